//! The ranges of all numbers in a scene file.
//!
//! They are wide: a range ends where a number has no physical meaning, or where 32-bit floating
//! point can no longer hold its square. Each message tells the range.

use super::decode::Report;
use super::outline::Kind;
use super::source::Cursor;
use std::fmt;

/// An interval of numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    min: f64,
    max: f64,
    open_min: bool,
    open_max: bool,
    unit: &'static str,
}

const fn closed(min: f64, max: f64, unit: &'static str) -> Limits {
    Limits { min, max, open_min: false, open_max: false, unit }
}

/// Coordinates, speeds, accelerations: a tenth of a light year is far enough.
pub(super) const COORDINATE: Limits = closed(-1e15, 1e15, "metres");
/// Speeds.
pub(super) const SPEED: Limits = closed(-1e15, 1e15, "metres per second");
/// Accelerations.
pub(super) const ACCELERATION: Limits = closed(-1e15, 1e15, "metres per second squared");
/// Sizes of things, from a hundredth of an atom on.
pub(super) const LENGTH: Limits = closed(1e-12, 1e15, "metres");
/// Lengths which may be zero.
pub(super) const LENGTH_OR_ZERO: Limits = closed(0.0, 1e15, "metres");
/// Angles which may be many turns.
pub(super) const ANGLE: Limits = closed(-1e9, 1e9, "degrees");
/// Factors along an axis.
pub(super) const SCALE: Limits = closed(-1e12, 1e12, "");
/// Weights of the points of a curve; only their ratios count.
pub(super) const WEIGHT: Limits = closed(1e-6, 1e6, "");
/// From which angle surfaces meet in an edge.
pub(super) const CREASE: Limits = closed(0.0, 180.0, "degrees");
/// Directions; only their direction counts.
pub(super) const DIRECTION: Limits = closed(-1e15, 1e15, "");
/// Times of keys.
pub(super) const TIME: Limits = closed(-1e9, 1e9, "seconds");
/// Vertical field of view.
pub(super) const FOV: Limits =
    Limits { min: 0.0, max: 180.0, open_min: true, open_max: true, unit: "degrees" };
/// Shares: albedo, roughness, opacity.
pub(super) const SHARE: Limits = closed(0.0, 1.0, "");
/// Transmittance, of which the logarithm is taken.
pub(super) const TRANSMITTANCE: Limits =
    Limits { min: 0.0, max: 1.0, open_min: true, open_max: false, unit: "" };
/// Index of refraction of a clear medium relative to vacuum.
pub(super) const IOR: Limits = closed(1.0, 10.0, "");
/// Abbe number of a clear medium.
pub(super) const ABBE: Limits = closed(1.0, 1e6, "");
/// Real and imaginary part of a metal's index of refraction.
pub(super) const METAL_INDEX: Limits = closed(0.0, 1000.0, "");
/// Scattering per metre.
pub(super) const COEFFICIENT: Limits = closed(0.0, 1e12, "per metre");
/// Mean cosine of what a medium scatters.
pub(super) const MEAN_COSINE: Limits =
    Limits { min: -1.0, max: 1.0, open_min: true, open_max: true, unit: "" };
/// Temperature of what glows.
pub(super) const TEMPERATURE: Limits = closed(500.0, 1e6, "kelvin");
/// Radiance, intensity, flux: their squares fit into `f32`.
pub(super) const STRENGTH: Limits = closed(0.0, 1e18, "");
/// Half angle of a cone.
pub(super) const CONE: Limits =
    Limits { min: 0.0, max: 180.0, open_min: true, open_max: false, unit: "degrees" };
/// Angular diameter of a distant light.
pub(super) const DIAMETER: Limits =
    Limits { min: 0.0, max: 180.0, open_min: false, open_max: true, unit: "degrees" };
/// Ratio of focal length and diameter of a lens.
pub(super) const F_NUMBER: Limits = closed(1e-3, 1e6, "");
/// Blades of a diaphragm, if it is not round.
pub(super) const BLADES: Limits = closed(3.0, 64.0, "blades (or 0 for a round aperture)");
/// Frames per second.
pub(super) const FPS: Limits =
    Limits { min: 0.0, max: 1e9, open_min: true, open_max: false, unit: "frames per second" };
/// Numbers of frames; they have a place of their own in file names.
pub(super) const FRAME: Limits = closed(-99_999_999.0, 99_999_999.0, "");
/// When the shutter opens and closes.
pub(super) const SHUTTER: Limits = closed(-1e6, 1e6, "frames");
/// Pixels along one side.
pub(super) const PIXELS: Limits = closed(1.0, 65_536.0, "pixels");
/// Pixels of a picture: what a film of about 100 bytes a pixel could fill on a large machine.
pub(super) const AREA: Limits = closed(1.0, 268_435_456.0, "pixels in all");
/// Samples per pixel.
pub(super) const SAMPLES: Limits = closed(1.0, 1e9, "samples");
/// Interactions of a path.
pub(super) const DEPTH: Limits = closed(1.0, 1e6, "interactions");
/// Interactions before Russian roulette.
pub(super) const ROULETTE: Limits = closed(0.0, 1e6, "interactions");
/// What the throughput is multiplied by for roulette.
pub(super) const ROULETTE_GAIN: Limits =
    Limits { min: 0.0, max: 1e9, open_min: true, open_max: false, unit: "" };
