//! What rays meet: the objects of a frame and their trees.

use super::top::{Joined, RESTING};
use super::{MeshTree, TopLevel};
use crate::extract::{Geometry, Instance};
use crate::math::{MotionTransform, Ray};
use crate::shape::LocalRay;
use glam::{DAffine3, DVec2};
use std::sync::Arc;

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
            // Equal distances are let through, so that the tie is decided by `precedes`.
            let end = t_max.next_up();
            let hit = if let (RESTING, Some(joined)) = (index, &self.top.joined) {
                hit_joined(joined, ray, end)
            } else {
                let instance = &self.instances[index as usize];
                if from_camera && instance.hidden_from_camera {
                    return t_max;
                }
                self.hit_instance(index, instance, ray, end)
            };
            if let Some(hit) = hit
                && best.is_none_or(|best| hit.precedes(&best))
            {
                best = Some(hit);
            }
            best.map_or(t_max, |best| best.t)
        };
        // Strictly before the end of the ray.
        let mut limit = t_max.next_down();
        for &index in &self.top.always {
            limit = visit(index, limit);
        }
        self.top.tree.traverse(&whole(ray), limit, visit);
        best
    }

    /// Whether anything lies at `0 < t < t_max`.
    pub fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        let mut blocked = false;
        let mut visit = |index: u32, t_max: f64| {
            blocked = if let (RESTING, Some(joined)) = (index, &self.top.joined) {
                joined.tree.any_hit(&shifted(ray, joined), ray.time, t_max)
            } else {
                self.blocks(&self.instances[index as usize], ray, t_max)
            };
            if blocked { 0.0 } else { t_max }
        };
        for &index in &self.top.always {
            if visit(index, t_max) <= 0.0 {
                return true;
            }
        }
        self.top.tree.traverse(&whole(ray), t_max, visit);
        blocked
    }

    /// The nearest hit of one instance with `0 < t < t_max`, whatever else is there. For a mesh which
    /// is in the tree of resting meshes `tree` is one of its own.
    pub(crate) fn hit_of(
        &self,
        index: u32,
        tree: Option<&MeshTree>,
        ray: &Ray,
        t_max: f64,
    ) -> Option<Hit> {
        let instance = &self.instances[index as usize];
        let Some(tree) = tree else { return self.hit_instance(index, instance, ray, t_max) };
        let hit = tree.closest_hit(&to_instance(instance, ray), ray.time, t_max)?;
        let (primitive, weights) = (hit.triangle, hit.weights);
        Some(Hit { t: hit.t, instance: index, primitive, weights })
    }

    /// The nearest hit of one instance with `0 < t < t_max`.
    #[inline]
    fn hit_instance(&self, index: u32, instance: &Instance, ray: &Ray, t_max: f64) -> Option<Hit> {
        let local = to_instance(instance, ray);
        match &instance.geometry {
            Geometry::Primitive(primitive) => primitive.intersect(&local, t_max).map(|hit| Hit {
                t: hit.t,
                instance: index,
                primitive: hit.face,
                weights: DVec2::ZERO,
            }),
            Geometry::Mesh(mesh) => {
                let hit = self.meshes[*mesh as usize].closest_hit(&local, ray.time, t_max)?;
                let (primitive, weights) = (hit.triangle, hit.weights);
                Some(Hit { t: hit.t, instance: index, primitive, weights })
            }
        }
    }

    /// Whether one instance is hit with `0 < t < t_max`.
    #[inline]
    fn blocks(&self, instance: &Instance, ray: &Ray, t_max: f64) -> bool {
        let local = to_instance(instance, ray);
        match &instance.geometry {
            Geometry::Primitive(primitive) => primitive.intersect(&local, t_max).is_some(),
            Geometry::Mesh(mesh) => self.meshes[*mesh as usize].any_hit(&local, ray.time, t_max),
        }
    }
}

/// The nearest hit of the resting meshes with `0 < t < t_max`.
#[inline]
fn hit_joined(joined: &Joined, ray: &Ray, t_max: f64) -> Option<Hit> {
    let hit = joined.tree.closest_hit(&shifted(ray, joined), ray.time, t_max)?;
    let (instance, primitive) = joined.members.owner(hit.triangle);
    Some(Hit { t: hit.t, instance, primitive, weights: hit.weights })
}

/// The ray in the space of the resting meshes.
#[inline]
fn shifted(ray: &Ray, joined: &Joined) -> LocalRay {
    LocalRay { o: ray.o.as_dvec3() - joined.shift, d: ray.d.as_dvec3() }
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
        moving => local_ray(&moving.inverse_at(ray.time), ray),
    }
}

#[inline]
fn local_ray(shape_from_render: &DAffine3, ray: &Ray) -> LocalRay {
    LocalRay {
        o: shape_from_render.transform_point3(ray.o.as_dvec3()),
        d: shape_from_render.transform_vector3(ray.d.as_dvec3()),
    }
}
