//! Rays per second through the tree of a mesh: this crate's, the plain binary tree, and the eight-fold
//! compressed tree of `obvhs` (its medium build) as a yardstick.
//!
//! One thread, all trees in turn for each set of rays, medians over the repetitions. Run it by
//! `cargo bench --bench kernel`; `-- --quick` takes smaller meshes and fewer rays.

use glam::{DVec3, Vec3, Vec3A};
use kinora::build::bvh::{Bvh, WideTree};
use kinora::description::TriangleMesh;
use kinora::math::Aabb;
use kinora::shape::{LocalRay, TriangleTest};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::time::{Duration, Instant};

#[expect(dead_code, reason = "shared with tests, which need more of it")]
#[path = "../src/build/bvh/wide/meshes.rs"]
mod meshes;
use meshes::{RawMesh, Uniforms};

/// Budget for cutting triangles, as for the meshes of a scene.
const SPLIT_BUDGET: f32 = 0.1;

/// Times a piece of work that one thread does, in seconds of that thread where the system tells them.
fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    // Nanoseconds on a processor come first.
    let spent = || -> Option<f64> {
        let line = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    };
    let (start, before) = (Instant::now(), spent());
    let result = work();
    let wall = start.elapsed().as_secs_f64();
    (before.zip(spent()).map_or(wall, |(a, b)| b - a), result)
}

/// A ray with its end.
type Segment = (Vec3, Vec3, f32);

/// A way to trace: the distance of the nearest hit, or 1 for any.
type Way = fn(&Trees, Segment) -> f32;

/// The three trees.
struct Trees {
    mesh: TriangleMesh,
    wide: WideTree,
    binary: Bvh,
    compressed: CwBvh,
    /// In the order of the compressed tree.
    triangles: Vec<Triangle>,
}

fn corners(mesh: &TriangleMesh, triangle: u32) -> [Vec3; 3] {
    mesh.triangles[triangle as usize].map(|k| mesh.positions[k as usize])
}

impl Trees {
    fn build(name: &str, raw: RawMesh) -> Self {
        let RawMesh { positions, triangles } = raw;
        let mesh = TriangleMesh { positions, triangles, ..Default::default() };
        let all = || (0..mesh.triangles.len() as u32).map(|k| corners(&mesh, k));
        let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let (wide_s, wide) = single.install(|| seconds(|| WideTree::build(&mesh, SPLIT_BUDGET)));
        let (binary_s, binary) = seconds(|| {
            let boxes: Vec<Aabb> = all().map(Aabb::from_points).collect();
            Bvh::build(&boxes, 4)
        });
        let (compressed_s, (compressed, triangles)) = seconds(|| {
            let list: Vec<Triangle> = all()
                .map(|[a, b, c]| Triangle { v0: a.into(), v1: b.into(), v2: c.into() })
                .collect();
            let params = BvhBuildParams::medium_build();
            let tree = build_cwbvh_from_tris(&list, params, &mut Duration::default());
            let order = tree.primitive_indices.iter().map(|&k| list[k as usize]).collect();
            (tree, order)
        });
        println!(
            "{name}: {} triangles; build, CPU-s: kinora {wide_s:.2}, binary {binary_s:.2}, \
             obvhs {compressed_s:.2}; kinora holds {:.1} MB",
            mesh.triangles.len(),
            wide.memory() as f64 * 1e-6
        );
        Self { mesh, wide, binary, compressed, triangles }
    }

    fn closest_wide(&self, (o, d, end): Segment) -> f32 {
        let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
        self.wide.closest_hit(&ray, f64::from(end)).map_or(f32::INFINITY, |hit| hit.t as f32)
    }

