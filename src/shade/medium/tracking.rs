//! Flights through media of uneven density, without bias.
//!
//! A path meets what the medium would hold if it had the greatest density of each cell everywhere; what is met is real with the
//! share of the density there, and nothing else (delta tracking: Woodcock et al. 1965). Going on through all of it with
//! that share taken out each time gives the share of light that is left (ratio tracking: Novák, Selle and Jarosz 2014,
//! "Residual Ratio Tracking for Estimating Attenuation in Participating Media", ACM TOG 33(6)).
//!
//! Where channels differ, whether something is real is decided by what each of them has left; the sum of the channels
//! then stays what it was (Kutz et al. 2017, "Spectral and Decomposition Tracking for Rendering Heterogeneous Volumes",
//! ACM TOG 36(4)). A density above its bound makes weights of what is not real negative: the mean stays right, and it is counted.

use super::density::{Cells, Passage};
use super::{Flight, Medium};
use crate::description::Rgb;
use crate::sampling::Stream;
use glam::DVec3;
use std::sync::atomic::Ordering::Relaxed;

/// Light of which less than this share is left goes on by roulette.
const FAINT: f64 = 0.05;

/// What may be met on a way, in order.
struct Tentative<'a> {
    cells: Cells<'a>,
    /// Coefficient per metre at a density of 1.
    sigma: f64,
    /// Where the way stands, where its cell ends, and the coefficient there.
    t: f64,
    end: f64,
    bar: f64,
}

impl<'a> Tentative<'a> {
    fn new(passage: &Passage<'a>, end: f64, sigma: f64) -> Self {
        Self { cells: passage.cells(end), sigma, t: 0.0, end: 0.0, bar: 0.0 }
    }

    /// Where something may be met next, after this optical depth, and the coefficient there.
    #[inline]
    fn next(&mut self, mut depth: f64) -> Option<(f64, f64)> {
        loop {
            let here = self.bar * (self.end - self.t);
            if depth < here {
                self.t += depth / self.bar;
                return Some((self.t, self.bar));
            }
            depth -= here;
            let part = self.cells.next()?;
            (self.t, self.end, self.bar) =
                (part.begin, part.end, self.sigma * f64::from(part.most));
        }
    }
}

impl Medium {
    /// The coefficient with which something is met at a density of 1: that of the thickest channel. What glows without holding
    /// light back is met a few times on a way of `length` metres, so that it is seen.
    fn thickest(&self, length: f64) -> f64 {
        /// Places at which a way looks at what glows, if it is thin.
        const GLOWS: f64 = 2.0;
        let thickest = f64::from(self.sigma_t.max_element());
        if self.emission == Rgb::ZERO { thickest } else { thickest.max(GLOWS / length) }
    }

    /// The density at a place, as a share of its bound; what exceeds that is counted.
    fn met(&self, passage: &Passage, t: f64, bar: f64) -> (f64, DVec3) {
        let density = f64::from(passage.at(t));
        let share = self.sigma_t.as_dvec3() * density / bar;
        if share.max_element() > 1.0 {
            passage.exceeded.fetch_add(1, Relaxed);
        }
        (density, share)
    }

    /// [`Medium::fly`] where the density is uneven; adds what glows on the way, as far as it comes back to the beginning. `u` in
    /// `[0, 1)` draws the first distance.
    pub fn fly_across(
        &self,
        passage: &Passage,
        end: f64,
        u: f64,
        numbers: &mut Stream,
        emitted: &mut Rgb,
    ) -> Flight {
        let through = |weight: DVec3| Flight { scattered_at: None, weight: weight.as_vec3() };
        let Some((near, far)) = passage.within(end) else { return through(DVec3::ONE) };
        let (mut weight, scatters) = (DVec3::ONE, self.sigma_s != Rgb::ZERO);
        let mut tentative = Tentative::new(passage, end, self.thickest(far - near));
        let mut depth = -(-u).ln_1p();
        while let Some((t, bar)) = tentative.next(depth) {
            let (density, share) = self.met(passage, t, bar);
            *emitted += (weight * self.emission.as_dvec3() * (density / bar)).as_vec3();
            let (real, other) = (weight * share, weight * (1.0 - share));
            if scatters {
                let mean = |channels: DVec3| channels.abs().element_sum();
                let p = mean(real) / (mean(real) + mean(other));
                if numbers.draw() < p {
                    let albedo = self.sigma_s.as_dvec3() / self.sigma_t.as_dvec3();
                    // 0 by 0 where a channel meets nothing.
                    let albedo = albedo.map(|albedo| if albedo.is_nan() { 0.0 } else { albedo });
                    return Flight { scattered_at: Some(t), weight: (real / p * albedo).as_vec3() };
                }
                weight = other / (1.0 - p);
            } else {
                weight = other;
                if !survives(&mut weight, numbers) {
                    break;
                }
            }
            depth = numbers.exponential();
        }
        through(weight)
    }

