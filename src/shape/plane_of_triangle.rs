//! Where a ray meets a triangle, decided where rounding of `f64` leaves it open.

use crate::math::TwofoldVec3;
use glam::{DVec2, DVec3};

/// The hit at `t > 0` of a triangle whose edges are all passed on the same side, to within their rounding, and
/// the weights of its second and third corner.
///
/// With the corners `a`, `b`, `c` as seen from the origin of the ray the volumes `U = d·(c × b)`, `V = d·(a × c)`
/// and `W = d·(b × a)` are as the weights, and
///
/// ```text
/// t = a·(c × b) / (U + V + W)
/// ```
///
/// Differences are exact here, and of products and sums about 104 bits: what is left of them when a strip a
/// million times as long as wide is seen from near is far more than an `f64` holds.
///
/// A ray which passes beside the triangle by the rounding of the edges is moved to its nearest point by weights,
/// so that what is found lies in the box of the triangle: none of its neighbours has that ray.
#[cold]
#[inline(never)]
pub(super) fn decide(o: DVec3, d: DVec3, corners: [DVec3; 3]) -> Option<(f64, DVec2)> {
    let [a, b, c] = corners.map(|corner| TwofoldVec3::difference(corner, o));
    let along = TwofoldVec3::from(d);
    let [u, v, w] = [c.cross(b), a.cross(c), b.cross(a)];
    let depth = a.dot(u).value();
    let [u, v, w] = [u, v, w].map(|area| along.dot(area));
    let det = (u + v + w).value();
    let t = depth / det;
    if !(t > 0.0 && t.is_finite()) {
        return None;
    }
    let [first, second, third] = [u, v, w].map(|volume| volume.value() / det);
    if first >= 0.0 && second >= 0.0 && third >= 0.0 {
        return Some((t, DVec2::new(second, third)));
    }
    let [first, second, third] = [first, second, third].map(|weight| weight.max(0.0));
    let weights = DVec2::new(second, third) / (first + second + third);
    let [a, b, c] = [a, b, c].map(TwofoldVec3::value);
    let p = a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
    let t = p.dot(d) / d.length_squared();
    (t > 0.0).then_some((t, weights))
}
