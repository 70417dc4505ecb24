//! The trees of meshes, each in the mesh's own space.

use super::resting::RestingTree;
use super::wide::segment_of;
use super::{MovingTree, Tangents, TriangleHit, WideTree};
use crate::description::{BvhQuality, TriangleMesh};
use crate::extract::{Geometry, Instances, Meshes};
use crate::math::Aabb;
use crate::shape::LocalRay;
use crate::world::{Settings, Vertices};
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// A mesh with its tree.
#[derive(Clone, Debug)]
pub struct MeshTree {
    /// The triangles; of a mesh which deforms as they are when the shutter opens.
    pub mesh: Arc<TriangleMesh>,
    /// Its vertices at the later keys of the shutter; none for a mesh which keeps its form.
    later: Arc<Vec<Vertices>>,
    /// What normal maps on it are made for, where there is one.
    pub(super) tangents: Option<Arc<Tangents>>,
    tree: Tree,
    quality: BvhQuality,
}

/// How rays find the triangles of a mesh.
#[derive(Clone, Debug)]
enum Tree {
    /// They do not look for it: it is in the tree of resting meshes only.
    Elsewhere,
    /// It keeps its form.
    Rigid(WideTree),
    /// It deforms while the shutter is open.
    Moving(MovingTree),
}

impl MeshTree {
    /// Builds the tree of a mesh.
    pub fn build(mesh: Arc<TriangleMesh>, quality: BvhQuality) -> Self {
        let tree = Tree::Rigid(WideTree::build(&mesh, quality));
        Self { mesh, later: Arc::default(), tangents: None, tree, quality }
    }

    /// Builds the tree of a mesh which has these vertices later in the shutter, at evenly spaced times.
    pub fn deforming(
        mesh: Arc<TriangleMesh>,
        later: Arc<Vec<Vertices>>,
        quality: BvhQuality,
    ) -> Self {
        if later.is_empty() {
            return Self::build(mesh, quality);
        }
        let later_positions = later.iter().map(|key| key.positions.as_slice());
        let keys: Vec<&[Vec3]> =
            std::iter::once(mesh.positions.as_slice()).chain(later_positions).collect();
        let tree = Tree::Moving(MovingTree::build(&mesh.triangles, &keys));
        Self { mesh, later, tangents: None, tree, quality }
    }

    /// A mesh which no ray looks for.
    fn elsewhere(mesh: Arc<TriangleMesh>) -> Self {
        let quality = BvhQuality::default();
        Self { mesh, later: Arc::default(), tangents: None, tree: Tree::Elsewhere, quality }
    }

    /// Whether no ray looks for it here.
    pub(crate) fn is_elsewhere(&self) -> bool {
        matches!(self.tree, Tree::Elsewhere)
    }

    /// Whether it has to be built anew for another quality.
    pub(crate) fn is_outdated(&self, quality: BvhQuality) -> bool {
        !self.is_elsewhere() && self.quality != quality
    }

    /// How its tree was built.
    pub(crate) fn quality(&self) -> BvhQuality {
        self.quality
    }

    /// Whether it deforms while the shutter is open.
    #[inline]
    pub fn deforms(&self) -> bool {
        !self.later.is_empty()
    }

    /// The nearest hit at `time` in the shutter with `0 < t < t_max`.
    #[inline]
    pub fn closest_hit(&self, ray: &LocalRay, time: f32, t_max: f64) -> Option<TriangleHit> {
        match &self.tree {
            Tree::Rigid(tree) => tree.closest_hit(ray, t_max),
            Tree::Moving(tree) => tree.closest_hit(ray, time, t_max),
            Tree::Elsewhere => None,
        }
    }

    /// Whether anything is hit at `time` in the shutter with `0 < t < t_max`.
    #[inline]
    pub fn any_hit(&self, ray: &LocalRay, time: f32, t_max: f64) -> bool {
        match &self.tree {
            Tree::Rigid(tree) => tree.any_hit(ray, t_max),
            Tree::Moving(tree) => tree.any_hit(ray, time, t_max),
            Tree::Elsewhere => false,
        }
    }

    /// The box around a mesh which keeps its form.
    pub(super) fn bounds(&self) -> Aabb {
        match &self.tree {
            Tree::Rigid(tree) => tree.bounds(),
            Tree::Moving(_) | Tree::Elsewhere => Aabb::EMPTY,
        }
    }