    /// Share of light which is left after a distance: an estimate.
    pub fn left_across(&self, passage: &Passage, end: f64, numbers: &mut Stream) -> Rgb {
        let mut left = DVec3::ONE;
        let mut tentative = Tentative::new(passage, end, f64::from(self.sigma_t.max_element()));
        while let Some((t, bar)) = tentative.next(numbers.exponential()) {
            left *= 1.0 - self.met(passage, t, bar).1;
            if !survives(&mut left, numbers) {
                break;
            }
        }
        left.as_vec3()
    }

    /// What is scattered per metre at a distance, of the light that set out: an estimate.
    pub fn scattered_across(&self, passage: &Passage, t: f64, numbers: &mut Stream) -> Rgb {
        let density = passage.at(t);
        if density == 0.0 || self.sigma_s == Rgb::ZERO {
            return Rgb::ZERO;
        }
        self.sigma_s * density * self.left_across(passage, t, numbers)
    }

    /// About the density per metre with which [`Medium::fly_across`] draws a distance: a function of nothing but the way, so
    /// that it may stand in for the density when weights are shared.
    pub fn density_across(&self, passage: &Passage, t: f64) -> f64 {
        let (here, depth) = passage.expected(t);
        let sigma_t = self.sigma_t.as_dvec3();
        (sigma_t * here * (-sigma_t * depth).map(f64::exp)).element_sum() / 3.0
    }

    /// About the probability with which [`Medium::fly_across`] scatters before an end.
    pub fn scattered_by(&self, passage: &Passage, end: f64) -> f64 {
        let depth = passage.expected(end).1;
        (-self.sigma_t.as_dvec3() * depth).map(|depth| -depth.exp_m1()).element_sum() / 3.0
    }
}

/// Roulette for light of which little is left: whether it goes on.
fn survives(left: &mut DVec3, numbers: &mut Stream) -> bool {
    let most = left.abs().max_element();
    if most >= FAINT {
        return true;
    }
    let survival = most / FAINT;
    if numbers.draw() >= survival {
        *left = DVec3::ZERO;
        return false;
    }
    *left /= survival;
    true
}

/// The share of light that is left along a way: an estimate for all its places at once, by the same numbers.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    /// Places where something was met, and what is left after each.
    steps: Vec<(f64, Rgb)>,
    /// What may be scattered at each of them: the scattering coefficient over that with which places are met, times
    /// what is left before it.
    scattered: Vec<Rgb>,
}

impl Profile {
    /// Goes along a way before `end`, and meets at least about `least` places where there is any density.
    pub fn new(
        medium: &Medium,
        passage: &Passage,
        end: f64,
        least: f64,
        numbers: &mut Stream,
    ) -> Self {
        let most: f64 =
            passage.cells(end).map(|part| f64::from(part.most) * (part.end - part.begin)).sum();
        let mut profile = Self::default();
        if most == 0.0 {
            return profile;
        }
        let sigma = f64::from(medium.sigma_t.max_element()).max(least / most);
        let mut tentative = Tentative::new(passage, end, sigma);
        let mut left = DVec3::ONE;
        while let Some((t, bar)) = tentative.next(numbers.exponential()) {
            let (density, share) = medium.met(passage, t, bar);
            profile.scattered.push((left * medium.sigma_s.as_dvec3() * (density / bar)).as_vec3());
            left *= 1.0 - share;
            let goes_on = survives(&mut left, numbers);
            profile.steps.push((t, left.as_vec3()));
            if !goes_on {
                break;
            }
        }
        profile
    }

    /// What is left at a distance.
    pub fn left(&self, t: f64) -> Rgb {
        let passed = self.steps.partition_point(|(place, _)| *place < t);
        passed.checked_sub(1).map_or(Rgb::ONE, |last| self.steps[last].1)
    }

