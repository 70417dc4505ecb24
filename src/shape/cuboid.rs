//! The unit cube. Faces are numbered −x, +x, −y, +y, −z, +z.

use super::{AreaFactor, CanonicalPoint, LocalHit, LocalRay, LocalSurface};
use crate::math::Chart;
use glam::{DAffine3, DVec3, Vec2};

pub(super) fn intersect(ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut enter_face, mut leave_face) = (0, 0);
    for axis in 0..3 {
        let (o, d) = (ray.o[axis], ray.d[axis]);
        if d == 0.0 {
            if o.abs() > 0.5 {
                return None;
            }
            continue;
        }
        // The side which the ray meets first has the sign opposite to its direction.
        let side = 0.5_f64.copysign(-d);
        let (near, far) = ((side - o) / d, (-side - o) / d);
        let near_face = axis as u32 * 2 + u32::from(side > 0.0);
        if near > enter {
            (enter, enter_face) = (near, near_face);
        }
        if far < leave {
            (leave, leave_face) = (far, near_face ^ 1);
        }
    }
    if enter > leave {
        return None;
    }
    let (t, face) = if enter > 0.0 { (enter, enter_face) } else { (leave, leave_face) };
    (t > 0.0 && t < t_max).then_some(LocalHit { t, face })
}

/// The normal of a face.
pub(super) fn normal(face: u32) -> DVec3 {
    let sign = if face & 1 == 1 { 1.0 } else { -1.0 };
    DVec3::AXES[(face / 2) as usize] * sign
}

/// The direction in which u grows on a face: to the right as seen from outside, +y (or, on top, −z)
/// up.
pub(super) fn right(face: u32) -> DVec3 {
    [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::X, DVec3::NEG_X, DVec3::X][face as usize]
}

pub(super) fn surface(p: DVec3, face: u32) -> LocalSurface {
    let n = normal(face);
    let x = right(face);
    let y = n.cross(x);
    let axis = (face / 2) as usize;
    let mut on_face = p;
    on_face[axis] = 0.5 * n[axis];
    let uv = (0.5 + on_face.dot(x), 0.5 + on_face.dot(y));
    LocalSurface::smooth(on_face, n, uv, Chart::SQUARE, x)
}

/// The probabilities with which [`sample`] takes the faces: their shares of the world's area.
pub(super) fn face_probabilities(world_from_shape: &DAffine3) -> [f64; 6] {
    let factor = AreaFactor::new(&world_from_shape.matrix3);
    let areas = DVec3::AXES.map(|n| factor.at(n));
    let total = 2.0 * (areas[0] + areas[1] + areas[2]);
    std::array::from_fn(|face| areas[face / 2] / total)
}

pub(super) fn sample(u: Vec2, world_from_shape: &DAffine3) -> CanonicalPoint {
    let probabilities = face_probabilities(world_from_shape);
    let mut x = f64::from(u.x);
    let mut face = 0;
    while face < 5 && x >= probabilities[face] {
        x -= probabilities[face];
        face += 1;
    }
    let x = (x / probabilities[face]).min(1.0);
    let n = normal(face as u32);
    let across = right(face as u32);
    let p = n * 0.5 + across * (x - 0.5) + n.cross(across) * (f64::from(u.y) - 0.5);
    CanonicalPoint { p, face: face as u32, pdf_area: probabilities[face] }
}
