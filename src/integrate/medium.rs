//! Paths through media which scatter light.
//!
//! Light that is scattered once towards a path is looked for at two distances: where the path itself scatters, and
//! where a light may be near. The second is drawn evenly by the angle under which a light sees the path
//! ([`Equiangular`]), the light chosen for a place on the path at random; for one infinitely far away it is drawn by what the medium
//! scatters before the end. Whichever light was chosen, the two densities and that of the phase function share the
//! light by the power heuristic, so that each finds what it is good at: lamps near by, thick fog, large lamps.

use super::path::{Arrival, Path, PathCounters, PathTracer};
use crate::build::bvh::Hit;
use crate::build::light::{Pivot, Receiver};
use crate::description::Rgb;
use crate::math::Ray;
use crate::sampling::{Equiangular, Sampler, Stream, dimension};
use crate::shade::medium::{Flight, Medium, Passage, ScatteredBefore};
use crate::shade::nesting::Inside;
use glam::{DVec3, Vec2, Vec3};

/// Distances at which a path that is not scattered looks for light: gathering photons costs about as much as so many.
pub(super) const LOOKS: u32 = 4;

/// A way through a medium.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'s, I> {
    pub(super) medium: Medium,
    /// The way through it, where its density is uneven.
    pub(super) passage: Option<Passage<'s>>,
    /// What goes through it, from its beginning.
    pub(super) ray: &'s Ray,
    /// Its length, metres.
    pub(super) end: f64,
    pub(super) inside: &'s I,
    /// Which vertex comes next: the numbers of the flight follow from it.
    pub(super) met: u32,
}

/// What became of a path on a stretch.
pub(super) enum Flown {
    /// It got to the end, and this is left of it.
    Through(Rgb),
    Scattered(Deflection),
    Ended,
}

/// A path is scattered in a medium.
pub(super) struct Deflection {
    /// Where, in render space.
    pub(super) p: DVec3,
    /// How far along the stretch, metres.
    pub(super) t: f64,
    /// The new unit direction, and its density.
    pub(super) wi: Vec3,
    pub(super) pdf: f32,
    /// What the throughput is multiplied by.
    pub(super) weight: Rgb,
    pub(super) arrival: Arrival,
}

/// How distances are drawn at which a light is looked for.
#[derive(Clone, Copy)]
pub(super) enum Aimed {
    Towards(Equiangular),
    Before(ScatteredBefore),
}

impl Aimed {
    pub(super) fn sample(&self, u: f64) -> f64 {
        match self {
            Self::Towards(lamp) => lamp.sample(u),
            Self::Before(end) => end.sample(u),
        }
    }

    pub(super) fn pdf(&self, t: f64) -> f64 {
        match self {
            Self::Towards(lamp) => lamp.pdf(t),
            Self::Before(end) => end.pdf(t),
        }
    }
}

/// Densities, per metre, with which two ways draw one distance, and whether the phase function goes on from there after
/// the first of them.
#[derive(Clone, Copy)]
pub(super) struct Ways {
    pub(super) flown: f64,
    pub(super) aimed: f64,
    pub(super) goes_on: bool,
}

impl Ways {
    /// By how much the second way makes light likelier to be found: the root of the sum of squares, over the first.
    fn together(&self) -> f32 {
        1.0_f64.hypot(self.aimed / self.flown) as f32
    }

    /// The weight of light at a distance drawn with the density `own`, over `own`.
    fn share(&self, own: f64, light_pdf: Option<f32>, phase_pdf: f32) -> f32 {
        let square = |x: f64| x * x;
        let (flown, aimed) = (self.flown / own, self.aimed / own);
        let by_phase = match light_pdf {
            Some(light_pdf) if self.goes_on => flown * f64::from(phase_pdf) / f64::from(light_pdf),
            _ => 0.0,
        };
        (1.0 / (square(flown) + square(aimed) + square(by_phase)) / own) as f32
    }
}

