//! Key lists for motions which are not polynomials: samples with their exact derivatives.
//!
//! Between keys `h` apart the cubic Hermite curve is off by at most `h⁴/384 · max|f⁗|`.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

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

/// `(time, value, slope)`, four to a line, as a scene file has them inside `keys: [ ]`.
fn list(keys: impl Iterator<Item = (f64, f64, f64)>) -> String {
    let mut text = String::new();
    for (k, (time, value, slope)) in keys.enumerate() {
        let [value, slope] = [value, slope].map(|x| (x * 1e6).round() / 1e6 + 0.0);
        let lead = if k % 4 == 0 { "\n                " } else { " " };
        write!(text, "{lead}({time:?}, {value:?}, {slope:?}),").expect("strings do not fail");
    }
    text
}
