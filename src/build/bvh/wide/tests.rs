//! What a tree finds is what testing every triangle finds.

use super::binary::Reference;
use super::meshes::{RawMesh, Uniforms};
use super::ray::BoxRay;
use super::*;
use crate::build::bvh::Bvh;
use crate::shape::TriangleTest;
use glam::{DQuat, DVec2, DVec3, Quat, Vec3, Vec3Swizzles};

fn mesh_of(raw: RawMesh) -> TriangleMesh {
    TriangleMesh { positions: raw.positions, triangles: raw.triangles, ..Default::default() }
}

/// Budget of the builds: more than usual, so that many triangles are cut.
const SPLITS: f32 = 0.5;

/// The definition of the closest hit: test all triangles.
fn nearest_of_all(mesh: &TriangleMesh, ray: &LocalRay, t_max: f64) -> Option<TriangleHit> {
    let test = TriangleTest::new(ray);
    let boxes = BoxRay::new(ray)?;
    let mut best: Option<TriangleHit> = None;
    for triangle in 0..mesh.triangles.len() as u32 {
        let end = best.map_or(t_max, |best| best.t);
        let corners = corners(mesh, triangle);
        if let Some((t, weights)) = test.intersect(corners, end)
            && boxes.reaches(&Aabb::from_points(corners), t)
        {
            best = Some(TriangleHit { t, triangle, weights });
        }
    }
    best
}

/// The same by the binary tree, whose boxes are tested in `f64`.
fn nearest_by_binary_tree(
    mesh: &TriangleMesh,
    tree: &Bvh,
    ray: &LocalRay,
    t_max: f64,
) -> Option<TriangleHit> {
    let test = TriangleTest::new(ray);
    let boxes = BoxRay::new(ray)?;
    let mut best: Option<TriangleHit> = None;
    tree.traverse(ray, t_max, |triangle, end| {
        let corners = corners(mesh, triangle);
        match test.intersect(corners, end) {
            Some((t, weights))
                if best.is_none_or(|best| (t, triangle) < (best.t, best.triangle))
                    && boxes.reaches(&Aabb::from_points(corners), t) =>
            {
                best = Some(TriangleHit { t, triangle, weights });
                t.next_up()
            }
            _ => end,
        }
    });
    best
}

/// Rays of all kinds: from anywhere and from corners, in any direction, along axes, at corners and at
/// edges, with lengths over many orders of magnitude, ended or not.
fn ray(mesh: &TriangleMesh, bounds: &Aabb, number: u64) -> (LocalRay, f64) {
    let mut u = Uniforms(number.wrapping_mul(0x1234_5678_9ABC_DEF1));
    let size = bounds.max - bounds.min;
    let in_box = |v: Vec3| (bounds.min + size * (v * 1.4 - 0.2)).as_dvec3();
    let corner = |u: &mut Uniforms| mesh.positions[u.below(mesh.positions.len())].as_dvec3();
    let o = match number % 4 {
        0 => corner(&mut u),
        1 => in_box(u.three()) + DVec3::splat(f64::from(u.one()) * 1e-9),
        _ => in_box(u.three()),
    };
    let target = match number / 4 % 6 {
        0 => corner(&mut u),
        1 => corner(&mut u).midpoint(corner(&mut u)),
        2 => {
            let [a, b, _] = corners(mesh, u.below(mesh.triangles.len()) as u32);
            a.as_dvec3().lerp(b.as_dvec3(), 0.5)
        }
        _ => in_box(u.three()),
    };
    let mut d = target - o;
    match number / 24 % 8 {
        0 => d = DVec3::new(d.x, 0.0, -0.0),
        1 => d = DVec3::new(-0.0, d.y, 0.0),
        2 => d.x *= 1e-30,
        3 => d.y *= 1e-5,
        _ => {}
    }
    let stretch = 10.0_f64.powi((number / 192 % 41) as i32 - 20);
    let end =
        if number.is_multiple_of(3) { f64::from(u.one()) * 2.0 / stretch } else { f64::INFINITY };
    (LocalRay { o, d: d * stretch }, end)
}

