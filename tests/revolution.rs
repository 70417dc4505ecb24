//! Surfaces of revolution: known shapes, known rays, and a dense search in `f64` as the oracle of everything else.

use glam::{DAffine3, DVec2, DVec3, Vec2};
use kinora::build::bvh::MeshTree;
use kinora::description::{BvhQuality, LoadOptions, Shape, TriangleMesh, load_scene};
use kinora::math::{Cubic, Profile, ProfileError, clamped_knots, spline};
use kinora::sampling::Sampler;
use kinora::shape::{LocalRay, Primitive, Revolution};
use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

/// A chain of curves through `3n + 1` points (radius, height).
fn bezier(points: &[[f64; 2]]) -> Vec<Cubic> {
    let curve =
        |k: usize| Cubic::new(std::array::from_fn(|i| DVec2::from(points[3 * k + i])), [1.0; 4]);
    (0..points.len() / 3).map(curve).collect()
}

fn polyline(points: &[[f64; 2]]) -> Vec<Cubic> {
    points.windows(2).map(|p| Cubic::line(p[0].into(), p[1].into())).collect()
}

/// Quarter of a circle, exact: from the angle `quarter·90°` on, counted from +r towards +y.
fn quarter(centre: DVec2, radius: f64, quarter: u8) -> Cubic {
    let w = (1.0 + 2.0_f64.sqrt()) / 3.0;
    let h = 2.0 - 2.0_f64.sqrt();
    let points = [[1.0, 0.0], [1.0, h], [h, 1.0], [0.0, 1.0]].map(DVec2::from);
    let turned = points.map(|p| centre + (0..quarter).fold(p, |p, _| p.perp()) * radius);
    Cubic::new(turned, [1.0, w, w, 1.0])
}

fn ball(radius: f64) -> Vec<Cubic> {
    [3, 0].map(|k| quarter(DVec2::ZERO, radius, k)).to_vec()
}

fn torus(major: f64, minor: f64) -> Vec<Cubic> {
    (0..4).map(|k| quarter(DVec2::new(major, 0.0), minor, k)).collect()
}

const VASE: [[f64; 2]; 4] = [[0.5, 0.0], [1.2, 0.3], [0.2, 0.9], [0.8, 1.2]];
const FOLDED: [[f64; 2]; 4] = [[0.2, 0.0], [2.2, 1.4], [-0.4, -0.4], [1.0, 1.0]];
/// Derivative 0 in the middle.
const CUSP: [[f64; 2]; 4] = [[0.3, 0.0], [1.3, 1.0], [0.3, 1.0], [1.3, 0.0]];

/// Everything that is thrown rays at: by name, its curves, and whether its ends are closed.
fn shapes() -> Vec<(&'static str, Vec<Cubic>, bool)> {
    let loose: Vec<DVec2> =
        [[0.0, 0.0], [1.0, 0.1], [0.4, 0.6], [0.9, 1.0], [0.3, 1.5], [0.0, 1.4]]
            .map(DVec2::from)
            .to_vec();
    vec![
        ("vase", bezier(&VASE), false),
        ("closed vase", bezier(&VASE), true),
        ("folded", bezier(&FOLDED), false),
        ("cusp", bezier(&CUSP), true),
        ("ball", ball(1.0), false),
        ("torus", torus(2.0, 0.5), false),
        ("lathe", polyline(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.4, 1.6], [0.4, 2.0]]), true),
        ("spline", spline(&loose, &[1.0, 0.5, 2.0, 1.0, 3.0, 1.0], &clamped_knots(6)), false),
        ("spindle", bezier(&[[0.0, 0.0], [0.0, 1.0], [1.0, 1.5], [0.0, 2.0]]), false),
    ]
}

fn turned(curves: &[Cubic], capped: bool) -> Revolution {
    Revolution::new(Arc::new(Profile::new(curves).expect("a valid profile")), capped)
}

fn primitive(curves: &[Cubic], capped: bool) -> Primitive {
    Primitive::Revolution(turned(curves, capped))
}

fn scaled(curves: &[Cubic], factor: f64) -> Vec<Cubic> {
    curves.iter().map(|c| Cubic(c.0.map(|p| DVec3::new(p.x * factor, p.y * factor, p.z)))).collect()
}

/// All hits of a ray, in order.
fn all_hits(shape: &Primitive, o: DVec3, d: DVec3) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    let mut from = 0.0;
    while let Some(hit) = shape.intersect(&LocalRay { o: o + d * from, d }, f64::INFINITY) {
        found.push(from + hit.t);
        // Past the hit by more than its rounding.
        from += hit.t + 1e-9;
    }
    found
}

