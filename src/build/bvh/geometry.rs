//! Two levels: a tree per mesh in the mesh's own space, and a tree over the instances of a frame.

use super::Bvh;
use crate::description::TriangleMesh;
use crate::extract::{Geometry, Instance, Instances, Meshes};
use crate::math::{Aabb, MotionTransform, Ray};
use crate::shape::{LocalRay, TriangleTest};
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Most triangles in a leaf of a mesh's tree.
const TRIANGLES_PER_LEAF: usize = 4;
/// Most instances in a leaf of the top level: a test of one costs a change of space.
const INSTANCES_PER_LEAF: usize = 1;

/// A mesh with its tree.
#[derive(Clone, Debug)]
pub struct MeshTree {
    /// The triangles.
    pub mesh: Arc<TriangleMesh>,
    tree: Bvh,
}

impl MeshTree {
    /// Builds the tree of a mesh.
    pub fn build(mesh: Arc<TriangleMesh>) -> Self {
        let boxes: Vec<Aabb> = mesh
            .triangles
            .iter()
            .map(|corners| Aabb::from_points(corners.map(|k| mesh.positions[k as usize])))
            .collect();
        let tree = Bvh::build(&boxes, TRIANGLES_PER_LEAF);
        Self { mesh, tree }
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|k| self.mesh.positions[k as usize])
    }

    /// Offers the hits of the ray before `t_max` to `accept(t, triangle, weights)`, which returns the
    /// new `t_max`.
    #[inline]
    fn intersect(
        &self,
        ray: &LocalRay,
        t_max: f64,
        mut accept: impl FnMut(f64, u32, DVec2) -> f64,
    ) {
        let test = TriangleTest::new(ray);
        self.tree.traverse(ray, t_max, |triangle, t_max| {
            match test.intersect(self.corners(triangle), t_max) {
                Some((t, weights)) => accept(t, triangle, weights),
                None => t_max,
            }
        });
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

/// Builds the trees of new meshes and drops those of removed ones.
pub fn rebuild_mesh_trees(meshes: Res<Meshes>, mut trees: ResMut<MeshTrees>) {
    if !meshes.is_changed() {
        if trees.built != 0 {
            trees.bypass_change_detection().built = 0;
        }
        return;
    }
    let old = std::mem::take(&mut trees.list);
    let kept = |mesh: &Arc<TriangleMesh>| old.iter().find(|tree| Arc::ptr_eq(&tree.mesh, mesh));
    trees.built = meshes.list.iter().filter(|mesh| kept(mesh).is_none()).count();
    trees.list = meshes
        .list
        .par_iter()
        .map(|mesh| kept(mesh).cloned().unwrap_or_else(|| Arc::new(MeshTree::build(mesh.clone()))))
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
            self.intersect(index, instance, ray, t_max.next_up(), |hit| {
                if hit.t <= t_max && best.is_none_or(|best| hit.precedes(&best)) {
                    best = Some(hit);
                }
                best.map_or(t_max, |best| best.t.min(t_max))
            });
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
            self.intersect(index, &self.instances[index as usize], ray, t_max, |_| {
                blocked = true;
                0.0
            });
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

    /// Offers the hits of one instance to `accept`, which returns the new end of the ray.
    #[inline]
    fn intersect(
        &self,
        index: u32,
        instance: &Instance,
        ray: &Ray,
        t_max: f64,
        mut accept: impl FnMut(Hit) -> f64,
    ) {
        let local = match &instance.motion {
            MotionTransform::Static { inverse, .. } => local_ray(inverse, ray),
            moving @ MotionTransform::Moving { .. } => local_ray(&moving.inverse_at(ray.time), ray),
        };
        match instance.geometry {
            Geometry::Primitive(primitive) => {
                if let Some(hit) = primitive.intersect(&local, t_max) {
                    accept(Hit {
                        t: hit.t,
                        instance: index,
                        primitive: hit.face,
                        weights: DVec2::ZERO,
                    });
                }
            }
            Geometry::Mesh(mesh) => {
                self.meshes[mesh as usize].intersect(&local, t_max, |t, triangle, weights| {
                    // One more than the end, so that a second triangle at the same distance is seen.
                    accept(Hit { t, instance: index, primitive: triangle, weights }).next_up()
                });
            }
        }
    }
}

/// The ray in render space in `f64`.
fn whole(ray: &Ray) -> LocalRay {
    LocalRay { o: ray.o.as_dvec3(), d: ray.d.as_dvec3() }
}

/// The ray in the space of an instance; its parameter counts as before.
#[inline]
fn local_ray(shape_from_render: &DAffine3, ray: &Ray) -> LocalRay {
    LocalRay {
        o: shape_from_render.transform_point3(ray.o.as_dvec3()),
        d: shape_from_render.transform_vector3(ray.d.as_dvec3()),
    }
}