pub(super) fn all_instructions() -> Vec<Instructions> {
    let best = Instructions::detect();
    if matches!(best, Instructions::Portable) {
        vec![best]
    } else {
        vec![best, Instructions::Portable]
    }
}

/// Compares all ways to trace `rays` rays with `expected`; returns how many hit.
fn compare(
    what: &str,
    mesh: &TriangleMesh,
    tree: &WideTree,
    rays: u64,
    expected: impl Fn(&LocalRay, f64) -> Option<TriangleHit> + Sync,
) -> usize {
    let bounds = Aabb::from_points(mesh.positions.iter().copied());
    (0..rays)
        .into_par_iter()
        .filter(|&number| {
            let (ray, end) = ray(mesh, &bounds, number);
            let expected = expected(&ray, end);
            for instructions in all_instructions() {
                let hit = tree.closest_hit_by(instructions, &ray, end);
                assert_eq!(hit, expected, "{what}, ray {number} by {instructions:?}: {ray:?}");
                let any = tree.any_hit_by(instructions, &ray, end);
                assert_eq!(any, expected.is_some(), "{what}, ray {number} by {instructions:?}");
            }
            expected.is_some()
        })
        .count()
}

/// Oracle: the scalar test of every triangle. Equal bits are asked for, since boxes only leave out.
#[test]
fn hits_are_those_of_every_triangle() {
    let copies = {
        let one = RawMesh::soup(1, 1.0, 5);
        let mut mesh = one.clone();
        for _ in 0..150 {
            mesh.add(&one);
        }
        mesh
    };
    let soup = || RawMesh::soup(150, 0.3, 1);
    let mut total = 0;
    for (what, raw) in [
        ("soup", soup()),
        ("small triangles", RawMesh::soup(150, 0.02, 2)),
        ("one triangle", RawMesh::soup(1, 1.0, 3)),
        ("nine triangles", RawMesh::soup(9, 1.0, 4)),
        ("copies", copies),
        ("slivers", RawMesh::soup(150, 1.0, 6).map(|p| p * Vec3::new(1.0, 1e-8, 1e-3))),
        ("flat", RawMesh::soup(150, 0.5, 7).map(|p| Vec3::new(p.x, 2.0, p.z))),
        ("a line", RawMesh::soup(100, 0.5, 7).map(|p| Vec3::new(p.x, 2.0, 1.0))),
        ("far away", soup().map(|p| p + 1e6)),
        ("tiny", soup().map(|p| p * 1e-30)),
        ("huge", soup().map(|p| p * 1e30)),
        ("tiny and away", soup().map(|p| p * 1e-6 + Vec3::new(1.0, -1.0, 1.0))),
        ("hills", RawMesh::terrain(8, 1, 2)),
        ("room", RawMesh::room(8, 1, 2)),
    ] {
        let mesh = mesh_of(raw);
        let quality = BvhQuality::ALL[what.len() % 3];
        let tree = WideTree::build_with_budget(&mesh, quality, SPLITS);
        let hits = compare(what, &mesh, &tree, RAYS, |ray, end| nearest_of_all(&mesh, ray, end));
        total += hits;
        assert!(hits > 0 || what == "a line", "{what}: no ray hits");
    }
    assert!(total as u64 > RAYS);
}

/// Rays per mesh of the comparison with brute force.
const RAYS: u64 = if cfg!(debug_assertions) { 2_000 } else { 40_000 };

/// Oracle: another tree, with boxes in `f64`.
#[test]
fn hits_are_those_of_a_binary_tree() {
    for (what, raw) in
        [("hills", RawMesh::terrain(60, 12, 8)), ("room", RawMesh::room(200, 10, 12))]
    {
        let mesh = mesh_of(raw);
        let tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
        // Enlarged, so that the rounding of the distance of a hit cannot hide one of two equal hits.
        let boxes: Vec<Aabb> = (0..mesh.triangles.len() as u32)
            .map(|k| Aabb::from_points(corners(&mesh, k)).inflated(1e-6))
            .collect();
        let binary = Bvh::build(&boxes, 4);
        let hits = compare(what, &mesh, &tree, 5 * RAYS, |ray, end| {
            nearest_by_binary_tree(&mesh, &binary, ray, end)
        });
        assert!(hits > 1000, "{what}: {hits}");
    }
}

