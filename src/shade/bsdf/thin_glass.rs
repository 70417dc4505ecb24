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

    /// The probability with which [`Self::sample`] reflects.
    pub(super) fn reflection_probability(&self, wo: Vec3) -> f32 {
        let (reflectance, transmittance) = self.shares(wo.z.abs(), wo.x * wo.x + wo.y * wo.y);
        let (r, t) = (mean(reflectance), mean(transmittance));
        r / (r + t)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn shares_at(degrees: f32, tint: f32) -> (f32, f32) {
        let mu = degrees.to_radians().cos();
        let (r, t) = ThinGlass { eta: 1.5, tint: Rgb::splat(tint) }.shares(mu, 1.0 - mu * mu);
        (r.x, t.x)
    }

    /// Oracle: the clear slab of index 1.5, all orders: T(0°) = (1 − F)/(1 + F), R(60°) = 2F/(1 + F).
    #[test]
    fn a_clear_pane_sums_all_orders() {
        let (r, t) = shares_at(0.0, 1.0);
        assert!((t - 0.923_076_9).abs() < 1e-6 && (r + t - 1.0).abs() < 1e-6, "{r} {t}");
        let (r, t) = shares_at(60.0, 1.0);
        assert!((r - 0.163_767_5).abs() < 1e-5 && (r + t - 1.0).abs() < 1e-6, "{r} {t}");
    }

    /// Oracle: the absorbing slab with an optical depth of ½ along the normal.
    #[test]
    fn a_tinted_pane_absorbs_on_every_crossing() {
        let (r, t) = shares_at(0.0, (-0.5_f32).exp());
        assert!((t - 0.559_307_9).abs() < 1e-6 && (r - 0.053_569_5).abs() < 1e-6, "{r} {t}");
    }

    /// Oracle: tracing the rays between the two interfaces of the pane one by one.
    #[test]
    fn the_series_matches_a_walk_through_the_pane() {
        for degrees in [0.0, 30.0, 60.0, 80.0, 89.0_f64] {
            let (mu, tint) = (degrees.to_radians().cos(), 0.7_f64);
            let mu_t = (1.0 - (1.0 - mu * mu) / 2.25).sqrt();
            let f = f64::from(fresnel::dielectric_reflectance(mu as f32, 1.5));
            let tau = tint.powf(1.0 / mu_t);
            let (mut r, mut t, mut inside) = (f, 0.0, 1.0 - f);
            for crossing in 0..1000 {
                inside *= tau;
                *(if crossing % 2 == 0 { &mut t } else { &mut r }) += inside * (1.0 - f);
                inside *= f;
            }
            let (r32, t32) = shares_at(degrees as f32, tint as f32);
            assert!((f64::from(r32) - r).abs() < 1e-4, "{degrees}°: {r32} {r}");
            assert!((f64::from(t32) - t).abs() < 1e-4, "{degrees}°: {t32} {t}");
        }
    }

    /// At grazing incidence everything is reflected, whatever the tint; index 1 is no pane at all.
    #[test]
    fn the_limits_are_finite() {
        for tint in [0.0, 0.5, 1.0] {
            let pane = ThinGlass { eta: 1.5, tint: Rgb::splat(tint) };
            assert_eq!(pane.shares(0.0, 1.0), (Rgb::ONE, Rgb::ZERO));
            let air = ThinGlass { eta: 1.0, tint: Rgb::ONE };
            assert_eq!(air.shares(0.3, 0.91), (Rgb::ZERO, Rgb::ONE));
        }
    }
}
