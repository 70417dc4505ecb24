//! The tests of boxes and triangles with the AVX2 instructions of x86-64.
//!
//! Chosen at run time where the processor has them. Triangles are tested by the same operations in the
//! same order as in plain Rust, without fused multiplication, so that the bits of a hit are the same.
//! Boxes decide no hit, so that there it may be used ([`BoxLanes`]).
#![expect(unsafe_code, reason = "vector instructions, used only where the processor has them")]

use super::boxes::{BoxTree, visit_boxes};
use super::node::{BLOCK, Block, Node};
use super::ray::{self, BoxRay, LEAST, ROUNDING, Scale, UNIT, larger, padded};
use super::traverse::{
    BlockHits, Distances, Lanes, Nodes, TriangleHit, WideCorners, any_hit, closest_hit, take_lane,
};
use crate::math::Aabb;
use crate::math::instructions::has_avx2;
use crate::shape::{INEXACT, LocalRay, OPEN, TriangleTest};
use glam::{DVec3, Vec3};
use std::arch::x86_64::{
    __m128, __m256, __m256d, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _CMP_NEQ_UQ, _MM_HINT_T0,
    _mm_add_ps, _mm_andnot_ps, _mm_loadu_ps, _mm_max_ps, _mm_min_ps, _mm_mul_ps, _mm_permute_ps,
    _mm_prefetch, _mm_set1_ps, _mm_storeu_ps, _mm_sub_ps, _mm_xor_ps, _mm256_add_pd, _mm256_and_pd,
    _mm256_andnot_pd, _mm256_blendv_pd, _mm256_broadcastss_ps, _mm256_cmp_pd, _mm256_cmp_ps,
    _mm256_cvtpd_ps, _mm256_cvtps_pd, _mm256_div_pd, _mm256_fmadd_ps, _mm256_load_ps,
    _mm256_loadu_pd, _mm256_max_pd, _mm256_max_ps, _mm256_min_pd, _mm256_min_ps,
    _mm256_movemask_pd, _mm256_movemask_ps, _mm256_mul_pd, _mm256_or_pd, _mm256_set1_pd,
    _mm256_set1_ps, _mm256_setzero_pd, _mm256_setzero_ps, _mm256_store_pd, _mm256_store_ps,
    _mm256_sub_pd,
};

/// The proof that this processor has the instructions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

#[expect(clippy::unused_self, reason = "the value is the proof")]
impl Avx2 {
    /// `None` where the processor lacks them.
    #[inline]
    pub(super) fn detect() -> Option<Self> {
        has_avx2().then_some(Self(()))
    }

    /// Whether ray and boxes, whose coordinates are within `reach` of 0, are of a size for [`BoxLanes`].
    #[inline]
    pub(super) fn fits(self, ray: &LocalRay, reach: f32) -> bool {
        let [x, y, z] = ray.o.to_array().map(f64::abs);
        let size = larger(larger(x, y), z) + f64::from(reach);
        (WIDEST.recip()..WIDEST).contains(&size)
    }

    #[inline]
    pub(super) fn closest_hit<N: Nodes, const STACK: usize>(
        self,
        tree: &N,
        ray: &LocalRay,
        t_max: f64,
    ) -> Option<TriangleHit> {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { closest_hit_avx2::<N, STACK>(tree, ray, t_max) }
    }

    #[inline]
    pub(super) fn any_hit<N: Nodes, const STACK: usize>(
        self,
        tree: &N,
        ray: &LocalRay,
        t_max: f64,
    ) -> bool {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { any_hit_avx2::<N, STACK>(tree, ray, t_max) }
    }

    #[inline]
    pub(super) fn visit_boxes<const STACK: usize>(
        self,
        tree: &BoxTree,
        ray: &LocalRay,
        t_max: f64,
        visit: impl FnMut(u32, f64) -> f64,
    ) {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { visit_boxes_avx2::<STACK>(tree, ray, t_max, visit) }
    }
}

#[target_feature(enable = "avx2,fma,bmi1,popcnt")]
fn closest_hit_avx2<N: Nodes, const STACK: usize>(
    tree: &N,
    ray: &LocalRay,
    t_max: f64,
) -> Option<TriangleHit> {
    closest_hit::<Vectors, N, STACK>(tree, ray, t_max)
}

