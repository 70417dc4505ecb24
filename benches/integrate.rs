//! The integrate stage: pixel samples per second on the scenes of the repository.
//!
//! The same frame again and again: after the first time the other stages find nothing to do.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use kinora::frame::{RenderControl, Simulation};

const SIZE: (u32, u32) = (64, 64);
const SAMPLES: u32 = 4;

fn path(c: &mut Criterion) {
    let mut group = c.benchmark_group("integrate/path");
    group.throughput(Throughput::Elements(u64::from(SIZE.0 * SIZE.1 * SAMPLES)));
    group.sample_size(20);
    // In frame 12 the ball is in the air and the knife in the middle of the picture.
    for (name, frame) in [("cornell", 0), ("ball", 12), ("moving", 12)] {
        let scene = common::scene(&format!("{name}.ron"), SIZE, SAMPLES);
        let mut simulation = Simulation::from_description(&scene);
        let control = RenderControl::default();
        group.bench_function(name, |b| {
            b.iter(|| simulation.render_frame(frame, &control).expect("the scene is valid"));
        });
    }
    group.finish();
}

/// One room, one power, ever more lamps: what choosing among them costs.
fn many_lights(c: &mut Criterion) {
    let mut group = c.benchmark_group("integrate/lights");
    group.throughput(Throughput::Elements(u64::from(SIZE.0 * SIZE.1 * SAMPLES)));
    group.sample_size(20);
    for count in [1, 100, 10_000] {
        let mut simulation = common::hall(count, SIZE, SAMPLES);
        let control = RenderControl::default();
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter(|| simulation.render_frame(0, &control).expect("the world is valid"));
        });
    }
    group.finish();
}

criterion_group!(benches, path, many_lights);
criterion_main!(benches);
