//! Key lists for motions which are not polynomials: samples with their exact derivatives.
//!
//! Between keys `h` apart the cubic Hermite curve is off by at most `h⁴/384 · max|f⁗|`.

use super::noise::hash;
use super::water;
use glam::DVec2;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Every list with the name of the motion.
pub const ALL: [(&str, fn() -> String); 9] = [
    ("swing", swing),
    ("ringing", ringing),
    ("waves", water::list),
    ("fish, translation", fish_place),
    ("fish, turn", fish_heading),
    ("float, translation", float_place),
    ("float, turn about z", || float_tilt(2)),
    ("float, turn about x", || float_tilt(1)),
    ("lamps", lamps),
];

/// Where the beach ball floats in `water`: x and z.
pub const FLOAT: DVec2 = DVec2::new(-0.55, -0.35);

/// The swing of the camera in `ball`: `4°·sin(π·t)` over its period of 2 s, keys 1/8 s apart.
/// Error at most 0.00025°.
pub fn swing() -> String {
    list((0..=16).map(|k| {
        let t = f64::from(k) / 8.0;
        (t, 4.0 * (PI * t).sin(), 4.0 * PI * (PI * t).cos())
    }))
}

/// The knife in `moving` rings after it has hit, at t = 1 s: `5°·e^(−τ/5)·sin(2π·τ/3)` after
/// `τ = 24·(t − 1)` frames, keys 1/64 s apart. Error at most 0.005°.
pub fn ringing() -> String {
    let at_rest = "(1.0, 0.0, 0.0, ".to_owned();
    let text = list((0..=64).map(|k| {
        let t = 1.0 + f64::from(k) / 64.0;
        let tau = 24.0 * (t - 1.0);
        let (decay, (sin, cos)) = (5.0 * (-tau / 5.0).exp(), (TAU * tau / 3.0).sin_cos());
        (t, decay * sin, 24.0 * decay * (TAU / 3.0 * cos - sin / 5.0))
    }));
    // It hits at rest: the slope of the first key holds on leaving only.
    text.replacen("(1.0, 0.0, ", &at_rest, 1)
}

/// The fish in `water` swims along `(0.55·cos p, −0.45, 0.38·sin p)` with `p = π·t`, keys 1/8 s apart.
/// Error at most 0.00004 m.
pub fn fish_place() -> String {
    places((0..=16).map(|k| {
        let t = f64::from(k) / 8.0;
        let (sin, cos) = (PI * t).sin_cos();
        (t, [0.55 * cos, -0.45, 0.38 * sin], [-0.55 * PI * sin, 0.0, 0.38 * PI * cos])
    }))
}

/// The turn about y which points +x along that path, in degrees: it falls by 360 in a round. Keys
/// 1/16 s apart, error below 0.005°.
pub fn fish_heading() -> String {
    list((0..=32).map(|k| {
        let t = f64::from(k) / 16.0;
        let (sin, cos) = (PI * t).sin_cos();
        let (x, z) = (-0.55 * sin, 0.38 * cos);
        // A turn by θ takes +x to (cos θ, 0, −sin θ); counted on from −90° at the start.
        let angle = -90.0 - (0.55 * sin).atan2(0.38 * cos).to_degrees().rem_euclid(360.0);
        let angle = if k == 32 { -450.0 } else { angle };
        // θ = atan2(−z, x), so that θ' = (z·x' − x·z')/(x² + z²).
        let (dx, dz) = (-0.55 * PI * cos, -0.38 * PI * sin);
        (t, angle, ((z * dx - x * dz) / (x * x + z * z)).to_degrees())
    }))
}

/// The ball in `water` floats 6 cm above the height of the waves. Keys 1/16 s apart; waves of 3 Hz and
/// 3 mm between them are followed to 0.00004 m.
pub fn float_place() -> String {
    places((0..=32).map(|k| {
        let (t, [height, ..], [rise, ..]) = float(k);
        (t, [FLOAT.x, 0.06 + height, FLOAT.y], [0.0, rise, 0.0])
    }))
}

/// The tilt of the waves under the ball: about x (1) or about z (2), in degrees, followed to 0.05°.
pub fn float_tilt(about: usize) -> String {
    list((0..=32).map(|k| {
        let (t, tilt, slope) = float(k);
        (t, tilt[about], slope[about])
    }))
}

/// Height and tilt of the waves, and their slopes, at `k`/16 s of a period of 2 s.
fn float(k: u32) -> (f64, [f64; 3], [f64; 3]) {
    let t = f64::from(k) / 16.0;
    // The end of the period is its beginning to the last digit.
    let phase = f64::from(k % 32) / 16.0;
    let at = |t: f64| water::float(FLOAT, t);
    // A central difference: its error, h²/6 of a third derivative below 1e4, is not printed.
    let h = 1e-5;
    let (before, after) = (at(phase - h), at(phase + h));
    let slope = std::array::from_fn(|c| (after[c] - before[c]) / (2.0 * h));
    (t, at(phase), slope)
}

/// The lamps in `glass`: 14 small spheres in a row, at heights from the hash of their number, in three
/// colours in turn.
pub fn lamps() -> String {
    const COLORS: [&str; 3] = ["(36, 16, 6)", "(8, 20, 36)", "(36, 32, 20)"];
    let lamp = |k: i32| {
        let x = rounded(-1.5 + 3.0 * (f64::from(k) + 0.5) / 14.0);
        let y = rounded(0.25 + 0.35 * hash(k.into(), 0, 77));
        let (number, color) = (k + 1, COLORS[k as usize % 3]);
        format!(
            "\n        \"lamp {number}\": (transform: (translation: ({x:?}, {y:?}, -2)), \
             shape: Sphere(radius: 0.022), emission: Radiance({color})),"
        )
    };
    (0..14).map(lamp).collect()
}

/// To a millionth, and no minus before a zero.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}

/// `(time, value, slope)`, four to a line, as a scene file has them inside `keys: [ ]`.
fn list(keys: impl Iterator<Item = (f64, f64, f64)>) -> String {
    let mut text = String::new();
    for (k, (time, value, slope)) in keys.enumerate() {
        let [value, slope] = [value, slope].map(rounded);
        let lead = if k % 4 == 0 { "\n                " } else { " " };
        write!(text, "{lead}({time:?}, {value:?}, {slope:?}),").expect("strings do not fail");
    }
    text
}

/// The same of vectors, two to a line.
fn places(keys: impl Iterator<Item = (f64, [f64; 3], [f64; 3])>) -> String {
    let mut text = String::new();
    for (k, (time, value, slope)) in keys.enumerate() {
        let [[x, y, z], [dx, dy, dz]] = [value, slope].map(|v| v.map(rounded));
        let lead = if k % 2 == 0 { "\n                " } else { " " };
        write!(text, "{lead}({time:?}, ({x:?}, {y:?}, {z:?}), ({dx:?}, {dy:?}, {dz:?})),")
            .expect("strings do not fail");
    }
    text
}