#[target_feature(enable = "avx2,fma,bmi1,popcnt")]
fn any_hit_avx2<N: Nodes, const STACK: usize>(tree: &N, ray: &LocalRay, t_max: f64) -> bool {
    any_hit::<Vectors, N, STACK>(tree, ray, t_max)
}

#[target_feature(enable = "avx2,fma,bmi1,popcnt")]
fn visit_boxes_avx2<const STACK: usize>(
    tree: &BoxTree,
    ray: &LocalRay,
    t_max: f64,
    visit: impl FnMut(u32, f64) -> f64,
) {
    visit_boxes::<Vectors, STACK>(tree, ray, t_max, visit);
}

/// [`BoxRay::reaches`], called: what it needs would take the registers of the loops around it.
#[target_feature(enable = "avx2,fma,bmi1,popcnt")]
#[inline(never)]
fn reaches_avx2(ray: &BoxRay, bounds: &Aabb, t: f64) -> bool {
    ray.reaches(bounds, t)
}

/// The vector tests. Private: they are instantiated only by the functions above, which have the
/// features and into which they are inlined.
struct Vectors;

/// A ray in every lane, for boxes: a plane at `b` is met at `b·slope + base`, by fused multiplication.
///
/// This takes half the instructions of [`BoxRay::reaches`], but what is rounded is relative to the size of
/// the numbers and not to the distance. With u the relative error of one rounding and P the largest
/// coordinate of a box, the slope is off by 6 u at most (5 u of its making in [`BoxRay`], and its own
/// rounding), which moves the plane by 6 u·P in space and the origin by 6 u·|o|; the origin is off by
/// 2 u·|o|, and the sums and products are rounded 4 times, each by u·(P + |o|) at most.
/// [`BoxRay::reaches`] is more generous than the exact ray by 7 u of the distance and 2 u·|o|, and must not
/// be where this is not. All of this is below 24 u·(P + |o|) in space, and the bases are moved by 32.
///
/// A slope which is too steep for products in the range of numbers is made less steep. Where the ray
/// enters is then too early, which is allowed; where it leaves is right if negative by more than the slack,
/// and otherwise at least 2⁵⁰·16 u·(P + |o|), which is beyond every box.
#[derive(Clone, Copy)]
struct BoxLanes {
    /// `1/d`.
    slope: [__m256; 3],
    /// `−o/d`, lowered.
    near_base: [__m256; 3],
    /// `−o/d`, raised.
    far_base: [__m256; 3],
    near_planes: [usize; 3],
}

/// What is added to distances in space, relative to the size of the numbers.
const SLACK: f32 = 32.0 * UNIT as f32;
/// The steepest slope, 2⁵⁰.
const STEEPEST: f32 = (1_u64 << 50) as f32;
/// Where the product of the steepest slope and any coordinate, and the slack, are normal numbers: 2⁷⁰.
const WIDEST: f64 = (1_u128 << 70) as f64;

/// A ray in every lane, for triangles.
#[derive(Clone, Copy)]
struct TriangleLanes {
    o: [__m256d; 3],
    shear: [__m256d; 3],
    axes: [usize; 3],
    /// What decides where rounding leaves it open.
    whole: TriangleTest,
}

// These are functions rather than closures, since a closure cannot be made to be inlined, and outside
// a function with the features an instruction becomes a call.

/// The first three lanes, each in every lane.
#[inline(always)]
fn lanes_of(v: __m128) -> [__m256; 3] {
    // SAFETY: runs only inside the functions with the features.
    unsafe {
        [
            _mm256_broadcastss_ps(v),
            _mm256_broadcastss_ps(_mm_permute_ps::<0b01>(v)),
            _mm256_broadcastss_ps(_mm_permute_ps::<0b10>(v)),
        ]
    }
}

#[inline(always)]
fn wide_lanes_of(v: [f64; 3]) -> [__m256d; 3] {
    // SAFETY: runs only inside the functions with the features.
    unsafe { [_mm256_set1_pd(v[0]), _mm256_set1_pd(v[1]), _mm256_set1_pd(v[2])] }
}

#[inline(always)]
fn times(v: __m256d, factor: f64) -> __m256d {
    // SAFETY: runs only inside the functions with the features.
    unsafe { _mm256_mul_pd(v, _mm256_set1_pd(factor)) }
}

/// The numbers, or that limit on their side of 0.
#[inline(always)]
fn within(v: __m128, limit: f32) -> __m128 {
    // SAFETY: runs only inside the functions with the features.
    unsafe { _mm_max_ps(_mm_min_ps(v, _mm_set1_ps(limit)), _mm_set1_ps(-limit)) }
}

