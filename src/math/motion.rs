//! Rigid and non-rigid motion between keys: translation, rotation and stretch apart.
//!
//! A matrix lerped entry by entry shrinks what turns. Each key is therefore split by the polar
//! decomposition `M = R·S`, `R` a rotation and `S` symmetric, and the parts are interpolated
//! apart: `R` along the great arc, `S` and the translation along lines (Shoemake and Duff 1992,
//! "Matrix Animation and Polar Decomposition", Graphics Interface, sections 3 to 5).
//!
//! Where the translations lie on a curve they are joined by one: in each segment, of length 1, by the cubic with the
//! slopes `(p₊ − p₋)/2` of the chords between neighbours (Catmull and Rom 1974, "A Class of Local Interpolating
//! Splines"), and at both ends by the slope of the parabola through three keys. What is thrown or accelerates evenly is
//! then met exactly by three keys, and an arc with an error that falls as the third power of the length of a segment.

use glam::{DAffine3, DMat3, DQuat, DVec3};

/// An affine map, split into translation, rotation and stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decomposed {
    /// Where the origin goes.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Symmetric factor, applied first; its determinant is negative for a mirroring map.
    pub stretch: DMat3,
}

impl Decomposed {
    /// Splits `m`. A singular linear part keeps the rotation of its last regular iterate.
    ///
    /// Newton's iteration `Q ← ½(Q + Q⁻ᵀ)` converges quadratically to the orthogonal factor (Higham
    /// 1986, "Computing the Polar Decomposition — with Applications", SIAM J. Sci. Stat. Comput.
    /// 7(4)).
    pub fn new(m: &DAffine3) -> Self {
        let linear = m.matrix3;
        let mut q = linear;
        for _ in 0..64 {
            if q.determinant() == 0.0 {
                break;
            }
            let next = (q + q.inverse().transpose()) * 0.5;
            let change = max_abs(next - q);
            q = next;
            // Quadratic convergence: once the step is below √ε of the entries, this one was the last.
            if change <= f64::EPSILON.sqrt() * max_abs(q) {
                q = (q + q.inverse().transpose()) * 0.5;
                break;
            }
        }
        if q.determinant() < 0.0 {
            q = -q;
        }
        let rotation = DQuat::from_mat3(&q).normalize();
        let stretch = DMat3::from_quat(rotation).transpose() * linear;
        let symmetric = (stretch + stretch.transpose()) * 0.5;
        Self { translation: m.translation, rotation, stretch: symmetric }
    }

    /// The map with these parts.
    #[inline]
    pub fn compose(&self) -> DAffine3 {
        DAffine3 {
            matrix3: DMat3::from_quat(self.rotation) * self.stretch,
            translation: self.translation,
        }
    }

    /// The map a share `s` of the way to `other`; the rotation takes the shorter arc.
    #[inline]
    pub fn interpolate(&self, other: &Self, s: f64) -> DAffine3 {
        self.between(other, s).compose()
    }

    /// The parts of that map.
    #[inline]
    fn between(&self, other: &Self, s: f64) -> Self {
        let rotation = if self.rotation == other.rotation {
            self.rotation
        } else {
            self.rotation.slerp(other.rotation, s)
        };
        let stretch = self.stretch * (1.0 - s) + other.stretch * s;
        Self { translation: self.translation.lerp(other.translation, s), rotation, stretch }
    }
}

fn max_abs(m: DMat3) -> f64 {
    m.to_cols_array().into_iter().fold(0.0, |a, x| a.max(x.abs()))
}

/// A map and its inverse, at rest or in motion over the shutter.
#[derive(Clone, Debug, PartialEq)]
pub enum MotionTransform {
    /// The same at every time.
    Static {
        /// World from object.
        forward: DAffine3,
        /// Object from world.
        inverse: DAffine3,
    },
    /// Moving without turning or changing shape, between places at evenly spaced times in `[0, 1]`, both ends included; at
    /// least two.
    Sliding {
        /// Linear part of the map.
        forward: DMat3,
        /// Its inverse.
        inverse: DMat3,
        /// Where the origin goes.
        places: Vec<DVec3>,
        /// By how much a place changes in a segment, at each of them; empty where lines join them.
        slopes: Vec<DVec3>,
    },
    /// Keys at evenly spaced times in `[0, 1]`, both ends included; at least two.
    Moving {
        /// World from object at each key, split.
        keys: Vec<Decomposed>,
        /// By how much the translation changes in a segment, at each key; empty where lines join them.
        slopes: Vec<DVec3>,
    },
}

