//! How the time of a ray grows with the number of objects and of triangles.
//!
//! The things become smaller as they become more, so that a line through the scene meets equally many
//! on average: n things of cross-section A in a volume V are met n·A·L/V times along a length L, so
//! their size goes with n^(−1/2).

use crate::Options;
use crate::clock::{median, thread_seconds};
use crate::common;
use crate::mesh_of;
use crate::meshes::RawMesh;
use crate::report::{Report, section};
use glam::Vec3;
use kinora::build::bvh::{MeshTrees, SceneGeometry, TopLevel};
use kinora::extract::Instances;
use kinora::frame::Simulation;
use kinora::math::Ray;
use std::sync::Arc;

/// Nanoseconds of a thread per ray.
fn time_per_ray(mut simulation: Simulation, rays: &[Ray], repetitions: usize) -> (f64, f64) {
    simulation.prepare_frame(0).expect("the world has a camera");
    let world = simulation.world();
    let geometry = SceneGeometry {
        instances: &world.resource::<Instances>().list,
        meshes: &world.resource::<MeshTrees>().list,
        top: world.resource::<TopLevel>(),
    };
    let mut hits = 0;
    let mut times = Vec::new();
    for _ in 0..repetitions {
        let trace = || {
            let hit = |ray: &&Ray| geometry.closest_hit(ray, f64::INFINITY, true).is_some();
            rays.iter().filter(hit).count()
        };
        let (time, count) = thread_seconds(trace);
        times.push(time * 1e9 / rays.len() as f64);
        hits = count;
    }
    (median(times), hits as f64 / rays.len() as f64)
}

/// Instances of a ball, and triangles of one mesh, in the cube `[−1, 1]³`.
pub fn run(options: &Options, report: &mut Report) {
    let (count, repetitions) = if options.quick { (100_000, 3) } else { (400_000, 5) };
    let rays = common::rays(count);
    section("growth: nanoseconds per ray at equal depth complexity");
    let mut rows = |what: &str, counts: [usize; 3], world: &dyn Fn(usize) -> Simulation| {
        let mut first = None;
        for n in counts {
            let (time, share) = time_per_ray(world(n), &rays, repetitions);
            let first = *first.get_or_insert(time);
            report.row(
                &format!("growth.{what}.{n}"),
                &[("ns_per_ray", time, ""), ("growth", time / first, ""), ("hit_share", share, "")],
            );
        }
    };
    let ball = Arc::new(mesh_of(RawMesh::icosphere(2)));
    rows("instances", [100, 1000, 10_000], &|n| {
        common::world_of_instances(&ball, &common::scattered(n), 1.2 / (n as f64).sqrt())
    });
    // The same eight blobs, in ever smaller triangles.
    rows("triangles", [10_000, 100_000, 1_000_000], &|n| {
        let detail = (n as f32 / (8.0 * 12.0)).sqrt().round() as u32;
        let mut blobs = RawMesh::default();
        for (k, p) in (0..).zip(common::scattered(8)) {
            blobs.add(&RawMesh::blob(detail, p, 0.4, k));
        }
        common::world_of_instances(&Arc::new(mesh_of(blobs)), &[Vec3::ZERO], 1.0)
    });
}
