//! The first step of a build: a binary tree by the surface area heuristic.
//!
//! References to triangles are sorted into bins along each axis by the centres of their boxes, and
//! divided at the border of bins where the expected cost of a ray is least (Wald 2007, "On fast
//! Construction of SAH-based Bounding Volume Hierarchies", section 3). References with equal centres,
//! and those in very deep nodes, are divided in halves, so that the depth is bounded for any input.
//!
//! A subtree over n references has 2n − 1 slots of its own, its left half in those which follow its
//! root. So large subtrees are built in parallel and the result is the same for any number of threads.
//! Small subtrees are packed at the front of their slots; the rest, about two thirds, is memory which
//! is never touched and so never taken from the system.

use super::node::BLOCK;
use crate::math::Aabb;
use bytemuck::Zeroable;
use glam::{Vec3, Vec4};

/// Bins along an axis where there are many references, and where there are few; powers of two.
const MANY_BINS: usize = 16;
const FEW_BINS: usize = 8;
/// References from which on there are many: twice as many bins as that see one each.
const MANY: usize = 128;
/// Nodes at this depth are halved by count, which ends 32 levels further down at the latest.
const DEEPEST_SAH: usize = 40;
/// Most levels of a tree.
pub(super) const DEEPEST: usize = DEEPEST_SAH + 32;
/// Fewest references for which another thread is asked.
pub(super) const PARALLEL: usize = 4096;
/// Most references in a leaf: those of one block, which costs the same however full it is.
pub(super) const LEAF: usize = BLOCK;

/// A triangle, or a part of one, on its way into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    /// Lower corner of its box; the fourth component holds the bits of the triangle's index.
    min: Vec4,
    /// Upper corner of its box; the fourth component has no meaning.
    max: Vec4,
}

impl Reference {
    pub(super) fn new(bounds: &Aabb, triangle: u32) -> Self {
        Self { min: bounds.min.extend(f32::from_bits(triangle)), max: bounds.max.extend(0.0) }
    }

    pub(super) fn triangle(&self) -> u32 {
        self.min.w.to_bits()
    }

    /// Whether there is nothing in its box.
    pub(super) fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    #[cfg(test)]
    pub(super) fn bounds(&self) -> Aabb {
        Aabb { min: self.min.truncate(), max: self.max.truncate() }
    }

    /// Twice the centre of the box.
    #[inline]
    fn center(&self) -> Vec4 {
        self.min + self.max
    }
}

/// A box in vector registers; the fourth component has no meaning.
#[derive(Clone, Copy, Debug)]
struct Extent {
    min: Vec4,
    max: Vec4,
}

impl Extent {
    const EMPTY: Self = Self { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    #[inline]
    fn add(&mut self, min: Vec4, max: Vec4) {
        self.min = self.min.min(min);
        self.max = self.max.max(max);
    }

    /// Half the surface area.
    #[inline]
    fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + (d.x + d.y) * d.z
    }
}

/// The boxes around references and around twice their centres.
#[derive(Clone, Copy, Debug)]
struct Summary {
    boxes: Extent,
    centers: Extent,
}

impl Summary {
    const EMPTY: Self = Self { boxes: Extent::EMPTY, centers: Extent::EMPTY };

    #[inline]
    fn add(&mut self, reference: &Reference) {
        self.boxes.add(reference.min, reference.max);
        let center = reference.center();
        self.centers.add(center, center);
    }

    fn of(references: &[Reference]) -> Self {
        let mut sum = Self::EMPTY;
        for reference in references {
            sum.add(reference);
        }
        sum
    }
}

/// A node of the binary tree: a leaf if it holds at most [`LEAF`] references, else its children are
/// at the places that [`children`] gives.
#[derive(Clone, Copy, Debug, Zeroable)]
#[repr(C)]
pub(super) struct BinaryNode {
    pub(super) bounds: Aabb,
    /// Index of the first of its references, which are contiguous.
    pub(super) first: u32,
    /// Number of its references; 0 for a slot which is not used.
    pub(super) count: u32,
    /// Slots from here to the root of the right subtree.
    right: u32,
}

impl BinaryNode {
    pub(super) fn leaf(bounds: Aabb, first: u32, count: u32) -> Self {
        Self { bounds, first, count, right: 0 }
    }

    pub(super) fn is_inner(&self) -> bool {
        self.right != 0
    }

    pub(super) fn make_inner(&mut self, count: u32, right: u32) {
        (self.count, self.right) = (count, right);
    }
}

/// The slots of the left and of the right subtree below the root of `subtree`.
pub(super) fn children(subtree: &[BinaryNode]) -> (&[BinaryNode], &[BinaryNode]) {
    subtree[1..].split_at(subtree[0].right as usize - 1)
}

/// How splits are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Search {
    /// Few bins everywhere.
    Coarse,
    /// More bins where there are many references.
    Fine,
}

/// Builds the tree and brings the references into its order. Empty without references.
pub(super) fn build(references: &mut [Reference]) -> Vec<BinaryNode> {
    build_by(references, Search::Fine)
}

/// The same with a choice of the search.
pub(super) fn build_by(references: &mut [Reference], search: Search) -> Vec<BinaryNode> {
    let slots = (2 * references.len()).saturating_sub(1);
    let mut nodes = bytemuck::zeroed_vec(slots);
    if !nodes.is_empty() {
        let summary = Summary::of(references);
        // From this count on there are many references.
        let many = if search == Search::Fine { MANY } else { usize::MAX };
        subdivide(&mut nodes, references, 0, &summary, (0, many));
    }
    nodes
}

