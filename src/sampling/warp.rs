//! Maps from the unit square to the domains of light transport, each with its density.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

/// Maps the unit square to the unit disk, keeping areas and neighbourhoods.
///
/// Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square", Journal of Graphics Tools
/// 2(3). The density is `1/π` per unit area.
#[inline]
pub fn square_to_disk(u: Vec2) -> Vec2 {
    let (radius, direction) = concentric(u);
    radius * direction
}

/// The same point as a radius, which may be negative, and a unit vector.
#[inline]
fn concentric(u: Vec2) -> (f32, Vec2) {
    let p = 2.0 * u - 1.0;
    if p.x.abs() > p.y.abs() {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (p.y / p.x));
        (p.x, Vec2::new(cos, sin))
    } else if p.y == 0.0 {
        (0.0, Vec2::X)
    } else {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (p.x / p.y));
        (p.y, Vec2::new(sin, cos))
    }
}

/// Sine and cosine of an angle in `[−π/4, π/4]`.
///
/// Their Taylor series to the powers 9 and 8: what is left out is below `(π/4)¹¹/11! = 2·10⁻⁹` and
/// `(π/4)¹⁰/10! = 2·10⁻⁸`, less than the rounding of the sum.
#[inline]
fn sin_cos_eighth(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = 1.0
        + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5_040.0 + x2 * (1.0 / 362_880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    (x * sin, cos)
}

/// Draws a point of the regular polygon with `blades ≥ 3` corners on the unit circle, one of them
/// on the x axis, evenly by area.
///
/// A triangle of the fan around the centre is chosen by `u.x`, a point of it by what is left of
/// `u.x` and by `u.y`: with `√a` from the centre, so that area grows linearly.
pub fn square_to_polygon(u: Vec2, blades: u32) -> Vec2 {
    let n = blades as f32;
    let scaled = u.x * n;
    let blade = scaled.floor().min(n - 1.0);
    let from_centre = (scaled - blade).min(1.0).sqrt();
    let corner = |k: f32| Vec2::from_angle(k * TAU / n);
    from_centre * corner(blade).lerp(corner(blade + 1.0), u.y)
}

/// Draws a direction around +z with density `cos θ / π` per unit solid angle (Malley's method).
///
/// Returns a unit vector with `z ≥ 0`; at the horizon `z` and the density can be 0, and such a
/// sample carries no energy.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let (radius, direction) = concentric(u);
    // The product keeps the digits of 1 − r² near the rim.
    let z = ((1.0 - radius) * (1.0 + radius)).max(0.0).sqrt();
    (radius * direction).extend(z)
}

