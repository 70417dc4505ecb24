//! The tree of a triangle mesh: nodes of eight children, leaves of blocks of four triangles.
//!
//! Eight boxes, or four triangles, are tested by one run of vector instructions, and a ray visits a
//! third of the nodes of a binary tree (Wald, Benthin, Boulos 2008, "Getting Rid of Packets",
//! section 3). Boxes are `f32` and conservative; triangles are tested in `f64` with the watertight
//! test of [`TriangleTest`](crate::shape::TriangleTest). What a ray hits is therefore defined without
//! the tree: the nearest of all triangles by that test, the lowest index among equal ones. It does not
//! depend on how the tree was built or refitted, on the number of threads, or on the processor: the
//! vector instructions and plain Rust give the same bits.
//!
//! One exception is left open. In the plane of a triangle, to within the rounding of `f64`, a ray may
//! count as a hit of it although it only passes its box; if the triangle was cut into parts, it may
//! pass the boxes of all parts. Such a hit would come and go with the cuts, which depend on the mesh
//! and the budget alone.

#![expect(
    clippy::inline_always,
    reason = "vector instructions are inlined only into functions that have their features"
)]

#[cfg(target_arch = "x86_64")]
mod avx2;
mod binary;
mod boxes;
mod collapse;
#[cfg(test)]
mod meshes;
mod moving;
mod node;
mod pages;
mod presplit;
mod ray;
mod reinsert;
mod stack;
#[cfg(test)]
mod tests;
mod traverse;

pub use boxes::BoxTree;
pub use moving::MovingTree;
pub(super) use moving::segment_of;
pub use traverse::TriangleHit;

use crate::description::{BvhQuality, TriangleMesh};
use crate::math::Aabb;
use crate::shape::LocalRay;
use binary::{DEEPEST, Search};
use glam::Vec3;
use node::{BLOCK, Block, Child, Node, WIDTH};
use rayon::prelude::*;
use traverse::{BlockHits, Lanes, Nodes, Portable, any_hit, closest_hit};

/// Room on the stack that is enough for two levels of nodes, which lie in the cache with their blocks.
const TINY_STACK: usize = 2 * (WIDTH - 1) + 1;
/// Room that is enough for all but odd trees.
const SHORT_STACK: usize = 96;
/// Room that is enough for any tree: every level leaves all children but one on the stack.
const LONG_STACK: usize = DEEPEST * (WIDTH - 1) + 1;

/// The share of references that may be added by cutting large triangles into parts.
///
/// A tenth costs a tenth of the memory and a fifth of the build; rays among long triangles which do not
/// follow the axes became 1.6 times as fast, those over even hills 1.05 times slower.
fn split_budget(quality: BvhQuality) -> f32 {
    match quality {
        BvhQuality::Fast => 0.0,
        BvhQuality::Balanced | BvhQuality::Best => 0.1,
    }
}

/// The tree of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct WideTree {
    /// Children come after their parent.
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    root: Child,
    /// Room on the stack that a traversal takes at most.
    stack: usize,
    /// No coordinate of a box is farther from 0.
    reach: f32,
}

impl Default for WideTree {
    fn default() -> Self {
        Self { nodes: Vec::new(), blocks: Vec::new(), root: Child::NOTHING, stack: 0, reach: 0.0 }
    }
}

/// Which instructions traverse a tree. The hits are the same.
#[derive(Clone, Copy, Debug)]
enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
    Portable,
}

impl Instructions {
    /// The best that this processor has.
    #[inline]
    fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = avx2::Avx2::detect() {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }

    /// These, or plain ones for rays and boxes of a size that they are not made for.
    #[inline]
    fn fit_for(self, ray: &LocalRay, reach: f32) -> Self {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) if avx2.fits(ray, reach) => self,
            _ => Self::Portable,
        }
    }

    /// The nearest hit in a tree whose traversal takes `stack` places.
    #[inline]
    fn closest_hit<N: Nodes>(
        self,
        tree: &N,
        stack: usize,
        ray: &LocalRay,
        t_max: f64,
    ) -> Option<TriangleHit> {
        match (self.fit_for(ray, tree.reach()), stack) {
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2(avx2), ..=TINY_STACK) => {
                avx2.closest_hit::<N, TINY_STACK>(tree, ray, t_max)
            }
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2(avx2), ..=SHORT_STACK) => {
                avx2.closest_hit::<N, SHORT_STACK>(tree, ray, t_max)
            }
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2(avx2), _) => avx2.closest_hit::<N, LONG_STACK>(tree, ray, t_max),
            (Self::Portable, ..=SHORT_STACK) => {
                closest_hit::<Portable, N, SHORT_STACK>(tree, ray, t_max)
            }
            (Self::Portable, _) => closest_hit::<Portable, N, LONG_STACK>(tree, ray, t_max),
        }
    }

    /// Whether anything is hit in a tree whose traversal takes `stack` places.
    #[inline]
    fn any_hit<N: Nodes>(self, tree: &N, stack: usize, ray: &LocalRay, t_max: f64) -> bool {
        match (self.fit_for(ray, tree.reach()), stack) {
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2(avx2), ..=TINY_STACK) => avx2.any_hit::<N, TINY_STACK>(tree, ray, t_max),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2(avx2), ..=SHORT_STACK) => avx2.any_hit::<N, SHORT_STACK>(tree, ray, t_max),
            #[cfg(target_arch = "x86_64")]
            (Self::Avx2(avx2), _) => avx2.any_hit::<N, LONG_STACK>(tree, ray, t_max),
            (Self::Portable, ..=SHORT_STACK) => {
                any_hit::<Portable, N, SHORT_STACK>(tree, ray, t_max)
            }
            (Self::Portable, _) => any_hit::<Portable, N, LONG_STACK>(tree, ray, t_max),
        }
    }
}

