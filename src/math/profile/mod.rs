//! Profiles: plane curves which are turned around the axis `r = 0` into a surface.
//!
//! A profile is a chain of rational cubic curves in the half plane (radius, height). It is cut into *pieces*
//! which are monotone in both coordinates and bend one way, so that the box between the ends of a piece holds
//! it, and all its directions lie between those at its ends; a tree of boxes is laid over them in the order of
//! the chain. Neighbouring pieces share the bits of their common end.

mod cut;
mod piece;
mod rings;

pub(crate) use piece::bracketed_root;
pub use piece::{Jet, Piece};
pub(crate) use rings::{Child, MARGIN, MAX_LEVELS, Rings, WIDTH};

use super::{Chart, Cubic};
use glam::DVec2;
use std::f64::consts::PI;

/// What is wrong with a profile.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProfileError {
    /// No surface would come of it.
    #[error("the profile has no extent off its axis")]
    Empty,
    /// The curve crosses the axis.
    #[error("segment {segment} of the profile reaches the radius {radius}")]
    NegativeRadius {
        /// Which curve of the chain, from 0.
        segment: usize,
        /// The least radius found.
        radius: f64,
    },
    /// More pieces than the tree over them can hold.
    #[error("the profile comes to {pieces} pieces, more than 262144")]
    TooLong {
        /// How many it comes to.
        pieces: usize,
    },
    /// A number which is not finite, or a weight which is not positive.
    #[error("segment {segment} of the profile has a point or a weight out of range")]
    OutOfRange {
        /// Which curve of the chain, from 0.
        segment: usize,
    },
}

/// A profile ready to be met by rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Its parts, in order; those on the axis are left out.
    pub pieces: Vec<Piece>,
    /// The tree over them, its root first.
    pub(crate) rings: Vec<Rings>,
    /// Where it begins and ends; `None` for both if that is one place, and for an end on the axis.
    pub open_ends: [Option<DVec2>; 2],
    /// Greatest radius, least and greatest height.
    pub extent: (f64, [f64; 2]),
    /// Height of the middle, and the radius of the sphere around it which holds the whole.
    pub sphere: (f64, f64),
    /// For each piece the area of those before it; the last is the whole.
    pub areas: Vec<f64>,
    /// `π·∫ r² dy` along the profile: what a closed one encloses, positive if it runs with the inside on its
    /// left.
    pub volume: f64,
}

/// Rounding of a coordinate of the profile as a share of its extent: 16 roundings.
const ROUNDINGS: f64 = 16.0 * f64::EPSILON;

impl Profile {
    /// The profile of a chain of curves, each of which begins where the one before ends.
    ///
    /// # Errors
    /// When there is nothing to turn, the curve crosses the axis, or a number is out of range.
    pub fn new(segments: &[Cubic]) -> Result<Self, ProfileError> {
        for (segment, curve) in segments.iter().enumerate() {
            if curve.0.iter().any(|p| !(p.is_finite() && p.z > 0.0)) {
                return Err(ProfileError::OutOfRange { segment });
            }
        }
        let points = || segments.iter().flat_map(Cubic::points);
        let size = points().fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
        let tiny = ROUNDINGS * size;
        let chain = chained(segments, tiny)?;
        if chain.len() > rings::MAX_PIECES {
            return Err(ProfileError::TooLong { pieces: chain.len() });
        }
        let (Some(first), Some(last)) = (chain.first(), chain.last()) else {
            return Err(ProfileError::Empty);
        };
        let off_axis = |p: DVec2| (p.x > 0.0 && first.start != last.end).then_some(p);
        let open_ends = [off_axis(first.start), off_axis(last.end)];
        let kept: Vec<Piece> =
            chain.into_iter().filter(|piece| piece.start.x > 0.0 || piece.end.x > 0.0).collect();
        if kept.is_empty() {
            return Err(ProfileError::Empty);
        }
        Ok(Self::assembled(kept, open_ends, tiny))
    }

