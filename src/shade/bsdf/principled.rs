//! The metallic–roughness model of glTF 2.0.
//!
//! Khronos Group 2021, *glTF 2.0 Specification*, appendix B: a mixture, by `metallic`, of a metal
//! with `F₀ = base colour` and of a dielectric whose diffuse base has the base colour as its albedo;
//! both with one GGX lobe of width `α = roughness²` and Schlick's Fresnel term. Since Schlick's
//! term is linear in `F₀`, the two specular lobes are one with the mixed `F₀`.
//!
//! The specification's `1 − F(o·m)` on the base lets base and gloss together exceed 1 at grazing angles,
//! and leaves it to the implementation to do better. Here the base gets what the gloss leaves, by
//! albedos: with `A(μ)` that of the dielectric's gloss, its factor is
//! `(1 − A_o)(1 − A_i) / (1 − Ā)`. The metal's light of further bounces returns as in
//! [`conductor`](super::conductor). White then reflects exactly 1 at every roughness, up to the
//! interpolation of the table (2·10⁻³), and the model is reciprocal.
//!
//! `transmission` follows `KHR_materials_transmission`: the surface is an infinitely thin wall, and
//! this share of the diffuse base is replaced by light which goes **through** it, tinted by the base
//! colour, unrefracted, blurred by the same roughness (the reflected lobe mirrored to the other side;
//! straight through when smooth). It is not diffuse translucency.

use super::conductor::ReflectorLobe;
use super::fresnel::{SCHLICK_AVERAGE, normal_reflectance, schlick_weight};
use super::ggx::reflect;
use super::{BsdfSample, BsdfValue, SMOOTH_BELOW_ALPHA, fresh, mean, stretched};
use crate::description::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use glam::{Vec2, Vec2Swizzles, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Metallic–roughness with thin-walled transmission.
#[derive(Clone, Copy, Debug)]
pub struct Principled<'t> {
    /// The gloss at reflectance 1; `None` is perfectly smooth.
    lobe: Option<ReflectorLobe<'t>>,
    /// Reflectance at normal incidence of the mixture.
    f0: Rgb,
    /// The same of the dielectric alone.
    f0_dielectric: f32,
    /// Colour of the diffuse base: base colour times its share.
    diffuse: Rgb,
    /// Colour of the transmitted light: base colour times its share.
    transmitted: Rgb,
    /// Colour of the metal's light of further bounces, times the share of the metal.
    returned: Rgb,
}

/// The values of [`Principled`], looked up for one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PrincipledParameters {
    pub base_color: Rgb,
    pub metallic: f32,
    pub ior: f32,
    pub transmission: f32,
}

/// Probabilities of the lobes, seen from one direction.
struct Choice {
    /// Cosine lobe on the side of the viewer.
    diffuse: f32,
    /// Of the light which facets keep from getting out: the share that comes back on the side of the viewer, the rest goes
    /// through. `None` where none returns.
    returned: Option<f32>,
    /// Probability with which facets decide between base and gloss, rather than these numbers.
    by_facet: f32,
    /// Of that case, the share which goes to the base.
    base_by_facet: f32,
}

impl<'t> Principled<'t> {
    pub(crate) fn new(parameters: &PrincipledParameters, lobe: Option<ReflectorLobe<'t>>) -> Self {
        let PrincipledParameters { base_color, metallic, ior, transmission } = *parameters;
        debug_assert!(lobe.is_none_or(|lobe| lobe.ggx().alpha >= SMOOTH_BELOW_ALPHA));
        let f0_dielectric = normal_reflectance(ior);
        let metal_average = base_color + (Rgb::ONE - base_color) * SCHLICK_AVERAGE;
        Self {
            lobe,
            f0: Rgb::splat(f0_dielectric).lerp(base_color, metallic),
            f0_dielectric,
            diffuse: base_color * ((1.0 - metallic) * (1.0 - transmission)),
            transmitted: base_color * ((1.0 - metallic) * transmission),
            returned: lobe.map_or(Rgb::ZERO, |lobe| lobe.returned_share(metal_average) * metallic),
        }
    }

    /// Whether light from the other side can come through.
    pub fn transmits(&self) -> bool {
        self.transmitted != Rgb::ZERO
    }

    /// Whether it has any lobe which is not a delta.
    pub(super) fn has_non_delta(&self) -> bool {
        self.lobe.is_some() || self.diffuse != Rgb::ZERO
    }

    /// `(1 − E, B)` of the gloss at `mu`: its albedo for any `F₀` is `F₀ (E − B) + B`.
    #[inline]
    fn gloss(&self, mu: f32) -> (f32, f32) {
        match &self.lobe {
            Some(lobe) => {
                let [lost, b] = lobe.albedo.value(mu);
                (lost, b)
            }
            None => (0.0, schlick_weight(mu)),
        }
    }

    /// `A`: what the dielectric's gloss reflects, from the values of [`Self::gloss`].
    #[inline]
    fn dielectric_albedo(&self, (lost, b): (f32, f32)) -> f32 {
        self.f0_dielectric * (1.0 - lost - b) + b
    }

