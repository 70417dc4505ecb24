//! A surface of revolution against meshes of it: rays per second, memory, and how far the mesh is off.
//!
//! The shape is a wine glass, its own height across. A mesh of an error `e` keeps its chords within `e` of the
//! profile and of the circle. In a picture `n` pixels high of the glass, half a pixel is an `e` of `1/2n` of the height; what is
//! seen through glass, or mirrored in it, needs more.

use crate::Options;
use crate::clock::{median, thread_seconds};
use crate::meshes::Uniforms;
use crate::report::{Report, section};
use glam::{DVec2, DVec3, Vec3};
use kinora::build::bvh::WideTree;
use kinora::description::{BvhQuality, TriangleMesh};
use kinora::math::{Cubic, Piece, Profile};
use kinora::shape::{LocalRay, Primitive, Revolution};
use std::f64::consts::PI;
use std::sync::Arc;

/// Outside from the axis, rim, and inside of a glass, (radius, height) in millimetres.
const GLASS: [[f64; 2]; 34] = [
    [0.0, 0.8],
    [10.0, 0.8],
    [24.0, 0.0],
    [35.0, 0.0],
    [36.2, 0.0],
    [36.2, 1.6],
    [35.0, 1.8],
    [20.0, 3.6],
    [6.5, 5.5],
    [4.6, 13.0],
    [3.4, 19.0],
    [3.4, 60.0],
    [3.8, 84.0],
    [4.6, 93.0],
    [15.0, 93.5],
    [27.0, 104.0],
    [37.5, 113.0],
    [43.0, 126.0],
    [43.0, 142.0],
    [43.0, 168.0],
    [36.5, 192.0],
    [33.0, 214.0],
    [32.8, 215.3],
    [31.9, 215.3],
    [31.8, 214.0],
    [35.2, 192.0],
    [41.7, 168.0],
    [41.7, 142.0],
    [41.7, 127.0],
    [36.4, 114.2],
    [26.1, 105.4],
    [15.5, 97.0],
    [7.0, 95.5],
    [0.0, 95.5],
];
const HEIGHT: f64 = 0.215;

fn profile() -> Profile {
    let point = |k: usize| DVec2::from(GLASS[k]) / 1000.0;
    let curve = |k: usize| Cubic::new(std::array::from_fn(|i| point(3 * k + i)), [1.0; 4]);
    Profile::new(&(0..11).map(curve).collect::<Vec<_>>()).expect("the glass is a solid")
}

/// Points of a piece whose chords are within `error` of it, without the first.
fn chords(piece: &Piece, (a, b): (f64, f64), error: f64, points: &mut Vec<DVec2>) {
    let (p, q, m) = (piece.jet(a).p, piece.jet(b).p, piece.jet(f64::midpoint(a, b)).p);
    let chord = (q - p).normalize_or(DVec2::X);
    if chord.perp_dot(m - p).abs() > error {
        let middle = f64::midpoint(a, b);
        chords(piece, (a, middle), error, points);
        chords(piece, (middle, b), error, points);
    } else {
        points.push(q);
    }
}

