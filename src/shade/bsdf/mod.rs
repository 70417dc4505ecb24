//! How a point of a surface scatters light: one model per file, one enum over them.
//!
//! Directions are unit vectors in the local shading frame. Its z axis is the shading normal on the
//! **outside** of the object, never turned towards the viewer: `wo.z < 0` means that the viewer is
//! inside or behind. `wo` leads back along the path, `wi` is drawn or asked for; both leave the
//! surface. Opaque models are two-sided: seen from behind they look as from the front. Densities
//! are per solid angle.
//!
//! A lobe which is a Dirac delta (a smooth interface) can be drawn but not evaluated: [`Bsdf::evaluate`]
//! and every `pdf` cover the other lobes alone. All models are reciprocal, `f(o, i) = f(i, o)`, and
//! transmission obeys `f(o → i) n_o² = f(i → o) n_i²` (Veach 1997, *Robust Monte Carlo Methods for Light
//! Transport Simulation*, section 5.2).

mod conductor;
mod dielectric;
mod diffuse;
mod energy;
mod fresnel;
mod ggx;
mod mirror;
mod plastic;
mod principled;
mod rough_dielectric;
#[cfg(test)]
mod statistics;
#[cfg(test)]
mod tests;
mod thin_glass;

pub use conductor::{RoughConductor, SmoothConductor};
pub use dielectric::SmoothDielectric;
pub use diffuse::Diffuse;
pub use mirror::Mirror;
pub use plastic::{RoughPlastic, SmoothPlastic};
pub use principled::Principled;
pub use rough_dielectric::RoughDielectric;
pub use thin_glass::ThinGlass;

pub(crate) use conductor::ReflectorLobe;
pub(crate) use energy::{
    AlbedoTable, ReflectorTable, Widths, coat_table, glass_table, reflector_table,
    reflector_table_at,
};
pub(crate) use fresnel::{
    ConductorFresnel, SCHLICK_AVERAGE, dielectric_average, normal_reflectance,
};
pub(crate) use ggx::SMOOTH_BELOW_ALPHA;
pub(crate) use principled::PrincipledParameters;

use crate::description::Rgb;
use glam::{Vec2, Vec3};

/// What travels along the path: decides how refraction scales it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TransportMode {
    /// A path from the camera carries radiance, which changes by `1/η²` where light enters another
    /// medium: `L/n²` is what stays constant along a refracted ray.
    Radiance,
    /// A photon carries power, which refraction does not change.
    Importance,
}

impl TransportMode {
    /// The factor on a transmitted value; `eta` is the index beyond the surface over the one on
    /// the side of `wo`.
    #[inline]
    fn transmission_factor(self, eta: f32) -> f32 {
        match self {
            Self::Radiance => 1.0 / (eta * eta),
            Self::Importance => 1.0,
        }
    }
}

/// A direction drawn by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The new direction.
    pub wi: Vec3,
    /// `f · |cos θ_i| / pdf`, the choice of the lobe included.
    pub weight: Rgb,
    /// Density of `wi` per solid angle over **all** lobes which are not deltas; 0 for a delta.
    pub pdf: f32,
    /// Whether the lobe is a delta.
    pub delta: bool,
    /// Whether the direction lies on the other side.
    pub transmitted: bool,
    /// Index beyond the surface over the one on the side of `wo` where the ray is refracted;
    /// 1 where it is reflected or the surface is thin.
    pub eta: f32,
}

impl BsdfSample {
    /// A mirror image: `wi = (−x, −y, z)` of `wo`.
    #[inline]
    fn mirrored(wo: Vec3, weight: Rgb) -> Self {
        let wi = Vec3::new(-wo.x, -wo.y, wo.z);
        Self { wi, weight, pdf: 0.0, delta: true, transmitted: false, eta: 1.0 }
    }

    /// Straight on: `wi = −wo`.
    #[inline]
    fn straight(wo: Vec3, weight: Rgb) -> Self {
        Self { wi: -wo, weight, pdf: 0.0, delta: true, transmitted: true, eta: 1.0 }
    }

    /// Straight on, into a medium of the relative index `eta`.
    pub(in crate::shade) fn let_through(
        wo: Vec3,
        (eta, tint): (f32, Rgb),
        mode: TransportMode,
    ) -> Self {
        Self { eta, ..Self::straight(wo, tint * mode.transmission_factor(eta)) }
    }

    /// A direction of a lobe which is not a delta, with what evaluating it gave; `None` where it
    /// carries nothing.
    #[inline]
    fn evaluated(wi: Vec3, value: BsdfValue, transmitted: bool, eta: f32) -> Option<Self> {
        // A density so small that the quotient overflows means a weight of noise: no sample.
        let weight = value.f_cos / value.pdf;
        (value.pdf > 0.0 && weight.is_finite()).then_some(Self {
            wi,
            weight,
            pdf: value.pdf,
            delta: false,
            transmitted,
            eta,
        })
    }

