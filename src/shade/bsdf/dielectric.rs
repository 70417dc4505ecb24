//! The smooth interface of clear glass or water: reflects by Fresnel, refracts by Snell.

use super::fresnel;
use super::{BsdfSample, TransportMode};
use crate::description::Rgb;
use glam::Vec3;

/// A smooth interface; light enters and leaves by the sign of `wo.z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothDielectric {
    /// Index inside (z < 0) over the index outside.
    pub eta: f32,
    /// Share of the refracted light that each crossing lets through, per channel, in `[0, 1]`.
    pub tint: Rgb,
}

impl SmoothDielectric {
    /// Clear.
    pub fn new(eta: f32) -> Self {
        Self { eta, tint: Rgb::ONE }
    }

    /// Share of the light from `wo` that is reflected.
    #[inline]
    #[expect(clippy::float_cmp, reason = "1 exactly means that there is no interface")]
    pub(super) fn reflectance(self, wo: Vec3) -> f32 {
        if self.eta == 1.0 {
            return 0.0;
        }
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        fresnel::dielectric(wo.z.abs(), wo.x * wo.x + wo.y * wo.y, eta).reflectance
    }

    #[inline]
    #[expect(clippy::float_cmp, reason = "1 exactly means that there is no interface")]
    pub(super) fn sample(self, wo: Vec3, u_lobe: f32, mode: TransportMode) -> Option<BsdfSample> {
        let mu = wo.z.abs();
        if mu == 0.0 {
            return None;
        }
        if self.eta == 1.0 {
            return Some(BsdfSample::straight(wo, self.tint));
        }
        // The relative index as the ray meets it, from its side to the other.
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let interface = fresnel::dielectric(mu, wo.x * wo.x + wo.y * wo.y, eta);
        if u_lobe < interface.reflectance {
            return Some(BsdfSample::mirrored(wo, Rgb::ONE));
        }
        let wi = Vec3::new(-wo.x / eta, -wo.y / eta, -interface.mu_t.copysign(wo.z));
        let weight = self.tint * mode.transmission_factor(eta);
        Some(BsdfSample { wi, weight, pdf: 0.0, delta: true, transmitted: true, eta })
    }
}
