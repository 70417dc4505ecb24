//! Paths from the camera which gather photons.
//!
//! With `E` the camera, `L` a light, `S` a specular interaction (over a lobe without extent, or one too
//! narrow to gather photons for) and `D` any other, every path belongs to one technique:
//!
//! ```text
//!                        E S* L     E S* D L      E S* D S+ L            all others
//! Sppm                   path       light rays    photons                photons
//! PhotonMap              path       light rays    caustic photons        photons, or a final gathering
//! Path with photons      path       light rays    caustic photons        path; …D S+ L: caustic photons
//! ```
//!
//! "Light rays" is next-event estimation together with a ray drawn from the BSDF, weighted. Where caustic
//! photons are gathered, at **every** `D` of the path, the path itself leaves out all that reaches a
//! light over `D S+ L`: a light met by chance, and light rays from a glossy `S`.
//!
//! Light which no photon carries comes from paths all the same: that of emitting planes, and what comes from infinitely far
//! away to planes beyond the reach of photons ([`PhotonSource::covers`]). Photons and paths divide it by the last segment of the
//! path, so that nothing is counted twice. Where photons bring all that is lit at second hand a path therefore goes on
//! after its last `D` as a *leftover*, which takes such light alone.
//!
//! A final gathering sends rays from the first `D` and reads all photons where these meet a surface,
//! the direct ones included. Where a ray is shorter than the disk over which it would read, the corner's
//! other side would be read twice: it goes on as a path (Jensen 2001, *Realistic Image Synthesis
//! Using Photon Mapping*, section 9.2.2; Christensen 1999, "Faster Photon Map Global Illumination",
//! Journal of Graphics Tools 4(3)).

use super::path::{Arrival, PathCounters, PathTracer};
use super::vertex::{Sides, Vertex};
use crate::build::bvh::{Hit, SurfacePoint};
use crate::build::light::{LightSample, PhotonSource, Receiver, ShadowEnd};
use crate::build::nesting::Meeting;
use crate::build::photon::{
    IrradianceMap, KnownIrradiance, PhotonMap, QueryPoint, VolumeMap, least_radius,
};
use crate::description::{DirectLight, PhotonSettings, Rgb};
use crate::extract::{CameraRay, Method, NOTHING};
use crate::film::PixelSample;
use crate::math::{Cone, Ray, offset_ray_origin};
use crate::sampling::{Sampler, dimension};
use crate::shade::medium::Fate;
use crate::shade::nesting::Inside;
use crate::shade::{Bsdf, BsdfSample, InnerReflections, TransportMode};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;
use std::ops::ControlFlow;

/// How much wider photons are gathered at points which the camera sees by a diffuse bounce: the
/// bounce blurs what is found there anyway.
const BEHIND_DIFFUSE: f32 = 2.0;

/// Least radius, in pixels, with which a pixel begins: blur which is narrower than the pixel is not seen.
const SMALLEST_FIRST: f32 = 0.5;

/// The photons of a pass.
#[derive(Clone, Copy)]
pub(super) struct Maps<'a> {
    /// All that the method reads at a diffuse point beside the caustics.
    pub global: &'a PhotonMap,
    /// Caustics, where they are kept apart.
    pub caustics: &'a PhotonMap,
    /// Where the irradiance of `global` is known beforehand.
    pub irradiance: &'a IrradianceMap,
    /// Photons in media: all, and caustics where they are kept apart.
    pub volume: &'a VolumeMap,
    pub volume_caustics: &'a VolumeMap,
}

/// Follows camera paths for the methods with photons.
#[derive(Clone, Copy)]
pub(super) struct EyeTracer<'a, const OPACITY: bool, I> {
    pub path: PathTracer<'a, OPACITY, I>,
    pub method: Method,
    pub settings: &'a PhotonSettings,
    /// Rays of a final gathering.
    pub final_gather: u32,
    pub maps: Maps<'a>,
    /// Side of a pixel at the camera, and its growth per metre.
    pub pixel_size: (f32, f32),
    /// Greatest radius of the first pass, metres.
    pub largest_radius: f32,
    /// From where photons start.
    pub source: &'a PhotonSource,
    /// Whether there is light that no photon carries.
    pub has_leftovers: bool,
}