/// The numbers, or the greatest on their side of 0.
#[inline(always)]
fn finite(v: __m128) -> __m128 {
    within(v, f32::MAX)
}

#[inline(always)]
fn stored(v: __m128) -> [f32; ray::LANES] {
    let mut lanes = [0.0; ray::LANES];
    // SAFETY: runs only inside the functions with the features; the store is unaligned.
    unsafe { _mm_storeu_ps(lanes.as_mut_ptr(), v) };
    lanes
}

/// Corners as seen from the origin of the ray, along one axis.
#[inline(always)]
fn from_origin(row: &[f32; BLOCK], o: __m256d) -> __m256d {
    // SAFETY: runs only inside the functions with the features; the load is unaligned.
    unsafe { _mm256_sub_pd(_mm256_cvtps_pd(_mm_loadu_ps(row.as_ptr())), o) }
}

/// The same for corners in `f64`.
#[inline(always)]
fn wide_from_origin(row: &[f64; BLOCK], o: __m256d) -> __m256d {
    // SAFETY: runs only inside the functions with the features; the load is unaligned.
    unsafe { _mm256_sub_pd(_mm256_loadu_pd(row.as_ptr()), o) }
}

/// Corners by axis, sheared so that the ray runs along z.
type Sheared = (__m256d, __m256d, __m256d);

#[inline(always)]
fn sheared(ray: &TriangleLanes, x: __m256d, y: __m256d, z: __m256d) -> Sheared {
    // SAFETY: runs only inside the functions with the features.
    unsafe {
        let x = _mm256_sub_pd(x, _mm256_mul_pd(ray.shear[0], z));
        let y = _mm256_sub_pd(y, _mm256_mul_pd(ray.shear[1], z));
        (x, y, z)
    }
}

/// Moves corners to the origin of the ray and shears them.
#[inline(always)]
fn seen(ray: &TriangleLanes, corner: &[[f32; BLOCK]; 3]) -> Sheared {
    // SAFETY: the axes of a `TriangleTest` are 0, 1 and 2 in some order.
    let [x, y, z] = unsafe { ray.axes.map(|axis| corner.get_unchecked(axis)) };
    let (x, y, z) = (from_origin(x, ray.o[0]), from_origin(y, ray.o[1]), from_origin(z, ray.o[2]));
    sheared(ray, x, y, z)
}

/// The same for corners in `f64`.
#[inline(always)]
fn wide_seen(ray: &TriangleLanes, corner: &[[f64; BLOCK]; 3]) -> Sheared {
    // SAFETY: the axes of a `TriangleTest` are 0, 1 and 2 in some order.
    let [x, y, z] = unsafe { ray.axes.map(|axis| corner.get_unchecked(axis)) };
    let (x, y, z) = (
        wide_from_origin(x, ray.o[0]),
        wide_from_origin(y, ray.o[1]),
        wide_from_origin(z, ray.o[2]),
    );
    sheared(ray, x, y, z)
}

/// `p·q − r·s`, rounded as written: a fused product would open the seams.
#[inline(always)]
fn edge(p: __m256d, q: __m256d, r: __m256d, s: __m256d) -> __m256d {
    // SAFETY: runs only inside the functions with the features.
    unsafe { _mm256_sub_pd(_mm256_mul_pd(p, q), _mm256_mul_pd(r, s)) }
}

/// The largest of three numbers without their signs.
#[inline(always)]
fn largest(a: __m256d, b: __m256d, c: __m256d) -> __m256d {
    // SAFETY: runs only inside the functions with the features.
    unsafe {
        let minus = _mm256_set1_pd(-0.0);
        let ab = _mm256_max_pd(_mm256_andnot_pd(minus, a), _mm256_andnot_pd(minus, b));
        _mm256_max_pd(ab, _mm256_andnot_pd(minus, c))
    }
}

/// Asks about the open lanes one by one; returns the mask with those of them that are hit.
#[cold]
#[inline(never)]
fn decide(
    (mut mask, mut open): (u32, u32),
    ray: &TriangleTest,
    t_max: f64,
    hits: &mut BlockHits,
    corners: impl Fn(usize) -> [DVec3; 3],
) -> u32 {
    while open != 0 {
        let lane = take_lane(&mut open) % BLOCK;
        mask &= !(1 << lane);
        if let Some((t, weights)) = ray.decide(corners(lane), t_max) {
            hits.t[lane] = t;
            (hits.second[lane], hits.third[lane]) = (weights.x, weights.y);
            mask |= 1 << lane;
        }
    }
    mask
}

