//! Where the coordinates of a surface end.
//!
//! An image is looked up between its texels, and a filter looks further around. What it finds beyond an end of the
//! coordinates must be what is there on the surface: the other end where a surface closes, as around a sphere, and
//! nothing where it ends, as at a pole, whose neighbours are not those of the other pole.

/// What lies beyond 0 and 1 of a surface coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Edge {
    /// The coordinate goes on, or nobody says where it ends: images repeat as their `wrap` says.
    #[default]
    Endless,
    /// The surface ends, or comes to a point.
    Border,
    /// 1 is 0 again.
    Seam,
}

/// The edges of both coordinates of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chart {
    /// Of u.
    pub u: Edge,
    /// Of v.
    pub v: Edge,
}

impl Chart {
    /// Nothing is known of it.
    pub const ENDLESS: Self = Self { u: Edge::Endless, v: Edge::Endless };
    /// A face with four sides.
    pub const SQUARE: Self = Self { u: Edge::Border, v: Edge::Border };
    /// Around an axis, between two rims or poles.
    pub const AROUND: Self = Self { u: Edge::Seam, v: Edge::Border };
    /// Around an axis, along a loop.
    pub const TORUS: Self = Self { u: Edge::Seam, v: Edge::Seam };
}
