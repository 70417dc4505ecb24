//! The tree of a mesh whose corners move while the shutter is open.
//!
//! The corners are given at evenly spaced keys over the shutter and move straight between two of
//! them. Each such segment has a tree of its own: the boxes of its nodes are kept where they begin,
//! with how far they move, so that they fit at every time and not only around the whole motion
//! (Grünschloß, Stich, Nawaz, Keller 2011, "MSBVH: An Efficient Acceleration Data Structure for Ray
//! Traced Motion Blur", HPG, section 3). Triangles are tested by the same exact test as those at rest,
//! with corners interpolated in `f64`, so that neighbours which share their corners leave no gap.

use super::Instructions;
use super::binary::{self, Reference};
use super::collapse::collapse;
use super::node::{BLOCK, Block, Child, Node, WIDTH};
use super::traverse::{BlockHits, Lanes, Nodes, TriangleHit, WideCorners};
use crate::math::Aabb;
use crate::shape::LocalRay;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// By how much a plane is moved outwards, as a fraction of its largest coordinate.
///
/// With `u = 2⁻²⁴` and `m` the larger coordinate, the difference of both ends is off by at most `2m·u`,
/// its product with the time by another `2m·u`, the sum by `m·u`; and the box of a triangle, with
/// which it is compared, was rounded outwards by up to `2m·u`. These 7 units and what is of higher
/// order stay below 8; the sum which moves the plane is rounded by one unit and is given twice as many.
const ASIDE: f32 = 8.0 * f32::EPSILON;

/// The tree of a mesh in motion.
#[derive(Clone, Debug, Default)]
pub struct MovingTree {
    /// At least one if there is a triangle.
    segments: Vec<Segment>,
}

/// A tree from one key to the next.
#[derive(Clone, Debug)]
struct Segment {
    nodes: Vec<MovingNode>,
    blocks: Vec<MovingBlock>,
    root: Child,
    stack: usize,
    /// No coordinate of a box is farther from 0 at any time.
    reach: f32,
}

/// A node at its beginning, and how far the planes of its boxes move.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct MovingNode {
    begin: Node,
    motion: [[f32; WIDTH]; 6],
}

/// Four triangles at the beginning and at the end.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct MovingBlock {
    begin: Block,
    end: [[[f32; BLOCK]; 3]; 3],
}

/// A segment at a time.
struct At<'a> {
    segment: &'a Segment,
    /// In `[0, 1]`.
    time: f32,
}

impl MovingTree {
    /// Builds the tree of `triangles` whose corners are given at evenly spaced `keys` over the shutter,
    /// both ends included; one key is a mesh at rest. Triangles which have a corner that is not finite
    /// at any key, or that a key does not have, are left out.
    pub fn build(triangles: &[[u32; 3]], keys: &[&[Vec3]]) -> Self {
        let corners = |key: usize, triangle: u32| -> Option<[Vec3; 3]> {
            let [a, b, c] = triangles[triangle as usize];
            let at = |k: u32| keys[key].get(k as usize).copied().filter(|p| p.is_finite());
            Some([at(a)?, at(b)?, at(c)?])
        };
        let whole: Vec<u32> = (0..triangles.len() as u32)
            .into_par_iter()
            .filter(|&triangle| (0..keys.len()).all(|key| corners(key, triangle).is_some()))
            .collect();
        if whole.is_empty() || keys.is_empty() {
            return Self::default();
        }
        // Only triangles are asked for whose corners were found above.
        let at = |key: usize| {
            move |triangle: u32| triangles[triangle as usize].map(|k| keys[key][k as usize])
        };
        let last = keys.len() - 1;
        let segments =
            (0..last.max(1)).map(|k| Segment::build(&whole, at(k), at((k + 1).min(last))));
        Self { segments: segments.collect() }
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        let bytes = |segment: &Segment| {
            segment.nodes.capacity() * size_of::<MovingNode>()
                + segment.blocks.capacity() * size_of::<MovingBlock>()
        };
        self.segments.iter().map(bytes).sum()
    }

