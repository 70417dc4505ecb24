//! The shade stage: sampling and evaluating materials, looking textures up.

mod common;

use common::Uniforms;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use kinora::description::{
    Channel, Encoding, GridData, ImageData, ImagePixels, Material, Metal, Rgb, Texture,
    TextureFilter, TextureFiltering, Wrap,
};
use kinora::shade::{MaterialTable, Pyramids, TexturePoint, Textures, TransportMode};
use std::hint::black_box;
use std::sync::Arc;

const COUNT: usize = 1000;

/// The materials by name; parameters as they are common in scenes.
fn materials() -> Vec<(&'static str, Material<u32>)> {
    let orange = Vec3::new(0.8, 0.32, 0.04);
    let gold = |roughness: f32| Material::Conductor {
        metal: Some(Metal::Gold),
        f0: None,
        eta: None,
        k: None,
        roughness: roughness.into(),
    };
    let glass = |roughness: f32| Material::Dielectric {
        ior: 1.5,
        dispersion: None,
        roughness: roughness.into(),
        tint: Vec3::ONE.into(),
        attenuation: None,
        absorption: None,
        scattering: None,
        emission: Rgb::ZERO,
        density: 1.0.into(),
        priority: 0,
    };
    vec![
        ("diffuse", Material::Diffuse { albedo: orange.into() }),
        ("glass", glass(0.0)),
        ("rough_glass", glass(0.4)),
        ("metal", gold(0.0)),
        ("rough_metal", gold(0.4)),
        ("plastic", Material::Plastic { albedo: orange.into(), ior: 1.5, roughness: 0.0.into() }),
        (
            "rough_plastic",
            Material::Plastic { albedo: orange.into(), ior: 1.5, roughness: 0.3.into() },
        ),
        (
            "principled",
            Material::Principled {
                base_color: orange.into(),
                metallic: 0.3.into(),
                roughness: 0.5.into(),
                ior: 1.5,
                transmission: 0.0.into(),
            },
        ),
    ]
}

/// A direction to the viewer, one to a light, and three uniforms.
fn inputs() -> Vec<(Vec3, Vec3, f32, Vec2)> {
    let mut uniforms = Uniforms::new(3);
    let above = |d: Vec3| d.with_z(d.z.abs().max(0.05)).normalize();
    (0..COUNT)
        .map(|_| {
            let (wo, wi) = (above(uniforms.direction()), above(uniforms.direction()));
            (wo, wi, uniforms.one(), uniforms.square())
        })
        .collect()
}

/// From the table to a direction, as a path does it.
fn sample(c: &mut Criterion) {
    let inputs = inputs();
    let mut group = c.benchmark_group("shade/sample");
    group.throughput(Throughput::Elements(COUNT as u64));
    for (name, material) in materials() {
        let table = MaterialTable::new(&[material], Textures::default());
        group.bench_function(name, |b| {
            b.iter(|| {
                let drawn = inputs.iter().filter_map(|&(wo, _, mut lobe, u)| {
                    let bsdf = table.bsdf(0, &TexturePoint::at(u), &mut lobe);
                    bsdf.sample(black_box(wo), lobe, u, TransportMode::Radiance)
                });
                drawn.map(|sample| sample.weight).sum::<Vec3>()
            });
        });
    }
    group.finish();
}

/// From the table to a value; materials of deltas alone are zero and not asked.
fn evaluate(c: &mut Criterion) {
    let inputs = inputs();
    let mut group = c.benchmark_group("shade/evaluate");
    group.throughput(Throughput::Elements(COUNT as u64));
    for (name, material) in materials() {
        let table = MaterialTable::new(&[material], Textures::default());
        if !table.bsdf(0, &TexturePoint::at(Vec2::ZERO), &mut 0.5).has_non_delta() {
            continue;
        }
        group.bench_function(name, |b| {
            b.iter(|| {
                let values = inputs.iter().map(|&(wo, wi, mut lobe, u)| {
                    let bsdf = table.bsdf(0, &TexturePoint::at(u), &mut lobe);
                    bsdf.evaluate(black_box(wo), wi, TransportMode::Radiance).f_cos
                });
                values.sum::<Vec3>()
            });
        });
    }
    group.finish();
}

fn image(
    pixels: ImagePixels,
    filter: TextureFilter,
) -> Texture<Arc<ImageData>, Arc<GridData>, u32> {
    Texture::Image {
        file: Arc::new(ImageData { width: 1024, height: 1024, pixels }),
        encoding: Encoding::Srgb,
        wrap: Wrap::Repeat,
        filter,
        channel: Channel::Luminance,
        repeat: Vec2::splat(3.0),
        offset: Vec2::ZERO,
    }
}

/// Everywhere in the image: the memory is part of it.
fn texture(c: &mut Criterion) {
    let size = 1024 * 1024;
    let codes = || ImagePixels::Rgba8(vec![[90, 120, 200, 255]; size], Encoding::Srgb);
    let floats = || ImagePixels::Rgba32F(vec![[0.1, 0.2, 0.6, 1.0]; size]);
    let checker = Texture::Checker { size: 0.1, a: Vec3::ONE.into(), b: Vec3::ZERO.into() };
    let cases = [
        ("checker", checker),
        ("bytes_bilinear", image(codes(), TextureFilter::Bilinear)),
        ("bytes_nearest", image(codes(), TextureFilter::Nearest)),
        ("floats_bilinear", image(floats(), TextureFilter::Bilinear)),
    ];
    let mut uniforms = Uniforms::new(5);
    let places: Vec<TexturePoint> =
        (0..COUNT).map(|_| TexturePoint::at(uniforms.square())).collect();
    let mut group = c.benchmark_group("shade/texture");
    group.throughput(Throughput::Elements(COUNT as u64));
    for (name, texture) in cases {
        let textures =
            Textures::new(vec![texture], TextureFiltering::Anisotropic, &Pyramids::default());
        group.bench_function(name, |b| {
            b.iter(|| black_box(&places).iter().map(|at| textures.color(0, at)).sum::<Vec3>());
        });
    }
    group.finish();
}

criterion_group!(benches, sample, evaluate, texture);
criterion_main!(benches);
