//! The cone around y with radius 1 at y = −½ and its tip at y = ½. Faces: 0 the side, 1 the base.

use super::{
    AreaFactor, CanonicalPoint, LocalHit, LocalRay, LocalSurface, cylinder, longitude, recentred,
};
use crate::math::Chart;
use crate::sampling::warp::square_to_disk;
use glam::{DAffine3, DVec3, Vec2};
use std::f64::consts::{PI, SQRT_2};

/// Area of the side: π·r·√(r² + h²).
const SIDE_AREA: f64 = PI * SQRT_2;

pub(super) fn intersect(ray: &LocalRay, t_max: f64, capped: bool) -> Option<LocalHit> {
    let (near, shift) = recentred(ray);
    let (o, d) = (near.o, near.d);
    let mut best: Option<LocalHit> = None;
    let mut offer = |t: f64, face: u32| {
        let t = t + shift;
        if t > 0.0 && t < t_max && best.is_none_or(|b| t < b.t) {
            best = Some(LocalHit { t, face });
        }
    };
    // x² + z² = r², r = ½ − y: along the ray r = h − d.y·t
    let h = 0.5 - o.y;
    let a = d.x * d.x + d.z * d.z - d.y * d.y;
    let half_b = o.x * d.x + o.z * d.z + h * d.y;
    let c = o.x * o.x + o.z * o.z - h * h;
    for t in quadratic_roots(a, half_b, c) {
        if (o.y + t * d.y).abs() <= 0.5 {
            offer(t, 0);
        }
    }
    if capped && d.y != 0.0 {
        let t = (-0.5 - o.y) / d.y;
        let p = o + d * t;
        if p.x * p.x + p.z * p.z <= 1.0 {
            offer(t, 1);
        }
    }
    best
}

/// The roots of `a·t² + 2·b·t + c`, without cancellation; NaN or infinite where there are none.
fn quadratic_roots(a: f64, half_b: f64, c: f64) -> [f64; 2] {
    let discriminant = half_b * half_b - a * c;
    if discriminant < 0.0 {
        return [f64::NAN; 2];
    }
    // q = −(b + sign(b)·√Δ) adds numbers of equal sign; the roots are q/a and c/q.
    let q = -(half_b + discriminant.sqrt().copysign(half_b));
    [q / a, c / q]
}

pub(super) fn surface(p: DVec3, face: u32) -> LocalSurface {
    if face == 1 {
        return cylinder::cap(p, -0.5);
    }
    let r = (0.5 - p.y).clamp(0.0, 1.0);
    let radial = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z);
    let on_side = DVec3::new(radial.x * r, p.y, radial.z * r);
    let normal = radial + DVec3::Y;
    let uv = (longitude(radial), p.y + 0.5);
    let dpdu = DVec3::new(radial.z, 0.0, -radial.x);
    LocalSurface::smooth(on_side, normal, uv, Chart::AROUND, dpdu)
}

/// The probability of the side: about its share of the world's area.
fn side_probability(world_from_shape: &DAffine3, capped: bool) -> f64 {
    if !capped {
        return 1.0;
    }
    let factor = AreaFactor::new(&world_from_shape.matrix3);
    let slopes = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z].map(|n| factor.at(n + DVec3::Y));
    let side = SIDE_AREA * slopes.iter().sum::<f64>() / 4.0;
    side / (side + PI * factor.at(DVec3::Y))
}

pub(super) fn pdf_area(face: u32, world_from_shape: &DAffine3, capped: bool) -> f64 {
    let side = side_probability(world_from_shape, capped);
    if face == 0 { side / SIDE_AREA } else { (1.0 - side) / PI }
}

pub(super) fn sample(u: Vec2, world_from_shape: &DAffine3, capped: bool) -> CanonicalPoint {
    let side = side_probability(world_from_shape, capped);
    let x = f64::from(u.x);
    // Unrolled, side and base are both disks around the axis: radius r goes to height ½ − r.
    let (x, on_side) = if x < side { (x / side, true) } else { ((x - side) / (1.0 - side), false) };
    let disk = square_to_disk(Vec2::new((x as f32).min(1.0), u.y)).as_dvec2();
    let height = if on_side { 0.5 - disk.length() } else { -0.5 };
    let p = DVec3::new(disk.x, height, disk.y);
    let face = u32::from(!on_side);
    CanonicalPoint { p, face, pdf_area: pdf_area(face, world_from_shape, capped) }
}
