//! Paths from the camera which gather photons in media.
//!
//! With `M` a place in a medium where light is scattered, it belongs to the techniques of `eye.rs` as a `D` does. Where
//! photons bring all but the light of lamps itself (`Sppm`, `PhotonMap`), a path crosses media without being scattered: what
//! light rays bring is looked for along the way, and photons are gathered along all of it. With `Path` it is scattered as
//! a path is, and gathers caustics alone.

use super::eye::{Context, EyeTracer, Since, Walk};
use super::medium::{Deflection, Flown, Stretch};
use crate::build::bvh::Hit;
use crate::build::photon::{Photon, VolumeMap};
use crate::description::{DirectLight, Rgb};
use crate::extract::Method;
use crate::sampling::{Sampler, dimension};
use crate::shade::nesting::Inside;

/// What became of a path in a medium.
pub(super) enum Crossing {
    Through,
    Scattered,
    Ended,
}

impl<const OPACITY: bool, I: Inside> EyeTracer<'_, OPACITY, I> {
    /// Takes a path through the medium around it towards what it would hit.
    pub(super) fn cross(
        &self,
        walk: &mut Walk<I>,
        hit: Option<&Hit>,
        sampler: &Sampler,
        context: &mut Context,
    ) -> Crossing {
        let end = hit.map_or(f64::INFINITY, |hit| hit.t);
        let Some(medium) = self.path.medium(&walk.inside) else { return Crossing::Through };
        let (ray, inside) = (walk.ray, walk.inside);
        let stretch = Stretch { medium, ray: &ray, end, inside: &inside, met: walk.met };
        let scatters = self.method == Method::PathWithPhotons && !walk.last;
        let (light, flown) = if scatters {
            let (light, flown) = self.path.flown(&stretch, walk.depth, sampler, context.counters);
            (light + self.along(self.maps.volume_caustics, &stretch, walk.depth, |_| true), flown)
        } else {
            let light = if walk.last {
                Rgb::ZERO
            } else {
                self.gathered_along(walk, &stretch, sampler, context)
            };
            (light, Flown::Through(medium.transmittance(end)))
        };
        context.sample.radiance += self.path.limited(walk.throughput * light, walk.depth);
        let deflection = match flown {
            Flown::Through(left) => {
                walk.throughput *= left;
                return Crossing::Through;
            }
            Flown::Ended => return Crossing::Ended,
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
        if self.survives(walk, || sampler.one(roulette)) {
            Crossing::Scattered
        } else {
            Crossing::Ended
        }
    }

    /// All light that is scattered towards the path on a stretch, where photons bring it.
    fn gathered_along(
        &self,
        walk: &Walk<I>,
        stretch: &Stretch<I>,
        sampler: &Sampler,
        context: &mut Context,
    ) -> Rgb {
        let photons_alone =
            self.method == Method::Sppm && self.settings.direct == DirectLight::Photons;
        if walk.reads || photons_alone {
            return self.along(self.maps.volume, stretch, walk.depth, |_| true);
        }
        let mut light = Rgb::ZERO;
        if walk.depth < self.path.max_depth {
            light += self.path.scattered_once(stretch, sampler, context.counters);
        }
        let apart = self.method == Method::PhotonMap;
        let kept = |photon: &Photon| photon.depth > 0 && !(apart && photon.caustic);
        light += self.along(self.maps.volume, stretch, walk.depth, kept);
        if apart {
            light += self.along(self.maps.volume_caustics, stretch, walk.depth, |_| true);
        }
        light
    }

    /// The beam radiance estimate `Σ T Φ p K` along a stretch. The photons of a medium have its scattering coefficient in
    /// their power.
    fn along(
        &self,
        map: &VolumeMap,
        stretch: &Stretch<I>,
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
                let left = medium.transmittance(f64::from(t));
                light += photon.power * left * (deflected * kernel.weight(distance2, radius2));
            }
        });
        light
    }
}
