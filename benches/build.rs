//! The build stage: trees over triangles and instances, and rays through them.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use kinora::build::bvh::{MeshTree, MeshTrees, SceneGeometry, TopLevel};
use kinora::description::BvhQuality;
use kinora::extract::Instances;
use kinora::frame::Simulation;
use std::hint::black_box;

type Points = fn(usize) -> Vec<Vec3>;
const CASES: [(&str, Points); 2] =
    [("scattered", common::scattered), ("clustered", common::clustered)];

fn mesh_tree(c: &mut Criterion) {
    let mut group = c.benchmark_group("build/mesh_tree");
    for (case, points) in CASES {
        for count in [1_000, 10_000, 100_000] {
            let mesh = common::triangles_at(&points(count));
            group.throughput(Throughput::Elements(count as u64));
            group.bench_with_input(BenchmarkId::new(case, count), &mesh, |b, mesh| {
                b.iter(|| MeshTree::build(black_box(mesh).clone(), BvhQuality::default()));
            });
        }
    }
    group.finish();
}

fn prepared(mut simulation: Simulation) -> Simulation {
    simulation.prepare_frame(0).expect("the world has a camera");
    simulation
}

fn geometry(simulation: &Simulation) -> SceneGeometry<'_> {
    let world = simulation.world();
    SceneGeometry {
        instances: &world.resource::<Instances>().list,
        meshes: &world.resource::<MeshTrees>().list,
        top: world.resource::<TopLevel>(),
    }
}

fn top_level(c: &mut Criterion) {
    let mut group = c.benchmark_group("build/top_level");
    let mesh = common::triangles_at(&common::scattered(100));
    for (case, points) in CASES {
        for count in [1_000, 10_000] {
            let simulation = prepared(common::world_of_instances(&mesh, &points(count), 0.05));
            let instances = &simulation.world().resource::<Instances>().list;
            group.throughput(Throughput::Elements(count as u64));
            group.bench_with_input(BenchmarkId::new(case, count), instances, |b, instances| {
                b.iter(|| TopLevel::build(black_box(instances)));
            });
        }
    }
    group.finish();
}

/// Rays through one mesh of many triangles, and through many instances of a mesh of few.
fn traversal(c: &mut Criterion) {
    const RAYS: usize = 1000;
    let rays = common::rays(RAYS);
    let small = common::triangles_at(&common::scattered(100));
    for (case, points) in CASES {
        let count = 100_000;
        let big = common::triangles_at(&points(count));
        let worlds = [
            ("triangles", count, common::world_of_instances(&big, &[Vec3::ZERO], 1.0)),
            ("instances", 1000, common::world_of_instances(&small, &points(1000), 0.05)),
        ];
        for (what, count, simulation) in worlds {
            let simulation = prepared(simulation);
            let geometry = geometry(&simulation);
            let id = BenchmarkId::new(case, count);
            let mut group = c.benchmark_group(format!("build/closest_hit/{what}"));
            group.throughput(Throughput::Elements(RAYS as u64));
            group.bench_function(id.clone(), |b| {
                let hits = |ray| geometry.closest_hit(ray, f64::INFINITY, true).is_some();
                b.iter(|| black_box(&rays).iter().filter(|ray| hits(ray)).count());
            });
            group.finish();
            let mut group = c.benchmark_group(format!("build/occluded/{what}"));
            group.throughput(Throughput::Elements(RAYS as u64));
            group.bench_function(id, |b| {
                let blocked = |ray| geometry.occluded(ray, f64::INFINITY);
                b.iter(|| black_box(&rays).iter().filter(|ray| blocked(ray)).count());
            });
            group.finish();
        }
    }
}

criterion_group!(benches, mesh_tree, top_level, traversal);
criterion_main!(benches);