/// Oracle: the values listed for a vase and for a profile which folds over, found by another program.
#[test]
fn known_rays_meet_known_surfaces_where_they_should() {
    let vase = primitive(&bezier(&VASE), false);
    let folded = primitive(&bezier(&FOLDED), false);
    // There the axis is z, here it is y.
    let turn = |x: f64, y: f64, z: f64| DVec3::new(y, z, x);
    let cases = [
        (
            &vase,
            turn(-2.0, 0.1, 0.4),
            turn(1.0, 0.05, 0.1),
            vec![1.313_855_429_98, 2.638_081_768_52],
        ),
        (
            &vase,
            turn(0.6, 0.1, -1.0),
            turn(0.05, 0.02, 1.0),
            vec![1.103_723_644_15, 1.590_515_438_29, 2.156_225_810_99],
        ),
        (
            &vase,
            turn(-2.0, 0.3, 0.4),
            turn(1.0, 0.0, 0.0),
            vec![1.310_820_291_37, 2.689_179_708_63],
        ),
        (
            &vase,
            turn(0.65, 0.0, -1.0),
            turn(0.0, 0.0, 1.0),
            vec![1.087_773_208_3, 1.697_393_369_516, 2.083_578_726_47],
        ),
        (
            &folded,
            turn(-3.0, 0.2, 0.45),
            turn(1.0, 0.01, 0.03),
            vec![
                2.103_220_035_47,
                2.171_675_174_94,
                2.460_089_593_07,
                3.559_992_098_74,
                3.950_612_605_83,
                3.962_758_493_82,
            ],
        ),
    ];
    for (shape, o, d, expected) in cases {
        let found = all_hits(shape, o, d.normalize());
        assert_eq!(found.len(), expected.len(), "{o} {d}: {found:?}");
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() < 2e-11, "{o} {d}: {found:?} instead of {expected:?}");
        }
    }
    let o = turn(-2.0, 0.1, 0.4);
    let d = turn(1.0, 0.05, 0.1).normalize();
    for (t, normal) in [
        (1.313_855_429_98, turn(-0.915_517_9, 0.217_955_7, 0.338_115_8)),
        (2.638_081_768_52, turn(0.874_864_7, 0.325_164_8, 0.358_998_2)),
    ] {
        let face =
            vase.intersect(&LocalRay { o: o + d * (t - 0.01), d }, 1.0).expect("it is there").face;
        let n = vase.surface(o + d * t, face, true).ng.normalize();
        assert!(n.distance(normal) < 2e-7, "{n} instead of {normal}");
    }
    // A nearly level ray meets it where the level one does.
    for slope in [1e-12, -1e-12, 1e-10, -1e-10] {
        let found = all_hits(&vase, turn(-2.0, 0.3, 0.4), turn(1.0, 0.0, slope));
        assert_eq!(found.len(), 2);
        assert!((found[0] - 1.310_820_291_37).abs() < 1e-9, "{slope}: {found:?}");
        assert!((found[1] - 2.689_179_708_63).abs() < 1e-9, "{slope}: {found:?}");
    }
}

struct Numbers {
    sampler: Sampler,
    dimension: u32,
}

impl Numbers {
    fn new(seed: u64, k: u32) -> Self {
        Self { sampler: Sampler::new(seed, 0, (k, 0), 0), dimension: 0 }
    }

    fn next(&mut self) -> f64 {
        self.dimension += 1;
        f64::from(self.sampler.one(self.dimension))
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next() - 0.5, self.next() - 0.5, self.next() - 0.5)
    }

    fn direction(&mut self) -> DVec3 {
        let (sin, cos) = (TAU * self.next()).sin_cos();
        let z = 2.0 * self.next() - 1.0;
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, z, r * sin)
    }
}

/// The oracle: the profile at many points, and for a ray all changes of sign between them, bisected.
struct Dense {
    curves: Vec<Cubic>,
    points: Vec<(f64, f64)>,
    caps: Vec<DVec2>,
    size: f64,
}

const STEPS: usize = 400;

impl Dense {
    fn new(curves: &[Cubic], capped: bool) -> Self {
        let at = |curve: &Cubic, k: usize| {
            let p = curve.at(k as f64 / STEPS as f64);
            (p.x, p.y)
        };
        let points = curves.iter().flat_map(|c| (0..=STEPS).map(move |k| at(c, k))).collect();
        let ends = [curves[0].at(0.0), curves[curves.len() - 1].at(1.0)];
        let caps = ends.into_iter().filter(|p| capped && p.x > 0.0).collect();
        let all: Vec<DVec2> = curves.iter().flat_map(Cubic::points).collect();
        let size = all.iter().fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
        Self { curves: curves.to_vec(), points, caps, size }
    }

