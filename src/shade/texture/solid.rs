//! Solid textures: functions of the place, from noise.
//!
//! Noise comes from `fastnoise-lite`; what is made of it is here. Octaves which are smaller than the footprint of
//! a sample are replaced by their mean, so that far noise does not flicker (Ebert et al. 2003, *Texturing
//! and Modeling: A Procedural Approach*, 3rd ed., chapter 2, "clamping").

use super::pattern::fade;
use super::point::TexturePoint;
use crate::description::CellFeature;
use fastnoise_lite::{CellularDistanceFunction, CellularReturnType, FastNoiseLite, NoiseType};
use glam::DVec3;
use std::sync::LazyLock;

/// Gradient noise with lattice distance 1 and values in `[−1, 1]` (Perlin 2002, "Improving Noise").
static GRADIENT: LazyLock<FastNoiseLite> = LazyLock::new(|| {
    let mut noise = FastNoiseLite::with_seed(0);
    noise.set_noise_type(Some(NoiseType::Perlin));
    noise.set_frequency(Some(1.0));
    noise
});

/// The mean magnitude of gradient noise, by which turbulence that is too small to be seen is replaced. Measured
/// over a million places.
const MEAN_MAGNITUDE: f32 = 0.2118;

/// How steep gradient noise is along an axis at most: the values of opposite corners of a lattice cell differ by 2, when their
/// gradients lie across the axis, and the weights between them grow by at most 15/8 per unit; times the scale of the
/// library, which makes the greatest value 1.
const STEEPEST: f64 = 2.0 * 1.875 * 0.965;

/// Gradient noise at a place, one of many by `seed`.
#[inline]
fn gradient(p: DVec3, seed: u32) -> f32 {
    // Another part of the same noise.
    let part = |k: u32| f64::from(seed.wrapping_mul(k) >> 12) * 0.731;
    let q = p + DVec3::new(part(0x9E37_79B1), part(0x85EB_CA77), part(0xC2B2_AE3D));
    GRADIENT.get_noise_3d(q.x, q.y, q.z)
}

/// A sum of octaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Octaves {
    pub(super) count: u32,
    pub(super) gain: f32,
    pub(super) turbulence: bool,
    pub(super) seed: u32,
}

