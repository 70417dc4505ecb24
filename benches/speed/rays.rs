//! Rays per second through the tree of a mesh: this crate's, and the eight-fold compressed tree of
//! `obvhs` (its medium build) as a yardstick.
//!
//! Two scenes of a million triangles: hills with blobs, and a closed room with slanted beams and
//! blobs. Rays from the camera in tiles, two bounces by a cosine, and from where the first two of
//! these end to a light with an area.

use crate::clock::{median, pool, process_seconds, thread_seconds};
use crate::meshes::{RawMesh, Uniforms};
use crate::report::{Report, section};
use crate::{Options, mesh_of};
use glam::{DVec3, Vec3, Vec3A};
use kinora::build::bvh::WideTree;
use kinora::description::{BvhQuality, TriangleMesh};
use kinora::shape::LocalRay;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::{BvhBuildParams, triangle::Triangle};
use rayon::prelude::*;
use std::time::Duration;

/// A ray with its end.
type Segment = (Vec3, Vec3, f32);

/// A way to trace: the distance of the nearest hit, or 1 for any.
type Way = fn(&Trees, Segment) -> f32;

/// Both trees.
struct Trees {
    mesh: TriangleMesh,
    wide: WideTree,
    compressed: CwBvh,
    /// In the order of the compressed tree.
    triangles: Vec<Triangle>,
}

/// The corners of a triangle.
fn corners(mesh: &TriangleMesh, triangle: u32) -> [Vec3; 3] {
    mesh.triangles[triangle as usize].map(|k| mesh.positions[k as usize])
}

/// The tree of `obvhs`, with its triangles in its order.
pub fn compressed_tree(mesh: &TriangleMesh) -> (CwBvh, Vec<Triangle>) {
    let list: Vec<Triangle> = (0..mesh.triangles.len() as u32)
        .map(|k| {
            let [a, b, c] = corners(mesh, k);
            Triangle { v0: a.into(), v1: b.into(), v2: c.into() }
        })
        .collect();
    let tree =
        build_cwbvh_from_tris(&list, BvhBuildParams::medium_build(), &mut Duration::default());
    let order = tree.primitive_indices.iter().map(|&k| list[k as usize]).collect();
    (tree, order)
}

impl Trees {
    fn build(mesh: TriangleMesh) -> Self {
        let wide = WideTree::build(&mesh, BvhQuality::Balanced);
        let (compressed, triangles) = compressed_tree(&mesh);
        Self { mesh, wide, compressed, triangles }
    }

    fn closest_wide(&self, (o, d, end): Segment) -> f32 {
        let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
        self.wide.closest_hit(&ray, f64::from(end)).map_or(f32::INFINITY, |hit| hit.t as f32)
    }

    fn closest_compressed(&self, (o, d, end): Segment) -> f32 {
        let ray = Ray::new(Vec3A::from(o), Vec3A::from(d), 0.0, end);
        let mut hit = RayHit::none();
        let met =
            self.compressed.ray_traverse(ray, &mut hit, |ray, k| self.triangles[k].intersect(ray));
        if met { hit.t } else { f32::INFINITY }
    }

    fn any_wide(&self, (o, d, end): Segment) -> f32 {
        let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
        f32::from(self.wide.any_hit(&ray, f64::from(end)))
    }

    fn any_compressed(&self, (o, d, end): Segment) -> f32 {
        let ray = Ray::new(Vec3A::from(o), Vec3A::from(d), 0.0, end);
        let hit = |ray: &Ray, k: usize| self.triangles[k].intersect(ray);
        f32::from(!self.compressed.ray_traverse_miss(ray, hit))
    }

    /// Rays by a cosine around the normal from where `rays` end, and segments from there to a light.
    fn onward(&self, rays: &[Segment], light: Vec3, seed: u64) -> (Vec<Segment>, Vec<Segment>) {
        let mut u = Uniforms(seed);
        let (mut bounced, mut shadows) = (Vec::new(), Vec::new());
        for &(o, d, end) in rays {
            let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
            let Some(hit) = self.wide.closest_hit(&ray, f64::from(end)) else { continue };
            let [a, b, c] = corners(&self.mesh, hit.triangle).map(Vec3::as_dvec3);
            let n = (b - a).cross(c - a).normalize();
            let n = if n.dot(ray.d) > 0.0 { -n } else { n };
            let p: DVec3 = ray.at(hit.t) + n * 1e-6;
            let (p, n) = (p.as_vec3(), n.as_vec3());
            bounced.push((p, (n + u.direction() * 0.999).normalize(), f32::INFINITY));
            shadows.push((p, light + (u.three() - 0.5) * 0.2 - p, 0.9999));
        }
        (bounced, shadows)
    }

    /// CPU-seconds of tracing all of `rays`, and how many hits are neither near nor missing.
    fn trace(&self, way: Way, rays: &[Segment], threads: &rayon::ThreadPool) -> (f64, usize) {
        let far = |&ray: &Segment| (0.5..1e30).contains(&way(self, ray));
        if threads.current_num_threads() == 1 {
            return thread_seconds(|| rays.iter().filter(|ray| far(ray)).count());
        }
        let chunk = |rays: &[Segment]| rays.iter().filter(|ray| far(ray)).count();
        process_seconds(|| threads.install(|| rays.par_chunks(4096).map(chunk).sum()))
    }