    /// The least `t > 0` at which the ray, `|d| = 1`, meets the surface.
    fn nearest(&self, o: DVec3, d: DVec3) -> f64 {
        let w = d.x.hypot(d.z);
        let middle = DVec3::Y * self.points[self.points.len() / 2].1;
        let shift = (middle - o).dot(d);
        let near = o + d * shift;
        let (hx, hz) = if w > 0.0 { (d.x / w, d.z / w) } else { (1.0, 0.0) };
        let q0 = near.x * hx + near.z * hz;
        let b = (near.x * hz - near.z * hx).abs();
        let mut best = f64::INFINITY;
        let mut offer = |t: f64| {
            if t > 0.0 && t < best {
                best = t;
            }
        };
        if d.y.abs() >= w {
            let k = w / d.y;
            let side = |r: f64, y: f64| r - b.hypot(q0 + k * (y - near.y));
            self.crossings(side, |p| offer(shift + (p.y - near.y) / d.y));
        } else {
            let kappa = d.y / w;
            let axis = near.y - kappa * q0;
            for sign in [-1.0, 1.0] {
                let chord = |r: f64| ((r - b) * (r + b)).sqrt();
                // Which coordinate tells better where on the ray a point is.
                let along = |p: DVec2| {
                    let by_height = chord(p.x).max(0.0) < kappa.abs() * p.x;
                    let way =
                        if by_height { (p.y - near.y) / d.y } else { (sign * chord(p.x) - q0) / w };
                    shift + way
                };
                // NaN inside of the closest approach: no change of sign is seen there, and the
                // first sample outside is compared with the crossing of the circle itself.
                let side = |r: f64, y: f64| axis + sign * kappa * chord(r) - y;
                self.crossings(side, |p| offer(along(p)));
                self.silhouettes(b, axis, side, |p| offer(along(p)));
            }
        }
        for rim in &self.caps {
            let t = (rim.y - near.y) / d.y;
            let p = near + d * t;
            if p.x * p.x + p.z * p.z <= rim.x * rim.x {
                offer(shift + t);
            }
        }
        best
    }

    fn at(&self, segment: usize, t: f64) -> DVec2 {
        self.curves[segment].at(t)
    }

    fn crossings(&self, side: impl Fn(f64, f64) -> f64, mut found: impl FnMut(DVec2)) {
        for segment in 0..self.curves.len() {
            let points = &self.points[segment * (STEPS + 1)..][..=STEPS];
            let mut before = side(points[0].0, points[0].1);
            for (k, &(r, y)) in points.iter().enumerate().skip(1) {
                let here = side(r, y);
                if (before > 0.0) != (here > 0.0) && !before.is_nan() && !here.is_nan() {
                    let (a, b) = ((k - 1) as f64 / STEPS as f64, k as f64 / STEPS as f64);
                    let p =
                        self.bisect(segment, (a, b), |p| (side(p.x, p.y) > 0.0) == (before > 0.0));
                    // Between the samples the profile may pass the circle and come back.
                    if !side(p.x, p.y).is_nan() {
                        found(p);
                    }
                }
                before = here;
            }
        }
    }

    /// Changes of sign between the radius `b`, where the ray is at the height `axis`, and the next sample.
    fn silhouettes(
        &self,
        b: f64,
        axis: f64,
        side: impl Fn(f64, f64) -> f64,
        mut found: impl FnMut(DVec2),
    ) {
        for segment in 0..self.curves.len() {
            let points = &self.points[segment * (STEPS + 1)..][..=STEPS];
            for k in 1..=STEPS {
                let (out, inn) = match (points[k - 1].0 >= b, points[k].0 >= b) {
                    (true, false) => (k - 1, k),
                    (false, true) => (k, k - 1),
                    _ => continue,
                };
                let (out, inn) = (out as f64 / STEPS as f64, inn as f64 / STEPS as f64);
                let mut range = (out, inn);
                for _ in 0..80 {
                    let m = f64::midpoint(range.0, range.1);
                    if self.at(segment, m).x >= b { range.0 = m } else { range.1 = m }
                }
                let p = self.at(segment, range.0);
                let (rim, sample) = (axis - p.y, {
                    let p = self.at(segment, out);
                    side(p.x, p.y)
                });
                if (rim > 0.0) != (sample > 0.0) {
                    found(self.bisect(segment, (out, range.0), |p| {
                        (side(p.x, p.y) > 0.0) == (sample > 0.0)
                    }));
                }
            }
        }
    }

