//! Boxes around what moves, for a part of the shutter.

use super::{Aabb, Decomposed, MotionTransform, gamma_f64};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// A box around `bounds` carried along the motion from time `begin` to time `end`, both in `[0, 1]` of the
/// shutter and both included.
///
/// The way is cut at the keys. On a piece without rotation points run along straight lines, and the boxes
/// at both ends hold it, or along a curve, for which they grow by how far it strays from its chord. With one, a point `q(s) = lerp(S₀p, S₁p, s)` is turned by `R(s)`, an angle `θ`
/// in all. It strays from the chord between its two ends by at most
/// `r(1 − cos ½θ) + ½·sin ½θ·|S₁p − S₀p|`, with `r` the greatest `|q|`: the sagitta of its arc, and what
/// the change of its radius adds on the way. Boxes around both ends, padded by that, hold the piece.
///
/// The maps of the ends and those that rays take are rounded: some thirty operations on numbers of the
/// size of a place and a reach, for which γ₃₂ of their sum is added.
pub fn swept_bounds(bounds: &Aabb, motion: &MotionTransform, begin: f32, end: f32) -> Aabb {
    if let MotionTransform::Static { forward, .. } = motion {
        return bounds.transformed(forward);
    }
    let corners = bounds.corners().map(glam::Vec3::as_dvec3);
    let mut all = Aabb::EMPTY;
    let mut before: Option<(f64, Decomposed)> = None;
    for (position, key) in keys_between(motion, begin, end) {
        let (from, before) = before.replace((position, key)).unwrap_or((position, key));
        let mut ends =
            bounds.transformed(&before.compose()).union(bounds.transformed(&key.compose()));
        if position > from {
            let k = from.floor();
            let [least, most] = motion.strays(k as usize, [from - k, position - k]);
            if least != most {
                ends.min = (ends.min.as_dvec3() + least).as_vec3().map(f32::next_down);
                ends.max = (ends.max.as_dvec3() + most).as_vec3().map(f32::next_up);
            }
        }
        let pad = bulge(&corners, &before, &key) + rounding(&corners, &before, &key);
        all = all.union(ends.inflated((pad as f32).next_up()));
    }
    all
}

/// The keys at both ends and those on the way, each with its position, counted in segments.
fn keys_between(
    motion: &MotionTransform,
    begin: f32,
    end: f32,
) -> impl Iterator<Item = (f64, Decomposed)> {
    let count = motion.keys_translations().count();
    let position = |time: f32| f64::from(time) * (count - 1) as f64;
    let (from, to) = (position(begin), position(end));
    let inner = (0..count).filter(move |&k| from < k as f64 && (k as f64) < to);
    let ends = [(from, motion.key_at(begin)), (to, motion.key_at(end))];
    let inner = inner.map(|k| (k as f64, motion.key(k)));
    std::iter::once(ends[0]).chain(inner).chain(std::iter::once(ends[1]))
}

/// How far corners stray at most from the chords between two keys.
fn bulge(corners: &[DVec3; 8], a: &Decomposed, b: &Decomposed) -> f64 {
    if a.rotation == b.rotation {
        return 0.0;
    }
    let half = 0.5 * a.rotation.angle_between(b.rotation);
    let half = half.min(PI - half);
    let (mut reach, mut stretch) = (0.0_f64, 0.0_f64);
    for &corner in corners {
        let (a, b) = (a.stretch * corner, b.stretch * corner);
        reach = reach.max(a.length()).max(b.length());
        stretch = stretch.max(a.distance(b));
    }
    // 1 − cos x = 2 sin²(x/2), without cancellation
    reach * 2.0 * (0.5 * half).sin().powi(2) + 0.5 * half.sin() * stretch
}

/// What rounding adds.
fn rounding(corners: &[DVec3; 8], a: &Decomposed, b: &Decomposed) -> f64 {
    let size = |m: &DMat3| m.to_cols_array().into_iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let extent = corners.iter().map(|corner| corner.abs().element_sum()).fold(0.0, f64::max);
    let place = a.translation.abs().max(b.translation.abs()).max_element();
    gamma_f64(32) * (place + 3.0 * size(&a.stretch).max(size(&b.stretch)) * extent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DQuat, Vec3};

    /// Keys of turning, sliding and stretching motions.
    fn motion(case: u8) -> MotionTransform {
        let a = f64::from(case);
        let turn = if case.is_multiple_of(4) { 0.0 } else { 0.5 };
        let key = |t: f64| {
            DAffine3::from_scale_rotation_translation(
                DVec3::new(1.0 + 0.3 * t * a.sin() * turn, 1.0, 1.0 + t * turn),
                DQuat::from_scaled_axis(DVec3::new(a.sin(), a.cos(), 0.3) * t * turn),
                DVec3::new(a, 2.0 * t, -t * t) * 3.0,
            )
        };
        let count = 2 + case % 4;
        let keys: Vec<_> = (0..count).map(|k| key(3.0 * f64::from(k) / f64::from(count))).collect();
        MotionTransform::through(&keys, case.is_multiple_of(3))
    }

    /// Oracle: the box at many times of the part, both ends among them. It is inside; and not much
    /// smaller, so that a part of the shutter has a part of its box.
    #[test]
    fn boxes_of_parts_hold_what_is_there_then() {
        let shape = Aabb { min: Vec3::new(-1.0, -0.2, 0.0), max: Vec3::new(2.0, 0.3, 0.5) };
        for case in 0..40_u8 {
            let motion = motion(case);
            for parts in [1_u8, 2, 8, 16] {
                for k in 0..parts {
                    let at = |j: u8| (f32::from(k) + f32::from(j) / 32.0) / f32::from(parts);
                    let bounds = swept_bounds(&shape, &motion, at(0), at(32));
                    let mut tight = Aabb::EMPTY;
                    for j in 0..=32 {
                        tight = tight.union(shape.transformed(&motion.at(at(j))));
                    }
                    assert_eq!(bounds.union(tight), bounds, "case {case}, part {k} of {parts}");
                    assert!(bounds.area() < 1.6 * tight.area(), "case {case}, part {k} of {parts}");
                }
            }
        }
    }

    /// At one time the box is that of the map.
    #[test]
    fn a_moment_has_the_box_of_its_map() {
        let shape = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
        for case in 0..8_u8 {
            let motion = motion(case);
            let (swept, there) =
                (swept_bounds(&shape, &motion, 0.7, 0.7), shape.transformed(&motion.at(0.7)));
            assert!((swept.area() / there.area() - 1.0).abs() < 1e-5, "case {case}");
        }
    }
}
