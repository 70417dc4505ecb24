//! What a frame costs before its first ray, by how many objects moved since the one before.

use crate::Options;
use crate::clock::{median, pool, process_seconds};
use crate::common;
use crate::report::{Report, section};
use bevy_ecs::prelude::*;
use glam::DVec3;
use kinora::frame::Simulation;
use kinora::world::{Shape, Transform};

/// Moves the first `count` shapes a little, to and fro.
fn shift(simulation: &mut Simulation, count: usize, frame: u32) {
    let world = simulation.world_mut();
    let mut shapes = world.query_filtered::<&mut Transform, With<Shape>>();
    let step = if frame.is_multiple_of(2) { 0.01 } else { -0.01 };
    for mut place in shapes.iter_mut(world).take(count) {
        place.translation += DVec3::X * step;
    }
}

/// Prepares frames over instances of one mesh: anew, and with none, one or all moved.
pub fn run(options: &Options, report: &mut Report) {
    let repetitions = if options.quick { 7 } else { 21 };
    section("frame: CPU-milliseconds before integration, by number of instances");
    let mesh = common::triangles_at(&common::scattered(1000));
    for count in [100, 1000, 10_000] {
        let points = common::scattered(count);
        let single = pool(1);
        let mut first = Vec::new();
        let mut moved = [const { Vec::new() }; 3];
        for _ in 0..repetitions / 3 {
            let mut simulation = common::world_of_instances(&mesh, &points, 0.05);
            let work = || single.install(|| simulation.prepare_frame(0));
            first.push(process_seconds(work).0 * 1e3);
        }
        let mut simulation = common::world_of_instances(&mesh, &points, 0.05);
        simulation.prepare_frame(0).expect("the world has a camera");
        for frame in 1..=repetitions {
            for (times, objects) in moved.iter_mut().zip([0, 1, count]) {
                shift(&mut simulation, objects, frame);
                let work = || single.install(|| simulation.prepare_frame(0));
                times.push(process_seconds(work).0 * 1e3);
            }
        }
        let [none, one, all] = moved.map(median);
        let first = median(first);
        report.row(
            &format!("frame.{count}"),
            &[
                ("first_ms", first, ""),
                ("none_moved_ms", none, ""),
                ("one_moved_ms", one, ""),
                ("all_moved_ms", all, ""),
                ("one_of_first", one / first, ""),
            ],
        );
    }
}