    fn bisect(&self, segment: usize, range: (f64, f64), is_first: impl Fn(DVec2) -> bool) -> DVec2 {
        let mut range = range;
        for _ in 0..60 {
            let m = f64::midpoint(range.0, range.1);
            if is_first(self.at(segment, m)) { range.0 = m } else { range.1 = m }
        }
        self.at(segment, range.1)
    }
}

/// A ray of one of the kinds that are hard, or any; of unit size.
fn hard_ray(shape: &Primitive, dense: &Dense, n: &mut Numbers) -> (DVec3, DVec3) {
    let size = dense.size;
    let middle = DVec3::Y * size * 0.5;
    let tiny = |n: &mut Numbers| 10.0_f64.powf(-14.0 + 13.0 * n.next()) * (n.next() - 0.5).signum();
    let kind = (n.next() * 8.0) as u32;
    match kind {
        // From all around, aimed at it.
        0 | 1 => {
            let o = middle + n.direction() * size * (1.0 + 3.0 * n.next());
            (o, middle + n.point() * size * 2.0 - o)
        }
        // Level, or nearly.
        2 => {
            let o = middle + n.point() * size * 3.0;
            let d = n.direction();
            (o, DVec3::new(d.x, if n.next() < 0.2 { 0.0 } else { tiny(n) }, d.z))
        }
        // Along the axis or nearly, on it or near it.
        3 => {
            let o = DVec3::new(tiny(n) * size, -3.0 * size, tiny(n) * size);
            let o = if n.next() < 0.3 { DVec3::new(0.0, o.y, 0.0) } else { o };
            let d = if n.next() < 0.3 { DVec3::Y } else { DVec3::new(tiny(n), 1.0, tiny(n)) };
            (o, d)
        }
        // Across the axis.
        4 => {
            let o = middle + n.direction() * size * 2.0;
            let d = DVec3::Y * (n.next() * 2.0 * size) - o;
            (o, if n.next() < 0.5 { d } else { d + n.direction() * tiny(n) * size })
        }
        // Grazing: through a point of the surface, along it but for a small angle.
        5 | 6 => {
            let u = Vec2::new(n.next() as f32, n.next() as f32);
            let point = shape.sample(u, &DAffine3::IDENTITY).expect("it has an area");
            let normal = shape.surface(point.p, point.face, false).ng.normalize();
            let along = normal.cross(n.direction()).normalize();
            let d = along + normal * tiny(n);
            (point.p + normal * (tiny(n) * size) - d * (size * 2.0 * n.next()), d)
        }
        // From inside.
        _ => (DVec3::new(tiny(n), n.next(), tiny(n)) * size, n.direction()),
    }
}

/// How far a point is from the surface, by the nearest of many points of the profile and from there downhill.
fn distance(dense: &Dense, p: DVec3) -> f64 {
    let at = DVec2::new(p.x.hypot(p.z), p.y);
    let mut least = f64::INFINITY;
    for rim in &dense.caps {
        if at.x <= rim.x {
            least = least.min((at.y - rim.y).abs());
        }
    }
    let per = STEPS + 1;
    let far = |k: &usize| {
        let (r, y) = dense.points[*k];
        (r - at.x).powi(2) + (y - at.y).powi(2)
    };
    // The three best samples: near a fold or a joint the best alone may be on another branch.
    let mut order: Vec<usize> = (0..dense.points.len()).collect();
    order.select_nth_unstable_by(8, |a, b| far(a).total_cmp(&far(b)));
    for k in &order[..8] {
        let (segment, step) = (k / per, k % per);
        let (mut a, mut b) = (
            step.saturating_sub(1) as f64 / STEPS as f64,
            (step + 1).min(STEPS) as f64 / STEPS as f64,
        );
        let d = |t: f64| dense.at(segment, t).distance(at);
        for _ in 0..120 {
            let (m1, m2) = (a + (b - a) * 0.45, a + (b - a) * 0.55);
            if d(m1) < d(m2) { b = m2 } else { a = m1 }
        }
        least = least.min(d(f64::midpoint(a, b)));
    }
    least
}

