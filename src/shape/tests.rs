//! Tests which hold for several shapes.

use super::*;
use crate::math::{Cubic, Profile};
use crate::sampling::Sampler;
use glam::{DQuat, DVec2};
use std::sync::Arc;

/// Corners of a turned solid, (radius, height), from the lowest to the highest.
const TURNED: [DVec2; 4] =
    [DVec2::new(0.5, -0.5), DVec2::new(1.0, 0.0), DVec2::new(0.2, 0.3), DVec2::new(0.4, 0.6)];

fn solids() -> [Primitive; 5] {
    let lines: Vec<Cubic> = TURNED.windows(2).map(|p| Cubic::line(p[0], p[1])).collect();
    let profile = Profile::new(&lines).expect("off its axis");
    [
        Primitive::Sphere,
        Primitive::Cuboid,
        Primitive::Cylinder { capped: true },
        Primitive::Cone { capped: true },
        Primitive::Revolution(Revolution::new(Arc::new(profile), true)),
    ]
}

/// Whether `p` lies inside the solid: the defining inequality.
fn inside(shape: &Primitive, p: DVec3) -> bool {
    let r2 = p.x * p.x + p.z * p.z;
    match shape {
        Primitive::Revolution(_) => TURNED.windows(2).any(|ends| {
            let share = (p.y - ends[0].y) / (ends[1].y - ends[0].y);
            (0.0..1.0).contains(&share) && r2.sqrt() < ends[0].lerp(ends[1], share).x
        }),
        Primitive::Sphere => p.length_squared() < 1.0,
        Primitive::Cuboid => p.abs().max_element() < 0.5,
        Primitive::Cylinder { .. } => r2 < 1.0 && p.y.abs() < 0.5,
        Primitive::Cone { .. } => p.y > -0.5 && p.y < 0.5 && r2 < (0.5 - p.y).powi(2),
        _ => unreachable!("not a solid"),
    }
}

fn random(k: u32) -> impl FnMut() -> f64 {
    let sampler = Sampler::new(99, 0, (k, 0), 0);
    let mut dimension = 0;
    move || {
        dimension += 1;
        f64::from(sampler.one(dimension))
    }
}

fn random_vector(next: &mut impl FnMut() -> f64) -> DVec3 {
    DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5)
}

/// Oracle: the inequality of the solid, asked along the ray. Before the hit the ray stays on the
/// side where it began, just behind it it is on the other.
#[test]
fn the_hit_is_where_the_ray_first_crosses_the_surface() {
    for shape in &solids() {
        let mut hits = 0;
        for k in 0..4000 {
            let mut next = random(k);
            let ray = LocalRay { o: random_vector(&mut next) * 4.0, d: random_vector(&mut next) };
            let starts_inside = inside(shape, ray.o);
            let hit = shape.intersect(&ray, f64::INFINITY);
            let end = hit.map_or(40.0, |hit| hit.t);
            for step in 1..400 {
                let p = ray.at(end * f64::from(step) / 400.0);
                assert_eq!(inside(shape, p), starts_inside, "{shape:?}, ray {k}: {ray:?}");
            }
            let Some(hit) = hit else { continue };
            hits += 1;
            let surface = shape.surface(ray.at(hit.t), hit.face, true);
            assert!((surface.p - ray.at(hit.t)).length() < 1e-11, "{shape:?}: {ray:?}");
            let n = surface.ng.normalize();
            assert!(!inside(shape, surface.p + n * 1e-9), "{shape:?}: the normal points outwards");
            assert!(inside(shape, surface.p - n * 1e-9), "{shape:?}: {ray:?} {surface:?}");
            assert_eq!(ray.d.dot(n) > 0.0, starts_inside, "{shape:?}");
        }
        assert!(hits > 200, "{shape:?}: only {hits} hits");
    }
}

/// Directions with zero and tiny components, and rays along faces and edges, give finite answers.
#[test]
fn degenerate_rays_do_not_make_nan() {
    let components = [0.0, -0.0, 1.0, -1.0, 1e-30, 1e-5, 0.5];
    for shape in [Primitive::Rectangle, Primitive::Disk, Primitive::Plane].iter().chain(&solids()) {
        for &x in &components {
            for &y in &components {
                for &z in &components {
                    let d = DVec3::new(x, y, z);
                    for o in [DVec3::ZERO, DVec3::new(0.5, 0.5, 0.5), DVec3::new(-3.0, 0.0, 0.0)] {
                        if d == DVec3::ZERO {
                            continue;
                        }
                        if let Some(hit) = shape.intersect(&LocalRay { o, d }, 1e9) {
                            assert!(hit.t > 0.0 && hit.t < 1e9, "{shape:?} {o} {d}");
                            let s = shape.surface(o + d * hit.t, hit.face, true);
                            assert!(s.ng.is_finite() && s.uv.is_finite(), "{shape:?} {o} {d}");
                        }
                    }
                }
            }
        }
    }
}