/// The test of four triangles by their sheared corners: which are hit, and which of them or of the others are
/// open.
#[inline(always)]
fn test(corners: [Sheared; 3], shear_z: __m256d, t_max: f64, hits: &mut BlockHits) -> (u32, u32) {
    let [(ax, ay, az), (bx, by, bz), (cx, cy, cz)] = corners;
    // SAFETY: runs only inside the functions with the features. The rows of
    // the hits are 32 bytes long in a type aligned to 32.
    unsafe {
        let u = edge(cx, by, cy, bx);
        let v = edge(ax, cy, ay, cx);
        let w = edge(bx, ay, by, ax);
        let zero = _mm256_setzero_pd();
        let negative = _mm256_cmp_pd::<_CMP_LT_OQ>(_mm256_min_pd(_mm256_min_pd(u, v), w), zero);
        let positive = _mm256_cmp_pd::<_CMP_GT_OQ>(_mm256_max_pd(_mm256_max_pd(u, v), w), zero);
        let det = _mm256_add_pd(_mm256_add_pd(u, v), w);
        let inside = _mm256_andnot_pd(
            _mm256_and_pd(negative, positive),
            _mm256_cmp_pd::<_CMP_NEQ_UQ>(det, zero),
        );
        if _mm256_movemask_pd(inside) == 0 {
            return (0, 0);
        }
        let inverse = _mm256_div_pd(_mm256_set1_pd(1.0), det);
        let depth = _mm256_add_pd(
            _mm256_add_pd(_mm256_mul_pd(u, az), _mm256_mul_pd(v, bz)),
            _mm256_mul_pd(w, cz),
        );
        let t = _mm256_mul_pd(_mm256_mul_pd(depth, shear_z), inverse);
        let in_range = _mm256_and_pd(
            _mm256_cmp_pd::<_CMP_GT_OQ>(t, zero),
            _mm256_cmp_pd::<_CMP_LT_OQ>(t, _mm256_set1_pd(t_max)),
        );
        let mask = _mm256_movemask_pd(_mm256_and_pd(inside, in_range)) as u32;
        if mask != 0 {
            _mm256_store_pd(hits.t.as_mut_ptr(), t);
            _mm256_store_pd(hits.second.as_mut_ptr(), _mm256_mul_pd(v, inverse));
            _mm256_store_pd(hits.third.as_mut_ptr(), _mm256_mul_pd(w, inverse));
        }
        // `is_open` of the plain test, by the same operations.
        let (x, y, z) = (largest(ax, bx, cx), largest(ay, by, cy), largest(az, bz, cz));
        let across = _mm256_add_pd(_mm256_mul_pd(x, y), _mm256_mul_pd(z, _mm256_add_pd(x, y)));
        let doubt = _mm256_mul_pd(_mm256_mul_pd(z, across), _mm256_set1_pd(OPEN));
        let ahead = _mm256_cmp_pd::<_CMP_GT_OQ>(t, zero);
        let share = _mm256_blendv_pd(_mm256_set1_pd(1.0), _mm256_set1_pd(INEXACT), ahead);
        let known = _mm256_mul_pd(_mm256_andnot_pd(_mm256_set1_pd(-0.0), depth), share);
        let open = _mm256_and_pd(inside, _mm256_cmp_pd::<_CMP_LT_OQ>(known, doubt));
        (mask, _mm256_movemask_pd(open) as u32)
    }
}

impl Lanes for Vectors {
    type Boxes = BoxLanes;
    type Triangles = TriangleLanes;

