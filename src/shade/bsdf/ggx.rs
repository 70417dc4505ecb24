//! The GGX distribution of microfacet normals: evaluating it and drawing visible normals.
//!
//! With `α` the width (slope, no unit), `m` a microfacet normal, `μ` cosines with the surface
//! normal and `s(μ) = √(α² + μ²(1 − α²))`
//!
//! ```text
//! D(m) = α² / (π (α² m_z² + m_x² + m_y²)²)
//! Λ(μ) = (s/μ − 1)/2,   G₁ = 1/(1 + Λ),   G₂ = 1/(1 + Λ_o + Λ_i)
//! V = G₂ / (4 μ_o μ_i) = ½ / (μ_i s_o + μ_o s_i)
//! ```
//!
//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", EGSR;
//! Heitz 2014, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs",
//! JCGT 3(2) (height-correlated `G₂`). The sine of `m` comes from its components rather than from
//! `1 − m_z²`, and no tangent and no division by `μ` appears, so that narrow lobes and grazing
//! angles keep their precision.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Widths `α` below this are perfectly smooth: 8ε = 2⁻²⁰, a roughness of 9.8·10⁻⁴.
///
/// The components of a direction in `f32` are multiples of ε/2, and a local frame rounds them once more: a half vector formed
/// of two directions is off by about ε. Relative to a lobe of width `α` that is `ε/α`, and `D`, which falls with the fourth
/// power, is off by four times that: half of its value here, where the lobe is a fifth of a second of arc wide, and 10⁻³ at a
/// roughness of 0.02. What is drawn does not suffer: it is weighted by the facet that was drawn, not by one
/// formed anew. What is connected to a light is blurred by ε. Narrower lobes hold fewer directions than it takes
/// to tell their form.
pub(crate) const SMOOTH_BELOW_ALPHA: f32 = 8.0 * f32::EPSILON;

/// The GGX distribution of one width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ggx {
    /// Width, in `[SMOOTH_BELOW_ALPHA, 1]`.
    pub alpha: f32,
}

impl Ggx {
    /// Density of microfacet normals per solid angle and projected area: `∫ D m_z dm = 1`.
    #[inline]
    pub fn d(self, m: Vec3) -> f32 {
        let alpha2 = self.alpha * self.alpha;
        let t = alpha2 * m.z * m.z + m.x * m.x + m.y * m.y;
        alpha2 * FRAC_1_PI / (t * t)
    }

    /// `s(μ) = √(α² + μ²(1 − α²))`.
    #[inline]
    pub fn s(self, mu: f32) -> f32 {
        let alpha2 = self.alpha * self.alpha;
        (alpha2 + mu * mu * (1.0 - alpha2)).sqrt()
    }

    /// `V μ_i = G₂ / (4 μ_o)`; both cosines positive. Their quotient rather than their products:
    /// two grazing directions must not underflow.
    #[inline]
    pub fn v_cos(self, mu_o: f32, mu_i: f32) -> f32 {
        0.5 / (self.s(mu_o) + self.s(mu_i) * (mu_o / mu_i))
    }

    /// `G₂ / G₁(o)`: the share of what the visible facets send along `μ_i` that gets out.
    #[inline]
    pub fn shadowing(self, mu_o: f32, mu_i: f32) -> f32 {
        let s_o = self.s(mu_o);
        (s_o + mu_o) / (s_o + self.s(mu_i) * (mu_o / mu_i))
    }

    /// Share of the facets drawn for `wo` from which the reflected `wi` gets out; none where it points inwards.
    #[inline]
    pub fn gets_out(self, wo: Vec3, wi: Vec3) -> f32 {
        if wi.z > 0.0 { self.shadowing(wo.z, wi.z) } else { 0.0 }
    }

    /// Density per solid angle of the direction which `m = (o + i)/|o + i|` reflects `wo` into.
    #[inline]
    pub fn reflection_pdf(self, wo: Vec3, m: Vec3) -> f32 {
        0.5 * self.d(m) / (wo.z + self.s(wo.z))
    }

    /// Draws a microfacet normal as seen from `wo`, `wo.z > 0`.
    ///
    /// `u` in `[0, 1)²`. Returns a unit vector with `z >= 0`; its density per solid angle is
    /// `G₁(o) (o·m)⁺ D / μ_o`. Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
    /// Caps", Computer Graphics Forum 42(8), listing 3.
    #[inline]
    pub fn sample_visible(self, wo: Vec3, u: Vec2) -> Vec3 {
        let alpha = self.alpha;
        let w = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
        let (sin_phi, cos_phi) = (TAU * u.x).sin_cos();
        let z = (1.0 - u.y) * (1.0 + w.z) - w.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let h = Vec3::new(r * cos_phi, r * sin_phi, z) + w;
        // h is zero only for u.y = 1, which the domain excludes; the fallback costs nothing.
        Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }
}