/// A sphere of radius 1 at distances up to 1e6: the `f64` entry from the triangle of eye, centre and
/// entry point.
#[test]
fn far_spheres_keep_their_entry_point() {
    for exponent in 1..=6 {
        let distance = 10.0_f64.powi(exponent);
        for h in [0.0, 0.5, 0.9] {
            let ray = LocalRay { o: DVec3::new(h, 0.0, distance), d: DVec3::NEG_Z };
            let t = Primitive::Sphere.intersect(&ray, 1e30).expect("aimed at it").t;
            let expected = distance - (1.0 - h * h).sqrt();
            assert!((t - expected).abs() <= 4.0 * f64::EPSILON * distance, "{t} {expected}");
        }
    }
}

/// A sphere of radius 1e6 from height 1, in canonical units. The value is 2c/(−b + √(b² − 4c)).
#[test]
fn a_huge_sphere_underfoot_is_met_where_it_should_be() {
    let r = 1e6;
    let ray =
        LocalRay { o: DVec3::new(0.0, (r + 1.0) / r, 0.0), d: DVec3::new(0.6, -0.8, 0.0) / r };
    let t = Primitive::Sphere.intersect(&ray, 1e30).expect("aimed at it").t;
    let (b, c) = (-1.6 * (r + 1.0), 2.0 * r + 1.0);
    let expected = 2.0 * c / (-b + (b * b - 4.0 * c).sqrt());
    assert!((t - expected).abs() < 1e-8, "{t} {expected}");
    assert!((t - 1.250_000_35).abs() < 1e-7, "{t}");
}

/// Radius 1, from −½ to ½.
fn turned_cylinder() -> Primitive {
    let line = Cubic::line(DVec2::new(1.0, -0.5), DVec2::new(1.0, 0.5));
    let profile = Profile::new(&[line]).expect("off its axis");
    Primitive::Revolution(Revolution::new(Arc::new(profile), true))
}

/// Oracles: areas in closed form under a map which stretches the axes.
#[test]
fn areas_agree_with_their_closed_forms() {
    use std::f64::consts::PI;
    let turn = DAffine3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, 0.2, -0.9)));
    let even = turn * DAffine3::from_scale(DVec3::splat(3.0));
    let tall = turn * DAffine3::from_scale(DVec3::new(2.0, 3.0, 2.0));
    let sheet = turn * DAffine3::from_scale(DVec3::new(2.0, 3.0, 5.0));
    let prolate = {
        // a = 2 twice, c = 3: 2πa²(1 + c/(a·e)·asin e), e² = 1 − a²/c²
        let e = (1.0_f64 - 4.0 / 9.0).sqrt();
        2.0 * PI * 4.0 * (1.0 + 3.0 / (2.0 * e) * e.asin())
    };
    let slant = (4.0_f64 + 9.0).sqrt();
    for (shape, m, expected) in [
        (Primitive::Sphere, even, 4.0 * PI * 9.0),
        (Primitive::Sphere, tall, prolate),
        (Primitive::Rectangle, sheet, 6.0),
        (Primitive::Disk, sheet, PI * 6.0),
        (Primitive::Cuboid, sheet, 2.0 * (6.0 + 15.0 + 10.0)),
        (Primitive::Cylinder { capped: false }, tall, 2.0 * PI * 2.0 * 3.0),
        (Primitive::Cylinder { capped: true }, tall, 2.0 * PI * 2.0 * 3.0 + 2.0 * PI * 4.0),
        (Primitive::Cone { capped: true }, tall, PI * 2.0 * slant + PI * 4.0),
        (turned_cylinder(), tall, 2.0 * PI * 2.0 * 3.0 + 2.0 * PI * 4.0),
    ] {
        let area = shape.world_area(&m);
        assert!((area / expected - 1.0).abs() < 1e-5, "{shape:?}: {area} against {expected}");
    }
}

/// Points are drawn on the surface, with the density that is claimed for their face: the share of
/// each face is its pdf times its area.
#[test]
fn points_are_drawn_on_the_surface() {
    let m = DAffine3::from_scale(DVec3::new(1.0, 2.0, 0.5));
    for shape in solids().iter().chain(&[Primitive::Rectangle, Primitive::Disk]) {
        for k in 0..500 {
            let u = Sampler::new(3, 0, (k, 0), 0).two(0);
            let point = shape.sample(u, &m).expect("finite area");
            let surface = shape.surface(point.p, point.face, true);
            assert!((surface.p - point.p).length() < 1e-6, "{shape:?}");
            let pdf = shape.pdf_area(point.face, &m);
            assert!((pdf / point.pdf_area - 1.0).abs() < 1e-12, "{shape:?}: {pdf}");
        }
    }
}

/// The mean of `f` over a fine stratified square, in `f64`.
fn mean(n: u32, f: impl Fn(Vec2) -> f64) -> f64 {
    let sum: f64 = (0..n * n)
        .map(|k| f(Vec2::new((k % n) as f32 + 0.5, (k / n) as f32 + 0.5) / n as f32))
        .sum();
    sum / f64::from(n * n)
}