/// Throws rays at all shapes in all sizes; returns how many.
fn compare_with_oracle(rays_per_shape: u32, seed: u64) -> u32 {
    let mut thrown = 0;
    for (name, curves, capped) in shapes() {
        let (shape, dense) = (primitive(&curves, capped), Dense::new(&curves, capped));
        let sizes = [1e-4, 1e-2, 1.0, 1e2, 1e4];
        let resized: Vec<Primitive> =
            sizes.iter().map(|s| primitive(&scaled(&curves, *s), capped)).collect();
        let (mut hits, mut between, mut touching) = (0, 0, 0);
        for k in 0..rays_per_shape {
            let n = &mut Numbers::new(seed, k);
            let (o, d) = hard_ray(&shape, &dense, n);
            let d = d.normalize();
            let which = k as usize % sizes.len();
            let scale = sizes[which];
            // The length of the direction is any.
            let ray = LocalRay { o: o * scale, d: d * (scale * 3.0) };
            let hit = resized[which].intersect(&ray, f64::INFINITY);
            let t = hit.map_or(f64::INFINITY, |hit| hit.t * 3.0);
            let expected = dense.nearest(o, d);
            thrown += 1;
            hits += u32::from(hit.is_some());
            let tell =
                || format!("{name} × {scale}, ray {k}: {o:?} {d:?}: {t} instead of {expected}");
            // Rounding moves the ray sideways by a few units in the last place of its coordinates.
            let graze = hit.map_or(0.0, |hit| {
                resized[which].surface(ray.at(hit.t), hit.face, false).ng.normalize().dot(d).abs()
            });
            let sideways = (t - expected).abs() * graze;
            if t == expected || sideways <= 16.0 * f64::EPSILON * (dense.size + o.length()) {
                continue;
            }
            // A crossing which the samples of the oracle step over is none the less one: the point is on the surface.
            if t < expected {
                between += 1;
                let off = distance(&dense, o + d * t);
                assert!(
                    off < 4e-15 * dense.size * (1.0 + o.length() / dense.size),
                    "ghost at {off:e}: {}",
                    tell()
                );
                continue;
            }
            // Where the ray only touches, within rounding, either answer is right.
            let p = o + d * expected;
            let shallow = touches(&dense, p, d);
            touching += 1;
            assert!(shallow < 1e-6, "missed by {shallow:e}: {}", tell());
        }
        assert!(hits > rays_per_shape / 4, "{name}: {hits}");
        assert!(touching <= rays_per_shape / 1000, "{name}: {touching}");
        assert!(between < rays_per_shape / 8, "{name}: {between}");
    }
    thrown
}

/// The cosine between the surface near a point of it and a ray through that point; where the surface
/// has a crease or bends within the samples, the least.
fn touches(dense: &Dense, p: DVec3, d: DVec3) -> f64 {
    let at = DVec2::new(p.x.hypot(p.z), p.y);
    let radial = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::X);
    let mut least = f64::INFINITY;
    for curve in &dense.curves {
        for k in 0..STEPS * 50 {
            let t = k as f64 / (STEPS * 50) as f64;
            let here = curve.at(t);
            if here.distance(at) < 1e-4 * dense.size {
                let along = curve.at(t + 1e-7) - here;
                let normal = (radial * along.y - DVec3::Y * along.x).normalize_or(DVec3::ZERO);
                least = least.min(normal.dot(d).abs());
            }
        }
    }
    least
}

#[test]
fn rays_agree_with_a_dense_search() {
    assert_eq!(compare_with_oracle(3000, 1), 27_000);
}

/// A quarter of a minute: `cargo test --release --test revolution -- --ignored`.
#[test]
#[ignore = "takes a quarter of a minute"]
fn a_million_rays_agree_with_a_dense_search() {
    assert!(compare_with_oracle(120_000, 2) >= 1_000_000);
}

