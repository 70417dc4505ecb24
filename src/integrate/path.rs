//! Unidirectional path tracing.
//!
//! A path is followed from the camera. At every surface it takes what the surface emits, connects to
//! one point of one light (next-event estimation), and goes on in a direction drawn from the BSDF:
//!
//! ```text
//! L = Σₖ βₖ·(w·Lₑ + NEE),      βₖ₊₁ = βₖ·f·|cos θ|/p
//! ```
//!
//! (Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., sections 13.2 to 13.4.) Light
//! which both techniques can find is weighted by the power heuristic; what only one can find (lights
//! and lobes without extent) has weight 1 there. Paths end by Russian roulette on their throughput,
//! the scale `η²` of refraction taken out of it: the survivors are divided by the probability to
//! survive, which keeps the mean.

use super::SceneView;
use super::medium::numbers;
use super::share::{Departure, Landing, SharedPath};
use super::vertex::{Sides, Vertex};
use crate::build::bvh::{Hit, SurfacePoint};
use crate::build::light::{LightSample, Receiver};
use crate::build::nesting::Meeting;
use crate::description::{Background, Rgb};
use crate::extract::{CameraRay, NOTHING};
use crate::film::{PixelSample, Seen};
use crate::math::{Cone, Ray, offset_ray_origin};
use crate::sampling::{Sampler, dimension, power_heuristic};
use crate::shade::nesting::{Inside, NestingFaults};
use crate::shade::{Bsdf, BsdfSample, Chosen, InnerReflections, TexturePoint};
use glam::{DVec3, Vec2, Vec3};
use std::ops::ControlFlow;

/// The path tracer with its settings.
///
/// `OPACITY` says whether the scene requires surfaces with holes, and `I` what a path must know of the
/// solids around it; what is not required has no code on the path.
#[derive(Clone, Copy)]
pub struct PathTracer<'a, const OPACITY: bool, I> {
    /// The scene.
    pub scene: SceneView<'a>,
    /// Greatest number of surface interactions.
    pub max_depth: u32,
    /// Interactions before roulette may end a path.
    pub roulette_depth: u32,
    /// A path survives with the probability of this times its throughput.
    pub roulette_gain: f32,
    /// Reflections in a row inside of a solid with bent normals after which a path is let out.
    pub inner_reflections: u32,
    /// Upper limit of a sample's radiance after its first bounce.
    pub clamp_indirect: Option<f32>,
    /// Whether the film wants to know what the camera ray saw first.
    pub wants_seen: bool,
    /// World position of the origin of render space.
    pub origin: DVec3,
    /// What a sample stands for at the camera; a ray where no texture is filtered.
    pub pixel: Cone,
    /// Samples of a pixel.
    pub samples: u32,
    /// What camera rays begin in; `None` where it depends on the ray.
    pub start: Option<I>,
    /// What camera rays see that meet nothing.
    pub background: Background,
}

/// What happened on the paths of one tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathCounters {
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Paths which were cut off at the greatest depth although they still carried something.
    pub truncated: u64,
    /// Times a path was let out of a solid after too many reflections inside.
    pub let_out: u64,
    /// Where solids were nested in a way that cannot be.
    pub nesting: NestingFaults,
}

impl PathCounters {
    /// The sum of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            truncated: self.truncated + other.truncated,
            let_out: self.let_out + other.let_out,
            nesting: self.nesting.plus(other.nesting),
        }
    }
}

/// How the path arrived where it is: what the weight of an emitter found there depends on.
#[derive(Clone, Copy)]
pub(super) enum Arrival {
    /// From the camera or over a lobe without extent: no light sample could have found it.
    Sure,
    /// In a direction of this density from this receiver.
    Drawn { from: Receiver, pdf: f32 },
}

/// A path on its way.
pub(super) struct Path<'a, I> {
    pub(super) ray: Ray,
    /// What of the scene the path stands for.
    pub(super) cone: Cone,
    pub(super) radiance: Rgb,
    pub(super) throughput: Rgb,
    /// Product of the η² by which refraction has scaled the throughput so far, inverted.
    eta_scale: f32,
    pub(super) arrival: Arrival,
    transmittance: f32,
    pub(super) inside: I,
    /// Whether a light was drawn already.
    lit: bool,
    /// Interactions with surfaces, and with media.
    pub(super) depth: u32,
    /// The same with surfaces which let the ray pass.
    pub(super) met: u32,
    departure: Option<Departure<'a>>,
    landing: Option<Landing>,
    /// Reflections in a row inside of a solid.
    inner: InnerReflections,
    /// Radiance gathered before the landing, and the throughput there.
    before: Rgb,
    throughput_before: Rgb,
    /// What roulette between departure and landing multiplied the path by.
    boost: f32,
}

