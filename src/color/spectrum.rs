//! Colours as spectra, and spectra as colours.
//!
//! A path of a spectral scene carries three wavelengths in place of red, green and blue: one of each third of the spectrum,
//! all of equal weight for the eye. There are [`SETS`] sets of three, which one after another take all of the spectrum, and
//! each sample of a pixel has the next of them, the same for all pixels: what is white has no coloured noise, and comes out
//! white as soon as all had their turn.
//!
//! What a scene says in colours is *uplifted*: a linear combination of three smooth spectra between 0 and 1, which add up to 1
//! everywhere (as in Mallett and Yuksel 2019, "Spectral Primary Decomposition for Rendering with sRGB Reflectance", EGSR). They
//! are those of the least slope in the sense of least squares which give back the colour that they stand for; white is flat.
//!
//! Light of equal energy at all wavelengths is white. A spectrum becomes a colour by the matching functions of
//! [`wavelength`](super::wavelength), each scaled to sum to 1; what lies outside of the gamut has a negative channel.

use super::wavelength::{DrawnWavelength, VISIBLE_NM, spectral_color};
use crate::description::{Rgb, SpectrumData};
use glam::{DVec3, Mat3, Vec3};
use std::sync::OnceLock;

/// How many sets of three wavelengths there are; a power of two.
pub const SETS: u32 = 64;
/// Steps of 1 nm.
const STEPS: usize = 350;
/// Bins of all sets.
const BINS: usize = 3 * SETS as usize;
/// By how many sets the next sample is ahead: of all odd numbers, that with which 8, 16 and 32 samples are whitest.
const STRIDE: u32 = 25;

/// Red's and green's share of the uplifted spectra, from 380 nm every 10 nm; blue has the rest.
const UPLIFT: [(f64, f64); 36] = [
    (0.070_723, 0.000_681),
    (0.071_754, 0.000_394),
    (0.075_257, 0.0),
    (0.079_107, 0.0),
    (0.075_504, 0.0),
    (0.060_589, 0.0),
    (0.039_637, 0.0),
    (0.011_861, 0.0),
    (0.0, 0.026_603),
    (0.0, 0.135_81),
    (0.0, 0.306_209),
    (0.0, 0.503_643),
    (0.0, 0.697_788),
    (0.0, 0.862_41),
    (0.0, 0.971_397),
    (0.0, 1.0),
    (0.0, 1.0),
    (0.0, 1.0),
    (0.0, 1.0),
    (0.0, 0.957_959),
    (0.161_373, 0.773_184),
    (0.571_92, 0.422_787),
    (0.911_912, 0.088_088),
    (1.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.0),
    (1.0, 0.0),
    (0.999_999, 0.0),
    (0.999_273, 0.000_626),
    (0.997_975, 0.001_439),
    (0.997_247, 0.001_875),
    (0.997_056, 0.001_987),
];

/// A part of the spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// Its ends, nm.
    pub nm: (f32, f32),
}

/// Three parts of the spectrum, which a path follows together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WavelengthSet {
    /// Its place among the [`sets`].
    pub index: u32,
    /// The parts, ascending.
    pub bins: [Bin; 3],
    /// From a colour to values at the three.
    pub from_rgb: Mat3,
    /// From values at the three to the colour for which they stand.
    pub to_rgb: Mat3,
}

impl WavelengthSet {
    /// The mean of a spectrum over each of the three, by the weight for the eye.
    pub fn of_spectrum(&self, spectrum: &SpectrumData) -> Vec3 {
        Vec3::from_array(self.bins.map(|bin| {
            let (mut sum, mut total) = (0.0, 0.0);
            each_step(bin.nm, |color, low, high| {
                let weight = weight(&color) * f64::from(high - low);
                sum += weight * f64::from(spectrum.mean(low, high));
                total += weight;
            });
            (sum / total) as f32
        }))
    }

