//! A diffuse base under a clear coat: plastic, varnish, glazed tiles.
//!
//! With `A(μ)` the share which the coat reflects, `Ā` its cosine-weighted mean, and light in the base
//! reflected back by the coat with `F̄_in = 1 − (1 − Ā)/η²`, the sum over all bounces between base and
//! coat is a diffuse lobe
//!
//! ```text
//! f_d = (1 − A(μ_o)) (1 − A(μ_i)) / (π (1 − Ā)) · ρ (1 − F̄_in) / (1 − ρ F̄_in).
//! ```
//!
//! For a smooth coat `A` is Fresnel's `F` and the expression is the usual
//! `(1 − F_o)(1 − F_i) ρ / (π η² (1 − ρ F̄_in))` (Pharr, Jakob, Humphreys 2023, section 14.3.1, give the
//! history). It is reciprocal, and a base with `ρ = 1` returns exactly what the coat lets in: coat
//! and base together reflect everything. A rough coat uses the tabulated albedo of its single bounce;
//! what that loses to further bounces is taken to reach the base, so that the sum stays 1 up to the
//! interpolation of the table (2·10⁻³).

use super::energy::AlbedoAt;
use super::fresnel::dielectric_reflectance;
use super::ggx::{Ggx, reflect};
use super::{BsdfSample, BsdfValue, fresh, mean, stretched};
use crate::description::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use glam::{Vec2, Vec2Swizzles, Vec3};
use std::f32::consts::FRAC_1_PI;

/// The diffuse base as it looks through a coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Base {
    /// `ρ (1 − F̄_in) / (1 − ρ F̄_in)`: share of the light let in which comes out again.
    albedo: Rgb,
    /// `1 / (1 − Ā)`.
    inverse_entering: f32,
}

impl Base {
    /// * `rho` — albedo of the base itself.
    /// * `eta` — index of the coat.
    /// * `average` — `Ā`, mean share which the coat reflects.
    pub fn new(rho: Rgb, eta: f32, average: f32) -> Self {
        let inside = 1.0 - (1.0 - average) / (eta * eta);
        let albedo = rho * (1.0 - inside) / (Rgb::ONE - rho * inside);
        Self { albedo, inverse_entering: 1.0 / (1.0 - average) }
    }

    /// `f_d μ_i` where the coat reflects `a_o` and `a_i`.
    #[inline]
    fn f_cos(&self, a_o: f32, a_i: f32, mu_i: f32) -> Rgb {
        self.albedo * ((1.0 - a_o) * (1.0 - a_i) * self.inverse_entering * mu_i * FRAC_1_PI)
    }

    /// Probability with which a facet decides between coat and base. That spares weights of `F/F̄` where it reflects more than
    /// others; but over a dark base it would send nearly all light down there.
    #[inline]
    fn by_facet(&self) -> f32 {
        mean(self.albedo)
    }

    /// Probability with which the coat is chosen rather than the base, where it reflects `a_o`.
    #[inline]
    fn coat_probability(&self, a_o: f32) -> f32 {
        let base = (1.0 - a_o) * mean(self.albedo);
        if a_o > 0.0 { a_o / (a_o + base) } else { 0.0 }
    }
}

/// A diffuse base under a smooth coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothPlastic {
    eta: f32,
    base: Base,
}

