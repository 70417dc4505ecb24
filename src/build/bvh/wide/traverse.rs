//! The way of a ray through the tree, and the tests of boxes and triangles in plain Rust.
//!
//! Closest hit: the children that the ray enters are visited from near to far, and those beyond the
//! best hit are dropped. Any hit: in whatever order, until something is met.
//!
//! Boxes are tested in `f32`, conservatively ([`BoxRay`]); triangles in `f64`, by the same operations
//! in the same order as [`TriangleTest`]; a hit counts if the ray also meets the box of the triangle
//! ([`BoxRay::reaches`]). So the answer is that of testing every triangle by itself, bit for bit,
//! whatever the tree looks like and whichever set of instructions ran.

use super::TINY_STACK;
use super::node::{BLOCK, Block, Child, Node, WIDTH};
use super::ray::BoxRay;
use super::stack::Stack;
use crate::math::Aabb;
use crate::shape::{LocalRay, TriangleTest};
use glam::{DVec2, DVec3};

/// Where a ray meets a triangle of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Ray parameter.
    pub t: f64,
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: DVec2,
}

/// Hits of the triangles of a block, by lane; only lanes which were hit have a meaning.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct BlockHits {
    pub(super) t: [f64; BLOCK],
    pub(super) second: [f64; BLOCK],
    pub(super) third: [f64; BLOCK],
}

/// Distances at which the boxes of a node are entered.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct Distances(pub(super) [f32; WIDTH]);

/// Corners of the four triangles of a block in `f64`, by corner, axis and lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct WideCorners(pub(super) [[[f64; BLOCK]; 3]; 3]);

impl WideCorners {
    /// The corners of a triangle.
    pub(super) fn get(&self, lane: usize) -> [DVec3; 3] {
        self.0.map(|corner| DVec3::from_array(corner.map(|row| row[lane])))
    }
}

/// What is traversed: nodes and blocks as they are at the time of the ray.
///
/// A tree at rest has them in memory; one that moves makes them, and nothing of that is in the code
/// for a tree at rest.
pub(super) trait Nodes {
    /// Where to begin.
    fn root(&self) -> Child;

    /// No coordinate of a box is farther from 0.
    fn reach(&self) -> f32;

    /// A node; `scratch` is there for one that must be made.
    fn node<'a>(&'a self, index: usize, scratch: &'a mut Node) -> &'a Node;

    /// Which triangles of a block the ray meets with `0 < t < t_max`, and where.
    fn hit<L: Lanes>(
        &self,
        block: usize,
        ray: &L::Triangles,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32;

    /// Index of a triangle of a block.
    fn triangle(&self, block: usize, lane: usize) -> u32;

    /// The box of a triangle of a block, within those of all nodes above it.
    fn triangle_bounds(&self, block: usize, lane: usize) -> Aabb;

    /// Where a child lies, and how many lines of 64 bytes of it are read.
    fn place(&self, child: Child) -> (*const i8, usize);
}

/// A test of eight boxes and one of four triangles, for one ray.
///
/// Bit `k` of a returned mask stands for lane `k`.
pub(super) trait Lanes {
    /// The ray as the box test wants it.
    type Boxes: Copy;
    /// The ray as the triangle test wants it.
    type Triangles: Copy;

    /// [`BoxRay::new`].
    fn prepare(ray: &LocalRay) -> Option<BoxRay>;
    /// `reach` is that of the boxes: none of their coordinates is farther from 0.
    fn prepare_boxes(ray: &BoxRay, reach: f32) -> Self::Boxes;
    fn prepare_triangles(test: &TriangleTest) -> Self::Triangles;

    /// Which boxes the ray meets at a distance in `[0, end]`, and where.
    fn enter(ray: &Self::Boxes, node: &Node, end: f32, distances: &mut Distances) -> u32;

    /// [`BoxRay::reaches`].
    fn reaches(ray: &BoxRay, bounds: &Aabb, t: f64) -> bool;

    /// Which triangles the ray meets with `0 < t < t_max`, and where.
    fn hit(ray: &Self::Triangles, block: &Block, t_max: f64, hits: &mut BlockHits) -> u32;

    /// The same for corners in `f64`.
    fn hit_wide(
        ray: &Self::Triangles,
        corners: &WideCorners,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32;

    /// Asks for so many lines of memory ahead of time.
    fn prefetch(place: (*const i8, usize));
}

/// The tests in plain Rust, for any processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

impl Lanes for Portable {
    type Boxes = BoxRay;
    type Triangles = TriangleTest;

    #[inline(always)]
    fn prepare(ray: &LocalRay) -> Option<BoxRay> {
        BoxRay::new(ray)
    }

    #[inline(always)]
    fn prepare_boxes(ray: &BoxRay, _: f32) -> BoxRay {
        *ray
    }

    #[inline(always)]
    fn prepare_triangles(test: &TriangleTest) -> TriangleTest {
        *test
    }