/// Oracle: a ray from inside a closed surface ends on it, also when it goes to a corner or an edge.
#[test]
fn no_ray_leaves_a_closed_surface() {
    let mesh = mesh_of(RawMesh::icosphere(4).map(|p| p * 3.7 + Vec3::new(11.3, -0.7, 5.1)));
    let tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
    let center = DVec3::new(11.3, -0.7, 5.1);
    (0..10 * RAYS).into_par_iter().for_each(|number| {
        let mut u = Uniforms(number);
        let o = center + u.direction().as_dvec3() * 2.0 * f64::from(u.one());
        let [a, b, c] = corners(&mesh, u.below(mesh.triangles.len()) as u32).map(Vec3::as_dvec3);
        let target = match number % 4 {
            0 => a,
            1 => a.lerp(b, f64::from(u.one())),
            2 => a.lerp(b, 0.5),
            _ => (a + b + c) / 3.0,
        };
        let ray = LocalRay { o, d: target - o };
        for instructions in all_instructions() {
            let hit = tree.closest_hit_by(instructions, &ray, f64::INFINITY);
            let t = hit.expect("the surface is closed").t;
            assert!((t - 1.0).abs() < 1e-12, "ray {number} to t = {t}");
        }
    });
}

/// The tree does not depend on how many threads built it.
#[test]
fn any_number_of_threads_builds_the_same_tree() {
    let mesh = mesh_of(RawMesh::terrain(100, 20, 8));
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS))
    };
    let one = build(1);
    assert!(one.nodes.len() > 1000);
    assert!(one == build(2) && one == build(7));
}

/// Oracle: what was built.
#[test]
fn memory_is_as_forecast() {
    for raw in [RawMesh::terrain(60, 12, 8), RawMesh::room(200, 10, 12), RawMesh::icosphere(5)] {
        let mesh = mesh_of(raw);
        for quality in BvhQuality::ALL {
            let held = WideTree::build(&mesh, quality).memory() as f64;
            let forecast = WideTree::forecast(mesh.triangles.len(), quality) as f64;
            assert!((held / forecast - 1.0).abs() < 0.2, "{held} for {forecast} at {quality:?}");
        }
    }
}

/// Oracle: random points of a triangle lie in the box of one of its parts, and the parts are as many
/// as were paid for.
#[test]
fn the_parts_of_a_triangle_cover_it() {
    let mesh = mesh_of(RawMesh::soup(200, 0.7, 8));
    let parts = presplit::references(&mesh, 2.0);
    assert!((500..=600).contains(&parts.len()), "{} parts", parts.len());
    let mut u = Uniforms(9);
    for triangle in 0..200 {
        let [a, b, c] = corners(&mesh, triangle);
        let own: Vec<Aabb> =
            parts.iter().filter(|p| p.triangle() == triangle).map(Reference::bounds).collect();
        for _ in 0..200 {
            let (s, t) = (u.one(), u.one());
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            let p = a + (b - a) * s + (c - a) * t;
            // The point itself is rounded.
            assert!(own.iter().any(|part| part.inflated(1e-6).contains(p)), "triangle {triangle}");
        }
    }
}

/// Every input gives a tree with every triangle in it and a stack that is long enough.
#[test]
fn degenerate_input_makes_bounded_trees() {
    let point = RawMesh { positions: vec![Vec3::ONE], triangles: vec![[0, 0, 0]; 100_000] };
    let mut line = RawMesh::default();
    for k in 0..10_000 {
        line.positions.push(Vec3::X * 2.0_f32.powi(-(k % 120)));
        line.triangles.push([k as u32; 3]);
    }
    let mut broken = RawMesh::soup(100, 0.3, 1);
    broken.positions[0] = Vec3::NAN;
    broken.positions[3] = Vec3::INFINITY;
    let huge = RawMesh::soup(1000, 1.0, 1).map(|p| (p - 0.5) * f32::MAX);
    for (raw, left_out) in [(RawMesh::default(), 0), (point, 0), (line, 0), (broken, 2), (huge, 0)]
    {
        let mesh = mesh_of(raw);
        let tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
        assert!(tree.stack <= LONG_STACK);
        let mut found: Vec<u32> = tree
            .blocks
            .iter()
            .flat_map(|block| block.used().map(|lane| block.triangles[lane]))
            .collect();
        found.sort_unstable();
        found.dedup();
        assert_eq!(found.len(), mesh.triangles.len() - left_out);
        let ray = LocalRay { o: DVec3::ZERO, d: DVec3::X };
        for instructions in all_instructions() {
            tree.closest_hit_by(instructions, &ray, f64::INFINITY);
            tree.any_hit_by(instructions, &ray, f64::INFINITY);
        }
    }
}