impl WideTree {
    /// Builds the tree of `mesh`, in parallel. Triangles with a corner that is not finite are left
    /// out.
    ///
    /// A tree that will be refitted is best built [`BvhQuality::Fast`], without cut triangles.
    pub fn build(mesh: &TriangleMesh, quality: BvhQuality) -> Self {
        Self::build_with_budget(mesh, quality, split_budget(quality))
    }

    /// The same with a share of references that may be added by cutting large triangles.
    fn build_with_budget(mesh: &TriangleMesh, quality: BvhQuality, budget: f32) -> Self {
        let mut references = presplit::references(mesh, budget);
        let search = if quality == BvhQuality::Fast { Search::Coarse } else { Search::Fine };
        let mut nodes = binary::build_by(&mut references, search);
        if quality == BvhQuality::Best {
            reinsert::optimize(&mut references, &mut nodes);
        }
        collapse::collapse(&|triangle| corners(mesh, triangle), references, &nodes)
    }

    /// Follows moved corners: `mesh` has the triangles of the build at new places. The tree keeps its
    /// shape, so that rays become slower the farther its triangles moved apart.
    pub fn refit(&mut self, mesh: &TriangleMesh) {
        self.blocks.par_iter_mut().for_each(|block| {
            for lane in 0..BLOCK {
                let triangle = block.triangles[lane];
                if triangle != Block::UNUSED {
                    block.set(lane, triangle, corners(mesh, triangle));
                }
            }
        });
        // Children come after their parent.
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                let child = self.nodes[index].children[slot];
                if child == Child::NOTHING {
                    continue;
                }
                let bounds = if child.is_leaf() {
                    self.leaf_bounds(child)
                } else {
                    self.nodes[child.index()].bounds()
                };
                self.nodes[index].set_box(slot, &bounds);
            }
        }
        self.reach = self.bounds().reach();
    }

    fn leaf_bounds(&self, leaf: Child) -> Aabb {
        let triangles = self.blocks[leaf.blocks()]
            .iter()
            .flat_map(|block| block.used().map(|lane| block.get(lane)));
        triangles.filter_map(binary::bounds_of).fold(Aabb::EMPTY, Aabb::union)
    }

    /// The box around everything; empty for an empty tree.
    pub fn bounds(&self) -> Aabb {
        if self.root.is_leaf() {
            self.leaf_bounds(self.root)
        } else {
            self.nodes[self.root.index()].bounds()
        }
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>() + self.blocks.capacity() * size_of::<Block>()
    }

    /// Bytes that the tree of so many triangles will hold, estimated before it is built.
    ///
    /// 61 bytes per reference were measured on hills and in rooms of a million triangles; it holds
    /// within a fifth for meshes of thousands of triangles and more.
    pub fn forecast(triangles: usize, quality: BvhQuality) -> usize {
        (triangles as f64 * 61.0 * (1.0 + f64::from(split_budget(quality)))) as usize
    }

    /// The nearest hit with `0 < t < t_max`; among equal ones that of the lowest triangle.
    #[inline]
    pub fn closest_hit(&self, ray: &LocalRay, t_max: f64) -> Option<TriangleHit> {
        self.closest_hit_by(Instructions::detect(), ray, t_max)
    }

    /// Whether any triangle is hit with `0 < t < t_max`.
    #[inline]
    pub fn any_hit(&self, ray: &LocalRay, t_max: f64) -> bool {
        self.any_hit_by(Instructions::detect(), ray, t_max)
    }

    #[inline]
    fn closest_hit_by(
        &self,
        instructions: Instructions,
        ray: &LocalRay,
        t_max: f64,
    ) -> Option<TriangleHit> {
        instructions.closest_hit(self, self.stack, ray, t_max)
    }

    #[inline]
    fn any_hit_by(&self, instructions: Instructions, ray: &LocalRay, t_max: f64) -> bool {
        instructions.any_hit(self, self.stack, ray, t_max)
    }
}

impl Nodes for WideTree {
    #[inline(always)]
    fn root(&self) -> Child {
        self.root
    }

    #[inline(always)]
    fn reach(&self) -> f32 {
        self.reach
    }

    #[inline(always)]
    fn node<'a>(&'a self, index: usize, _: &'a mut Node) -> &'a Node {
        &self.nodes[index]
    }

    #[inline(always)]
    fn hit<L: Lanes>(
        &self,
        block: usize,
        ray: &L::Triangles,
        t_max: f64,
        hits: &mut BlockHits,
    ) -> u32 {
        L::hit(ray, &self.blocks[block], t_max, hits)
    }

    #[inline(always)]
    fn triangle(&self, block: usize, lane: usize) -> u32 {
        self.blocks[block].triangles[lane]
    }

    #[inline(always)]
    fn triangle_bounds(&self, block: usize, lane: usize) -> Aabb {
        Aabb::from_points(self.blocks[block].get(lane))
    }

    #[inline(always)]
    fn place(&self, child: Child) -> (*const i8, usize) {
        if child.is_leaf() {
            (self.blocks.as_ptr().wrapping_add(child.blocks().start).cast(), 3)
        } else {
            (self.nodes.as_ptr().wrapping_add(child.index()).cast(), 4)
        }
    }
}

/// The corners of a triangle of a mesh.
fn corners(mesh: &TriangleMesh, triangle: u32) -> [Vec3; 3] {
    mesh.triangles[triangle as usize].map(|k| mesh.positions[k as usize])
}
