//! Settings of photon mapping.

use serde::{Deserialize, Serialize};

/// Where caustics, light which reaches diffuse surfaces over mirrors or through glass, come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Caustics {
    /// From paths which start at the camera and meet the light by chance. No bias; noise without end
    /// where the light is small, and nothing where it is a point.
    #[default]
    Traced,
    /// From photons, with a radius which shrinks from sample to sample.
    Photons,
}

/// How light which comes straight from a lamp is found by `Sppm`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum DirectLight {
    /// By rays towards the lamps: sharp shadows.
    #[default]
    Sampled,
    /// By the photons themselves: blurred, but good where most lamps are hidden.
    Photons,
}

/// How photons around a point are weighted by their distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Kernel {
    /// The same weight everywhere.
    Constant,
    /// Falls linearly to the rim.
    Cone,
    /// Falls quadratically to the rim: the least error of all kernels.
    #[default]
    Epanechnikov,
}

/// How photons are traced and gathered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PhotonSettings {
    /// Photons emitted in each pass; `None` is as many as there are pixels, rounded up to a power of
    /// two and at least 4096, and an eighth of that where they are aimed at what casts caustics, since
    /// so many more of them arrive. Trades time and memory for noise.
    pub per_pass: Option<u32>,
    /// How slowly the radius shrinks, in `(0, 1)`: the noise falls with `passes^−alpha`, the blur with
    /// `passes^(alpha − 1)`. Both together fall fastest at 2/3.
    pub alpha: f32,
    /// Radius of the first pass in pixels at the point. Trades blur (bias) for noise.
    pub radius: f32,
    /// With `Sppm`, photons which suffice in the first pass: where more are found the radius of the pixel begins as small as
    /// holds so many, down to half a pixel; 0 has all begin alike. Trades noise for blur (bias) of
    /// bright caustics.
    pub enough: u32,
    /// Greatest radius of the first pass, as a share of the radius of the scene. Bounds the blur where
    /// pixels are large.
    pub largest_radius: f32,
    /// Photons in an estimate of `PhotonMap`: the radius is that of so many, at most the one above.
    /// Trades noise for blur (bias).
    pub nearest: u32,
    /// With the final gathering of `PhotonMap` one in so many photons makes a place where the irradiance is
    /// computed beforehand, for the gathering's rays to take; 0 has each ray look for its own photons. Trades time
    /// for blur (bias), up to twice that of the radius.
    pub places: u32,
    /// Weight over the disk.
    pub kernel: Kernel,
    /// How `Sppm` finds light which comes straight from a lamp.
    pub direct: DirectLight,
    /// Perceptual roughness from which photons are gathered on a glossy surface; on smoother ones
    /// paths go on as from a mirror. Trades noise of few photons for that of paths.
    pub min_roughness: f32,
    /// Memory for photons, MiB: where a pass would need more it emits fewer.
    pub max_memory: u32,
}

impl Default for PhotonSettings {
    fn default() -> Self {
        Self {
            per_pass: None,
            alpha: 2.0 / 3.0,
            radius: 3.0,
            enough: 16,
            largest_radius: 0.1,
            nearest: 60,
            places: 8,
            kernel: Kernel::default(),
            direct: DirectLight::default(),
            min_roughness: 0.4,
            max_memory: 1024,
        }
    }
}

impl PhotonSettings {
    /// The GGX width from which photons are gathered.
    pub fn min_alpha(&self) -> f32 {
        self.min_roughness * self.min_roughness
    }

    /// Photons of a pass for a picture of this size; `aimed` says whether all go to what casts caustics.
    pub fn emitted(&self, size: (u32, u32), aimed: bool) -> u32 {
        /// Fewer than this leave more work to starting a pass than to its photons.
        const LEAST: u64 = 1 << 12;
        /// As many as are traced in about ten seconds by one core.
        const MOST: u64 = 1 << 22;
        let pixels = u64::from(size.0) * u64::from(size.1);
        let photons = pixels.next_power_of_two() / if aimed { 8 } else { 1 };
        self.per_pass.unwrap_or(photons.clamp(LEAST, MOST) as u32)
    }
}
