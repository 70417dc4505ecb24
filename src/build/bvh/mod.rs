//! Bounding volume hierarchies: one per mesh, kept over frames, of eight-fold nodes ([`WideTree`]), and
//! one per frame over instances ([`Bvh`]).

mod geometry;
mod surface;
mod tree;
mod wide;

pub use geometry::{
    Hit, MeshTree, MeshTrees, SceneGeometry, TopLevel, rebuild_mesh_trees, rebuild_top_level,
};
pub use surface::SurfacePoint;
pub use tree::Bvh;
pub use wide::{MovingTree, TriangleHit, WideTree};
