//! Paths through media of uneven density.
//!
//! All is as in `medium.rs`, but for the densities with which distances are drawn: tracking does not tell them. Where weights are
//! shared a guess stands in for them, [`Medium::density_across`], a function of the way alone; shares of any such function
//! add up to 1, so that the mean stays right.
//!
//! [`Medium::density_across`]: crate::shade::medium::Medium::density_across

use super::medium::{Flown, LOOKS, Stretch, Ways};
use super::path::{PathCounters, PathTracer};
use crate::build::light::Pivot;
use crate::description::Rgb;
use crate::sampling::{Equiangular, Sampler, Stream, dimension};
use crate::shade::medium::{Flight, Passage, Profile};
use crate::shade::nesting::Inside;

impl<const OPACITY: bool, I: Inside> PathTracer<'_, OPACITY, I> {
    /// [`PathTracer::flown`] where the density is uneven.
    pub(super) fn flown_across(
        &self,
        stretch: &Stretch<I>,
        passage: &Passage,
        depth: u32,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> (Rgb, Flown) {
        let Stretch { medium, end, met, .. } = *stretch;
        let flight = dimension::flight(met);
        let u = sampler.one_fine(dimension::vertex(met) + dimension::DISTANCE);
        let mut numbers = Stream::new(&[u, sampler.one_fine(flight + dimension::PIVOT)]);
        let mut gathered = Rgb::ZERO;
        let may_scatter = depth < self.max_depth;
        let lamp = if may_scatter { self.near_lamp(stretch, passage, sampler) } else { None };
        if let Some(lamp) = &lamp {
            let t = lamp.sample(sampler.one_fine(flight + dimension::PIVOT_DISTANCE));
            let scattered = medium.scattered_across(passage, t, &mut numbers);
            let flown = medium.density_across(passage, t);
            let ways = Ways { flown, aimed: lamp.pdf(t), goes_on: true };
            let seen = (t, scattered, dimension::PIVOT_LIGHT);
            gathered += self.light_from(stretch, seen, (ways, ways.aimed), sampler, counters);
        }
        let flown = medium.fly_across(passage, end, u, &mut numbers, &mut gathered);
        let Flight { scattered_at: Some(t), weight } = flown else {
            return (gathered, Flown::Through(flown.weight));
        };
        let ways = match &lamp {
            Some(lamp) => {
                Ways { flown: medium.density_across(passage, t), aimed: lamp.pdf(t), goes_on: true }
            }
            None => Ways { flown: 1.0, aimed: 0.0, goes_on: true },
        };
        let scattered = (t, weight, may_scatter.then_some(ways));
        let (light, flown) = self.deflected(stretch, scattered, sampler, counters);
        (gathered + light, flown)
    }

    /// [`PathTracer::scattered_once`] where the density is uneven.
    pub(super) fn scattered_once_across(
        &self,
        stretch: &Stretch<I>,
        (passage, profile): (&Passage, &Profile),
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Rgb {
        let Stretch { medium, end, met, .. } = *stretch;
        let flight = dimension::flight(met);
        let lamp = self.near_lamp(stretch, passage, sampler);
        // What the looks together draw, as far as is known.
        let all = medium.scattered_by(passage, end);
        let ways = |t: f64| match &lamp {
            Some(lamp) if all > 0.0 => Ways {
                flown: f64::from(LOOKS) * medium.density_across(passage, t) / all,
                aimed: lamp.pdf(t),
                goes_on: false,
            },
            _ => Ways { flown: 1.0, aimed: 0.0, goes_on: false },
        };
        let mut light = Rgb::ZERO;
        let u = sampler.one_fine(flight + dimension::BEFORE_DISTANCE);
        for look in 0..LOOKS {
            let u = (f64::from(look) + u) / f64::from(LOOKS);
            let Some((t, scattered)) = profile.scatter(u) else { break };
            let ways = ways(t);
            if ways.flown > 0.0 {
                let seen = (t, scattered / LOOKS as f32, dimension::BEFORE_LIGHT + 3 * look);
                let found = self.light_from(stretch, seen, (ways, ways.flown), sampler, counters);
                // How densely looks are drawn is in what is scattered.
                light += found * ways.flown as f32;
            }
        }
        if let Some(lamp) = lamp.as_ref().filter(|_| all > 0.0) {
            let t = lamp.sample(sampler.one_fine(flight + dimension::PIVOT_DISTANCE));
            let scattered = medium.sigma_s * passage.at(t) * profile.left(t);
            let (ways, seen) = (ways(t), (t, scattered, dimension::PIVOT_LIGHT));
            light += self.light_from(stretch, seen, (ways, ways.aimed), sampler, counters);
        }
        light
    }

    /// How a second distance is drawn on a stretch; `None` where the light that would be chosen is not near, or nothing
    /// scatters.
    fn near_lamp(
        &self,
        stretch: &Stretch<I>,
        passage: &Passage,
        sampler: &Sampler,
    ) -> Option<Equiangular> {
        let Stretch { medium, ray, end, met, .. } = *stretch;
        if medium.sigma_s == Rgb::ZERO {
            return None;
        }
        let (near, far) = passage.within(end)?;
        let flight = dimension::flight(met);
        let place = near + (far - near) * sampler.one_fine(flight + dimension::PIVOT_PLACE);
        let choose = sampler.one_fine(flight + dimension::PIVOT);
        match self.scene.lights.pivot(ray.at(place).as_vec3(), ray.time, choose)? {
            Pivot::Near { centre, radius } => {
                Equiangular::new(ray.o.as_dvec3(), ray.d.as_dvec3(), end, centre, radius)
            }
            Pivot::Far => None,
        }
    }
}