    /// One of the places by a number in `[0, 1)`, drawn by how much is scattered there: the distance, and what stands for
    /// what is scattered on the whole way.
    pub fn scatter(&self, u: f64) -> Option<(f64, Rgb)> {
        let size = |scattered: &Rgb| f64::from(scattered.abs().max_element());
        let total: f64 = self.scattered.iter().map(size).sum();
        let mut rest = u * total;
        let mut drawn = None;
        for ((t, _), scattered) in self.steps.iter().zip(&self.scattered) {
            let size = size(scattered);
            if size > 0.0 {
                drawn = Some((*t, *scattered * (total / size) as f32));
                if rest < size {
                    break;
                }
                rest -= size;
            }
        }
        drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Falloff, PhaseFunction, Texture, TextureFiltering, Value};
    use crate::math::Ray;
    use crate::shade::medium::Density;
    use crate::shade::{Pyramids, Textures};
    use glam::{DAffine3, Vec3};
    use std::sync::atomic::AtomicU64;

    /// From density `a` at z = 0 to `b` at z = −4.
    fn ramp(a: f32, b: f32, falloff: Falloff) -> Textures {
        let [a, b] = [a, b].map(|value| Value::Constant(Rgb::splat(value)));
        let ramp = Texture::Ramp { from: Vec3::ZERO, to: -4.0 * Vec3::Z, falloff, a, b };
        Textures::new(vec![ramp], TextureFiltering::Point, &Pyramids::default())
    }

    fn medium(sigma_s: Rgb, sigma_t: Rgb) -> Medium {
        Medium { sigma_s, sigma_t, emission: Rgb::ZERO, phase: PhaseFunction::Isotropic }
    }

    /// A box of 2 × 2 × 4 m, perhaps with another bound, and a ray through its middle from 1 m before it; how often the
    /// bound was exceeded.
    fn across(textures: &Textures, bound: Option<f32>, mut look: impl FnMut(&Passage)) -> u64 {
        let (min, max) = (DVec3::new(-1.0, -1.0, -4.0), DVec3::new(1.0, 1.0, 0.0));
        let density = Density::new(textures, 0, min, max);
        let density = bound.map_or_else(|| density.clone(), |most| density.clone().bounded(most));
        let ray = Ray { o: Vec3::Z, d: Vec3::NEG_Z, time: 0.0 };
        let exceeded = AtomicU64::new(0);
        look(&Passage::new(&density, textures, &ray, &DAffine3::IDENTITY, &exceeded));
        exceeded.into_inner()
    }

