//! What the tree is made of: nodes of eight children, and blocks of four triangles.

use crate::math::Aabb;
use glam::Vec3;

/// Children of a node, and lanes of the box test.
pub(super) const WIDTH: usize = 8;
/// Triangles of a block, and lanes of the triangle test.
pub(super) const BLOCK: usize = 4;

/// What a slot of a node leads to: another node, or a run of blocks.
///
/// A leaf has the highest bit set, its number of blocks (at most 3) in the next two bits and the
/// index of its first block in the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const COUNT_SHIFT: u32 = 29;
    const FIRST: u32 = (1 << Self::COUNT_SHIFT) - 1;

    /// A leaf without blocks: also what an unused slot holds, so that nothing happens if rounding at
    /// the ends of the range of numbers lets a ray in.
    pub(super) const NOTHING: Self = Self(Self::LEAF);

    pub(super) fn node(index: usize) -> Self {
        debug_assert!(index < Self::LEAF as usize);
        Self(index as u32)
    }

    pub(super) fn leaf(first: usize, blocks: usize) -> Self {
        debug_assert!(first <= Self::FIRST as usize && blocks <= 3);
        Self(Self::LEAF | (blocks as u32) << Self::COUNT_SHIFT | first as u32)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Index of the node; meaningless for a leaf.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }

    /// The blocks of a leaf; meaningless for a node.
    #[inline(always)]
    pub(super) fn blocks(self) -> std::ops::Range<usize> {
        let first = (self.0 & Self::FIRST) as usize;
        first..first + ((self.0 & !Self::LEAF) >> Self::COUNT_SHIFT) as usize
    }
}

/// A node: the boxes of its children, by plane, and where they lead.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    /// Lower and upper planes in turn for x, y and z.
    pub(super) planes: [[f32; WIDTH]; 6],
    pub(super) children: [Child; WIDTH],
}

const _: () = assert!(size_of::<Node>() == 256);

impl Node {
    pub(super) const EMPTY: Self = {
        let (lo, hi) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { planes: [lo, hi, lo, hi, lo, hi], children: [Child::NOTHING; WIDTH] }
    };

    pub(super) fn set_box(&mut self, slot: usize, bounds: &Aabb) {
        for axis in 0..3 {
            self.planes[2 * axis][slot] = bounds.min[axis];
            self.planes[2 * axis + 1][slot] = bounds.max[axis];
        }
    }

    pub(super) fn get_box(&self, slot: usize) -> Aabb {
        let p = |k: usize| self.planes[k][slot];
        Aabb { min: Vec3::new(p(0), p(2), p(4)), max: Vec3::new(p(1), p(3), p(5)) }
    }

    /// The box around all children.
    pub(super) fn bounds(&self) -> Aabb {
        (0..WIDTH).fold(Aabb::EMPTY, |sum, slot| sum.union(self.get_box(slot)))
    }
}

/// Four triangles, by coordinate.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Block {
    /// By corner, axis and lane.
    pub(super) corners: [[[f32; BLOCK]; 3]; 3],
    /// Index of the triangle in its mesh; [`Block::UNUSED`] in an unused lane.
    pub(super) triangles: [u32; BLOCK],
}

const _: () = assert!(size_of::<Block>() == 160);

impl Block {
    pub(super) const UNUSED: u32 = u32::MAX;
    /// No triangle: three equal corners are never hit.
    pub(super) const EMPTY: Self =
        Self { corners: [[[0.0; BLOCK]; 3]; 3], triangles: [Self::UNUSED; BLOCK] };

    pub(super) fn set(&mut self, lane: usize, triangle: u32, corners: [Vec3; 3]) {
        self.triangles[lane] = triangle;
        for (corner, v) in self.corners.iter_mut().zip(corners) {
            for (axis, coordinates) in corner.iter_mut().enumerate() {
                coordinates[lane] = v[axis];
            }
        }
    }

    pub(super) fn get(&self, lane: usize) -> [Vec3; 3] {
        self.corners.map(|corner| Vec3::from_array(corner.map(|coordinates| coordinates[lane])))
    }

    /// The lanes in use.
    pub(super) fn used(&self) -> impl Iterator<Item = usize> {
        (0..BLOCK).filter(|&lane| self.triangles[lane] != Self::UNUSED)
    }
}
