//! A ray in the half plane (radius, height), where a surface of revolution is its profile.
//!
//! With `σ` the length along the ray, its height is `y = o + δ·σ`, and horizontally it passes the axis at the
//! distance `b`, from where it is `q = c + w·σ` away along its direction: its radius is `ρ = √(b² + q²)`
//! (the reduction to the plane is that of Kajiya 1983, "New Techniques for Ray Tracing Procedurally Defined
//! Objects", ACM Trans. Graph. 2(3), on surfaces of revolution; and of van Wijk 1984, "Ray Tracing Objects
//! Defined by Sweeping Planar Cubic Splines", ACM Trans. Graph. 3(3)). This is one branch of a hyperbola, which
//! the profile crosses where the ray meets the surface. Which side of it a point is on is told in one of two
//! ways, each free of cancellation where it is used and continuous in the slope `δ/w`, 0 included:
//!
//! * [`Steep`], `|δ| ≥ w`: by the radius, `r − ρ(y)`, with `q = c + (w/δ)·(y − o)`;
//! * [`Shallow`], `|δ| < w`: by the height, `o + (δ/w)·(±√(r² − b²) − c) − y`, once for either sign, the way to
//!   the axis and the way from there, which for level rays are one line.
//!
//! Multiplied out, both give Kajiya's polynomial of degree 6, in which the two ways of a nearly level ray are a
//! double root.

use crate::math::Jet;
use crate::math::profile::{Rings, WIDTH};
use crate::shape::LocalRay;
use glam::{DVec2, DVec3};

/// A ray with a unit direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meridian {
    /// Height at σ = 0.
    pub(super) o: f64,
    /// Height per length.
    pub(super) slope: f64,
    inverse_slope: f64,
    inverse_w: f64,
    /// Signed horizontal distance from the closest approach to the axis, at σ = 0 …
    pub(super) c: f64,
    /// … and per length.
    pub(super) w: f64,
    /// Horizontal distance of the closest approach.
    pub(super) b: f64,
}

impl Meridian {
    pub(super) fn new(ray: &LocalRay) -> Self {
        let (p, d) = (ray.o, ray.d);
        // Where the squares vanish the ray has the direction of the axis, to within any rounding.
        let w = (d.x * d.x + d.z * d.z).sqrt();
        // A ray along the axis has the same radius everywhere: any horizontal direction will do.
        let inverse_w = 1.0 / w;
        let along = DVec2::new(d.x, d.z) * inverse_w;
        let along = if w > 0.0 { along } else { DVec2::new(p.x, p.z).normalize_or(DVec2::X) };
        let across = DVec2::new(p.x, p.z);
        Self {
            o: p.y,
            slope: d.y,
            inverse_slope: 1.0 / d.y,
            inverse_w,
            c: across.dot(along),
            w,
            b: across.perp_dot(along).abs(),
        }
    }

    /// Whether the ray may be in the ring between two points, enlarged by `margin`, within `from..to`.
    #[inline]
    pub(super) fn passes(&self, (p, q): (DVec2, DVec2), margin: f64, from: f64, to: f64) -> bool {
        let (least, most) = (p.min(q) - margin, p.max(q) + margin);
        // A level ray has infinite ends, of unlike signs if it is between the heights; no 0·∞, for the ring is
        // larger than what is in it by more than rounding.
        let low = (least.y - self.o) * self.inverse_slope;
        let high = (most.y - self.o) * self.inverse_slope;
        let (enter, leave) = (larger(smaller(low, high), from), smaller(larger(low, high), to));
        let (a, b) = (self.c + self.w * enter, self.c + self.w * leave);
        let (a2, b2) = (a * a, b * b);
        let nearest = if a * b <= 0.0 { 0.0 } else { smaller(a2, b2) };
        let (passed, inner) = (self.b * self.b, least.x.max(0.0));
        enter <= leave
            && passed + larger(a2, b2) >= inner * inner
            && passed + nearest <= most.x * most.x
    }

    /// The ray as the tree of a profile sees it, whose middle has this height; with the inverse of the unit of
    /// the tree.
    pub(super) fn narrow(&self, middle: f64, inverse_unit: f64) -> Narrow {
        let unit = |x: f64| (x * inverse_unit) as f32;
        let b = unit(self.b);
        Narrow {
            o: unit(self.o - middle),
            inverse_slope: self.inverse_slope as f32,
            c: unit(self.c),
            w: self.w as f32,
            b2: b * b,
        }
    }