    /// The same sample for a viewer behind the surface.
    #[inline]
    fn turned(mut self, behind: bool) -> Self {
        if behind {
            self.wi.z = -self.wi.z;
        }
        self
    }
}

/// A BSDF evaluated for a pair of directions: all lobes which are not deltas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfValue {
    /// `f · |cos θ_i|`.
    pub f_cos: Rgb,
    /// Density with which [`Bsdf::sample`] draws `wi`, per solid angle.
    pub pdf: f32,
}

impl BsdfValue {
    /// Nothing is scattered this way.
    pub const ZERO: Self = Self { f_cos: Rgb::ZERO, pdf: 0.0 };
}

/// The scattering of one point. Cheap to copy; `'t` is the [`MaterialTable`](super::MaterialTable)
/// it came from.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the types say it")]
pub enum Bsdf<'t> {
    Diffuse(Diffuse),
    Mirror(Mirror),
    SmoothDielectric(SmoothDielectric),
    RoughDielectric(RoughDielectric<'t>),
    ThinGlass(ThinGlass),
    SmoothConductor(SmoothConductor),
    RoughConductor(RoughConductor<'t>),
    SmoothPlastic(SmoothPlastic),
    RoughPlastic(RoughPlastic<'t>),
    Principled(Principled<'t>),
}

impl Bsdf<'_> {
    /// Draws a direction.
    ///
    /// * `u_lobe` — uniform in `[0, 1)`, chooses the lobe: by `u_lobe < p`, so that a lobe of
    ///   probability 0 is never chosen.
    /// * `u` — two uniforms in `[0, 1)²`, choose the direction in the lobe.
    ///
    /// `None` is a sample without energy: it counts as zero, it is not to be drawn again.
    #[inline]
    pub fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: Vec2,
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(bsdf) => two_sided_sample(wo, |wo| bsdf.sample(wo, u)),
            Self::Mirror(bsdf) => two_sided_sample(wo, |wo| Some(bsdf.sample(wo))),
            Self::SmoothDielectric(bsdf) => bsdf.sample(wo, u_lobe, mode),
            Self::RoughDielectric(bsdf) => bsdf.sample(wo, u_lobe, u, mode),
            Self::ThinGlass(bsdf) => two_sided_sample(wo, |wo| bsdf.sample(wo, u_lobe)),
            Self::SmoothConductor(bsdf) => two_sided_sample(wo, |wo| Some(bsdf.sample(wo))),
            Self::RoughConductor(bsdf) => two_sided_sample(wo, |wo| bsdf.sample(wo, u_lobe, u)),
            Self::SmoothPlastic(bsdf) => two_sided_sample(wo, |wo| bsdf.sample(wo, u_lobe, u)),
            Self::RoughPlastic(bsdf) => two_sided_sample(wo, |wo| bsdf.sample(wo, u_lobe, u)),
            Self::Principled(bsdf) => two_sided_sample(wo, |wo| bsdf.sample(wo, u_lobe, u)),
        }
    }

    /// The probability with which [`Bsdf::sample`] takes the first of two deltas, those with `u_lobe` below
    /// it; `None` where there are not just two.
    #[inline]
    pub fn first_of_two_deltas(&self, wo: Vec3) -> Option<f32> {
        let p = match self {
            Self::SmoothDielectric(bsdf) => bsdf.reflectance(wo),
            Self::ThinGlass(bsdf) => bsdf.reflection_probability(wo),
            _ => return None,
        };
        (p > 0.0 && p < 1.0).then_some(p)
    }

    /// Where it encloses a solid: the index beyond the surface over the one on the side of `wo`, and the tint of a crossing.
    #[inline]
    pub fn refracts(&self, wo: Vec3) -> Option<(f32, Rgb)> {
        let (eta, tint) = match self {
            Self::SmoothDielectric(bsdf) => (bsdf.eta, bsdf.tint),
            Self::RoughDielectric(bsdf) => (bsdf.eta(), bsdf.tint()),
            _ => return None,
        };
        Some((if wo.z > 0.0 { eta } else { 1.0 / eta }, tint))
    }

    /// Evaluates all lobes which are not deltas for a pair of directions.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> BsdfValue {
        match self {
            Self::Diffuse(bsdf) => opaque_evaluate(wo, wi, |_, wi| bsdf.evaluate(wi)),
            Self::Mirror(_)
            | Self::SmoothDielectric(_)
            | Self::ThinGlass(_)
            | Self::SmoothConductor(_) => BsdfValue::ZERO,
            Self::RoughDielectric(bsdf) => bsdf.evaluate(wo, wi, mode),
            Self::RoughConductor(bsdf) => opaque_evaluate(wo, wi, |wo, wi| bsdf.evaluate(wo, wi)),
            Self::SmoothPlastic(bsdf) => opaque_evaluate(wo, wi, |wo, wi| bsdf.evaluate(wo, wi)),
            Self::RoughPlastic(bsdf) => opaque_evaluate(wo, wi, |wo, wi| bsdf.evaluate(wo, wi)),
            Self::Principled(bsdf) => bsdf.evaluate_two_sided(wo, wi),
        }
    }

    /// Whether [`Bsdf::evaluate`] is ever other than zero: whether connecting to a light makes sense.
    #[inline]
    pub fn has_non_delta(&self) -> bool {
        match self {
            Self::Mirror(_)
            | Self::SmoothDielectric(_)
            | Self::ThinGlass(_)
            | Self::SmoothConductor(_) => false,
            Self::Principled(bsdf) => bsdf.has_non_delta(),
            _ => true,
        }
    }

    /// Whether light from the other side can come through.
    #[inline]
    pub fn transmits(&self) -> bool {
        match self {
            Self::SmoothDielectric(_) | Self::RoughDielectric(_) | Self::ThinGlass(_) => true,
            Self::Principled(bsdf) => bsdf.transmits(),
            _ => false,
        }
    }

    /// Share of the light from `wo` which is scattered at all, transmission included: for
    /// the albedo layer. Exact up to the interpolation of tables.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let mu = wo.z.abs().min(1.0);
        match self {
            Self::Diffuse(bsdf) => bsdf.albedo,
            Self::Mirror(bsdf) => bsdf.reflectance,
            Self::SmoothDielectric(_) | Self::RoughDielectric(_) => {
                self.refracts(wo).map_or(Rgb::ONE, |(eta, tint)| {
                    let f = fresnel::dielectric_reflectance(mu, eta);
                    tint + (Rgb::ONE - tint) * f
                })
            }
            Self::ThinGlass(bsdf) => bsdf.albedo(mu),
            Self::SmoothConductor(bsdf) => bsdf.albedo(mu),
            Self::RoughConductor(bsdf) => bsdf.albedo(mu),
            Self::SmoothPlastic(bsdf) => bsdf.albedo(mu),
            Self::RoughPlastic(bsdf) => bsdf.albedo(mu),
            Self::Principled(bsdf) => bsdf.albedo(mu),
        }
    }
}

