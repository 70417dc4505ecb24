//! Bounding volume hierarchies, of eight-fold nodes.
//!
//! * A [`WideTree`] per mesh, in the mesh's own space, kept over frames.
//! * One more over all meshes which stand still and are used once ([`RestingTree`]).
//! * A tree over the objects of a frame ([`TopLevel`]), whose leaves lead to these and to analytic shapes.
//! * For what moves far within the shutter a tree for each part of it.
//!
//! `tree` holds the binary tree that the top level is made from.

mod geometry;
#[cfg(test)]
mod leaving;
mod mesh_tree;
mod movers;
mod resting;
mod spheres;
mod surface;
mod tangents;
mod terminator;
#[cfg(test)]
mod tests;
mod texture_point;
mod top;
mod tree;
mod wide;

pub use geometry::{Hit, SceneGeometry};
pub use mesh_tree::{MeshTree, MeshTrees, rebuild_mesh_trees};
pub use resting::{RestingTree, join_resting_meshes};
pub use surface::SurfacePoint;
pub use tangents::Tangents;
pub use terminator::RayOrigin;
pub use top::{TopLevel, rebuild_top_level};
pub(crate) use tree::Bvh;
pub use wide::{MovingTree, TriangleHit, WideTree};