    #[inline(always)]
    fn enter(ray: &BoxRay, node: &Node, end: f32, distances: &mut Distances) -> u32 {
        let (mut near, mut far) = ([0.0; WIDTH], [end; WIDTH]);
        for axis in 0..3 {
            let plane = ray.near_planes[axis];
            let (enter, leave) = (&node.planes[plane], &node.planes[plane ^ 1]);
            for lane in 0..WIDTH {
                // NaN compares false and leaves the distance as it is.
                let a = (ray.near_origin[axis] - enter[lane]) * ray.near_inverse[axis];
                near[lane] = if a > near[lane] { a } else { near[lane] };
                let b = (ray.far_origin[axis] - leave[lane]) * ray.far_inverse[axis];
                far[lane] = if b < far[lane] { b } else { far[lane] };
            }
        }
        distances.0 = near;
        (0..WIDTH).fold(0, |mask, lane| mask | (u32::from(near[lane] <= far[lane]) << lane))
    }

    #[inline(always)]
    fn reaches(ray: &BoxRay, bounds: &Aabb, t: f64) -> bool {
        ray.reaches(bounds, t)
    }

    #[inline(always)]
    fn hit(ray: &TriangleTest, block: &Block, t_max: f64, hits: &mut BlockHits) -> u32 {
        let mut mask = 0;
        for lane in 0..BLOCK {
            if let Some((t, weights)) = ray.intersect(block.get(lane), t_max) {
                hits.t[lane] = t;
                (hits.second[lane], hits.third[lane]) = (weights.x, weights.y);
                mask |= 1 << lane;
            }
        }
        mask
    }