    pub(super) fn is_steep(&self) -> bool {
        self.slope.abs() >= self.w
    }

    pub(super) fn steep(&self) -> Steep {
        Steep {
            o: self.o,
            c: self.c,
            k: self.w * self.inverse_slope,
            b2: self.b * self.b,
            inverse_slope: self.inverse_slope,
        }
    }

    /// On the way to the axis (`sign` −1) or from there (1).
    pub(super) fn shallow(&self, sign: f64) -> Shallow {
        let kappa = self.slope * self.inverse_w;
        let axis = self.o - kappa * self.c;
        Shallow {
            axis,
            kappa: kappa * sign,
            sign,
            b: self.b,
            c: self.c,
            inverse_w: self.inverse_w,
            o: self.o,
            inverse_slope: self.inverse_slope,
        }
    }
}

/// A ray as the tree of a profile sees it: in `f32`, in units of the sphere around the profile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Narrow {
    o: f32,
    inverse_slope: f32,
    c: f32,
    w: f32,
    b2: f32,
}

/// Between which lengths a ray may be inside of the rings of a node.
pub(super) struct Passages {
    /// Infinite where it cannot be inside.
    pub(super) enter: [f32; WIDTH],
    pub(super) leave: [f32; WIDTH],
}

impl Narrow {
    /// The parts of `from..to` inside of the rings of a node: all in step, so that the compiler makes vectors
    /// of them.
    #[inline(always)]
    #[expect(
        clippy::needless_bitwise_bool,
        reason = "a branch for each ring would undo the vectors"
    )]
    pub(super) fn passages(&self, rings: &Rings, from: f32, to: f32) -> Passages {
        let (mut enter, mut leave) = ([0.0; WIDTH], [0.0; WIDTH]);
        for k in 0..WIDTH {
            let low = (rings.low[k] - self.o) * self.inverse_slope;
            let high = (rings.high[k] - self.o) * self.inverse_slope;
            enter[k] = larger(smaller(low, high), from);
            leave[k] = smaller(larger(low, high), to);
        }
        for k in 0..WIDTH {
            let (a, b) = (self.q(enter[k]), self.q(leave[k]));
            let (a2, b2) = (a * a, b * b);
            let nearest = if a * b <= 0.0 { 0.0 } else { smaller(a2, b2) };
            let meets = (enter[k] <= leave[k])
                & (self.b2 + larger(a2, b2) >= rings.inner[k])
                & (self.b2 + nearest <= rings.outer[k]);
            enter[k] = if meets { enter[k] } else { f32::INFINITY };
        }
        Passages { enter, leave }
    }

    /// Signed distance from the closest approach at a length along the ray.
    #[inline(always)]
    pub(super) fn q(&self, sigma: f32) -> f32 {
        self.c + self.w * sigma
    }
}

/// An end of a part of a piece.
#[derive(Clone, Copy)]
pub(super) struct End {
    /// Parameter of the piece.
    pub(super) u: f64,
    pub(super) p: DVec2,
    /// Unit direction of the piece.
    pub(super) direction: DVec2,
    /// [`Side::value`].
    pub(super) value: f64,
    /// [`Side::tilt`].
    pub(super) tilt: Tilt,
}

/// How the side changes at a point: along a direction `(r', y')` by `(a·r' − b·y')/scale`.
#[derive(Clone, Copy)]
pub(super) struct Tilt {
    pub(super) a: f64,
    pub(super) b: f64,
    /// Not negative; 0 where the change is infinite.
    pub(super) scale: f64,
}

impl Tilt {
    /// `a·r' − b·y'`.
    #[inline]
    pub(super) fn change(&self, direction: DVec2) -> f64 {
        self.a * direction.x - self.b * direction.y
    }
}

/// On which side of a ray points of the half plane are.
pub(super) trait Side {
    /// The ray has no points with a smaller radius.
    fn least_radius(&self) -> f64;
    /// Positive on one side, negative on the other.
    fn value(&self, p: DVec2) -> f64;
    /// How it changes there; the quotient `b/a` changes one way along both coordinates.
    fn tilt(&self, p: DVec2) -> Tilt;
    /// The value along a curve, and that over its derivative.
    fn along(&self, jet: &Jet) -> (f64, f64);
    /// Length along the ray where it is at a point of its own.
    fn sigma(&self, p: DVec2) -> f64;
    /// Length along the ray where it has the coordinate of a point which tells its ways apart: the height, or
    /// the radius.
    fn level(&self, p: DVec2) -> f64;
}

