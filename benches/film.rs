//! The film: filters, sums, and the developed picture.

mod common;

use common::Uniforms;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Vec2, Vec3};
use kinora::description::{Filter, Layer, ToneMap};
use kinora::film::{Film, FilterSampler, FirstHit, PixelSample, Seen};
use kinora::output::develop;
use std::hint::black_box;

const SAMPLES: usize = 4096;

fn filter(c: &mut Criterion) {
    let mut uniforms = Uniforms::new(3);
    let points: Vec<Vec2> = (0..SAMPLES).map(|_| uniforms.square()).collect();
    let mut group = c.benchmark_group("film/filter");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    let filters = [
        ("box", Filter::Box { radius: 0.5 }),
        ("gaussian", Filter::Gaussian { sigma: 0.5, radius: 1.5 }),
        ("blackman_harris", Filter::BlackmanHarris { radius: 1.5 }),
    ];
    for (name, filter) in filters {
        let sampler = FilterSampler::new(&filter);
        group.bench_function(name, |b| {
            b.iter(|| black_box(&points).iter().map(|&u| sampler.sample(u)).sum::<Vec2>());
        });
    }
    group.finish();
}

fn pixel_samples() -> Vec<PixelSample> {
    let mut uniforms = Uniforms::new(5);
    let seen = |uniforms: &mut Uniforms| {
        let first_hit = FirstHit {
            albedo: uniforms.cube().abs(),
            normal: uniforms.direction(),
            depth: uniforms.one(),
            position: DVec3::ONE,
            object_id: 1 + (3.0 * uniforms.one()) as u32,
        };
        Seen { first_hit: Some(first_hit), motion: uniforms.square() }
    };
    (0..SAMPLES)
        .map(|_| PixelSample {
            radiance: uniforms.cube().abs(),
            seen: Some(seen(&mut uniforms)),
            ..PixelSample::default()
        })
        .collect()
}

/// One tile filled and merged: with the beauty alone, and with all that a film can hold.
fn accumulate(c: &mut Criterion) {
    use Layer::{Albedo, Beauty, Depth, Motion, Normal, ObjectId, Position, Samples, Variance};
    let samples = pixel_samples();
    let all = [Beauty, Albedo, Normal, Depth, Position, Motion, ObjectId, Samples, Variance];
    let mut group = c.benchmark_group("film/accumulate");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    for (case, layers) in [("beauty", &all[..1]), ("all_layers", &all[..])] {
        let mut film = Film::new((16, 16), layers).expect("a small film");
        let tile = film.tiles()[0];
        let width = (tile.x1 - tile.x0) as usize;
        let pixels = width * (tile.y1 - tile.y0) as usize;
        group.bench_function(BenchmarkId::new(case, SAMPLES), |b| {
            b.iter(|| {
                let mut buffer = film.tile_buffer(tile);
                for (k, sample) in black_box(&samples).iter().enumerate() {
                    let pixel = k * pixels / SAMPLES;
                    let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
                    buffer.add(tile.x0 + x, tile.y0 + y, sample);
                }
                film.merge(buffer);
            });
        });
    }
    group.finish();
}

fn tone_curves(c: &mut Criterion) {
    let mut uniforms = Uniforms::new(7);
    let colors: Vec<Vec3> = (0..SAMPLES).map(|_| uniforms.cube().abs() * 4.0).collect();
    let mut group = c.benchmark_group("film/develop");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    let curves = [
        ("srgb", ToneMap::Srgb),
        ("agx", ToneMap::Agx),
        ("aces", ToneMap::Aces),
        ("reinhard", ToneMap::Reinhard),
    ];
    for (name, curve) in curves {
        group.bench_function(name, |b| {
            let code = |&color: &Vec3| u32::from(develop(color, 0.0, curve)[0]);
            b.iter(|| black_box(&colors).iter().map(code).sum::<u32>());
        });
    }
    group.finish();
}

criterion_group!(benches, filter, accumulate, tone_curves);
criterion_main!(benches);