impl SmoothPlastic {
    /// `average` is [`dielectric_average`](super::dielectric_average) of `eta`.
    pub(crate) fn new(rho: Rgb, eta: f32, average: f32) -> Self {
        Self { eta, base: Base::new(rho, eta, average) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let f = dielectric_reflectance(wo.z.min(1.0), self.eta);
        let p = self.base.coat_probability(f);
        if u_lobe < p {
            return Some(BsdfSample::mirrored(wo, Rgb::splat(f / p)));
        }
        let wi = cosine_hemisphere(u);
        if wi.z <= 0.0 {
            return None;
        }
        BsdfSample::evaluated(wi, self.evaluate(wo, wi), false, 1.0)
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        let f_o = dielectric_reflectance(wo.z.min(1.0), self.eta);
        let f_i = dielectric_reflectance(wi.z.min(1.0), self.eta);
        let pdf = (1.0 - self.base.coat_probability(f_o)) * wi.z * FRAC_1_PI;
        BsdfValue { f_cos: self.base.f_cos(f_o, f_i, wi.z), pdf }
    }

    pub(super) fn albedo(&self, mu: f32) -> Rgb {
        let f = dielectric_reflectance(mu, self.eta);
        Rgb::splat(f) + self.base.albedo * (1.0 - f)
    }
}

/// A diffuse base under a coat with GGX roughness.
#[derive(Clone, Copy, Debug)]
pub struct RoughPlastic<'t> {
    eta: f32,
    coat: AlbedoAt<'t, 1>,
    base: Base,
}

impl<'t> RoughPlastic<'t> {
    /// `coat` is the albedo of the coat's single reflection, a table made for `eta`.
    pub(crate) fn new(rho: Rgb, eta: f32, coat: AlbedoAt<'t, 1>) -> Self {
        Self { eta, coat, base: Base::new(rho, eta, coat.average()[0]) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let ggx = Ggx { alpha: self.coat.alpha() };
        let by_facet = self.base.by_facet();
        if u_lobe < by_facet {
            // What the facet does not reflect, or what does not get out, reaches the base. The base has the
            // numbers which are spread more evenly: it is the brighter one here.
            let m = ggx.sample_visible(wo, Vec2::new(fresh(u), fresh(u.yx())));
            let wi = reflect(wo, m);
            let reflected = dielectric_reflectance(wo.dot(m).clamp(0.0, 1.0), self.eta);
            return if u_lobe < by_facet * reflected * ggx.gets_out(wo, wi) {
                BsdfSample::evaluated(wi, self.evaluate_at(wo, wi, m), false, 1.0)
            } else {
                self.sample_base(wo, u)
            };
        }
        let u_lobe = stretched(u_lobe, by_facet, 1.0);
        let p = self.base.coat_probability(self.coat.value(wo.z)[0]);
        if u_lobe >= p {
            return self.sample_base(wo, u);
        }
        let m = ggx.sample_visible(wo, u);
        let wi = reflect(wo, m);
        if wi.z <= 0.0 {
            return None;
        }
        BsdfSample::evaluated(wi, self.evaluate_at(wo, wi, m), false, 1.0)
    }

    #[inline]
    fn sample_base(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(u);
        (wi.z > 0.0).then(|| BsdfSample::evaluated(wi, self.evaluate(wo, wi), false, 1.0))?
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        self.evaluate_at(wo, wi, (wo + wi).normalize_or_zero())
    }

    /// The same where the half vector is known.
    #[inline]
    fn evaluate_at(&self, wo: Vec3, wi: Vec3, m: Vec3) -> BsdfValue {
        let ggx = Ggx { alpha: self.coat.alpha() };
        let fresnel = dielectric_reflectance(wo.dot(m).clamp(0.0, 1.0), self.eta);
        let specular = fresnel * ggx.d(m) * ggx.v_cos(wo.z, wi.z);
        let (a_o, a_i) = (self.coat.value(wo.z)[0], self.coat.value(wi.z)[0]);
        let p = self.base.coat_probability(a_o);
        let (by_facet, cosine) = (self.base.by_facet(), wi.z * FRAC_1_PI);
        BsdfValue {
            f_cos: Rgb::splat(specular) + self.base.f_cos(a_o, a_i, wi.z),
            pdf: by_facet * (specular + (1.0 - a_o) * cosine)
                + (1.0 - by_facet) * (p * ggx.reflection_pdf(wo, m) + (1.0 - p) * cosine),
        }
    }

    pub(super) fn albedo(&self, mu: f32) -> Rgb {
        let a = self.coat.value(mu)[0];
        Rgb::splat(a) + self.base.albedo * (1.0 - a)
    }
}