    /// `Ā`.
    #[inline]
    fn mean_dielectric_albedo(&self) -> f32 {
        self.dielectric_albedo(match &self.lobe {
            Some(lobe) => lobe.albedo.average().into(),
            None => (0.0, SCHLICK_AVERAGE),
        })
    }

    #[inline]
    fn choice(&self, mu: f32) -> Choice {
        let gloss = self.gloss(mu);
        let (lost, b) = gloss;
        let specular = mean(self.f0) * (1.0 - lost - b) + b;
        let a = self.dielectric_albedo(gloss);
        let diffuse = mean(self.diffuse) * (1.0 - a);
        let returned = mean(self.returned) * lost;
        let transmitted = mean(self.transmitted);
        let through = transmitted * (1.0 - lost - a).max(0.0);
        let through_returned = transmitted * lost;
        let sum = specular + diffuse + returned + through + through_returned;
        let back = mean(self.returned);
        let by_facet = if self.lobe.is_some() && self.diffuse != Rgb::ZERO {
            (mean(self.diffuse + self.transmitted) + back).min(1.0)
        } else {
            0.0
        };
        Choice {
            by_facet,
            base_by_facet: (1.0 - specular - through - (back + transmitted) * lost).max(0.0),
            diffuse: if sum > 0.0 { diffuse / sum } else { 0.0 },
            returned: (back + transmitted > 0.0).then(|| back / (back + transmitted)),
        }
    }

    /// Shares of the light that a facet reflects and lets through, means over the channels.
    #[inline]
    fn facet(&self, cos: f32) -> (f32, f32) {
        let weight = schlick_weight(cos);
        let f0 = mean(self.f0);
        let through = mean(self.transmitted) * (1.0 - self.f0_dielectric) * (1.0 - weight);
        (f0 + (1.0 - f0) * weight, through)
    }

    /// Probability with which a facet that is not passed over for the base reflects, rather than lets through.
    #[inline]
    fn reflects(&self, cos: f32) -> f32 {
        let (f, through) = self.facet(cos);
        if through > 0.0 { f / (f + through) } else { 1.0 }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let choice = self.choice(wo.z);
        if u_lobe < choice.by_facet {
            let lobe = self.lobe.as_ref()?;
            return self.sample_by_facet(lobe, wo, stretched(u_lobe, 0.0, choice.by_facet), u);
        }
        let u_lobe = stretched(u_lobe, choice.by_facet, 1.0);
        if u_lobe < choice.diffuse {
            return self.finish(wo, cosine_hemisphere(u), None, false);
        }
        let u_lobe = stretched(u_lobe, choice.diffuse, 1.0);
        match &self.lobe {
            Some(lobe) => self.sample_facet(lobe, &choice, wo, u_lobe, u),
            None => Some(self.sample_smooth(&choice, wo, u_lobe)),
        }
    }

    /// The mirror image, or straight on.
    #[inline]
    fn sample_smooth(&self, choice: &Choice, wo: Vec3, u_lobe: f32) -> BsdfSample {
        let reflects = self.reflects(wo.z);
        let p = 1.0 - choice.diffuse;
        if u_lobe < reflects {
            let f = self.f0 + (Rgb::ONE - self.f0) * schlick_weight(wo.z);
            return BsdfSample::mirrored(wo, f / (p * reflects));
        }
        let a = self.dielectric_albedo(self.gloss(wo.z));
        BsdfSample::straight(wo, self.transmitted * ((1.0 - a) / (p * (1.0 - reflects))))
    }

    /// What a facet makes of the light: gloss, what goes through, further bounces, and for all else the base. That spares weights
    /// of `F/F̄` where it reflects more than others; but over a dark base it would send nearly all light down there. The base has
    /// the numbers which are spread more evenly: it is the brighter one here.
    fn sample_by_facet(
        &self,
        lobe: &ReflectorLobe,
        wo: Vec3,
        u_lobe: f32,
        u: Vec2,
    ) -> Option<BsdfSample> {
        let ggx = lobe.ggx();
        let other = Vec2::new(fresh(u), fresh(u.yx()));
        let m = ggx.sample_visible(wo, other);
        let wi = reflect(wo, m);
        let out = ggx.gets_out(wo, wi);
        let (reflected, through) = self.facet(wo.dot(m));
        let (back, over) = (mean(self.returned), mean(self.transmitted));
        let (gloss, passed) = (reflected * out, (reflected + through) * out);
        let (returned, end) = (out + back * (1.0 - out), out + (back + over) * (1.0 - out));
        if u_lobe < passed {
            return self.finish(wo, wi, Some(m), u_lobe >= gloss);
        }
        if u_lobe < out || u_lobe >= end {
            return self.finish(wo, cosine_hemisphere(u), None, false);
        }
        let is_through = u_lobe >= returned;
        let (from, to) = if is_through { (returned, end) } else { (out, returned) };
        let left = Vec2::new(stretched(u_lobe, from, to), fresh(other));
        self.finish(wo, lobe.albedo.sample_returned(left), None, is_through)
    }

