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

    /// The ray for fused multiplication, for boxes whose coordinates are within `reach` of 0.
    #[inline(always)]
    pub(super) fn fused(&self, reach: f32) -> FusedRay {
        let size = reach + self.near_origin.iter().fold(0.0, |size, o| o.abs().max(size));
        let mut fused = FusedRay { slope: [0.0; 3], near_base: [0.0; 3], far_base: [0.0; 3] };
        for axis in 0..3 {
            let inverse = self.near_inverse[axis].clamp(-STEEPEST, STEEPEST);
            let base = self.near_origin[axis] * inverse;
            let slack = (size * SLACK) * inverse.abs();
            fused.slope[axis] = -inverse;
            fused.near_base[axis] = base - slack;
            fused.far_base[axis] = base + slack;
        }
        fused
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

/// A [`BoxRay`] for fused multiplication: a plane at `b` is met at `b·slope + base`.
///
/// This takes half the instructions, but what is rounded is relative to the size of the numbers and not
/// to the distance. With u the relative error of one rounding and P the largest coordinate of a
/// box, the slope is off by 6 u at most (5 u of its making in [`BoxRay`], and its own rounding), which moves
/// the plane by 6 u·P in space and the origin by 6 u·|o|; the origin is off by 2 u·|o|, and the sums and
/// products are rounded 4 times, each by u·(P + |o|) at most. [`BoxRay::reaches`] is more generous than the
/// exact ray by 7 u of the distance and 2 u·|o|, and must not be where this is not. All of this is below
/// 24 u·(P + |o|) in space, and the bases are moved by 32.
///
/// A slope which is too steep for products in the range of numbers is made less steep. Where the ray
/// enters is then too early, which is allowed; where it leaves is right if negative by more than the slack, and
/// otherwise at least 2⁵⁰·16 u·(P + |o|), which is beyond every box.
#[derive(Clone, Copy, Debug)]
pub(super) struct FusedRay {
    /// `1/d`.
    pub(super) slope: [f32; 3],
    /// `−o/d`, lowered.
    pub(super) near_base: [f32; 3],
    /// `−o/d`, raised.
    pub(super) far_base: [f32; 3],
}

/// What a [`FusedRay`] adds to distances in space, relative to the size of the numbers.
const SLACK: f32 = 32.0 * UNIT as f32;
/// The steepest slope of a [`FusedRay`], 2⁵⁰.
const STEEPEST: f32 = (1_u64 << 50) as f32;
/// Where the product of the steepest slope and any coordinate, and the slack, are normal numbers: 2⁷⁰.
const WIDEST: f64 = (1_u128 << 70) as f64;

/// Whether ray and boxes, whose coordinates are within `reach` of 0, are of a size for [`BoxRay::fused`].
#[inline(always)]
pub(super) fn can_be_fused(ray: &LocalRay, reach: f32) -> bool {
    let size = ray.o.abs().max_element() + f64::from(reach);
    (WIDEST.recip()..WIDEST).contains(&size)
}

/// So much from `o` any `f32` lies on that side of it after rounding: half a unit in the last place, that
/// of `f64` included, or half the least number.
#[inline(always)]
fn rounding_of(o: f64) -> f64 {
    o.abs() * (UNIT + UNIT * UNIT) + f64::from(f32::from_bits(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use glam::{DVec3, Vec3};

    /// The test of a box by fused multiplication, as the vector instructions do it.
    fn enters(ray: &BoxRay, reach: f32, bounds: &Aabb, t: f64) -> bool {
        let FusedRay { slope, near_base, far_base } = ray.fused(reach);
        let planes = [bounds.min, bounds.max];
        let (mut near, mut far) = (0.0_f32, ray.distance(t));
        for axis in 0..3 {
            let side = ray.near_planes[axis] % 2;
            near = near.max(planes[side][axis].mul_add(slope[axis], near_base[axis]));
            far = far.min(planes[side ^ 1][axis].mul_add(slope[axis], far_base[axis]));
        }
        near <= far
    }

    /// Rays to a corner or an edge of a box, most of them nearly or exactly along an axis, from near and
    /// far: where rounding decides whether a box is met. Oracle: [`BoxRay::reaches`], which decides what
    /// counts as a hit. None that it lets in is kept out by fused multiplication; and that one is no
    /// looser than a few parts in a million of the size of the numbers.
    #[test]
    fn fused_multiplication_keeps_no_ray_out() {
        let (mut met, mut spared) = (0, 0);
        for k in 0..200_000 {
            let s = Sampler::new(11, 2, (k, 0), 0);
            let unit = |at| s.two(at).extend(s.one(at + 2)) * 2.0 - 1.0;
            let size = 10_f32.powf(s.one(20) * 24.0 - 12.0);
            let corner = unit(3) * size;
            let thickness =
                Vec3::from_array([6, 7, 8].map(|at| if s.one(at) < 0.3 { 0.0 } else { s.one(at) }));
            let bounds = Aabb { min: corner, max: corner + thickness * size * 0.1 };
            let d = unit(9)
                * Vec3::from_array(
                    [12, 13, 14].map(|at| 10_f32.powf(-60.0 * (s.one(at) - 0.6).max(0.0))),
                );
            let away = f64::from(size) * 10_f64.powf(f64::from(s.one(15)) * 6.0 - 3.0);
            let within = thickness.as_dvec3() * f64::from(s.one(16).round());
            let aside = unit(17).as_dvec3() * if k % 2 == 0 { 0.0 } else { 3.0 };
            let aim = corner.as_dvec3() + (within + aside) * (f64::from(size) * 0.1);
            let ray =
                LocalRay { o: aim - d.as_dvec3().normalize_or(DVec3::X) * away, d: d.as_dvec3() };
            let reach = bounds.reach();
            let Some(prepared) = BoxRay::new(&ray) else { continue };
            assert!(can_be_fused(&ray, reach));
            if prepared.reaches(&bounds, f64::INFINITY) {
                met += 1;
                assert!(enters(&prepared, reach, &bounds, f64::INFINITY), "{ray:?} {bounds:?}");
            }
            let margin = 8.0 * SLACK * (reach + ray.o.abs().max_element() as f32);
            let wider = Aabb { min: bounds.min - margin, max: bounds.max + margin };
            if !prepared.reaches(&wider, f64::INFINITY) {
                spared += 1;
                assert!(!enters(&prepared, reach, &bounds, f64::INFINITY), "{ray:?} {bounds:?}");
            }
        }
        assert!(met > 50_000 && spared > 50_000, "{met} rays meet their box, {spared} pass it");
    }
}