/// Oracle: irradiance `πL(R/d)²·cos θ` of a sphere seen whole, L = 1.
#[test]
fn sphere_lights_give_the_closed_form_irradiance() {
    for (tilt, expected) in [(0.0_f64, 0.349_065_9), (60.0, 0.174_532_9)] {
        let (sin, cos) = tilt.to_radians().sin_cos();
        let centre = DVec3::new(sin, 0.0, cos) * 3.0;
        let cone = ConeOfSphere::new(DVec3::ZERO, centre, 1.0, 0.0).expect("outside");
        let e = mean(256, |u| {
            let (wi, normal) = sample_sphere(&cone, u);
            assert!(wi.dot(normal) < 1e-6, "the visible side faces the point");
            wi.z.max(0.0) / cone.pdf()
        });
        assert!((e / expected - 1.0).abs() < 2e-5, "tilt {tilt}: {e}");
    }
    // A tiny, far sphere: E = πL·(R/d)²
    let cone = ConeOfSphere::new(DVec3::ZERO, DVec3::Z, 1e-6, 0.0).expect("outside");
    assert!((1.0 / cone.pdf() / (std::f64::consts::PI * 1e-12) - 1.0).abs() < 1e-9);
}

/// Oracles: the unit square at height 1 above its centre, and a 2 × 1 rectangle under its corner.
#[test]
fn rectangle_lights_give_the_closed_form_irradiance() {
    let cases = [
        (DVec3::new(-0.5, -0.5, 1.0), DVec3::X, DVec3::Y, 0.752_274_7),
        (DVec3::new(0.0, 0.0, 1.0), DVec3::X * 2.0, DVec3::Y, 0.525_824_1),
    ];
    for (corner, ex, ey, expected) in cases {
        let sampler = RectangleSampler::new(DVec3::ZERO, corner, ex, ey).expect("in view");
        let e = mean(256, |u| {
            let (to, share) = sample_rectangle(&sampler, u);
            let point = corner + ex * share.x + ey * share.y;
            assert!((to - point).length() < 1e-9, "vector and position agree");
            to.normalize().z / sampler.pdf()
        });
        assert!((e / expected - 1.0).abs() < 1e-5, "{e} against {expected}");
    }
}

/// Oracle: Lambert's formula `½ Σ Θᵢ n·Γᵢ` for two receivers under one triangle; also for a triangle
/// so small that points are drawn by area.
#[test]
fn triangle_lights_give_the_closed_form_irradiance() {
    let triangle =
        [DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 2.0), DVec3::new(-1.0, -1.0, 3.0)];
    let irradiance = |p: DVec3, triangle: [DVec3; 3], n: DVec3| {
        mean(400, |u| {
            let b: DVec2 = sample_triangle(p, triangle, u);
            let q = triangle[0] * (1.0 - b.x - b.y) + triangle[1] * b.x + triangle[2] * b.y;
            (q - p).normalize().dot(n) / triangle_pdf(p, triangle, q)
        })
    };
    for (n, expected) in [(DVec3::Z, 0.258_953_9), (DVec3::new(2.0, 3.0, 6.0) / 7.0, 0.231_285_7)] {
        let e = irradiance(DVec3::ZERO, triangle, n);
        assert!((e / expected - 1.0).abs() < 1e-5, "{e} against {expected}");
    }
    let tiny = triangle.map(|v| v * 1e-3 + DVec3::Z * 2.0);
    let e = irradiance(DVec3::ZERO, tiny, DVec3::Z);
    let lambert: f64 = (0..3)
        .map(|k| {
            let (a, b) = (tiny[k].normalize(), tiny[(k + 1) % 3].normalize());
            let axis = a.cross(b);
            0.5 * axis.length().asin() * axis.normalize().z
        })
        .sum();
    assert!((e / lambert.abs() - 1.0).abs() < 1e-5, "{e} against {lambert}");
}

/// No ray passes between triangles: rays through the shared edge and the shared vertices of a fan
/// hit at least one of its triangles.
#[test]
fn shared_edges_and_vertices_are_watertight() {
    let rim: Vec<Vec3> = (0..7)
        .map(|k| {
            let a = k as f32 * 0.9;
            Vec3::new(a.cos(), a.sin(), 0.1 * a)
        })
        .collect();
    let centre = Vec3::new(0.01, -0.02, 0.3);
    for k in 0..20_000 {
        let mut next = random(k);
        let spoke = (next() * 7.0) as usize;
        let along = next() as f32;
        let target = if next() < 0.2 { centre } else { centre.lerp(rim[spoke], along) };
        let o = random_vector(&mut next) * 6.0 + DVec3::Z * 5.0;
        let test = TriangleTest::new(&LocalRay { o, d: target.as_dvec3() - o });
        let hit = (0..7)
            .any(|k| test.intersect([centre, rim[k], rim[(k + 1) % 7]], f64::INFINITY).is_some());
        // The target itself is rounded to f32 and may lie beyond the outer end of a spoke.
        assert!(hit || along > 0.999_99, "ray {k} slips through");
    }
}