    fn assembled(pieces: Vec<Piece>, open_ends: [Option<DVec2>; 2], tiny: f64) -> Self {
        let corners = || pieces.iter().flat_map(|piece| [piece.start, piece.end]);
        let low = corners().fold(f64::INFINITY, |m, p| m.min(p.y));
        let high = corners().fold(f64::NEG_INFINITY, |m, p| m.max(p.y));
        let radius = corners().fold(0.0_f64, |m, p| m.max(p.x));
        let middle = f64::midpoint(low, high);
        // A piece stays inside the box between its ends, but between them it may be farther out than they are.
        let farthest = |piece: &Piece| {
            let (a, b) = (piece.start, piece.end);
            a.x.max(b.x).hypot((a.y - middle).abs().max((b.y - middle).abs()))
        };
        let reach = pieces.iter().map(farthest).fold(0.0, f64::max);
        let mut areas = vec![0.0];
        for piece in &pieces {
            areas.push(areas[areas.len() - 1] + piece.area);
        }
        let volume = pieces.iter().map(Piece::volume).sum();
        let sphere = (middle, reach + 8.0 * tiny);
        let rings = rings::tree(&pieces, sphere);
        Self { pieces, rings, open_ends, extent: (radius, [low, high]), sphere, areas, volume }
    }

    /// Bound of the error, per axis and in its own unit, of points of the surface and of where rays are found
    /// to meet it.
    ///
    /// A point has the rounding of the cubic's coefficients and of its evaluation, a ray seen from the middle
    /// of the profile those of its distance to the axis and of its height; each of them less than 16 roundings
    /// of numbers of the size of the whole.
    pub fn error(&self) -> f64 {
        let (radius, [low, high]) = self.extent;
        2.0 * ROUNDINGS * radius.max(low.abs()).max(high.abs())
    }

    /// 1 if the outside of its surface is to the right of the way along the profile, −1 if to the left; `capped`: its ends
    /// are closed by disks.
    pub fn outward(&self, capped: bool) -> f64 {
        let closed = capped || self.open_ends == [None, None];
        if closed && self.volume < 0.0 { -1.0 } else { 1.0 }
    }

    /// Where the coordinates of its surface end: v at the ends of the profile, unless that is a loop.
    pub fn chart(&self) -> Chart {
        let (first, last) = (&self.pieces[0], &self.pieces[self.pieces.len() - 1]);
        if first.start == last.end { Chart::TORUS } else { Chart::AROUND }
    }

    /// Area of the surface, without ends.
    pub fn area(&self) -> f64 {
        self.areas[self.pieces.len()]
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.pieces.len() * (size_of::<Piece>() + size_of::<f64>())
            + self.rings.len() * size_of::<Rings>()
    }
}

impl Piece {
    /// Its part of `π·∫ r² dy`.
    fn volume(&self) -> f64 {
        PI * self.integral(1.0, |jet| jet.p.x * jet.p.x * jet.d.y)
    }
}

/// The pieces of all segments with common ends.
fn chained(segments: &[Cubic], tiny: f64) -> Result<Vec<Piece>, ProfileError> {
    let mut pieces: Vec<Piece> = Vec::new();
    let mut at: Option<DVec2> = None;
    for (segment, curve) in segments.iter().enumerate() {
        let cuts = cut::pieces(curve, tiny);
        let ends = cuts.iter().flat_map(|cut| [cut.curve.points()[0].x, cut.curve.points()[3].x]);
        let radius = ends.fold(0.0, f64::min);
        if radius < -tiny {
            return Err(ProfileError::NegativeRadius { segment, radius });
        }
        for cut in cuts {
            let [first, _, _, last] = cut.curve.points();
            let inside = |p: DVec2| DVec2::new(if p.x <= tiny { 0.0 } else { p.x }, p.y);
            let (start, end) = (at.unwrap_or(inside(first)), inside(last));
            let v = |t: f64| (segment as f64 + t) / segments.len() as f64;
            pieces.push(Piece::new(&cut, start, end, (v(cut.range.0), v(cut.range.1))));
            at = Some(end);
        }
    }
    // A loop closes to the bit.
    if let (Some(first), Some(last)) = (pieces.first().map(|piece| piece.start), pieces.last_mut())
        && first.distance(last.end) <= tiny
    {
        last.end = first;
    }
    Ok(pieces)
}

#[cfg(test)]
mod tests;
