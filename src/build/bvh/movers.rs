//! Objects which move far while the shutter is open: a tree for each part of it.
//!
//! What crosses the picture within the shutter has a box as long as its way, and a ray, which knows its
//! time, meets many boxes whose objects are elsewhere then. The shutter is therefore cut into equal
//! segments, and each has a tree over the boxes of these objects during that segment alone. The top level
//! holds all of them as one object, and a ray which meets its box looks at the tree of its time.
//!
//! A box holds the way of its object in a closed segment ([`swept_bounds`]), and hits come from the object
//! itself: they do not depend on the number of segments.
//!
//! Trees by segments are the simplest of the ways to bound motion; see Woop, Áfra and Benthin 2017, "STBVH:
//! A Spatial-Temporal BVH for Efficient Multi-Segment Motion Blur", High Performance Graphics, sections 2
//! and 3, for the others.

use super::Bvh;
use super::wide::BoxTree;
use crate::extract::{Geometry, Instance};
use crate::math::{Aabb, swept_bounds};
use rayon::prelude::*;

/// An object moves far when the box of its whole way has this many times the area of its box at one time:
/// about that of a ball which moves by four times its radius.
const FAR: f32 = 2.0;
/// The number of segments is doubled as long as that leaves at most this share of the area of the boxes,
/// to which the number of objects that a ray asks is proportional.
const WORTH: f32 = 0.75;
/// Most segments.
const MOST_SEGMENTS: usize = 64;
/// Most boxes of all segments together; each takes about 60 bytes.
const MOST_BOXES: usize = 1 << 20;
/// Objects by which the number of segments is chosen.
const ASKED: usize = 256;

/// The objects which move far.
#[derive(Clone, Debug)]
pub(super) struct Movers {
    /// Their indices, ascending.
    members: Vec<u32>,
    /// For each segment the tree over them.
    trees: Vec<BoxTree>,
    /// Around all of them during the whole shutter.
    pub(super) bounds: Aabb,
}

/// A moving object: its index and the box of its geometry.
pub(super) type Mover = (u32, Aabb);

impl Movers {
    /// Builds the trees of the segments; `None` without any objects.
    pub(super) fn build(movers: &[Mover], instances: &[Instance]) -> Option<Self> {
        let segments = segments_for(movers, instances);
        Self::with_segments(movers, instances, segments)
    }

    /// The same with so many segments.
    pub(super) fn with_segments(
        movers: &[Mover],
        instances: &[Instance],
        segments: usize,
    ) -> Option<Self> {
        if movers.is_empty() {
            return None;
        }
        let members: Vec<u32> = movers.iter().map(|(index, _)| *index).collect();
        let tree = |segment| {
            let boxes: Vec<Aabb> = movers
                .iter()
                .map(|mover| segment_bounds(mover, instances, segment, segments))
                .collect();
            BoxTree::collapse(&Bvh::build(&boxes, 1), &boxes, &members)
        };
        let trees: Vec<BoxTree> = (0..segments).into_par_iter().map(tree).collect();
        let bounds = trees.iter().fold(Aabb::EMPTY, |sum, tree| sum.union(tree.bounds()));
        Some(Self { members, trees, bounds })
    }

    /// Whether these are the objects.
    pub(super) fn are(&self, movers: &[Mover]) -> bool {
        self.members.iter().eq(movers.iter().map(|(index, _)| index))
    }

    /// The tree over the objects at a time in `[0, 1]`.
    #[inline]
    pub(super) fn at(&self, time: f32) -> &BoxTree {
        // Exact, since the number of segments is a power of two; a time on a border is in both.
        let segment = (time * self.trees.len() as f32) as usize;
        &self.trees[segment.min(self.trees.len() - 1)]
    }

    /// Number of segments.
    pub(super) fn segments(&self) -> usize {
        self.trees.len()
    }

    /// Bytes held.
    pub(super) fn memory(&self) -> usize {
        self.trees.iter().map(BoxTree::memory).sum::<usize>()
            + self.members.capacity() * size_of::<u32>()
    }
}

/// The object as a mover, if it moves far. `mesh_bounds` has the boxes of the meshes; an object whose
/// mesh is not among them is none.
pub(super) fn mover(index: u32, instance: &Instance, mesh_bounds: &[Aabb]) -> Option<Mover> {
    if instance.motion.is_static() || !instance.bounds.min.is_finite() {
        return None;
    }
    let own = match &instance.geometry {
        Geometry::Primitive(primitive) => primitive.bounds(),
        Geometry::Mesh(mesh) => *mesh_bounds.get(*mesh as usize)?,
    };
    let at = |time| swept_bounds(&own, &instance.motion, time, time).area();
    let far = instance.bounds.area() > FAR * at(0.0).midpoint(at(1.0));
    far.then_some((index, own))
}

/// The box of an object during a segment.
fn segment_bounds(
    (index, own): &Mover,
    instances: &[Instance],
    segment: usize,
    segments: usize,
) -> Aabb {
    let border = |k: usize| k as f32 / segments as f32;
    swept_bounds(own, &instances[*index as usize].motion, border(segment), border(segment + 1))
}

/// The number of segments that the motion of these objects is worth, a power of two.
fn segments_for(movers: &[Mover], instances: &[Instance]) -> usize {
    let most = (MOST_BOXES / movers.len().max(1)).clamp(1, MOST_SEGMENTS);
    let stride = movers.len().div_ceil(ASKED).max(1);
    // The mean over the segments of the area of all boxes.
    let area = |segments: usize| {
        let of = |segment| {
            let asked = movers.iter().step_by(stride);
            asked.map(|m| segment_bounds(m, instances, segment, segments).area()).sum::<f32>()
        };
        (0..segments).map(of).sum::<f32>() / segments as f32
    };
    let (mut segments, mut now) = (1, area(1));
    while 2 * segments <= most {
        let halved = area(2 * segments);
        // Also where areas are beyond the range of numbers and nothing is known.
        let is_worth_it = halved <= WORTH * now;
        if !is_worth_it {
            break;
        }
        (segments, now) = (2 * segments, halved);
    }
    segments
}
