//! A ray prepared for the test against boxes in `f32`.

use crate::math::Aabb;
use crate::shape::LocalRay;
use glam::DVec3;
use std::array;

/// Half the distance from 1 to the next `f32`: the relative error of one rounding.
pub(super) const UNIT: f64 = f32::EPSILON as f64 * 0.5;

/// Axes, and one more that fills a vector register.
pub(super) const LANES: usize = 4;

/// A ray of `f64` which meets boxes of `f32` without missing any.
///
/// A plane at `b` is met at `(b − o)/d`. Where the ray would enter a box it is computed too small, and
/// where it would leave too large, each plane by itself: the origin is rounded to either side, and the
/// reciprocal direction is made smaller or larger by 4 units of rounding. Three roundings follow (that
/// of the reciprocal, of the difference and of the product) and (1 ± u)³·(1 ∓ 4u) stays on the safe
/// side of 1. This is the idea of Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2), section 3, extended
/// to origins which are no `f32`.
///
/// The direction is scaled by a power of two so that its longest component is near 1. No reciprocal
/// is then below 1 and no product underflows, whatever the scale of the scene. A component so small
/// that its reciprocal overflows gives infinite distances on the far side and finite ones on the near
/// side; 0·∞ is NaN, which the comparisons of the test drop. So no direction needs a threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BoxRay {
    /// Origin for the planes through which the ray enters.
    pub(super) near_origin: [f32; LANES],
    /// Origin for the planes through which it leaves.
    pub(super) far_origin: [f32; LANES],
    /// `−1/d` for entering.
    pub(super) near_inverse: [f32; LANES],
    /// `−1/d` for leaving.
    pub(super) far_inverse: [f32; LANES],
    /// Which planes of a node the ray enters through, by axis; it leaves through `near ^ 1`.
    pub(super) near_planes: [usize; 3],
    /// Distances of the boxes per ray parameter.
    pub(super) scale: f64,
}

/// How the direction of a [`BoxRay`] is scaled, by powers of two.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    /// Of the direction, whose longest component is near 1 then.
    pub(super) shrink: f64,
    /// Of the ray parameter.
    pub(super) scale: f64,
}

impl Scale {
    /// `None` for a ray without a direction or a place.
    #[inline(always)]
    pub(super) fn of(ray: &LocalRay) -> Option<Self> {
        let longest = larger(larger(ray.d.x.abs(), ray.d.y.abs()), ray.d.z.abs());
        // What is not finite stays so when it is multiplied by 0.
        let zero = (ray.d * 0.0 + ray.o * 0.0).element_sum();
        if !(longest > 0.0 && zero == 0.0) {
            return None;
        }
        // Exponents for which both powers below are normal numbers: only lengths beyond 1e±307 differ.
        let exponent = (longest.to_bits() >> 52).clamp(1, 2044);
        let shrink = f64::from_bits((2045 - exponent) << 52);
        Some(Self { shrink, scale: f64::from_bits((exponent + 1) << 52) })
    }
}

impl BoxRay {
    /// `None` for a ray without a direction or a place, which meets nothing.
    #[inline(always)]
    pub(super) fn new(ray: &LocalRay) -> Option<Self> {
        let Scale { shrink, scale } = Scale::of(ray)?;
        let (o, d) = (padded(ray.o), padded(ray.d));
        let inverse = d.map(|d| -1.0 / (d * shrink));
        let aside: [f64; LANES] = array::from_fn(|k| rounding_of(o[k]).copysign(d[k]));
        Some(Self {
            near_origin: array::from_fn(|k| finite((o[k] + aside[k]) as f32)),
            far_origin: array::from_fn(|k| finite((o[k] - aside[k]) as f32)),
            near_inverse: inverse.map(|i| finite((i * (1.0 - 4.0 * UNIT)) as f32)),
            far_inverse: inverse.map(|i| (i * (1.0 + 4.0 * UNIT)) as f32),
            near_planes: array::from_fn(|axis| 2 * axis + usize::from(d[axis].is_sign_negative())),
            scale,
        })
    }

    /// The distance of boxes for a ray parameter, not below it.
    #[inline(always)]
    pub(super) fn distance(&self, t: f64) -> f32 {
        let exact = t * self.scale;
        let rounded = exact as f32;
        if f64::from(rounded) < exact { rounded.next_up() } else { rounded }
    }

    /// Whether the ray is in the box of a triangle before or at the parameter `t` of a hit.
    ///
    /// A ray in the plane of a triangle gives edge functions which are nothing but rounding; when
    /// they happen to agree in sign they report a hit anywhere along the plane. Such hits are left
    /// out by this test. It rounds like that of the nodes, every step of which is monotonic: a ray
    /// that passes here passes the boxes of all nodes above as well, so that the tree never decides.
    #[inline(always)]
    pub(super) fn reaches(&self, bounds: &Aabb, t: f64) -> bool {
        let planes = [bounds.min, bounds.max];
        let (mut near, mut far) = (0.0, self.distance(t));
        for (axis, plane) in self.near_planes.into_iter().enumerate() {
            let side = plane % 2;
            let a = (self.near_origin[axis] - planes[side][axis]) * self.near_inverse[axis];
            near = if a > near { a } else { near };
            let b = (self.far_origin[axis] - planes[side ^ 1][axis]) * self.far_inverse[axis];
            far = if b < far { b } else { far };
        }
        near <= far
    }
}

/// The vector with a number which does no harm in the lane without an axis.
#[inline(always)]
pub(super) fn padded(v: DVec3) -> [f64; LANES] {
    [v.x, v.y, v.z, 1.0]
}

/// The larger of two numbers. `max` has to look for NaN, which takes three times as long.
#[inline(always)]
pub(super) fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The number, or the greatest on its side of 0.
#[inline(always)]
fn finite(x: f32) -> f32 {
    let x = if x < f32::MAX { x } else { f32::MAX };
    if x > f32::MIN { x } else { f32::MIN }
}

/// Half a unit in the last place of a number, that of `f64` included.
pub(super) const ROUNDING: f64 = UNIT + UNIT * UNIT;
/// The least `f32` above 0.
pub(super) const LEAST: f64 = f32::from_bits(1) as f64;

/// So much from `o` any `f32` lies on that side of it after rounding: half a unit in the last place, that
/// of `f64` included, or half the least number.
#[inline(always)]
fn rounding_of(o: f64) -> f64 {
    o.abs() * ROUNDING + LEAST
}