/// Which random numbers a camera path has.
#[derive(Clone, Copy)]
pub(super) struct SampleKey {
    pub seed: u64,
    pub frame: u32,
    pub pixel: (u32, u32),
    pub index: u32,
}

impl SampleKey {
    pub fn sampler(&self) -> Sampler {
        Sampler::new(self.seed, self.frame, self.pixel, self.index)
    }

    /// The numbers of ray `k` of the `n` of a final gathering.
    fn gather_ray(&self, k: u32, n: u32) -> Sampler {
        // No picture is as wide as 2³⁰ pixels.
        let place = (self.pixel.0 | 1 << 30, self.pixel.1);
        Sampler::new(self.seed, self.frame, place, self.index.wrapping_mul(n).wrapping_add(k))
    }
}

/// How large a disk a path begins with.
#[derive(Clone, Copy)]
pub(super) struct FirstDisk {
    /// Factor on the radius of the first pass.
    pub scale: f32,
    /// Photons with which the first disk that holds any is content; 0 where it is as large as it is.
    pub enough: u32,
}

/// What a pass found for a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathered {
    /// Photons in the disks.
    pub found: u32,
    /// Smallest and greatest radius.
    pub radii: (f32, f32),
    /// Disks which could not shrink further.
    pub unresolved: u32,
    /// Part of the radius with which the pixel was content.
    pub part: f32,
}

impl Default for Gathered {
    fn default() -> Self {
        Self { found: 0, radii: (f32::INFINITY, 0.0), unresolved: 0, part: 1.0 }
    }
}

impl Gathered {
    /// Takes note of a disk.
    fn note(&mut self, radius: f32, unresolved: bool) {
        let (min, max) = self.radii;
        self.radii = (min.min(radius), max.max(radius));
        self.unresolved += u32::from(unresolved);
    }
}

/// What the path has met since its last diffuse surface.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Since {
    /// There was none: only specular surfaces so far.
    Never,
    /// It was the last surface.
    Diffuse,
    /// Specular surfaces came after it.
    Specular,
}

/// What a path looks for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Task {
    /// All that its method has.
    All,
    /// The same as a ray of a final gathering: where it meets something storable it reads all photons.
    Reads,
    /// A light, where its next ray ends.
    Lamp,
    /// Light which no photon carries.
    Leftover,
}

/// A path on its way.
#[derive(Clone, Copy)]
pub(super) struct Walk<I> {
    pub(super) ray: Ray,
    /// What of the scene the path stands for.
    pub(super) cone: Cone,
    pub(super) throughput: Rgb,
    eta_scale: f32,
    pub(super) arrival: Arrival,
    pub(super) since: Since,
    pub(super) inside: I,
    pub(super) depth: u32,
    pub(super) met: u32,
    /// Length of the path, metres.
    pub(super) length: f64,
    /// Reflections in a row inside of a solid.
    inner: InnerReflections,
    /// What it looks for.
    pub(super) task: Task,
    /// Whether it may still be split in two at a surface of glass.
    whole: bool,
}

/// What goes along with all walks of a sample.
pub(super) struct Context<'a> {
    key: SampleKey,
    first_disk: FirstDisk,
    pub(super) counters: &'a mut PathCounters,
    gathered: Gathered,
    pub(super) sample: PixelSample,
    distances: Vec<f32>,
}