/// Oracle: quadrics and a torus in closed form, surface and normal.
#[test]
fn known_shapes_are_met_where_their_formulas_say() {
    let cylinder = primitive(&polyline(&[[0.7, -0.5], [0.7, 0.5]]), true);
    let cone = primitive(&polyline(&[[0.8, -0.5], [0.0, 0.5]]), true);
    let (ball, torus) = (primitive(&ball(1.0), false), primitive(&torus(2.0, 0.5), false));
    let unit = [
        (cylinder, Primitive::Cylinder { capped: true }, DVec3::new(0.7, 1.0, 0.7)),
        (cone, Primitive::Cone { capped: true }, DVec3::new(0.8, 1.0, 0.8)),
        (ball, Primitive::Sphere, DVec3::ONE),
    ];
    for k in 0..20_000 {
        let n = &mut Numbers::new(3, k);
        let (o, d) = (n.point() * 4.0, n.direction());
        for (shape, quadric, scale) in &unit {
            let found = shape.intersect(&LocalRay { o, d }, f64::INFINITY);
            let canonical = LocalRay { o: o / *scale, d: d / *scale };
            let expected = quadric.intersect(&canonical, f64::INFINITY);
            let (Some(a), Some(b)) = (found, expected) else {
                assert_eq!(found.is_some(), expected.is_some(), "{quadric:?}: {o:?} {d:?}");
                continue;
            };
            let p = o + d * b.t;
            let normal = (quadric.surface(p / *scale, b.face, false).ng / *scale).normalize();
            let graze = normal.dot(d).abs();
            assert!((a.t - b.t).abs() * graze < 1e-14, "{quadric:?}: {o:?} {d:?}: {} {}", a.t, b.t);
            let ours = shape.surface(p, a.face, false).ng.normalize();
            assert!(ours.distance(normal) < 1e-9 / graze.max(1e-3), "{quadric:?}: {ours} {normal}");
        }
        if let Some(hit) = torus.intersect(&LocalRay { o, d }, f64::INFINITY) {
            let p = o + d * hit.t;
            let ring = DVec3::new(p.x, 0.0, p.z).normalize() * 2.0;
            let normal = (p - ring) / 0.5;
            assert!((normal.length() - 1.0).abs() < 1e-13);
            assert!(torus.surface(p, hit.face, false).ng.normalize().distance(normal) < 1e-12);
        }
    }
}

/// The volume of a solid by the chords of parallel rays: the sum of their lengths inside, a ray per cell of area.
fn volume_by_chords(shape: &Primitive, radius: f64, rays: u32) -> f64 {
    let mut sum = 0.0;
    for k in 0..rays {
        let n = &mut Numbers::new(4, k);
        let o = DVec3::new(-10.0, (2.0 * n.next() - 1.0) * radius, (2.0 * n.next() - 1.0) * radius);
        let (mut at, mut inside) = (0.0, false);
        while let Some(hit) = shape.intersect(&LocalRay { o: o + DVec3::X * at, d: DVec3::X }, 1e9)
        {
            sum += if inside { hit.t + 1e-9 } else { -1e-9 };
            inside = !inside;
            at += hit.t + 1e-9;
        }
        assert!(!inside, "a ray ends in the solid");
    }
    sum * (2.0 * radius).powi(2) / f64::from(rays)
}

/// Oracles: closed forms of area and volume; the volume again by Monte Carlo, level 5 standard deviations at a
/// relative deviation of a chord of about 1.
#[test]
fn areas_and_volumes_are_those_of_the_solids() {
    let k = 4.0 * (2.0_f64.sqrt() - 1.0) / 3.0;
    let bezier_ball =
        bezier(&[[0.0, -1.0], [k, -1.0], [1.0, -k], [1.0, 0.0], [1.0, k], [k, 1.0], [0.0, 1.0]]);
    let lathe = polyline(&[[0.8, -0.5], [0.0, 0.5]]);
    let cases = [
        (ball(1.0), false, 4.0 * PI, 4.0 / 3.0 * PI, 1.0),
        (bezier_ball, false, 4.0 * PI * 1.000_280_619, 4.0 / 3.0 * PI * 1.000_420_532, 1.01),
        (torus(2.0, 0.5), false, 39.478_417_604_4, 9.869_604_401_1, 2.5),
        (bezier(&VASE), false, 6.056_988_461_7, 1.738_804_213_92, 1.2),
        (lathe, true, PI * 0.8 * (1.64_f64.sqrt() + 0.8), PI * 0.64 / 3.0, 0.8),
    ];
    for (curves, capped, area, volume, radius) in cases {
        let shape = turned(&curves, capped);
        assert!((shape.area() / area - 1.0).abs() < 1e-9, "{} instead of {area}", shape.area());
        let v = shape.profile().volume;
        assert!((v / volume - 1.0).abs() < 1e-9, "{v} instead of {volume}");
        let solid = Primitive::Revolution(Revolution::new(Arc::new(shape.profile().clone()), true));
        let chords = volume_by_chords(&solid, radius, 40_000);
        assert!((chords / volume - 1.0).abs() < 5.0 * 1.5 / 200.0, "{chords} instead of {volume}");
    }
}

