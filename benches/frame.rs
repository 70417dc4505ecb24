//! A whole small frame, and what a scene pays only when it asks for it.

mod common;

use bevy_ecs::prelude::*;
use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec3, Vec3};
use kinora::description::{Attenuation, EmissionStrength, RenderSettings, Rgb};
use kinora::frame::{RenderControl, Simulation};
use kinora::world::{Camera, Emission, MadeOf, Material, Settings, Shape, Velocity};
use std::hint::black_box;

/// A frame without its picture: what is done before the integration starts.
///
/// 10,000 instances of a mesh. `first` is a full build; then the frames after it in which nothing moves,
/// one instance moves, all move, the camera moves.
fn prepare(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame/prepare");
    group.sample_size(20);
    let mesh = common::triangles_at(&common::scattered(100));
    let world = || common::world_of_instances(&mesh, &common::scattered(INSTANCES), 0.02);
    group.bench_function("first", |b| {
        b.iter_batched(
            world,
            |mut simulation| simulation.prepare_frame(0).expect("the world has a camera"),
            criterion::BatchSize::PerIteration,
        );
    });
    for (case, moving) in [("nothing_moves", 0), ("one_moves", 1), ("all_move", INSTANCES)] {
        let mut simulation = world();
        let world = simulation.world_mut();
        let mut shapes = world.query_filtered::<Entity, With<Shape>>();
        let shapes: Vec<Entity> = shapes.iter(world).take(moving).collect();
        for shape in shapes {
            world.entity_mut(shape).insert(velocity());
        }
        next_frames(&mut group, case, simulation);
    }
    let mut simulation = world();
    let world = simulation.world_mut();
    let camera = world.query_filtered::<Entity, With<Camera>>().single(world);
    let camera = camera.expect("the world has one camera");
    world.entity_mut(camera).insert(velocity());
    next_frames(&mut group, "camera_moves", simulation);
    group.finish();
}

const INSTANCES: usize = 10_000;

fn velocity() -> Velocity {
    Velocity { linear: DVec3::X * 0.1, angular: DVec3::ZERO }
}

fn next_frames(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    case: &str,
    mut simulation: Simulation,
) {
    simulation.prepare_frame(0).expect("the world has a camera");
    let mut frame = 0;
    group.bench_function(case, |b| {
        b.iter(|| {
            frame = (frame + 1) % 48;
            simulation.prepare_frame(black_box(frame)).expect("the world has a camera");
        });
    });
}

/// A scene from its description to its picture, and its next frame.
fn ball(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame/ball");
    group.sample_size(20);
    let scene = common::scene("ball.ron", (64, 36), 4);
    let control = RenderControl::default();
    group.bench_function("first", |b| {
        b.iter(|| {
            let mut simulation = Simulation::from_description(black_box(&scene));
            simulation.render_frame(0, &control).expect("the scene is valid")
        });
    });
    let mut simulation = Simulation::from_description(&scene);
    let mut frame = 0;
    group.bench_function("next", |b| {
        b.iter(|| {
            frame = (frame + 1) % 48;
            simulation.render_frame(frame, &control).expect("the scene is valid")
        });
    });
    group.finish();
}

/// Spheres of one material before a camera and below a lamp.
fn spheres(material: Material, lace: bool) -> Simulation {
    let mut simulation = common::empty_world();
    let world = simulation.world_mut();
    let settings = RenderSettings { size: (64, 36), samples: 4, ..Default::default() };
    world.insert_resource(Settings(settings));
    let mut material = world.spawn(material).id();
    if lace {
        material = world.spawn(Material::Masked { material, opacity: 0.5.into() }).id();
    }
    for p in common::scattered(200) {
        let place = common::at(p * 2.0 - 4.0 * Vec3::Z);
        world.spawn((Shape::Sphere { radius: 0.2 }, MadeOf(material), place));
    }
    let strength = EmissionStrength::Radiance(Vec3::splat(10.0).into());
    let lamp = Emission { strength, two_sided: false };
    world.spawn((Shape::Sphere { radius: 1.0 }, lamp, common::at(Vec3::Y * 5.0)));
    simulation
}

/// The same geometry with and without surfaces with holes, with and without absorption inside.
fn features(c: &mut Criterion) {
    let glass = |attenuation| Material::Dielectric {
        ior: 1.5,
        dispersion: None,
        roughness: 0.0.into(),
        tint: Vec3::ONE.into(),
        attenuation,
        absorption: None,
        scattering: None,
        emission: Rgb::ZERO,
        density: 1.0.into(),
        priority: 0,
    };
    let amber = Attenuation { color: Vec3::new(0.9, 0.6, 0.2), distance: 0.2 };
    let diffuse = || Material::Diffuse { albedo: Vec3::splat(0.6).into() };
    let cases = [
        ("opaque", spheres(diffuse(), false)),
        ("lace", spheres(diffuse(), true)),
        ("clear_glass", spheres(glass(None), false)),
        ("amber_glass", spheres(glass(Some(amber)), false)),
    ];
    let mut group = c.benchmark_group("frame/features");
    group.sample_size(20);
    let control = RenderControl::default();
    for (case, mut simulation) in cases {
        group.bench_function(case, |b| {
            b.iter(|| simulation.render_frame(0, &control).expect("the world has a camera"));
        });
    }
    group.finish();
}

criterion_group!(benches, prepare, ball, features);
criterion_main!(benches);