    /// Draws one of the three, and a wavelength of it, by a number in `[0, 1)`.
    pub fn draw(&self, u: f32) -> DrawnWavelength {
        let third = ((3.0 * u) as usize).min(2);
        let (from, to) = self.bins[third].nm;
        let mut weight = Vec3::ZERO;
        weight[third] = 3.0;
        DrawnWavelength {
            nm: from + (to - from) * (3.0 * u - third as f32).clamp(0.0, 1.0),
            weight,
        }
    }

    /// What red, green and blue are at about these wavelengths for something that is known at 610, 550 and 465 nm: straight
    /// lines between them, the same beyond.
    pub fn between(&self, rgb: Rgb) -> Vec3 {
        let known = SpectrumData::new(vec![(465.0, rgb.z), (550.0, rgb.y), (610.0, rgb.x)]);
        self.of_spectrum(&known)
    }
}

/// Colour of each step of 1 nm; each channel sums to 1.
fn matching() -> &'static [DVec3; STEPS] {
    static MATCHING: OnceLock<[DVec3; STEPS]> = OnceLock::new();
    MATCHING.get_or_init(|| {
        let mut colors = [DVec3::ZERO; STEPS];
        for (k, color) in colors.iter_mut().enumerate() {
            *color = spectral_color(VISIBLE_NM.0 + k as f64 + 0.5);
        }
        let total = colors.iter().copied().sum::<DVec3>();
        colors.map(|color| color / total)
    })
}

/// Red's, green's and blue's share of what a colour is uplifted to.
fn uplift(nm: f64) -> DVec3 {
    let place = ((nm - VISIBLE_NM.0) / 10.0).clamp(0.0, 35.0);
    let k = (place as usize).min(34);
    let share = place - k as f64;
    let (a, b) = (UPLIFT[k], UPLIFT[k + 1]);
    let (r, g) = (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share);
    DVec3::new(r, g, 1.0 - r - g)
}

/// The colour of a spectrum, in white light.
pub fn color_of(spectrum: &SpectrumData) -> Rgb {
    let steps = matching().iter().enumerate();
    let seen = steps.map(|(k, color)| {
        let nm = (VISIBLE_NM.0 + k as f64) as f32;
        *color * f64::from(spectrum.mean(nm, nm + 1.0))
    });
    seen.sum::<DVec3>().as_vec3()
}

/// How much a colour weighs for the eye: the magnitudes of its channels.
fn weight(color: &DVec3) -> f64 {
    color.abs().element_sum()
}

/// All sets.
pub fn sets() -> &'static [WavelengthSet; SETS as usize] {
    static ALL: OnceLock<[WavelengthSet; SETS as usize]> = OnceLock::new();
    ALL.get_or_init(|| {
        // Bins weigh the same.
        let total: f64 = matching().iter().map(weight).sum();
        let mut edges = vec![VISIBLE_NM.0];
        let mut before = 0.0;
        for (k, color) in matching().iter().enumerate() {
            let here = weight(color) / total * BINS as f64;
            while edges.len() < BINS && edges.len() as f64 <= before + here {
                let share = (edges.len() as f64 - before) / here;
                edges.push(VISIBLE_NM.0 + k as f64 + share);
            }
            before += here;
        }
        edges.push(VISIBLE_NM.1);
        std::array::from_fn(|set| {
            let bins = [0, 1, 2].map(|third| {
                let bin = set + third * SETS as usize;
                Bin { nm: (edges[bin] as f32, edges[bin + 1] as f32) }
            });
            let (mut seen, mut rows) = ([Vec3::ZERO; 3], [Vec3::ZERO; 3]);
            for (k, bin) in bins.iter().enumerate() {
                let (mut color, mut raised, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
                each_step(bin.nm, |step, low, high| {
                    let (width, nm) = (f64::from(high - low), 0.5 * f64::from(low + high));
                    color += step * width;
                    raised += uplift(nm) * (weight(&step) * width);
                    total += weight(&step) * width;
                });
                seen[k] = (color * f64::from(SETS)).as_vec3();
                rows[k] = (raised / total).as_vec3();
            }
            WavelengthSet {
                index: set as u32,
                bins,
                from_rgb: Mat3::from_cols(rows[0], rows[1], rows[2]).transpose(),
                to_rgb: Mat3::from_cols(seen[0], seen[1], seen[2]),
            }
        })
    })
}