/// The slopes of the curve through evenly spaced places: their change in a segment. Two are joined by a line.
pub fn curve_slopes(places: &[DVec3]) -> Vec<DVec3> {
    let end = |a: DVec3, b: DVec3, c: DVec3| (b - a) * 2.0 - (c - a) * 0.5;
    match places {
        [first, second, third, ..] => {
            let [.., before, last_but_one, last] = places else { unreachable!("three or more") };
            let inner = places.windows(3).map(|near| (near[2] - near[0]) * 0.5);
            std::iter::once(end(*first, *second, *third))
                .chain(inner)
                .chain(std::iter::once(-end(*last, *last_but_one, *before)))
                .collect()
        }
        _ => Vec::new(),
    }
}

/// The place a share `s` of the way between two, on the cubic with these slopes at both, or on a line without.
#[inline]
pub fn place_between([p, q]: [DVec3; 2], slopes: Option<[DVec3; 2]>, s: f64) -> DVec3 {
    let on_line = p.lerp(q, s);
    let Some([m, n]) = slopes else { return on_line };
    // Hermite's cubic, as what it adds to the line.
    let chord = q - p;
    let rest = 1.0 - s;
    on_line + ((m - chord) * rest - (n - chord) * s) * (s * rest)
}

/// The slopes at both ends of a segment, of a curve.
#[inline]
fn slopes_of(slopes: &[DVec3], first: usize) -> Option<[DVec3; 2]> {
    (!slopes.is_empty()).then(|| [slopes[first], slopes[first + 1]])
}

impl MotionTransform {
    /// The motion through `keys`, which lie at evenly spaced times; at least one. Lines join their translations.
    pub fn new(keys: &[DAffine3]) -> Self {
        Self::through(keys, false)
    }

    /// The same, where a curve joins the translations if that is wanted.
    pub fn through(keys: &[DAffine3], curved: bool) -> Self {
        let slopes = || {
            let places: Vec<DVec3> = keys.iter().map(|key| key.translation).collect();
            if curved { curve_slopes(&places) } else { Vec::new() }
        };
        match keys {
            [] => Self::at_rest(DAffine3::IDENTITY),
            [key] => Self::at_rest(*key),
            [first, rest @ ..] if rest.iter().all(|key| key.matrix3 == first.matrix3) => {
                Self::Sliding {
                    forward: first.matrix3,
                    inverse: first.matrix3.inverse(),
                    places: keys.iter().map(|key| key.translation).collect(),
                    slopes: slopes(),
                }
            }
            keys => {
                Self::Moving { keys: keys.iter().map(Decomposed::new).collect(), slopes: slopes() }
            }
        }
    }

    fn at_rest(forward: DAffine3) -> Self {
        Self::Static { forward, inverse: forward.inverse() }
    }

    /// Whether the map is the same at every time.
    pub fn is_static(&self) -> bool {
        matches!(self, Self::Static { .. })
    }

    /// Where the origin goes at the keys.
    pub fn keys_translations(&self) -> impl Iterator<Item = DVec3> {
        let (places, keys): (&[DVec3], &[Decomposed]) = match self {
            Self::Static { forward, .. } => (std::slice::from_ref(&forward.translation), &[]),
            Self::Sliding { places, .. } => (places, &[]),
            Self::Moving { keys, .. } => (&[], keys),
        };
        places.iter().copied().chain(keys.iter().map(|key| key.translation))
    }

    fn slopes(&self) -> &[DVec3] {
        match self {
            Self::Static { .. } => &[],
            Self::Sliding { slopes, .. } | Self::Moving { slopes, .. } => slopes,
        }
    }

    /// Points whose convex hull holds all places of the origin: those at the keys, and of curves the control points
    /// of their Bézier form between them.
    pub fn hull(&self) -> impl Iterator<Item = DVec3> {
        let curve = self.keys_translations().zip(self.slopes());
        let controls = curve.flat_map(|(p, slope)| [p - *slope / 3.0, p + *slope / 3.0]);
        self.keys_translations().chain(controls)
    }

    /// How far the place of the origin strays from the chord of a part, from one share to another, of the segment after key
    /// `k`: at least and at most along each axis.
    ///
    /// In Bézier's form a cubic strays by `3s(1−s)²·c₁ + 3s²(1−s)·c₂`, with `c` how far the inner control points are from
    /// where those of the chord are. The weights come to ¾ at most together.
    pub(super) fn strays(&self, k: usize, [from, to]: [f64; 2]) -> [DVec3; 2] {
        let Some([m, n]) = slopes_of(self.slopes(), k) else { return [DVec3::ZERO; 2] };
        let ends = [self.key(k).translation, self.key(k + 1).translation];
        let chord = ends[1] - ends[0];
        let (m, n) = (m - chord, n - chord);
        let slope = |s: f64| {
            let rest = 1.0 - s;
            (chord + m * (rest * (1.0 - 3.0 * s)) - n * (s * (2.0 - 3.0 * s))) * (to - from)
        };
        let [first, last] = [from, to].map(|s| place_between(ends, slopes_of(self.slopes(), k), s));
        let part = last - first;
        let (a, b) = ((slope(from) - part) * 0.25, (part - slope(to)) * 0.25);
        [a.min(b).min(DVec3::ZERO), a.max(b).max(DVec3::ZERO)]
    }

