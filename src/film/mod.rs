//! Accumulation of radiance samples: pixel filter, sums, variance, auxiliary layers.
//!
//! Every worker fills the [`TileBuffer`] of its own tile; [`Film::merge`] joins it to the film. Tiles do
//! not overlap, so that the order in which they are merged does not show. Several passes over the
//! same tile must be merged in the order of the passes, for floating-point sums have an order.

mod accumulate;
mod filter;
mod moments;
mod planes;

pub use accumulate::{Film, FilmError, TileBuffer};
pub use filter::FilterSampler;
pub use planes::{Plane, PlaneSamples};

use crate::description::Rgb;
use glam::{DVec3, Vec2, Vec3};

/// One sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelSample {
    /// Radiance arriving at the film, W·m⁻²·sr⁻¹ per channel.
    pub radiance: Rgb,
    /// What the camera ray met first, if anything. Ignored unless an auxiliary layer is asked for.
    pub first_hit: Option<FirstHit>,
}

/// The surface which a camera ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Reflectance towards the camera, per channel.
    pub albedo: Rgb,
    /// Unit shading normal in world space, towards the camera.
    pub normal: Vec3,
    /// Distance along the camera's axis, metres.
    pub depth: f32,
    /// World position, metres.
    pub position: DVec3,
    /// Motion on the film from shutter opening to closing, pixels (x right, y down).
    pub motion: Vec2,
    /// Object id, from 1.
    pub object_id: u32,
}

/// A rectangle of pixels: `x0 <= x < x1`, `y0 <= y < y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the type says it")]
pub struct Tile {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}