    /// Millions of rays per CPU-second by all ways in turn, as medians.
    fn rates(
        &self,
        ways: [Way; 2],
        rays: &[Segment],
        repetitions: usize,
        threads: usize,
    ) -> [f64; 2] {
        let threads = pool(threads);
        let mut times = [const { Vec::new() }; 2];
        let mut hits = [0; 2];
        for _ in 0..repetitions {
            for ((way, times), hits) in ways.iter().zip(&mut times).zip(&mut hits) {
                let (time, count) = self.trace(*way, rays, &threads);
                times.push(time);
                *hits = count;
            }
        }
        // The yardstick rounds to `f32`: a few rays meet the surface that they leave.
        let off = hits[0].abs_diff(hits[1]);
        assert!(off * 100 <= rays.len(), "the trees disagree: {hits:?} of {}", rays.len());
        times.map(|times| rays.len() as f64 * 1e-6 / median(times))
    }
}

/// Rays through a square of pixels, in tiles of 16 × 16.
fn primary(side: u32, eye: Vec3, target: Vec3) -> Vec<Segment> {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let pixel = |k: u32| {
        let (tile, inside) = (k / 256, k % 256);
        let x = tile % (side / 16) * 16 + inside % 16;
        let y = tile / (side / 16) * 16 + inside / 16;
        let at = |v: u32| v as f32 / side as f32 - 0.5;
        (eye, (forward + right * at(x) + up * at(y)).normalize(), f32::INFINITY)
    };
    (0..side * side).map(pixel).collect()
}

/// A scene: its name, its mesh, from where and to where the camera looks, and where the light is.
type Scene = (&'static str, RawMesh, Vec3, Vec3, Vec3);

/// The two scenes.
fn scenes() -> [Scene; 2] {
    let v = Vec3::new;
    let terrain = RawMesh::terrain(447, 810, 8);
    let interior = RawMesh::room(600, 278, 17);
    [
        ("terrain", terrain, v(-0.1, 0.6, -0.1), v(0.5, 0.0, 0.5), v(0.5, 1.5, 0.5)),
        ("interior", interior, v(0.1, 0.5, 0.1), v(0.7, 0.4, 0.8), v(0.5, 0.85, 0.5)),
    ]
}

/// Rays per CPU-second through trees of every quality, in turn.
pub fn rates_by_quality(options: &Options, report: &mut Report) {
    let repetitions = if options.quick { 3 } else { 7 };
    for (name, raw, eye, target, _) in scenes() {
        let mesh = mesh_of(raw);
        let trees = BvhQuality::ALL.map(|quality| WideTree::build(&mesh, quality));
        let rays = primary(512, eye, target);
        let mut times = [const { Vec::new() }; 3];
        for _ in 0..repetitions {
            for (tree, times) in trees.iter().zip(&mut times) {
                let hit = |&&(o, d, _): &&Segment| {
                    let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
                    tree.closest_hit(&ray, f64::INFINITY).is_some()
                };
                times.push(thread_seconds(|| rays.iter().filter(hit).count()).0);
            }
        }
        let [fast, balanced, best] = times.map(|times| rays.len() as f64 * 1e-6 / median(times));
        report.row(
            &format!("build.rays.{name}"),
            &[("fast", fast, ""), ("balanced", balanced, ""), ("best", best, "")],
        );
    }
}

/// Measures both scenes.
pub fn run(options: &Options, report: &mut Report) {
    let (side, repetitions) = if options.quick { (512, 3) } else { (1024, 7) };
    section("rays: Mrays per CPU-second through a million triangles");
    for (name, raw, eye, target, light) in scenes() {
        let trees = Trees::build(mesh_of(raw));
        let primary = primary(side, eye, target);
        let (bounce1, shadow1) = trees.onward(&primary, light, 1);
        let (bounce2, shadow2) = trees.onward(&bounce1, light, 2);
        let closest: [Way; 2] = [Trees::closest_wide, Trees::closest_compressed];
        let any: [Way; 2] = [Trees::any_wide, Trees::any_compressed];
        let sets = [
            ("primary", &primary, closest),
            ("bounce1", &bounce1, closest),
            ("bounce2", &bounce2, closest),
            ("shadow1", &shadow1, any),
            ("shadow2", &shadow2, any),
        ];
        for (threads, prefix) in [(1, "rays"), (2, "rays_2_threads")] {
            let mut logs = 0.0;
            for (kind, rays, ways) in sets {
                let [kinora, obvhs] = trees.rates(ways, rays, repetitions, threads);
                logs += (kinora / obvhs).ln();
                report.row(
                    &format!("{prefix}.{name}.{kind}"),
                    &[("kinora", kinora, ""), ("obvhs", obvhs, ""), ("ratio", kinora / obvhs, "")],
                );
            }
            let mean = (logs / sets.len() as f64).exp();
            report.row(&format!("{prefix}.{name}"), &[("mean_ratio", mean, "")]);
        }
    }
}
