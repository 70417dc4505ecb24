//! Colour: the working space, the sRGB transfer function, tone curves.
//!
//! The working space has the primaries of ITU-R BT.709 and the white point D65, and is linear: numbers
//! are proportional to light. Display codes appear only when a file of codes is read or written.

mod blackbody;
pub mod spectrum;
pub mod srgb;
pub mod tone;
pub mod wavelength;

pub use blackbody::{Blackbody, blackbody};

use glam::Vec3;

/// Chromaticities `(x, y)` of the red, green and blue primaries and of the white point D65
/// (ITU-R BT.709-6, table 1, items 1.3 and 1.4).
pub const CHROMATICITIES: [(f32, f32); 4] =
    [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)];

/// Weights of red, green and blue in luminance (ITU-R BT.709-6, table 1, item 3.2, to one more
/// digit, as IEC 61966-2-1 has them).
pub const LUMINANCE_WEIGHTS: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Relative luminance of a linear colour: 1 for white.
#[inline]
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(LUMINANCE_WEIGHTS)
}

/// The factor by which an exposure of so many stops multiplies radiance: `2^stops`.
pub fn exposure_factor(stops: f32) -> f32 {
    stops.exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_has_luminance_one() {
        assert!((luminance(Vec3::ONE) - 1.0).abs() <= f32::EPSILON);
    }

    /// Oracle: the row of the matrix RGB to XYZ which gives Y follows from the chromaticities: the
    /// weights w solve Σ wᵢ·(xᵢ/yᵢ, 1, zᵢ/yᵢ) = (X, 1, Z) of the white.
    #[test]
    fn luminance_weights_follow_from_the_primaries() {
        let xyz = |(x, y): (f32, f32)| {
            glam::DVec3::new(f64::from(x / y), 1.0, f64::from((1.0 - x - y) / y))
        };
        let [r, g, b, white] = CHROMATICITIES.map(xyz);
        let weights = glam::DMat3::from_cols(r, g, b).inverse() * white;
        assert!((weights.as_vec3() - LUMINANCE_WEIGHTS).abs().max_element() < 5.1e-5, "{weights}");
    }

    #[test]
    fn one_stop_doubles() {
        for (stops, factor) in [(0.0, 1.0), (1.0, 2.0), (-3.0, 0.125)] {
            assert!((exposure_factor(stops) / factor - 1.0).abs() <= f32::EPSILON);
        }
    }
}
