//! Which surface coordinates there are, as an image sees them.

use crate::math::{Chart, Edge};
use glam::{DMat2, DVec2, Vec2};

/// The part of the plane of an image that is laid on a surface, between its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    chart: Chart,
    low: DVec2,
    high: DVec2,
}

/// One axis of a [`Domain`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) edge: Edge,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Domain {
    /// All of a surface, before its coordinates are changed.
    pub(super) const fn new(chart: Chart) -> Self {
        Self { chart, low: DVec2::ZERO, high: DVec2::ONE }
    }

    /// The coordinates `m·uv + offset`. Where a turn leaves its edges aslant to the rows of an image, none of that
    /// image ends there.
    pub(super) fn placed(self, m: DMat2, offset: DVec2) -> Self {
        let Chart { u, v } = self.chart;
        let across = m.x_axis.y == 0.0 && m.y_axis.x == 0.0;
        let quarter = m.x_axis.x == 0.0 && m.y_axis.y == 0.0;
        let chart = match (across, quarter) {
            (true, _) => self.chart,
            (_, true) => Chart { u: v, v: u },
            _ => Chart::ENDLESS,
        };
        let (a, b) = (m * self.low + offset, m * self.high + offset);
        Self { chart, low: a.min(b), high: a.max(b) }
    }

    pub(super) fn u(&self) -> Interval {
        Interval { edge: self.chart.u, low: self.low.x, high: self.high.x }
    }

    pub(super) fn v(&self) -> Interval {
        Interval { edge: self.chart.v, low: self.low.y, high: self.high.y }
    }

    /// A point of the surface for one that a step may have taken beyond an edge: the nearest one, or on the other side
    /// of a seam.
    pub(super) fn within(&self, uv: DVec2) -> DVec2 {
        DVec2::new(self.u().within(uv.x), self.v().within(uv.y))
    }

    /// The same for a point of a footprint: what reaches beyond an end is folded back, so that the mean is that over what
    /// lies within.
    pub(super) fn folded(&self, uv: DVec2) -> DVec2 {
        DVec2::new(self.u().folded(uv.x), self.v().folded(uv.y))
    }

    /// The axis of a footprint, not longer than the surface: around a pole it would be without bound, and to go around
    /// once is enough.
    pub(super) fn shortened(&self, axis: Vec2) -> Vec2 {
        Vec2::new(self.u().shortened(axis.x), self.v().shortened(axis.y))
    }
}

impl Interval {
    /// Seen from the other end: `1 − x` for each `x`.
    pub(super) fn flipped(self) -> Self {
        Self { low: 1.0 - self.high, high: 1.0 - self.low, ..self }
    }

    fn length(self) -> f64 {
        self.high - self.low
    }

    fn within(self, x: f64) -> f64 {
        match self.edge {
            Edge::Border => x.clamp(self.low, self.high),
            Edge::Seam if x < self.low || x >= self.high => {
                x - self.length() * ((x - self.low) / self.length()).floor()
            }
            Edge::Endless | Edge::Seam => x,
        }
    }

    fn folded(self, x: f64) -> f64 {
        match self.edge {
            Edge::Border if x < self.low => self.within(2.0 * self.low - x),
            Edge::Border if x > self.high => self.within(2.0 * self.high - x),
            _ => self.within(x),
        }
    }

    fn shortened(self, along: f32) -> f32 {
        let most = self.length() as f32;
        match self.edge {
            Edge::Endless => along,
            Edge::Border => along.clamp(-most, most),
            // An image that is laid around more than once is seen whole by once.
            Edge::Seam => along.clamp(-most.min(1.0), most.min(1.0)),
        }
    }
}

/// The rotation by an angle in degrees; quarter turns to the bit.
pub(super) fn turn(angle_deg: f32) -> DMat2 {
    let angle = f64::from(angle_deg).rem_euclid(360.0);
    let [cos, sin] = match angle {
        0.0 => [1.0, 0.0],
        90.0 => [0.0, 1.0],
        180.0 => [-1.0, 0.0],
        270.0 => [0.0, -1.0],
        _ => {
            let (sin, cos) = angle.to_radians().sin_cos();
            [cos, sin]
        }
    };
    DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos))
}
