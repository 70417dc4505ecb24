//! Wavelengths as colours: what a path counts for which follows one of them.
//!
//! Light is carried as red, green and blue. Where it meets glass that disperses it, one wavelength is drawn for the path,
//! which then counts `w(λ)/p(λ)`. The weights `w` are non-negative and integrate to 1 in each channel: where all
//! wavelengths go the same way, the expectation is the picture without dispersion.
//!
//! A pure spectral colour lies outside of what red, green and blue can show. `w` is its colour (CIE 1931, as Wyman, Sloan,
//! Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", *JCGT* 2(2), section 2.2,
//! have it) with white added until no channel is negative: hues are kept in order, and no flat bands of pure
//! primaries arise, as clipping would make them.

use crate::description::Rgb;
use glam::DVec3;
use std::sync::OnceLock;

/// Least and greatest wavelength, nm.
pub const VISIBLE_NM: (f64, f64) = (380.0, 730.0);
/// Bins of 1 nm, in each of which the weight is constant.
const BINS: usize = 350;

/// A wavelength and what a path along it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnWavelength {
    /// nm.
    pub nm: f32,
    /// `w/p`, at most 3 in a channel.
    pub weight: Rgb,
}

struct Table {
    /// `w` of each bin, per bin: a channel's sum is 1.
    weights: [DVec3; BINS],
    /// The probability of all bins before each, and 1.
    sums: [f64; BINS + 1],
}

/// XYZ of light of one wavelength.
pub(super) fn matching(nm: f64) -> DVec3 {
    let lobe = |height: f64, middle: f64, below: f64, above: f64| {
        let width = if nm < middle { below } else { above };
        height * (-0.5 * ((nm - middle) / width).powi(2)).exp()
    };
    DVec3::new(
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7)
            - lobe(0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

/// Linear Rec. 709 of light of one wavelength, outside of the gamut and not normalised.
pub(super) fn spectral_color(nm: f64) -> DVec3 {
    rec_709(matching(nm))
}

/// Linear Rec. 709 from XYZ (IEC 61966-2-1).
pub(super) fn rec_709(xyz: DVec3) -> DVec3 {
    DVec3::new(
        xyz.dot(DVec3::new(3.2406, -1.5372, -0.4986)),
        xyz.dot(DVec3::new(-0.9689, 1.8758, 0.0415)),
        xyz.dot(DVec3::new(0.0557, -0.2040, 1.0570)),
    )
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut weights = [DVec3::ZERO; BINS];
        for (k, weight) in weights.iter_mut().enumerate() {
            let color = spectral_color(VISIBLE_NM.0 + k as f64 + 0.5);
            // Adding white to a colour adds the same to all channels.
            *weight = color - color.min_element().min(0.0);
        }
        let total = weights.iter().copied().sum::<DVec3>();
        for weight in &mut weights {
            *weight /= total;
        }
        let mut sums = [0.0; BINS + 1];
        for k in 0..BINS {
            sums[k + 1] = sums[k] + weights[k].element_sum() / 3.0;
        }
        sums[BINS] = 1.0;
        Table { weights, sums }
    })
}

/// Draws a wavelength by a number in `[0, 1)`, as often as red, green and blue need it.
#[inline]
pub fn draw(u: f32) -> DrawnWavelength {
    let Table { weights, sums } = table();
    let u = f64::from(u);
    let bin = sums.partition_point(|&sum| sum <= u).clamp(1, BINS) - 1;
    let within = (u - sums[bin]) / (sums[bin + 1] - sums[bin]);
    let nm = VISIBLE_NM.0 + bin as f64 + within.clamp(0.0, 1.0);
    let weight = weights[bin] / (weights[bin].element_sum() / 3.0);
    DrawnWavelength { nm: nm as f32, weight: weight.as_vec3() }
}

