//! The unit sphere.

use super::{CanonicalPoint, LocalHit, LocalRay, LocalSurface, longitude, recentred};
use crate::math::{Chart, Frame};
use crate::sampling::warp::{uniform_cone, uniform_sphere};
use glam::{DVec3, Vec2};
use std::f64::consts::{PI, TAU};

/// Density of [`sample`] per unit area.
pub(super) const PDF_AREA: f64 = 1.0 / (4.0 * PI);

pub(super) fn intersect(ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
    let (near, shift) = recentred(ray);
    let discriminant = 1.0 - near.o.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let half_chord = (discriminant / ray.d.length_squared()).sqrt();
    let entry = shift - half_chord;
    let t = if entry > 0.0 { entry } else { shift + half_chord };
    (t > 0.0 && t < t_max).then_some(LocalHit { t, face: 0 })
}

pub(super) fn surface(p: DVec3, needs_uv: bool) -> LocalSurface {
    let p = p.normalize();
    let uv =
        if needs_uv { (longitude(p), 0.5 + p.y.clamp(-1.0, 1.0).asin() / PI) } else { (0.0, 0.0) };
    LocalSurface::smooth(p, p, uv, Chart::AROUND, DVec3::new(p.z, 0.0, -p.x))
}

pub(super) fn sample(u: Vec2) -> CanonicalPoint {
    CanonicalPoint { p: uniform_sphere(u).as_dvec3().normalize(), face: 0, pdf_area: PDF_AREA }
}

/// The cone under which a sphere is seen from a point outside.
#[derive(Clone, Copy, Debug)]
pub struct ConeOfSphere {
    to_centre: DVec3,
    distance: f64,
    radius: f64,
    one_minus_cos_max: f64,
}

impl ConeOfSphere {
    /// The cone of the sphere at `centre` from `p`, which is known to within `error`, metres; `None`
    /// from inside or on the sphere.
    ///
    /// A point counts as on the sphere up to a height of `f32::EPSILON` radii as well: directions to
    /// the sphere are `f32`, and from there cannot tell its rim from the horizon.
    pub fn new(p: DVec3, centre: DVec3, radius: f64, error: f64) -> Option<Self> {
        let to_centre = centre - p;
        let distance = to_centre.length();
        let sin_max = radius / distance;
        if distance.is_nan() || distance - error <= radius * (1.0 + f64::from(f32::EPSILON)) {
            return None;
        }
        // 1 − cos θ = sin²θ/(1 + cos θ) keeps its digits for a narrow cone.
        let one_minus_cos_max = sin_max * sin_max / (1.0 + (1.0 - sin_max * sin_max).sqrt());
        Some(Self { to_centre, distance, radius, one_minus_cos_max })
    }

    /// Density of [`sample_cone`] per unit solid angle.
    pub fn pdf(&self) -> f64 {
        1.0 / (TAU * self.one_minus_cos_max)
    }
}

/// Draws a point of the visible part of a sphere, evenly by solid angle; returns the unit direction
/// to it and the unit normal there.
///
/// Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., section 6.2.4.
pub fn sample_cone(cone: &ConeOfSphere, u: Vec2) -> (DVec3, DVec3) {
    let axis = cone.to_centre / cone.distance;
    let frame = Frame::from_z(axis.as_vec3());
    let local = uniform_cone(u, cone.one_minus_cos_max as f32);
    // The frame is f32; take the axis itself in f64 so that narrow cones keep their direction.
    let across = (frame.x * local.x + frame.y * local.y).as_dvec3();
    let sin2 = across.length_squared();
    let wi = (axis * (1.0 - sin2).max(0.0).sqrt() + across).normalize();
    // Distance to the sphere along wi, from the triangle of eye, centre and point.
    let cos = wi.dot(axis);
    let d = cone.distance;
    let sin2 = (wi - axis * cos).length_squared();
    let t = d * cos - (cone.radius * cone.radius - d * d * sin2).max(0.0).sqrt();
    let normal = (wi * t - cone.to_centre).normalize();
    (wi, normal)
}
