//! A pane so thin that light is not displaced: both interfaces, and all reflections between them.
//!
//! With the reflectance `F` of one interface and the transmittance `τ` of one crossing,
//!
//! ```text
//! T = (1 − F)² τ / (1 − F²τ²),      R = F (1 + τ T)
//! ```
//!
//! are the geometric series over all internal orders (Stokes 1862, "On the Intensity of the Light
//! Reflected from or Transmitted through a Pile of Plates"). The light is unpolarised at each interface.

use super::fresnel;
use super::{BsdfSample, mean};
use crate::description::Rgb;
use glam::Vec3;

/// A pane in the plane of the surface; both sides are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinGlass {
    /// Index of the glass over that of its surroundings.
    pub eta: f32,
    /// Transmittance of one crossing at normal incidence, per channel, in `[0, 1]`.
    pub tint: Rgb,
}

impl ThinGlass {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32) -> Option<BsdfSample> {
        let (reflectance, transmittance) = self.shares(wo.z, wo.x * wo.x + wo.y * wo.y);
        let (r, t) = (mean(reflectance), mean(transmittance));
        let p = r / (r + t);
        if u_lobe < p {
            Some(BsdfSample::mirrored(wo, reflectance / p))
        } else if t > 0.0 {
            Some(BsdfSample::straight(wo, transmittance / (1.0 - p)))
        } else {
            None
        }
    }

    pub(super) fn albedo(&self, mu: f32) -> Rgb {
        let (r, t) = self.shares(mu, ((1.0 - mu) * (1.0 + mu)).max(0.0));
        r + t
    }

    /// Reflectance and transmittance of the pane.
    fn shares(&self, mu: f32, sin2: f32) -> (Rgb, Rgb) {
        let interface = fresnel::dielectric(mu, sin2, self.eta);
        let f = interface.reflectance;
        // The way through the glass is longer by 1/μ_t.
        let crossing = if self.tint == Rgb::ONE || interface.mu_t == 0.0 {
            self.tint
        } else {
            self.tint.powf(1.0 / interface.mu_t)
        };
        let transmittance = crossing.map(|tau| {
            // (1 − F)²/(1 − F²τ²) with one factor taken out, whose limit at F = τ = 1 is no longer 0/0.
            let rest = 1.0 - f * tau;
            if rest > 0.0 { (1.0 - f) * ((1.0 - f) / rest) * tau / (1.0 + f * tau) } else { 0.0 }
        });
        (f * (Rgb::ONE + crossing * transmittance), transmittance)
    }
}
