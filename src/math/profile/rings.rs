//! The tree over the pieces of a profile: rings with a rectangular section, eight to a node.
//!
//! Rings are kept in `f32`, in units of the sphere around the profile, with heights from its middle: inside of
//! the sphere no coordinate of a ray is then larger than 1, nor its length from where it is nearest to the
//! middle. They are enlarged by [`MARGIN`], which is more than all rounding of a test in `f32` comes to: a
//! height has 3 roundings, a horizontal distance `c + w·σ` has 5, the sum of squares 3 more, and a radius half
//! of those of its square. With 2⁻²⁴ each these are less than 2⁻²⁰.

use super::Piece;
use glam::DVec2;

/// By how much a ring is larger than what is in it.
pub(crate) const MARGIN: f32 = 1.0 / 524_288.0;
/// Rings of a node.
pub(crate) const WIDTH: usize = 8;
/// Levels of a tree at most.
pub(crate) const MAX_LEVELS: usize = 6;
/// Pieces of a profile at most.
pub(super) const MAX_PIECES: usize = WIDTH.pow(MAX_LEVELS as u32);

/// A node: some rings and what is in them.
#[derive(Clone, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Rings {
    /// Least heights.
    pub(crate) low: [f32; WIDTH],
    /// Greatest heights.
    pub(crate) high: [f32; WIDTH],
    /// Squares of the least radii.
    pub(crate) inner: [f32; WIDTH],
    /// Squares of the greatest radii; −1 where there is no ring.
    pub(crate) outer: [f32; WIDTH],
    /// What is in them.
    pub(crate) children: [Child; WIDTH],
}

/// What is in a ring: a node or a piece, and for a ray which passes the ring on which of its ways; by default
/// the first node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Child(u32);

impl Child {
    const PIECE: u32 = 1 << 31;
    const WAY_IN: u32 = 1 << 30;
    const WAY_OUT: u32 = 1 << 29;

    /// Whether it is a piece of the profile.
    #[inline]
    pub(crate) fn is_piece(self) -> bool {
        self.0 & Self::PIECE != 0
    }

    /// The index of the piece, or of the node.
    #[inline]
    pub(crate) fn index(self) -> usize {
        (self.0 & !(Self::PIECE | Self::WAY_IN | Self::WAY_OUT)) as usize
    }

    /// The same, passed on the way to the axis, or from there, or both.
    #[inline]
    #[must_use]
    pub(crate) fn on_ways(self, way_in: bool, way_out: bool) -> Self {
        let way_in = if way_in { Self::WAY_IN } else { 0 };
        let way_out = if way_out { Self::WAY_OUT } else { 0 };
        Self(self.0 | way_in | way_out)
    }

    /// Whether a ray passes it on its way to the axis.
    #[inline]
    pub(crate) fn is_on_way_in(self) -> bool {
        self.0 & Self::WAY_IN != 0
    }

    /// Whether a ray passes it on its way from the axis.
    #[inline]
    pub(crate) fn is_on_way_out(self) -> bool {
        self.0 & Self::WAY_OUT != 0
    }
}

impl Rings {
    const EMPTY: Self = Self {
        low: [0.0; WIDTH],
        high: [0.0; WIDTH],
        inner: [0.0; WIDTH],
        outer: [-1.0; WIDTH],
        children: [Child(0); WIDTH],
    };
}

/// The tree over the pieces, its root first, in the order of the chain; the sphere is the height of its middle
/// and its radius.
pub(super) fn tree(pieces: &[Piece], sphere: (f64, f64)) -> Vec<Rings> {
    let mut nodes = Vec::new();
    lay(pieces, (0, pieces.len()), sphere, &mut nodes);
    nodes
}

/// Writes the tree over a range of pieces and returns the index of its root.
fn lay(
    pieces: &[Piece],
    (from, to): (usize, usize),
    sphere: (f64, f64),
    nodes: &mut Vec<Rings>,
) -> u32 {
    let index = nodes.len();
    nodes.push(Rings::EMPTY);
    // Full nodes at the bottom: a ray looks into fewer.
    let mut span = 1;
    while span * WIDTH < to - from {
        span *= WIDTH;
    }
    for (part, start) in (from..to).step_by(span).enumerate() {
        let range = (start, to.min(start + span));
        let child = if range.1 - range.0 == 1 {
            Child(range.0 as u32 | Child::PIECE)
        } else {
            Child(lay(pieces, range, sphere, nodes))
        };
        let node = &mut nodes[index];
        node.children[part] = child;
        node.enclose(part, &pieces[range.0..range.1], sphere);
    }
    index as u32
}

impl Rings {
    fn enclose(&mut self, ring: usize, pieces: &[Piece], (middle, radius): (f64, f64)) {
        let corners = || pieces.iter().flat_map(|piece| [piece.start, piece.end]);
        let unit = |p: DVec2| DVec2::new(p.x, p.y - middle) / radius;
        let margin = f64::from(MARGIN);
        let least = unit(corners().fold(DVec2::INFINITY, DVec2::min)) - margin;
        let most = unit(corners().fold(DVec2::NEG_INFINITY, DVec2::max)) + margin;
        self.low[ring] = least.y as f32;
        self.high[ring] = most.y as f32;
        self.inner[ring] = least.x.max(0.0).powi(2) as f32;
        self.outer[ring] = most.x.powi(2) as f32;
    }
}
