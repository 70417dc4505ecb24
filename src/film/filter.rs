//! The pixel filter, by importance sampling.
//!
//! A pixel's value is the average of the radiance around its centre, weighted by a filter. Drawing
//! the positions in proportion to that filter gives every sample the weight 1: no weight sums are
//! kept, pixels do not share samples, and the noise of neighbours stays independent (Ernst,
//! Stamminger and Greiner 2006, "Filter Importance Sampling", IEEE Symposium on Interactive Ray
//! Tracing, section 3). It needs a filter which is nowhere negative; all of ours are.
//!
//! All filters are products of one even function per axis. The box has a closed form. The others
//! go through the table [`HalfCdf`]: the cumulative distribution of `|x|`, exact at its nodes, the
//! density taken as linear between them.

use crate::description::Filter;
use glam::Vec2;
use std::f64::consts::PI;

/// Draws film positions around a pixel's centre in proportion to a pixel filter.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    axis: Axis,
}

#[derive(Clone, Debug)]
enum Axis {
    /// Half the side of the box.
    Box(f32),
    Table(HalfCdf),
}

impl FilterSampler {
    /// Prepares a filter whose lengths are positive and finite, as the description has checked.
    pub fn new(filter: &Filter) -> Self {
        let axis = match *filter {
            Filter::Box { radius } => Axis::Box(radius),
            Filter::Gaussian { sigma, radius } => {
                let (sigma, radius) = (f64::from(sigma), f64::from(radius));
                // The uniforms are multiples of 2⁻²⁴. Beyond 6σ lies 2·10⁻⁹ of the area, less than
                // one step: nothing is ever drawn there, and the nodes are better spent inside.
                let reach = radius.min(6.0 * sigma);
                Axis::Table(HalfCdf::new(reach, |x| gaussian(x, sigma)))
            }
            Filter::BlackmanHarris { radius } => {
                let radius = f64::from(radius);
                Axis::Table(HalfCdf::new(radius, |x| blackman_harris(x, radius)))
            }
        };
        Self { axis }
    }

    /// Draws an offset from the pixel's centre, in pixels (x right, y down).
    ///
    /// * `u` — two independent uniforms in `[0, 1)²`. The map is increasing in each of them, so
    ///   that strata stay whole, and odd about `u = ½`: mirrored numbers give mirrored offsets.
    /// * The density per unit area of the film is the filter divided by its integral.
    pub fn sample(&self, u: Vec2) -> Vec2 {
        Vec2::new(self.sample_axis(u.x), self.sample_axis(u.y))
    }

    fn sample_axis(&self, u: f32) -> f32 {
        let centred = 2.0 * u - 1.0; // exact in f32 for multiples of 2⁻²⁴
        match &self.axis {
            Axis::Box(radius) => centred * radius,
            Axis::Table(table) => table.invert(centred.abs()).copysign(centred),
        }
    }
}

/// Cells of the table. The density is linear within a cell, which for a function with second
/// derivative f'' strays by at most `h²/8 · |f''|`: with 1024 cells over 6σ, by 4·10⁻⁶ of the peak.
const CELLS: usize = 1024;

/// The cumulative distribution of `|x|` for an even density on `[−reach, reach]`.
#[derive(Clone, Debug)]
struct HalfCdf {
    /// Width of a cell in pixels.
    step: f32,
    /// Distribution at the nodes `i · step`, from 0 to exactly 1.
    cdf: Box<[f32]>,
    /// Density at the nodes; only ratios within a cell matter.
    density: Box<[f32]>,
}

impl HalfCdf {
    fn new(reach: f64, density: impl Fn(f64) -> f64) -> Self {
        let step = reach / CELLS as f64;
        let mut sums = Vec::with_capacity(CELLS + 1);
        let mut sum = 0.0;
        sums.push(sum);
        for cell in 0..CELLS {
            sum += gauss_legendre_3(cell as f64 * step, step, &density);
            sums.push(sum);
        }
        Self {
            step: step as f32,
            cdf: sums.iter().map(|s| (s / sum) as f32).collect(),
            density: (0..=CELLS).map(|i| density(i as f64 * step) as f32).collect(),
        }
    }

