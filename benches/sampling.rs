//! Random streams, warps and tabulated distributions.

mod common;

use common::Uniforms;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec2;
use kinora::sampling::{Piecewise1D, Piecewise2D, Sampler, dimension, warp};
use std::hint::black_box;

const COUNT: u32 = 1000;

fn stream(c: &mut Criterion) {
    let mut group = c.benchmark_group("sampling/sampler");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    let of_index = |index| Sampler::new(black_box(1), 0, (100, 50), index);
    group.bench_function("one", |b| {
        b.iter(|| (0..COUNT).map(|k| of_index(k).one(dimension::TIME)).sum::<f32>());
    });
    group.bench_function("two", |b| {
        b.iter(|| (0..COUNT).map(|k| of_index(k).two(dimension::FILM)).sum::<Vec2>());
    });
    // All that a surface on a path may ask for.
    group.bench_function("vertex", |b| {
        b.iter(|| {
            let vertex = |k| {
                let (sampler, at) = (of_index(k), dimension::vertex(k % 8));
                let alone = sampler.one(at + dimension::LOBE)
                    + sampler.one(at + dimension::LIGHT)
                    + sampler.one(at + dimension::ROULETTE);
                let (direction, point) = sampler.four(at + dimension::DIRECTION_AND_LIGHT_POINT);
                alone + direction.element_sum() + point.element_sum()
            };
            (0..COUNT).map(vertex).sum::<f32>()
        });
    });
    group.finish();
}

fn points() -> Vec<Vec2> {
    let mut uniforms = Uniforms::new(3);
    (0..COUNT).map(|_| uniforms.square()).collect()
}

fn warps(c: &mut Criterion) {
    let points = points();
    let mut group = c.benchmark_group("sampling/warp");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    group.bench_function("disk", |b| {
        b.iter(|| black_box(&points).iter().map(|&u| warp::square_to_disk(u)).sum::<Vec2>());
    });
    group.bench_function("cosine_hemisphere", |b| {
        b.iter(|| black_box(&points).iter().map(|&u| warp::cosine_hemisphere(u).z).sum::<f32>());
    });
    group.finish();
}

/// A table over lights, and one over an environment map with a sun in it.
fn tables(c: &mut Criterion) {
    let points = points();
    let mut uniforms = Uniforms::new(5);
    let lights = Piecewise1D::new((0..10_000).map(|_| f64::from(uniforms.one())));
    let sun = |x: usize, y: usize| if (x, y) == (300, 100) { 1e5 } else { 1.0 };
    let sky = Piecewise2D::new(1024, 512, sun);
    let mut group = c.benchmark_group("sampling/table");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    group.bench_function("lights", |b| {
        b.iter(|| {
            black_box(&points).iter().map(|u| lights.sample(f64::from(u.x)).0).sum::<usize>()
        });
    });
    group.bench_function("sky", |b| {
        b.iter(|| black_box(&points).iter().map(|&u| sky.sample(u).1).sum::<f32>());
    });
    group.bench_function("sky_pdf", |b| {
        b.iter(|| black_box(&points).iter().map(|&p| sky.pdf(p)).sum::<f32>());
    });
    group.finish();
}

criterion_group!(benches, stream, warps, tables);
criterion_main!(benches);
