//! Paths through media which scatter light.

use super::path::{Arrival, Path, PathCounters, PathTracer};
use crate::build::bvh::Hit;
use crate::build::light::Receiver;
use crate::description::Rgb;
use crate::math::Ray;
use crate::sampling::{Sampler, dimension, power_heuristic};
use crate::shade::medium::{Flight, HenyeyGreenstein, Medium};
use crate::shade::nesting::Inside;
use glam::{DVec3, Vec2};

impl<'a, const OPACITY: bool, I: Inside> PathTracer<'a, OPACITY, I> {
    /// The medium around a path, if it scatters.
    #[inline]
    pub(super) fn medium(&self, inside: &I) -> Option<Medium> {
        self.scene.surfaces.materials.medium(inside.medium())
    }

    /// Lets a path fly through the medium around it to what it would hit. `None` where it gets there; else it has
    /// scattered, and this is whether it goes on.
    ///
    /// At a point of the medium it does what it does at a surface, with the phase function in place of the BSDF.
    pub(super) fn fly<const SHARE: bool>(
        &self,
        path: &mut Path<'a, I>,
        hit: Option<&Hit>,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Option<bool> {
        let medium = self.medium(&path.inside)?;
        let dimensions = dimension::vertex(path.met);
        let end = hit.map_or(f64::INFINITY, |hit| hit.t);
        let flight = medium.fly(end, sampler.one_fine(dimensions + dimension::DISTANCE));
        path.throughput *= flight.weight;
        let Flight { scattered_at: Some(t), .. } = flight else { return None };
        path.met += 1;
        if path.depth == self.max_depth {
            counters.truncated += 1;
            return Some(false);
        }
        if path.throughput == Rgb::ZERO {
            return Some(false);
        }
        path.cone.advance(t);
        let p = path.ray.at(t);
        let here = -path.ray.d;
        let receiver = Receiver {
            p,
            p_error: DVec3::ZERO,
            ng: here,
            facing: here,
            horizon: None,
            draws_both: false,
        };
        let (to_scatter, on_light) =
            sampler.four(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
        let choose = sampler.one_fine(dimensions + dimension::LIGHT);
        let light =
            self.direct_in_medium(path, medium.phase, &receiver, (choose, on_light), counters);
        path.radiance += self.limited(path.throughput * light, path.depth);
        let (wi, pdf) = medium.phase.sample(path.ray.d, to_scatter);
        path.depth += 1;
        if !path.cone.is_ray() {
            path.cone.scatter(pdf, self.samples as f32);
        }
        if path.depth >= self.roulette_depth
            && !path.survives::<SHARE>(
                sampler.one(dimensions + dimension::ROULETTE),
                self.roulette_gain,
            )
        {
            return Some(false);
        }
        (path.ray.o, path.ray.d) = (p.as_vec3(), wi);
        path.arrival = Arrival::Drawn { from: receiver, pdf };
        Some(true)
    }

    /// Light which arrives straight from a light and is scattered along the path, by one connection.
    fn direct_in_medium(
        &self,
        path: &Path<'a, I>,
        phase: HenyeyGreenstein,
        receiver: &Receiver,
        (choose, on_light): (f64, Vec2),
        counters: &mut PathCounters,
    ) -> Rgb {
        let time = path.ray.time;
        let Some(light) = self.scene.lights.sample(receiver, time, choose, on_light) else {
            return Rgb::ZERO;
        };
        // What goes to the light was deflected by as much as what comes from there.
        let density = phase.density(light.wi.dot(path.ray.d));
        let (shadow_ray, end) = light.shadow_ray(receiver, time);
        counters.rays += 1;
        let left = self.transmitted(&shadow_ray, end, &path.inside);
        let weight = if light.delta { 1.0 } else { power_heuristic(light.pdf, density) };
        light.radiance * left * (density * weight / light.pdf)
    }

    /// Share of the light which is left along a segment that begins inside `inside`: what holes let pass, times what
    /// is not absorbed or scattered on the way. Surfaces between equal indices are none.
    pub(super) fn transmitted(&self, shadow_ray: &Ray, end: f64, inside: &I) -> Rgb {
        let mut left = Rgb::ONE;
        let passed = self.passed(shadow_ray, end, inside, |inside, distance| {
            left *= self.left_after(inside, distance);
        });
        left * passed
    }

    /// Share of light which is left after a distance in metres in what is around a path.
    fn left_after(&self, inside: &I, distance: f64) -> Rgb {
        match self.medium(inside) {
            Some(medium) => medium.transmittance(distance),
            None => self.transmittance(inside, distance),
        }
    }
}