/// Rays without a direction, or from nowhere, hit nothing and do no harm.
#[test]
fn rays_which_are_not_rays_hit_nothing() {
    let mesh = mesh_of(RawMesh::soup(100, 0.5, 1));
    let tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
    let bad = [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY];
    let rays = bad.map(|d| LocalRay { o: DVec3::splat(0.5), d });
    let more = [DVec3::NAN, DVec3::INFINITY].map(|o| LocalRay { o, d: DVec3::X });
    for ray in rays.iter().chain(&more) {
        for instructions in all_instructions() {
            assert_eq!(tree.closest_hit_by(instructions, ray, f64::INFINITY), None);
            assert!(!tree.any_hit_by(instructions, ray, f64::INFINITY));
        }
    }
}

/// Coincident triangles: the lowest index wins, from both sides.
#[test]
fn the_first_of_equal_triangles_is_hit() {
    let one = RawMesh::soup(1, 1.0, 5);
    let mut raw = one.clone();
    for _ in 0..999 {
        raw.add(&one);
    }
    let mesh = mesh_of(raw);
    let tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
    let center = one.positions.iter().sum::<Vec3>().as_dvec3() / 3.0;
    for d in [DVec3::new(0.3, 0.4, 0.5), DVec3::new(-0.3, -0.4, -0.5)] {
        let ray = LocalRay { o: center - d, d };
        let hit = tree.closest_hit(&ray, f64::INFINITY).expect("the ray aims at the middle");
        assert_eq!(hit.triangle, 0);
        assert!((hit.weights - DVec2::splat(1.0 / 3.0)).length() < 1e-6);
    }
}

/// Oracle: brute force over the moved mesh, and boxes which enclose what is below them.
#[test]
fn a_refitted_tree_finds_the_moved_triangles() {
    let twist = |p: Vec3| Quat::from_rotation_y(3.0 * p.y) * p + Vec3::new(5.0, 0.0, p.x);
    for count in [1, 5, 300] {
        let mesh = mesh_of(RawMesh::soup(count, 0.3, 1));
        let mut tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
        let moved = mesh_of(RawMesh::soup(count, 0.3, 1).map(twist));
        tree.refit(&moved);
        assert_eq!(tree.bounds(), Aabb::from_points(moved.positions.iter().copied()));
        compare("moved", &moved, &tree, RAYS / 2, |ray, end| nearest_of_all(&moved, ray, end));
    }
}

/// The expected cost of a ray: the areas of all boxes of the nodes.
fn cost(tree: &WideTree) -> f64 {
    let boxes = tree.nodes.iter().flat_map(|node| (0..WIDTH).map(|slot| node.get_box(slot)));
    boxes.filter(|bounds| !bounds.is_empty()).map(|bounds| f64::from(bounds.area())).sum()
}

/// Oracle: brute force for every quality, and the cost that each of them is paid to lower.
#[test]
fn better_trees_find_the_same_for_less() {
    let mesh = mesh_of(RawMesh::room(100, 3, 3));
    let trees = BvhQuality::ALL.map(|quality| WideTree::build(&mesh, quality));
    for tree in &trees {
        compare("room", &mesh, tree, RAYS / 4, |ray, end| nearest_of_all(&mesh, ray, end));
    }
    // What it is paid for shows in meshes of thousands of triangles.
    let larger = mesh_of(RawMesh::room(300, 10, 4));
    let [fast, balanced, best] =
        BvhQuality::ALL.map(|quality| cost(&WideTree::build(&larger, quality)));
    assert!(best < 0.97 * balanced && balanced < fast, "{best}, {balanced}, {fast}");
}

