//! The tests of boxes and triangles with the AVX2 instructions of x86-64.
//!
//! Chosen at run time where the processor has them. Triangles are tested by the same operations in the
//! same order as in plain Rust, without fused multiplication, so that the bits of a hit are the same.
//! Boxes decide no hit, so that there it may be used ([`FusedRay`]).
#![expect(unsafe_code, reason = "vector instructions, used only where the processor has them")]

use super::boxes::{BoxTree, visit_boxes};
use super::node::{BLOCK, Block, Node};
use super::ray::{BoxRay, FusedRay};
use super::traverse::{
    BlockHits, Distances, Lanes, Nodes, TriangleHit, WideCorners, any_hit, closest_hit,
};
use crate::build::bvh::spheres::{LANES, SphereBlock};
use crate::shape::{LocalRay, TriangleTest};
use std::arch::x86_64::{
    __m256, __m256d, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _CMP_NEQ_UQ, _MM_HINT_T0, _mm_loadu_ps,
    _mm_prefetch, _mm256_add_pd, _mm256_and_pd, _mm256_andnot_pd, _mm256_cmp_pd, _mm256_cmp_ps,
    _mm256_cvtps_pd, _mm256_div_pd, _mm256_fmadd_ps, _mm256_load_ps, _mm256_loadu_pd,
    _mm256_max_pd, _mm256_max_ps, _mm256_min_pd, _mm256_min_ps, _mm256_movemask_pd,
    _mm256_movemask_ps, _mm256_mul_pd, _mm256_set1_pd, _mm256_set1_ps, _mm256_setzero_pd,
    _mm256_setzero_ps, _mm256_store_pd, _mm256_store_ps, _mm256_sub_pd,
};

/// The proof that this processor has the instructions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

#[expect(clippy::unused_self, reason = "the value is the proof")]
impl Avx2 {
    /// `None` where the processor lacks them. The standard library asks the processor once.
    #[inline]
    pub(super) fn detect() -> Option<Self> {
        let present = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("popcnt");
        present.then_some(Self(()))
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
        prepared: &BoxRay,
        t_max: f64,
        visit: impl FnMut(u32, f64) -> f64,
    ) {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { visit_boxes_avx2::<STACK>(tree, prepared, t_max, visit) }
    }

    /// [`SphereBlock::hits`].
    #[inline]
    pub(super) fn sphere_hits(
        self,
        block: &SphereBlock,
        ray: &LocalRay,
        t_max: f64,
    ) -> [f64; LANES] {
        // SAFETY: a value of this type exists only where the features were detected.
        unsafe { sphere_hits_avx2(block, ray, t_max) }
    }
}

#[target_feature(enable = "avx2,bmi1,popcnt")]
fn sphere_hits_avx2(block: &SphereBlock, ray: &LocalRay, t_max: f64) -> [f64; LANES] {
    block.hits(ray, t_max)
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
    prepared: &BoxRay,
    t_max: f64,
    visit: impl FnMut(u32, f64) -> f64,
) {
    visit_boxes::<Vectors, STACK>(tree, prepared, t_max, visit);
}

/// The vector tests. Private: they are instantiated only by the three functions above, which have the
/// features and into which they are inlined.
struct Vectors;

/// A ray in every lane, for boxes.
#[derive(Clone, Copy)]
struct BoxLanes {
    slope: [__m256; 3],
    near_base: [__m256; 3],
    far_base: [__m256; 3],
    near_planes: [usize; 3],
}

/// A ray in every lane, for triangles.
#[derive(Clone, Copy)]
struct TriangleLanes {
    o: [__m256d; 3],
    shear: [__m256d; 3],
    axes: [usize; 3],
}

// These are functions rather than closures, since a closure cannot be made to be inlined, and outside
// a function with the features an instruction becomes a call.

#[inline(always)]
fn lanes_of(v: [f32; 3]) -> [__m256; 3] {
    // SAFETY: runs only inside the three functions with the features.
    unsafe { [_mm256_set1_ps(v[0]), _mm256_set1_ps(v[1]), _mm256_set1_ps(v[2])] }
}

