//! Where a ray first meets a surface of revolution.
//!
//! The pieces of the profile whose rings the ray passes are asked in the order in which it comes to them. A
//! piece is crossed once or not at all, as its ends say, when the ray is steeper or flatter than it everywhere:
//! with the directions at both ends, between which are all others, and the slopes of the ray at both ends the
//! four changes of the side are then of one sign (see [`Side::tilt`]). Else it is halved, and the halves which
//! the ray cannot meet are dropped. A crossing is found by Newton's method in its bracket.
//!
//! Neighbouring pieces share the bits of their common end, where the side is computed by the same formula: a
//! ray which crosses the profile crosses one of its pieces. On the ray itself counts as outside, so that a
//! profile which begins and ends on the axis is crossed also by the ray along the axis.

use super::meridian::{End, Meridian, Side, recentred};
use crate::math::instructions::{Lanewise, widest};
use crate::math::profile::{Child, MARGIN, MAX_LEVELS, WIDTH};
use crate::math::{Piece, Profile, bracketed_root};
use crate::shape::{LocalHit, LocalRay};
use glam::{DVec2, DVec3};

/// Pending rings: all but one of a node for each level of the deepest tree, and the last.
const MAX_PENDING: usize = (WIDTH - 1) * MAX_LEVELS + 1;
/// Halvings of a piece for one ray. Near a point of contact a few halves remain for each of the 53 bits of the
/// parameter; more are only spent on a ray which lies in the surface.
const MAX_HALVINGS: u32 = 8 * f64::MANTISSA_DIGITS;

/// The search for the nearest hit.
struct Search<'a> {
    profile: &'a Profile,
    ray: Meridian,
    from: f64,
    /// The nearest so far, or the end of the ray.
    to: f64,
    face: Option<u32>,
    margin: f64,
    halvings: u32,
}

/// Whether the ray certainly misses the sphere of this radius around a point of the axis: most rays of a scene
/// do, and this takes no root and no quotient.
///
/// The squared distance of its line times `|d|²` is the difference of two numbers of which neither is larger
/// than `|o|²·|d|²`: each is off by 8 roundings at most where nothing underflows, and so is `r²·|d|²`, which is
/// smaller where this matters. With their differences these are less than the 32 that are allowed.
#[inline]
fn misses(ray: &LocalRay, height: f64, radius: f64) -> bool {
    let o = ray.o - DVec3::Y * height;
    let (size, scale, along) = (o.length_squared(), ray.d.length_squared(), o.dot(ray.d));
    let far = size * scale;
    let precise = size.is_normal() && scale.is_normal() && far.is_normal();
    precise && far - along * along - radius * radius * scale > 16.0 * f64::EPSILON * far
}

/// The nearest hit with `0 < t < t_max`, on the surface or on one of the disks with these rims.
pub(super) fn nearest(
    profile: &Profile,
    caps: [Option<DVec2>; 2],
    ray: &LocalRay,
    t_max: f64,
) -> Option<LocalHit> {
    let (height, radius) = profile.sphere;
    if misses(ray, height, radius) {
        return None;
    }
    let (near, length, shift) = recentred(ray, height);
    let (x, y, z) = (near.o.x, near.o.y - height, near.o.z);
    let room = radius * radius - (x * x + y * y + z * z);
    if room.is_nan() || room < 0.0 {
        return None;
    }
    let half_chord = room.sqrt();
    let (from, to) = ((-half_chord).max(-shift), half_chord.min(t_max * length - shift));
    if from >= to {
        return None;
    }
    let meridian = Meridian::new(&near);
    let margin = profile.error();
    let search = Search { profile, ray: meridian, from, to, face: None, margin, halvings: 0 };
    let mut search = widest(Descent(search));
    for (end, rim) in caps.into_iter().enumerate() {
        if let Some(rim) = rim {
            search.cap(rim, (profile.pieces.len() + end) as u32);
        }
    }
    let t = (search.to + shift) / length;
    search.face.filter(|_| t > 0.0 && t < t_max).map(|face| LocalHit { t, face })
}