    /// The `|x|` below which the share `v` of the distribution lies, for `v` in `[0, 1]`.
    fn invert(&self, v: f32) -> f32 {
        let cell = self.cdf.partition_point(|&c| c <= v).clamp(1, CELLS) - 1;
        let width = self.cdf[cell + 1] - self.cdf[cell];
        let share = if width > 0.0 { ((v - self.cdf[cell]) / width).min(1.0) } else { 0.5 };
        (cell as f32 + invert_linear(self.density[cell], self.density[cell + 1], share)) * self.step
    }
}

/// Inverts the distribution of a density which runs linearly from `a` at 0 to `b` at 1.
///
/// Solves `(a·t + (b − a)·t²/2) / ((a + b)/2) = share` for `t`, in the form of the quadratic
/// formula that does not cancel (Pharr, Jakob and Humphreys 2023, *Physically Based Rendering*,
/// 4th ed., section 2.3.2 uses the same).
fn invert_linear(a: f32, b: f32, share: f32) -> f32 {
    let root = (a * a + share * (b * b - a * a)).max(0.0).sqrt();
    if a + root > 0.0 { (share * (a + b) / (a + root)).min(1.0) } else { share }
}

/// Integral of `f` over `[start, start + width]` by three points, exact to degree 5.
fn gauss_legendre_3(start: f64, width: f64, f: impl Fn(f64) -> f64) -> f64 {
    let middle = start + 0.5 * width;
    let offset = 0.5 * width * 0.6_f64.sqrt();
    width / 18.0 * (5.0 * f(middle - offset) + 8.0 * f(middle) + 5.0 * f(middle + offset))
}

fn gaussian(x: f64, sigma: f64) -> f64 {
    (-0.5 * (x / sigma).powi(2)).exp()
}

