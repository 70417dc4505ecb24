//! Tone curves: from linear radiance without an upper end to what a display can show.
//!
//! [`aces`] and [`reinhard`] return linear light for the display, still to be encoded with
//! [`super::srgb`]. [`agx`] returns display values in `[0, 1]`, for its curve is defined on them.

use super::luminance;
use glam::Vec3;

/// The curve of Narkowicz, fitted to the ACES reference rendering and output transform for sRGB
/// displays, per channel: linear in, linear in `[0, 1]` out.
///
/// Narkowicz 2016, "ACES Filmic Tone Mapping Curve" (his web log, 6 January 2016). As published, the
/// fit is exposed so that 1 comes out near 0.8; for the brightness of ACES itself lower the
/// exposure by 0.74 stops (a factor of 0.6).
pub fn aces(rgb: Vec3) -> Vec3 {
    // Beyond 10⁶ the curve lies above 1 in every case; the limit keeps x² finite in f32.
    let x = rgb.clamp(Vec3::ZERO, Vec3::splat(1e6));
    let curve = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
    curve.min(Vec3::ONE)
}

/// Compresses luminance by `L / (1 + L)` and keeps the ratios between the channels: linear in,
/// linear out. Saturated colours may exceed 1 in one channel, to be clipped by the encoder.
///
/// Reinhard, Stark, Shirley and Ferwerda 2002, "Photographic Tone Reproduction for Digital
/// Images", ACM Trans. Graph. 21(3), eq. 3.
pub fn reinhard(rgb: Vec3) -> Vec3 {
    rgb.max(Vec3::ZERO) / (1.0 + luminance(rgb.max(Vec3::ZERO)))
}

/// Troy Sobotka's AgX, base look: linear in, **display values** in `[0, 1]` out.
///
/// Three steps, after the configuration and the generator that Sobotka published in 2022 ("AgX",
/// an OpenColorIO configuration, and `AgX.py`):
///
/// 1. *Inset*: the colour is mixed with white, as if the primaries lay 20 % nearer to the white
///    point in the chromaticity diagram. Pure hues get a little of the other channels and so run to
///    white, instead of to a pure channel, when they grow bright.
/// 2. *Curve*: log₂ from 10 stops below middle grey (0.18) to 6.5 above is mapped to `[0, 1]`, and a
///    sigmoid with slope 2 at middle grey takes that to display values, 0.18 to ½.
/// 3. *Outset*: the inverse of the inset.
///
/// We evaluate the sigmoid in closed form rather than from the published table of 4096 entries.
pub fn agx(rgb: Vec3) -> Vec3 {
    let inset = mix_with_white(rgb.max(Vec3::ZERO), INSET);
    let curved = inset.map(|channel| sigmoid(log_exposure(channel)));
    // The inverse of `(1 − a)·c + a·(w·c)`: the mixture leaves w·c as it is, since Σw = 1.
    let outset = (curved - INSET * curved.dot(INSET_WHITE)) / (1.0 - INSET);
    outset.clamp(Vec3::ZERO, Vec3::ONE)
}

/// How far the primaries move towards white.
const INSET: f32 = 0.2;

/// What each channel gives to the white it is mixed with: the share of its primary in X + Y + Z of the
/// white point. Moving the primaries of a space along straight lines in the chromaticity diagram,
/// with the white kept, turns into exactly this mixture.
const INSET_WHITE: Vec3 = Vec3::new(0.212_005, 0.392_183, 0.395_812);

fn mix_with_white(rgb: Vec3, share: f32) -> Vec3 {
    (1.0 - share) * rgb + Vec3::splat(share * rgb.dot(INSET_WHITE))
}

/// Stops shown below and above middle grey.
const STOPS_BELOW: f32 = 10.0;
const STOPS_ABOVE: f32 = 6.5;
const MIDDLE_GREY: f32 = 0.18;

/// Logarithm of a linear value, scaled so that the range of stops becomes `[0, 1]`.
fn log_exposure(linear: f32) -> f32 {
    let stops = (linear / MIDDLE_GREY).log2(); // −∞ at 0, which the clamp takes to 0
    ((stops + STOPS_BELOW) / (STOPS_BELOW + STOPS_ABOVE)).clamp(0.0, 1.0)
}

