//! Values between keys: step, linear and cubic, held or looped.
//!
//! Between the keys `k` and `k+1`, `h` seconds apart, with `s` in `[0, 1]`, the cubic rule is
//! Hermite's: `(2s³−3s²+1)·v₀ + (s³−2s²+s)·h·m₀ + (−2s³+3s²)·v₁ + (s³−s²)·h·m₁`. A key without
//! tangents of its own takes the slope of the chord between its neighbours (Catmull and Rom 1974,
//! "A Class of Local Interpolating Splines"), one-sided at the ends of a held track.
//!
//! Over a span of time a track is taken apart at its keys: between them it is one polynomial of at most the third degree,
//! whose integral Simpson's rule has exactly. A flash between two samples is so never missed, nor a jump smeared.

use crate::description::{Extend, Interpolation, Key, Track};
use crate::math::TimeCurve;
use glam::{DQuat, DVec3};

/// A span of time in which one rule holds.
struct TrackPiece {
    from: f64,
    to: f64,
    /// The key after it.
    after: usize,
    /// By how much it is later than in the turn of the keys.
    shift: f64,
}

/// What a track can hold: values which add and scale, and a rule for the straight line.
pub trait Animated: Copy {
    /// `self·a + other·b`.
    fn combine(self, a: f64, other: Self, b: f64) -> Self;
    /// The value a share `s` of the way to `other`.
    fn lerp(self, other: Self, s: f64) -> Self {
        self.combine(1.0 - s, other, s)
    }
    /// The factor, 1 or −1, which brings this value near `reference`: `q` and `−q` are one rotation.
    fn sign_near(self, _reference: Self) -> f64 {
        1.0
    }
    /// Brings the result of arithmetic back to a valid value.
    fn restored(self) -> Self {
        self
    }
    /// A measure of the difference between two values: the angle in radians for rotations.
    fn distance(self, other: Self) -> f64;
}

impl Animated for f64 {
    fn combine(self, a: f64, other: Self, b: f64) -> Self {
        self * a + other * b
    }
    fn distance(self, other: Self) -> f64 {
        (self - other).abs()
    }
}

impl Animated for DVec3 {
    fn combine(self, a: f64, other: Self, b: f64) -> Self {
        self * a + other * b
    }
    fn distance(self, other: Self) -> f64 {
        (self - other).length()
    }
}

impl Animated for DQuat {
    fn combine(self, a: f64, other: Self, b: f64) -> Self {
        self * a + other * b
    }
    fn lerp(self, other: Self, s: f64) -> Self {
        self.slerp(other, s)
    }
    fn sign_near(self, reference: Self) -> f64 {
        if self.dot(reference) < 0.0 { -1.0 } else { 1.0 }
    }
    fn restored(self) -> Self {
        self.normalize()
    }
    fn distance(self, other: Self) -> f64 {
        let angle = self.angle_between(other);
        angle.min(std::f64::consts::TAU - angle)
    }
}

impl<T: Animated> Track<T> {
    /// The value at `time` seconds.
    ///
    /// # Panics
    /// If the track has no keys, which a description never lets through.
    pub fn at(&self, time: f64) -> T {
        let keys = self.keys.as_slice();
        let first = keys.first().expect("a track has at least one key");
        let last = keys[keys.len() - 1];
        let time = self.wrapped(time);
        // At a jump the later key holds, so that frame n sees what its own key says.
        let after = keys.partition_point(|key| key.time <= time);
        if after == 0 {
            return first.value;
        }
        if after == keys.len() {
            return last.value;
        }
        self.in_piece(after, time)
    }

    /// The value by the rule of one piece: that between the key `after` and the one before it, or what holds before the
    /// first and after the last. At the time of a key this is what the piece comes to there.
    fn in_piece(&self, after: usize, time: f64) -> T {
        let keys = self.keys.as_slice();
        if after == 0 || after == keys.len() {
            return keys[after.saturating_sub(1)].value;
        }
        let (from, to) = (keys[after - 1], keys[after]);
        let h = to.time - from.time;
        let s = (time - from.time) / h;
        match self.interpolation {
            Interpolation::Step => from.value,
            Interpolation::Linear => from.value.lerp(to.value, s),
            Interpolation::Cubic => {
                let (m0, m1) = (self.slope_out(after - 1), self.slope_in(after));
                let sign = to.value.sign_near(from.value);
                let (s2, s3) = (s * s, s * s * s);
                let (w0, w1) = (2.0 * s3 - 3.0 * s2 + 1.0, 3.0 * s2 - 2.0 * s3);
                let values = from.value.combine(w0, to.value, w1 * sign);
                let slopes = m0.combine((s3 - 2.0 * s2 + s) * h, m1, (s3 - s2) * h * sign);
                values.combine(1.0, slopes, 1.0).restored()
            }
        }
    }