/// The four-term window with its minimum side lobe of −92 dB (Harris 1978, "On the Use of Windows
/// for Harmonic Analysis with the Discrete Fourier Transform", Proc. IEEE 66(1), table 1),
/// centred on 0.
fn blackman_harris(x: f64, radius: f64) -> f64 {
    let phase = PI * x / radius;
    0.35875 + 0.48829 * phase.cos() + 0.14128 * (2.0 * phase).cos() + 0.01168 * (3.0 * phase).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    use statrs::function::erf::erf;
    use std::f64::consts::SQRT_2;

    /// The distribution function of one axis in closed form.
    fn exact_cdf(filter: &Filter, x: f64) -> f64 {
        match *filter {
            Filter::Box { radius } => 0.5 + x / (2.0 * f64::from(radius)),
            Filter::Gaussian { sigma, radius } => {
                let scaled = |x: f64| erf(x / (SQRT_2 * f64::from(sigma)));
                0.5 + 0.5 * scaled(x) / scaled(f64::from(radius))
            }
            Filter::BlackmanHarris { radius } => {
                let phase = PI * x / f64::from(radius);
                let waves = 0.48829 * phase.sin()
                    + 0.14128 / 2.0 * (2.0 * phase).sin()
                    + 0.01168 / 3.0 * (3.0 * phase).sin();
                0.5 + (phase + waves / 0.35875) / (2.0 * PI)
            }
        }
    }

    fn filters() -> [Filter; 7] {
        [
            Filter::Box { radius: 0.5 },
            Filter::Box { radius: 2.0 },
            Filter::default(),
            Filter::Gaussian { sigma: 0.01, radius: 1.5 },
            Filter::Gaussian { sigma: 50.0, radius: 1.5 },
            Filter::BlackmanHarris { radius: 1.5 },
            Filter::BlackmanHarris { radius: 4.0 },
        ]
    }

    /// Oracle: F(F⁻¹(u)) = u with the closed form of F in f64. The table's density error of 4e-6 of
    /// the peak acts over one cell only; the rest is the rounding of cdf differences (2⁻²⁴ each).
    #[test]
    fn tabulated_inverse_agrees_with_the_exact_distribution() {
        for filter in filters() {
            let sampler = FilterSampler::new(&filter);
            for i in 0..100_000 {
                let u = (i as f32 + 0.5) / 100_000.0;
                let x = sampler.sample(Vec2::new(u, 0.5)).x;
                let error = exact_cdf(&filter, f64::from(x)) - f64::from(u);
                assert!(error.abs() < 4e-7, "{filter:?}: F(x({u})) - u = {error:e}");
            }
        }
    }

    #[test]
    fn offsets_stay_inside_the_filter_and_increase_with_u() {
        for filter in filters() {
            let radius = match filter {
                Filter::Box { radius }
                | Filter::Gaussian { radius, .. }
                | Filter::BlackmanHarris { radius } => radius,
            };
            let sampler = FilterSampler::new(&filter);
            let largest_below_one = 1.0 - f32::EPSILON / 2.0;
            let mut last = f32::NEG_INFINITY;
            for u in (0..4096).map(|i| i as f32 / 4096.0).chain([largest_below_one]) {
                let x = sampler.sample(Vec2::splat(u)).x;
                assert!(x >= last && x.abs() <= radius, "{filter:?}: x({u}) = {x} after {last}");
                last = x;
            }
            assert_eq!(sampler.sample(Vec2::splat(0.5)), Vec2::ZERO);
        }
    }

    #[test]
    fn mirrored_numbers_give_mirrored_offsets() {
        let sampler = FilterSampler::new(&Filter::default());
        for i in 1..1024 {
            let u = i as f32 / 1024.0;
            let (left, right) =
                (sampler.sample(Vec2::splat(u)), sampler.sample(Vec2::splat(1.0 - u)));
            assert_eq!(left, -right);
        }
    }

    /// A fixed stream of independent uniforms: splitmix64 (Steele, Lea and Flood 2014).
    fn uniforms(seed: u64) -> impl FnMut() -> f32 {
        let mut state = seed;
        move || {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
        }
    }

    /// Pearson's χ² of positions binned over equal widths against the exact distribution.
    fn p_value(drawn: &Filter, expected: &Filter) -> f64 {
        const BINS: usize = 32;
        const SAMPLES: usize = 200_000;
        let sampler = FilterSampler::new(drawn);
        let mut uniform = uniforms(11);
        let mut counts = [0.0; BINS];
        for _ in 0..SAMPLES {
            let x = sampler.sample(Vec2::new(0.5, uniform())).y;
            let bin = ((f64::from(x) + 1.5) / 3.0 * BINS as f64) as usize;
            counts[bin.min(BINS - 1)] += 1.0;
        }
        let edge = |i: usize| exact_cdf(expected, i as f64 / BINS as f64 * 3.0 - 1.5);
        let (mut chi2, mut cells) = (0.0, 0);
        let (mut pooled_count, mut pooled_mean) = (0.0, 0.0);
        for (bin, count) in counts.iter().enumerate() {
            pooled_count += count;
            pooled_mean += (edge(bin + 1) - edge(bin)) * SAMPLES as f64;
            if pooled_mean >= 5.0 {
                chi2 += (pooled_count - pooled_mean).powi(2) / pooled_mean;
                cells += 1;
                (pooled_count, pooled_mean) = (0.0, 0.0);
            }
        }
        let law = ChiSquared::new(f64::from(cells - 1)).expect("more than one cell");
        1.0 - law.cdf(chi2)
    }

    /// Level 1e-6 for two tests; thin tails are pooled until a cell expects 5 samples.
    #[test]
    fn sampled_positions_follow_the_filter() {
        for filter in [Filter::default(), Filter::BlackmanHarris { radius: 1.5 }] {
            let p = p_value(&filter, &filter);
            assert!(p > 5e-7, "{filter:?}: p = {p:e}");
        }
    }

    #[test]
    fn a_slightly_wider_gaussian_is_told_apart() {
        let wrong = Filter::Gaussian { sigma: 0.52, radius: 1.5 };
        assert!(p_value(&wrong, &Filter::default()) < 1e-9);
    }

    /// Oracle: E[x²] = ∫x²f / ∫f, by quadrature in f64. Stratified u leave an error of O(1/n).
    #[test]
    fn second_moment_equals_that_of_the_density() {
        let sampler = FilterSampler::new(&Filter::BlackmanHarris { radius: 1.5 });
        let n = 100_000;
        let drawn = (0..n)
            .map(|i| f64::from(sampler.sample(Vec2::splat((i as f32 + 0.5) / n as f32)).x).powi(2))
            .sum::<f64>()
            / f64::from(n);
        let h = 1.5 / 10_000.0;
        let moment = |power: i32| {
            let f = |x: f64| x.powi(power) * blackman_harris(x, 1.5);
            (0..10_000).map(|i| gauss_legendre_3(f64::from(i) * h, h, f)).sum::<f64>()
        };
        let exact = moment(2) / moment(0);
        assert!((drawn / exact - 1.0).abs() < 1e-4, "{drawn} instead of {exact}");
    }
}