/// The density of [`cosine_hemisphere`], per unit solid angle, for a direction with this cosine.
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Draws a direction evenly over the sphere; the density is `1/(4π)` per unit solid angle.
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Draws a direction evenly over the cone around +z with `1 − cos θ_max = one_minus_cos_max`.
///
/// The density is `1/(2π·one_minus_cos_max)` per unit solid angle. Written in `1 − cos θ`, which
/// for a narrow cone keeps all its digits where `cos θ` has lost them.
pub fn uniform_cone(u: Vec2, one_minus_cos_max: f32) -> Vec3 {
    let one_minus_cos = u.x * one_minus_cos_max;
    // sin²θ = (1 − cos θ)(1 + cos θ)
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
    Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

    /// The value which a χ² variable with `degrees` of freedom exceeds with the probability that a
    /// standard normal variable exceeds `normal_quantile`.
    pub(crate) fn chi2_upper_quantile(degrees: usize, normal_quantile: f64) -> f64 {
        let normal = Normal::new(0.0, 1.0).expect("the standard normal distribution is valid");
        let level = normal.cdf(-normal_quantile);
        ChiSquared::new(degrees as f64)
            .expect("a positive number of degrees of freedom")
            .inverse_cdf(1.0 - level)
    }

    fn squares(n: u32) -> impl Iterator<Item = Vec2> {
        (0..n).map(|k| Sampler::new(11, 0, (k, 3), 0).two(0))
    }

    /// Pearson's χ² for `cell` of 64 equally likely cells. Level 1e-6 (normal quantile 4.753), 1000
    /// expected per cell.
    fn chi2_64(cell: impl Fn(Vec2) -> usize) -> f64 {
        let mut counts = [0_u32; 64];
        squares(64_000).for_each(|u| counts[cell(u)] += 1);
        counts.iter().map(|&c| (f64::from(c) - 1000.0).powi(2) / 1000.0).sum()
    }

    fn eighth(x: f32) -> usize {
        ((x * 8.0) as usize).min(7)
    }

    fn turn(y: f32, x: f32) -> f32 {
        (y.atan2(x) / TAU).rem_euclid(1.0)
    }

    /// For each warp the named quantities are uniform under its density.
    #[test]
    fn warps_follow_their_densities() {
        let limit = chi2_upper_quantile(63, 4.753);
        let disk = chi2_64(|u| {
            let p = square_to_disk(u);
            eighth(p.length_squared()) * 8 + eighth(turn(p.y, p.x))
        });
        let cosine = chi2_64(|u| {
            let w = cosine_hemisphere(u);
            eighth(w.z * w.z) * 8 + eighth(turn(w.y, w.x))
        });
        let sphere = chi2_64(|u| {
            let w = uniform_sphere(u);
            eighth(w.z * 0.5 + 0.5) * 8 + eighth(turn(w.y, w.x))
        });
        let cone = chi2_64(|u| {
            let w = uniform_cone(u, 0.25);
            eighth((1.0 - w.z) * 4.0) * 8 + eighth(turn(w.y, w.x))
        });
        for (name, chi2) in [("disk", disk), ("cosine", cosine), ("sphere", sphere), ("cone", cone)]
        {
            assert!(chi2 < limit, "{name}: χ² = {chi2:.1}, limit {limit:.1}");
        }
        // A sampler which is wrong is found: a radius linear in u bunches in the centre.
        let bunched = chi2_64(|u| eighth(u.x * u.x) * 8 + eighth(u.y));
        assert!(bunched > limit, "χ² = {bunched:.1} should exceed {limit:.1}");
    }

    /// Oracle: sine and cosine in f64; two units of rounding.
    #[test]
    fn the_series_agree_with_sine_and_cosine() {
        for k in -1000..=1000 {
            let x = FRAC_PI_4 * k as f32 / 1000.0;
            let (sin, cos) = sin_cos_eighth(x);
            let (exact_sin, exact_cos) = f64::from(x).sin_cos();
            assert!((f64::from(sin) - exact_sin).abs() <= 1.2e-7 * exact_sin.abs(), "sin {x}");
            assert!((f64::from(cos) - exact_cos).abs() <= 1.2e-7, "cos {x}");
        }
    }

    /// Oracles: E[r] = 2/3 and E[r²] = 1/2 on the disk, E[cos θ] = 2/3 under the cosine density.
    #[test]
    fn moments_agree_with_their_closed_forms() {
        let n = 100_000;
        let mean = |f: &dyn Fn(Vec2) -> f32| {
            squares(n).map(|u| f64::from(f(u))).sum::<f64>() / f64::from(n)
        };
        assert!((mean(&|u| square_to_disk(u).length()) - 2.0 / 3.0).abs() < 3e-3);
        assert!((mean(&|u| square_to_disk(u).length_squared()) - 0.5).abs() < 4e-3);
        assert!((mean(&|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 3e-3);
    }

    /// Oracle: the second moment of a regular polygon of circumradius 1 is (2 + cos(2π/n))/6 per
    /// unit area, and every point lies inside all its edges.
    #[test]
    fn polygons_are_filled_evenly() {
        for blades in [3, 5, 6, 8] {
            let n = 100_000;
            let mean: f64 = squares(n)
                .map(|u| f64::from(square_to_polygon(u, blades).length_squared()))
                .sum::<f64>()
                / f64::from(n);
            let angle = std::f64::consts::TAU / f64::from(blades);
            let expected = (2.0 + angle.cos()) / 6.0;
            assert!((mean - expected).abs() < 4e-3, "{blades}: {mean} against {expected}");
            let apothem = (angle / 2.0).cos() as f32 * (1.0 + 1e-6);
            for u in squares(2000) {
                let p = square_to_polygon(u, blades);
                for k in 0..blades {
                    let normal = Vec2::from_angle((k as f32 + 0.5) * TAU / blades as f32);
                    assert!(p.dot(normal) <= apothem);
                }
            }
        }
    }

    /// Half the width of the sun: directions stay in the cone and fill it to its rim.
    #[test]
    fn narrow_cones_keep_their_width() {
        let half = (0.265_f64).to_radians();
        let one_minus_cos = (half.sin().powi(2) / (1.0 + half.cos())) as f32;
        let widest = squares(10_000)
            .map(|u| uniform_cone(u, one_minus_cos).truncate().length())
            .fold(0.0, f32::max);
        let rim = half.sin() as f32;
        assert!(widest <= rim * 1.000_01 && widest > rim * 0.999, "{widest} against {rim}");
    }
}
