//! Metals: smooth ones are coloured mirrors, rough ones GGX microfacets with the light of further
//! bounces given back.

use super::energy::AlbedoAt;
use super::fresnel::ConductorFresnel;
use super::ggx::{Ggx, reflect};
use super::{BsdfSample, BsdfValue, fresh, stretched};
use crate::description::Rgb;
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A polished metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothConductor {
    pub(crate) fresnel: ConductorFresnel,
}

impl SmoothConductor {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> BsdfSample {
        BsdfSample::mirrored(wo, self.fresnel.reflectance(wo.z.min(1.0)))
    }

    pub(super) fn albedo(&self, mu: f32) -> Rgb {
        self.fresnel.reflectance(mu)
    }
}

/// GGX reflection with reflectance 1 as its albedo table knows it: what the single bounce loses, and
/// the diffuse lobe which returns it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReflectorLobe<'t> {
    pub(super) albedo: AlbedoAt<'t, 2>,
}

impl<'t> ReflectorLobe<'t> {
    pub fn new(albedo: AlbedoAt<'t, 2>) -> Self {
        Self { albedo }
    }

    #[inline]
    pub fn ggx(&self) -> Ggx {
        Ggx { alpha: self.albedo.alpha() }
    }

    /// `1 − E(μ)`, lost by the single bounce at reflectance 1.
    #[inline]
    pub fn lost(&self, mu: f32) -> f32 {
        self.albedo.value(mu)[0]
    }

    /// `(1 − E_o)(1 − E_i) μ_i / (π (1 − Ē))`: the returned light at reflectance 1, given `1 − E_o`.
    #[inline]
    pub fn returned_f_cos(&self, lost_o: f32, mu_i: f32) -> f32 {
        let average = self.albedo.average()[0];
        if average > 0.0 { lost_o * self.lost(mu_i) * mu_i * FRAC_1_PI / average } else { 0.0 }
    }

    /// Share of the light lost by the first bounce which comes back in the end, for facets of mean
    /// reflectance `F̄`: `F̄² Ē / (1 − F̄ (1 − Ē))`, each further bounce reflecting `F̄` (Kulla and
    /// Conty 2017, slide "Colored energy loss").
    pub fn returned_share(&self, average: Rgb) -> Rgb {
        let lost = self.albedo.average()[0];
        average * average * (1.0 - lost) / (Rgb::ONE - average * lost)
    }
}

/// A metal with GGX roughness.
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor<'t> {
    fresnel: ConductorFresnel,
    lobe: ReflectorLobe<'t>,
    /// Colour of the light which bounces more than once.
    returned: Rgb,
}

impl<'t> RoughConductor<'t> {
    /// `average` is the cosine-weighted mean of `fresnel`.
    pub(crate) fn new(fresnel: ConductorFresnel, average: Rgb, lobe: ReflectorLobe<'t>) -> Self {
        Self { fresnel, lobe, returned: lobe.returned_share(average) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let ggx = self.lobe.ggx();
        let m = ggx.sample_visible(wo, u);
        let reflected = reflect(wo, m);
        // What does not get out is what returns later: the one happens as often as the other is worth.
        let out = ggx.gets_out(wo, reflected);
        let (wi, m) = if u_lobe < out {
            (reflected, m)
        } else {
            let u = Vec2::new(stretched(u_lobe, out, 1.0), fresh(u));
            let wi = self.lobe.albedo.sample_returned(u);
            (wi, (wo + wi).normalize_or_zero())
        };
        if wi.z <= 0.0 {
            return None;
        }
        BsdfSample::evaluated(wi, self.evaluate_at(wo, wi, m), false, 1.0)
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        self.evaluate_at(wo, wi, (wo + wi).normalize_or_zero())
    }

    /// The same where the half vector is known.
    #[inline]
    fn evaluate_at(&self, wo: Vec3, wi: Vec3, m: Vec3) -> BsdfValue {
        let ggx = self.lobe.ggx();
        let single = ggx.d(m) * ggx.v_cos(wo.z, wi.z);
        let lost = self.lobe.lost(wo.z);
        let reflectance = self.fresnel.reflectance(wo.dot(m).clamp(0.0, 1.0));
        BsdfValue {
            f_cos: reflectance * single + self.returned * self.lobe.returned_f_cos(lost, wi.z),
            pdf: single + lost * self.lobe.albedo.returned_pdf(wi.z),
        }
    }

    pub(super) fn albedo(&self, mu: f32) -> Rgb {
        let [lost, b] = self.lobe.albedo.value(mu);
        // Exact for Schlick's term; that of a complex index is close to it.
        let f0 = self.fresnel.reflectance(1.0);
        f0 * (1.0 - lost - b) + Rgb::splat(b) + self.returned * lost
    }
}
