//! The waves of the scene `water`, to find how a ball floats on them.
//!
//! Ten trains of a period of 2 s over a whole number: all of them together repeat after 2 s. The
//! surface is the one that scene files call `Waves`.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::fmt::Write;

/// Periods in 2 s, direction in degrees from +x to +z, amplitude in millimetres, phase in radians.
pub const TRAINS: [(f64, f64, f64, f64); 10] = [
    (2.0, 20.0, 9.0, 0.0),
    (3.0, -35.0, 6.0, 1.7),
    (3.0, 75.0, 5.0, 4.1),
    (4.0, 10.0, 3.2, 2.3),
    (4.0, 120.0, 2.8, 5.5),
    (5.0, -60.0, 1.9, 0.9),
    (5.0, 40.0, 1.7, 3.6),
    (6.0, 95.0, 1.05, 2.9),
    (6.0, -15.0, 1.0, 5.0),
    (6.0, 150.0, 0.9, 1.2),
];
/// Share of the horizontal motion.
const STEEPNESS: f64 = 0.7;
/// Metres per second squared.
const GRAVITY: f64 = 9.81;

/// Where a particle is at `t` seconds, and the normal there, not of unit length.
fn particle(rest: DVec2, t: f64) -> (DVec3, DVec3) {
    let mut p = DVec3::new(rest.x, 0.0, rest.y);
    let (mut by_x, mut by_z) = (DVec3::X, DVec3::Z);
    for (periods, degrees, millimetres, phase) in TRAINS {
        let (omega, amplitude) = (PI * periods, millimetres / 1000.0);
        let k = omega * omega / GRAVITY;
        let d = DVec2::from_angle(degrees.to_radians());
        let (sin, cos) = (k * d.dot(rest) - omega * t + phase).sin_cos();
        let push = STEEPNESS * amplitude;
        p += DVec3::new(-push * d.x * sin, amplitude * cos, -push * d.y * sin);
        let slope = DVec3::new(-push * d.x * cos, -amplitude * sin, -push * d.y * cos);
        by_x += k * d.x * slope;
        by_z += k * d.y * slope;
    }
    (p, by_z.cross(by_x))
}

/// The height of the water above `(x, z)`, metres, and its tilt in degrees: first about x, then about
/// z, which turns +y to the normal.
pub fn float(at: DVec2, t: f64) -> [f64; 3] {
    // The particle which is there now: its displacement changes little with its place, so that this
    // iteration gains a digit at each step.
    let mut rest = at;
    for _ in 0..40 {
        let (p, _) = particle(rest, t);
        rest += at - DVec2::new(p.x, p.z);
    }
    let (p, normal) = particle(rest, t);
    let normal = normal.normalize();
    let about_x = normal.z.asin();
    let about_z = (-normal.x).atan2(normal.y);
    [p.y, about_x.to_degrees(), about_z.to_degrees()]
}

/// The waves as the scene file has them inside `waves: [ ]`.
pub fn list() -> String {
    let round = |x: f64| (x * 1e6).round() / 1e6;
    let mut text = String::new();
    for (periods, direction, millimetres, phase) in TRAINS {
        let (amplitude, frequency) = (round(millimetres / 1000.0), periods / 2.0);
        let phase = round(phase.to_degrees());
        text.push_str("\n                ");
        write!(
            text,
            "(amplitude: {amplitude:?}, frequency: {frequency:?}, direction: {direction:?}, \
             phase: {phase:?}),"
        )
        .expect("strings do not fail");
    }
    text
}