impl<const OPACITY: bool, I: Inside> EyeTracer<'_, OPACITY, I> {
    /// The radiance which arrives along a camera ray, as this pass sees it.
    pub fn sample(
        &self,
        camera_ray: &CameraRay,
        key: SampleKey,
        first_disk: FirstDisk,
        counters: &mut PathCounters,
    ) -> (PixelSample, Gathered) {
        let walk = Walk {
            ray: camera_ray.ray,
            cone: self.path.pixel,
            throughput: Rgb::ONE,
            eta_scale: 1.0,
            arrival: Arrival::Sure,
            since: Since::Never,
            inside: self.path.start(&camera_ray.ray),
            depth: 0,
            met: 0,
            length: 0.0,
            inner: InnerReflections::new(self.path.inner_reflections),
            task: Task::All,
            whole: true,
        };
        let mut context = Context {
            key,
            first_disk,
            counters,
            gathered: Gathered::default(),
            sample: PixelSample::default(),
            distances: Vec::new(),
        };
        let sampler = key.sampler();
        self.walk(walk, &sampler, &mut context);
        let Context { mut sample, gathered, .. } = context;
        sample.seen = self.path.seen_if_wanted(camera_ray, &sampler, counters);
        (sample, gathered)
    }

    /// Whether light met by chance on this path is left to photons.
    fn left_to_photons(&self, walk: &Walk<I>) -> bool {
        walk.task == Task::Leftover
            || (walk.since == Since::Specular && self.method != Method::Sppm)
    }

    /// Whether no photon comes from infinitely far away against a ray.
    fn is_beyond(&self, o: DVec3, d: Vec3) -> bool {
        self.source.has_beyond && !self.source.covers(o, d)
    }

    fn walk(&self, mut walk: Walk<I>, sampler: &Sampler, context: &mut Context) {
        while let ControlFlow::Continue(hit) = self.advance(&mut walk, sampler, context) {
            let Some(hit) = hit else { continue };
            if !self.interact(&mut walk, &hit, sampler, context) {
                return;
            }
        }
    }

    /// The next surface, or nothing where the path was scattered on the way; adds light from infinity where it ends
    /// there.
    fn advance(
        &self,
        walk: &mut Walk<I>,
        sampler: &Sampler,
        context: &mut Context,
    ) -> ControlFlow<(), Option<Hit>> {
        context.counters.rays += 1;
        let from_camera = walk.depth == 0;
        let hit = self.path.scene.geometry.closest_hit(&walk.ray, f64::INFINITY, from_camera);
        if I::SCATTERS && self.path.medium(&walk.inside).is_some() {
            match self.cross(walk, hit.as_ref(), sampler, context) {
                Fate::Through => {}
                Fate::Scattered => return ControlFlow::Continue(None),
                Fate::Ended => return ControlFlow::Break(()),
            }
        }
        if I::NESTS && hit.is_none() {
            self.path.scene.nested().escape(&walk.inside, &mut context.counters.nesting);
        }
        let taken =
            || !self.left_to_photons(walk) || self.is_beyond(walk.ray.o.as_dvec3(), walk.ray.d);
        if hit.is_none() && taken() {
            let (light, transmittance) =
                self.path.behind(&walk.ray, walk.throughput, walk.arrival, walk.depth);
            context.sample.radiance += light;
            context.sample.transmittance += transmittance;
        }
        hit.map_or(ControlFlow::Break(()), |hit| ControlFlow::Continue(Some(hit)))
    }

    /// Everything at one surface; whether the path goes on.
    fn interact(
        &self,
        walk: &mut Walk<I>,
        hit: &Hit,
        sampler: &Sampler,
        context: &mut Context,
    ) -> bool {
        let scene = &self.path.scene;
        walk.length += hit.t;
        walk.cone.advance(hit.t);
        if I::ABSORBS && !(I::SCATTERS && self.path.medium(&walk.inside).is_some()) {
            walk.throughput *= self.path.transmittance(&walk.inside, hit.t);
        }
        let counters = &mut context.counters.nesting;
        let (hit, mut surface, mut beyond, outside) =
            match scene.nested().meet(&walk.ray, *hit, &mut walk.inside, counters) {
                Meeting::Surface { hit, surface, beyond, outside } => {
                    (hit, surface, beyond, outside)
                }
                Meeting::Nothing { surface, beyond } => {
                    let SurfacePoint { p, p_error, ng, .. } = surface;
                    walk.ray.o = offset_ray_origin(p, p_error, ng, walk.ray.d);
                    walk.inside = beyond;
                    // The next flight has numbers of its own.
                    walk.met += u32::from(I::SCATTERS);
                    return true;
                }
            };
        let hit = &hit;
        let dimensions = dimension::vertex(walk.met);
        walk.met += 1;
        let material = scene.geometry.instances[hit.instance as usize].material;
        let wo = -walk.ray.d;
        let at = scene.geometry.texture_point_in(walk.cone, &walk.ray, hit, &surface);
        let mut roulette = None;
        if OPACITY && material != NOTHING {
            let u = || sampler.one(dimensions + dimension::ROULETTE);
            let Some(left) = scene.surfaces.materials.stopped(material, &at, u) else {
                walk.ray.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, walk.ray.d);
                return true;
            };
            roulette = left;
        }
        if !self.left_to_photons(walk) || self.path.scene.lights.is_met_by_chance(hit.instance) {
            let time = walk.ray.time;
            let emitted = self.path.emitted(hit, &surface, wo, time, walk.arrival);
            context.sample.radiance += self.path.limited(walk.throughput * emitted, walk.depth);
        }
        if walk.task == Task::Lamp && !self.looks_for_leftovers(walk) {
            return false;
        }
        let (media, sides) = ((material, outside), [&mut walk.inside, &mut beyond]);
        let medium = self.path.disperse(media, sides, &mut walk.throughput, sampler);
        let mut lobe = sampler.one(dimensions + dimension::LOBE);
        let seen = (&walk.ray, walk.cone);
        // Photons were weighted by the normal of the shape, before a relief turns it.
        let smooth = surface;
        let mut storable = false;
        let bsdf = (material != NOTHING).then(|| {
            let chosen = self.path.choose(seen, hit, &mut surface, &at, &mut lobe);
            let (materials, min_alpha) = (&scene.surfaces.materials, self.settings.min_alpha());
            let (at, gathers) = materials.storable_at(chosen.material, &at, min_alpha);
            storable = gathers;
            self.path.bsdf(chosen, &at, medium)
        });
        let Some(bsdf) = bsdf else { return false };
        if walk.depth == self.path.max_depth {
            context.counters.truncated += 1;
            return false;
        }
        let ray_origin = scene.ray_origin(&walk.ray, hit, &surface, &bsdf);
        let vertex = Vertex::new(surface, ray_origin, wo, bsdf);
        let sides = Sides { here: walk.inside, beyond };
        let receiver = vertex.receiver();
        let (direction, on_light) = sampler.four(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
        let place = GatherPoint::new(&vertex, &smooth, storable);
        let drawn = || (sampler.one_fine(dimensions + dimension::LIGHT), on_light);
        let read_here = self.collect(walk, hit, &place, &receiver, drawn, &sides, context);
        let gathers = storable && self.gathers_finally(walk);
        if gathers {
            self.final_gathering(walk, &vertex, &receiver, &sides, context);
        }
        let lobe = self.split(walk, &vertex, (lobe, direction), &sides, sampler, context);
        let Some((wi, drawn)) = vertex.scatter(lobe, direction, &mut walk.inner) else {
            return false;
        };
        context.counters.let_out += u64::from(walk.inner.was_let_out());
        let diffuse = storable && !drawn.delta;
        let ends = diffuse && (read_here || gathers || self.ends_at_diffuse(walk));
        if ends && (gathers || !self.looks_for_leftovers(walk)) {
            return false;
        }
        self.turn(walk, &vertex, &receiver, (wi, &drawn), diffuse, &sides);
        if walk.task == Task::Lamp {
            return true;
        }
        self.survives(walk, || {
            roulette.unwrap_or_else(|| sampler.one(dimensions + dimension::ROULETTE))
        })
    }

    /// Turns a path which would end into one that looks for what no photon carries, if there is such.
    fn looks_for_leftovers(&self, walk: &mut Walk<I>) -> bool {
        if self.has_leftovers {
            walk.task = Task::Leftover;
        }
        self.has_leftovers
    }

    /// Adds what a surface scatters towards the path: what photons bring, and light from a point of a light, for which it
    /// asks for the numbers. Whether all photons were read there.
    #[expect(clippy::too_many_arguments, reason = "both ends of a connection, and what is between")]
    fn collect(
        &self,
        walk: &Walk<I>,
        hit: &Hit,
        place: &GatherPoint,
        receiver: &Receiver,
        drawn: impl FnOnce() -> (f64, Vec2),
        sides: &Sides<I>,
        context: &mut Context,
    ) -> bool {
        let GatherPoint { vertex, storable, .. } = *place;
        // A ray of a final gathering reads all photons where it is long enough.
        let reads = storable && walk.task == Task::Reads;
        let read_here = reads && self.read(walk, hit, place, context);
        let by_paths = !read_here && walk.task != Task::Leftover;
        let any = by_paths && self.takes_light_rays(walk, &vertex.bsdf, storable);
        if any || (self.has_leftovers && vertex.bsdf.has_non_delta()) {
            self.light_rays(walk, any, vertex, receiver, drawn(), sides, context);
        }
        if by_paths && storable {
            self.gather_here(walk, place, context);
        }
        read_here
    }

    /// Russian roulette by a number in `[0, 1)`: whether the path goes on.
    pub(super) fn survives(&self, walk: &mut Walk<I>, u: impl FnOnce() -> f32) -> bool {
        if walk.depth >= self.path.roulette_depth {
            let carried = (walk.throughput * walk.eta_scale).max_element();
            let survival = (carried * self.path.roulette_gain).min(1.0);
            if survival.is_nan() || u() >= survival {
                return false;
            }
            walk.throughput /= survival;
        }
        true
    }

    /// Splits the first path which meets glass: the likelier one of mirror image and refracted ray is followed here to its
    /// end; returns the number which chooses the other for `walk`, whose throughput is now that share.
    ///
    /// Either one draws its number from its own share of `[0, 1)`, so that the sum has the mean of a single path,
    /// whatever is made of the number. A lamp whose image in glass one path in twenty-five would see is seen by all of
    /// them.
    fn split(
        &self,
        walk: &mut Walk<I>,
        vertex: &Vertex,
        (lobe, direction): (f32, Vec2),
        sides: &Sides<I>,
        sampler: &Sampler,
        context: &mut Context,
    ) -> f32 {
        if !(walk.whole && walk.since == Since::Never) {
            return lobe;
        }
        let wo = vertex.frame.to_local(vertex.wo);
        let Some(p) = vertex.bsdf.first_of_two_deltas(wo) else { return lobe };
        walk.whole = false;
        let (first, second) = (p * lobe, p + (1.0 - p) * lobe);
        let ((likely, share), (other, rest)) =
            if p > 0.5 { ((first, p), (second, 1.0 - p)) } else { ((second, 1.0 - p), (first, p)) };
        let mut branch = *walk;
        if let Some((wi, drawn)) = vertex.scatter(likely, direction, &mut branch.inner) {
            branch.throughput *= share;
            self.turn(&mut branch, vertex, &vertex.receiver(), (wi, &drawn), false, sides);
            self.walk(branch, sampler, context);
        }
        walk.throughput *= rest;
        other
    }

    /// Whether a path ends where a diffuse lobe would take it on; otherwise `Sppm` and `PhotonMap` send one ray
    /// more, which looks for lights alone.
    fn ends_at_diffuse(&self, walk: &mut Walk<I>) -> bool {
        if walk.task != Task::All {
            return false;
        }
        match self.method {
            Method::Sppm if self.settings.direct == DirectLight::Photons => return true,
            Method::Sppm | Method::PhotonMap => walk.task = Task::Lamp,
            Method::Path | Method::PathWithPhotons => {}
        }
        false
    }

    fn gathers_finally(&self, walk: &Walk<I>) -> bool {
        self.method == Method::PhotonMap
            && self.final_gather > 0
            && walk.task == Task::All
            && walk.since == Since::Never
    }

    /// Whether rays are sent to the lights from here.
    fn takes_light_rays(&self, walk: &Walk<I>, bsdf: &Bsdf, storable: bool) -> bool {
        if !bsdf.has_non_delta() {
            return false;
        }
        if storable {
            return self.method != Method::Sppm || self.settings.direct == DirectLight::Sampled;
        }
        self.method == Method::Sppm || walk.since == Since::Never
    }

    /// Sends a ray to a point of a light, drawn by these numbers: of any, or of what no photon carries.
    #[expect(clippy::too_many_arguments, reason = "both ends of a connection, and what is between")]
    fn light_rays(
        &self,
        walk: &Walk<I>,
        any: bool,
        vertex: &Vertex,
        receiver: &Receiver,
        drawn: (f64, Vec2),
        sides: &Sides<I>,
        context: &mut Context,
    ) {
        let time = walk.ray.time;
        let (choose, on_light) = drawn;
        let light = self.path.scene.lights.sample(receiver, time, choose, on_light);
        let is_beyond = |light: &LightSample| {
            matches!(light.end, ShadowEnd::Infinity) && self.is_beyond(receiver.p, light.wi)
        };
        let Some(light) = light.filter(|light| any || is_beyond(light)) else { return };
        let counters = &mut *context.counters;
        let light = self.path.connect_to(&light, vertex, receiver, sides, drawn, time, counters);
        context.sample.radiance += self.path.limited(walk.throughput * light, walk.depth);
    }

    /// Gathers what the method has at a storable point of a camera path.
    fn gather_here(&self, walk: &Walk<I>, place: &GatherPoint, context: &mut Context) {
        let mut light = Rgb::ZERO;
        let global = match self.method {
            Method::Sppm => true,
            Method::PhotonMap => self.final_gather == 0,
            Method::Path | Method::PathWithPhotons => false,
        };
        if global {
            light += self.gather(self.maps.global, walk, place, context);
        }
        if self.method != Method::Sppm {
            light += self.gather(self.maps.caustics, walk, place, context);
        }
        context.sample.radiance += self.path.limited(walk.throughput * light, walk.depth);
    }

    /// Reads all photons at the end of a ray of a final gathering; `false` if the ray is too short.
    fn read(&self, walk: &Walk<I>, hit: &Hit, place: &GatherPoint, context: &mut Context) -> bool {
        let vertex = place.vertex;
        // What is known beforehand is the irradiance of the surface without a relief.
        if let Bsdf::Diffuse(diffuse) = vertex.bsdf
            && place.weighted_by.is_none()
            && let Some(known) = self.known(walk, vertex)
        {
            if hit.t < f64::from(known.radius) {
                return false;
            }
            let unresolved = known.radius <= least_radius(vertex.surface.p.as_vec3());
            context.gathered.note(known.radius, unresolved);
            let light = diffuse.albedo * known.irradiance * FRAC_1_PI;
            context.sample.radiance += self.path.limited(walk.throughput * light, walk.depth);
            return true;
        }
        let query = self.query(self.maps.global, walk, vertex, context);
        if hit.t < f64::from(query.radius) {
            return false;
        }
        let light = self.estimate(self.maps.global, &query, walk, place, context);
        context.sample.radiance += self.path.limited(walk.throughput * light, walk.depth);
        true
    }

    /// The irradiance on the side from which the path came, where it is known beforehand and all its photons
    /// have met no more surfaces than the path may.
    fn known(&self, walk: &Walk<I>, vertex: &Vertex) -> Option<&KnownIrradiance> {
        let surface = &vertex.surface;
        let normal = if vertex.wo.dot(surface.ng) < 0.0 { -surface.ng } else { surface.ng };
        let position = surface.p.as_vec3();
        let query = QueryPoint { position, normal, radius: self.largest_radius };
        let allowed = self.path.max_depth.saturating_sub(walk.depth);
        let known = self.maps.irradiance.nearest(&query);
        known.filter(|known| u32::from(known.deepest) < allowed)
    }

    /// Sends the rays of a final gathering over the lobes which are not deltas.
    fn final_gathering(
        &self,
        walk: &Walk<I>,
        vertex: &Vertex,
        receiver: &Receiver,
        sides: &Sides<I>,
        context: &mut Context,
    ) {
        let n = self.final_gather;
        for k in 0..n {
            let sampler = context.key.gather_ray(k, n);
            let dimensions = dimension::vertex(walk.met - 1);
            let lobe = sampler.one(dimensions + dimension::LOBE);
            let direction = sampler.two(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
            let mut ray =
                Walk { task: Task::Reads, throughput: walk.throughput / n as f32, ..*walk };
            let drawn = vertex.scatter(lobe, direction, &mut ray.inner);
            let Some((wi, drawn)) = drawn else { continue };
            if drawn.delta {
                continue; // the camera path itself goes on there
            }
            self.turn(&mut ray, vertex, receiver, (wi, &drawn), true, sides);
            self.walk(ray, &sampler, context);
        }
    }

    /// Sends a path on in the direction drawn.
    fn turn(
        &self,
        walk: &mut Walk<I>,
        vertex: &Vertex,
        receiver: &Receiver,
        (wi, drawn): (Vec3, &BsdfSample),
        diffuse: bool,
        sides: &Sides<I>,
    ) {
        walk.throughput *= drawn.weight;
        walk.eta_scale *= drawn.eta * drawn.eta;
        walk.depth += 1;
        walk.inside = *sides.towards(wi, vertex);
        self.path.widen(&mut walk.cone, drawn);
        walk.since = match (diffuse, walk.since) {
            (true, _) => Since::Diffuse,
            (false, Since::Never) => Since::Never,
            (false, _) => Since::Specular,
        };
        walk.arrival = if drawn.delta || !self.path_takes_light(walk, diffuse) {
            Arrival::Sure
        } else {
            Arrival::Drawn { from: *receiver, pdf: drawn.pdf }
        };
        walk.ray.o = vertex.ray_origin.towards(wi);
        walk.ray.d = wi;
    }

    /// Whether rays were sent to the lights from the surface that is left.
    fn path_takes_light(&self, walk: &Walk<I>, diffuse: bool) -> bool {
        diffuse || self.method == Method::Sppm || walk.since == Since::Never || self.has_leftovers
    }

    /// The disk over which photons are gathered at a point of a path.
    fn query(
        &self,
        map: &PhotonMap,
        walk: &Walk<I>,
        vertex: &Vertex,
        context: &mut Context,
    ) -> QueryPoint {
        let surface = &vertex.surface;
        let position = surface.p.as_vec3();
        let nearest = self.method == Method::PhotonMap;
        let (side, growth) = self.pixel_size;
        // A pixel is stretched where the surface is seen from the side.
        let stretch = vertex.wo.dot(surface.ng).abs().sqrt();
        let footprint = (side + growth * walk.length as f32) / stretch;
        let first = if nearest {
            self.largest_radius
        } else {
            let wider = if walk.since == Since::Never { 1.0 } else { BEHIND_DIFFUSE };
            (self.settings.radius * footprint * wider).min(self.largest_radius)
        };
        let FirstDisk { scale, enough } = context.first_disk;
        let mut radius = first * scale;
        let mut query = QueryPoint { position, normal: surface.ng, radius };
        if nearest {
            let count = self.settings.nearest as usize;
            radius = map.radius_of(&query, count, &mut context.distances);
        } else if enough > 0 {
            // What is smaller than the pixel is not seen.
            let within = map.radius_of(&query, enough as usize, &mut context.distances);
            let content = within.max(SMALLEST_FIRST * footprint).min(radius);
            if !context.distances.is_empty() {
                context.gathered.part = content / radius;
                context.first_disk = FirstDisk { scale: scale * content / radius, enough: 0 };
            }
            radius = content;
        }
        let least = least_radius(position);
        query.radius = radius.max(least);
        context.gathered.note(query.radius, radius < least);
        query
    }

    fn gather(
        &self,
        map: &PhotonMap,
        walk: &Walk<I>,
        place: &GatherPoint,
        context: &mut Context,
    ) -> Rgb {
        if map.is_empty() {
            return Rgb::ZERO;
        }
        let query = self.query(map, walk, place.vertex, context);
        self.estimate(map, &query, walk, place, context)
    }

    /// The radiance estimate `Σ f Φ K` over a disk.
    fn estimate(
        &self,
        map: &PhotonMap,
        query: &QueryPoint,
        walk: &Walk<I>,
        place: &GatherPoint,
        context: &mut Context,
    ) -> Rgb {
        let vertex = place.vertex;
        let kernel = self.settings.kernel;
        let radius2 = query.radius * query.radius;
        let allowed = self.path.max_depth.saturating_sub(walk.depth);
        let (shaded, ns) = (vertex.shaded(), vertex.surface.ns);
        let wo_local = vertex.frame.to_local(vertex.wo);
        let mut light = Rgb::ZERO;
        let mut found = 0;
        map.gather(query, |photon, distance2| {
            if u32::from(photon.depth) >= allowed {
                return;
            }
            found += 1;
            let wi = photon.wi();
            if !shaded.is_consistent(wi) {
                return;
            }
            let back = shaded.thrown_back(wi);
            let weight = kernel.weight(distance2, radius2) * place.share(wi);
            match vertex.bsdf {
                Bsdf::Diffuse(_) if vertex.crosses(wi) => {}
                // The same for all: it is multiplied by at the end.
                Bsdf::Diffuse(_) => {
                    let thrown_back = back.map_or(0.0, |from| (from.dot(ns) / wi.dot(ns)).abs());
                    light += photon.power * (weight * (1.0 + thrown_back));
                }
                _ => {
                    let f_cos = |wi: Vec3| {
                        let wi = vertex.frame.to_local(wi);
                        vertex.bsdf.evaluate(wo_local, wi, TransportMode::Radiance).f_cos
                    };
                    let f_cos = f_cos(wi) + back.map_or(Rgb::ZERO, f_cos);
                    if f_cos != Rgb::ZERO {
                        // Without the cosine: that is in how densely photons arrive.
                        light += f_cos / wi.dot(ns).abs() * photon.power * weight;
                    }
                }
            }
        });
        context.gathered.found += found;
        match vertex.bsdf {
            Bsdf::Diffuse(diffuse) => light * diffuse.albedo * FRAC_1_PI,
            _ => light,
        }
    }
}

/// A point of a path where photons are gathered.
struct GatherPoint<'v, 'a> {
    vertex: &'v Vertex<'a>,
    /// Whether there are photons to gather.
    storable: bool,
    /// The surface by whose shading normal photons were weighted where they were left, if that is not the one of
    /// the vertex.
    weighted_by: Option<&'v SurfacePoint>,
}

impl<'v, 'a> GatherPoint<'v, 'a> {
    fn new(vertex: &'v Vertex<'a>, smooth: &'v SurfacePoint, storable: bool) -> Self {
        let weighted_by = (vertex.surface.ns != smooth.ns).then_some(smooth);
        Self { vertex, storable, weighted_by }
    }

    /// The factor on a photon from the direction `wi`: its cosine to the normal of the vertex over that to the normal by which
    /// it was weighted. It is not bounded where light grazes a surface whose relief faces it: such photons are as rare as
    /// they are heavy.
    #[inline]
    fn share(&self, wi: Vec3) -> f32 {
        let Some(smooth) = self.weighted_by else { return 1.0 };
        let share = (wi.dot(self.vertex.surface.ns) / wi.dot(smooth.normal_seen_from(wi))).abs();
        if share.is_finite() { share } else { 0.0 }
    }
}