/// Oracle: a closed surface faces out whichever way its profile runs; asked by rays from outside and inside.
#[test]
fn closed_surfaces_face_outwards() {
    for (name, curves, capped) in shapes() {
        let closed = capped || !matches!(name, "vase" | "folded");
        let backwards: Vec<Cubic> =
            curves.iter().rev().map(|c| Cubic([c.0[3], c.0[2], c.0[1], c.0[0]])).collect();
        let both = [primitive(&curves, capped), primitive(&backwards, capped)];
        for k in 0..300 {
            let n = &mut Numbers::new(6, k);
            let d = n.direction();
            let ray = LocalRay { o: DVec3::Y * 0.7 + n.point() - d * 9.0, d };
            let sides = both.each_ref().map(|shape| {
                let hit = shape.intersect(&ray, f64::INFINITY)?;
                Some(shape.surface(ray.at(hit.t), hit.face, false).ng.dot(d) < 0.0)
            });
            if closed && name != "cusp" {
                assert!(sides.iter().all(|front| front.is_none_or(|front| front)), "{name}, {k}");
            } else if !closed {
                assert_eq!(sides[0], sides[1].map(|front| !front), "{name}, {k}");
            }
        }
    }
}

/// Oracle: the share of the area between two heights, and of each of the faces, by the closed form of a sphere.
#[test]
fn points_are_drawn_evenly_over_the_area() {
    let shape = primitive(&ball(2.0), false);
    let mut counts = [0_u32; 16];
    let samples = 16_000;
    for k in 0..samples {
        let u = Sampler::new(9, 0, (k, 0), 0).two(0);
        let point = shape.sample(u, &DAffine3::IDENTITY).expect("it has an area");
        let surface = shape.surface(point.p, point.face, true);
        assert!(surface.p.distance(point.p) < 1e-14 && (point.p.length() - 2.0).abs() < 1e-14);
        assert!((point.pdf_area * 16.0 * PI - 1.0).abs() < 1e-12);
        counts[((point.p.y / 4.0 + 0.5) * 16.0).min(15.0) as usize] += 1;
    }
    // Bands of equal height have equal area. χ² with 15 degrees of freedom, level 1e-6: 54.9.
    let expected = f64::from(samples) / 16.0;
    let chi2: f64 = counts.iter().map(|c| (f64::from(*c) - expected).powi(2) / expected).sum();
    assert!(chi2 < 54.9, "{chi2}: {counts:?}");
    for (name, curves, capped) in shapes() {
        let shape = turned(&curves, capped);
        let world = Primitive::Revolution(shape.clone()).world_area(&DAffine3::IDENTITY);
        assert!((world / shape.area() - 1.0).abs() < 1e-9, "{name}");
    }
}

/// The wine glass of `scenes/glass.ron` and its wine, by the drawing: volumes in cubic metres, and the wine reaches a quarter of
/// a millimetre into the glass, whose wall is more than a millimetre thick.
#[test]
fn the_wine_fills_its_glass() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/glass.ron");
    let scene = load_scene(&path, &LoadOptions::default()).expect("it is valid");
    let profile = |name: &str| {
        let Some(Shape::Revolution { profile, .. }) = &scene.entities[name].shape else {
            panic!("{name} is turned")
        };
        profile.clone()
    };
    let (glass, wine) = (profile("glass 1"), profile("wine 1"));
    assert!((60.95e-6..61.05e-6).contains(&glass.volume), "{}", glass.volume);
    assert!((195.5e-6..196.5e-6).contains(&wine.volume), "{}", wine.volume);
    assert_eq!((glass.open_ends, wine.open_ends), ([None; 2], [None; 2]));
    // Seen from the wine, the glass begins just inside of it and ends beyond.
    let [glass, wine] =
        [glass, wine].map(|profile| Primitive::Revolution(Revolution::new(profile, false)));
    for k in 0..2000 {
        let n = &mut Numbers::new(8, k);
        let d = n.direction();
        let o = DVec3::Y * (0.1 + 0.04 * n.next());
        let exit = wine.intersect(&LocalRay { o, d }, f64::INFINITY).expect("it is inside").t;
        let p = o + d * exit;
        if p.y > 0.1455 {
            // The surface, or the wall above it.
            continue;
        }
        let enter = glass.intersect(&LocalRay { o, d }, f64::INFINITY).expect("the wall").t;
        let face = wine.intersect(&LocalRay { o, d }, f64::INFINITY).expect("as before").face;
        let cos = wine.surface(p, face, false).ng.normalize().dot(d);
        let depth = (exit - enter) * cos;
        assert!((2e-4..3e-4).contains(&depth), "{depth} deep at {p}");
        let beyond = LocalRay { o: o + d * (exit + 1e-9), d };
        let thickness = glass.intersect(&beyond, f64::INFINITY).expect("the outside").t * cos;
        assert!(thickness > 5e-4, "{thickness} at {p}");
    }
}

