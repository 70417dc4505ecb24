//! A point on a path: where a surface was met, how it scatters, and which side is which.
//!
//! Which side of a surface a direction leaves by is decided by the geometric normal. The shading
//! normal shapes the BSDF; a specular direction which ends up on the wrong side is drawn again around
//! the geometric normal, any other is dropped.

use crate::build::bvh::SurfacePoint;
use crate::build::light::Receiver;
use crate::description::Rgb;
use crate::math::Frame;
use crate::shade::{Bsdf, BsdfSample, TransportMode};
use glam::{Vec2, Vec3};

/// What is on either side of a surface that a path has reached.
#[derive(Clone, Copy)]
pub(super) struct Sides<I> {
    /// On the side from which it came.
    pub(super) here: I,
    pub(super) beyond: I,
}

impl<I> Sides<I> {
    /// Where a path is that leaves in the direction `wi`.
    #[inline]
    pub(super) fn towards(&self, wi: Vec3, vertex: &Vertex) -> &I {
        if vertex.crosses(wi) { &self.beyond } else { &self.here }
    }
}

/// A point on a path.
#[derive(Clone)]
pub(super) struct Vertex<'a> {
    pub(super) surface: SurfacePoint,
    pub(super) frame: Frame,
    pub(super) wo: Vec3,
    pub(super) bsdf: Bsdf<'a>,
}

impl<'a> Vertex<'a> {
    pub(super) fn new(mut surface: SurfacePoint, wo: Vec3, bsdf: Bsdf<'a>) -> Self {
        // Seen from beyond its horizon a shading normal cannot say what is reflected where.
        if wo.dot(surface.ns) * wo.dot(surface.ng) <= 0.0 {
            surface.ns = surface.ng;
        }
        Self { surface, frame: surface.frame(), wo, bsdf }
    }

    pub(super) fn receiver(&self) -> Receiver {
        let SurfacePoint { p, p_error, ng, ns, .. } = self.surface;
        let facing = if self.wo.dot(ns) < 0.0 { -ns } else { ns };
        let horizon = (!self.bsdf.transmits()).then_some(facing);
        Receiver { p, p_error, ng, facing, horizon, draws_both: false }
    }

    /// Whether `wi` leaves by the side on which the BSDF placed it.
    pub(super) fn is_consistent(&self, wi: Vec3) -> bool {
        let ns = self.surface.ns;
        self.crosses(wi) == ((wi.dot(ns) > 0.0) != (self.wo.dot(ns) > 0.0))
    }

    /// Whether `wi` leaves on the other side of the surface than the path arrived from.
    pub(super) fn crosses(&self, wi: Vec3) -> bool {
        let ng = self.surface.ng;
        (wi.dot(ng) > 0.0) != (self.wo.dot(ng) > 0.0)
    }

    /// `f·|cos θ|` towards a light, and the density with which the BSDF draws that direction.
    pub(super) fn evaluate(&self, wi: Vec3) -> (Rgb, f32) {
        if !self.is_consistent(wi) {
            return (Rgb::ZERO, 0.0);
        }
        let local = |v: Vec3| match self.bsdf {
            // It looks at cosines alone, and is asked for the most connections.
            Bsdf::Diffuse(_) => Vec3::Z * v.dot(self.frame.z),
            _ => self.frame.to_local(v),
        };
        let value = self.bsdf.evaluate(local(self.wo), local(wi), TransportMode::Radiance);
        (value.f_cos, value.pdf)
    }

    /// Draws where the path goes on.
    pub(super) fn scatter(&self, lobe: f32, u: Vec2) -> Option<(Vec3, BsdfSample)> {
        let draw = |frame: &Frame| {
            let wo = frame.to_local(self.wo);
            let sample = self.bsdf.sample(wo, lobe, u, TransportMode::Radiance)?;
            Some((frame.from_local(sample.wi).normalize(), sample))
        };
        let (wi, sample) = draw(&self.frame)?;
        if self.crosses(wi) == sample.transmitted {
            return Some((wi, sample));
        }
        if !sample.delta {
            return None;
        }
        let (wi, sample) = draw(&Frame::from_z(self.surface.ng))?;
        (self.crosses(wi) == sample.transmitted).then_some((wi, sample))
    }
}
