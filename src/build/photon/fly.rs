//! Photons in media.

use super::trace::Walk;
use super::{Keep, Photon, PhotonCounters, PhotonTracer};
use crate::build::bvh::Hit;
use crate::description::Rgb;
use crate::sampling::{Sampler, Stream, dimension};
use crate::shade::medium::Fate;
use crate::shade::nesting::Inside;

impl<const OPACITY: bool, I: Inside> PhotonTracer<'_, OPACITY, I> {
    /// Lets a photon fly through what is around it to what it would hit. Where it is scattered it is left, with the
    /// scattering coefficient in its power: how densely such photons lie is the light that is scattered, per cubic metre.
    pub(super) fn fly(
        &self,
        walk: &mut Walk<I>,
        hit: Option<&Hit>,
        sampler: &Sampler,
        photons: &mut Vec<Photon>,
        counters: &mut PhotonCounters,
    ) -> Fate {
        let around = walk.inside.medium();
        let end = hit.map_or(f64::INFINITY, |hit| hit.t);
        let Some(medium) = self.scene.materials.medium(around) else {
            walk.power *= self.scene.materials.transmittance(around, end);
            return Fate::Through;
        };
        let before = walk.power.max_element();
        let dimensions = dimension::vertex(walk.met);
        let u = sampler.one_fine(dimensions + dimension::DISTANCE);
        let flight = match self.scene.passage(&walk.inside, &walk.ray) {
            None => medium.fly(end, u),
            Some(passage) => {
                let more = sampler.one_fine(dimension::flight(walk.met));
                let mut numbers = Stream::new(&[u, more]);
                // What glows sends no photons.
                medium.fly_across(&passage, end, u, &mut numbers, &mut Rgb::default())
            }
        };
        walk.power *= flight.weight;
        let Some(t) = flight.scattered_at else { return Fate::Through };
        walk.met += 1;
        walk.ray.o = walk.ray.at(t).as_vec3();
        let caustic = walk.only_specular && walk.depth > 0;
        let (wi, power) = (-walk.ray.d, walk.power);
        if self.keeps(walk.depth, caustic) && power != Rgb::ZERO && power.is_finite() {
            photons.push(Photon::new(walk.ray.o, power, wi, wi, walk.depth, caustic));
        }
        walk.only_specular = false;
        if self.keep == Keep::Caustics {
            return Fate::Ended;
        }
        // What is left here has met at most `max_depth` surfaces and places in media with this one.
        if walk.depth + 1 >= self.max_depth {
            counters.truncated += 1;
            return Fate::Ended;
        }
        let survival = (walk.power.max_element() / before).min(1.0);
        let u = sampler.one(dimensions + dimension::ROULETTE);
        if u >= survival || survival.is_nan() {
            return Fate::Ended;
        }
        walk.power /= survival;
        walk.depth += 1;
        let direction = sampler.two(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
        walk.ray.d = medium.phase.sample(walk.ray.d, direction).0;
        Fate::Scattered
    }
}
