//! How much a smooth interface reflects: Fresnel's equations for unpolarised light.
//!
//! `η = n_t / n_i` is the relative index from the side of the incident ray to the other one,
//! `μ` a cosine with the normal, both cosines taken positive. For a dielectric
//!
//! ```text
//! r∥ = (η μ_i − μ_t) / (η μ_i + μ_t),   r⊥ = (μ_i − η μ_t) / (μ_i + η μ_t),   F = (r∥² + r⊥²) / 2
//! ```
//!
//! and `F = 1` beyond the critical angle. Pharr, Jakob, Humphreys 2023, *Physically Based
//! Rendering*, 4th ed., sections 9.3.5 (dielectrics) and 9.3.6 (conductors).

use crate::description::Rgb;

/// What a ray meets at a smooth dielectric interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interface {
    /// Reflected share of the power, in `[0, 1]`.
    pub reflectance: f32,
    /// Cosine of the refracted ray on the other side, positive; 0 under total reflection.
    pub mu_t: f32,
}

/// Fresnel reflectance of a dielectric and the cosine beyond it.
///
/// * `mu_i` — cosine of the incident ray, in `[0, 1]`.
/// * `sin2_i` — its squared sine. Asked for rather than computed, since `1 − μ²` loses what
///   a caller who knows the tangential components still has.
/// * `eta` — relative index `n_t / n_i`, any positive number.
#[inline]
#[expect(
    clippy::float_cmp,
    reason = "1 exactly is the removable singularity; beside it all is well"
)]
pub(crate) fn dielectric(mu_i: f32, sin2_i: f32, eta: f32) -> Interface {
    if eta == 1.0 {
        // No interface; the formula is 0/0 at grazing incidence.
        return Interface { reflectance: 0.0, mu_t: mu_i };
    }
    let sin2_t = sin2_i / (eta * eta);
    if sin2_t >= 1.0 {
        return Interface { reflectance: 1.0, mu_t: 0.0 };
    }
    let mu_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * mu_i - mu_t) / (eta * mu_i + mu_t);
    let perpendicular = (mu_i - eta * mu_t) / (mu_i + eta * mu_t);
    Interface { reflectance: 0.5 * (parallel * parallel + perpendicular * perpendicular), mu_t }
}

/// Reflectance of a dielectric where only the cosine of the incident ray is known.
#[inline]
pub(crate) fn dielectric_reflectance(mu_i: f32, eta: f32) -> f32 {
    dielectric(mu_i, ((1.0 - mu_i) * (1.0 + mu_i)).max(0.0), eta).reflectance
}

/// Diffuse (cosine-weighted) mean `2 ∫ F(μ) μ dμ` of the dielectric reflectance.
///
/// From the dense side (`eta < 1`) it follows from reciprocity, `1 − F̄(1/η) = (1 − F̄(η)) / η²`,
/// which spares the quadrature the kink at the critical angle.
pub(crate) fn dielectric_average(eta: f32) -> f32 {
    if eta < 1.0 {
        let inverse = 1.0 / f64::from(eta);
        let outside = cosine_average(|mu| f64::from(dielectric_reflectance(mu, inverse as f32)));
        return (1.0 - (1.0 - outside) / (inverse * inverse)) as f32;
    }
    cosine_average(|mu| f64::from(dielectric_reflectance(mu, eta))) as f32
}

