//! Paths from the camera which gather photons in media.
//!
//! With `M` a place in a medium where light is scattered, it belongs to the techniques of `eye.rs` as a `D` does. Where
//! photons bring all but the light of lamps itself (`Sppm`, `PhotonMap`), a path crosses media without being scattered: what
//! light rays bring is looked for along the way, and photons are gathered along all of it. With `Path` it is scattered as
//! a path is, and gathers caustics alone.

use super::eye::{Context, EyeTracer, Since, Task, Walk};
use super::medium::{Deflection, Flown, LOOKS, Stretch};
use crate::build::bvh::Hit;
use crate::build::photon::{Photon, VolumeMap};
use crate::description::{DirectLight, Rgb};
use crate::extract::Method;
use crate::sampling::{Sampler, Stream, dimension};
use crate::shade::medium::{Fate, Medium, Profile};
use crate::shade::nesting::Inside;

impl<const OPACITY: bool, I: Inside> EyeTracer<'_, OPACITY, I> {
    /// Takes a path through the medium around it towards what it would hit.
    pub(super) fn cross(
        &self,
        walk: &mut Walk<I>,
        hit: Option<&Hit>,
        sampler: &Sampler,
        context: &mut Context,
    ) -> Fate {
        let (ray, inside) = (walk.ray, walk.inside);
        let Some(stretch) = self.path.stretch(&ray, &inside, hit, walk.met) else {
            return Fate::Through;
        };
        let left = Left::new(&stretch, sampler);
        let scatters = self.method == Method::PathWithPhotons && walk.task != Task::Lamp;
        let (light, flown) = if scatters {
            let (light, flown) = self.path.flown(&stretch, walk.depth, sampler, context.counters);
            let caustics = self.maps.volume_caustics;
            (light + self.along(caustics, &stretch, &left, walk.depth, |_| true), flown)
        } else {
            let light = if matches!(walk.task, Task::Lamp | Task::Leftover) {
                Rgb::ZERO
            } else {
                self.gathered_along(walk, &stretch, &left, sampler, context)
            };
            (light, Flown::Through(left.at(stretch.end)))
        };
        context.sample.radiance += self.path.limited(walk.throughput * light, walk.depth);
        let deflection = match flown {
            Flown::Through(left) => {
                walk.throughput *= left;
                return Fate::Through;
            }
            Flown::Ended => return Fate::Ended,
            Flown::Scattered(deflection) => deflection,
        };
        let Deflection { p, t, wi, pdf, weight, arrival } = deflection;
        walk.throughput *= weight;
        walk.depth += 1;
        walk.length += t;
        walk.cone.advance(t);
        if !walk.cone.is_ray() {
            walk.cone.scatter(pdf, self.path.samples as f32);
        }
        walk.since = Since::Diffuse;
        let roulette = dimension::vertex(walk.met) + dimension::ROULETTE;
        walk.met += 1;
        (walk.ray.o, walk.ray.d, walk.arrival) = (p.as_vec3(), wi, arrival);
        if self.survives(walk, || sampler.one(roulette)) { Fate::Scattered } else { Fate::Ended }
    }

    /// All light that is scattered towards the path on a stretch, where photons bring it.
    fn gathered_along(
        &self,
        walk: &Walk<I>,
        stretch: &Stretch<I>,
        left: &Left,
        sampler: &Sampler,
        context: &mut Context,
    ) -> Rgb {
        let photons_alone =
            self.method == Method::Sppm && self.settings.direct == DirectLight::Photons;
        if walk.task == Task::Reads || photons_alone {
            return self.along(self.maps.volume, stretch, left, walk.depth, |_| true);
        }
        let mut light = Rgb::ZERO;
        if walk.depth < self.path.max_depth {
            let counters = &mut *context.counters;
            light += match (left, &stretch.passage) {
                (Left::Estimated(profile), Some(passage)) => {
                    let way = (passage, profile);
                    self.path.scattered_once_across(stretch, way, sampler, counters)
                }
                _ => self.path.scattered_once(stretch, sampler, counters),
            };
        }
        let apart = self.method == Method::PhotonMap;
        let kept = |photon: &Photon| photon.depth > 0 && !(apart && photon.caustic);
        light += self.along(self.maps.volume, stretch, left, walk.depth, kept);
        if apart {
            light += self.along(self.maps.volume_caustics, stretch, left, walk.depth, |_| true);
        }
        light
    }

    /// The beam radiance estimate `Σ T Φ p K` along a stretch. The photons of a medium have its scattering coefficient in
    /// their power.
    fn along(
        &self,
        map: &VolumeMap,
        stretch: &Stretch<I>,
        left: &Left,
        depth: u32,
        kept: impl Fn(&Photon) -> bool,
    ) -> Rgb {
        let allowed = self.path.max_depth.saturating_sub(depth);
        let kernel = self.settings.kernel;
        let Stretch { medium, ray, end, .. } = *stretch;
        let mut light = Rgb::ZERO;
        map.along(ray, end as f32, |photon, t, distance2, radius2| {
            if u32::from(photon.depth) < allowed && kept(photon) {
                let deflected = medium.phase.density(photon.wi().dot(ray.d));
                let left = left.at(f64::from(t));
                light += photon.power * left * (deflected * kernel.weight(distance2, radius2));
            }
        });
        light
    }
}

/// What is left of the light along a stretch.
enum Left {
    Even(Medium),
    Estimated(Profile),
}

impl Left {
    fn new<I>(stretch: &Stretch<I>, sampler: &Sampler) -> Self {
        let Stretch { medium, passage, end, met, .. } = stretch;
        let Some(passage) = passage else { return Self::Even(*medium) };
        let dimensions = dimension::flight(*met);
        let drawn = [dimension::PIVOT, dimension::BEFORE_DISTANCE];
        let drawn = drawn.map(|dimension| sampler.one_fine(dimensions + dimension));
        let least = 2.0 * f64::from(LOOKS);
        Self::Estimated(Profile::new(medium, passage, *end, least, &mut Stream::new(&drawn)))
    }

    fn at(&self, t: f64) -> Rgb {
        match self {
            Self::Even(medium) => medium.transmittance(t),
            Self::Estimated(profile) => profile.left(t),
        }
    }
}