    /// The nearest hit at `time`, in `[0, 1]` over the shutter, with `0 < t < t_max`; among equal ones
    /// that of the lowest triangle.
    #[inline]
    pub fn closest_hit(&self, ray: &LocalRay, time: f32, t_max: f64) -> Option<TriangleHit> {
        self.closest_hit_by(Instructions::detect(), ray, time, t_max)
    }

    /// Whether any triangle is hit at `time` with `0 < t < t_max`.
    #[inline]
    pub fn any_hit(&self, ray: &LocalRay, time: f32, t_max: f64) -> bool {
        self.any_hit_by(Instructions::detect(), ray, time, t_max)
    }

    #[inline]
    pub(super) fn closest_hit_by(
        &self,
        instructions: Instructions,
        ray: &LocalRay,
        time: f32,
        t_max: f64,
    ) -> Option<TriangleHit> {
        let at = self.at(time)?;
        instructions.closest_hit(&at, at.segment.stack, ray, t_max)
    }

    #[inline]
    pub(super) fn any_hit_by(
        &self,
        instructions: Instructions,
        ray: &LocalRay,
        time: f32,
        t_max: f64,
    ) -> bool {
        let at = self.at(time);
        at.is_some_and(|at| instructions.any_hit(&at, at.segment.stack, ray, t_max))
    }

    /// The segment of a time, and the time in it.
    #[inline]
    fn at(&self, time: f32) -> Option<At<'_>> {
        let (index, time) = segment_of(time, self.segments.len());
        Some(At { segment: self.segments.get(index)?, time })
    }
}

/// Which of `count` equal segments of `[0, 1]` a time lies in, and where, in `[0, 1]`; the end of all is
/// the end of the last.
#[inline]
pub(in super::super) fn segment_of(time: f32, count: usize) -> (usize, f32) {
    let place = time.clamp(0.0, 1.0) * count as f32;
    let index = (place as usize).min(count.saturating_sub(1));
    (index, place - index as f32)
}

/// The corners at a time in `[0, 1]` between two keys.
#[inline(always)]
pub(super) fn between(begin: f32, end: f32, time: f64) -> f64 {
    let (a, b) = (f64::from(begin), f64::from(end));
    a + time * (b - a)
}

impl Segment {
    fn build(
        triangles: &[u32],
        begin: impl Fn(u32) -> [Vec3; 3] + Sync,
        end: impl Fn(u32) -> [Vec3; 3] + Sync,
    ) -> Self {
        // By the boxes around the whole motion: near things then stay near.
        let reference = |&triangle: &u32| {
            let corners = begin(triangle).into_iter().chain(end(triangle));
            Reference::new(&Aabb::from_points(corners), triangle)
        };
        let mut references: Vec<Reference> = triangles.par_iter().map(reference).collect();
        let binary = binary::build(&mut references);
        let tree = collapse(&begin, references, &binary);
        let block = |block: &Block| {
            let mut last = Block::EMPTY;
            for lane in block.used() {
                last.set(lane, block.triangles[lane], end(block.triangles[lane]));
            }
            MovingBlock { begin: *block, end: last.corners }
        };
        let blocks = tree.blocks.par_iter().map(block).collect();
        let node = |&begin: &Node| MovingNode { begin, motion: [[0.0; WIDTH]; 6] };
        let nodes = tree.nodes.par_iter().map(node).collect();
        let mut this = Self { nodes, blocks, root: tree.root, stack: tree.stack, reach: 0.0 };
        this.fit_boxes();
        this
    }

    /// Gives all nodes their boxes at the beginning and at the end. Children come after their parent.
    fn fit_boxes(&mut self) {
        let mut ends = vec![[Aabb::EMPTY; 2]; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                let child = self.nodes[index].begin.children[slot];
                if child == Child::NOTHING {
                    continue;
                }
                let boxes =
                    if child.is_leaf() { self.leaf_boxes(child) } else { ends[child.index()] };
                self.nodes[index].set_boxes(slot, boxes);
                for (sum, bounds) in ends[index].iter_mut().zip(boxes) {
                    *sum = sum.union(bounds);
                }
            }
        }
        // That of a tree without nodes is not asked for.
        let [begin, end] = ends.first().copied().unwrap_or_default();
        self.reach = begin.union(end).reach() * (1.0 + 4.0 * ASIDE) + f32::MIN_POSITIVE;
    }

    fn leaf_boxes(&self, leaf: Child) -> [Aabb; 2] {
        let mut boxes = [Aabb::EMPTY; 2];
        for block in &self.blocks[leaf.blocks()] {
            let end = Block { corners: block.end, ..block.begin };
            for lane in block.begin.used() {
                boxes[0] = boxes[0].union(Aabb::from_points(block.begin.get(lane)));
                boxes[1] = boxes[1].union(Aabb::from_points(end.get(lane)));
            }
        }
        boxes
    }
}

