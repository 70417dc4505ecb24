//! Bounding volume hierarchies: one per mesh, kept over frames, and one per frame over instances.

mod geometry;
mod surface;
mod tree;

pub use geometry::{
    Hit, MeshTree, MeshTrees, SceneGeometry, TopLevel, rebuild_mesh_trees, rebuild_top_level,
};
pub use surface::SurfacePoint;
pub use tree::Bvh;