/// The AgX sigmoid: through (0, 0), (x₀, ½) with slope 2, and (1, 1), where x₀ = 10/16.5.
///
/// ```text
/// y = ½ + s·d · (1 + A·|d|ᵖ)^(−1/p),     d = x − x₀,  s = 2
/// ```
///
/// with `p` = 3 below (toe) and 3.25 above (shoulder). `A` follows from the end point `(e, y_e)` of
/// each half: `A·|e − x₀|ᵖ = (s·|e − x₀| / ½)ᵖ − 1`.
fn sigmoid(x: f32) -> f32 {
    let pivot = STOPS_BELOW / (STOPS_BELOW + STOPS_ABOVE);
    let d = x - pivot;
    let (reach, power) = if d < 0.0 { (pivot, 3.0) } else { (1.0 - pivot, 3.25) };
    let slope = 2.0;
    let bend = ((slope * reach / 0.5).powf(power) - 1.0) * (d.abs() / reach).powf(power);
    0.5 + slope * d * (1.0 + bend).powf(-1.0 / power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::CHROMATICITIES;
    use glam::{DMat3, DVec3};

    type Curve = fn(Vec3) -> Vec3;
    const CURVES: [(&str, Curve); 3] = [("aces", aces), ("reinhard", reinhard), ("agx", agx)];

    /// From 2⁻²⁰ to 2²⁰ in eighths of a stop.
    fn exposures() -> impl Iterator<Item = f32> {
        (-160..=160).map(|i| (i as f32 / 8.0).exp2())
    }

    #[test]
    fn black_stays_black_and_nothing_leaves_the_display() {
        for (name, curve) in CURVES {
            assert!(curve(Vec3::ZERO).max_element() < 1e-6, "{name}: {}", curve(Vec3::ZERO));
            for x in exposures().chain([f32::MAX]) {
                let y = curve(Vec3::splat(x));
                assert!(
                    y.is_finite() && y.min_element() >= 0.0 && y.max_element() <= 1.0,
                    "{name}({x}) = {y}"
                );
            }
        }
    }

    #[test]
    fn brighter_grey_never_becomes_darker() {
        for (name, curve) in CURVES {
            let mut last = 0.0;
            for x in exposures() {
                let y = curve(Vec3::splat(x)).y;
                assert!(y >= last - 2.0 * f32::EPSILON, "{name}({x}) = {y} after {last}");
                last = y;
            }
        }
    }

    #[test]
    fn grey_stays_grey() {
        for (name, curve) in CURVES {
            for x in exposures() {
                let y = curve(Vec3::splat(x));
                assert!(y.max_element() - y.min_element() < 2e-6, "{name}({x}) = {y}");
            }
        }
    }

    #[test]
    fn known_points_of_the_curves_are_met() {
        // By hand: 2.54/3.16 at 1, and 0.086724/0.324932 at 0.18.
        assert!((aces(Vec3::ONE).x - 2.54 / 3.16).abs() < 1e-6);
        assert!((aces(Vec3::splat(0.18)).x - 0.086_724 / 0.324_932).abs() < 1e-6);
        assert!((reinhard(Vec3::ONE).y - 0.5).abs() < 1e-6);
        assert!((reinhard(Vec3::new(0.0, 2.0, 0.0)).y - 2.0 / 2.4304).abs() < 1e-6);
        // Middle grey lands on one half, the ends of the range of stops on 0 and 1.
        assert!((agx(Vec3::splat(0.18)).x - 0.5).abs() < 1e-6);
        assert!(agx(Vec3::splat(0.18 * (-10.0_f32).exp2())).x < 1e-6);
        assert!((agx(Vec3::splat(0.18 * 6.5_f32.exp2())).x - 1.0).abs() < 1e-6);
    }

    /// Oracle: the coefficients that others derived from the published generator in machine precision,
    /// `A` = 59.507875 for the toe and 69.862789 for the shoulder.
    #[test]
    fn sigmoid_has_the_published_coefficients() {
        let pivot = 20.0_f64 / 33.0;
        let published = |x: f64| {
            let (a, p) = if x < pivot { (59.507_875, 3.0) } else { (69.862_789, 3.25) };
            let d = x - pivot;
            0.5 + 2.0 * d * (1.0 + a * d.abs().powf(p)).powf(-1.0 / p)
        };
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            let y = f64::from(sigmoid(x as f32));
            assert!((y - published(x)).abs() < 2e-6, "{x}: {y} instead of {}", published(x));
        }
    }

    /// Oracle: primaries moved 20 % towards D65, the matrix to the original space built from both sets of
    /// chromaticities in f64. The published matrix has 0.2120, 0.3922, 0.3958 (times 0.2).
    #[test]
    fn inset_equals_the_matrix_built_from_moved_primaries() {
        let chromaticity = |(x, y): (f32, f32)| {
            let (x, y) = (f64::from(x), f64::from(y));
            DVec3::new(x, y, 1.0 - x - y)
        };
        let [r, g, b, white] = CHROMATICITIES.map(chromaticity);
        let xyz_from_rgb = |primaries: [DVec3; 3]| {
            let unscaled = DMat3::from_cols_array_2d(&primaries.map(|p| p.to_array()));
            unscaled * DMat3::from_diagonal(unscaled.inverse() * (white / white.y))
        };
        let moved = [r, g, b].map(|p| p.lerp(white, f64::from(INSET)));
        let matrix = xyz_from_rgb([r, g, b]).inverse() * xyz_from_rgb(moved);
        for unit in [DVec3::X, DVec3::Y, DVec3::Z] {
            let expected = (matrix * unit).as_vec3();
            let mixed = mix_with_white(unit.as_vec3(), INSET);
            assert!((mixed - expected).abs().max_element() < 1e-4, "{mixed} instead of {expected}");
        }
    }

    #[test]
    fn agx_takes_bright_pure_hues_towards_white() {
        let saturation = |c: Vec3| 1.0 - c.min_element() / c.max_element();
        let dim = saturation(agx(Vec3::new(0.2, 0.0, 0.0)));
        let bright = saturation(agx(Vec3::new(200.0, 0.0, 0.0)));
        assert!(bright < 0.2 * dim, "saturation {dim} dim, {bright} bright");
    }
}
