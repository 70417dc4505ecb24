//! The extract stage: from the world to flat arrays.

mod common;

use bevy_ecs::prelude::*;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use kinora::extract::{
    derive_requirements, extract_camera, extract_emissions, extract_instances, extract_lights,
    extract_meshes, extract_surfaces,
};
use kinora::frame::Simulation;
use kinora::step::sample_shutter;
use kinora::world::{FrameClock, Material, Shape, Velocity};
use std::hint::black_box;
use std::time::{Duration, Instant};

const COUNT: usize = 1000;

/// Spheres with a material each, of which every `moving_one_in`-th flies.
fn spheres(moving_one_in: usize) -> Simulation {
    let mut simulation = common::empty_world();
    let world = simulation.world_mut();
    for (k, p) in common::scattered(COUNT).into_iter().enumerate() {
        let material = Material::Diffuse { albedo: p.abs().into() };
        let mut entity = world.spawn((Shape::Sphere { radius: 0.01 }, material, common::at(p)));
        if k % moving_one_in == moving_one_in - 1 {
            entity.insert(Velocity { linear: DVec3::X, angular: DVec3::ZERO });
        }
    }
    simulation
}

/// The systems of the stage, in its order.
fn stage() -> Schedule {
    let mut stage = Schedule::default();
    stage.add_systems(
        (
            extract_camera,
            extract_surfaces,
            extract_emissions,
            extract_meshes,
            extract_instances,
            extract_lights,
            derive_requirements,
        )
            .chain(),
    );
    stage
}

/// From one frame to the next, the step stage untimed. A world of which nothing moves shows what
/// looking for changes costs.
fn next_frame(c: &mut Criterion) {
    let mut group = c.benchmark_group("extract/next_frame");
    group.throughput(Throughput::Elements(COUNT as u64));
    for (case, one_in) in [("static", usize::MAX), ("one_in_ten_moves", 10), ("all_move", 1)] {
        let mut simulation = spheres(one_in);
        let mut stage = stage();
        let world = simulation.world_mut();
        sample_shutter(world);
        stage.run(world);
        group.bench_function(BenchmarkId::new(case, COUNT), |b| {
            b.iter_custom(|frames| {
                let mut spent = Duration::ZERO;
                for frame in 0..frames {
                    world.resource_mut::<FrameClock>().frame = frame as i32 % 48;
                    sample_shutter(world);
                    let start = Instant::now();
                    stage.run(black_box(world));
                    spent += start.elapsed();
                }
                spent
            });
        });
    }
    group.finish();
}

/// A schedule which has never run sees everything as changed.
fn first_frame(c: &mut Criterion) {
    let mut group = c.benchmark_group("extract/first_frame");
    group.throughput(Throughput::Elements(COUNT as u64));
    let mut simulation = spheres(1);
    let world = simulation.world_mut();
    sample_shutter(world);
    group.bench_function(BenchmarkId::new("all_new", COUNT), |b| {
        b.iter_custom(|times| {
            let mut spent = Duration::ZERO;
            for _ in 0..times {
                let mut stage = stage();
                let initialised = stage.initialize(world);
                assert!(initialised.is_ok());
                let start = Instant::now();
                stage.run(black_box(world));
                spent += start.elapsed();
            }
            spent
        });
    });
    group.finish();
}

criterion_group!(benches, next_frame, first_frame);
criterion_main!(benches);