/// A ray which is at each height once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steep {
    o: f64,
    c: f64,
    /// `w/δ`, in [−1, 1].
    k: f64,
    b2: f64,
    inverse_slope: f64,
}

impl Steep {
    #[inline]
    fn q(&self, y: f64) -> f64 {
        self.c + self.k * (y - self.o)
    }
}

impl Side for Steep {
    fn least_radius(&self) -> f64 {
        0.0
    }

    #[inline]
    fn value(&self, p: DVec2) -> f64 {
        let q = self.q(p.y);
        p.x - (self.b2 + q * q).sqrt()
    }

    /// `r' − (k·q/ρ)·y'`.
    #[inline]
    fn tilt(&self, p: DVec2) -> Tilt {
        let q = self.q(p.y);
        let rho = (self.b2 + q * q).sqrt();
        if rho > 0.0 {
            Tilt { a: rho, b: self.k * q, scale: rho }
        } else {
            Tilt { a: 1.0, b: 0.0, scale: 1.0 }
        }
    }

    #[inline]
    fn along(&self, jet: &Jet) -> (f64, f64) {
        let q = self.q(jet.p.y);
        let rho = (self.b2 + q * q).sqrt();
        let value = jet.p.x - rho;
        (value, value * rho / (rho * jet.d.x - self.k * q * jet.d.y))
    }

    #[inline]
    fn sigma(&self, p: DVec2) -> f64 {
        (p.y - self.o) * self.inverse_slope
    }

    #[inline]
    fn level(&self, p: DVec2) -> f64 {
        self.sigma(p)
    }
}

/// One of the two ways of a ray which is at each radius twice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shallow {
    /// Height at the closest approach.
    axis: f64,
    /// Height per `|q|`, in (−1, 1).
    kappa: f64,
    sign: f64,
    b: f64,
    c: f64,
    inverse_w: f64,
    o: f64,
    inverse_slope: f64,
}

impl Shallow {
    /// `|q|` at a radius.
    #[inline]
    fn distance(&self, r: f64) -> f64 {
        ((r - self.b) * (r + self.b)).max(0.0).sqrt()
    }
}

impl Side for Shallow {
    fn least_radius(&self) -> f64 {
        self.b
    }

    #[inline]
    fn value(&self, p: DVec2) -> f64 {
        self.axis + self.kappa * self.distance(p.x) - p.y
    }

    /// `κ·(r/|q|)·r' − y'`: infinite at the closest approach.
    #[inline]
    fn tilt(&self, p: DVec2) -> Tilt {
        let distance = self.distance(p.x);
        if distance > 0.0 {
            Tilt { a: self.kappa * p.x, b: distance, scale: distance }
        } else {
            Tilt { a: self.kappa, b: 0.0, scale: 0.0 }
        }
    }

    #[inline]
    fn along(&self, jet: &Jet) -> (f64, f64) {
        let distance = self.distance(jet.p.x);
        let value = self.axis + self.kappa * distance - jet.p.y;
        (value, value * distance / (self.kappa * jet.p.x * jet.d.x - distance * jet.d.y))
    }

    /// An error `e` of the radius is one of `e·r/(|q|·w)` of the length, one of the height `e/|δ|`.
    #[inline]
    fn sigma(&self, p: DVec2) -> f64 {
        let distance = self.distance(p.x);
        if distance >= self.kappa.abs() * p.x {
            (self.sign * distance - self.c) * self.inverse_w
        } else {
            (p.y - self.o) * self.inverse_slope
        }
    }

    #[inline]
    fn level(&self, p: DVec2) -> f64 {
        (self.sign * self.distance(p.x) - self.c) * self.inverse_w
    }
}

/// The smaller of two numbers; unlike `min`, one instruction, for it need not look for NaN.
#[inline(always)]
fn smaller<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The larger of two numbers.
#[inline(always)]
fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The ray, seen from where it is nearest to a point of the axis, with a unit direction; the length of its
/// direction, and how far its origin was moved, in units of length.
///
/// Coordinates are then of the size of the shape instead of its distance.
pub(super) fn recentred(ray: &LocalRay, height: f64) -> (LocalRay, f64, f64) {
    let length = ray.d.length();
    let d = ray.d / length;
    let shift = (DVec3::Y * height - ray.o).dot(d);
    (LocalRay { o: ray.o + d * shift, d }, length, shift)
}
