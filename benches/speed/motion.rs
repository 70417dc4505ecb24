//! What moving objects cost, and what the code for them costs a scene in which nothing moves.

use crate::Options;
use crate::clock::{median, pool, process_seconds};
use crate::common;
use crate::mesh_of;
use crate::meshes::RawMesh;
use crate::report::{Report, section};
use crate::shapes::{any, closest, geometry, times_in_turn};
use glam::{DVec3, Vec3};
use kinora::build::bvh::{SceneGeometry, TopLevel};
use kinora::extract::{Instance, Instances};
use kinora::frame::Simulation;
use kinora::world::{FrameClock, Shape, Transform, Velocity};
use std::sync::Arc;

/// Radius of a ball.
const RADIUS: f64 = 0.01;

/// Balls which go in every direction by so many radii while the shutter is open.
fn balls(count: usize, radii: f64) -> Simulation {
    let mut simulation = common::empty_world();
    let mut uniforms = common::Uniforms::new(23);
    let world = simulation.world_mut();
    let (open, close) = world.resource::<FrameClock>().shutter();
    let way = radii * RADIUS / (close - open);
    for p in common::scattered(count) {
        let linear = uniforms.direction().as_dvec3() * way;
        let place = Transform {
            translation: p.as_dvec3() - linear * (0.5 * (close - open)),
            ..Default::default()
        };
        let velocity = Velocity { linear, ..Default::default() };
        world.spawn((Shape::Sphere { radius: RADIUS }, place, velocity));
    }
    simulation.prepare_frame(0).expect("the world has a camera");
    simulation
}

/// Balls by segments of the shutter and by their whole way.
fn segments(options: &Options, report: &mut Report) {
    let (count, repetitions) = if options.quick { (50_000, 5) } else { (200_000, 9) };
    let rays = common::rays(count);
    for radii in [1_u8, 4, 50] {
        let simulation = balls(1000, f64::from(radii));
        let instances = &simulation.world().resource::<Instances>().list;
        let single = pool(1);
        let seconds = |build: fn(&[Instance]) -> TopLevel| {
            let once = || single.install(|| process_seconds(|| build(instances)).0 * 1e3);
            median((0..repetitions).map(|_| once()).collect())
        };
        let (built, built_whole) = (seconds(TopLevel::build), seconds(TopLevel::without_segments));
        let whole = TopLevel::without_segments(instances);
        let by_segments = geometry(&simulation);
        let before = SceneGeometry { top: &whole, ..by_segments };
        let ways = [&by_segments, &before];
        let [closest, closest_whole] = times_in_turn(ways, &rays, closest, repetitions);
        let [any, any_whole] = times_in_turn(ways, &rays, any, repetitions);
        report.row(
            &format!("motion.radii.{radii}"),
            &[
                ("segments", by_segments.top.segments() as f64, ""),
                ("closest", closest, ""),
                ("closest_ratio", closest / closest_whole, ""),
                ("any", any, ""),
                ("any_ratio", any / any_whole, ""),
                ("build_ms", built, ""),
                ("build_whole_ms", built_whole, ""),
            ],
        );
    }
}

/// Instances of a mesh, boxes and balls at rest, through the code for both kinds of scenes.
fn at_rest(options: &Options, report: &mut Report) {
    let (count, repetitions) = if options.quick { (20_000, 15) } else { (50_000, 41) };
    let rays = common::rays(count);
    let ball = Arc::new(mesh_of(RawMesh::icosphere(2)));
    let points = common::scattered(1000);
    let meshes = common::world_of_instances(&ball, &points, 0.04);
    let mut shapes = common::empty_world();
    for (k, &p) in points.iter().enumerate() {
        let shape = match k % 3 {
            0 => Shape::Sphere { radius: 0.03 },
            1 => Shape::Box { size: DVec3::splat(0.05) },
            _ => Shape::Cylinder { radius: 0.02, height: 0.05, capped: true },
        };
        shapes.world_mut().spawn((shape, common::at(p)));
    }
    let few = common::world_of_instances(&ball, &[Vec3::ZERO], 1.0);
    let mut logs = 0.0;
    let mut values = Vec::new();
    let names = ["meshes", "meshes_any", "shapes", "shapes_any", "few", "few_any"];
    for mut simulation in [meshes, shapes, few] {
        simulation.prepare_frame(0).expect("the world has a camera");
        let without = geometry(&simulation);
        let mut top = without.top.clone();
        top.assume_motion();
        // A copy too, so that both lie in memory of the same kind.
        let still = without.top.clone();
        let with = SceneGeometry { top: &top, ..without };
        let without = SceneGeometry { top: &still, ..without };
        for way in [closest, any] {
            let [with, without] = times_in_turn([&with, &without], &rays, way, repetitions);
            values.push((names[values.len()], with / without, ""));
            logs += (with / without).ln();
        }
    }
    values.insert(0, ("static_ratio", (logs / values.len() as f64).exp(), ""));
    report.row("motion", &values);
}

/// Both.
pub fn run(options: &Options, report: &mut Report) {
    section(
        "motion: ns per ray, balls by segments of the shutter against boxes of their whole ways",
    );
    segments(options, report);
    section("motion: a scene at rest, time with the code for motion by time without it");
    at_rest(options, report);
}