impl<'a, const OPACITY: bool, I: Inside> PathTracer<'a, OPACITY, I> {
    /// The way of a path to what it would hit, or to infinity, through the medium around it, if that scatters, glows or
    /// is uneven.
    #[inline]
    pub(super) fn stretch<'s>(
        &self,
        ray: &'s Ray,
        inside: &'s I,
        hit: Option<&Hit>,
        met: u32,
    ) -> Option<Stretch<'s, I>>
    where
        'a: 's,
    {
        let medium = self.medium(inside)?;
        let passage = self.scene.nested().passage(inside, ray);
        let end = hit.map_or(f64::INFINITY, |hit| hit.t);
        Some(Stretch { medium, passage, ray, end, inside, met })
    }

    /// The medium around a path, if it scatters, glows or is uneven.
    #[inline]
    pub(super) fn medium(&self, inside: &I) -> Option<Medium> {
        self.scene.surfaces.materials.medium(inside.medium())
    }

    /// Lets a path fly through the medium around it to what it would hit. `None` where it gets there; else it has
    /// scattered, and this is whether it goes on.
    pub(super) fn fly<const SHARE: bool>(
        &self,
        path: &mut Path<'a, I>,
        hit: Option<&Hit>,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Option<bool> {
        let (ray, inside) = (path.ray, path.inside);
        let stretch = self.stretch(&ray, &inside, hit, path.met)?;
        let (light, flown) = self.flown(&stretch, path.depth, sampler, counters);
        path.radiance += self.limited(path.throughput * light, path.depth);
        let deflection = match flown {
            Flown::Through(left) => {
                path.throughput *= left;
                return None;
            }
            Flown::Ended => return Some(false),
            Flown::Scattered(deflection) => deflection,
        };
        let Deflection { p, t, wi, pdf, weight, arrival } = deflection;
        path.throughput *= weight;
        path.depth += 1;
        path.cone.advance(t);
        if !path.cone.is_ray() {
            path.cone.scatter(pdf, self.samples as f32);
        }
        let roulette = dimension::vertex(path.met) + dimension::ROULETTE;
        path.met += 1;
        (path.ray.o, path.ray.d, path.arrival) = (p.as_vec3(), wi, arrival);
        let goes_on = path.depth < self.roulette_depth
            || path.survives::<SHARE>(sampler.one(roulette), self.roulette_gain);
        Some(goes_on)
    }

    /// What becomes of a path of this depth on a stretch, and the light which it gathers there.
    ///
    /// At a point of the medium it does what it does at a surface, with the phase function in place of the BSDF.
    pub(super) fn flown(
        &self,
        stretch: &Stretch<I>,
        depth: u32,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> (Rgb, Flown) {
        if let Some(passage) = &stretch.passage {
            return self.flown_across(stretch, passage, depth, sampler, counters);
        }
        let Stretch { medium, end, met, .. } = *stretch;
        let dimensions = dimension::vertex(met);
        let mut gathered = Rgb::ZERO;
        if medium.emission != Rgb::ZERO {
            gathered += medium.emitted(end);
        }
        let may_scatter = depth < self.max_depth;
        let aimed = if may_scatter { self.aimed(stretch, sampler) } else { None };
        if let Some(aimed) = &aimed {
            let t =
                aimed.sample(sampler.one_fine(dimension::flight(met) + dimension::PIVOT_DISTANCE));
            let ways = Ways { flown: medium.density(t), aimed: aimed.pdf(t), goes_on: true };
            let seen = (t, medium.scattered(t), dimension::PIVOT_LIGHT);
            gathered += self.light_from(stretch, seen, (ways, ways.aimed), sampler, counters);
        }
        let flown = medium.fly(end, sampler.one_fine(dimensions + dimension::DISTANCE));
        let Flight { scattered_at: Some(t), weight } = flown else {
            return (gathered, Flown::Through(flown.weight));
        };
        let aimed = aimed.map_or(0.0, |aimed| aimed.pdf(t));
        let ways = Ways { flown: medium.density(t), aimed, goes_on: true };
        let scattered = (t, weight, may_scatter.then_some(ways));
        let (light, flown) = self.deflected(stretch, scattered, sampler, counters);
        (gathered + light, flown)
    }

    /// A path has scattered at a distance with a weight: the light of one connection from there, and where it goes on.
    /// `ways` led there; `None` where paths are cut off.
    pub(super) fn deflected(
        &self,
        stretch: &Stretch<I>,
        (t, weight, ways): (f64, Rgb, Option<Ways>),
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> (Rgb, Flown) {
        let Stretch { medium, ray, met, .. } = *stretch;
        let dimensions = dimension::vertex(met);
        counters.truncated += u64::from(ways.is_none());
        let Some(ways) = ways.filter(|_| weight != Rgb::ZERO) else {
            return (Rgb::ZERO, Flown::Ended);
        };
        let p = ray.at(t);
        let receiver = receiver(p, ray);
        let (to_scatter, on_light) =
            sampler.four(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
        let mut light = Rgb::ZERO;
        if ways.flown > 0.0 {
            let drawn = (sampler.one_fine(dimensions + dimension::LIGHT), on_light);
            // The density of the distance is in the weight.
            light = weight
                * self.scattered(stretch, &receiver, drawn, (ways, ways.flown), counters)
                * ways.flown as f32;
        }
        let (wi, pdf) = medium.phase.sample(ray.d, to_scatter);
        let arrival = Arrival::Drawn { from: receiver, pdf: pdf / ways.together() };
        (light, Flown::Scattered(Deflection { p, t, wi, pdf, weight, arrival }))
    }

    /// Light which is scattered once on a stretch, for a path that is not scattered there itself: from a few distances, one in
    /// each part of what is scattered before the end.
    pub(super) fn scattered_once(
        &self,
        stretch: &Stretch<I>,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Rgb {
        let Some(aimed) = self.aimed(stretch, sampler) else { return Rgb::ZERO };
        let before = ScatteredBefore::new(&stretch.medium, stretch.end);
        let flight = dimension::flight(stretch.met);
        let ways = |t: f64| Ways {
            flown: before.map_or(0.0, |before| f64::from(LOOKS) * before.pdf(t)),
            aimed: if let Aimed::Towards(lamp) = &aimed { lamp.pdf(t) } else { 0.0 },
            goes_on: false,
        };
        let mut light = Rgb::ZERO;
        if let Some(before) = before {
            let u = sampler.one_fine(flight + dimension::BEFORE_DISTANCE);
            for look in 0..LOOKS {
                let t = before.sample((f64::from(look) + u) / f64::from(LOOKS));
                let seen = (t, stretch.medium.scattered(t), dimension::BEFORE_LIGHT + 3 * look);
                let ways = ways(t);
                light += self.light_from(stretch, seen, (ways, ways.flown), sampler, counters);
            }
        }
        if let Aimed::Towards(lamp) = &aimed {
            let t = lamp.sample(sampler.one_fine(flight + dimension::PIVOT_DISTANCE));
            let (ways, seen) = (ways(t), (t, stretch.medium.scattered(t), dimension::PIVOT_LIGHT));
            light += self.light_from(stretch, seen, (ways, ways.aimed), sampler, counters);
        }
        light
    }

    /// How a second distance is drawn on a stretch; `None` where no light or nothing which scatters is there.
    pub(super) fn aimed(&self, stretch: &Stretch<I>, sampler: &Sampler) -> Option<Aimed> {
        let Stretch { medium, ray, end, met, .. } = *stretch;
        let dimensions = dimension::flight(met);
        if medium.sigma_s == Rgb::ZERO {
            return None;
        }
        let before = ScatteredBefore::new(&medium, end);
        let u = sampler.one_fine(dimensions + dimension::PIVOT_PLACE);
        let place = before.map_or(0.0, |before| before.sample(u));
        let choose = sampler.one_fine(dimensions + dimension::PIVOT);
        match self.scene.lights.pivot(ray.at(place).as_vec3(), ray.time, choose)? {
            Pivot::Near { centre, radius } => {
                let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
                Equiangular::new(o, d, end, centre, radius).map(Aimed::Towards)
            }
            Pivot::Far => before.map(Aimed::Before),
        }
    }

    /// Light of one connection, by the numbers from `dimensions` on, from a distance of a stretch which was drawn with the
    /// density `own`; `scattered` of it goes towards the beginning.
    pub(super) fn light_from(
        &self,
        stretch: &Stretch<I>,
        (t, scattered, dimensions): (f64, Rgb, u32),
        (ways, own): (Ways, f64),
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Rgb {
        if scattered == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let receiver = receiver(stretch.ray.at(t), stretch.ray);
        let dimensions = dimension::flight(stretch.met) + dimensions;
        let drawn = (sampler.one_fine(dimensions + 2), sampler.two(dimensions));
        scattered * self.scattered(stretch, &receiver, drawn, (ways, own), counters)
    }

    /// Light which arrives at a point of a stretch straight from a light and is deflected along it, by one connection:
    /// per metre, over the density of the distance.
    pub(super) fn scattered(
        &self,
        stretch: &Stretch<I>,
        receiver: &Receiver,
        (choose, on_light): (f64, Vec2),
        (ways, own): (Ways, f64),
        counters: &mut PathCounters,
    ) -> Rgb {
        let time = stretch.ray.time;
        let Some(light) = self.scene.lights.sample(receiver, time, choose, on_light) else {
            return Rgb::ZERO;
        };
        // What goes to the light was deflected by as much as what comes from there.
        let density = stretch.medium.phase.density(light.wi.dot(stretch.ray.d));
        let (shadow_ray, end) = light.shadow_ray(receiver, time);
        counters.rays += 1;
        let mut numbers = numbers(choose, on_light);
        let left = self.transmitted(&shadow_ray, end, stretch.inside, &mut numbers);
        let weight = ways.share(own, (!light.delta).then_some(light.pdf), density);
        light.radiance * left * (density * weight / light.pdf)
    }

    /// Share of the light which is left along a segment that begins inside `inside`: what holes let pass, times what
    /// is not absorbed or scattered on the way. Surfaces between equal indices are none.
    pub(super) fn transmitted(
        &self,
        shadow_ray: &Ray,
        end: f64,
        inside: &I,
        numbers: &mut Stream,
    ) -> Rgb {
        let mut left = Rgb::ONE;
        let passed = self.passed(shadow_ray, end, inside, |inside, ray, end| {
            left *= self.left_after(inside, ray, end, numbers);
        });
        left * passed
    }

    /// Share of light which is left at a parameter of a ray in what is around it.
    fn left_after(&self, inside: &I, ray: &Ray, end: f64, numbers: &mut Stream) -> Rgb {
        let distance = end * ray.d.as_dvec3().length();
        let Some(medium) = self.medium(inside) else { return self.transmittance(inside, distance) };
        match self.scene.nested().passage(inside, ray) {
            Some(passage) => medium.left_across(&passage, distance, numbers),
            None => medium.transmittance(distance),
        }
    }
}

/// The numbers for tracking towards a light, from those that chose it.
pub(super) fn numbers(choose: f64, on_light: Vec2) -> Stream {
    Stream::new(&[choose, f64::from(on_light.x), f64::from(on_light.y)])
}

/// A point of a medium which receives light from all around.
pub(super) fn receiver(p: DVec3, ray: &Ray) -> Receiver {
    Receiver {
        p,
        p_error: DVec3::ZERO,
        ng: -ray.d,
        facing: Vec3::ZERO,
        horizon: None,
        draws_both: false,
    }
}