/// Oracle: a mesh of the vase of 1000 chords around and 400 along, at most `e` off. Hits and misses are the same but for
/// rays that graze it within `e`, a share of about √(2e/r), 0.6 %; and so are places, but where rays meet it at so flat an
/// angle that it bends by more than `e` over the way between both.
#[test]
fn a_fine_mesh_is_met_at_the_same_places() {
    let shape = primitive(&bezier(&VASE), false);
    let curve = bezier(&VASE)[0];
    let (around, along) = (1000_u32, 400_u32);
    let mut mesh = TriangleMesh::default();
    for j in 0..=along {
        let p = curve.at(f64::from(j) / f64::from(along));
        for i in 0..around {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
            mesh.positions.push(DVec3::new(p.x * sin, p.y, p.x * cos).as_vec3());
        }
    }
    for j in 0..along {
        for i in 0..around {
            let at = |i: u32, j: u32| j * around + i % around;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let tree = MeshTree::build(Arc::new(mesh), BvhQuality::Fast);
    // r·(1 − cos(π/n)) around the axis, and along it |P''|/8n² with |P''| ≤ 6·|P₀ − 2P₁ + P₂| = 10.4.
    let error = 0.8 * (1.0 - (PI / f64::from(around)).cos()) + 1.3 / f64::from(along).powi(2);
    let mut differ = 0;
    for k in 0..20_000 {
        let n = &mut Numbers::new(10, k);
        let o = DVec3::Y * 0.6 + n.direction() * 3.0;
        let ray = LocalRay { o, d: (DVec3::Y * 0.6 + n.point() * 1.6 - o).normalize() };
        let ours = shape.intersect(&ray, f64::INFINITY);
        let theirs = tree.closest_hit(&ray, 0.0, f64::INFINITY);
        let (Some(a), Some(b)) = (ours, &theirs) else {
            differ += u32::from(ours.is_some() != theirs.is_some());
            continue;
        };
        let cos = shape.surface(ray.at(a.t), a.face, false).ng.normalize().dot(ray.d).abs();
        // Half the square of the way, e/0.03, over the least radius, 0.3: e/40.
        if cos > 0.03 {
            let apart = (a.t - b.t).abs() * cos;
            assert!(apart < 1.1 * error, "{ray:?}: {apart:e} apart, {cos}");
        } else {
            differ += u32::from((a.t - b.t).abs() > 0.05);
        }
    }
    assert!(differ < 20_000 * 6 / 1000, "{differ}");
}

/// A profile with nothing to turn, or across the axis, is an error which says where; ugly ones are defined.
#[test]
fn bad_profiles_are_errors_and_ugly_ones_are_surfaces() {
    let empty = |curves: &[Cubic]| Profile::new(curves).expect_err("nothing to turn");
    assert_eq!(empty(&[]), ProfileError::Empty);
    assert_eq!(empty(&bezier(&[[0.5, 0.5]; 4])), ProfileError::Empty);
    assert_eq!(empty(&polyline(&[[0.0, 0.0], [0.0, 1.0]])), ProfileError::Empty);
    let crossing = polyline(&[[1.0, 0.0], [0.5, 1.0], [-0.25, 2.0]]);
    assert_eq!(empty(&crossing), ProfileError::NegativeRadius { segment: 1, radius: -0.25 });
    let dips = bezier(&[[1.0, 0.0], [-2.0, 0.3], [-2.0, 0.6], [1.0, 1.0]]);
    assert!(
        matches!(empty(&dips), ProfileError::NegativeRadius { segment: 0, radius } if radius < -1.0)
    );
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY] {
        let curves = bezier(&[[1.0, 0.0], [1.0, bad], [1.0, 0.6], [1.0, 1.0]]);
        assert_eq!(empty(&curves), ProfileError::OutOfRange { segment: 0 });
    }
    let weightless = Cubic::new([DVec2::X, DVec2::ONE, DVec2::ONE, DVec2::Y], [1.0, 0.0, 1.0, 1.0]);
    assert_eq!(empty(&[weightless]), ProfileError::OutOfRange { segment: 0 });
    // Repeated points, a loop that crosses itself, a touch of the axis.
    for points in [
        vec![[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.5, 1.0]],
        vec![[0.2, 0.0], [2.0, 1.0], [-0.5, 1.0], [1.0, 0.0]],
        vec![[1.0, 0.0], [0.0, 0.0], [-1.0 / 3.0, 1.0], [1.0, 1.0]],
    ] {
        let profile = Profile::new(&bezier(&points)).expect("it is a surface");
        assert!(profile.pieces.len() < 64 && profile.memory() < 32_768);
    }
}
