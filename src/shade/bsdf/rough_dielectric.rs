//! Frosted glass: a dielectric interface with GGX roughness.
//!
//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", EGSR; Pharr, Jakob,
//! Humphreys 2023, *Physically Based Rendering*, 4th ed., section 9.7. With `η` the index on the
//! side of `t` over that on the side of `o`, the normal of the facet which refracts `o` into `t` is
//! `m ∝ ±(o + η t)`, and
//!
//! ```text
//! f_t μ_t = (1 − F) D G₂ |o·m| |t·m| η² / (μ_o (o·m + η t·m)²)      (share of the power)
//! ```
//!
//! which radiance divides by `η²` ([`TransportMode`]). One bounce loses `1 − E(μ)`, on either side its
//! own table. It returns in four diffuse lobes of the form of Kulla and Conty 2017,
//!
//! ```text
//! f_r = r (1 − E_o)(1 − E_i) / (π ℓ),          ℓ, ℓ' mean losses on the side of o and on the other
//! f_t = t (1 − E_o)(1 − E'_t) / (π ℓ'),        r + t = 1 on each side,   t' = t ℓ / (η² ℓ')
//! ```
//!
//! where the last relation is reciprocity. It leaves `t` free: the share which a smooth interface
//! would transmit of diffuse light is taken, lowered where `t'` would exceed 1.

use super::energy::AlbedoAt;
use super::fresnel::{dielectric, dielectric_reflectance};
use super::ggx::{Ggx, SMOOTH_BELOW_ALPHA, reflect, refract};
use super::{BsdfSample, BsdfValue, TransportMode, fresh, stretched};
use crate::description::Rgb;
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A rough interface; light enters and leaves by the sign of `wo.z`.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric<'t> {
    /// Index inside (z < 0) over the index outside.
    eta: f32,
    /// Share of the refracted light that each crossing lets through.
    tint: Rgb,
    /// Losses of a single bounce: from outside, from inside.
    lost: AlbedoAt<'t, 2>,
    /// Mean losses: from outside, from inside.
    mean_lost: [f32; 2],
    /// Share of the returned light which is transmitted: from outside, from inside.
    returned_transmission: [f32; 2],
}

impl<'t> RoughDielectric<'t> {
    /// The transmitted lobe is about `|η − 1| α` wide. Below the width at which reflected lobes end, a half vector of
    /// `o + η t`, which carries the same rounding error, no longer resolves it, and the interface is taken as smooth.
    pub(crate) fn resolves(eta: f32, alpha: f32) -> bool {
        (eta - 1.0).abs() * alpha >= SMOOTH_BELOW_ALPHA
    }

    /// Index inside over the index outside.
    #[inline]
    pub(super) fn eta(&self) -> f32 {
        self.eta
    }

    #[inline]
    pub(super) fn tint(&self) -> Rgb {
        self.tint
    }

    /// * `eta` — index inside over outside.
    /// * `lost` — the table of single-bounce losses made for `eta`, at the width wanted.
    /// * `average` — mean reflectance of the smooth interface from outside.
    pub(crate) fn new(eta: f32, lost: AlbedoAt<'t, 2>, average: f32) -> Self {
        let mean_lost = lost.average();
        let ratio = eta * eta * mean_lost[1] / mean_lost[0]; // t / t'
        let outside = (1.0 - average).min(ratio);
        let inside = outside / ratio;
        let returned_transmission =
            if mean_lost.iter().all(|&l| l > 0.0) { [outside, inside] } else { [0.0; 2] };
        Self { eta, tint: Rgb::ONE, lost, mean_lost, returned_transmission }
    }

    /// The same interface with a tint, per channel in `[0, 1]`.
    pub(crate) fn tinted(self, tint: Rgb) -> Self {
        Self { tint, ..self }
    }

    /// The same interface at another index of refraction, near that of its table.
    pub(crate) fn with_index(self, eta: f32) -> Self {
        Self { eta, ..self }
    }

    /// The side of `wo` (0 outside, 1 inside) and the relative index met from there.
    #[inline]
    fn side(&self, wo: Vec3) -> (usize, f32) {
        if wo.z > 0.0 { (0, self.eta) } else { (1, 1.0 / self.eta) }
    }