/// A number uniform in `[0, 1)` which does not depend on what two others decide: a hash of their bits.
///
/// Where a facet was drawn and what it sends does not get out, the numbers which drew it are used up: of those that draw such
/// facets they are not uniform.
#[inline]
fn fresh(u: Vec2) -> f32 {
    // The finaliser of MurmurHash3 (Appleby 2011): every bit of its input changes every bit of its output.
    let mut h = u.x.to_bits() ^ u.y.to_bits().wrapping_mul(0x9E37_79B1).rotate_left(15);
    h = (h ^ (h >> 16)).wrapping_mul(0x85EB_CA6B);
    h = (h ^ (h >> 13)).wrapping_mul(0xC2B2_AE35);
    h ^= h >> 16;
    (h >> 8) as f32 / (1_u32 << 24) as f32
}

/// What is left of a number in `[0, 1)` that lies in `[from, to)`, stretched to `[0, 1)`.
#[inline]
fn stretched(u: f32, from: f32, to: f32) -> f32 {
    ((u - from) / (to - from)).clamp(0.0, 1.0_f32.next_down())
}

/// Samples a model which is the same from both sides; it sees `wo.z > 0`.
#[inline]
fn two_sided_sample(
    wo: Vec3,
    sample: impl FnOnce(Vec3) -> Option<BsdfSample>,
) -> Option<BsdfSample> {
    let behind = wo.z < 0.0;
    let above = wo.with_z(wo.z.abs());
    // At exactly grazing incidence a surface has no extent and scatters nothing.
    if above.z == 0.0 {
        return None;
    }
    sample(above).map(|sample| sample.turned(behind))
}

/// Evaluates an opaque model which is the same from both sides; it sees both directions above.
#[inline]
fn opaque_evaluate(
    wo: Vec3,
    wi: Vec3,
    evaluate: impl FnOnce(Vec3, Vec3) -> BsdfValue,
) -> BsdfValue {
    // The product may underflow to zero for two grazing directions: compare signs.
    if wo.z == 0.0 || wi.z == 0.0 || (wo.z < 0.0) != (wi.z < 0.0) {
        return BsdfValue::ZERO;
    }
    evaluate(wo.with_z(wo.z.abs()), wi.with_z(wi.z.abs()))
}

/// Mean of the channels: how much a lobe counts when one is chosen.
#[inline]
fn mean(color: Rgb) -> f32 {
    color.element_sum() * (1.0 / 3.0)
}
