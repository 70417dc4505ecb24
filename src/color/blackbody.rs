//! The colour of what glows.

use super::luminance;
use super::wavelength::{matching, rec_709};
use glam::{DVec3, Vec3};

/// Second radiation constant `hc/k`, nm·K (CODATA 2018).
const C2: f64 = 1.438_776_877e7;

/// Relative XYZ of a blackbody: Planck's law, summed over 360 to 830 nm. Y is 1.
fn planckian(kelvin: f64) -> DVec3 {
    let radiance = |nm: f64| (nm / 560.0).powi(-5) / (C2 / (nm * kelvin)).exp_m1();
    // Relative to its value in the middle, so that it neither under- nor overflows.
    let middle = radiance(560.0);
    let sum: DVec3 =
        (360..=830).map(f64::from).map(|nm| matching(nm) * (radiance(nm) / middle)).sum();
    sum / sum.y
}

/// Linear colour, of luminance 1, of a blackbody at a temperature. Below some 1900 K it lies outside of what red, green
/// and blue can show; white is added until it does not.
pub fn blackbody(kelvin: f64) -> Vec3 {
    let color = rec_709(planckian(kelvin));
    let inside = (color - color.min_element().min(0.0)).as_vec3();
    inside / luminance(inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: published chromaticities of blackbodies: CIE standard illuminant A is one of 2856 K; the others are from
    /// Wyszecki and Stiles 1982, *Color Science*, 2nd ed., table 1(3.3.8). The analytic matching functions are off by
    /// 3.4e-3 at 2000 K, 1.6e-3 at 2856 K and less than 2e-4 from 6500 K on (measured).
    #[test]
    fn chromaticities_are_those_of_the_planckian_locus() {
        for (kelvin, x, y) in [
            (2000.0, 0.5267, 0.4133),
            (2856.0, 0.4476, 0.4074),
            (4000.0, 0.3805, 0.3768),
            (6500.0, 0.3135, 0.3237),
            (10000.0, 0.2807, 0.2884),
        ] {
            let xyz = planckian(kelvin);
            let (found_x, found_y) = (xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum());
            let off = (found_x - x).hypot(found_y - y);
            assert!(off < 4e-3, "{kelvin} K: {found_x} {found_y}");
        }
    }

    /// Hotter is bluer; all of one luminance, none negative, from embers to stars.
    #[test]
    fn hotter_is_bluer() {
        let mut before = f32::INFINITY;
        for kelvin in [500.0, 1000.0, 2000.0, 3000.0, 5000.0, 7000.0, 1e4, 3e4, 1e6] {
            let color = blackbody(kelvin);
            // The division and the sum round five times.
            assert!((luminance(color) - 1.0).abs() < 5.0 * f32::EPSILON, "{kelvin} K: {color}");
            assert!(color.min_element() >= 0.0 && color.is_finite());
            let warmth = color.x - color.z;
            assert!(warmth < before, "{kelvin} K: {color}");
            before = warmth;
        }
    }
}
