//! Two levels: a tree per mesh in the mesh's own space, and a tree over the instances of a frame.

use super::{Bvh, WideTree};
use crate::description::{BvhQuality, TriangleMesh};
use crate::extract::{Geometry, Instance, Instances, Meshes};
use crate::math::{Aabb, MotionTransform, Ray};
use crate::shape::LocalRay;
use crate::world::Settings;
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Most instances in a leaf of the top level: a test of one costs a change of space.
const INSTANCES_PER_LEAF: usize = 1;

/// A mesh with its tree.
#[derive(Clone, Debug)]
pub struct MeshTree {
    /// The triangles.
    pub mesh: Arc<TriangleMesh>,
    tree: WideTree,
    quality: BvhQuality,
}

impl MeshTree {
    /// Builds the tree of a mesh.
    pub fn build(mesh: Arc<TriangleMesh>, quality: BvhQuality) -> Self {
        let tree = WideTree::build(&mesh, quality);
        Self { mesh, tree, quality }
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

/// Builds the trees of new meshes and drops those of removed ones; builds all anew for another quality.
pub fn rebuild_mesh_trees(
    meshes: Res<Meshes>,
    settings: Res<Settings>,
    mut trees: ResMut<MeshTrees>,
) {
    let quality = settings.0.bvh;
    if !meshes.is_changed() && trees.list.iter().all(|tree| tree.quality == quality) {
        if trees.built != 0 {
            trees.bypass_change_detection().built = 0;
        }
        return;
    }
    let old = std::mem::take(&mut trees.list);
    let kept = |mesh: &Arc<TriangleMesh>| {
        old.iter().find(|tree| tree.quality == quality && Arc::ptr_eq(&tree.mesh, mesh))
    };
    trees.built = meshes.list.iter().filter(|mesh| kept(mesh).is_none()).count();
    trees.list = meshes
        .list
        .par_iter()
        .map(|mesh| {
            kept(mesh).cloned().unwrap_or_else(|| Arc::new(MeshTree::build(mesh.clone(), quality)))
        })
        .collect();
}

/// The tree over the instances of a frame. Planes have no bounds and are kept beside it.
#[derive(Resource, Clone, Debug, Default)]
pub struct TopLevel {
    tree: Bvh,
    unbounded: Vec<u32>,
    /// Whether it was built anew in this frame.
    pub built: bool,
}

impl TopLevel {
    /// Builds the tree over `instances`.
    pub fn build(instances: &[Instance]) -> Self {
        let boxes: Vec<Aabb> = instances
            .iter()
            .map(|i| if i.bounds.min.is_finite() { i.bounds } else { Aabb::EMPTY })
            .collect();
        let unbounded =
            (0..).zip(instances).filter(|(_, i)| !i.bounds.min.is_finite()).map(|(k, _)| k);
        Self {
            tree: Bvh::build(&boxes, INSTANCES_PER_LEAF),
            unbounded: unbounded.collect(),
            built: true,
        }
    }

    /// The box around all instances which have bounds.
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }
}

/// Builds the top level anew when an instance changed.
pub fn rebuild_top_level(instances: Res<Instances>, mut top: ResMut<TopLevel>) {
    if instances.is_changed() {
        *top = TopLevel::build(&instances.list);
    } else if top.built {
        top.bypass_change_detection().built = false;
    }
}

/// Where a ray meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// Index of the instance.
    pub instance: u32,
    /// Triangle of a mesh, or face of an analytic shape.
    pub primitive: u32,
    /// Weights of a triangle's second and third corner.
    pub weights: DVec2,
}

impl Hit {
    /// Whether this hit comes before `other`; the order of coincident surfaces is that of the scene,
    /// whatever the direction of the ray.
    fn precedes(&self, other: &Self) -> bool {
        (self.t, self.instance, self.primitive) < (other.t, other.instance, other.primitive)
    }
}