/// Mirrors `wo` at `m`.
#[inline]
pub(crate) fn reflect(wo: Vec3, m: Vec3) -> Vec3 {
    2.0 * wo.dot(m) * m - wo
}

/// Refracts `wo` at `m` to the other side, `eta` being the index there over that on the side of
/// `wo`. Under total reflection it is the direction along the facet, stretched: not a unit vector.
#[inline]
pub(crate) fn refract(wo: Vec3, m: Vec3, eta: f32) -> Vec3 {
    let cos = wo.dot(m);
    let sin2_t = wo.cross(m).length_squared() / (eta * eta);
    let mu_t = (1.0 - sin2_t).max(0.0).sqrt();
    (cos / eta - mu_t) * m - wo / eta
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::bsdf::fresnel::gauss_legendre;

    /// Oracle: `∫ D m_z dm = 1`; in `t = tan²θ_m` the integrand is `α²/(α² + t)²`, integrated here
    /// over `s = t/(t + α²)` from the implementation's `D`.
    #[test]
    fn facets_cover_the_surface_once() {
        for alpha in [SMOOTH_BELOW_ALPHA, 0.1, 0.5, 1.0] {
            let a2 = f64::from(alpha * alpha);
            let sum: f64 = gauss_legendre::<64>()
                .iter()
                .map(|&(s, weight)| {
                    let t = a2 * s / (1.0 - s);
                    let cos2 = 1.0 / (1.0 + t);
                    let m = glam::DVec3::new((1.0 - cos2).sqrt(), 0.0, cos2.sqrt()).as_vec3();
                    // d(cos θ) · cos θ = ½ d(cos²θ); dt/ds = α²/(1 − s)²
                    let measure = 0.5 * cos2 * cos2 * a2 / (1.0 - s).powi(2);
                    weight * std::f64::consts::TAU * f64::from(Ggx { alpha }.d(m)) * measure
                })
                .sum();
            assert!((sum - 1.0).abs() < 1e-4, "α = {alpha}: {sum}");
        }
    }

    /// Oracle: α = ½, μ = ½: Λ = 0.1614378, G₁ = 0.8610017, D(0) = 1.2732395.
    #[test]
    fn masking_matches_its_definition() {
        let ggx = Ggx { alpha: 0.5 };
        assert!((ggx.d(Vec3::Z) - 1.273_239_5).abs() < 1e-6);
        let g1 = 2.0 * 0.5 / (0.5 + ggx.s(0.5)); // 1/(1 + Λ) with Λ = (s/μ − 1)/2
        assert!((g1 - 0.861_001_7).abs() < 1e-6);
        let lambda = |mu: f32| 0.5 * ((1.0 + 0.25 * (1.0 / (mu * mu) - 1.0)).sqrt() - 1.0);
        assert!((lambda(0.5) - 0.161_437_8).abs() < 1e-6);
        for (o, i) in [(0.5, 0.5), (1.0, 0.3), (0.01, 0.9), (0.2, 0.001)] {
            let g2 = 1.0 / (1.0 + lambda(o) + lambda(i));
            assert!((ggx.v_cos(o, i) / (g2 / (4.0 * o)) - 1.0).abs() < 1e-4, "{o} {i}");
            let ratio = g2 * (1.0 + lambda(o));
            assert!((ggx.shadowing(o, i) / ratio - 1.0).abs() < 1e-4, "{o} {i}");
        }
    }

    /// The corners of the unit square, at normal and at grazing incidence: unit facets above the surface.
    #[test]
    fn corners_of_the_square_give_valid_facets() {
        let corners = [0.0, 0.5, 1.0_f32.next_down()];
        for alpha in [SMOOTH_BELOW_ALPHA, 0.3, 1.0] {
            for wo in [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(1.0, 0.0, 1e-6), Vec3::X] {
                for x in corners {
                    for y in corners {
                        let m = Ggx { alpha }.sample_visible(wo, Vec2::new(x, y));
                        assert!((m.length() - 1.0).abs() < 1e-5 && m.z >= 0.0, "{wo} {x} {y}: {m}");
                        // At the far corner h = c + w cancels to rounding noise.
                        assert!(y > 0.9 || wo.dot(m) >= 0.0, "{wo} {x} {y}: {m}");
                    }
                }
            }
        }
    }
}
