//! A point on a path: where a surface was met, how it scatters, and which side is which.
//!
//! Which side of a surface a direction leaves by is decided by the geometric normal. The shading
//! normal shapes the BSDF; a direction which ends up on the wrong side is thrown back: [`ShadedBsdf`]. Where
//! rays leave a mesh from the round surface that its smooth normals mean, their normal takes the place of
//! the geometric one.

use crate::build::bvh::{RayOrigin, SurfacePoint};
use crate::build::light::Receiver;
use crate::description::Rgb;
use crate::math::Frame;
use crate::shade::{Bsdf, BsdfSample, InnerReflections, ShadedBsdf, TransportMode};
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
    /// Where rays leave it.
    pub(super) ray_origin: RayOrigin,
    pub(super) frame: Frame,
    pub(super) wo: Vec3,
    pub(super) bsdf: Bsdf<'a>,
}

impl<'a> Vertex<'a> {
    pub(super) fn new(
        mut surface: SurfacePoint,
        mut ray_origin: RayOrigin,
        wo: Vec3,
        bsdf: Bsdf<'a>,
    ) -> Self {
        // Seen from beyond its horizon a shading normal cannot say what is reflected where.
        let is_beyond = |n: Vec3| wo.dot(n) * wo.dot(surface.ng) <= 0.0;
        if is_beyond(ray_origin.n) {
            ray_origin = RayOrigin::from(&surface);
        }
        if is_beyond(surface.ns) {
            surface.ns = ray_origin.n;
        }
        Self { surface, ray_origin, frame: surface.frame(), wo, bsdf }
    }

    pub(super) fn receiver(&self) -> Receiver {
        let (RayOrigin { p, p_error, n: ng }, ns) = (self.ray_origin, self.surface.ns);
        let facing = if self.wo.dot(ns) < 0.0 { -ns } else { ns };
        let horizon = (!self.bsdf.transmits()).then_some(facing);
        Receiver { p, p_error, ng, facing, horizon, draws_both: false }
    }

    /// How it scatters.
    #[inline]
    pub(super) fn shaded(&self) -> ShadedBsdf<'_, 'a> {
        let Self { ray_origin, frame, wo, bsdf, .. } = self;
        ShadedBsdf { bsdf, frame, ng: ray_origin.n, wo: *wo }
    }

    /// Whether `wi` leaves on the other side of the surface than the path arrived from.
    #[inline]
    pub(super) fn crosses(&self, wi: Vec3) -> bool {
        self.shaded().crosses(wi)
    }

    /// `f·|cos θ|` towards a light, and the density with which the BSDF draws that direction.
    #[inline]
    pub(super) fn evaluate(&self, wi: Vec3) -> (Rgb, f32) {
        let value = self.shaded().evaluate(wi, TransportMode::Radiance);
        (value.f_cos, value.pdf)
    }

    /// Draws where the path goes on, and counts where it stays inside.
    #[inline]
    pub(super) fn scatter(
        &self,
        lobe: f32,
        u: Vec2,
        inner: &mut InnerReflections,
    ) -> Option<(Vec3, BsdfSample)> {
        self.shaded().sample(lobe, u, TransportMode::Radiance, inner)
    }
}
