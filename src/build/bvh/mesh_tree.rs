//! The trees of meshes, each in the mesh's own space.

use super::WideTree;
use super::resting::RestingTree;
use crate::description::{BvhQuality, TriangleMesh};
use crate::extract::{Geometry, Instances, Meshes};
use crate::world::Settings;
use bevy_ecs::prelude::*;
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// A mesh with its tree.
#[derive(Clone, Debug)]
pub struct MeshTree {
    /// The triangles.
    pub mesh: Arc<TriangleMesh>,
    /// `None` for a mesh which is in the tree of resting meshes only.
    tree: Option<WideTree>,
    quality: BvhQuality,
}

impl MeshTree {
    /// Builds the tree of a mesh.
    pub fn build(mesh: Arc<TriangleMesh>, quality: BvhQuality) -> Self {
        let tree = WideTree::build(&mesh, quality);
        Self { mesh, tree: Some(tree), quality }
    }

    /// A mesh which no ray looks for.
    fn without_tree(mesh: Arc<TriangleMesh>) -> Self {
        Self { mesh, tree: None, quality: BvhQuality::default() }
    }

    /// The tree.
    #[inline]
    pub(super) fn tree(&self) -> &WideTree {
        self.tree.as_ref().expect("a mesh outside the tree of resting meshes has a tree of its own")
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|k| self.mesh.positions[k as usize])
    }
}

/// The trees of all meshes, by the index of the mesh.
#[derive(Resource, Clone, Debug, Default)]
pub struct MeshTrees {
    /// The trees.
    pub list: Vec<Arc<MeshTree>>,
    /// How many were built in this frame.
    pub built: usize,
}

/// Builds the trees of new meshes and drops those of removed ones. A mesh whose only instance is in
/// the tree of resting meshes gets none. All are built anew for another quality.
pub fn rebuild_mesh_trees(
    meshes: Res<Meshes>,
    settings: Res<Settings>,
    instances: Res<Instances>,
    resting: Res<RestingTree>,
    mut trees: ResMut<MeshTrees>,
) {
    let quality = settings.0.bvh;
    let outdated = |tree: &Arc<MeshTree>| tree.tree.is_some() && tree.quality != quality;
    if !(meshes.is_changed() || resting.is_changed() || trees.list.iter().any(outdated)) {
        if trees.built != 0 {
            trees.bypass_change_detection().built = 0;
        }
        return;
    }
    let mut wanted = vec![true; meshes.list.len()];
    for (index, instance) in (0..).zip(&instances.list) {
        if let Geometry::Mesh(mesh) = instance.geometry
            && resting.first_triangle(index).is_some()
        {
            wanted[mesh as usize] = false;
        }
    }
    let old = std::mem::take(&mut trees.list);
    let kept = |mesh: &Arc<TriangleMesh>, wanted: bool| {
        old.iter().find(|tree| {
            Arc::ptr_eq(&tree.mesh, mesh) && tree.tree.is_some() == wanted && !outdated(tree)
        })
    };
    let pairs = || meshes.list.iter().zip(wanted.iter().copied());
    trees.built = pairs().filter(|(mesh, wanted)| *wanted && kept(mesh, true).is_none()).count();
    trees.list = meshes
        .list
        .par_iter()
        .zip(&wanted)
        .map(|(mesh, &wanted)| match kept(mesh, wanted) {
            Some(tree) => tree.clone(),
            None if wanted => Arc::new(MeshTree::build(mesh.clone(), quality)),
            None => Arc::new(MeshTree::without_tree(mesh.clone())),
        })
        .collect();
}