#[inline(always)]
fn wide_lanes_of(v: [f64; 3]) -> [__m256d; 3] {
    // SAFETY: runs only inside the three functions with the features.
    unsafe { [_mm256_set1_pd(v[0]), _mm256_set1_pd(v[1]), _mm256_set1_pd(v[2])] }
}

/// Corners as seen from the origin of the ray, along one axis.
#[inline(always)]
fn from_origin(row: &[f32; BLOCK], o: __m256d) -> __m256d {
    // SAFETY: runs only inside the three functions with the features; the load is unaligned.
    unsafe { _mm256_sub_pd(_mm256_cvtps_pd(_mm_loadu_ps(row.as_ptr())), o) }
}

/// The same for corners in `f64`.
#[inline(always)]
fn wide_from_origin(row: &[f64; BLOCK], o: __m256d) -> __m256d {
    // SAFETY: runs only inside the three functions with the features; the load is unaligned.
    unsafe { _mm256_sub_pd(_mm256_loadu_pd(row.as_ptr()), o) }
}

/// Corners by axis, sheared so that the ray runs along z.
type Sheared = (__m256d, __m256d, __m256d);

#[inline(always)]
fn sheared(ray: &TriangleLanes, x: __m256d, y: __m256d, z: __m256d) -> Sheared {
    // SAFETY: runs only inside the three functions with the features.
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
    // SAFETY: runs only inside the three functions with the features.
    unsafe { _mm256_sub_pd(_mm256_mul_pd(p, q), _mm256_mul_pd(r, s)) }
}

/// The test of four triangles by their sheared corners.
#[inline(always)]
fn test(corners: [Sheared; 3], shear_z: __m256d, t_max: f64, hits: &mut BlockHits) -> u32 {
    let [(ax, ay, az), (bx, by, bz), (cx, cy, cz)] = corners;
    // SAFETY: runs only inside the three functions with the features. The rows of
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
            return 0;
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
        mask
    }
}

impl Lanes for Vectors {
    type Boxes = BoxLanes;
    type Triangles = TriangleLanes;

    #[inline(always)]
    fn prepare_boxes(ray: &BoxRay, reach: f32) -> BoxLanes {
        let FusedRay { slope, near_base, far_base } = ray.fused(reach);
        BoxLanes {
            slope: lanes_of(slope),
            near_base: lanes_of(near_base),
            far_base: lanes_of(far_base),
            near_planes: ray.near_planes,
        }
    }

    #[inline(always)]
    fn prepare_triangles(test: &TriangleTest) -> TriangleLanes {
        let axes = test.axes;
        let o = test.o.to_array();
        let o = [o[axes[0]], o[axes[1]], o[axes[2]]];
        TriangleLanes { o: wide_lanes_of(o), shear: wide_lanes_of(test.shear.to_array()), axes }
    }

    #[inline(always)]
    fn enter(ray: &BoxLanes, node: &Node, end: f32, distances: &mut Distances) -> u32 {
        // SAFETY: runs only inside the three functions with the features. The rows of planes are 32
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
    fn hit(ray: &TriangleLanes, block: &Block, t_max: f64, hits: &mut BlockHits) -> u32 {
        let [a, b, c] = &block.corners;
        test([seen(ray, a), seen(ray, b), seen(ray, c)], ray.shear[2], t_max, hits)
    }

    #[inline(always)]
    fn hit_wide(
        ray: &TriangleLanes,
        corners: &WideCorners,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32 {
        let [a, b, c] = &corners.0;
        let corners = [wide_seen(ray, a), wide_seen(ray, b), wide_seen(ray, c)];
        test(corners, ray.shear[2], t_max, hits)
    }

    #[inline(always)]
    fn prefetch((address, lines): (*const i8, usize)) {
        for line in 0..lines {
            // SAFETY: a prefetch reads nothing, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64 * line)) };
        }
    }
}
