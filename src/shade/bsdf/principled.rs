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
use super::{BsdfSample, BsdfValue, SMOOTH_BELOW_ALPHA, mean};
use crate::description::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use glam::{Vec2, Vec3};
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

/// Probabilities of the lobes.
struct Choice {
    gloss: f32,
    /// Cosine lobe on the side of the viewer.
    diffuse: f32,
    /// Light of further bounces on the side of the viewer.
    returned: f32,
    /// Mirrored gloss on the other side; the smooth case goes straight on.
    through: f32,
    /// Light of further bounces on the other side.
    through_returned: f32,
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

    /// [`Bsdf::is_storable`](super::Bsdf::is_storable).
    #[inline]
    pub(super) fn is_storable(&self, min_alpha: f32) -> bool {
        self.diffuse != Rgb::ZERO || self.lobe.is_some_and(|lobe| lobe.ggx().alpha >= min_alpha)
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
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        Choice {
            gloss: specular * scale,
            diffuse: diffuse * scale,
            returned: returned * scale,
            through: through * scale,
            through_returned: through_returned * scale,
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let choice = self.choice(wo.z);
        let gloss_direction = |lobe: &ReflectorLobe| reflect(wo, lobe.ggx().sample_visible(wo, u));
        let mut end = choice.gloss;
        if u_lobe < end {
            let Some(lobe) = &self.lobe else {
                let f = self.f0 + (Rgb::ONE - self.f0) * schlick_weight(wo.z);
                return Some(BsdfSample::mirrored(wo, f / choice.gloss));
            };
            return self.finish(wo, gloss_direction(lobe), false);
        }
        end += choice.diffuse;
        if u_lobe < end {
            return self.finish(wo, cosine_hemisphere(u), false);
        }
        end += choice.through;
        if u_lobe < end {
            let Some(lobe) = &self.lobe else {
                let a = self.dielectric_albedo(self.gloss(wo.z));
                let weight = self.transmitted * ((1.0 - a) / choice.through);
                return Some(BsdfSample::straight(wo, weight));
            };
            return self.finish(wo, gloss_direction(lobe), true);
        }
        let lobe = self.lobe.as_ref()?;
        end += choice.returned;
        if u_lobe < end {
            return self.finish(wo, lobe.albedo.sample_returned(u), false);
        }
        if choice.through_returned > 0.0 {
            return self.finish(wo, lobe.albedo.sample_returned(u), true);
        }
        None
    }

    /// The sample of the direction `wi` above the surface, or of its mirror image `through` it.
    #[inline]
    fn finish(&self, wo: Vec3, wi: Vec3, through: bool) -> Option<BsdfSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let wi = if through { wi.with_z(-wi.z) } else { wi };
        BsdfSample::evaluated(wi, self.evaluate(wo, wi), through, 1.0)
    }

    #[inline]
    pub(super) fn evaluate_two_sided(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        if wo.z == 0.0 || wi.z == 0.0 {
            return BsdfValue::ZERO;
        }
        if wo.z > 0.0 {
            self.evaluate(wo, wi)
        } else {
            self.evaluate(wo.with_z(-wo.z), wi.with_z(-wi.z))
        }
    }

    /// Evaluates for `wo.z > 0` and `wi` on either side.
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        let choice = self.choice(wo.z);
        let mu_i = wi.z.abs();
        // Both sides have the geometry of a reflection.
        let mirrored = wi.with_z(mu_i);
        let cosine = mu_i * FRAC_1_PI;
        // D V μ_i, the weight of Schlick's term, `returned_f_cos`, and the two densities.
        let (single, weight, returned, pdf, returned_pdf) = match &self.lobe {
            Some(lobe) => {
                let ggx = lobe.ggx();
                let m = (wo + mirrored).normalize_or_zero();
                (
                    ggx.d(m) * ggx.v_cos(wo.z, mu_i),
                    schlick_weight(wo.dot(m)),
                    lobe.returned_f_cos(lobe.lost(wo.z), mu_i),
                    ggx.reflection_pdf(wo, m),
                    lobe.albedo.returned_pdf(mu_i),
                )
            }
            None => (0.0, 0.0, 0.0, 0.0, 0.0),
        };
        if wi.z > 0.0 {
            let f = self.f0 + (Rgb::ONE - self.f0) * weight;
            let a_o = self.dielectric_albedo(self.gloss(wo.z));
            let a_i = self.dielectric_albedo(self.gloss(mu_i));
            let base = (1.0 - a_o) * (1.0 - a_i) / (1.0 - self.mean_dielectric_albedo()) * cosine;
            BsdfValue {
                f_cos: f * single + self.diffuse * base + self.returned * returned,
                pdf: choice.gloss * pdf + choice.diffuse * cosine + choice.returned * returned_pdf,
            }
        } else {
            let f = self.f0_dielectric + (1.0 - self.f0_dielectric) * weight;
            BsdfValue {
                f_cos: self.transmitted * ((1.0 - f) * single + returned),
                pdf: choice.through * pdf + choice.through_returned * returned_pdf,
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
