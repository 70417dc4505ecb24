//! Media which scatter light: how far it flies, and where it goes on.
//!
//! Where the density is the same everywhere all is in closed form, here. Where it is not, [`Passage`] says what lies on a ray
//! and `tracking` draws distances.

mod density;
mod phase;
mod tracking;

pub use density::{Density, Passage};
pub use tracking::Profile;

use crate::description::{PhaseFunction, Rgb};
use glam::DVec3;

/// A medium; where its density is uneven, all its coefficients are those of a density of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Scattering coefficient per metre.
    pub sigma_s: Rgb,
    /// Extinction coefficient per metre: scattering and absorption.
    pub sigma_t: Rgb,
    /// What it emits per metre, W·m⁻³·sr⁻¹.
    pub emission: Rgb,
    /// The phase function.
    pub phase: PhaseFunction,
}

/// What became of something that went on its way through a medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It got to the end.
    Through,
    /// It goes on in another direction.
    Scattered,
    /// It goes on no more.
    Ended,
}

/// How far light has flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Where it scattered, metres; `None` if it came to the end.
    pub scattered_at: Option<f64>,
    /// What a path then counts: what is left of it, and is scattered, over the probability of that.
    pub weight: Rgb,
}

impl Medium {
    /// Share of light which is left after a distance in metres (Beer and Lambert).
    #[inline]
    pub fn transmittance(&self, distance: f64) -> Rgb {
        if distance == f64::INFINITY {
            return self.sigma_t.map(|sigma| if sigma > 0.0 { 0.0 } else { 1.0 });
        }
        (-self.sigma_t.as_dvec3() * distance).map(f64::exp).as_vec3()
    }

    /// What is scattered per metre at a distance, of the light that set out: `σ_s` times what is left.
    #[inline]
    pub fn scattered(&self, distance: f64) -> Rgb {
        self.sigma_s * self.transmittance(distance)
    }

    /// What the first metres emit that comes out at their beginning: the integral of the emission times what is left of
    /// it, `ε·(1 − exp(−σd))/σ`.
    pub fn emitted(&self, distance: f64) -> Rgb {
        let path = self.sigma_t.as_dvec3().map(|sigma| {
            if sigma > 0.0 { -(-sigma * distance).exp_m1() / sigma } else { distance }
        });
        let seen = |emission: f32, path: f64| {
            if emission > 0.0 { (f64::from(emission) * path) as f32 } else { 0.0 }
        };
        let (e, p) = (self.emission, path);
        Rgb::new(seen(e.x, p.x), seen(e.y, p.y), seen(e.z, p.z))
    }

    /// The density per metre with which [`Medium::fly`] draws a distance, where no end is in its way.
    pub fn density(&self, distance: f64) -> f64 {
        let sigma_t = self.sigma_t.as_dvec3();
        (sigma_t * (-sigma_t * distance).map(f64::exp)).element_sum() / 3.0
    }

    /// A flight over at most `end` metres, by a number in `[0, 1)`.
    ///
    /// One channel draws the distance, and the balance heuristic over what all of them would have drawn weights it (one
    /// sample of Veach 1997, *Robust Monte Carlo Methods for Light Transport Simulation*, section 9.2.4).
    pub fn fly(&self, end: f64, u: f64) -> Flight {
        if self.sigma_s == Rgb::ZERO {
            return Flight { scattered_at: None, weight: self.transmittance(end) };
        }
        let sigma_t = self.sigma_t.as_dvec3();
        let channel = ((3.0 * u) as usize).min(2);
        let drawn = -(-(3.0 * u - channel as f64)).ln_1p() / sigma_t[channel];
        // 0 by 0 where a channel does not meet anything.
        let t = if drawn.is_nan() { f64::INFINITY } else { drawn };
        // Relative to the clearest channel, since all of them may be next to nothing.
        let least = sigma_t.min_element();
        let left = |distance: f64| {
            let thicker = sigma_t - least;
            DVec3::from_array(
                thicker.to_array().map(|s| if s > 0.0 { (-s * distance).exp() } else { 1.0 }),
            )
        };
        let mean = |values: DVec3| values.element_sum() / 3.0;
        if t < end {
            let left = left(t);
            let weight = self.sigma_s.as_dvec3() * left / mean(sigma_t * left);
            Flight { scattered_at: Some(t), weight: weight.as_vec3() }
        } else {
            let left = left(end);
            Flight { scattered_at: None, weight: (left / mean(left)).as_vec3() }
        }
    }
}

/// Distances at which a medium scatters before an end, by the balance heuristic over its channels: those of
/// [`Medium::fly`] with the end not reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteredBefore {
    sigma_t: DVec3,
    end: f64,
    /// Share of each channel that gets to the end, less 1.
    lost: DVec3,
}

impl ScatteredBefore {
    /// `None` where a channel would come back from infinity.
    pub fn new(medium: &Medium, end: f64) -> Option<Self> {
        let sigma_t = medium.sigma_t.as_dvec3();
        let lost = (-sigma_t * end).map(f64::exp_m1);
        let fine = end.is_finite() || sigma_t.min_element() > 0.0;
        (fine && end > 0.0).then_some(Self { sigma_t, end, lost })
    }

    /// A distance by a number in `[0, 1)`.
    pub fn sample(&self, u: f64) -> f64 {
        let channel = ((3.0 * u) as usize).min(2);
        let u = 3.0 * u - channel as f64;
        let (sigma, lost) = (self.sigma_t[channel], self.lost[channel]);
        let t = if lost < 0.0 { -(u * lost).ln_1p() / sigma } else { u * self.end };
        t.min(self.end)
    }