/// Side of the groups of pixels which share paths.
pub(super) const GROUP: Limits = closed(1.0, 4.0, "pixels");
/// Anything above zero.
pub(super) const POSITIVE: Limits =
    Limits { min: 0.0, max: 1e18, open_min: true, open_max: false, unit: "" };
/// Photons of a pass, or rays of a final gathering.
pub(super) const PHOTONS: Limits = closed(1.0, 2_147_483_648.0, "photons");
/// Rays of a final gathering.
pub(super) const GATHER: Limits = closed(0.0, 65_536.0, "rays");
/// Share of photons that the progressive radius keeps.
pub(super) const ALPHA: Limits =
    Limits { min: 0.0, max: 1.0, open_min: true, open_max: true, unit: "" };
/// Gather radius in pixels.
pub(super) const RADIUS: Limits =
    Limits { min: 0.0, max: 1e6, open_min: true, open_max: false, unit: "pixels" };
/// Shares which are not 0.
pub(super) const POSITIVE_SHARE: Limits =
    Limits { min: 0.0, max: 1.0, open_min: true, open_max: false, unit: "" };
/// Photons of an estimate.
pub(super) const NEAREST: Limits = closed(1.0, 1_000_000.0, "photons");
/// Photons which suffice in the first pass.
pub(super) const ENOUGH: Limits = closed(0.0, 1_000_000.0, "photons");
/// Photons for each which makes a place.
pub(super) const PLACES: Limits = closed(0.0, 1_000_000.0, "photons");
/// Memory for photons.
pub(super) const MEBIBYTES: Limits = closed(1.0, 1e9, "MiB");
/// Exposure.
pub(super) const STOPS: Limits = closed(-60.0, 60.0, "stops");
/// Radius and width of the pixel filter.
pub(super) const FILTER: Limits =
    Limits { min: 0.0, max: 16.0, open_min: true, open_max: false, unit: "pixels" };
/// Motion tolerance, as a share of the way.
pub(super) const TOLERANCE: Limits =
    Limits { min: 0.0, max: 1e6, open_min: true, open_max: false, unit: "" };
/// Waves per second.
pub(super) const FREQUENCY: Limits =
    Limits { min: 0.0, max: 1e6, open_min: true, open_max: false, unit: "periods per second" };
/// Acceleration of a fall.
pub(super) const GRAVITY: Limits = Limits {
    min: 0.0,
    max: 1e6,
    open_min: true,
    open_max: false,
    unit: "metres per second squared",
};
/// Cells along one side of a grid.
pub(super) const CELLS: Limits = closed(1.0, 65_536.0, "cells");
/// Edge of a checker's field.
pub(super) const UV_LENGTH: Limits = closed(1e-9, 1e15, "in units of uv");
/// Lengths in uv which may be zero.
pub(super) const UV_LENGTH_OR_ZERO: Limits = closed(0.0, 1e15, "in units of uv");
/// Octaves of noise: from 1 m down to an atom.
pub(super) const OCTAVES: Limits = closed(1.0, 32.0, "octaves");
/// How far noise bends a pattern, in units of its size.
pub(super) const DISTORTION: Limits = closed(0.0, 1e6, "");
/// Powers that sharpen a value.
pub(super) const POWER: Limits = closed(1e-3, 1e3, "");
/// Texture coordinates.
pub(super) const UV: Limits = closed(-1e9, 1e9, "");

impl Limits {
    fn contain(&self, value: f64) -> bool {
        let above = if self.open_min { value > self.min } else { value >= self.min };
        let below = if self.open_max { value < self.max } else { value <= self.max };
        above && below
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |x: f64| {
            if x != 0.0 && !(1e-3..1e9).contains(&x.abs()) {
                format!("{x:e}")
            } else {
                x.to_string()
            }
        };
        let more = if self.open_min { "greater than" } else { "at least" };
        let less = if self.open_max { "less than" } else { "at most" };
        write!(f, "{more} {} and {less} {}", number(self.min), number(self.max))?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

/// Reports a number outside its limits.
pub(super) fn number(
    report: &mut Report,
    cursor: &Cursor,
    value: impl Into<f64>,
    limits: &Limits,
) -> bool {
    let value = value.into();
    if limits.contain(value) {
        return true;
    }
    let name = cursor.path.rsplit('.').find(|step| !step.bytes().all(|b| b.is_ascii_digit()));
    let name = name.unwrap_or_default();
    let (code, found) = if value.is_finite() {
        // As written, for 0.9 is not the same in 32 bits.
        let is_word = cursor.node.kind == Kind::Word;
        ("scene::out-of-range", if is_word { cursor.text().to_owned() } else { value.to_string() })
    } else {
        ("scene::not-finite", "not a finite number".to_owned())
    };
    report.at(code, cursor, format!("`{name}` must be {limits}, but is {found}"));
    false
}

/// Reports the components of a vector outside their limits, each at its own place.
pub(super) fn vector(
    report: &mut Report,
    cursor: &Cursor,
    values: &[f64],
    limits: &Limits,
) -> bool {
    let mut fine = true;
    for (index, &value) in values.iter().enumerate() {
        let single = cursor.node.entries.len() != values.len();
        let place = if single { cursor.clone() } else { cursor.nth(index) };
        fine &= number(report, &place, value, limits);
    }
    fine
}

/// [`vector`] for colours.
pub(super) fn color(
    report: &mut Report,
    cursor: &Cursor,
    color: crate::description::Rgb,
    limits: &Limits,
) -> bool {
    vector(report, cursor, &color.to_array().map(f64::from), limits)
}