/// The way of a search through the tree.
struct Descent<'a>(Search<'a>);

impl<'a> Lanewise for Descent<'a> {
    type Output = Search<'a>;

    #[inline(always)]
    fn run(self) -> Search<'a> {
        let Self(mut search) = self;
        search.descend();
        search
    }
}

impl Search<'_> {
    /// Goes through the tree, nearer rings first.
    #[inline(always)]
    fn descend(&mut self) {
        let (middle, radius) = self.profile.sphere;
        let inverse_unit = 1.0 / radius;
        let narrow = self.ray.narrow(middle, inverse_unit);
        // Rounded outwards: what is met first must not be lost.
        let from = ((self.from * inverse_unit) as f32).next_down();
        let mut to = ((self.to * inverse_unit) as f32).next_up();
        // Where the ray enters a ring yet to be looked into, and what is in it.
        let (mut enters, mut children) = ([0.0_f32; MAX_PENDING], [Child::default(); MAX_PENDING]);
        let mut count = 1;
        enters[0] = from;
        while count > 0 {
            count -= 1;
            if enters[count] > to {
                continue;
            }
            let child = children[count];
            if child.is_piece() {
                self.piece(child);
                to = ((self.to * inverse_unit) as f32).next_up();
                continue;
            }
            let rings = &self.profile.rings[child.index()];
            let found = narrow.passages(rings, from, to);
            let first = count;
            for (ring, &enter) in found.enter.iter().enumerate() {
                if enter == f32::INFINITY {
                    continue;
                }
                let child = rings.children[ring]
                    .on_ways(narrow.q(enter) <= MARGIN, narrow.q(found.leave[ring]) >= -MARGIN);
                // In order, the nearest on top.
                let mut place = count;
                while place > first && enters[place - 1] < enter {
                    (enters[place], children[place]) = (enters[place - 1], children[place - 1]);
                    place -= 1;
                }
                (enters[place], children[place]) = (enter, child);
                count += 1;
            }
        }
    }

    /// Asks a piece whose ring the ray passes.
    #[inline(always)]
    fn piece(&mut self, child: Child) {
        let index = child.index();
        let piece = &self.profile.pieces[index];
        self.halvings = MAX_HALVINGS;
        if self.ray.is_steep() {
            self.side(&self.ray.steep(), index as u32, piece);
            return;
        }
        if child.is_on_way_in() {
            self.side(&self.ray.shallow(-1.0), index as u32, piece);
        }
        if child.is_on_way_out() {
            self.side(&self.ray.shallow(1.0), index as u32, piece);
        }
    }

    /// Looks for crossings of a piece with one way of the ray.
    #[inline]
    fn side<S: Side>(&mut self, side: &S, index: u32, piece: &Piece) {
        let least = side.least_radius();
        let within = (piece.start.x >= least, piece.end.x >= least);
        let start = || end_of(side, 0.0, piece.start, piece.directions[0]);
        let end = || end_of(side, 1.0, piece.end, piece.directions[1]);
        let clipped = || {
            let ends = (piece.start.x - least, piece.end.x - least);
            let u = bracketed_root((0.0, 1.0), ends, |u| {
                let jet = piece.jet(u);
                let value = jet.p.x - least;
                (value, value / jet.d.x)
            });
            end_of(side, u, DVec2::new(least, piece.jet(u).p.y), piece.direction(u))
        };
        let (a, b) = match within {
            (true, true) => (start(), end()),
            (true, false) => (start(), clipped()),
            (false, true) => (clipped(), end()),
            (false, false) => return,
        };
        self.part(side, index, piece, a, b);
    }

    /// Looks for crossings of a part of a piece.
    #[inline]
    fn part<S: Side>(&mut self, side: &S, index: u32, piece: &Piece, a: End, b: End) {
        let [aa, ab, ba, bb] = changes(&a, &b);
        let rises = aa > 0.0 && ab > 0.0 && ba > 0.0 && bb > 0.0;
        let falls = aa < 0.0 && ab < 0.0 && ba < 0.0 && bb < 0.0;
        if rises || falls {
            self.crossing(side, index, piece, &a, &b);
        } else {
            self.halves(side, index, piece, a, b);
        }
    }

    /// Takes the crossing between two ends, if there is one.
    #[inline]
    fn crossing<S: Side>(&mut self, side: &S, index: u32, piece: &Piece, a: &End, b: &End) {
        let unlike = (a.value > 0.0) != (b.value > 0.0);
        if unlike && self.holds(side.level(a.p), side.level(b.p)) {
            let values = (a.value, b.value);
            let u = bracketed_root((a.u, b.u), values, |u| side.along(&piece.jet(u)));
            let sigma = side.sigma(piece.jet(u).p);
            if sigma > self.from && sigma < self.to {
                (self.to, self.face) = (sigma, Some(index));
            }
        }
    }

    /// Looks for crossings of both halves of a part along which the side may change both ways.
    #[inline(never)]
    fn halves<S: Side>(&mut self, side: &S, index: u32, piece: &Piece, a: End, b: End) {
        let middle = f64::midpoint(a.u, b.u);
        if self.halvings == 0 || middle <= a.u || middle >= b.u {
            self.crossing(side, index, piece, &a, &b);
            return;
        }
        // Both ends are too far from 0 to get there and back. The way along a monotone curve is no longer than
        // along the sides of its box.
        let way = (b.p - a.p).abs().element_sum();
        let unlike = (a.value > 0.0) != (b.value > 0.0);
        if !unlike && (a.value + b.value).abs() > greatest_rate(&a, &b) * way {
            return;
        }
        self.halvings -= 1;
        let m = end_of(side, middle, piece.jet(middle).p, piece.direction(middle));
        for (a, b) in [(a, m), (m, b)] {
            if self.ray.passes((a.p, b.p), self.margin, self.from, self.to) {
                self.part(side, index, piece, a, b);
            }
        }
    }

    /// Whether a crossing between two lengths can be of interest. Of a radius near the closest approach the
    /// length is known to the root of rounding, which is less than the margin of a ring.
    #[inline]
    fn holds(&self, a: f64, b: f64) -> bool {
        let slack = self.profile.sphere.1 * f64::from(MARGIN);
        a.max(b) + slack > self.from && a.min(b) - slack < self.to
    }

    /// Asks a disk, by the same sides of its rim as the piece that ends there.
    fn cap(&mut self, rim: DVec2, face: u32) {
        let level = self.ray.steep();
        let sigma = if self.ray.is_steep() {
            (level.value(rim) > 0.0).then(|| level.sigma(rim))
        } else {
            let [to_axis, from_axis] = [-1.0, 1.0].map(|sign| self.ray.shallow(sign));
            let passes = (to_axis.value(rim) > 0.0) != (from_axis.value(rim) > 0.0);
            // Between the two points over the rim, also where the height hardly tells where.
            let over = (to_axis.level(rim), from_axis.level(rim));
            (passes && rim.x >= self.ray.b).then(|| level.sigma(rim).max(over.0).min(over.1))
        };
        if let Some(sigma) = sigma
            && sigma > self.from
            && sigma < self.to
        {
            (self.to, self.face) = (sigma, Some(face));
        }
    }
}

fn end_of<S: Side>(side: &S, u: f64, p: DVec2, direction: DVec2) -> End {
    End { u, p, direction, value: side.value(p), tilt: side.tilt(p) }
}

/// The changes of the side for the directions at both ends and the tilts at both ends. Between the ends they are
/// between these, up to a positive factor: linear in the direction and in the quotient of the tilt.
#[inline]
fn changes(a: &End, b: &End) -> [f64; 4] {
    [
        a.tilt.change(a.direction),
        a.tilt.change(b.direction),
        b.tilt.change(a.direction),
        b.tilt.change(b.direction),
    ]
}

/// Bound between two ends of the change of the value by the length of the way.
fn greatest_rate(a: &End, b: &End) -> f64 {
    let [aa, ab, ba, bb] = changes(a, b).map(f64::abs);
    (aa.max(ab) / a.tilt.scale).max(ba.max(bb) / b.tilt.scale)
}
