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

use crate::description::{RenderSettings, Rgb};
use glam::{DVec3, Vec2, Vec3};
use std::ops::Range;

/// One sample of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Radiance arriving at the film, W·m⁻²·sr⁻¹ per channel.
    pub radiance: Rgb,
    /// What the camera ray saw first; `None` where no layer asks for it.
    pub seen: Option<Seen>,
    /// The share of the light from behind everything that would arrive: 0 where the ray has met something, or where
    /// the radiance holds what is behind. Its mean may lie a little outside of `[0, 1]` where a medium is sampled.
    /// Ignored unless the film has an alpha channel.
    pub transmittance: f32,
}

/// What a camera ray sees first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// The surface; `None` where there is none, but the sky.
    pub first_hit: Option<FirstHit>,
    /// Where its place on the film, or that of the direction in the sky, is when the shutter closes, from where it is when
    /// it opens, pixels (x right, y down). 0 where one of these is behind the camera.
    pub motion: Vec2,
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
    /// Number of the object; never 0.
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

impl Tile {
    /// A whole picture of this size.
    pub fn whole((width, height): (u32, u32)) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// What the settings ask for of a picture, as far as the picture goes.
    pub fn rendered(settings: &RenderSettings) -> Self {
        let whole = Self::whole(settings.size);
        settings.region.map_or(whole, |(x0, y0, width, height)| {
            let (x1, y1) = (x0.saturating_add(width), y0.saturating_add(height));
            Self { x0, y0, x1, y1 }.common(whole)
        })
    }

    /// What belongs to both; without pixels where nothing does.
    #[must_use]
    pub fn common(self, other: Self) -> Self {
        let (x0, y0) = (self.x0.max(other.x0), self.y0.max(other.y0));
        let (x1, y1) = (self.x1.min(other.x1), self.y1.min(other.y1));
        Self { x0, y0, x1: x1.max(x0), y1: y1.max(y0) }
    }

    /// Whether some of these rows belong to it.
    pub(crate) fn has_rows(&self, rows: &Range<u32>) -> bool {
        rows.start < self.y1 && self.y0 < rows.end
    }

    /// Whether some of these columns belong to it.
    pub(crate) fn has_columns(&self, columns: &Range<u32>) -> bool {
        columns.start < self.x1 && self.x0 < columns.end
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.x1 - self.x0, self.y1 - self.y0)
    }

    /// The number of pixels.
    pub fn area(&self) -> usize {
        let (width, height) = self.size();
        // Saturation cannot reach the allocator: it turns into its "capacity overflow".
        (width as usize).saturating_mul(height as usize)
    }
}
