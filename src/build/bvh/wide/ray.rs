//! A ray prepared for the test against boxes in `f32`.

use crate::math::Aabb;
use crate::shape::LocalRay;

/// Half the distance from 1 to the next `f32`: the relative error of one rounding.
const UNIT: f64 = f32::EPSILON as f64 * 0.5;

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
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxRay {
    /// Origin for the planes through which the ray enters.
    pub(super) near_origin: [f32; 3],
    /// Origin for the planes through which it leaves.
    pub(super) far_origin: [f32; 3],
    /// `−1/d` for entering.
    pub(super) near_inverse: [f32; 3],
    /// `−1/d` for leaving.
    pub(super) far_inverse: [f32; 3],
    /// Which planes of a node the ray enters through, by axis; it leaves through `near ^ 1`.
    pub(super) near_planes: [usize; 3],
    /// Distances of the boxes per ray parameter.
    scale: f64,
}

impl BoxRay {
    /// `None` for a ray without a direction or a place, which meets nothing.
    #[inline(always)]
    pub(super) fn new(ray: &LocalRay) -> Option<Self> {
        let longest = ray.d.abs().max_element();
        if !(longest > 0.0 && longest < f64::INFINITY && ray.o.is_finite()) {
            return None;
        }
        // Exponents for which both powers below are normal numbers: only lengths beyond 1e±307 differ.
        let exponent = (longest.to_bits() >> 52).clamp(1, 2044);
        let shrink = f64::from_bits((2045 - exponent) << 52);
        let inverse = (ray.d * shrink).recip();
        let mut this = Self {
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            near_inverse: [0.0; 3],
            far_inverse: [0.0; 3],
            near_planes: [0; 3],
            scale: f64::from_bits((exponent + 1) << 52),
        };
        for axis in 0..3 {
            let (o, d, i) = (ray.o[axis], ray.d[axis], -inverse[axis]);
            this.near_planes[axis] = 2 * axis + usize::from(d.is_sign_negative());
            this.near_inverse[axis] = ((i * (1.0 - 4.0 * UNIT)) as f32).clamp(f32::MIN, f32::MAX);
            this.far_inverse[axis] = (i * (1.0 + 4.0 * UNIT)) as f32;
            let aside = rounding_of(o).copysign(d);
            this.near_origin[axis] = ((o + aside) as f32).clamp(f32::MIN, f32::MAX);
            this.far_origin[axis] = ((o - aside) as f32).clamp(f32::MIN, f32::MAX);
        }
        Some(this)
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

/// So much from `o` any `f32` lies on that side of it after rounding: half a unit in the last place, that
/// of `f64` included, or half the least number.
#[inline(always)]
fn rounding_of(o: f64) -> f64 {
    o.abs() * (UNIT + UNIT * UNIT) + f64::from(f32::from_bits(1))
}