/// Visits the steps of 1 nm that lie in a part of the spectrum, those at its ends cut: colour per nm, and ends in nm.
fn each_step((from, to): (f32, f32), mut visit: impl FnMut(DVec3, f32, f32)) {
    let first = (f64::from(from) - VISIBLE_NM.0) as usize;
    for (k, color) in matching().iter().enumerate().skip(first) {
        let low = (VISIBLE_NM.0 + k as f64) as f32;
        if low >= to {
            break;
        }
        let (a, b) = (low.max(from), (low + 1.0).min(to));
        if b > a {
            visit(*color, a, b);
        }
    }
}

/// The set of a sample.
pub fn set_of(sample: u32) -> usize {
    (sample.wrapping_mul(STRIDE) % SETS) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over all sets of what comes of values at three wavelengths.
    fn mean(values: impl Fn(&WavelengthSet) -> Vec3) -> DVec3 {
        let colors = sets().iter().map(|set| (set.to_rgb * values(set)).as_dvec3());
        colors.sum::<DVec3>() / f64::from(SETS)
    }

    /// Closed forms: white stays white, and every colour is what it was after having been a spectrum; uplifted
    /// spectra are between 0 and 1 and add up to 1.
    #[test]
    fn colours_come_back_from_their_spectra() {
        for set in sets() {
            let white = set.from_rgb * Rgb::ONE;
            assert!((white - 1.0).abs().max_element() < 1e-6, "{white}");
            assert!(set.from_rgb.to_cols_array().iter().all(|v| (-1e-6..=1.0 + 1e-6).contains(v)));
            assert!(set.bins[0].nm.1 < set.bins[1].nm.0 && set.bins[1].nm.1 < set.bins[2].nm.0);
        }
        assert!((mean(|_| Vec3::ONE) - 1.0).abs().max_element() < 1e-6);
        for rgb in [Rgb::X, Rgb::Y, Rgb::Z, Rgb::new(0.8, 0.3, 0.05), Rgb::new(3.0, 5.0, 9.0)] {
            let back = mean(|set| set.from_rgb * rgb);
            // Within a bin the spectrum and the eye are not constant.
            let error = (back - rgb.as_dvec3()).abs().max_element() / f64::from(rgb.max_element());
            assert!(error < 1e-3, "{rgb}: {back}");
        }
    }

    /// The colour of a spectrum is that of its values at all wavelengths of the sets.
    #[test]
    fn spectra_have_the_colour_of_their_wavelengths() {
        for points in [
            vec![(500.0, 0.4)],
            vec![(450.0, 0.0), (550.0, 1.0), (650.0, 0.2)],
            vec![(590.0, 0.0), (610.0, 1.0)],
        ] {
            let spectrum = SpectrumData::new(points);
            let (direct, summed) =
                (color_of(&spectrum).as_dvec3(), mean(|set| set.of_spectrum(&spectrum)));
            assert!((direct - summed).abs().max_element() < 2e-3, "{direct} {summed}");
        }
        assert!(
            (color_of(&SpectrumData::new(vec![(500.0, 0.4)])) - 0.4).abs().max_element() < 1e-6
        );
    }

    /// Samples of a pixel take all sets in turn, and few of them are white within a hundredth already.
    #[test]
    fn samples_take_all_sets() {
        let mut met = [0; SETS as usize];
        (0..2 * SETS).for_each(|sample| met[set_of(sample)] += 1);
        assert!(met.iter().all(|&count| count == 2), "{met:?}");
        for samples in [8, 16, 32, 128] {
            let white = (0..samples).map(|sample| sets()[set_of(sample)].to_rgb * Vec3::ONE);
            let white = white.sum::<Vec3>() / samples as f32;
            assert!((white - 1.0).abs().max_element() < 0.01, "{samples}: {white}");
        }
    }
}