/// Strips of this length along z and half a metre wide, side by side at y = 0, which share their corners.
fn strips(length: f64) -> RawMesh {
    let mut mesh = RawMesh::default();
    for k in 0..=24 {
        let x = 0.5 * (k as f32 - 12.0);
        mesh.positions.extend([-0.5, 0.5].map(|end| Vec3::new(x, 0.0, (end * length) as f32)));
    }
    for k in (0..48).step_by(2) {
        mesh.triangles.extend([[k, k + 1, k + 3], [k, k + 3, k + 2]]);
    }
    mesh
}

/// A ray down to a ground of such strips, from between a millimetre and ten metres above `lift` to a place up to
/// nearly its end.
fn down(length: f64, lift: f64, number: u64) -> LocalRay {
    let mut u = Uniforms(number);
    let mut one = || f64::from(u.one());
    let o = DVec3::new(one() - 0.5, lift + 10.0_f64.powf(4.0 * one() - 3.0), one() - 0.5);
    let away = 10.0_f64.powf(one() * (0.45 * length).log10());
    let target = DVec3::new(10.0 * one() - 5.0, 0.0, if one() < 0.5 { away } else { -away });
    LocalRay { o, d: (target - o).normalize() }
}

/// Oracle: the plane, in closed form; on either set of instructions the same bits. Twenty thousand million
/// times as long as wide, seen from a millimetre above: no ray passes, and each hit is where the plane is to
/// half a rounding of `f32`.
#[test]
fn ground_of_long_thin_strips_lets_no_ray_through() {
    for (exponent, axis) in (2..11).flat_map(|exponent| (0..3).map(move |axis| (exponent, axis))) {
        let length = 2.0 * 10.0_f64.powi(exponent);
        let raw = strips(length).map(|p| [p, p.yzx(), p.zxy()][axis]);
        let mesh = mesh_of(raw);
        let quality = BvhQuality::ALL[exponent as usize % 3];
        let tree = WideTree::build_with_budget(&mesh, quality, SPLITS);
        for number in 0..300 {
            let ray = down(length, 0.0, number);
            let turned = |v: DVec3| {
                let turns = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];
                DVec3::from_array(turns[axis].map(|k| v[k]))
            };
            let exact = -ray.o.y / ray.d.y;
            let ray = LocalRay { o: turned(ray.o), d: turned(ray.d) };
            let find = |with| tree.closest_hit_by(with, &ray, f64::INFINITY);
            let hits: Vec<_> = all_instructions().into_iter().map(find).collect();
            for (hit, with) in hits.iter().zip(all_instructions()) {
                let what = format!("{length:e} m, axis {axis}, ray {number} by {with:?}: {ray:?}");
                let t = hit.unwrap_or_else(|| panic!("{what} passes")).t;
                let error = (t / exact - 1.0).abs();
                assert!(error <= f64::from(f32::EPSILON) * 0.25, "{what}: off by {error:e}");
                assert_eq!(*hit, hits[0], "{what}");
                assert!(tree.any_hit_by(with, &ray, f64::INFINITY), "{what}");
                let short = tree.any_hit_by(with, &ray, exact * (1.0 - f64::from(f32::EPSILON)));
                assert!(!short, "{what} is met too early");
            }
        }
    }
}

/// Oracle: none but that ground is closed. Turned, its corners are those that `f32` can hold.
#[test]
fn turned_ground_of_long_thin_strips_lets_no_ray_through() {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.9, -0.7));
    for exponent in 2..6 {
        let length = 2.0 * 10.0_f64.powi(exponent);
        let mesh = mesh_of(strips(length).map(|p| (turn * p.as_dvec3()).as_vec3()));
        let tree = WideTree::build_with_budget(&mesh, BvhQuality::Balanced, SPLITS);
        for number in 0..600 {
            // From above what the rounding of the corners lifts.
            let ray = down(length, 0.1, number);
            let ray = LocalRay { o: turn * ray.o, d: turn * ray.d };
            for with in all_instructions() {
                let hit = tree.closest_hit_by(with, &ray, f64::INFINITY);
                assert!(hit.is_some(), "{length:e} m, ray {number} by {with:?} passes: {ray:?}");
            }
        }
    }
}