impl MovingNode {
    /// Sets where the box of a child begins and ends, so that it is never too small between.
    fn set_boxes(&mut self, slot: usize, [begin, end]: [Aabb; 2]) {
        for axis in 0..3 {
            let (low, high) = (2 * axis, 2 * axis + 1);
            for (plane, first, last, outwards) in [
                (low, begin.min[axis], end.min[axis], -1.0),
                (high, begin.max[axis], end.max[axis], 1.0),
            ] {
                let aside = first.abs().max(last.abs()) * ASIDE + f32::MIN_POSITIVE;
                let motion = last - first;
                let (first, motion) = if motion.is_finite() {
                    (first, motion)
                } else {
                    // Too far for the range of numbers: a box around the whole motion.
                    (if outwards < 0.0 { first.min(last) } else { first.max(last) }, 0.0)
                };
                self.begin.planes[plane][slot] = first + outwards * aside;
                self.motion[plane][slot] = motion;
            }
        }
    }
}

impl At<'_> {
    /// The corners of a block in `f64`.
    #[inline(always)]
    fn corners(&self, block: usize) -> WideCorners {
        let block = &self.segment.blocks[block];
        let time = f64::from(self.time);
        let mut corners = WideCorners([[[0.0; BLOCK]; 3]; 3]);
        for (corner, (begin, end)) in
            corners.0.iter_mut().zip(block.begin.corners.iter().zip(&block.end))
        {
            for axis in 0..3 {
                for lane in 0..BLOCK {
                    corner[axis][lane] = between(begin[axis][lane], end[axis][lane], time);
                }
            }
        }
        corners
    }
}

impl Nodes for At<'_> {
    #[inline(always)]
    fn root(&self) -> Child {
        self.segment.root
    }

    #[inline(always)]
    fn reach(&self) -> f32 {
        self.segment.reach
    }

    #[inline(always)]
    fn node<'a>(&'a self, index: usize, scratch: &'a mut Node) -> &'a Node {
        let node = &self.segment.nodes[index];
        for plane in 0..6 {
            for slot in 0..WIDTH {
                scratch.planes[plane][slot] =
                    node.begin.planes[plane][slot] + self.time * node.motion[plane][slot];
            }
        }
        scratch.children = node.begin.children;
        scratch
    }

    #[inline(always)]
    fn hit<L: Lanes>(
        &self,
        block: usize,
        ray: &L::Triangles,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32 {
        L::hit_wide(ray, &self.corners(block), t_max, hits)
    }

    #[inline(always)]
    fn triangle(&self, block: usize, lane: usize) -> u32 {
        self.segment.blocks[block].begin.triangles[lane]
    }

    #[inline(always)]
    fn triangle_bounds(&self, block: usize, lane: usize) -> Aabb {
        let corners = self.corners(block).0;
        rounded_box(corners.map(|corner| DVec3::from_array(corner.map(|row| row[lane]))))
    }

    #[inline(always)]
    fn place(&self, child: Child) -> (*const i8, usize) {
        if child.is_leaf() {
            let first = child.blocks().start;
            (self.segment.blocks.as_ptr().wrapping_add(first).cast(), 5)
        } else {
            (self.segment.nodes.as_ptr().wrapping_add(child.index()).cast(), 7)
        }
    }
}