    /// The mean rate of the fastest piece, in units of `Animated::distance` per second; a cubic
    /// piece is at most 1.5 times faster than its chord and the slopes at its ends together.
    pub fn fastest(&self) -> f64 {
        let chord =
            |pair: &[Key<T>]| pair[0].value.distance(pair[1].value) / (pair[1].time - pair[0].time);
        let chords = self.keys.windows(2).map(chord).fold(0.0, f64::max);
        let slopes = self
            .keys
            .iter()
            .filter_map(|key| key.tangents)
            .map(|(a, b)| {
                let zero = a.combine(0.0, a, 0.0);
                a.distance(zero).max(b.distance(zero))
            })
            .fold(0.0, f64::max);
        match self.interpolation {
            Interpolation::Step => 0.0,
            Interpolation::Linear => chords,
            Interpolation::Cubic => 1.5 * chords.max(slopes) + slopes,
        }
    }

    fn wrapped(&self, time: f64) -> f64 {
        let start = self.keys[0].time;
        self.period().map_or(time, |period| start + (time - start).rem_euclid(period))
    }

    /// Seconds after which the track repeats.
    fn period(&self) -> Option<f64> {
        let (start, end) = (self.keys[0].time, self.keys[self.keys.len() - 1].time);
        (self.extend == Extend::Loop && end > start).then_some(end - start)
    }

    /// What of the track lies between two times, piece by piece.
    fn pieces(&self, open: f64, close: f64) -> impl Iterator<Item = TrackPiece> {
        let keys = self.keys.as_slice();
        let last = keys.len();
        let (start, period) = (keys[0].time, self.period());
        let turns = period.map_or(0.0, |period| ((open - start) / period).floor());
        let mut shift = turns * period.unwrap_or(0.0);
        let mut after = keys.partition_point(|key| key.time <= open - shift);
        let mut from = open;
        std::iter::from_fn(move || {
            while from < close {
                if period.is_some() && (after == 0 || after == last) {
                    // Rounding can take the opening beyond the end of its turn.
                    shift += if after == last { period.unwrap_or(0.0) } else { 0.0 };
                    after = 1;
                }
                let end = if after < last { keys[after].time + shift } else { close };
                let piece = TrackPiece { from, to: end.min(close), after, shift };
                from = from.max(piece.to);
                after += 1;
                if piece.to > piece.from {
                    return Some(piece);
                }
            }
            None
        })
    }

    fn slope_out(&self, k: usize) -> T {
        self.keys[k].tangents.map_or_else(|| self.chord_slope(k), |(_, out)| out)
    }

    fn slope_in(&self, k: usize) -> T {
        self.keys[k].tangents.map_or_else(|| self.chord_slope(k), |(incoming, _)| incoming)
    }

    /// Slope of the chord between the neighbours of key `k`; around the seam of a loop.
    fn chord_slope(&self, k: usize) -> T {
        let keys = &self.keys;
        let last = keys.len() - 1;
        let looped = self.extend == Extend::Loop && last >= 2;
        let period = keys[last].time - keys[0].time;
        let before = match k {
            0 if looped => (keys[last - 1].value, keys[last - 1].time - period),
            0 => (keys[0].value, keys[0].time),
            k => (keys[k - 1].value, keys[k - 1].time),
        };
        let after = match k {
            k if k == last && looped => (keys[1].value, keys[1].time + period),
            k if k == last => (keys[last].value, keys[last].time),
            k => (keys[k + 1].value, keys[k + 1].time),
        };
        let here = keys[k].value;
        let rate = 1.0 / (after.1 - before.1);
        let (ahead, behind) = (after.0.sign_near(here), before.0.sign_near(here));
        after.0.combine(rate * ahead, before.0, -rate * behind)
    }
}

impl<T: Animated> Track<T> {
    /// The shortest time between two neighbouring keys in a span, of which the ends count as keys, unless it is shorter
    /// than `least` or there is none in the span.
    pub fn shortest_gap(&self, [open, close]: [f64; 2], least: f64) -> Option<f64> {
        // No more than all pieces of one turn and those of a part of one.
        let most = 2 * self.keys.len() + 2;
        let gaps = self.pieces(open, close).take(most).map(|piece| piece.to - piece.from);
        gaps.filter(|gap| *gap >= least && *gap < close - open).reduce(f64::min)
    }
}

