//! The cylinder of radius 1 around y from −½ to ½. Faces: 0 the side, 1 the lower, 2 the upper end.

use super::{AreaFactor, CanonicalPoint, LocalHit, LocalRay, LocalSurface, longitude, recentred};
use crate::math::Chart;
use crate::sampling::warp::square_to_disk;
use glam::{DAffine3, DVec3, Vec2};
use std::f64::consts::{PI, TAU};

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
    let a = d.x * d.x + d.z * d.z;
    if a > 0.0 {
        // Closest approach to the axis, and from there half a chord to both sides.
        let middle = -(o.x * d.x + o.z * d.z) / a;
        let (x, z) = (o.x + middle * d.x, o.z + middle * d.z);
        let discriminant = 1.0 - (x * x + z * z);
        if discriminant >= 0.0 {
            let half_chord = (discriminant / a).sqrt();
            for t in [middle - half_chord, middle + half_chord] {
                if (o.y + t * d.y).abs() <= 0.5 {
                    offer(t, 0);
                }
            }
        }
    }
    if capped && d.y != 0.0 {
        for (face, y) in [(1, -0.5), (2, 0.5)] {
            let t = (y - o.y) / d.y;
            let p = o + d * t;
            if p.x * p.x + p.z * p.z <= 1.0 {
                offer(t, face);
            }
        }
    }
    best
}

pub(super) fn surface(p: DVec3, face: u32) -> LocalSurface {
    match face {
        0 => {
            let radial = DVec3::new(p.x, 0.0, p.z).normalize();
            let on_side = DVec3::new(radial.x, p.y, radial.z);
            let uv = (longitude(p), p.y + 0.5);
            let dpdu = DVec3::new(radial.z, 0.0, -radial.x);
            LocalSurface::smooth(on_side, radial, uv, Chart::AROUND, dpdu)
        }
        1 => cap(p, -0.5),
        _ => cap(p, 0.5),
    }
}

/// An end at height `y`, seen from outside with +x to the right.
pub(super) fn cap(p: DVec3, y: f64) -> LocalSurface {
    let normal = DVec3::new(0.0, y.signum(), 0.0);
    let uv = (0.5 + 0.5 * p.x, 0.5 - 0.5 * p.z * y.signum());
    LocalSurface::smooth(DVec3::new(p.x, y, p.z), normal, uv, Chart::SQUARE, DVec3::X)
}

/// The probabilities of side, lower and upper end: about their shares of the world's area.
fn face_probabilities(world_from_shape: &DAffine3, capped: bool) -> [f64; 3] {
    let factor = AreaFactor::new(&world_from_shape.matrix3);
    let side = TAU * 0.5 * (factor.at(DVec3::X) + factor.at(DVec3::Z));
    let end = if capped { PI * factor.at(DVec3::Y) } else { 0.0 };
    let total = side + 2.0 * end;
    [side / total, end / total, end / total]
}

pub(super) fn pdf_area(face: u32, world_from_shape: &DAffine3, capped: bool) -> f64 {
    let area = if face == 0 { TAU } else { PI };
    face_probabilities(world_from_shape, capped)[face as usize] / area
}

pub(super) fn sample(u: Vec2, world_from_shape: &DAffine3, capped: bool) -> CanonicalPoint {
    let probabilities = face_probabilities(world_from_shape, capped);
    let x = f64::from(u.x);
    if x < probabilities[0] {
        let (sin, cos) = (TAU * x / probabilities[0]).sin_cos();
        let p = DVec3::new(sin, f64::from(u.y) - 0.5, cos);
        return CanonicalPoint { p, face: 0, pdf_area: probabilities[0] / TAU };
    }
    let x = ((x - probabilities[0]) / (1.0 - probabilities[0])).min(1.0);
    let (face, x) = if x < 0.5 { (1, 2.0 * x) } else { (2, 2.0 * x - 1.0) };
    let disk = square_to_disk(Vec2::new(x as f32, u.y)).as_dvec2();
    let p = DVec3::new(disk.x, if face == 1 { -0.5 } else { 0.5 }, disk.y);
    CanonicalPoint { p, face, pdf_area: probabilities[face as usize] / PI }
}
