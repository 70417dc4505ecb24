//! The colour of what glows.

use super::luminance;
use super::spectrum::{WavelengthSet, color_of, sets};
use super::wavelength::{matching, rec_709};
use crate::description::{Rgb, SpectrumData};
use glam::{DVec3, Vec3};

/// Second radiation constant `hc/k`, nm·K (CODATA 2018).
const C2: f64 = 1.438_776_877e7;

/// The temperature whose colour is nearest to the white of Rec. 709, kelvin.
const WHITE: f64 = 6504.0;

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

/// What a blackbody shines.
#[derive(Clone, Debug, PartialEq)]
pub struct Blackbody {
    /// Its temperature.
    pub kelvin: f32,
    /// Its [colour](blackbody), of luminance 1.
    pub color: Rgb,
    /// By wavelength, relative to that of 6504 K, whose colour is the white of red, green and blue; of luminance 1.
    pub spectrum: SpectrumData,
    /// The values of the spectrum at each set of wavelengths.
    seen: Vec<Vec3>,
}

impl Blackbody {
    /// A blackbody of a temperature.
    pub fn new(kelvin: f32) -> Self {
        let radiance = |nm: f64, kelvin: f64| 1.0 / (C2 / (nm * kelvin)).exp_m1();
        let ratio = |nm: f64| radiance(nm, f64::from(kelvin)) / radiance(nm, WHITE);
        let middle = ratio(560.0);
        let points = |scale: f64| {
            let nm = (0..=35).map(|k| 380.0 + 10.0 * f64::from(k));
            SpectrumData::new(nm.map(|nm| (nm as f32, (ratio(nm) * scale) as f32)).collect())
        };
        let luminance = f64::from(luminance(color_of(&points(1.0 / middle))));
        let spectrum = points(1.0 / (middle * luminance));
        let seen = sets().iter().map(|set| set.of_spectrum(&spectrum)).collect();
        Self { kelvin, color: blackbody(f64::from(kelvin)), spectrum, seen }
    }

    /// What it shines at the wavelengths of a set.
    #[inline]
    pub fn at(&self, set: &WavelengthSet) -> Vec3 {
        self.seen[set.index as usize]
    }
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

    /// By wavelength a blackbody has nearly the colour that it has in red, green and blue, relative to that of 6504 K: not quite,
    /// since a ratio of colours is not the colour of a ratio, and what lies outside of the gamut is not moved. White is flat.
    #[test]
    fn spectra_of_blackbodies_have_their_colours() {
        for (kelvin, precision) in
            [(2700.0, 0.012), (4000.0, 0.012), (6504.0, 1e-5), (9000.0, 0.012)]
        {
            let body = Blackbody::new(kelvin);
            let color = color_of(&body.spectrum);
            assert!((luminance(color) - 1.0).abs() < 1e-5, "{kelvin} K: {color}");
            let expected = body.color / blackbody(WHITE);
            let expected = expected / luminance(expected);
            let off = (color - expected).abs().max_element() / expected.max_element();
            assert!(off < precision, "{kelvin} K: {color}, {expected}");
        }
        let white = Blackbody::new(6504.0).spectrum;
        assert!(white.points().iter().all(|(_, value)| (value - 1.0).abs() < 1e-5));
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