impl<'a, I> Path<'a, I> {
    fn new(camera_ray: &CameraRay, pixel: Cone, inside: I, most_inner: u32) -> Self {
        Self {
            ray: camera_ray.ray,
            cone: pixel,
            radiance: Rgb::ZERO,
            throughput: Rgb::ONE,
            eta_scale: 1.0,
            arrival: Arrival::Sure,
            transmittance: 0.0,
            inside,
            lit: false,
            depth: 0,
            met: 0,
            departure: None,
            landing: None,
            inner: InnerReflections::new(most_inner),
            before: Rgb::ZERO,
            throughput_before: Rgb::ONE,
            boost: 1.0,
        }
    }

    /// The throughput from the camera on.
    fn carried<const SHARE: bool>(&self) -> Rgb {
        if SHARE { self.throughput * self.throughput_before } else { self.throughput }
    }

    /// Russian roulette with a number in `[0, 1)`: whether the path goes on, which it then does for
    /// those that do not.
    pub(super) fn survives<const SHARE: bool>(&mut self, u: f32, gain: f32) -> bool {
        let carried = self.carried::<SHARE>() * self.eta_scale;
        let survival = (carried.max_element() * gain).min(1.0);
        if u >= survival || survival.is_nan() {
            return false;
        }
        self.throughput /= survival;
        if SHARE && self.is_between() {
            self.boost /= survival;
        }
        true
    }

    /// Goes on behind a surface that is not there for it.
    fn pass(&mut self, surface: &SurfacePoint) {
        self.ray.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, self.ray.d);
    }

    /// Keeps the first surface which scattered the path at random.
    fn depart(&mut self, vertex: &Vertex<'a>, sample: &BsdfSample) {
        if self.departure.is_none() {
            self.departure = Some(Departure {
                vertex: vertex.clone(),
                depth: self.depth,
                throughput: self.throughput,
                weight: sample.weight,
                pdf: sample.pdf,
            });
        }
    }

    /// Whether the path has just left its departure.
    fn is_between(&self) -> bool {
        self.landing.is_none() && self.departure.as_ref().is_some_and(|d| d.depth + 1 == self.depth)
    }

    /// Keeps the surface that was reached from the departure, if it may be shared.
    fn land(&mut self, surface: &SurfacePoint, wo: Vec3, bsdf: &Bsdf) {
        let Some(departure) = self.departure.as_ref().filter(|_| self.is_between()) else { return };
        let Some(landing) = Landing::new(surface, wo, bsdf, departure) else { return };
        self.landing = Some(landing);
        self.before = std::mem::take(&mut self.radiance);
        self.throughput_before = std::mem::replace(&mut self.throughput, Rgb::ONE);
    }
}

impl<'a, const OPACITY: bool, I: Inside> PathTracer<'a, OPACITY, I> {
    /// What a camera ray begins in.
    #[inline]
    pub(super) fn start(&self, ray: &Ray) -> I {
        self.start.unwrap_or_else(|| I::new(&self.scene.nested().around(ray)))
    }

