//! The step stage: where everything is over the shutter.

mod common;

use bevy_ecs::prelude::*;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use kinora::frame::Simulation;
use kinora::step::sample_shutter;
use kinora::world::{ChildOf, FrameClock, Shape, Velocity};
use std::hint::black_box;

/// Spheres, of which every `moving_one_in`-th flies and turns.
fn spheres(count: usize, moving_one_in: usize) -> Simulation {
    let mut simulation = common::empty_world();
    let world = simulation.world_mut();
    for (k, p) in common::scattered(count).into_iter().enumerate() {
        let mut entity = world.spawn((Shape::Sphere { radius: 0.01 }, common::at(p)));
        if k % moving_one_in == moving_one_in - 1 {
            entity.insert(Velocity { linear: DVec3::X, angular: DVec3::new(0.0, 3.0, 1.0) });
        }
    }
    simulation
}

/// Chains of parents, each link turning: the most that the hierarchy can ask for.
fn chains(count: usize, links: usize) -> Simulation {
    let mut simulation = common::empty_world();
    let world = simulation.world_mut();
    for p in common::scattered(count / links) {
        let mut parent: Option<Entity> = None;
        for _ in 0..links {
            let turning = Velocity { linear: DVec3::ZERO, angular: DVec3::Z };
            let link = world.spawn((Shape::Sphere { radius: 0.01 }, common::at(p), turning)).id();
            if let Some(parent) = parent {
                world.entity_mut(link).insert(ChildOf(parent));
            }
            parent = Some(link);
        }
    }
    simulation
}

fn shutter(c: &mut Criterion) {
    const COUNT: usize = 1000;
    let mut group = c.benchmark_group("step/sample_shutter");
    group.throughput(Throughput::Elements(COUNT as u64));
    let cases = [
        ("static", spheres(COUNT, usize::MAX)),
        ("one_in_ten_moves", spheres(COUNT, 10)),
        ("all_move", spheres(COUNT, 1)),
        ("chains_of_ten", chains(COUNT, 10)),
    ];
    for (case, mut simulation) in cases {
        let mut frame = 0;
        group.bench_function(BenchmarkId::new(case, COUNT), |b| {
            b.iter(|| {
                frame = (frame + 1) % 48;
                let world = simulation.world_mut();
                world.resource_mut::<FrameClock>().frame = frame;
                sample_shutter(black_box(world));
            });
        });
    }
    group.finish();
}

criterion_group!(benches, shutter);
criterion_main!(benches);