    /// The density of a distance, per metre.
    pub fn pdf(&self, t: f64) -> f64 {
        let of = |channel: usize| {
            let (sigma, lost) = (self.sigma_t[channel], self.lost[channel]);
            if lost < 0.0 { sigma * (-sigma * t).exp() / -lost } else { 1.0 / self.end }
        };
        (of(0) + of(1) + of(2)) / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(sigma_s: Rgb, sigma_a: Rgb) -> Medium {
        Medium {
            sigma_s,
            sigma_t: sigma_s + sigma_a,
            emission: Rgb::ZERO,
            phase: PhaseFunction::Isotropic,
        }
    }

    /// Closed forms of what glows: with absorption, without, and endless; a colour that does not glow is dark there.
    #[test]
    fn what_glows_is_seen_through_itself() {
        let glow = |absorbed: f32| Medium {
            emission: Rgb::new(2.0, 1.0, 0.0),
            ..medium(Rgb::ZERO, Rgb::new(absorbed, absorbed, 0.0))
        };
        let seen = glow(0.5).emitted(3.0);
        assert!((seen - Rgb::new(3.107_479_4, 1.553_739_7, 0.0)).abs().max_element() < 1e-6);
        assert_eq!(glow(0.0).emitted(3.0), Rgb::new(6.0, 3.0, 0.0));
        assert!((glow(1e-9).emitted(3.0) - Rgb::new(6.0, 3.0, 0.0)).abs().max_element() < 1e-6);
        assert_eq!(glow(0.5).emitted(f64::INFINITY), Rgb::new(4.0, 2.0, 0.0));
    }

    /// Distances before an end: the densities integrate to 1 and are those of what is drawn, thin and thick.
    #[test]
    fn distances_before_an_end() {
        for (sigma, end) in [(0.0, 2.0), (1e-9, 2.0), (0.7, 2.0), (1e9, 2.0), (0.7, f64::INFINITY)]
        {
            let fog = medium(Rgb::splat(sigma), Rgb::ZERO);
            let Some(before) = ScatteredBefore::new(&fog, end) else { panic!("{sigma} {end}") };
            for k in 0..64 {
                // All of a channel, at its middle numbers.
                let (u, h) = ((1.0 + (f64::from(k) + 0.5) / 64.0) / 3.0, 1e-6);
                let [a, t, b] = [u - h, u, u + h].map(|u| before.sample(u));
                assert!(0.0 < t && t < end);
                let expected = 2.0 * h * 3.0 / (b - a);
                let error = (before.pdf(t) / expected - 1.0).abs();
                assert!(error < 1e-3, "{sigma} {end} {u}: {error}");
            }
        }
        let clear = medium(Rgb::new(0.0, 1.0, 1.0), Rgb::ZERO);
        assert_eq!(ScatteredBefore::new(&clear, f64::INFINITY), None);
    }

    /// Closed forms, channel by channel: the share that comes to the end is `exp(−σd)`, what scatters is the albedo times
    /// the rest, and the mean distance is `1/σ`.
    #[test]
    fn flights_follow_beer_and_lambert_in_every_channel() {
        let fog = medium(Rgb::new(0.5, 2.0, 0.0), Rgb::new(0.0, 1.0, 0.0));
        let (n, end) = (1 << 16, 3.0);
        let (mut through, mut scattered, mut far) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for k in 0..n {
            let u = (f64::from(k) + 0.5) / f64::from(n);
            let Flight { scattered_at, weight } = fog.fly(end, u);
            match scattered_at {
                None => through += weight.as_dvec3() / f64::from(n),
                Some(_) => scattered += weight.as_dvec3() / f64::from(n),
            }
            let endless = fog.fly(f64::INFINITY, u);
            let t = endless.scattered_at.unwrap_or(0.0);
            far += endless.weight.as_dvec3() * t / f64::from(n);
        }
        let left = fog.transmittance(end).as_dvec3();
        assert!((left - DVec3::new(0.223_130_2, (-9.0_f64).exp(), 1.0)).abs().max_element() < 1e-6);
        assert!((through - left).abs().max_element() < 1e-3, "{through} instead of {left}");
        let albedo = DVec3::new(1.0, 2.0 / 3.0, 0.0);
        let expected = albedo * (1.0 - left);
        assert!((scattered - expected).abs().max_element() < 2e-3, "{scattered}");
        let expected = DVec3::new(2.0, 2.0 / 9.0, 0.0);
        assert!((far - expected).abs().max_element() < 5e-3, "{far}");
    }

    /// Nothing, next to nothing and stone: finite weights, and what is expected.
    #[test]
    fn extremes_of_extinction() {
        for sigma in [0.0_f32, 1e-9, 1.0, 1e9] {
            let fog = medium(Rgb::splat(sigma), Rgb::new(0.0, sigma, 0.0));
            for u in [0.0, 0.3, 0.5, 1.0_f64.next_down()] {
                for end in [1e-6, 1.0, 1e6, f64::INFINITY] {
                    let Flight { scattered_at, weight } = fog.fly(end, u);
                    assert!(weight.is_finite() && weight.max_element() <= 3.0, "{sigma} {u} {end}");
                    assert!(scattered_at.is_none_or(|t| t < end));
                    assert!(sigma > 0.0 || scattered_at.is_none() && weight == Rgb::ONE);
                }
            }
        }
    }
}