impl Octaves {
    /// The sum at a place in units of the largest features, divided by the sum of the strengths:
    /// in `[−1, 1]`, of turbulence in `[0, 1]`. `width` is the footprint in the same units.
    pub(super) fn at(&self, p: DVec3, width: f32) -> f32 {
        let (mut sum, mut total) = (0.0, 0.0);
        let (mut strength, mut frequency) = (1.0_f32, 1.0_f64);
        for octave in 0..self.count {
            let left = fade(width * frequency as f32);
            let seen = if left > 0.0 {
                let noise = gradient(p * frequency, self.seed.wrapping_add(octave));
                if self.turbulence { noise.abs() } else { noise }
            } else {
                0.0
            };
            let mean = if self.turbulence { MEAN_MAGNITUDE } else { 0.0 };
            sum += strength * (mean + (seen - mean) * left);
            total += strength;
            strength *= self.gain;
            frequency *= 2.0;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }
}

impl Octaves {
    /// Bounds of [`Octaves::at`] without a footprint, in a box of this half size around a place.
    pub(super) fn range(&self, middle: DVec3, half: DVec3) -> [f32; 2] {
        let (mut range, mut total) = ([0.0, 0.0], 0.0);
        let (mut strength, mut frequency) = (1.0_f32, 1.0_f64);
        for octave in 0..self.count {
            let reach = (STEEPEST * frequency * half.element_sum()) as f32;
            let [mut low, mut high] = [-1.0_f32, 1.0];
            if reach < 2.0 {
                let here = gradient(middle * frequency, self.seed.wrapping_add(octave));
                (low, high) = (low.max(here - reach), high.min(here + reach));
            }
            if self.turbulence {
                let least = if low < 0.0 && high > 0.0 { 0.0 } else { low.abs().min(high.abs()) };
                (low, high) = (least, low.abs().max(high.abs()));
            }
            range = [range[0] + strength * low, range[1] + strength * high];
            total += strength;
            strength *= self.gain;
            frequency *= 2.0;
        }
        if total > 0.0 { range.map(|end| end / total) } else { range }
    }
}

/// Clouds in `[0, 1]`.
pub(super) fn noise(at: &TexturePoint, size: f32, octaves: &Octaves) -> f32 {
    let value = octaves.at(at.p / f64::from(size), at.width / size);
    if octaves.turbulence { value } else { 0.5 + 0.5 * value }.clamp(0.0, 1.0)
}

/// What of scattered cells is shown, in `[0, 1]`.
pub(super) fn cells(
    at: &TexturePoint,
    size: f32,
    shows: CellFeature,
    jitter: f32,
    seed: u32,
) -> f32 {
    let mut noise = FastNoiseLite::with_seed(seed as i32);
    noise.set_noise_type(Some(NoiseType::Cellular));
    noise.set_frequency(Some(1.0));
    noise.set_cellular_jitter(Some(jitter));
    noise.set_cellular_distance_function(Some(CellularDistanceFunction::Euclidean));
    noise.set_cellular_return_type(Some(match shows {
        CellFeature::Distance => CellularReturnType::Distance,
        CellFeature::Border => CellularReturnType::Distance2Sub,
        CellFeature::Number => CellularReturnType::CellValue,
    }));
    let p = at.p / f64::from(size);
    let value = noise.get_noise_3d(p.x, p.y, p.z);
    // Distances come less 1, numbers in [−1, 1].
    let value = match shows {
        CellFeature::Distance | CellFeature::Border => value + 1.0,
        CellFeature::Number => 0.5 + 0.5 * value,
    };
    let left = fade(at.width / size);
    (0.5 + (value - 0.5) * left).clamp(0.0, 1.0)
}

/// How much of marble is vein.
pub(super) fn marble(
    at: &TexturePoint,
    size: f32,
    distortion: f32,
    sharpness: f32,
    seed: u32,
) -> f32 {
    let (p, width) = (at.p / f64::from(size), at.width / size);
    let octaves = Octaves { count: 6, gain: 0.5, turbulence: true, seed };
    let bent = p.x + f64::from(distortion * octaves.at(p, width));
    let vein = 0.5 + 0.5 * (bent * std::f64::consts::TAU).cos() as f32;
    let mean = 0.5;
    (mean + (vein - mean) * fade(width)).powf(sharpness)
}

/// How much of wood is that of autumn.
pub(super) fn wood(at: &TexturePoint, size: f32, distortion: f32, grain: f32, seed: u32) -> f32 {
    let (p, width) = (at.p / f64::from(size), at.width / size);
    let octaves = Octaves { count: 4, gain: 0.5, turbulence: false, seed };
    // A trunk changes slowly along its axis.
    let bend = octaves.at(p * DVec3::new(0.25, 0.05, 0.25), width * 0.25);
    let ring = p.x.hypot(p.z) + f64::from(distortion * bend);
    let ring = (ring - ring.floor()) as f32;
    // Slowly to the dark of autumn, quickly back to spring.
    let ring = if ring < 0.85 { ring / 0.85 } else { (1.0 - ring) / 0.15 };
    let ring = 0.5 + (ring - 0.5) * fade(width);
    let fibre = 0.5 + 0.5 * octaves.at(p * DVec3::new(8.0, 0.2, 8.0), width * 8.0);
    (ring * (1.0 - grain) + fibre * grain).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    fn place(k: u32) -> DVec3 {
        let s = Sampler::new(3, 0, (k, 0), 0);
        (s.two(0).extend(s.one(2)) - 0.5).as_dvec3() * 200.0
    }

    /// Oracle: the mean magnitude, measured.
    #[test]
    fn turbulence_fades_to_its_mean() {
        let n = 200_000;
        let sum: f64 = (0..n).map(|k| f64::from(gradient(place(k), 7).abs())).sum();
        let mean = sum / f64::from(n);
        assert!((mean - f64::from(MEAN_MAGNITUDE)).abs() < 2e-3, "{mean}");
        let octaves = Octaves { count: 5, gain: 0.5, turbulence: true, seed: 1 };
        assert!((octaves.at(place(1), 100.0) - MEAN_MAGNITUDE).abs() < 1e-6);
    }

    /// Oracle: differences along an axis over a million places.
    #[test]
    fn noise_is_not_steeper_than_its_bound() {
        let h = 1e-4;
        let steepest = (0..1_000_000)
            .map(|k| {
                let p = place(k);
                f64::from((gradient(p + DVec3::X * h, 7) - gradient(p, 7)).abs()) / h
            })
            .fold(0.0, f64::max);
        assert!((0.75 * STEEPEST..STEEPEST).contains(&steepest), "{steepest}");
    }

    /// Noise is continuous, has both signs, stays in its range, and seeds give others.
    #[test]
    fn noise_is_noise() {
        let octaves = |seed| Octaves { count: 4, gain: 0.5, turbulence: false, seed };
        let (mut low, mut high, mut same) = (1.0_f32, -1.0_f32, 0);
        for k in 0..20_000 {
            let p = place(k);
            let value = octaves(1).at(p, 0.0);
            (low, high) = (low.min(value), high.max(value));
            let near = octaves(1).at(p + DVec3::splat(1e-5), 0.0);
            assert!((near - value).abs() < 1e-3, "{p}");
            same += u32::from((octaves(2).at(p, 0.0) - value).abs() < 1e-3);
        }
        assert!(low > -1.0 && low < -0.3 && high < 1.0 && high > 0.3, "{low} to {high}");
        assert!(same < 200, "{same} of 20000 places are the same with another seed");
    }

    /// Oracle: the distance to the nearest lattice point, which without jitter the points of the cells are.
    #[test]
    fn cells_without_jitter_are_a_lattice() {
        for k in 0..2000 {
            let p = place(k);
            let at = TexturePoint { p, ..TexturePoint::at(glam::Vec2::ZERO) };
            let distance = (p - p.round()).length() as f32;
            let value = cells(&at, 1.0, CellFeature::Distance, 0.0, 5);
            assert!((value - distance.min(1.0)).abs() < 1e-5, "{p}: {value} {distance}");
        }
    }

    #[test]
    fn stone_and_wood_stay_in_their_range() {
        for k in 0..5000 {
            let p = place(k);
            for width in [0.0, 0.1, 3.0, f32::INFINITY] {
                let at = TexturePoint { p, width, ..TexturePoint::at(glam::Vec2::ZERO) };
                for value in [marble(&at, 0.7, 1.5, 4.0, 1), wood(&at, 0.02, 0.6, 0.3, 1)] {
                    assert!((0.0..=1.0).contains(&value), "{p} {width}: {value}");
                }
            }
        }
    }
}
