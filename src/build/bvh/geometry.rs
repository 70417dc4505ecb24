//! What rays meet: the objects of a frame and their trees.

use super::movers::Movers;
use super::top::{Joined, Leaf};
use super::{MeshTree, TopLevel};
use crate::extract::{Geometry, Instance};
use crate::math::{MotionTransform, Ray};
use crate::shape::LocalRay;
use glam::{DAffine3, DVec2, DVec3};
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

/// The nearest hit so far.
#[derive(Default)]
struct Nearest(Option<Hit>);

impl Nearest {
    #[inline]
    fn offer(&mut self, hit: Option<Hit>) {
        if let Some(hit) = hit
            && self.0.is_none_or(|best| hit.precedes(&best))
        {
            self.0 = Some(hit);
        }
    }

    /// A hit of a sphere, or infinity.
    #[inline]
    fn offer_sphere(&mut self, t: f64, instance: u32) {
        if t < f64::INFINITY {
            self.offer(Some(Hit { t, instance, primitive: 0, weights: DVec2::ZERO }));
        }
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
        if self.top.moves {
            self.closest_hit_by::<true>(ray, t_max, from_camera)
        } else {
            self.closest_hit_by::<false>(ray, t_max, from_camera)
        }
    }

    /// [`SceneGeometry::closest_hit`] where something may move, or nothing does.
    fn closest_hit_by<const MOTION: bool>(
        &self,
        ray: &Ray,
        t_max: f64,
        from_camera: bool,
    ) -> Option<Hit> {
        let (whole, mut nearest) = (whole(ray), Nearest::default());
        let mut visit = |name: u32, t_max: f64| {
            // Equal distances are let through, so that the tie is decided by `precedes`.
            let end = t_max.next_up();
            match (Leaf::of(name), &self.top.joined) {
                (Leaf::Spheres(block), _) => {
                    let block = &self.top.spheres[block];
                    let t = block.hits(&whole, end);
                    for (t, instance) in t.into_iter().zip(block.instances) {
                        nearest.offer_sphere(t, instance);
                    }
                }
                (Leaf::Resting, Some(joined)) => nearest.offer(hit_joined(joined, ray, end)),
                (Leaf::Resting, None) => {}
                (Leaf::Moving, _) => {
                    if let Some(movers) = self.top.movers.as_ref().filter(|_| MOTION) {
                        movers.at(ray.time).traverse(&whole, t_max, |index, t_max| {
                            self.meet::<MOTION>(index, ray, t_max, from_camera, &mut nearest)
                        });
                    }
                }
                (Leaf::One(index), _) => {
                    self.meet::<MOTION>(index, ray, t_max, from_camera, &mut nearest);
                }
            }
            nearest.0.map_or(t_max, |best| best.t)
        };
        // Strictly before the end of the ray.
        let mut limit = t_max.next_down();
        for &index in &self.top.always {
            limit = visit(index, limit);
        }
        self.top.tree.traverse(&whole, limit, visit);
        nearest.0
    }

    /// Lowers `nearest` to the hit of an instance up to `t_max`, and returns the new end.
    #[inline]
    fn meet<const MOTION: bool>(
        &self,
        index: u32,
        ray: &Ray,
        t_max: f64,
        from_camera: bool,
        nearest: &mut Nearest,
    ) -> f64 {
        let instance = &self.instances[index as usize];
        if !(from_camera && instance.hidden_from_camera) {
            nearest.offer(self.hit_instance::<MOTION>(index, instance, ray, t_max.next_up()));
        }
        nearest.0.map_or(t_max, |best| best.t)
    }

    /// Whether anything lies at `0 < t < t_max`.
    pub fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        if self.top.moves {
            self.occluded_by::<true>(ray, t_max)
        } else {
            self.occluded_by::<false>(ray, t_max)
        }
    }

    /// [`SceneGeometry::occluded`] where something may move, or nothing does.
    fn occluded_by<const MOTION: bool>(&self, ray: &Ray, t_max: f64) -> bool {
        let (whole, mut blocked) = (whole(ray), false);
        let mut visit = |name: u32, t_max: f64| {
            blocked = match (Leaf::of(name), &self.top.joined) {
                (Leaf::Spheres(block), _) => {
                    let t = self.top.spheres[block].hits(&whole, t_max);
                    t.iter().any(|t| *t < f64::INFINITY)
                }
                (Leaf::Resting, Some(joined)) => {
                    joined.tree.any_hit(&shifted(ray, joined), ray.time, t_max)
                }
                (Leaf::Resting, None) => false,
                (Leaf::Moving, _) => self
                    .top
                    .movers
                    .as_ref()
                    .filter(|_| MOTION)
                    .is_some_and(|movers| self.blocked_by_movers(movers, &whole, ray, t_max)),
                (Leaf::One(index), _) => {
                    self.blocks::<MOTION>(&self.instances[index as usize], ray, t_max)
                }
            };
            if blocked { 0.0 } else { t_max }
        };
        for &index in &self.top.always {
            if visit(index, t_max) <= 0.0 {
                return true;
            }
        }
        self.top.tree.traverse(&whole, t_max, visit);
        blocked
    }

    /// Whether anything that moves far lies at `0 < t < t_max`.
    fn blocked_by_movers(&self, movers: &Movers, whole: &LocalRay, ray: &Ray, t_max: f64) -> bool {
        let mut blocked = false;
        movers.at(ray.time).traverse(whole, t_max, |index, t_max| {
            blocked = self.blocks::<true>(&self.instances[index as usize], ray, t_max);
            if blocked { 0.0 } else { t_max }
        });
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
        let Some(tree) = tree else {
            return self.hit_instance::<true>(index, instance, ray, t_max);
        };
        let hit = tree.closest_hit(&to_instance::<true>(instance, ray), ray.time, t_max)?;
        let (primitive, weights) = (hit.triangle, hit.weights);
        Some(Hit { t: hit.t, instance: index, primitive, weights })
    }

    /// The nearest hit of one instance with `0 < t < t_max`.
    #[inline]
    fn hit_instance<const MOTION: bool>(
        &self,
        index: u32,
        instance: &Instance,
        ray: &Ray,
        t_max: f64,
    ) -> Option<Hit> {
        let local = to_instance::<MOTION>(instance, ray);
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
    fn blocks<const MOTION: bool>(&self, instance: &Instance, ray: &Ray, t_max: f64) -> bool {
        let local = to_instance::<MOTION>(instance, ray);
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

/// The ray in the space of an instance; its parameter counts as before. Without `MOTION` only what is at
/// rest has a place, and nothing else is there.
#[inline]
fn to_instance<const MOTION: bool>(instance: &Instance, ray: &Ray) -> LocalRay {
    match &instance.motion {
        MotionTransform::Static { inverse, .. } => local_ray(inverse, ray),
        moving if MOTION => local_ray(&moving.inverse_at(ray.time), ray),
        _ => {
            debug_assert!(false, "the top level knows whether anything moves");
            LocalRay { o: DVec3::NAN, d: DVec3::NAN }
        }
    }
}

#[inline]
fn local_ray(shape_from_render: &DAffine3, ray: &Ray) -> LocalRay {
    LocalRay {
        o: shape_from_render.transform_point3(ray.o.as_dvec3()),
        d: shape_from_render.transform_vector3(ray.d.as_dvec3()),
    }
}