    fn path_along(&self, camera_ray: &CameraRay) -> Path<'a, I> {
        let inside = self.start(&camera_ray.ray);
        Path::new(camera_ray, self.pixel, inside, self.inner_reflections)
    }

    /// The radiance which arrives along a camera ray.
    pub fn sample(
        &self,
        camera_ray: &CameraRay,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> PixelSample {
        let mut path = self.path_along(camera_ray);
        self.follow::<false>(&mut path, sampler, counters);
        let seen = self.seen_if_wanted(camera_ray, sampler, counters);
        let Path { radiance, transmittance, .. } = path;
        PixelSample { radiance, seen, transmittance }
    }

    /// Like [`PathTracer::sample`], with what neighbours may use of the path kept apart.
    pub(super) fn sample_shared(
        &self,
        camera_ray: &CameraRay,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> SharedPath<'a> {
        let mut path = self.path_along(camera_ray);
        self.follow::<true>(&mut path, sampler, counters);
        let seen = self.seen_if_wanted(camera_ray, sampler, counters);
        let Path { radiance, transmittance, departure, mut landing, before, boost, .. } = path;
        let radiance = match &mut landing {
            Some(landing) => {
                landing.leaving = radiance * boost;
                before
            }
            None => radiance,
        };
        SharedPath { sample: PixelSample { radiance, seen, transmittance }, departure, landing }
    }

    /// Follows a path to its end.
    ///
    /// With `SHARE` the first surface that scatters at random is kept as the place of departure, and if
    /// the next one is diffuse it is kept as the landing: what leaves it is gathered as if the path
    /// had begun there, and what it had gathered before is put aside.
    fn follow<const SHARE: bool>(
        &self,
        path: &mut Path<'a, I>,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) {
        while let ControlFlow::Continue(hit) = self.advance::<SHARE>(path, sampler, counters) {
            let Some(hit) = hit else { continue };
            let met = self.meet(path, hit, counters);
            let (hit, mut surface, mut beyond, outside) = match met {
                Meeting::Surface { hit, surface, beyond, outside } => {
                    (hit, surface, beyond, outside)
                }
                Meeting::Nothing { surface, beyond } => {
                    path.pass(&surface);
                    path.inside = beyond;
                    // The next flight has numbers of its own.
                    path.met += u32::from(I::SCATTERS);
                    continue;
                }
            };
            let dimensions = dimension::vertex(path.met);
            path.met += 1;
            let instance = &self.scene.geometry.instances[hit.instance as usize];
            let materials = &self.scene.surfaces.materials;
            let wo = -path.ray.d;
            let at = self.scene.geometry.texture_point_in(path.cone, &path.ray, &hit, &surface);
            let mut roulette = None;
            if OPACITY && instance.material != NOTHING {
                let u = || sampler.one(dimensions + dimension::ROULETTE);
                let Some(left) = materials.stopped(instance.material, &at, u) else {
                    path.pass(&surface);
                    continue;
                };
                roulette = left;
            }
            if instance.emission != NOTHING {
                let emitted = self.emitted(&hit, &surface, wo, path.ray.time, path.arrival);
                path.radiance += self.limited(path.throughput * emitted, path.depth);
            }
            if instance.material == NOTHING {
                break;
            }
            let (media, sides) = ((instance.material, outside), [&mut path.inside, &mut beyond]);
            let medium = self.disperse(media, sides, &mut path.throughput, sampler);
            let mut lobe = if materials.needs_lobe(instance.material) {
                sampler.one(dimensions + dimension::LOBE)
            } else {
                0.0
            };
            let seen = (&path.ray, path.cone);
            let chosen = self.choose(seen, &hit, &mut surface, &at, &mut lobe);
            let bsdf = self.bsdf(chosen, &at, medium);
            if path.depth == self.max_depth {
                counters.truncated += 1;
                break;
            }
            if SHARE {
                path.land(&surface, wo, &bsdf);
            }
            let ray_origin = self.scene.ray_origin(&path.ray, &hit, &surface, &bsdf);
            let vertex = Vertex::new(surface, ray_origin, wo, bsdf);
            let sides = Sides { here: path.inside, beyond };
            let mut receiver = vertex.receiver();
            let (to_scatter, on_light) =
                sampler.four(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
            if vertex.bsdf.has_non_delta() {
                receiver.draws_both = !path.lit && self.scene.lights.has_both_groups();
                let from = (&vertex, &receiver, &sides);
                let light =
                    self.lit_by(from, on_light, dimensions, path.ray.time, sampler, counters);
                path.lit = true;
                path.radiance += self.limited(path.throughput * light, path.depth);
            }
            let Some((wi, sample)) = vertex.scatter(lobe, to_scatter, &mut path.inner) else {
                break;
            };
            counters.let_out += u64::from(path.inner.was_let_out());
            if SHARE && !sample.delta {
                path.depart(&vertex, &sample);
            }
            path.throughput *= sample.weight;
            path.depth += 1;
            path.eta_scale *= sample.eta * sample.eta;
            path.inside = *sides.towards(wi, &vertex);
            self.widen(&mut path.cone, &sample);
            if path.depth >= self.roulette_depth {
                let u = roulette.unwrap_or_else(|| sampler.one(dimensions + dimension::ROULETTE));
                if !path.survives::<SHARE>(u, self.roulette_gain) {
                    break;
                }
            }
            path.ray.o = vertex.ray_origin.towards(wi);
            path.ray.d = wi;
            path.arrival = if sample.delta {
                Arrival::Sure
            } else {
                Arrival::Drawn { from: receiver, pdf: sample.pdf }
            };
        }
    }

    /// What a path hits next; nothing where it was scattered on the way, and a break where it ends.
    #[inline]
    fn advance<const SHARE: bool>(
        &self,
        path: &mut Path<'a, I>,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> ControlFlow<(), Option<Hit>> {
        counters.rays += 1;
        let from_camera = path.depth == 0;
        let hit = self.scene.geometry.closest_hit(&path.ray, f64::INFINITY, from_camera);
        if I::SCATTERS
            && let Some(goes_on) = self.fly::<SHARE>(path, hit.as_ref(), sampler, counters)
        {
            return if goes_on { ControlFlow::Continue(None) } else { ControlFlow::Break(()) };
        }
        let Some(hit) = hit else {
            self.escape(path, counters);
            return ControlFlow::Break(());
        };
        path.cone.advance(hit.t);
        ControlFlow::Continue(Some(hit))
    }

    /// Follows a path to a hit, through what is around it, and tells what it meets there.
    #[inline]
    fn meet(&self, path: &mut Path<'a, I>, hit: Hit, counters: &mut PathCounters) -> Meeting<I> {
        if I::ABSORBS && !(I::SCATTERS && self.medium(&path.inside).is_some()) {
            path.throughput *= self.transmittance(&path.inside, hit.t);
        }
        let Path { ray, inside, .. } = path;
        self.scene.nested().meet(ray, hit, inside, &mut counters.nesting)
    }

    /// What of a material is at a point that was hit, chosen by `lobe`, with its relief: seen by a ray in a cone.
    #[inline]
    pub(super) fn choose(
        &self,
        (ray, cone): (&Ray, Cone),
        hit: &Hit,
        surface: &mut SurfacePoint,
        at: &TexturePoint,
        lobe: &mut f32,
    ) -> Chosen {
        let SceneView { geometry, surfaces, .. } = self.scene;
        let materials = &surfaces.materials;
        let material = geometry.instances[hit.instance as usize].material;
        let chosen = materials.choose(material, at, lobe);
        if let Some(relief) = chosen.relief {
            geometry.turn_normal((materials, relief), cone, ray, hit, surface, at);
        }
        chosen
    }

    /// How a chosen material scatters at a point; `medium` is what is on its outside, and the wavelength of the path.
    #[inline]
    pub(super) fn bsdf(
        &self,
        chosen: Chosen,
        at: &TexturePoint,
        (outside, wavelength): (Option<u32>, Option<f32>),
    ) -> Bsdf<'a> {
        let materials = &self.scene.surfaces.materials;
        if I::NESTS {
            materials.chosen_bsdf_tuned(chosen.material, at, outside, wavelength)
        } else {
            materials.chosen_bsdf(chosen.material, at)
        }
    }

    /// Lets a path choose its wavelength where it first matters; what is outside of the surface, and the wavelength.
    #[inline]
    pub(super) fn disperse(
        &self,
        media: (u32, Option<u32>),
        [here, beyond]: [&mut I; 2],
        throughput: &mut Rgb,
        sampler: &Sampler,
    ) -> (Option<u32>, Option<f32>) {
        let sides = [&mut *here, beyond];
        *throughput *= self.scene.nested().disperse(media, sides, sampler, dimension::WAVELENGTH);
        (media.1, here.wavelength())
    }

    /// What of the scene a path stands for that was scattered.
    #[inline]
    pub(super) fn widen(&self, cone: &mut Cone, sample: &BsdfSample) {
        if !cone.is_ray() && !sample.delta {
            cone.scatter(sample.pdf, self.samples as f32);
        }
    }

    /// Ends a path which meets nothing.
    fn escape(&self, path: &mut Path<'a, I>, counters: &mut PathCounters) {
        if I::NESTS {
            self.scene.nested().escape(&path.inside, &mut counters.nesting);
        }
        let (light, transmittance) =
            self.behind(&path.ray, path.throughput, path.arrival, path.depth);
        path.radiance += light;
        path.transmittance = transmittance;
    }

    /// What a path brings that has left the scene, and its share of the light from behind the picture: where the
    /// background is transparent, a path that has met nothing sees nothing, and what media on its way have left
    /// of its throughput would come through.
    #[inline]
    pub(super) fn behind(
        &self,
        ray: &Ray,
        throughput: Rgb,
        arrival: Arrival,
        depth: u32,
    ) -> (Rgb, f32) {
        if depth == 0 && self.background == Background::Transparent {
            return (Rgb::ZERO, throughput.element_sum() / 3.0);
        }
        (self.limited(throughput * self.infinite(ray, arrival), depth), 0.0)
    }

    /// Light straight from a light; where a path is lit first, from a light of each group.
    ///
    /// The noise of that first light counts most: so it draws from the lights at a place and from the
    /// distant ones, where later vertices draw from either.
    fn lit_by(
        &self,
        (vertex, receiver, sides): (&Vertex, &Receiver, &Sides<I>),
        on_light: Vec2,
        dimensions: u32,
        time: f32,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Rgb {
        let choose = if self.scene.lights.has_choice() {
            sampler.one_fine(dimensions + dimension::LIGHT)
        } else {
            0.0
        };
        if !receiver.draws_both {
            return self.direct(vertex, receiver, sides, (choose, on_light), time, counters);
        }
        let on_distant = sampler.two(dimensions + dimension::DISTANT_LIGHT_POINT);
        let (distant, near) = ((0.5 * choose, on_distant), (0.5 + 0.5 * choose, on_light));
        self.direct(vertex, receiver, sides, distant, time, counters)
            + self.direct(vertex, receiver, sides, near, time, counters)
    }

    /// What the camera ray of a sample sees first, for the film that wants it.
    pub(super) fn seen_if_wanted(
        &self,
        camera_ray: &CameraRay,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> Option<Seen> {
        self.wants_seen.then(|| self.seen(camera_ray, Some(sampler), &mut counters.rays))
    }

    /// Light from infinitely far away along a ray which meets nothing.
    pub(super) fn infinite(&self, ray: &Ray, arrival: Arrival) -> Rgb {
        let (from, pdf) = match &arrival {
            Arrival::Sure => (None, None),
            Arrival::Drawn { from, pdf } => (Some(from), Some(*pdf)),
        };
        self.scene
            .lights
            .infinite(from, ray.d, ray.time)
            .map(|(radiance, light_pdf)| match pdf {
                None => radiance,
                Some(pdf) => radiance * power_heuristic(pdf, light_pdf),
            })
            .fold(Rgb::ZERO, |sum, radiance| sum + radiance)
    }

    /// What the surface that was met emits along the path, weighted.
    pub(super) fn emitted(
        &self,
        hit: &Hit,
        surface: &SurfacePoint,
        wo: Vec3,
        time: f32,
        arrival: Arrival,
    ) -> Rgb {
        let lights = &self.scene.lights;
        let radiance = lights.emitted(hit.instance, surface, wo, time);
        match arrival {
            Arrival::Drawn { from, pdf } if radiance != Rgb::ZERO => {
                let light_pdf =
                    lights.pdf(&from, hit.instance, hit.primitive, surface.p, surface.ng, time);
                radiance * power_heuristic(pdf, light_pdf)
            }
            _ => radiance,
        }
    }

    /// Light which arrives straight from a light, by one connection to the light and the point on it
    /// that these numbers draw.
    pub(super) fn direct(
        &self,
        vertex: &Vertex,
        receiver: &Receiver,
        sides: &Sides<I>,
        (choose, on_light): (f64, Vec2),
        time: f32,
        counters: &mut PathCounters,
    ) -> Rgb {
        let Some(light) = self.scene.lights.sample(receiver, time, choose, on_light) else {
            return Rgb::ZERO;
        };
        self.connect_to(&light, vertex, receiver, sides, (choose, on_light), time, counters)
    }

    /// Light which arrives straight from a point of a light that was drawn by these numbers.
    #[expect(clippy::too_many_arguments, reason = "both ends of a connection, and what is between")]
    #[inline]
    pub(super) fn connect_to(
        &self,
        light: &LightSample,
        vertex: &Vertex,
        receiver: &Receiver,
        sides: &Sides<I>,
        (choose, on_light): (f64, Vec2),
        time: f32,
        counters: &mut PathCounters,
    ) -> Rgb {
        let (f_cos, pdf) = vertex.evaluate(light.wi);
        if f_cos == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let (shadow_ray, end) = light.shadow_ray(receiver, time);
        counters.rays += 1;
        let inside = sides.towards(light.wi, vertex);
        if I::SCATTERS {
            let weight = if light.delta { 1.0 } else { power_heuristic(light.pdf, pdf) };
            let mut numbers = numbers(choose, on_light);
            let left = self.transmitted(&shadow_ray, end, inside, &mut numbers);
            return f_cos * light.radiance * left * (weight / light.pdf);
        }
        let visible = self.visible(&shadow_ray, end, inside);
        if visible == 0.0 {
            return Rgb::ZERO;
        }
        let weight = if light.delta { 1.0 } else { power_heuristic(light.pdf, pdf) };
        let arriving = f_cos * light.radiance * (visible * weight / light.pdf);
        if I::ABSORBS && arriving != Rgb::ZERO {
            let distance = end * shadow_ray.d.as_dvec3().length();
            arriving * self.transmittance(inside, distance)
        } else {
            arriving
        }
    }

    /// Share of the light which passes along a segment that begins inside `inside`, absorption apart.
    pub(super) fn visible(&self, shadow_ray: &Ray, end: f64, inside: &I) -> f32 {
        if !OPACITY && !I::NESTS {
            return if self.scene.geometry.occluded(shadow_ray, end) { 0.0 } else { 1.0 };
        }
        self.passed(shadow_ray, end, inside, |_, _, _| {})
    }

    /// Follows a segment from surface to surface: the share of the light that holes let through; surfaces inside of other
    /// solids let all of it. `flown` is told what is around each part of the way, the ray, and its parameter
    /// at the end.
    pub(super) fn passed(
        &self,
        shadow_ray: &Ray,
        end: f64,
        inside: &I,
        mut flown: impl FnMut(&I, &Ray, f64),
    ) -> f32 {
        // What is found wrong is counted on the paths.
        let (mut inside, mut faults) = (*inside, NestingFaults::default());
        let mut passed = 1.0;
        let target = shadow_ray.at(if end.is_finite() { end } else { 1.0 });
        let mut ray = *shadow_ray;
        while let Some(hit) = self.scene.geometry.closest_hit(&ray, end, false) {
            flown(&inside, &ray, hit.t);
            let surface = match self.scene.nested().meet(&ray, hit, &mut inside, &mut faults) {
                Meeting::Nothing { surface, beyond } => {
                    inside = beyond;
                    surface
                }
                Meeting::Surface { hit, surface, .. } => {
                    let material = self.scene.geometry.instances[hit.instance as usize].material;
                    let materials = &self.scene.surfaces.materials;
                    if material == NOTHING || !materials.has_opacity(material) {
                        return 0.0;
                    }
                    let at = self.scene.geometry.texture_point(hit.instance, &surface, ray.time);
                    passed *= 1.0 - materials.opacity(material, &at);
                    if passed == 0.0 {
                        return 0.0;
                    }
                    surface
                }
            };
            ray.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, ray.d);
            if end.is_finite() {
                ray.d = (target - ray.o.as_dvec3()).as_vec3();
                if ray.d.dot(shadow_ray.d) <= 0.0 {
                    return passed;
                }
            }
        }
        flown(&inside, &ray, end);
        passed
    }

    /// Share of the light which is left after a distance in metres, [`MaterialTable::transmittance`].
    ///
    /// [`MaterialTable::transmittance`]: crate::shade::MaterialTable::transmittance
    pub(super) fn transmittance(&self, inside: &I, distance: f64) -> Rgb {
        self.scene.surfaces.materials.transmittance(inside.medium(), distance)
    }

    /// The knob `clamp_indirect`; what the camera or its first surface sees is never limited.
    pub(super) fn limited(&self, radiance: Rgb, depth: u32) -> Rgb {
        match self.clamp_indirect {
            Some(limit) if depth > 0 => radiance.min(Rgb::splat(limit)),
            _ => radiance,
        }
    }
}