    /// What a facet reflects or lets through, or the light of further bounces where that does not get out.
    #[inline]
    fn sample_facet(
        &self,
        lobe: &ReflectorLobe,
        choice: &Choice,
        wo: Vec3,
        u_lobe: f32,
        u: Vec2,
    ) -> Option<BsdfSample> {
        let ggx = lobe.ggx();
        let m = ggx.sample_visible(wo, u);
        let wi = reflect(wo, m);
        let reflects = self.reflects(wo.dot(m));
        let through = u_lobe >= reflects;
        let (from, to) = if through { (reflects, 1.0) } else { (0.0, reflects) };
        let Some(share) = choice.returned else { return self.finish(wo, wi, Some(m), through) };
        let end = from + (to - from) * ggx.gets_out(wo, wi);
        if u_lobe < end {
            return self.finish(wo, wi, Some(m), through);
        }
        let left = stretched(u_lobe, end, to);
        let through = left >= share;
        let left = if through { stretched(left, share, 1.0) } else { stretched(left, 0.0, share) };
        let wi = lobe.albedo.sample_returned(Vec2::new(left, fresh(u)));
        self.finish(wo, wi, None, through)
    }

    /// The sample of the direction `wi` above the surface, or of its mirror image `through` it.
    #[inline]
    fn finish(&self, wo: Vec3, wi: Vec3, m: Option<Vec3>, through: bool) -> Option<BsdfSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let wi = if through { wi.with_z(-wi.z) } else { wi };
        BsdfSample::evaluated(wi, self.evaluate(wo, wi, m), through, 1.0)
    }

    #[inline]
    pub(super) fn evaluate_two_sided(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        if wo.z == 0.0 || wi.z == 0.0 {
            return BsdfValue::ZERO;
        }
        if wo.z > 0.0 {
            self.evaluate(wo, wi, None)
        } else {
            self.evaluate(wo.with_z(-wo.z), wi.with_z(-wi.z), None)
        }
    }

    /// Evaluates for `wo.z > 0` and `wi` on either side; `m` is the half vector of a reflection, where it is known.
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3, m: Option<Vec3>) -> BsdfValue {
        let choice = self.choice(wo.z);
        let mu_i = wi.z.abs();
        // Both sides have the geometry of a reflection.
        let mirrored = wi.with_z(mu_i);
        let cosine = mu_i * FRAC_1_PI;
        // D V μ_i, the cosine at the facet, `returned_f_cos`, and the two densities.
        let (single, cos, returned, pdf, returned_pdf) = match &self.lobe {
            Some(lobe) => {
                let ggx = lobe.ggx();
                let m = m.unwrap_or_else(|| (wo + mirrored).normalize_or_zero());
                let single = ggx.d(m) * ggx.v_cos(wo.z, mu_i);
                let lost = lobe.lost(wo.z);
                let returned = lobe.returned_f_cos(lost, mu_i);
                let (pdf, returned_pdf) = match choice.returned {
                    Some(_) => (single, lost * lobe.albedo.returned_pdf(mu_i)),
                    None => (ggx.reflection_pdf(wo, m), 0.0),
                };
                (single, wo.dot(m), returned, pdf, returned_pdf)
            }
            None => (0.0, 1.0, 0.0, 0.0, 0.0),
        };
        let (weight, reflects) = (schlick_weight(cos), self.reflects(cos));
        let (reflected, through) = self.facet(cos);
        let by_facet = choice.by_facet;
        let (p, share) = (1.0 - choice.diffuse, choice.returned.unwrap_or(1.0));
        if wi.z > 0.0 {
            let f = self.f0 + (Rgb::ONE - self.f0) * weight;
            let a_o = self.dielectric_albedo(self.gloss(wo.z));
            let a_i = self.dielectric_albedo(self.gloss(mu_i));
            let base = (1.0 - a_o) * (1.0 - a_i) / (1.0 - self.mean_dielectric_albedo()) * cosine;
            BsdfValue {
                f_cos: f * single + self.diffuse * base + self.returned * returned,
                pdf: by_facet
                    * (reflected * single
                        + choice.base_by_facet * cosine
                        + mean(self.returned) * returned_pdf)
                    + (1.0 - by_facet)
                        * (choice.diffuse * cosine + p * (reflects * pdf + share * returned_pdf)),
            }
        } else {
            let f = self.f0_dielectric + (1.0 - self.f0_dielectric) * weight;
            BsdfValue {
                f_cos: self.transmitted * ((1.0 - f) * single + returned),
                pdf: by_facet * (through * single + mean(self.transmitted) * returned_pdf)
                    + (1.0 - by_facet)
                        * p
                        * ((1.0 - reflects) * pdf + (1.0 - share) * returned_pdf),
            }
        }
    }

    pub(super) fn albedo(&self, mu: f32) -> Rgb {
        let gloss = self.gloss(mu);
        let (lost, b) = gloss;
        let a = self.dielectric_albedo(gloss);
        self.f0 * (1.0 - lost - b)
            + Rgb::splat(b)
            + (self.diffuse + self.transmitted) * (1.0 - a)
            + self.returned * lost
    }
}