    /// A key, split. What does not turn within the shutter has no rotation and all else in its stretch.
    pub(super) fn key(&self, k: usize) -> Decomposed {
        match self {
            Self::Static { forward, .. } => unturned(forward.matrix3, forward.translation),
            Self::Sliding { forward, places, .. } => unturned(*forward, places[k]),
            Self::Moving { keys, .. } => keys[k],
        }
    }

    /// World from object at time `u` in `[0, 1]` of the shutter, split as [`MotionTransform::key`] is.
    pub(super) fn key_at(&self, u: f32) -> Decomposed {
        match self {
            Self::Static { .. } => self.key(0),
            Self::Sliding { forward, places, slopes, .. } => {
                unturned(*forward, place_at(places, slopes, u))
            }
            Self::Moving { keys, slopes } => between_keys(keys, slopes, u),
        }
    }

    /// World from object at time `u` in `[0, 1]` of the shutter.
    #[inline]
    pub fn at(&self, u: f32) -> DAffine3 {
        match self {
            Self::Static { forward, .. } => *forward,
            Self::Sliding { forward, places, slopes, .. } => {
                DAffine3 { matrix3: *forward, translation: place_at(places, slopes, u) }
            }
            Self::Moving { keys, slopes } => between_keys(keys, slopes, u).compose(),
        }
    }

    /// World from object and object from world at time `u` in `[0, 1]` of the shutter.
    #[inline]
    pub fn both_at(&self, u: f32) -> (DAffine3, DAffine3) {
        match self {
            Self::Static { forward, inverse } => (*forward, *inverse),
            Self::Sliding { inverse, .. } => {
                let forward = self.at(u);
                (forward, inverse_of(inverse, forward.translation))
            }
            Self::Moving { .. } => {
                let forward = self.at(u);
                (forward, forward.inverse())
            }
        }
    }

    /// Object from world at time `u` in `[0, 1]` of the shutter.
    #[inline]
    pub fn inverse_at(&self, u: f32) -> DAffine3 {
        match self {
            Self::Static { inverse, .. } => *inverse,
            Self::Sliding { inverse, places, slopes, .. } => {
                inverse_of(inverse, place_at(places, slopes, u))
            }
            Self::Moving { .. } => self.at(u).inverse(),
        }
    }
}

/// A map without rotation.
fn unturned(linear: DMat3, translation: DVec3) -> Decomposed {
    Decomposed { translation, rotation: DQuat::IDENTITY, stretch: linear }
}

/// The segment between `count` keys in which the time `u` lies, and the share of it that has passed.
#[inline]
fn segment(count: usize, u: f32) -> (usize, f64) {
    let position = f64::from(u) * (count - 1) as f64;
    let first = (position as usize).min(count - 2);
    (first, position - first as f64)
}

#[inline]
fn place_at(places: &[DVec3], slopes: &[DVec3], u: f32) -> DVec3 {
    let (first, share) = segment(places.len(), u);
    place_between([places[first], places[first + 1]], slopes_of(slopes, first), share)
}

#[inline]
fn between_keys(keys: &[Decomposed], slopes: &[DVec3], u: f32) -> Decomposed {
    let (first, share) = segment(keys.len(), u);
    let ends = [&keys[first], &keys[first + 1]];
    let mut parts = ends[0].between(ends[1], share);
    if let Some(slopes) = slopes_of(slopes, first) {
        parts.translation = place_between(ends.map(|key| key.translation), Some(slopes), share);
    }
    parts
}