    fn closest_binary(&self, (o, d, end): Segment) -> f32 {
        let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
        let test = TriangleTest::new(&ray);
        let mut best = f64::INFINITY;
        self.binary.traverse(&ray, f64::from(end), |triangle, end| {
            let hit = test.intersect(corners(&self.mesh, triangle), end);
            hit.map_or(end, |(t, _)| {
                best = t;
                t
            })
        });
        best as f32
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

    fn any_binary(&self, (o, d, end): Segment) -> f32 {
        let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
        let test = TriangleTest::new(&ray);
        let mut blocked = false;
        self.binary.traverse(&ray, f64::from(end), |triangle, end| {
            blocked |= test.intersect(corners(&self.mesh, triangle), end).is_some();
            if blocked { 0.0 } else { end }
        });
        f32::from(blocked)
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
}

fn main() {
    let quick = std::env::args().any(|word| word == "--quick");
    let (side, repetitions) = if quick { (256, 3) } else { (512, 7) };
    let scenes = if quick {
        [RawMesh::terrain(150, 81, 7), RawMesh::room(60, 28, 18)]
    } else {
        [RawMesh::terrain(447, 810, 8), RawMesh::room(600, 278, 17)]
    };
    let views = [
        (Vec3::new(-0.1, 0.6, -0.1), Vec3::new(0.5, 0.0, 0.5), Vec3::new(0.5, 1.5, 0.5)),
        (Vec3::new(0.1, 0.5, 0.1), Vec3::new(0.7, 0.4, 0.8), Vec3::new(0.5, 0.85, 0.5)),
    ];
    for ((name, raw), (eye, target, light)) in
        ["terrain", "room"].into_iter().zip(scenes).zip(views)
    {
        let trees = Trees::build(name, raw);
        let forward = (target - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let up = right.cross(forward);
        let primary: Vec<Segment> = (0..side * side)
            .map(|k| {
                // Tiles of 16 × 16.
                let (tile, inside) = (k / 256, k % 256);
                let x = tile % (side / 16) * 16 + inside % 16;
                let y = tile / (side / 16) * 16 + inside / 16;
                let at = |v: u32| v as f32 / side as f32 - 0.5;
                (eye, (forward + right * at(x) + up * at(y)).normalize(), f32::INFINITY)
            })
            .collect();
        let (bounce1, shadow1) = trees.onward(&primary, light, 1);
        let (bounce2, shadow2) = trees.onward(&bounce1, light, 2);
        let closest: [Way; 3] =
            [Trees::closest_wide, Trees::closest_binary, Trees::closest_compressed];
        let any: [Way; 3] = [Trees::any_wide, Trees::any_binary, Trees::any_compressed];
        println!("{:8} {:>8} {:>8} {:>8}   ratios (Mrays/s)", "", "kinora", "binary", "obvhs");
        let mut logs = [0.0; 2];
        for (kind, rays, ways) in [
            ("primary", &primary, closest),
            ("bounce1", &bounce1, closest),
            ("bounce2", &bounce2, closest),
            ("shadow1", &shadow1, any),
            ("shadow2", &shadow2, any),
        ] {
            let mut times = [const { Vec::new() }; 3];
            let mut hits = [0_usize; 3];
            for _ in 0..repetitions {
                for ((way, times), hits) in ways.iter().zip(&mut times).zip(&mut hits) {
                    let trace =
                        || rays.iter().filter(|&&r| (0.5..1e30).contains(&way(&trees, r))).count();
                    let (time, count) = seconds(trace);
                    times.push(time);
                    *hits = count;
                }
            }
            let rate = times.map(|mut t| {
                t.sort_by(f64::total_cmp);
                rays.len() as f64 * 1e-6 / t[t.len() / 2]
            });
            let ratios = [rate[0] / rate[1], rate[0] / rate[2]];
            logs = [logs[0] + ratios[0].ln(), logs[1] + ratios[1].ln()];
            println!(
                "{kind:8} {:8.2} {:8.2} {:8.2}   {:.2} {:.2}   (far hits {hits:?})",
                rate[0], rate[1], rate[2], ratios[0], ratios[1]
            );
        }
        let [binary, obvhs] = logs.map(|sum| (sum / 5.0).exp());
        println!("geometric mean of the ratios: {binary:.2} × binary, {obvhs:.2} × obvhs\n");
    }
}