    #[inline(always)]
    fn prepare(ray: &LocalRay) -> Option<BoxRay> {
        let Scale { shrink, scale } = Scale::of(ray)?;
        let (o, d) = (padded(ray.o), padded(ray.d));
        // SAFETY: runs only inside the functions with the features; loads and stores are unaligned
        // and of whole arrays of four.
        unsafe {
            let (o, d) = (_mm256_loadu_pd(o.as_ptr()), _mm256_loadu_pd(d.as_ptr()));
            let minus = _mm256_set1_pd(-0.0);
            let inverse = _mm256_div_pd(_mm256_set1_pd(-1.0), times(d, shrink));
            let aside =
                _mm256_add_pd(times(_mm256_andnot_pd(minus, o), ROUNDING), _mm256_set1_pd(LEAST));
            let aside = _mm256_or_pd(aside, _mm256_and_pd(minus, d));
            let mut ray = BoxRay {
                near_origin: stored(finite(_mm256_cvtpd_ps(_mm256_add_pd(o, aside)))),
                far_origin: stored(finite(_mm256_cvtpd_ps(_mm256_sub_pd(o, aside)))),
                near_inverse: stored(finite(_mm256_cvtpd_ps(times(inverse, 1.0 - 4.0 * UNIT)))),
                far_inverse: stored(_mm256_cvtpd_ps(times(inverse, 1.0 + 4.0 * UNIT))),
                near_planes: [0, 2, 4],
                scale,
            };
            let backwards = _mm256_movemask_pd(d) as usize;
            for (axis, plane) in ray.near_planes.iter_mut().enumerate() {
                *plane += backwards >> axis & 1;
            }
            Some(ray)
        }
    }

    #[inline(always)]
    fn prepare_boxes(ray: &BoxRay, reach: f32) -> BoxLanes {
        let size = {
            let [x, y, z, _] = ray.near_origin.map(f32::abs);
            reach + larger(larger(x, y), z)
        };
        // SAFETY: runs only inside the functions with the features; the loads are unaligned and of whole
        // arrays of four.
        unsafe {
            let minus = _mm_set1_ps(-0.0);
            let inverse = within(_mm_loadu_ps(ray.near_inverse.as_ptr()), STEEPEST);
            let base = _mm_mul_ps(_mm_loadu_ps(ray.near_origin.as_ptr()), inverse);
            let slack = _mm_mul_ps(_mm_set1_ps(size * SLACK), _mm_andnot_ps(minus, inverse));
            BoxLanes {
                slope: lanes_of(_mm_xor_ps(minus, inverse)),
                near_base: lanes_of(_mm_sub_ps(base, slack)),
                far_base: lanes_of(_mm_add_ps(base, slack)),
                near_planes: ray.near_planes,
            }
        }
    }

    #[inline(always)]
    fn prepare_triangles(test: &TriangleTest) -> TriangleLanes {
        let axes = test.axes;
        let o = test.o.to_array();
        let o = [o[axes[0]], o[axes[1]], o[axes[2]]];
        let shear = wide_lanes_of(test.shear.to_array());
        TriangleLanes { o: wide_lanes_of(o), shear, axes, whole: *test }
    }

    #[inline(always)]
    fn enter(ray: &BoxLanes, node: &Node, end: f32, distances: &mut Distances) -> u32 {
        // SAFETY: runs only inside the functions with the features. The rows of planes are 32
        // bytes long in a type aligned to 64, and distances are aligned to 32.
        unsafe {
            let mut near = _mm256_setzero_ps();
            let mut far = _mm256_set1_ps(end);
            for axis in 0..3 {
                // One of 2·axis and 2·axis + 1: `BoxRay` makes no others.
                let plane = ray.near_planes[axis];
                debug_assert!(plane / 2 == axis);
                let enter = _mm256_load_ps(node.planes.get_unchecked(plane).as_ptr());
                let leave = _mm256_load_ps(node.planes.get_unchecked(plane ^ 1).as_ptr());
                // Minimum and maximum return their second operand where one is NaN.
                let a = _mm256_fmadd_ps(enter, ray.slope[axis], ray.near_base[axis]);
                near = _mm256_max_ps(a, near);
                let b = _mm256_fmadd_ps(leave, ray.slope[axis], ray.far_base[axis]);
                far = _mm256_min_ps(b, far);
            }
            _mm256_store_ps(distances.0.as_mut_ptr(), near);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32
        }
    }

    #[inline(always)]
    fn reaches(ray: &BoxRay, bounds: &Aabb, t: f64) -> bool {
        // SAFETY: runs only inside the functions with the features.
        unsafe { reaches_avx2(ray, bounds, t) }
    }

    #[inline(always)]
    fn hit(ray: &TriangleLanes, block: &Block, t_max: f64, hits: &mut BlockHits) -> u32 {
        let [a, b, c] = &block.corners;
        let corners = [seen(ray, a), seen(ray, b), seen(ray, c)];
        let (mask, open) = test(corners, ray.shear[2], t_max, hits);
        if open == 0 {
            return mask;
        }
        let corners = |lane| block.get(lane).map(Vec3::as_dvec3);
        decide((mask, open), &ray.whole, t_max, hits, corners)
    }