/// Everything that a ray can meet.
#[derive(Clone, Copy, Debug)]
pub struct SceneGeometry<'a> {
    /// The objects.
    pub instances: &'a [Instance],
    /// The trees of the meshes.
    pub meshes: &'a [Arc<MeshTree>],
    /// The tree over the objects.
    pub top: &'a TopLevel,
}

impl SceneGeometry<'_> {
    /// The nearest hit with `0 < t < t_max`. A camera ray passes through what is hidden from the
    /// camera.
    pub fn closest_hit(&self, ray: &Ray, t_max: f64, from_camera: bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut visit = |index: u32, t_max: f64| {
            let instance = &self.instances[index as usize];
            if from_camera && instance.hidden_from_camera {
                return t_max;
            }
            // Equal distances are let through, so that the tie is decided by `precedes`.
            if let Some(hit) = self.hit_instance(index, instance, ray, t_max.next_up())
                && best.is_none_or(|best| hit.precedes(&best))
            {
                best = Some(hit);
            }
            best.map_or(t_max, |best| best.t)
        };
        // Strictly before the end of the ray.
        let mut limit = t_max.next_down();
        for &index in &self.top.unbounded {
            limit = visit(index, limit);
        }
        self.top.tree.traverse(&whole(ray), limit, visit);
        best
    }

    /// Whether anything lies at `0 < t < t_max`.
    pub fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        let mut blocked = false;
        let mut visit = |index: u32, t_max: f64| {
            blocked = self.blocks(&self.instances[index as usize], ray, t_max);
            if blocked { 0.0 } else { t_max }
        };
        for &index in &self.top.unbounded {
            if visit(index, t_max) <= 0.0 {
                return true;
            }
        }
        self.top.tree.traverse(&whole(ray), t_max, visit);
        blocked
    }

    /// The nearest hit of one instance with `0 < t < t_max`.
    #[inline]
    fn hit_instance(&self, index: u32, instance: &Instance, ray: &Ray, t_max: f64) -> Option<Hit> {
        let local = to_instance(instance, ray);
        match instance.geometry {
            Geometry::Primitive(primitive) => primitive.intersect(&local, t_max).map(|hit| Hit {
                t: hit.t,
                instance: index,
                primitive: hit.face,
                weights: DVec2::ZERO,
            }),
            Geometry::Mesh(mesh) => {
                self.meshes[mesh as usize].tree.closest_hit(&local, t_max).map(|hit| Hit {
                    t: hit.t,
                    instance: index,
                    primitive: hit.triangle,
                    weights: hit.weights,
                })
            }
        }
    }

    /// Whether one instance is hit with `0 < t < t_max`.
    #[inline]
    fn blocks(&self, instance: &Instance, ray: &Ray, t_max: f64) -> bool {
        let local = to_instance(instance, ray);
        match instance.geometry {
            Geometry::Primitive(primitive) => primitive.intersect(&local, t_max).is_some(),
            Geometry::Mesh(mesh) => self.meshes[mesh as usize].tree.any_hit(&local, t_max),
        }
    }
}

/// The ray in render space in `f64`.
fn whole(ray: &Ray) -> LocalRay {
    LocalRay { o: ray.o.as_dvec3(), d: ray.d.as_dvec3() }
}

/// The ray in the space of an instance; its parameter counts as before.
#[inline]
fn to_instance(instance: &Instance, ray: &Ray) -> LocalRay {
    match &instance.motion {
        MotionTransform::Static { inverse, .. } => local_ray(inverse, ray),
        moving @ MotionTransform::Moving { .. } => local_ray(&moving.inverse_at(ray.time), ray),
    }
}

#[inline]
fn local_ray(shape_from_render: &DAffine3, ray: &Ray) -> LocalRay {
    LocalRay {
        o: shape_from_render.transform_point3(ray.o.as_dvec3()),
        d: shape_from_render.transform_vector3(ray.d.as_dvec3()),
    }
}