/// Builds a subtree; returns how many of its slots lie before the end of the last one in use.
fn subdivide(
    nodes: &mut [BinaryNode],
    references: &mut [Reference],
    first: usize,
    summary: &Summary,
    (depth, many): (usize, usize),
) -> usize {
    let count = references.len();
    let Extent { min, max } = summary.boxes;
    let bounds = Aabb { min: min.truncate(), max: max.truncate() };
    nodes[0] = BinaryNode::leaf(bounds, first as u32, count as u32);
    if count <= LEAF {
        return 1;
    }
    let split = if depth >= DEEPEST_SAH {
        None
    } else if count >= many {
        best_split::<MANY_BINS>(references, summary)
    } else {
        best_split::<FEW_BINS>(references, summary)
    };
    let (middle, left_summary, right_summary) = if let Some(split) = split {
        split.apply(references)
    } else {
        let (left, right) = references.split_at(count / 2);
        (left.len(), Summary::of(left), Summary::of(right))
    };
    let (left, right) = references.split_at_mut(middle);
    let (middle, below) = (first + middle, (depth + 1, many));
    if count >= PARALLEL {
        let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left.len() - 1);
        let place = 1 + left_nodes.len();
        let (_, used) = rayon::join(
            || subdivide(left_nodes, left, first, &left_summary, below),
            || subdivide(right_nodes, right, middle, &right_summary, below),
        );
        nodes[0].right = place as u32;
        return place + used;
    }
    let place = 1 + subdivide(&mut nodes[1..], left, first, &left_summary, below);
    nodes[0].right = place as u32;
    place + subdivide(&mut nodes[place..], right, middle, &right_summary, below)
}

/// How centres map to bins.
#[derive(Clone, Copy, Debug)]
struct Binning {
    origin: Vec4,
    per_length: Vec4,
}

impl Binning {
    fn new(centers: &Extent, bins: usize) -> Self {
        let per_length = ((bins - 1) as f32 / (centers.max - centers.min)).to_array();
        // No length, or one whose reciprocal is not a number to bin by: everything in bin 0.
        let per_length = per_length.map(|k| if k.is_normal() { k } else { 0.0 });
        Self { origin: centers.min, per_length: Vec4::from_array(per_length) }
    }

    /// The bins of a reference along the axes: the nearest of `bins` points from the first to the
    /// last centre.
    #[inline]
    fn bins<const BINS: usize>(&self, reference: &Reference) -> [usize; 4] {
        // Numbers from 2²³ on have a unit in the last place of 1: the sum is rounded to an integer,
        // which then stands in the lowest bits.
        let shifted = (reference.center() - self.origin) * self.per_length + 8_388_608.0;
        shifted.to_array().map(|x| x.to_bits() as usize % BINS)
    }
}

/// A plane between two bins.
#[derive(Clone, Copy, Debug)]
struct Split {
    binning: Binning,
    axis: usize,
    first_right: usize,
    many: bool,
}

impl Split {
    /// Moves what lies left of the plane to the front; returns how many, and what lies on both sides.
    fn apply(&self, references: &mut [Reference]) -> (usize, Summary, Summary) {
        if self.many {
            self.apply_by::<MANY_BINS>(references)
        } else {
            self.apply_by::<FEW_BINS>(references)
        }
    }

    fn apply_by<const BINS: usize>(
        &self,
        references: &mut [Reference],
    ) -> (usize, Summary, Summary) {
        let (mut left, mut right) = (Summary::EMPTY, Summary::EMPTY);
        let (mut begin, mut end) = (0, references.len());
        while begin < end {
            let reference = references[begin];
            if self.binning.bins::<BINS>(&reference)[self.axis] < self.first_right {
                left.add(&reference);
                begin += 1;
            } else {
                right.add(&reference);
                end -= 1;
                references.swap(begin, end);
            }
        }
        (begin, left, right)
    }
}

/// The best split by the surface area heuristic; `None` when all centres share their bins.
fn best_split<const BINS: usize>(references: &[Reference], summary: &Summary) -> Option<Split> {
    let binning = Binning::new(&summary.centers, BINS);
    let mut extents = [[Extent::EMPTY; BINS]; 3];
    let mut counts = [[0_u32; BINS]; 3];
    for reference in references {
        let bin = binning.bins::<BINS>(reference);
        for axis in 0..3 {
            extents[axis][bin[axis]].add(reference.min, reference.max);
            counts[axis][bin[axis]] += 1;
        }
    }
    let total = references.len() as u32;
    let mut best = (f32::INFINITY, None);
    for axis in 0..3 {
        let (extents, counts) = (&extents[axis], &counts[axis]);
        // Area times count of everything to the right of each plane, then the same from the left.
        let mut right_cost = [0.0_f32; BINS];
        let (mut sum, mut count) = (Extent::EMPTY, 0);
        for k in (1..BINS).rev() {
            sum.add(extents[k].min, extents[k].max);
            count += counts[k];
            right_cost[k] = sum.half_area() * count as f32;
        }
        let (mut sum, mut count) = (Extent::EMPTY, 0);
        for k in 1..BINS {
            sum.add(extents[k - 1].min, extents[k - 1].max);
            count += counts[k - 1];
            if count == 0 || count == total {
                continue;
            }
            let cost = sum.half_area() * count as f32 + right_cost[k];
            // Areas which overflow compare as equal: the first plane is as good as any.
            if cost < best.0 || best.1.is_none() {
                best =
                    (cost, Some(Split { binning, axis, first_right: k, many: BINS == MANY_BINS }));
            }
        }
    }
    best.1
}

/// The box of a triangle, or `None` if it is not finite.
pub(super) fn bounds_of(corners: [Vec3; 3]) -> Option<Aabb> {
    let bounds = Aabb::from_points(corners);
    corners.iter().all(|v| v.is_finite()).then_some(bounds)
}