/// The density of each channel at a wavelength, per nm: what of a white beam is seen there.
pub fn density(nm: f64) -> DVec3 {
    if !(VISIBLE_NM.0..VISIBLE_NM.1).contains(&nm) {
        return DVec3::ZERO;
    }
    table().weights[((nm - VISIBLE_NM.0) as usize).min(BINS - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers over which a mean is taken.
    const N: u32 = 1 << 16;

    /// Closed form: white stays white, and densities of what is drawn are those stated.
    #[test]
    fn white_stays_white() {
        let total: DVec3 = (380..730).map(|nm| density(f64::from(nm) + 0.5)).sum();
        assert!((total - 1.0).abs().max_element() < BINS as f64 * f64::EPSILON, "{total}");
        let drawn = || (0..N).map(|k| draw((k as f32 + 0.5) / N as f32));
        let mean: DVec3 =
            drawn().map(|drawn| drawn.weight.as_dvec3()).sum::<DVec3>() / f64::from(N);
        // At each border of two bins one number may fall on the wrong side, and counts the difference of their weights;
        // f32 rounds numbers and weights.
        let ratio = |k: usize| table().weights[k] / (table().weights[k].element_sum() / 3.0);
        let steps = (1..BINS).map(|k| (ratio(k) - ratio(k - 1)).abs().max_element());
        let border = steps.sum::<f64>() / f64::from(N) + 3.0 * f64::from(f32::EPSILON);
        assert!((mean - 1.0).abs().max_element() < border, "{mean}");
        for (from, to) in [(400.0, 450.0), (450.0, 550.0), (600.0, 650.0)] {
            let inside = |d: &DrawnWavelength| (from..to).contains(&f64::from(d.nm));
            let found: DVec3 = drawn().filter(inside).map(|d| d.weight.as_dvec3()).sum();
            let expected: DVec3 =
                (from as u32..to as u32).map(|nm| density(f64::from(nm) + 0.5)).sum();
            let error = (found / f64::from(N) - expected).abs().max_element();
            // Besides, one number at either end.
            assert!(error < border + 2.0 * 3.0 / f64::from(N), "{from} to {to}: {error}");
        }
        for u in [0.0, 1.0_f32.next_down()] {
            let DrawnWavelength { nm, weight } = draw(u);
            assert!((380.0..=730.0).contains(&nm) && weight.min_element() >= 0.0, "{nm}");
            // A share of a third, in f32.
            assert!(weight.max_element() <= 3.0 * (1.0 + f32::EPSILON));
        }
    }

    /// The colours of the rainbow in their order: hue falls from violet through blue, cyan, green and yellow to red.
    #[test]
    fn hues_run_in_order() {
        let strongest = |nm: f64| {
            let DVec3 { x: r, y: g, z: b } = spectral_color(nm) - spectral_color(nm).min_element();
            let greatest = r.max(g).max(b);
            // Hue in sixths of a turn from red over green to blue.
            if greatest == r {
                (g - b) / greatest
            } else if greatest == g {
                2.0 + (b - r) / greatest
            } else {
                4.0 + (r - g) / greatest
            }
        };
        let hues: Vec<f64> = (45..64).map(|k| strongest(f64::from(10 * k))).collect();
        for pair in hues.windows(2) {
            assert!(pair[1] <= pair[0], "{hues:?}");
        }
        assert!(hues[0] > 3.9 && hues[hues.len() - 1].abs() < 0.2, "from blue to red: {hues:?}");
    }

    /// Closed form: the luminance of equal energy is that of its Y, and its white that of Illuminant E within a hundredth.
    #[test]
    fn matching_functions_integrate_to_one_another() {
        let sum: DVec3 = (360..830).map(|nm| matching(f64::from(nm))).sum();
        assert!((sum.x / sum.y - 1.0).abs() < 0.01 && (sum.z / sum.y - 1.0).abs() < 0.01, "{sum}");
        assert!((sum.y - 106.857).abs() < 1.0, "{sum}");
    }
}