    /// Bytes of the tree and the tangents.
    pub fn memory(&self) -> usize {
        let tree = match &self.tree {
            Tree::Rigid(tree) => tree.memory(),
            Tree::Moving(tree) => tree.memory(),
            Tree::Elsewhere => 0,
        };
        tree + self.tangents.as_ref().map_or(0, |tangents| tangents.memory())
    }

    /// The corners of a triangle at `time` in the shutter.
    #[inline]
    pub fn corners(&self, triangle: u32, time: f32) -> [DVec3; 3] {
        let indices = self.mesh.triangles[triangle as usize];
        self.between(indices, time, &self.mesh.positions, |key| &key.positions)
    }

    /// The normals of the corners of a triangle; `None` where the mesh has none.
    #[inline]
    pub(super) fn normals(&self, triangle: u32, time: f32) -> Option<[DVec3; 3]> {
        if self.mesh.normals.is_empty() {
            return None;
        }
        let indices = self.mesh.triangles[triangle as usize];
        Some(self.between(indices, time, &self.mesh.normals, |key| &key.normals))
    }

    /// Vectors of three vertices at a time, interpolated as [`MovingTree`] does it.
    #[inline]
    fn between(
        &self,
        indices: [u32; 3],
        time: f32,
        first: &[Vec3],
        of: impl Fn(&Vertices) -> &Vec<Vec3>,
    ) -> [DVec3; 3] {
        if self.later.is_empty() {
            return indices.map(|k| first[k as usize].as_dvec3());
        }
        let (segment, share) = segment_of(time, self.later.len());
        let begin = if segment == 0 { first } else { of(&self.later[segment - 1]) };
        let end = of(&self.later[segment]);
        indices.map(|k| {
            let (a, b) = (begin[k as usize].as_dvec3(), end[k as usize].as_dvec3());
            a + f64::from(share) * (b - a)
        })
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
/// the tree of resting meshes gets none. All are built anew for another quality. Tangents are computed for meshes which a
/// normal map looks at.
pub fn rebuild_mesh_trees(
    meshes: Res<Meshes>,
    settings: Res<Settings>,
    instances: Res<Instances>,
    resting: Res<RestingTree>,
    mut trees: ResMut<MeshTrees>,
) {
    let quality = settings.0.bvh;
    let outdated = |tree: &Arc<MeshTree>| tree.is_outdated(quality);
    let mut mapped = vec![false; meshes.list.len()];
    if meshes.is_changed() || instances.is_changed() {
        for instance in instances.list.iter().filter(|instance| instance.needs.tangents) {
            if let Geometry::Mesh(mesh) = instance.geometry {
                mapped[mesh as usize] = true;
            }
        }
    } else {
        mapped.iter_mut().zip(&trees.list).for_each(|(m, tree)| *m = tree.tangents.is_some());
    }
    let remapped = trees.list.iter().zip(&mapped).any(|(tree, m)| tree.tangents.is_some() != *m);
    let rebuilt = meshes.is_changed() || resting.is_changed() || remapped;
    if !(rebuilt || trees.list.iter().any(outdated)) {
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
    let list: Vec<(Arc<MeshTree>, bool)> = (0..meshes.list.len())
        .into_par_iter()
        .map(|k| {
            let (mesh, later) = (&meshes.list[k], &meshes.later_keys[k]);
            let same = |tree: &&Arc<MeshTree>| {
                let keys = tree.later.is_empty() && later.is_empty();
                Arc::ptr_eq(&tree.mesh, mesh) && (keys || Arc::ptr_eq(&tree.later, later))
            };
            let fits = |tree: &&Arc<MeshTree>| {
                matches!(tree.tree, Tree::Elsewhere) != wanted[k] && !outdated(tree)
            };
            let (tree, built) = match old.iter().filter(same).find(fits) {
                Some(tree) => (tree.clone(), false),
                None if wanted[k] => {
                    let tree = MeshTree::deforming(mesh.clone(), later.clone(), quality);
                    (Arc::new(tree), true)
                }
                None => (Arc::new(MeshTree::elsewhere(mesh.clone())), false),
            };
            if tree.tangents.is_some() == mapped[k] {
                return (tree, built);
            }
            let known = || old.iter().filter(same).find_map(|tree| tree.tangents.clone());
            let tangents = || known().unwrap_or_else(|| Arc::new(Tangents::new(mesh, later)));
            let tangents = mapped[k].then(tangents);
            (Arc::new(MeshTree { tangents, ..Arc::unwrap_or_clone(tree) }), built)
        })
        .collect();
    trees.built = list.iter().filter(|(_, built)| *built).count();
    trees.list = list.into_iter().map(|(tree, _)| tree).collect();
}