/// The smallest box of `f32` around corners in `f64`.
#[inline(always)]
pub(super) fn rounded_box([a, b, c]: [DVec3; 3]) -> Aabb {
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let down = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
    let up = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
    Aabb {
        min: Vec3::new(down(low.x), down(low.y), down(low.z)),
        max: Vec3::new(up(high.x), up(high.y), up(high.z)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::WideTree;
    use super::super::meshes::{RawMesh, Uniforms};
    use super::super::ray::BoxRay;
    use super::super::tests::all_instructions;
    use super::*;
    use crate::description::{BvhQuality, TriangleMesh};
    use crate::shape::TriangleTest;
    use glam::Quat;

    const RAYS: u64 = if cfg!(debug_assertions) { 1_000 } else { 20_000 };

    /// A mesh at `count` keys: it turns, grows and bends.
    fn keys(raw: &RawMesh, count: usize) -> Vec<Vec<Vec3>> {
        let size = raw.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let bend = |p: Vec3, s: f32| {
            Quat::from_rotation_y(2.0 * s + p.y * s) * p * (1.0 + 0.5 * s)
                + Vec3::X * (3.0 * size * s * s)
        };
        (0..count)
            .map(|k| raw.positions.iter().map(|&p| bend(p, k as f32 / count as f32)).collect())
            .collect()
    }

    fn tree_of(raw: &RawMesh, keys: &[Vec<Vec3>]) -> MovingTree {
        let keys: Vec<&[Vec3]> = keys.iter().map(Vec::as_slice).collect();
        MovingTree::build(&raw.triangles, &keys)
    }

    /// The corners of a triangle at a time.
    fn corners_at(raw: &RawMesh, keys: &[Vec<Vec3>], triangle: u32, time: f32) -> [DVec3; 3] {
        let (segment, time) = segment_of(time, keys.len() - 1);
        raw.triangles[triangle as usize].map(|k| {
            let (a, b) = (keys[segment][k as usize], keys[segment + 1][k as usize]);
            let at = |axis: usize| between(a[axis], b[axis], f64::from(time));
            DVec3::new(at(0), at(1), at(2))
        })
    }

    /// The definition: every triangle as it is at the time.
    fn nearest_of_all(
        raw: &RawMesh,
        keys: &[Vec<Vec3>],
        ray: &LocalRay,
        time: f32,
    ) -> Option<TriangleHit> {
        let (test, boxes) = (TriangleTest::new(ray), BoxRay::new(ray)?);
        let mut best: Option<TriangleHit> = None;
        for triangle in 0..raw.triangles.len() as u32 {
            let corners = corners_at(raw, keys, triangle, time);
            let end = best.map_or(f64::INFINITY, |best| best.t);
            if let Some((t, weights)) = test.intersect_exact(corners, end)
                && boxes.reaches(&rounded_box(corners), t)
            {
                best = Some(TriangleHit { t, triangle, weights });
            }
        }
        best
    }

    /// A time: both ends, keys, and anything.
    fn time(number: u64, u: &mut Uniforms) -> f32 {
        match number % 5 {
            0 => 0.0,
            1 => 1.0,
            2 => u.below(4) as f32 / 3.0,
            _ => u.one(),
        }
    }

    /// Oracle: the test of every triangle, at ends and at keys of the shutter too. Equal bits.
    #[test]
    fn hits_are_those_of_every_triangle_at_its_time() {
        for (what, raw, count) in [
            ("soup, two keys", RawMesh::soup(150, 0.3, 1), 2),
            ("soup, four keys", RawMesh::soup(150, 0.3, 2), 4),
            ("one triangle", RawMesh::soup(1, 1.0, 3), 2),
            ("far away", RawMesh::soup(150, 0.3, 4).map(|p| p + 1e6), 2),
            ("tiny", RawMesh::soup(150, 0.3, 5).map(|p| p * 1e-30), 3),
            ("flat", RawMesh::soup(150, 0.5, 7).map(|p| Vec3::new(p.x, 2.0, p.z)), 2),
        ] {
            let keys = keys(&raw, count);
            let tree = tree_of(&raw, &keys);
            let mut hits = 0;
            for number in 0..RAYS {
                let mut u = Uniforms(number);
                let time = time(number, &mut u);
                let mut anywhere = || {
                    let triangle = u.below(raw.triangles.len()) as u32;
                    let [a, b, c] = corners_at(&raw, &keys, triangle, time);
                    match u.below(3) {
                        0 => a,
                        1 => a.lerp(b, f64::from(u.one())),
                        _ => (a + b + c) / 3.0,
                    }
                };
                let (from, to) = (anywhere(), anywhere());
                let ray = LocalRay { o: from - (to - from) * 2.0, d: to - from };
                let expected = nearest_of_all(&raw, &keys, &ray, time);
                for instructions in all_instructions() {
                    let found = tree.closest_hit_by(instructions, &ray, time, f64::INFINITY);
                    assert_eq!(found, expected, "{what}, ray {number}, {instructions:?}");
                    let any = tree.any_hit_by(instructions, &ray, time, f64::INFINITY);
                    assert_eq!(any, expected.is_some(), "{what}, ray {number}, {instructions:?}");
                }
                hits += u64::from(expected.is_some());
            }
            // Rays from point to point of a plane stay in it.
            assert!(hits > RAYS / 4 || what == "flat", "{what}: {hits}");
        }
    }

    /// Oracle: a closed surface stays closed while it bends, also for rays to its corners and edges.
    #[test]
    fn no_ray_leaves_a_closed_surface_in_motion() {
        let raw = RawMesh::icosphere(3);
        let keys = keys(&raw, 3);
        let tree = tree_of(&raw, &keys);
        for number in 0..RAYS {
            let mut u = Uniforms(number);
            let time = time(number, &mut u);
            let corners = |triangle: usize| corners_at(&raw, &keys, triangle as u32, time);
            // The centre of the first key's ball moves like every point: it stays inside.
            let points = (0..raw.triangles.len()).map(|k| corners(k)[0]);
            let center = points.sum::<DVec3>() / raw.triangles.len() as f64;
            let [a, b, c] = corners(u.below(raw.triangles.len()));
            let target = [a, a.lerp(b, f64::from(u.one())), (a + b + c) / 3.0][u.below(3)];
            let ray = LocalRay { o: center, d: target - center };
            for instructions in all_instructions() {
                let hit = tree.closest_hit_by(instructions, &ray, time, f64::INFINITY);
                assert!(hit.is_some(), "ray {number} at {time} by {instructions:?}");
            }
        }
    }

    /// Oracle: the tree for meshes at rest.
    #[test]
    fn a_mesh_which_rests_is_hit_as_one_at_rest() {
        let raw = RawMesh::terrain(20, 3, 4);
        let mesh = TriangleMesh {
            positions: raw.positions.clone(),
            triangles: raw.triangles.clone(),
            ..Default::default()
        };
        let rest = WideTree::build(&mesh, BvhQuality::Fast);
        for keys in [vec![raw.positions.clone()], vec![raw.positions.clone(); 3]] {
            let tree = tree_of(&raw, &keys);
            for number in 0..RAYS {
                let mut u = Uniforms(number);
                let o = u.three().as_dvec3() + DVec3::Y;
                let ray = LocalRay { o, d: u.three().as_dvec3() - o };
                let expected = rest.closest_hit(&ray, f64::INFINITY);
                assert_eq!(tree.closest_hit(&ray, time(number, &mut u), f64::INFINITY), expected);
            }
        }
    }

    /// What cannot be built from is left out, and nothing panics.
    #[test]
    fn broken_input_makes_a_tree_of_the_rest() {
        assert_eq!(MovingTree::build(&[], &[]).memory(), 0);
        assert_eq!(MovingTree::build(&[[0, 1, 2]], &[]).memory(), 0);
        let ray = LocalRay { o: DVec3::new(0.2, 0.2, -1.0), d: DVec3::Z };
        let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let bad = [Vec3::NAN, Vec3::X, Vec3::Y];
        assert!(MovingTree::build(&[[0, 1, 2]], &[&good, &good]).any_hit(&ray, 0.5, f64::INFINITY));
        for keys in [[&good[..], &bad[..]], [&good[..], &good[..2]]] {
            let tree = MovingTree::build(&[[0, 1, 2]], &keys);
            assert!(!tree.any_hit(&ray, 0.0, f64::INFINITY));
        }
        // So far that the distance overflows: from one end of the numbers to the other.
        let far = good.map(|p| p * 0.5 + Vec3::X * f32::MAX);
        let near = good.map(|p| p * 0.5 - Vec3::X * f32::MAX);
        let tree = MovingTree::build(&vec![[0, 1, 2]; 20], &[&near, &far]);
        tree.closest_hit(&ray, 0.5, f64::INFINITY);
    }
}