    #[inline]
    pub(super) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: Vec2,
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let behind = wo.z < 0.0;
        let (side, eta) = self.side(wo);
        let wo = wo.with_z(wo.z.abs());
        let ggx = Ggx { alpha: self.lost.alpha() };
        let m = ggx.sample_visible(wo, u);
        let cos = wo.dot(m);
        // Facets drawn are seen from the front but for rounding at the far corner of the square.
        if cos <= 0.0 {
            return None;
        }
        let f = dielectric(cos, wo.cross(m).length_squared(), eta).reflectance;
        // What does not get out is what returns later: the one happens as often as the other is worth.
        let (wi, out, from, to) = if u_lobe < f {
            let wi = reflect(wo, m);
            (wi, ggx.gets_out(wo, wi), 0.0, f)
        } else {
            let wi = refract(wo, m, eta).normalize();
            (wi, ggx.gets_out(wo, wi.with_z(-wi.z)), f, 1.0)
        };
        let end = from + (to - from) * out;
        let (wi, m) = if u_lobe < end {
            (wi, Some(m))
        } else {
            (self.sample_returned(stretched(u_lobe, end, to), fresh(u), side), None)
        };
        if wi.z == 0.0 {
            return None;
        }
        let transmitted = wi.z < 0.0;
        let value = self.evaluate_above((wo, wi, m), side, eta, mode);
        let eta = if transmitted { eta } else { 1.0 };
        BsdfSample::evaluated(wi, value, transmitted, eta).map(|sample| sample.turned(behind))
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> BsdfValue {
        if wo.z == 0.0 || wi.z == 0.0 {
            return BsdfValue::ZERO;
        }
        let (side, eta) = self.side(wo);
        if wo.z > 0.0 {
            self.evaluate_above((wo, wi, None), side, eta, mode)
        } else {
            self.evaluate_above((wo.with_z(-wo.z), wi.with_z(-wi.z), None), side, eta, mode)
        }
    }

    /// A direction of the light of further bounces, on either side.
    fn sample_returned(&self, u: f32, azimuth: f32, side: usize) -> Vec3 {
        let t = self.returned_transmission[side];
        if u < t {
            let wi = self.lost.sample_returned(Vec2::new(stretched(u, 0.0, t), azimuth));
            wi.with_z(-wi.z)
        } else {
            self.lost.sample_returned(Vec2::new(stretched(u, t, 1.0), azimuth))
        }
    }

    /// Evaluates for `wo.z > 0`, on whichever side that is; `m` is the facet, where it is known.
    fn evaluate_above(
        &self,
        (wo, wi, m): (Vec3, Vec3, Option<Vec3>),
        side: usize,
        eta: f32,
        mode: TransportMode,
    ) -> BsdfValue {
        let lost = self.lost.value(wo.z)[side];
        let t = self.returned_transmission[side];
        let (f_cos, pdf) = if wi.z > 0.0 {
            let once = self.reflected_once(wo, wi, m, eta);
            let returned = (1.0 - t) * self.returned(lost, wi.z, side);
            let returned_pdf = (1.0 - t) * self.lost.returned_pdf(wi.z);
            (Rgb::splat(once + returned), once + lost * returned_pdf)
        } else {
            let once = self.transmitted_once(wo, wi, m, eta);
            let returned = t * self.returned(lost, -wi.z, 1 - side);
            let value = (once + returned) * mode.transmission_factor(eta);
            (self.tint * value, once + lost * t * self.lost.returned_pdf(-wi.z))
        };
        BsdfValue { f_cos, pdf }
    }

    /// `(1 − E_o)(1 − E_i) μ_i / (π ℓ_i)` for `wi` on the side `side`.
    #[inline]
    fn returned(&self, lost: f32, mu_i: f32, side: usize) -> f32 {
        if self.mean_lost[side] > 0.0 {
            lost * self.lost.value(mu_i)[side] * mu_i * FRAC_1_PI / self.mean_lost[side]
        } else {
            0.0
        }
    }

    /// `f μ_i` of a single reflection, which is also the density with which it is drawn.
    #[inline]
    fn reflected_once(&self, wo: Vec3, wi: Vec3, m: Option<Vec3>, eta: f32) -> f32 {
        let ggx = Ggx { alpha: self.lost.alpha() };
        let m = m.unwrap_or_else(|| (wo + wi).normalize_or_zero());
        let f = dielectric_reflectance(wo.dot(m).clamp(0.0, 1.0), eta);
        f * ggx.d(m) * ggx.v_cos(wo.z, wi.z)
    }

    /// `f μ_i` (share of the power) of a single refraction, which is also its density.
    #[inline]
    fn transmitted_once(&self, wo: Vec3, wi: Vec3, m: Option<Vec3>, eta: f32) -> f32 {
        let ggx = Ggx { alpha: self.lost.alpha() };
        let m = m.unwrap_or_else(|| {
            let m = (wo + eta * wi).normalize_or_zero();
            if m.z < 0.0 { -m } else { m }
        });
        let (cos_o, cos_t) = (wo.dot(m), wi.dot(m));
        // A facet seen from its back refracts nothing (or m is 0: no facet refracts so).
        if cos_o <= 0.0 || cos_t >= 0.0 {
            return 0.0;
        }
        let transmitted = 1.0 - dielectric_reflectance(cos_o.min(1.0), eta);
        let scale = cos_o + eta * cos_t;
        let jacobian = eta * eta * -cos_t / (scale * scale);
        transmitted * ggx.d(m) * 4.0 * ggx.v_cos(wo.z, -wi.z) * cos_o * jacobian
    }
}
