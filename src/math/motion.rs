//! Rigid and non-rigid motion between keys: translation, rotation and stretch apart.
//!
//! A matrix lerped entry by entry shrinks what turns. Each key is therefore split by the polar
//! decomposition `M = R·S`, `R` a rotation and `S` symmetric, and the parts are interpolated
//! apart: `R` along the great arc, `S` and the translation along lines (Shoemake and Duff 1992,
//! "Matrix Animation and Polar Decomposition", Graphics Interface, sections 3 to 5).

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
    /// Moving without turning or changing shape, along straight lines between places at evenly spaced
    /// times in `[0, 1]`, both ends included; at least two.
    Sliding {
        /// Linear part of the map.
        forward: DMat3,
        /// Its inverse.
        inverse: DMat3,
        /// Where the origin goes.
        places: Vec<DVec3>,
    },
    /// Keys at evenly spaced times in `[0, 1]`, both ends included; at least two.
    Moving {
        /// World from object at each key, split.
        keys: Vec<Decomposed>,
    },
}

impl MotionTransform {
    /// The motion through `keys`, which lie at evenly spaced times; at least one.
    pub fn new(keys: &[DAffine3]) -> Self {
        match keys {
            [] => Self::at_rest(DAffine3::IDENTITY),
            [key] => Self::at_rest(*key),
            [first, rest @ ..] if rest.iter().all(|key| key.matrix3 == first.matrix3) => {
                Self::Sliding {
                    forward: first.matrix3,
                    inverse: first.matrix3.inverse(),
                    places: keys.iter().map(|key| key.translation).collect(),
                }
            }
            keys => Self::Moving { keys: keys.iter().map(Decomposed::new).collect() },
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
            Self::Moving { keys } => (&[], keys),
        };
        places.iter().copied().chain(keys.iter().map(|key| key.translation))
    }

    /// A key, split. What does not turn within the shutter has no rotation and all else in its stretch.
    pub(super) fn key(&self, k: usize) -> Decomposed {
        match self {
            Self::Static { forward, .. } => unturned(forward.matrix3, forward.translation),
            Self::Sliding { forward, places, .. } => unturned(*forward, places[k]),
            Self::Moving { keys } => keys[k],
        }
    }

    /// World from object at time `u` in `[0, 1]` of the shutter, split as [`MotionTransform::key`] is.
    pub(super) fn key_at(&self, u: f32) -> Decomposed {
        match self {
            Self::Static { .. } => self.key(0),
            Self::Sliding { forward, places, .. } => unturned(*forward, place_at(places, u)),
            Self::Moving { keys } => {
                let (first, share) = segment(keys.len(), u);
                keys[first].between(&keys[first + 1], share)
            }
        }
    }

    /// World from object at time `u` in `[0, 1]` of the shutter.
    #[inline]
    pub fn at(&self, u: f32) -> DAffine3 {
        match self {
            Self::Static { forward, .. } => *forward,
            Self::Sliding { forward, places, .. } => {
                DAffine3 { matrix3: *forward, translation: place_at(places, u) }
            }
            Self::Moving { keys } => {
                let (first, share) = segment(keys.len(), u);
                keys[first].interpolate(&keys[first + 1], share)
            }
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
            Self::Sliding { inverse, places, .. } => inverse_of(inverse, place_at(places, u)),
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
fn place_at(places: &[DVec3], u: f32) -> DVec3 {
    let (first, share) = segment(places.len(), u);
    places[first].lerp(places[first + 1], share)
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
        let moving = MotionTransform::Moving { keys: keys.iter().map(Decomposed::new).collect() };
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
}