/// `F₀ = ((η − 1) / (η + 1))²`, the reflectance at normal incidence.
#[inline]
pub(crate) fn normal_reflectance(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// `(1 − μ)⁵`, the angular part of Schlick's approximation.
#[inline]
pub(crate) fn schlick_weight(mu: f32) -> f32 {
    let m = (1.0 - mu).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Cosine-weighted mean of `(1 − μ)⁵`: `2 ∫ (1 − μ)⁵ μ dμ = 1/21`.
pub(crate) const SCHLICK_AVERAGE: f32 = 1.0 / 21.0;

/// How the reflectance of a metal depends on the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ConductorFresnel {
    /// Exact, from the complex index `η + i k` per channel.
    Complex {
        /// Real part.
        eta: Rgb,
        /// Imaginary part.
        k: Rgb,
    },
    /// `F₀ + (1 − F₀)(1 − μ)⁵` (Schlick 1994, "An Inexpensive BRDF Model for Physically-based
    /// Rendering", Computer Graphics Forum 13(3)).
    Schlick {
        /// Reflectance at normal incidence.
        f0: Rgb,
    },
}

impl ConductorFresnel {
    /// Reflectance at the cosine `mu` in `[0, 1]`.
    #[inline]
    pub fn reflectance(&self, mu: f32) -> Rgb {
        match *self {
            Self::Complex { eta, k } => conductor(mu, eta, k),
            Self::Schlick { f0 } => f0 + (Rgb::ONE - f0) * schlick_weight(mu),
        }
    }

    /// Cosine-weighted mean of the reflectance.
    pub fn average(&self) -> Rgb {
        match *self {
            Self::Complex { .. } => Rgb::from_array(std::array::from_fn(|channel| {
                cosine_average(|mu| f64::from(self.reflectance(mu)[channel])) as f32
            })),
            Self::Schlick { f0 } => f0 + (Rgb::ONE - f0) * SCHLICK_AVERAGE,
        }
    }
}

/// Reflectance of a metal with the complex index `η + i k`, seen from vacuum.
///
/// With `a + i b = √((η + i k)² − sin²θ)` the amplitudes need real arithmetic only (Born and Wolf
/// 1999, *Principles of Optics*, 7th ed., section 14.2). `a²` is taken in the form which does not
/// cancel when `k` is much larger than `η`, as it is for silver.
fn conductor(mu: f32, eta: Rgb, k: Rgb) -> Rgb {
    let cos2 = mu * mu;
    let sin2 = (1.0 - mu) * (1.0 + mu);
    let eta2 = eta * eta;
    let k2 = k * k;
    let real = eta2 - k2 - Rgb::splat(sin2);
    let norm = (real * real + 4.0 * eta2 * k2).map(f32::sqrt); // a² + b²
    let a = Rgb::from_array(std::array::from_fn(|c| {
        let a2 = if real[c] >= 0.0 {
            0.5 * (norm[c] + real[c])
        } else {
            2.0 * eta2[c] * k2[c] / (norm[c] - real[c])
        };
        a2.sqrt()
    }));
    let cross = 2.0 * mu * a;
    let sum = norm + Rgb::splat(cos2);
    let perpendicular = (sum - cross) / (sum + cross);
    let sum = norm * cos2 + Rgb::splat(sin2 * sin2);
    let cross = cross * sin2;
    // The second factor is |r∥|²/|r⊥|²; 0/0 only at normal incidence of an index-free "metal".
    let ratio = (sum - cross) / (sum + cross);
    0.5 * (perpendicular + perpendicular * ratio)
}

/// `2 ∫₀¹ f(μ) μ dμ` by Gauss–Legendre quadrature.
pub(crate) fn cosine_average(mut f: impl FnMut(f32) -> f64) -> f64 {
    gauss_legendre::<32>().iter().map(|&(x, weight)| 2.0 * weight * x * f(x as f32)).sum()
}

/// Nodes and weights of the Gauss–Legendre rule with `N` points on `[0, 1]`.
///
/// Newton's iteration on the Legendre polynomial from the asymptotic guess `cos π(i + ¾)/(N + ½)`
/// (Press et al. 2007, *Numerical Recipes*, 3rd ed., section 4.6.1).
pub(crate) fn gauss_legendre<const N: usize>() -> [(f64, f64); N] {
    std::array::from_fn(|i| {
        let n = N as f64;
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut derivative = 1.0;
        // Quadratic convergence from a guess good to 1/N²: six steps reach rounding.
        for _ in 0..6 {
            let (mut p, mut p_before) = (1.0, 0.0);
            for j in 0..N {
                let j = j as f64;
                (p, p_before) = (((2.0 * j + 1.0) * x * p - j * p_before) / (j + 1.0), p);
            }
            derivative = n * (x * p - p_before) / (x * x - 1.0);
            x -= p / derivative;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * derivative * derivative))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_degrees(degrees: f64, eta: f32) -> f32 {
        dielectric_reflectance(degrees.to_radians().cos() as f32, eta)
    }

    /// Oracle: Fresnel's equations in decimal arithmetic.
    #[test]
    fn dielectrics_reflect_by_fresnel() {
        for (eta, expected) in [
            (1.33, 0.020_059_3),
            (1.5, 0.04),
            (2.4173, 0.172_011_5),
            (4.0, 0.36),
            (100.0, 0.960_788_2),
        ] {
            assert!((dielectric_reflectance(1.0, eta) - expected).abs() < 1e-5, "η = {eta}");
            assert!((normal_reflectance(eta) - expected).abs() < 1e-5, "η = {eta}");
        }
        for (degrees, expected) in [
            (30.0, 0.041_522_6),
            (45.0, 0.050_239_9),
            (60.0, 0.089_186_7),
            (75.0, 0.253_060_6),
            (85.0, 0.612_799_6),
            (89.0, 0.904_185),
            (56.309_932_5, 0.073_964_5), // Brewster: half of the perpendicular 0.1479290
        ] {
            assert!((at_degrees(degrees, 1.5) - expected).abs() < 2e-5, "{degrees}°");
        }
        for (degrees, expected) in
            [(30.0, 0.055_190_2), (40.0, 0.245_291_2), (41.0, 0.379_751_3), (41.82, 1.0)]
        {
            assert!((at_degrees(degrees, 1.0 / 1.5) - expected).abs() < 2e-5, "inside, {degrees}°");
        }
    }

    /// At the critical angle, one unit in the last place to either side: 1, or a number close to it.
    #[test]
    fn the_critical_angle_gives_no_nan() {
        for n in [1.1_f32, 1.33, 1.5, 2.4173] {
            let eta = 1.0 / n;
            let critical = (1.0 - 1.0 / (f64::from(n) * f64::from(n))).sqrt() as f32;
            for mu in [critical.next_down(), critical, critical.next_up()] {
                let sin2 = (1.0 - mu) * (1.0 + mu);
                let interface = dielectric(mu, sin2, eta);
                assert!((0.95..=1.0).contains(&interface.reflectance), "n = {n}: {interface:?}");
                assert!((0.0..0.1).contains(&interface.mu_t), "n = {n}: {interface:?}");
            }
        }
    }

    #[test]
    fn equal_indices_make_no_interface() {
        for mu in [0.0, f32::MIN_POSITIVE, 1e-3, 0.5, 1.0] {
            let interface = dielectric(mu, 1.0 - mu * mu, 1.0);
            assert_eq!(interface, Interface { reflectance: 0.0, mu_t: mu });
        }
    }

    /// Oracle: the diffuse averages of glass and water, from outside and from inside.
    #[test]
    fn diffuse_averages_match_their_integrals() {
        for (n, outside, inside) in [
            (1.333, 0.066_405_8, 0.474_590_6),
            (1.5, 0.091_778_0, 0.596_345_8),
            (1.8, 0.134_054_4, 0.732_732_9),
        ] {
            assert!((dielectric_average(n) - outside).abs() < 2e-6, "n = {n}");
            assert!((dielectric_average(1.0 / n) - inside).abs() < 2e-6, "n = {n}");
            // and by brute force, the kink at the critical angle included
            let steps = 200_000;
            let brute: f64 = (0..steps)
                .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
                .map(|mu| 2.0 * mu * f64::from(dielectric_reflectance(mu as f32, 1.0 / n)))
                .sum::<f64>()
                / f64::from(steps);
            assert!((brute - f64::from(inside)).abs() < 1e-5, "n = {n}: {brute}");
        }
    }

    /// Oracle: `|r|²` in complex arithmetic, for n = 0.2 + 3i.
    #[test]
    fn metals_reflect_by_the_complex_fresnel_equations() {
        let metal = ConductorFresnel::Complex { eta: Rgb::splat(0.2), k: Rgb::splat(3.0) };
        for (degrees, expected) in [
            (0.0, 0.923_371_6),
            (45.0, 0.921_319_6),
            (60.0, 0.918_411_1),
            (75.0, 0.925_223_1),
            (85.0, 0.963_598_6),
        ] {
            let f = metal.reflectance(f64::to_radians(degrees).cos() as f32);
            assert!((f.x - expected).abs() < 1e-5 && (f.x - f.z).abs() < 1e-7, "{degrees}°: {f}");
        }
    }

    /// Oracle: a complex index without imaginary part is a dielectric.
    #[test]
    fn a_metal_without_absorption_is_a_dielectric() {
        for eta in [0.5, 1.5, 4.0] {
            let metal = ConductorFresnel::Complex { eta: Rgb::splat(eta), k: Rgb::ZERO };
            for k in 1..=100 {
                let mu = k as f32 / 100.0;
                let (f, expected) = (metal.reflectance(mu).x, dielectric_reflectance(mu, eta));
                assert!((f - expected).abs() < 2e-5, "η = {eta}, μ = {mu}: {f} {expected}");
            }
        }
    }

    /// Oracle: Gauss–Legendre with N points is exact for polynomials of degree 2N − 1.
    #[test]
    fn quadrature_is_exact_for_polynomials() {
        let rule = gauss_legendre::<8>();
        for degree in 0..16 {
            let integral: f64 = rule.iter().map(|&(x, w)| w * x.powi(degree)).sum();
            assert!((integral * f64::from(degree + 1) - 1.0).abs() < 1e-13, "degree {degree}");
        }
    }
}
