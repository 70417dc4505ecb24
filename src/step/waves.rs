//! The surface of water at an instant.
//!
//! With the symbols of [`crate::description::Waves`] and `Q` its steepness, the particle at rest at
//! `(x, 0, z)` is at
//!
//! ```text
//! x' = x − Σ Q·a·Dx·sin ψ,    y' = Σ a·cos ψ,    z' = z − Σ Q·a·Dz·sin ψ
//! ```
//!
//! and the normal is the cross product of the derivatives of that by z and by x.

use crate::description::Waves;
use glam::DVec3;

/// A train of waves at one instant.
#[derive(Clone, Copy, Debug)]
struct Train {
    /// Wave vector, radians per metre.
    kx: f64,
    kz: f64,
    /// `φ − ω·t`, radians.
    phase: f64,
    /// Metres.
    amplitude: f64,
    /// `Q·a·D`, metres.
    push_x: f64,
    push_z: f64,
}

/// The sum of all waves at one instant.
#[derive(Clone, Debug)]
pub(super) struct WaterSurface {
    trains: Vec<Train>,
}

impl WaterSurface {
    /// The surface at `t` seconds.
    pub(super) fn new(waves: &Waves, t: f64) -> Self {
        let train = |wave: &crate::description::Wave| {
            let (dz, dx) = wave.direction.to_radians().sin_cos();
            let k = wave.number(waves.gravity);
            let push = waves.steepness * wave.amplitude;
            Train {
                kx: k * dx,
                kz: k * dz,
                phase: wave.phase.to_radians() - wave.angular_frequency() * t,
                amplitude: wave.amplitude,
                push_x: push * dx,
                push_z: push * dz,
            }
        };
        Self { trains: waves.waves.iter().map(train).collect() }
    }

    /// Where the particle is whose place at rest is `(x, 0, z)`.
    pub(super) fn position(&self, x: f64, z: f64) -> DVec3 {
        self.trains.iter().fold(DVec3::new(x, 0.0, z), |p, train| {
            let (sin, cos) = train.at(x, z).sin_cos();
            p + DVec3::new(-train.push_x * sin, train.amplitude * cos, -train.push_z * sin)
        })
    }

    /// [`WaterSurface::position`] and the unit normal there, upwards.
    pub(super) fn vertex(&self, x: f64, z: f64) -> (DVec3, DVec3) {
        let mut p = DVec3::new(x, 0.0, z);
        let (mut by_x, mut by_z) = (DVec3::X, DVec3::Z);
        for train in &self.trains {
            let (sin, cos) = train.at(x, z).sin_cos();
            p += DVec3::new(-train.push_x * sin, train.amplitude * cos, -train.push_z * sin);
            let slope =
                DVec3::new(-train.push_x * cos, -train.amplitude * sin, -train.push_z * cos);
            by_x += train.kx * slope;
            by_z += train.kz * slope;
        }
        (p, by_z.cross(by_x).normalize())
    }
}

impl Train {
    fn at(&self, x: f64, z: f64) -> f64 {
        self.kx * x + self.kz * z + self.phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Wave;
    use glam::DVec2;
    use std::f64::consts::PI;

    fn two_trains(steepness: f64) -> Waves {
        Waves {
            size: DVec2::ONE,
            cells: (1, 1),
            steepness,
            gravity: 9.81,
            waves: vec![
                Wave { amplitude: 0.009, frequency: 1.0, direction: 20.0, phase: 0.0 },
                Wave { amplitude: 0.006, frequency: 1.5, direction: -35.0, phase: 97.4 },
            ],
        }
    }

    /// Oracle: the formula for one wave along x, written out; its crest is where the phase is 0.
    #[test]
    fn a_single_wave_is_a_trochoid() {
        let wave = Wave { amplitude: 0.02, frequency: 0.5, direction: 0.0, phase: 30.0 };
        let waves = Waves { waves: vec![wave], ..two_trains(0.6) };
        let (omega, k) = (PI, PI * PI / 9.81);
        for (x, t) in [(0.0, 0.0), (0.7, 0.3), (-2.0, 1.7)] {
            let psi = k * x - omega * t + PI / 6.0;
            let expected = DVec3::new(x - 0.6 * 0.02 * psi.sin(), 0.02 * psi.cos(), 0.4);
            let (p, n) = WaterSurface::new(&waves, t).vertex(x, 0.4);
            assert!((p - expected).length() < 1e-15, "{p}");
            // A trochoid's slope: dy/dx' = −a·k·sin ψ/(1 − Q·a·k·cos ψ).
            let slope = -0.02 * k * psi.sin() / (1.0 - 0.6 * 0.02 * k * psi.cos());
            assert!((n - DVec3::new(-slope, 1.0, 0.0).normalize()).length() < 1e-15, "{n}");
        }
    }

    /// Oracle: normals from central differences of positions. Their error is `h²·k³·a/6`, below 1e-9
    /// for h = 1e-4 m here, and that of rounding 1e-16/h.
    #[test]
    fn normals_are_those_of_the_surface() {
        for steepness in [0.0, 0.7, 1.0] {
            let surface = WaterSurface::new(&two_trains(steepness), 0.37);
            for (x, z) in [(0.0, 0.0), (0.31, -0.2), (-1.4, 0.9)] {
                let h = 1e-4;
                let by_x = surface.position(x + h, z) - surface.position(x - h, z);
                let by_z = surface.position(x, z + h) - surface.position(x, z - h);
                let (p, n) = surface.vertex(x, z);
                assert_eq!(p, surface.position(x, z));
                let expected = by_z.cross(by_x).normalize();
                assert!((n - expected).length() < 1e-8, "{n} {expected}");
            }
        }
    }

    /// Oracle: crests of a wave move by ω/k, whatever the direction.
    #[test]
    fn waves_travel_along_their_direction() {
        let wave = Wave { amplitude: 0.01, frequency: 2.0, direction: 120.0, phase: 0.0 };
        let waves = Waves { waves: vec![wave], ..two_trains(0.7) };
        let (t, speed) = (0.05, 9.81 / (4.0 * PI));
        let (sin, cos) = 120.0_f64.to_radians().sin_cos();
        let crest = WaterSurface::new(&waves, t).position(speed * t * cos, speed * t * sin);
        assert!((crest.y - 0.01).abs() < 1e-14, "{crest}");
    }
}
