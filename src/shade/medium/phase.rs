//! Where light goes on that a medium scatters.

use crate::description::PhaseFunction;
use crate::math::Frame;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

impl PhaseFunction {
    /// Per steradian, for light that is deflected by an angle of this cosine.
    #[inline]
    pub fn density(self, cos: f32) -> f32 {
        match self {
            Self::Isotropic => 0.5 / TAU,
            Self::HenyeyGreenstein(g) => {
                // (1 − g)² + 2g(1 − cos): no cancellation where a narrow peak is met.
                let squared = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cos);
                (1.0 - g) * (1.0 + g) / (2.0 * TAU * squared * squared.sqrt())
            }
            Self::Rayleigh => 0.375 / TAU * (1.0 + cos * cos),
        }
    }

    /// A direction after light that went along the unit vector `d`, with its density.
    pub fn sample(self, d: Vec3, u: Vec2) -> (Vec3, f32) {
        let cos = self.deflection(u.x).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (2.0 * PI * u.y).sin_cos();
        let wi = Frame::from_z(d).from_local(Vec3::new(sin * cos_phi, sin * sin_phi, cos));
        let wi = wi.normalize();
        (wi, self.density(wi.dot(d)))
    }

    /// The cosine of the deflection by a number in `[0, 1)`.
    fn deflection(self, u: f32) -> f32 {
        /// Below this the closed form loses more digits than the series of first order lacks.
        const NEARLY_ISOTROPIC: f32 = 4e-3;
        let s = 2.0 * u - 1.0;
        match self {
            Self::Isotropic => s,
            Self::HenyeyGreenstein(g) if g.abs() < NEARLY_ISOTROPIC => s + 1.5 * g * (1.0 - s * s),
            Self::HenyeyGreenstein(g) => {
                let ratio = (1.0 - g) * (1.0 + g) / (1.0 + g * s);
                (1.0 + g * g - ratio * ratio) / (2.0 * g)
            }
            // The root of c³ + 3c = 4s.
            Self::Rayleigh => 2.0 * ((2.0 * s).asinh() / 3.0).sinh(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// Closed forms: densities forwards, backwards and at an angle; the cosine drawn by a half; the mean of the cosine and
    /// of its square; and the density integrates to 1.
    #[test]
    fn deflections_follow_henyey_and_greenstein() {
        for (g, cos, expected) in
            [(0.8, 1.0, 3.580_986_2), (0.8, -1.0, 0.004_912_2), (-0.3, 0.2, 0.054_406_8)]
        {
            let density = PhaseFunction::HenyeyGreenstein(g).density(cos);
            assert!((density / expected - 1.0_f32).abs() < 1e-4, "{g} {cos}: {density}");
        }
        let (wi, _) = PhaseFunction::HenyeyGreenstein(0.5).sample(Vec3::Z, Vec2::splat(0.5));
        assert!((wi.z - 0.6875).abs() < 1e-6, "{wi}");
        let n = 1 << 14;
        for g in [-0.999, -0.5, -1e-3, 0.0, 3.9e-3, 4.1e-3, 0.3, 0.8, 0.999] {
            let phase = PhaseFunction::HenyeyGreenstein(g);
            let d = Vec3::new(0.3, -0.5, 0.7).normalize();
            let (mut first, mut second, mut solid_angle) = (0.0, 0.0, 0.0);
            for index in 0..n {
                let sampler = Sampler::new(1, 0, (0, 0), index);
                let (wi, density) = phase.sample(d, sampler.two(0));
                assert!(density.is_finite() && density > 0.0, "{g}");
                let cos = f64::from(wi.dot(d));
                first += cos / f64::from(n);
                second += cos * cos / f64::from(n);
                solid_angle +=
                    f64::from(2.0 * TAU * phase.density(2.0 * sampler.one(2) - 1.0)) / f64::from(n);
            }
            let g = f64::from(g);
            assert!((first - g).abs() < 2e-3, "{g}: {first}");
            assert!((second - (1.0 + 2.0 * g * g) / 3.0).abs() < 3e-3, "{g}: {second}");
            // Evenly drawn cosines hardly meet a narrow peak.
            assert!(g.abs() > 0.9 || (solid_angle - 1.0).abs() < 0.02, "{g}: {solid_angle}");
        }
    }

    /// Closed forms of Rayleigh's function: its values, `⟨cos⟩ = 0`, `⟨cos²⟩ = 2/5`, and the number that each cosine has.
    #[test]
    fn deflections_follow_rayleigh() {
        let phase = PhaseFunction::Rayleigh;
        assert!((phase.density(1.0) - 0.119_366_2).abs() < 1e-7);
        assert!((phase.density(0.0) - 0.059_683_1).abs() < 1e-7);
        let (n, mut first, mut second) = (1 << 12, 0.0, 0.0);
        for k in 0..n {
            let u = (f64::from(k) + 0.5) / f64::from(n);
            let cos = f64::from(phase.deflection(u as f32));
            let below = 0.5 + (3.0 * cos + cos.powi(3)) / 8.0;
            assert!((below - u).abs() < 1e-6, "{u}: {below}");
            first += cos / f64::from(n);
            second += cos * cos / f64::from(n);
        }
        assert!(first.abs() < 1e-6 && (second - 0.4).abs() < 1e-6, "{first} {second}");
    }
}