impl Track<f64> {
    /// The mean between two times, or the value where they are one.
    pub fn mean(&self, open: f64, close: f64) -> f64 {
        if close <= open {
            return self.at(open);
        }
        let integral = |open: f64, close: f64| {
            self.pieces(open, close).map(|p| self.integral(&p)).sum::<f64>()
        };
        let Some(period) = self.period() else { return integral(open, close) / (close - open) };
        // Whole turns are alike.
        let turns = ((close - open) / period).floor();
        let start = self.keys[0].time;
        let whole = if turns > 0.0 { turns * integral(start, start + period) } else { 0.0 };
        (whole + integral(open + turns * period, close)) / (close - open)
    }

    /// Simpson's rule, which is exact up to the third degree.
    fn integral(&self, piece: &TrackPiece) -> f64 {
        let [a, b] = [piece.from, piece.to].map(|time| time - piece.shift);
        let at = |time: f64| self.in_piece(piece.after, time);
        (piece.to - piece.from) * (at(a) + 4.0 * at(f64::midpoint(a, b)) + at(b)) / 6.0
    }

    /// The track over a shutter as lines: each piece that bends in `segments` of them.
    pub fn curve(&self, open: f64, close: f64, segments: u32) -> TimeCurve {
        if close <= open {
            return TimeCurve::constant(self.at(open));
        }
        let parts = if self.interpolation == Interpolation::Cubic { segments } else { 1 };
        let mut knots = Vec::new();
        for piece in self.pieces(open, close) {
            for k in 0..=parts {
                let time = piece.from + (piece.to - piece.from) * (f64::from(k) / f64::from(parts));
                let value = self.in_piece(piece.after, time - piece.shift);
                knots.push(((time - open) / (close - open), value));
            }
        }
        TimeCurve::through(knots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track<T>(keys: Vec<(f64, T)>, interpolation: Interpolation, extend: Extend) -> Track<T> {
        let keys = keys.into_iter().map(|(time, value)| Key { time, value, tangents: None });
        Track { keys: keys.collect(), interpolation, extend }
    }

    /// Oracle: a parabola is reproduced by Hermite pieces with its own derivatives.
    #[test]
    fn cubic_keys_with_tangents_are_an_exact_parabola() {
        let f = |t: f64| 0.12 + 1.8 * t * (1.0 - t);
        let keys = vec![
            Key { time: 0.0, value: f(0.0), tangents: Some((-1.8, 1.8)) },
            Key { time: 1.0, value: f(1.0), tangents: Some((-1.8, 1.8)) },
        ];
        let track = Track { keys, interpolation: Interpolation::Cubic, extend: Extend::Loop };
        for k in 0..100 {
            let t = f64::from(k) * 0.031;
            assert!((track.at(t) - f(t.rem_euclid(1.0))).abs() < 1e-14, "t = {t}");
        }
    }

    /// Oracle: Catmull–Rom slopes of a straight line are the line, also on uneven keys.
    #[test]
    fn cubic_keys_on_a_line_stay_on_it() {
        let line = |t: f64| 3.0 - 2.0 * t;
        let keys = [0.0, 0.5, 2.0, 2.25].map(|t| (t, line(t))).to_vec();
        let track = track(keys, Interpolation::Cubic, Extend::Hold);
        for k in 0..=90 {
            let t = f64::from(k) / 40.0;
            assert!((track.at(t) - line(t)).abs() < 1e-14);
        }
        assert_eq!(track.at(-5.0), line(0.0));
        assert_eq!(track.at(9.0), line(2.25));
    }

    /// A step holds until the time of the next key and changes exactly there.
    #[test]
    fn step_changes_at_the_key() {
        let track = track(vec![(0.0, 1.0), (1.0, 2.0)], Interpolation::Step, Extend::Hold);
        assert_eq!(track.at(1.0_f64.next_down()), 1.0);
        assert_eq!(track.at(1.0), 2.0);
    }

    /// Oracle: slerp between two rotations about one axis has the interpolated angle; the shorter
    /// way is taken when the second key is written with the opposite sign.
    #[test]
    fn rotations_take_the_shorter_arc_at_constant_speed() {
        let q = |angle: f64| DQuat::from_axis_angle(DVec3::Y, angle);
        for sign in [1.0, -1.0] {
            let keys = vec![(0.0, q(0.2)), (1.0, q(1.4) * sign)];
            for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
                let track = track(keys.clone(), interpolation, Extend::Hold);
                let half = track.at(0.5);
                assert!(half.distance(q(0.8)) < 1e-7, "{interpolation:?}: {half}");
            }
        }
    }

    /// A looped track has no kink at its seam: the slope of both sides is that of the neighbours.
    #[test]
    fn loops_are_smooth_across_the_seam() {
        let keys = (0..=8).map(|k| {
            let t = f64::from(k) / 8.0;
            (t, (t * std::f64::consts::TAU).sin())
        });
        let track = track(keys.collect(), Interpolation::Cubic, Extend::Loop);
        let h = 1e-6;
        let left = (track.at(1.0 - h) - track.at(1.0 - 2.0 * h)) / h;
        let right = (track.at(1.0 + 2.0 * h) - track.at(1.0 + h)) / h;
        assert!((left - right).abs() < 1e-3, "{left} against {right}");
    }

    /// Oracle: sums and integrals by hand. Flashes as short as a hundredth of the shutter and less, jumps anywhere, cubics,
    /// loops of many turns, and the time before and after all keys.
    #[test]
    fn means_are_integrals_whatever_is_between() {
        use crate::description::Extend::{Hold, Loop};
        use Interpolation::{Cubic, Linear, Step};
        for (open, shutter) in [(0.0, 1.0), (0.0, 1.0 / 48.0), (-0.3, 0.7), (1e3, 0.02)] {
            let at = |share: f64| open + share * shutter;
            for width in [0.5, 0.05, 0.01, 1e-4, 1e-6] {
                for middle in [0.5, 0.263, 0.74] {
                    let (a, b) = (at(middle - 0.5 * width), at(middle + 0.5 * width));
                    // One of area 1, as a step and as a triangle.
                    let high = 1.0 / width;
                    let flash = track(vec![(a - 9.0, 0.0), (a, high), (b, 0.0)], Step, Hold);
                    let peak = vec![(a, 0.0), (at(middle), 2.0 * high), (b, 0.0)];
                    let triangle = track(peak, Linear, Hold);
                    for track in [flash, triangle] {
                        let mean = track.mean(open, open + shutter);
                        // The times of its keys are rounded.
                        let scale = open.abs() + shutter;
                        let allowed = 1e-12 + 4.0 * scale * f64::EPSILON / (width * shutter);
                        assert!((mean - 1.0).abs() < allowed, "{width} {middle}: {mean}");
                    }
                }
            }
            let step = track(vec![(open - 1.0, 0.5), (at(0.5), 1.5)], Step, Hold);
            assert!((step.mean(open, at(1.0)) - 1.0).abs() < 1e-12 + 1e-15 * open.abs() / shutter);
        }
        // ∫ 1.8 t (1 − t) + 0.12 over the unit interval is 0.42.
        let tangents = Some((-1.8, 1.8));
        let keys = [0.0, 1.0].map(|time| Key { time, value: 0.12, tangents }).to_vec();
        let parabola = Track { keys, interpolation: Cubic, extend: Loop };
        let part = |t: f64| 0.12 * t + 0.9 * t * t - 0.6 * t * t * t;
        assert!((parabola.mean(0.0, 1.0) - 0.42).abs() < 1e-15);
        assert!((parabola.mean(-7.0, 1e6) - 0.42).abs() < 1e-12);
        assert!((parabola.mean(5.25, 5.5) - (part(0.5) - part(0.25)) * 4.0).abs() < 1e-13);
        let seam = (part(1.0) - part(0.75) + part(0.5)) / 0.75;
        assert!((parabola.mean(-0.25, 0.5) - seam).abs() < 1e-15);
        let ramp = track(vec![(0.0, 0.0), (1.0, 2.0)], Linear, Hold);
        assert_eq!(
            (ramp.mean(-2.0, -1.0), ramp.mean(3.0, 4.0), ramp.mean(0.5, 0.5)),
            (0.0, 2.0, 1.0)
        );
        assert!((ramp.mean(-1.0, 2.0) - 1.0).abs() < 1e-15);
        let alone = track(vec![(0.3, 7.0)], Linear, Loop);
        assert_eq!(alone.mean(0.0, 1.0), 7.0);
    }

    /// Oracle: the track itself, at every time; a jump is a jump.
    #[test]
    fn curves_over_the_shutter_are_the_track() {
        let keys = vec![(0.0, 20.0), (0.031, 40.0), (0.5, 30.0), (0.75, 60.0), (2.0, 50.0)];
        for interpolation in [Interpolation::Step, Interpolation::Linear, Interpolation::Cubic] {
            for extend in [Extend::Hold, Extend::Loop] {
                let track = track(keys.clone(), interpolation, extend);
                for (open, close) in [(0.0, 1.0), (-1.3, 0.7), (1.9, 2.6)] {
                    let curve = track.curve(open, close, 64);
                    for k in 0..1000_u32 {
                        let u = (f64::from(k) + 0.37) / 1000.0;
                        let expected = track.at(open + (close - open) * u);
                        let found = curve.at(u);
                        let allowed =
                            if interpolation == Interpolation::Cubic { 0.02 } else { 1e-9 };
                        assert!((found - expected).abs() < allowed, "{u}: {found} {expected}");
                    }
                }
            }
        }
    }
}
