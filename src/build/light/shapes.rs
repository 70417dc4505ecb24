//! Emitting shapes at rest, with all that drawing points of them takes computed once.

use super::towards::{is_perpendicular, is_similarity};
use super::{Emitter, LightTable, Receiver};
use crate::build::bvh::SurfacePoint;
use crate::extract::{Geometry, Instance, Instances};
use crate::math::MotionTransform;
use crate::shape::{ConeOfSphere, Primitive, RectangleSampler, rounding_error, sample_rectangle};
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

/// A rectangle farther away than this many of its diagonals is drawn from by area, a nearer one by
/// solid angle. Measured on the Cornell box, 12 samples: by solid angle everywhere 2.6 CPU-seconds and a
/// relMSE of 1.039e-3, with this distance 2.3 and 1.054e-3, by area everywhere 2.3 and 1.077e-3. Near the
/// lamp area alone would be far worse: `cos θ/d²` is not bounded there.
const FAR: f64 = 2.0;

/// An emitting analytic shape.
#[derive(Clone, Debug)]
pub(super) enum ShapeLight {
    /// At rest, with perpendicular edges.
    Rectangle(Box<RectangleLight>),
    /// At rest, and round.
    Sphere(SphereLight),
    /// Any other.
    Other,
}

impl ShapeLight {
    fn new(instance: &Instance) -> Self {
        let (Geometry::Primitive(primitive), MotionTransform::Static { forward, inverse }) =
            (&instance.geometry, &instance.motion)
        else {
            return Self::Other;
        };
        let m = &forward.matrix3;
        match primitive {
            Primitive::Rectangle
                if is_perpendicular(m.x_axis, m.y_axis) && !instance.needs.place =>
            {
                Self::Rectangle(Box::new(RectangleLight::new(forward, inverse)))
            }
            Primitive::Sphere if is_similarity(forward) && !instance.needs_uv => {
                // Of a point on it, and of the way back of the ray which ends there.
                let (centre, radius) = (forward.translation, m.x_axis.length());
                let back = rounding_error(inverse, centre.abs() + radius);
                let p_error =
                    rounding_error(forward, DVec3::ONE) + 2.0 * radius * back.max_element();
                Self::Sphere(SphereLight { centre, radius, p_error })
            }
            _ => Self::Other,
        }
    }
}

/// A sphere in render space.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphereLight {
    pub(super) centre: DVec3,
    pub(super) radius: f64,
    /// Bound of the error of its points, per axis.
    pub(super) p_error: DVec3,
}

impl SphereLight {
    /// The cone under which it is seen; `None` from inside.
    ///
    /// A point of the sphere itself may lie outside it by its rounding. Its cone would hold the side next to it
    /// alone, and none of what it sees across the inside.
    #[inline]
    pub(super) fn cone(&self, from: &Receiver) -> Option<ConeOfSphere> {
        ConeOfSphere::new(from.p, self.centre, self.radius, from.p_error.length())
    }
}

/// A rectangle in render space.
#[derive(Clone, Debug)]
pub(super) struct RectangleLight {
    centre: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    area: f64,
    far_squared: f64,
    /// Unit normal.
    pub(super) n: Vec3,
    /// Bound of the error of its points, per axis.
    pub(super) p_error: DVec3,
}

/// A point of a rectangle: where it is, its shares of the edges, its density per unit solid angle.
pub(super) struct RectanglePoint {
    pub(super) p: DVec3,
    pub(super) uv: Vec2,
    pub(super) pdf: f64,
}

impl RectangleLight {
    fn new(forward: &DAffine3, inverse: &DAffine3) -> Self {
        let edges = [forward.matrix3.x_axis, forward.matrix3.y_axis];
        let normal = (inverse.matrix3.transpose() * DVec3::Z).normalize();
        // Rounding grows with the coordinates: its bound at the farthest corner holds everywhere.
        let corners = [-0.5, 0.5].map(|x| [-0.5, 0.5].map(|y| DVec3::new(x, y, 0.0)));
        let p_error = corners
            .iter()
            .flatten()
            .map(|&corner| {
                let local = Primitive::Rectangle.surface(corner, 0, false);
                SurfacePoint::new(&local, forward, inverse).p_error
            })
            .fold(DVec3::ZERO, DVec3::max);
        Self {
            centre: forward.translation,
            edges,
            normal,
            area: edges[0].cross(edges[1]).length(),
            far_squared: FAR * FAR * (edges[0].length_squared() + edges[1].length_squared()),
            n: normal.as_vec3(),
            p_error,
        }
    }

    /// Whether a point is on the side to which the rectangle faces.
    #[inline]
    pub(super) fn faces(&self, p: DVec3) -> bool {
        (p - self.centre).dot(self.normal) > 0.0
    }

    /// The sampler by solid angle where that is used.
    #[inline]
    fn near(&self, p: DVec3) -> Option<RectangleSampler> {
        if (p - self.centre).length_squared() >= self.far_squared {
            return None;
        }
        let corner = self.centre - (self.edges[0] + self.edges[1]) * 0.5;
        RectangleSampler::new(p, corner, self.edges[0], self.edges[1])
    }

    /// The density of [`RectangleLight::sample`] at `q`, by area: `d²/(A·cos θ)`.
    #[inline]
    fn pdf_far(&self, p: DVec3, q: DVec3) -> f64 {
        let to = q - p;
        let distance_squared = to.length_squared();
        let projected = to.dot(self.normal).abs() * self.area;
        if projected > 0.0 { distance_squared * distance_squared.sqrt() / projected } else { 0.0 }
    }

    /// Density per unit solid angle at `p` with which `q` is drawn.
    #[inline]
    pub(super) fn pdf(&self, p: DVec3, q: DVec3) -> f64 {
        self.near(p).map_or_else(|| self.pdf_far(p, q), |sampler| sampler.pdf())
    }

    /// Draws a point as seen from `p`.
    #[inline]
    pub(super) fn sample(&self, p: DVec3, u: Vec2) -> RectanglePoint {
        let at = |share: DVec2| {
            let from_centre = share - DVec2::splat(0.5);
            self.centre + self.edges[0] * from_centre.x + self.edges[1] * from_centre.y
        };
        if let Some(sampler) = self.near(p) {
            let (_, share) = sample_rectangle(&sampler, u);
            return RectanglePoint { p: at(share), uv: share.as_vec2(), pdf: sampler.pdf() };
        }
        let q = at(u.as_dvec2());
        RectanglePoint { p: q, uv: u, pdf: self.pdf_far(p, q) }
    }
}

/// The emitting shapes of a frame, by instance.
#[derive(Resource, Clone, Debug, Default)]
pub struct ShapeLights(Vec<ShapeLight>);

impl ShapeLights {
    /// The light of an instance.
    #[inline]
    pub(super) fn of(&self, instance: u32) -> &ShapeLight {
        self.0.get(instance as usize).unwrap_or(&ShapeLight::Other)
    }
}

/// Prepares the emitting shapes when the lights changed.
pub fn prepare_shape_lights(
    table: Res<LightTable>,
    instances: Res<Instances>,
    mut shapes: ResMut<ShapeLights>,
) {
    if !(table.is_changed() || instances.is_changed()) {
        return;
    }
    let mut list = std::mem::take(&mut shapes.0);
    list.clear();
    for emitter in &table.emitters {
        if let Emitter::Shape(instance) = *emitter {
            let index = instance as usize;
            list.resize(list.len().max(index + 1), ShapeLight::Other);
            list[index] = ShapeLight::new(&instances.list[index]);
        }
    }
    shapes.0 = list;
}