/// The inverse of a map whose linear part has this inverse.
#[inline]
fn inverse_of(inverse: &DMat3, translation: DVec3) -> DAffine3 {
    DAffine3 { matrix3: *inverse, translation: -(*inverse * translation) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheared() -> DAffine3 {
        let turn = DAffine3::from_rotation_translation(
            DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7)),
            DVec3::new(4.0, 5.0, -6.0),
        );
        turn * DAffine3::from_scale(DVec3::new(0.2, 3.0, 1.0))
            * DAffine3::from_quat(DQuat::from_rotation_x(0.8))
    }

    /// Oracle: the product of the parts is the map; also for a mirroring and a tiny one.
    #[test]
    fn parts_multiply_to_the_map() {
        let mirror = DAffine3::from_scale(DVec3::new(-1.0, 2.0, 0.5));
        let tiny = DAffine3::from_scale(DVec3::splat(1e-9));
        for m in [sheared(), sheared() * mirror, sheared() * tiny, DAffine3::IDENTITY] {
            let back = Decomposed::new(&m).compose();
            let scale = max_abs(m.matrix3);
            assert!(max_abs(back.matrix3 - m.matrix3) < 1e-13 * scale, "{m:?}\n{back:?}");
        }
    }

    /// Oracle: a quarter turn about an axis, half way, is an eighth of a turn, not a chord.
    #[test]
    fn half_a_rotation_is_the_rotation_by_half_the_angle() {
        let a = DAffine3::IDENTITY;
        let b = DAffine3::from_rotation_y(1.2);
        let motion = MotionTransform::new(&[a, b]);
        let p = motion.at(0.5).transform_point3(DVec3::Z);
        assert!((p - DVec3::new(0.6_f64.sin(), 0.0, 0.6_f64.cos())).length() < 1e-14);
        let (forward, inverse) = motion.both_at(0.3);
        assert!(max_abs((forward * inverse).matrix3 - DMat3::IDENTITY) < 1e-14);
    }

    /// Oracle: the general interpolation of the same keys.
    #[test]
    fn sliding_is_what_moving_would_be() {
        let places = [DVec3::X, DVec3::new(3.0, -1.0, 2.0), DVec3::new(4.0, 8.0, 1e6)];
        let keys = places.map(|p| DAffine3 { translation: p, ..sheared() });
        let sliding = MotionTransform::new(&keys);
        assert!(matches!(sliding, MotionTransform::Sliding { .. }));
        let moving = MotionTransform::Moving {
            keys: keys.iter().map(Decomposed::new).collect(),
            slopes: Vec::new(),
        };
        assert!(sliding.keys_translations().eq(moving.keys_translations()));
        for u in [0.0, 0.2, 0.5, 0.77, 1.0] {
            let (a, b) = (sliding.at(u), moving.at(u));
            assert!(max_abs(a.matrix3 - b.matrix3) < 1e-13, "{u}");
            assert!((a.translation - b.translation).length() <= 1e-9, "{u}");
            let (forward, inverse) = sliding.both_at(u);
            assert_eq!((forward, inverse), (a, sliding.inverse_at(u)));
            let p = DVec3::new(0.3, -0.2, 0.7);
            let back = inverse.transform_point3(forward.transform_point3(p));
            assert!((back - p).length() < 1e-8, "{u}: {back}");
        }
    }

    /// The ends are the keys themselves, and time 1 lies inside the last segment.
    #[test]
    fn keys_are_met_at_their_times() {
        let keys: Vec<_> =
            (0..4).map(|k| DAffine3::from_translation(DVec3::X * f64::from(k * k))).collect();
        let motion = MotionTransform::new(&keys);
        for (u, x) in [(0.0, 0.0), (1.0, 9.0), (0.5, 2.5)] {
            assert!((motion.at(u).translation.x - x).abs() < 1e-12, "u = {u}");
        }
    }

    /// Oracle: the parabola of a thrown body through three keys and more, and of an arc its own error, which falls by eight
    /// with every halving; the hull holds both.
    #[test]
    fn curves_follow_what_accelerates() {
        let thrown = |t: f64| DVec3::new(3.0 * t, 2.0 * t - 4.905 * t * t, 1e3);
        let arc = |t: f64| DVec3::new((1.5 * t).cos(), (1.5 * t).sin(), 0.0);
        let error = |path: &dyn Fn(f64) -> DVec3, turn: bool, segments: u32| {
            let keys: Vec<DAffine3> = (0..=segments)
                .map(|k| {
                    let t = f64::from(k) / f64::from(segments);
                    let angle = if turn { t } else { 0.0 };
                    DAffine3::from_rotation_translation(DQuat::from_rotation_z(angle), path(t))
                })
                .collect();
            let motion = MotionTransform::through(&keys, true);
            let hull: Vec<DVec3> = motion.hull().collect();
            let low = hull.iter().fold(DVec3::INFINITY, |low, p| low.min(*p)) - 1e-12;
            let high = hull.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p)) + 1e-12;
            (0..=100_u8)
                .map(|k| {
                    let u = f32::from(k) / 100.0;
                    let found = motion.at(u).translation;
                    assert_eq!(found, motion.key_at(u).translation);
                    assert!(found.cmpge(low).all() && found.cmple(high).all());
                    found.distance(path(f64::from(u)))
                })
                .fold(0.0, f64::max)
        };
        for turn in [false, true] {
            for segments in [2, 3, 8] {
                assert!(error(&thrown, turn, segments) < 1e-12, "{segments}");
            }
            let [coarse, fine] = [8, 16].map(|segments| error(&arc, turn, segments));
            assert!(coarse < 5e-4 && fine < coarse / 6.0, "{coarse} {fine}");
        }
        assert!(curve_slopes(&[DVec3::X, DVec3::Y]).is_empty(), "two are joined by a line");
    }
}