    #[inline(always)]
    fn hit_wide(
        ray: &TriangleTest,
        corners: &WideCorners,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32 {
        let mut mask = 0;
        for lane in 0..BLOCK {
            if let Some((t, weights)) = ray.intersect_exact(corners.get(lane), t_max) {
                hits.t[lane] = t;
                (hits.second[lane], hits.third[lane]) = (weights.x, weights.y);
                mask |= 1 << lane;
            }
        }
        mask
    }

    #[inline(always)]
    fn prefetch(_: (*const i8, usize)) {}
}

/// A child on the stack: its distance in the upper half, so that keys sort by distance (which is not
/// negative, and the bits of such numbers are in their order).
pub(super) type Key = u64;

#[inline(always)]
pub(super) fn key(distance: f32, child: Child) -> Key {
    u64::from(distance.to_bits()) << 32 | u64::from(child.0)
}

#[inline(always)]
pub(super) fn child_of(key: Key) -> Child {
    Child(key as u32)
}

#[inline(always)]
pub(super) fn distance_of(key: Key) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

/// The lanes of a mask, from the lowest.
#[inline(always)]
pub(super) fn take_lane(mask: &mut u32) -> usize {
    let lane = mask.trailing_zeros() as usize;
    *mask &= *mask - 1;
    lane % WIDTH
}

/// [`BoxRay::reaches`], for a ray that was prepared already or is now.
#[inline(always)]
fn is_met<L: Lanes>(ray: &LocalRay, prepared: Option<&BoxRay>, bounds: &Aabb, t: f64) -> bool {
    match prepared {
        Some(prepared) => L::reaches(prepared, bounds, t),
        None => L::prepare(ray).is_some_and(|prepared| L::reaches(&prepared, bounds, t)),
    }
}

/// Lowers `best` and `t_max` to the nearest hit in a leaf.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the state of a traversal, inlined into it")]
fn nearest_of_leaf<L: Lanes, N: Nodes>(
    tree: &N,
    leaf: Child,
    ray: &LocalRay,
    prepared: Option<&BoxRay>,
    triangles: &L::Triangles,
    t_max: &mut f64,
    best: &mut Option<TriangleHit>,
    hits: &mut BlockHits,
) {
    for block in leaf.blocks() {
        let mut mask = tree.hit::<L>(block, triangles, *t_max, hits);
        while mask != 0 {
            let lane = take_lane(&mut mask) % BLOCK;
            let (t, triangle) = (hits.t[lane], tree.triangle(block, lane));
            if best.is_none_or(|best| (t, triangle) < (best.t, best.triangle))
                && is_met::<L>(ray, prepared, &tree.triangle_bounds(block, lane), t)
            {
                let weights = DVec2::new(hits.second[lane], hits.third[lane]);
                *best = Some(TriangleHit { t, triangle, weights });
                // Another triangle at the same distance is still to be seen.
                *t_max = t.next_up();
            }
        }
    }
}

/// Whether any triangle of a leaf is hit.
#[inline(always)]
fn leaf_blocks<L: Lanes, N: Nodes>(
    tree: &N,
    leaf: Child,
    ray: &LocalRay,
    prepared: Option<&BoxRay>,
    triangles: &L::Triangles,
    t_max: f64,
    hits: &mut BlockHits,
) -> bool {
    for block in leaf.blocks() {
        let mut mask = tree.hit::<L>(block, triangles, t_max, hits);
        while mask != 0 {
            let lane = take_lane(&mut mask) % BLOCK;
            if is_met::<L>(ray, prepared, &tree.triangle_bounds(block, lane), hits.t[lane]) {
                return true;
            }
        }
    }
    false
}

/// Asks for a child ahead of time, unless the tree is so small that it is at hand.
#[inline(always)]
fn ask_for<L: Lanes, N: Nodes, const STACK: usize>(tree: &N, child: Child) {
    if STACK > TINY_STACK {
        L::prefetch(tree.place(child));
    }
}

/// The child in the lowest lane of a mask, asked for ahead of time.
#[inline(always)]
fn take_child<L: Lanes, N: Nodes, const STACK: usize>(
    tree: &N,
    node: &Node,
    distances: &Distances,
    mask: &mut u32,
) -> Key {
    let lane = take_lane(mask);
    let child = node.children[lane];
    ask_for::<L, N, STACK>(tree, child);
    key(distances.0[lane], child)
}

/// The nearest hit with `0 < t < t_max`; among equal ones that of the lowest triangle.
///
/// `STACK` is at least what the tree needs.
#[inline(always)]
pub(super) fn closest_hit<L: Lanes, N: Nodes, const STACK: usize>(
    tree: &N,
    ray: &LocalRay,
    mut t_max: f64,
) -> Option<TriangleHit> {
    let triangles = L::prepare_triangles(&TriangleTest::new(ray));
    let mut best = None;
    let mut hits = BlockHits::default();
    let root = tree.root();
    if root.is_leaf() {
        nearest_of_leaf::<L, N>(
            tree, root, ray, None, &triangles, &mut t_max, &mut best, &mut hits,
        );
        return best;
    }
    let prepared = L::prepare(ray)?;
    let boxes = L::prepare_boxes(&prepared, tree.reach());
    let mut end = prepared.distance(t_max);
    let mut stack = Stack::<Key, STACK>::new();
    let mut distances = Distances::default();
    let mut current = tree.root();
    let mut scratch = Node::EMPTY;
    loop {
        if current.is_leaf() {
            let before = t_max;
            nearest_of_leaf::<L, N>(
                tree,
                current,
                ray,
                Some(&prepared),
                &triangles,
                &mut t_max,
                &mut best,
                &mut hits,
            );
            if t_max < before {
                end = prepared.distance(t_max);
            }
        } else {
            let node = tree.node(current.index(), &mut scratch);
            let mut mask = L::enter(&boxes, node, end, &mut distances);
            if mask != 0 {
                let a = take_child::<L, N, STACK>(tree, node, &distances, &mut mask);
                if mask == 0 {
                    current = child_of(a);
                    continue;
                }
                let b = take_child::<L, N, STACK>(tree, node, &distances, &mut mask);
                let (a, b) = (a.min(b), a.max(b));
                if mask == 0 {
                    stack.push(b);
                    current = child_of(a);
                    continue;
                }
                let c = take_child::<L, N, STACK>(tree, node, &distances, &mut mask);
                let (a, c) = (a.min(c), a.max(c));
                let (b, c) = (b.min(c), b.max(c));
                if mask == 0 {
                    stack.push(c);
                    stack.push(b);
                    current = child_of(a);
                    continue;
                }
                let bottom = stack.depth();
                for key in [c, b, a] {
                    stack.push(key);
                }
                while mask != 0 {
                    stack.insert(
                        bottom,
                        take_child::<L, N, STACK>(tree, node, &distances, &mut mask),
                    );
                }
            }
        }
        loop {
            let Some(key) = stack.pop() else { return best };
            if distance_of(key) <= end {
                current = child_of(key);
                break;
            }
        }
    }
}

/// Whether anything is met with `0 < t < t_max`.
///
/// `STACK` is at least what the tree needs.
#[inline(always)]
pub(super) fn any_hit<L: Lanes, N: Nodes, const STACK: usize>(
    tree: &N,
    ray: &LocalRay,
    t_max: f64,
) -> bool {
    let triangles = L::prepare_triangles(&TriangleTest::new(ray));
    let mut hits = BlockHits::default();
    if tree.root().is_leaf() {
        return leaf_blocks::<L, N>(tree, tree.root(), ray, None, &triangles, t_max, &mut hits);
    }
    let Some(prepared) = L::prepare(ray) else { return false };
    let boxes = L::prepare_boxes(&prepared, tree.reach());
    let end = prepared.distance(t_max);
    let mut stack = Stack::<u32, STACK>::new();
    let mut distances = Distances::default();
    let mut current = tree.root();
    let mut scratch = Node::EMPTY;
    'next: loop {
        if current.is_leaf() {
            let ready = Some(&prepared);
            if leaf_blocks::<L, N>(tree, current, ray, ready, &triangles, t_max, &mut hits) {
                return true;
            }
        } else {
            let node = tree.node(current.index(), &mut scratch);
            let mut mask = L::enter(&boxes, node, end, &mut distances);
            while mask != 0 {
                let child = node.children[take_lane(&mut mask)];
                ask_for::<L, N, STACK>(tree, child);
                if mask == 0 {
                    current = child;
                    continue 'next;
                }
                stack.push(child.0);
            }
        }
        let Some(child) = stack.pop() else { return false };
        current = Child(child);
    }
}