    #[inline(always)]
    fn hit_wide(
        ray: &TriangleLanes,
        corners: &WideCorners,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32 {
        let [a, b, c] = &corners.0;
        let seen = [wide_seen(ray, a), wide_seen(ray, b), wide_seen(ray, c)];
        let (mask, open) = test(seen, ray.shear[2], t_max, hits);
        if open == 0 {
            return mask;
        }
        decide((mask, open), &ray.whole, t_max, hits, |lane| corners.get(lane))
    }

    #[inline(always)]
    fn prefetch((address, lines): (*const i8, usize)) {
        for line in 0..lines {
            // SAFETY: a prefetch reads nothing, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64 * line)) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use glam::{DVec3, Vec3};

    /// The ray as both sets of instructions prepare it.
    #[target_feature(enable = "avx2,fma,bmi1,popcnt")]
    fn prepared(ray: &LocalRay) -> Option<BoxRay> {
        Vectors::prepare(ray)
    }

    /// Oracle: plain Rust, bit for bit, from the least numbers to the greatest.
    #[test]
    fn rays_are_prepared_as_in_plain_rust() {
        if Avx2::detect().is_none() {
            return;
        }
        for k in 0..100_000 {
            let s = Sampler::new(3, 1, (k, 0), 0);
            let number = |at: u32| match s.one(at) {
                u if u < 0.1 => 0.0,
                u if u < 0.2 => -0.0,
                u if u < 0.21 => f64::NAN,
                u if u < 0.22 => f64::INFINITY,
                _ => {
                    let exponent = f64::from(s.one(at + 1)).powi(3) * 300.0 - 150.0;
                    (f64::from(s.one(at + 2)) - 0.5) * 10_f64.powf(exponent)
                }
            };
            let vector = |at: u32| DVec3::new(number(at), number(at + 3), number(at + 6));
            let ray = LocalRay { o: vector(0), d: vector(9) };
            // SAFETY: the features were detected.
            let vectors = unsafe { prepared(&ray) };
            assert_eq!(vectors, BoxRay::new(&ray), "{ray:?}");
        }
    }

    #[target_feature(enable = "avx2,fma,bmi1,popcnt")]
    fn enters_avx2(ray: &LocalRay, reach: f32, bounds: &Aabb) -> bool {
        let prepared = Vectors::prepare(ray).unwrap();
        let mut node = Node::EMPTY;
        node.set_box(5, bounds);
        let boxes = Vectors::prepare_boxes(&prepared, reach);
        Vectors::enter(&boxes, &node, f32::INFINITY, &mut Distances::default()) == 1 << 5
    }

    /// Whether the ray is let into a box among boxes whose coordinates are within `reach` of 0.
    fn enters(ray: &LocalRay, reach: f32, bounds: &Aabb) -> bool {
        assert!(Avx2::detect().is_some());
        // SAFETY: the features were detected.
        unsafe { enters_avx2(ray, reach, bounds) }
    }

    /// Rays to a corner or an edge of a box, most of them nearly or exactly along an axis, from near and
    /// far: where rounding decides whether a box is met. Oracle: [`BoxRay::reaches`], which decides what
    /// counts as a hit. None that it lets in is kept out by fused multiplication; and that one is no
    /// looser than a few parts in a million of the size of the numbers.
    #[test]
    fn fused_multiplication_keeps_no_ray_out() {
        let Some(avx2) = Avx2::detect() else { return };
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
            assert!(avx2.fits(&ray, reach));
            if prepared.reaches(&bounds, f64::INFINITY) {
                met += 1;
                assert!(enters(&ray, reach, &bounds), "{ray:?} {bounds:?}");
            }
            let margin = 8.0 * SLACK * (reach + ray.o.abs().max_element() as f32);
            let wider = Aabb { min: bounds.min - margin, max: bounds.max + margin };
            if !prepared.reaches(&wider, f64::INFINITY) {
                spared += 1;
                assert!(!enters(&ray, reach, &bounds), "{ray:?} {bounds:?}");
            }
        }
        assert!(met > 50_000 && spared > 50_000, "{met} rays meet their box, {spared} pass it");
    }
}
