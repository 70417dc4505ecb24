//! A surface which scatters a photon, as who looks at it sees it.
//!
//! Light goes the other way than paths from the camera do, over the same surfaces: of a direction `ω_i` from which a photon
//! comes and one `ω_o` into which it goes, the path would arrive from `ω_o`. With its `f` and its normal `n_o` the
//! photon's power changes by
//!
//! ```text
//! f(ω_o, ω_i)·|ω_i·n_o|·|ω_o·n_g| / (|ω_i·n_g|·p(ω_o))
//! ```
//!
//! (Veach 1997, section 5.3). A direction is drawn by the normal `n_i` as it is seen from where the photon comes. Mostly that is
//! `n_o`, and what was drawn already holds `f·|ω_o·n|/p`; it is not where either is seen from beyond the horizon of the
//! shading normal, or a relief is bent for the one who looks.

use crate::build::bvh::SurfacePoint;
use crate::description::Rgb;
use crate::math::Frame;
use crate::shade::{Bsdf, BsdfSample, InnerReflections, ShadedBsdf, TransportMode, bent_normal};
use glam::{Vec2, Vec3};

/// A surface which scatters a photon.
pub(super) struct Scattering<'a> {
    /// With the shading normal whoever looks.
    pub(super) surface: SurfacePoint,
    /// Whether the shading normal is that of a relief.
    relief: bool,
    /// The normal as it is seen from where the photon comes.
    ns: Vec3,
    wo: Vec3,
    bsdf: Bsdf<'a>,
}

impl<'a> Scattering<'a> {
    pub(super) fn new(surface: SurfacePoint, relief: bool, wo: Vec3, bsdf: Bsdf<'a>) -> Self {
        Self { surface, relief, ns: normal_from(&surface, relief, wo), wo, bsdf }
    }

    pub(super) fn crosses(&self, wi: Vec3) -> bool {
        let ng = self.surface.ng;
        (wi.dot(ng) > 0.0) != (self.wo.dot(ng) > 0.0)
    }

    /// Draws where the photon goes on, with the factor on its power.
    pub(super) fn draw(
        &self,
        lobe: f32,
        u: Vec2,
        inner: &mut InnerReflections,
    ) -> Option<(Vec3, BsdfSample, Rgb)> {
        let Self { surface, ns, wo, bsdf, .. } = self;
        let frame = Frame::from_z(*ns);
        let shaded = ShadedBsdf { bsdf, frame: &frame, ng: surface.ng, wo: *wo };
        let (wi, sample) = shaded.sample(lobe, u, TransportMode::Importance, inner)?;
        if inner.was_let_out() {
            return Some((wi, sample, sample.weight));
        }
        let seen_by = normal_from(surface, self.relief, wi);
        let weight = if sample.delta || seen_by == *ns {
            // What is thrown back counts as it was drawn: its height above the surface is the same.
            sample.weight * self.adjoint(frame.from_local(sample.wi))
        } else {
            self.seen(wi, seen_by) / sample.pdf
        };
        weight.is_finite().then_some((wi, sample, weight))
    }

    /// `f*/f`.
    fn adjoint(&self, wi: Vec3) -> f32 {
        let (ng, ns) = (self.surface.ng, self.ns);
        if ng == ns {
            return 1.0;
        }
        let ratio = (self.wo.dot(ns) * wi.dot(ng)) / (self.wo.dot(ng) * wi.dot(ns));
        if ratio.is_finite() { ratio.abs() } else { 0.0 }
    }

    /// `f*·|cos θ_o|` by the normal that is seen from `wi`.
    fn seen(&self, wi: Vec3, ns: Vec3) -> Rgb {
        let (bsdf, ng, frame) = (&self.bsdf, self.surface.ng, Frame::from_z(ns));
        let seen = ShadedBsdf { bsdf, frame: &frame, ng, wo: wi };
        let value = seen.evaluate(self.wo, TransportMode::Radiance);
        value.f_cos * (wi.dot(ng) / self.wo.dot(ng)).abs()
    }
}

/// The shading normal of a surface for who looks at it from `wo`.
fn normal_from(surface: &SurfacePoint, relief: bool, wo: Vec3) -> Vec3 {
    let ns = if relief { bent_normal(surface.ns, surface.ng, wo) } else { surface.ns };
    SurfacePoint { ns, ..*surface }.normal_seen_from(wo)
}