/// The mesh of a profile within `error`, without normals.
fn mesh_within(profile: &Profile, error: f64) -> TriangleMesh {
    let mut rings = vec![profile.pieces[0].start];
    for piece in &profile.pieces {
        chords(piece, (0.0, 1.0), error, &mut rings);
    }
    let around = (PI / (1.0 - error / profile.extent.0).acos()).ceil() as u32;
    let mut mesh = TriangleMesh::default();
    for ring in &rings {
        for k in 0..around {
            let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(around)).sin_cos();
            mesh.positions.push(DVec3::new(ring.x * sin, ring.y, ring.x * cos).as_vec3());
        }
    }
    for ring in 0..rings.len() as u32 - 1 {
        for k in 0..around {
            let at = |ring: u32, k: u32| ring * around + k % around;
            let (a, b, c, d) = (at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Rays from a camera, and what becomes of them: mirrored evenly, refracted into the glass, and on from there.
fn ray_sets(surface: &Primitive, side: usize) -> [(&'static str, Vec<LocalRay>); 4] {
    let mut u = Uniforms(5);
    let eye = DVec3::new(0.1, 0.25, 0.45);
    let forward = (DVec3::Y * 0.5 * HEIGHT - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let pixel = |k: usize| {
        let (tile, inside) = (k / 256, k % 256);
        let x = tile % (side / 16) * 16 + inside % 16;
        let y = tile / (side / 16) * 16 + inside / 16;
        let at = |v: usize| 0.5 * (v as f64 / side as f64 - 0.5);
        LocalRay { o: eye, d: (forward + right * at(x) + up * at(y)).normalize() }
    };
    let primary: Vec<LocalRay> = (0..side * side).map(pixel).collect();
    let mut next = |rays: &[LocalRay], ratio: Option<f64>| -> Vec<LocalRay> {
        let mut found = Vec::new();
        for ray in rays {
            let Some(hit) = surface.intersect(ray, f64::INFINITY) else { continue };
            let n = surface.surface(ray.at(hit.t), hit.face, false).ng.normalize();
            let n = if n.dot(ray.d) > 0.0 { -n } else { n };
            let cos = -ray.d.dot(n);
            let (side, d) = match ratio {
                Some(ratio) => {
                    let cos_t = (1.0 - ratio * ratio * (1.0 - cos * cos)).max(0.0).sqrt();
                    (-n, ray.d * ratio + n * (ratio * cos - cos_t))
                }
                None => (n, n + u.direction().as_dvec3() * 0.999),
            };
            // Away from a mesh, which the point may be inside of.
            found.push(LocalRay { o: ray.at(hit.t) + side * (1e-4 * HEIGHT), d: d.normalize() });
        }
        found
    };
    let mirrored = next(&primary, None);
    let refracted = next(&primary, Some(1.0 / 1.5));
    let inner = next(&refracted, Some(1.0));
    [("camera", primary), ("mirrored", mirrored), ("in glass", refracted), ("through it", inner)]
}

/// Measures the glass and its meshes in turn.
pub fn run(options: &Options, report: &mut Report) {
    let (side, repetitions) = if options.quick { (512, 5) } else { (1024, 9) };
    section(
        "revolution: Mrays per CPU-second, and MB; meshes by their error in heights of the glass",
    );
    let profile = profile();
    let errors = [1e-3, 1e-4, 1e-5];
    let meshes = errors.map(|error| mesh_within(&profile, error * HEIGHT));
    let trees = meshes.each_ref().map(|mesh| WideTree::build(mesh, BvhQuality::Balanced));
    let bytes = profile.memory();
    let surface = Primitive::Revolution(Revolution::new(Arc::new(profile), false));
    report.row("revolution.memory", &[("revolution", bytes as f64 * 1e-6, "MB")]);
    for ((error, mesh), tree) in errors.iter().zip(&meshes).zip(&trees) {
        let corners = mesh.positions.len() * size_of::<Vec3>() + mesh.triangles.len() * 12;
        report.row(
            &format!("revolution.memory.{error:.0e}"),
            &[
                ("triangles", mesh.triangles.len() as f64, ""),
                ("mesh", (corners + tree.memory()) as f64 * 1e-6, "MB"),
            ],
        );
    }
    for (kind, rays) in ray_sets(&surface, side) {
        let mut times = [const { Vec::new() }; 4];
        for _ in 0..repetitions {
            let hit = |&ray: &&LocalRay| surface.intersect(ray, f64::INFINITY).is_some();
            times[0].push(thread_seconds(|| rays.iter().filter(hit).count()).0);
            for (tree, times) in trees.iter().zip(&mut times[1..]) {
                let hit = |&ray: &&LocalRay| tree.closest_hit(ray, f64::INFINITY).is_some();
                times.push(thread_seconds(|| rays.iter().filter(hit).count()).0);
            }
        }
        let [own, coarse, middle, fine] = times.map(|t| rays.len() as f64 * 1e-6 / median(t));
        report.row(
            &format!("revolution.{}", kind.replace(' ', "_")),
            &[
                ("revolution", own, ""),
                ("1e-3", coarse, ""),
                ("1e-4", middle, ""),
                ("1e-5", fine, ""),
                ("ratio_1e-4", own / middle, ""),
            ],
        );
    }
}