    /// Mean and variance of numbers that a stream makes.
    fn moments(count: u32, mut number: impl FnMut(&mut Stream) -> f64) -> (f64, f64) {
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..count {
            let x = number(&mut Stream::new(&[f64::from(k)]));
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(count);
        (mean, squares / f64::from(count) - mean * mean)
    }

    /// Closed forms, five standard errors: what is left after `∫σ` for densities that grow linearly and decay
    /// exponentially, by ratio tracking, by delta tracking, and along a whole profile.
    #[test]
    fn what_is_left_is_that_of_the_closed_form() {
        type Depth = fn(f64) -> f64;
        let n = 40_000;
        let cases: [(f32, f32, Falloff, Depth); 3] = [
            (0.0, 1.0, Falloff::Linear, |z: f64| z * z / 8.0),
            (1.0, 0.01, Falloff::Exponential, |z: f64| {
                let rate = -(0.01_f64.ln()) / 4.0;
                (1.0 - (-rate * z).exp()) / rate
            }),
            (0.3, 0.3, Falloff::Linear, |z: f64| 0.3 * z),
        ];
        for (a, b, falloff, depth) in cases {
            let textures = ramp(a, b, falloff);
            let fog = medium(Rgb::splat(0.4), Rgb::splat(0.9));
            let exceeded = across(&textures, None, |passage| {
                for z in [1.0, 2.5, 4.0] {
                    let expected = (-0.9 * depth(z)).exp();
                    let check = |what: &str, (mean, variance): (f64, f64)| {
                        let error = (variance / f64::from(n)).sqrt();
                        assert!(
                            (mean - expected).abs() < 5.0 * error + 1e-6,
                            "{what}, {a} to {b} over {z} m: {mean} ± {error} is not {expected}"
                        );
                    };
                    let left = |numbers: &mut Stream| {
                        f64::from(fog.left_across(passage, 1.0 + z, numbers).x)
                    };
                    check("ratio tracking", moments(n, left));
                    let flown = |numbers: &mut Stream| {
                        let u = numbers.draw();
                        let mut emitted = Rgb::ZERO;
                        let flight = fog.fly_across(passage, 1.0 + z, u, numbers, &mut emitted);
                        if flight.scattered_at.is_none() { f64::from(flight.weight.x) } else { 0.0 }
                    };
                    check("delta tracking", moments(n, flown));
                    let profile = |numbers: &mut Stream| {
                        let profile = Profile::new(&fog, passage, 5.0, 8.0, numbers);
                        f64::from(profile.left(1.0 + z).x)
                    };
                    check("profile", moments(n, profile));
                }
            });
            assert_eq!(exceeded, 0, "a density is above its bound");
        }
    }

    /// Closed forms: with a bound `σ̄` above what is there the second moment of ratio tracking is
    /// `exp(−σ̄d + σ̄d(1 − σ/σ̄)²)`, and the variance of delta tracking that of a coin, `T(1 − T)`; σ = 0.5, σ̄ = 2, 3 m.
    #[test]
    fn variances_are_those_of_the_closed_form() {
        let (n, textures) = (400_000, ramp(0.5, 0.5, Falloff::Linear));
        let fog = medium(Rgb::splat(0.5), Rgb::ONE);
        let exceeded = across(&textures, Some(2.0), |passage| {
            let left = |numbers: &mut Stream| f64::from(fog.left_across(passage, 4.0, numbers).x);
            let (mean, variance) = moments(n, left);
            // Roulette below 0.05 adds to the variance where as little is left.
            assert!((mean - 0.223_130_2).abs() < 2e-3, "{mean}");
            assert!((variance / 0.022_652_7 - 1.0).abs() < 0.02, "{variance}");
            let flown = |numbers: &mut Stream| {
                let flight =
                    fog.fly_across(passage, 4.0, numbers.draw(), numbers, &mut Rgb::default());
                f64::from(u8::from(flight.scattered_at.is_none()))
            };
            let (mean, variance) = moments(n, flown);
            assert!((mean - 0.223_130_2).abs() < 4e-3, "{mean}");
            assert!((variance / 0.173_343_1 - 1.0).abs() < 0.02, "{variance}");
        });
        assert_eq!(exceeded, 0);
    }

    /// A bound that does not hold is counted, and the mean is what it would be.
    #[test]
    fn what_exceeds_its_bound_is_counted() {
        let (n, textures) = (400_000, ramp(0.5, 0.5, Falloff::Linear));
        let fog = medium(Rgb::splat(0.5), Rgb::ONE);
        let exceeded = across(&textures, Some(0.4), |passage| {
            let left = |numbers: &mut Stream| f64::from(fog.left_across(passage, 4.0, numbers).x);
            let flown = |numbers: &mut Stream| {
                let flight =
                    fog.fly_across(passage, 4.0, numbers.draw(), numbers, &mut Rgb::default());
                if flight.scattered_at.is_none() { f64::from(flight.weight.x) } else { 0.0 }
            };
            for (mean, variance) in [moments(n, left), moments(n, flown)] {
                let error = (variance / f64::from(n)).sqrt();
                assert!((mean - 0.223_130_2).abs() < 5.0 * error, "{mean} ± {error}");
            }
        });
        assert!(exceeded > u64::from(n), "{exceeded}");
    }

    /// Channel by channel as if it were alone: what comes through, what is scattered, the mean distance. Closed forms for an
    /// even density of 0.5, five standard errors.
    #[test]
    fn channels_do_not_disturb_each_other() {
        let (n, textures) = (200_000, ramp(0.5, 0.5, Falloff::Linear));
        let (sigma_s, sigma_t) = (Rgb::new(1.0, 4.0, 0.0), Rgb::new(1.0, 6.0, 0.0));
        let fog = medium(sigma_s, sigma_t);
        across(&textures, Some(0.8), |passage| {
            for channel in 0..3 {
                let sigma = 0.5 * f64::from(sigma_t[channel]);
                let left = (-4.0 * sigma).exp();
                let scattered = 0.5 * f64::from(sigma_s[channel]) * (1.0 - left) / sigma;
                let expected = [left, if sigma > 0.0 { scattered } else { 0.0 }];
                for (kind, expected) in expected.into_iter().enumerate() {
                    let (mean, variance) = moments(n, |numbers| {
                        let u = numbers.draw();
                        let flight = fog.fly_across(passage, 5.0, u, numbers, &mut Rgb::default());
                        assert!(flight.weight.is_finite() && flight.weight.max_element() <= 3.0);
                        let is_kind = flight.scattered_at.is_some() == (kind == 1);
                        if is_kind { f64::from(flight.weight[channel]) } else { 0.0 }
                    });
                    let error = (variance / f64::from(n)).sqrt();
                    assert!(
                        (mean - expected).abs() < 5.0 * error + 1e-9,
                        "channel {channel}: {mean} ± {error} is not {expected}"
                    );
                }
            }
        });
    }

    /// What glows: `∫ε·exp(−∫σ)` in closed form, where light is held back, where it is not, and where it is scattered.
    #[test]
    fn what_glows_is_seen_through_itself() {
        let n = 100_000;
        let textures = ramp(0.0, 1.0, Falloff::Linear);
        for (sigma_s, sigma_t) in [(0.0_f32, 0.0_f32), (0.0, 2.0), (1.5, 2.0)] {
            let fog = Medium {
                emission: Rgb::splat(3.0),
                ..medium(Rgb::splat(sigma_s), Rgb::splat(sigma_t))
            };
            // The density is z/4: ∫₀⁴ 3·(z/4)·exp(−σz²/8) dz = 3·(1 − exp(−2σ))/σ.
            let sigma = f64::from(sigma_t);
            let expected = if sigma > 0.0 { -3.0 * (-2.0 * sigma).exp_m1() / sigma } else { 6.0 };
            across(&textures, None, |passage| {
                let (mean, variance) = moments(n, |numbers| {
                    let (u, mut emitted) = (numbers.draw(), Rgb::ZERO);
                    fog.fly_across(passage, 5.0, u, numbers, &mut emitted);
                    f64::from(emitted.x)
                });
                let error = (variance / f64::from(n)).sqrt();
                assert!((mean - expected).abs() < 5.0 * error, "{mean} ± {error}: {expected}");
            });
        }
    }

    /// A profile stands for all that is scattered on its way: its looks have the mean `∫σ_s ρ T = albedo·(1 − T)`, and
    /// distances are drawn by how much is.
    #[test]
    fn looks_stand_for_what_is_scattered() {
        let (n, textures) = (100_000, ramp(0.0, 1.0, Falloff::Linear));
        for sigma_t in [1e-3_f32, 0.5, 20.0] {
            let fog = medium(Rgb::splat(0.5 * sigma_t), Rgb::splat(sigma_t));
            let expected = -0.5 * (-2.0 * f64::from(sigma_t)).exp_m1();
            across(&textures, None, |passage| {
                let (mean, variance) = moments(n, |numbers| {
                    let profile = Profile::new(&fog, passage, 5.0, 8.0, numbers);
                    profile.scatter(numbers.draw()).map_or(0.0, |(_, value)| f64::from(value.x))
                });
                let error = (variance / f64::from(n)).sqrt();
                assert!((mean - expected).abs() < 5.0 * error, "{mean} ± {error}: {expected}");
            });
        }
    }

    /// Nothing, next to nothing and stone: finite, and what is expected.
    #[test]
    fn extremes_of_extinction() {
        let textures = ramp(0.0, 1.0, Falloff::Linear);
        for sigma in [0.0_f32, 1e-9, 1e9] {
            let fog = medium(Rgb::splat(sigma), Rgb::splat(sigma));
            across(&textures, None, |passage| {
                for k in 0..64 {
                    let mut numbers = Stream::new(&[f64::from(k)]);
                    let left = fog.left_across(passage, 5.0, &mut numbers);
                    let flight =
                        fog.fly_across(passage, 5.0, 0.5, &mut numbers, &mut Rgb::default());
                    let thick = sigma > 1.0;
                    assert_eq!(left, if thick { Rgb::ZERO } else { Rgb::ONE });
                    assert_eq!(flight.scattered_at.is_some(), thick);
                    assert!(flight.weight == Rgb::ONE, "{}", flight.weight);
                }
            });
        }
    }
}
