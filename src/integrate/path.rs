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
use super::share::{Departure, Landing, SharedPath};
use super::vertex::Vertex;
use crate::build::bvh::{Hit, SurfacePoint};
use crate::build::light::Receiver;
use crate::description::Rgb;
use crate::extract::{CameraRay, NOTHING};
use crate::film::{FirstHit, PixelSample};
use crate::math::{Ray, offset_ray_origin};
use crate::sampling::{Sampler, dimension, power_heuristic};
use crate::shade::Bsdf;
use glam::{DVec3, Vec2, Vec3};

/// The path tracer with its settings.
///
/// `OPACITY` and `ABSORPTION` say whether the scene requires surfaces with holes and solids which
/// absorb; without them there is no code for them on the path.
#[derive(Clone, Copy)]
pub struct PathTracer<'a, const OPACITY: bool, const ABSORPTION: bool> {
    /// The scene.
    pub scene: SceneView<'a>,
    /// Greatest number of surface interactions.
    pub max_depth: u32,
    /// Interactions before roulette may end a path.
    pub roulette_depth: u32,
    /// A path survives with the probability of this times its throughput.
    pub roulette_gain: f32,
    /// Upper limit of a sample's radiance after its first bounce.
    pub clamp_indirect: Option<f32>,
    /// Whether the film wants to know what the camera ray met first.
    pub wants_first_hit: bool,
    /// World position of the origin of render space.
    pub origin: DVec3,
}

/// What happened on the paths of one tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathCounters {
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Paths which were cut off at the greatest depth although they still carried something.
    pub truncated: u64,
}

impl PathCounters {
    /// The sum of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { rays: self.rays + other.rays, truncated: self.truncated + other.truncated }
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
struct Path<'a> {
    ray: Ray,
    radiance: Rgb,
    throughput: Rgb,
    /// Product of the η² by which refraction has scaled the throughput so far, inverted.
    eta_scale: f32,
    arrival: Arrival,
    first_hit: Option<FirstHit>,
    inside: u32,
    /// Whether a light was drawn already.
    lit: bool,
    /// Surface interactions.
    depth: u32,
    /// Surfaces met: those which let the ray pass count only here.
    met: u32,
    departure: Option<Departure<'a>>,
    landing: Option<Landing>,
    /// Radiance gathered before the landing, and the throughput there.
    before: Rgb,
    throughput_before: Rgb,
    /// What roulette between departure and landing multiplied the path by.
    boost: f32,
}

impl Path<'_> {
    fn new(camera_ray: &CameraRay) -> Self {
        Self {
            ray: camera_ray.ray,
            radiance: Rgb::ZERO,
            throughput: Rgb::ONE,
            eta_scale: 1.0,
            arrival: Arrival::Sure,
            first_hit: None,
            inside: NOTHING,
            lit: false,
            depth: 0,
            met: 0,
            departure: None,
            landing: None,
            before: Rgb::ZERO,
            throughput_before: Rgb::ONE,
            boost: 1.0,
        }
    }

    /// The throughput from the camera on.
    fn carried<const SHARE: bool>(&self) -> Rgb {
        if SHARE { self.throughput * self.throughput_before } else { self.throughput }
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

impl<'a, const OPACITY: bool, const ABSORPTION: bool> PathTracer<'a, OPACITY, ABSORPTION> {
    /// The radiance which arrives along a camera ray.
    pub fn sample(
        &self,
        camera_ray: &CameraRay,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> PixelSample {
        let mut path = Path::new(camera_ray);
        self.follow::<false>(&mut path, camera_ray, sampler, counters);
        PixelSample { radiance: path.radiance, first_hit: path.first_hit }
    }

    /// Like [`PathTracer::sample`], with what neighbours may use of the path kept apart.
    pub(super) fn sample_shared(
        &self,
        camera_ray: &CameraRay,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) -> SharedPath<'a> {
        let mut path = Path::new(camera_ray);
        self.follow::<true>(&mut path, camera_ray, sampler, counters);
        let Path { radiance, first_hit, departure, mut landing, before, boost, .. } = path;
        let radiance = match &mut landing {
            Some(landing) => {
                landing.leaving = radiance * boost;
                before
            }
            None => radiance,
        };
        SharedPath { sample: PixelSample { radiance, first_hit }, departure, landing }
    }

    /// Follows a path to its end.
    ///
    /// With `SHARE` the first surface that scatters at random is kept as the place of departure, and if
    /// the next one is diffuse it is kept as the landing: what leaves it is gathered as if the path
    /// had begun there, and what it had gathered before is put aside.
    fn follow<const SHARE: bool>(
        &self,
        path: &mut Path<'a>,
        camera_ray: &CameraRay,
        sampler: &Sampler,
        counters: &mut PathCounters,
    ) {
        loop {
            counters.rays += 1;
            let from_camera = path.met == 0;
            let Some(hit) = self.scene.geometry.closest_hit(&path.ray, f64::INFINITY, from_camera)
            else {
                let light = self.infinite(&path.ray, path.arrival);
                path.radiance += self.limited(path.throughput * light, path.depth);
                break;
            };
            let dimensions = dimension::vertex(path.met);
            path.met += 1;
            let surface = self.scene.geometry.surface(&path.ray, &hit);
            let instance = &self.scene.geometry.instances[hit.instance as usize];
            let materials = &self.scene.surfaces.materials;
            let wo = -path.ray.d;
            if ABSORPTION {
                path.throughput *= self.transmittance(path.inside, hit.t);
            }
            // One number decides whether the ray passes through a hole and, stretched back to the
            // whole interval, whether the path goes on.
            let mut roulette = None;
            if OPACITY && instance.material != NOTHING {
                let opacity = materials.opacity(instance.material, surface.uv);
                if opacity < 1.0 {
                    let u = sampler.one(dimensions + dimension::ROULETTE);
                    if u >= opacity {
                        let SurfacePoint { p, p_error, ng, .. } = surface;
                        path.ray.o = offset_ray_origin(p, p_error, ng, path.ray.d);
                        continue;
                    }
                    roulette = Some(u / opacity);
                }
            }
            if instance.emission != NOTHING {
                let emitted = self.emitted(&hit, &surface, wo, path.ray.time, path.arrival);
                path.radiance += self.limited(path.throughput * emitted, path.depth);
            }
            if instance.material == NOTHING {
                if self.wants_first_hit && path.depth == 0 && path.first_hit.is_none() {
                    let first = self.first_hit(camera_ray, &path.ray, &hit, &surface, None);
                    path.first_hit = Some(first);
                }
                break;
            }
            let mut lobe = if materials.needs_lobe(instance.material) {
                sampler.one(dimensions + dimension::LOBE)
            } else {
                0.0
            };
            let bsdf = materials.bsdf(instance.material, surface.uv, &mut lobe);
            if self.wants_first_hit && path.depth == 0 && path.first_hit.is_none() {
                let first = self.first_hit(camera_ray, &path.ray, &hit, &surface, Some(&bsdf));
                path.first_hit = Some(first);
            }
            if path.depth == self.max_depth {
                counters.truncated += 1;
                break;
            }
            if SHARE {
                path.land(&surface, wo, &bsdf);
            }
            let vertex = Vertex::new(surface, wo, bsdf);
            let mut receiver = vertex.receiver();
            let (to_scatter, on_light) =
                sampler.four(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
            if vertex.bsdf.has_non_delta() {
                let lights = &self.scene.lights;
                let choose = if lights.has_choice() {
                    sampler.one_fine(dimensions + dimension::LIGHT)
                } else {
                    0.0
                };
                let mut draw = |receiver: &Receiver, choose: f64, on_light: Vec2| {
                    let (wi, distance, light) =
                        self.direct(&vertex, receiver, choose, on_light, path.ray.time, counters);
                    if ABSORPTION && light != Rgb::ZERO {
                        let material = instance.material;
                        let medium = self.medium_towards(wi, &vertex, material, path.inside);
                        light * self.transmittance(medium, distance)
                    } else {
                        light
                    }
                };
                // Where a path is lit first its noise counts most: it draws from the lights at a
                // place and from the distant ones, later from either.
                receiver.draws_both = !path.lit && lights.has_both_groups();
                let light = if receiver.draws_both {
                    let distant = sampler.two(dimensions + dimension::DISTANT_LIGHT_POINT);
                    draw(&receiver, 0.5 * choose, distant)
                        + draw(&receiver, 0.5 + 0.5 * choose, on_light)
                } else {
                    draw(&receiver, choose, on_light)
                };
                path.lit = true;
                path.radiance += self.limited(path.throughput * light, path.depth);
            }
            let Some((wi, sample)) = vertex.scatter(lobe, to_scatter) else {
                break;
            };
            if SHARE && !sample.delta && path.departure.is_none() {
                path.departure = Some(Departure {
                    vertex: vertex.clone(),
                    depth: path.depth,
                    throughput: path.throughput,
                    weight: sample.weight,
                    pdf: sample.pdf,
                });
            }
            path.throughput *= sample.weight;
            path.depth += 1;
            path.eta_scale *= sample.eta * sample.eta;
            if ABSORPTION {
                path.inside = self.medium_towards(wi, &vertex, instance.material, path.inside);
            }
            if path.depth >= self.roulette_depth {
                let carried = path.carried::<SHARE>() * path.eta_scale;
                let survival = (carried.max_element() * self.roulette_gain).min(1.0);
                let u = roulette.unwrap_or_else(|| sampler.one(dimensions + dimension::ROULETTE));
                if u >= survival || survival.is_nan() {
                    break;
                }
                path.throughput /= survival;
                if SHARE && path.is_between() {
                    path.boost /= survival;
                }
            }
            let SurfacePoint { p, p_error, ng, .. } = vertex.surface;
            path.ray.o = offset_ray_origin(p, p_error, ng, wi);
            path.ray.d = wi;
            path.arrival = if sample.delta {
                Arrival::Sure
            } else {
                Arrival::Drawn { from: receiver, pdf: sample.pdf }
            };
        }
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
        let radiance = lights.emitted(hit.instance, surface, wo);
        match arrival {
            Arrival::Drawn { from, pdf } if radiance != Rgb::ZERO => {
                let light_pdf =
                    lights.pdf(&from, hit.instance, hit.primitive, surface.p, surface.ng, time);
                radiance * power_heuristic(pdf, light_pdf)
            }
            _ => radiance,
        }
    }

    /// Light which arrives straight from a light, by one connection: with its unit direction and its
    /// distance in metres.
    pub(super) fn direct(
        &self,
        vertex: &Vertex,
        receiver: &Receiver,
        choose: f64,
        on_light: Vec2,
        time: f32,
        counters: &mut PathCounters,
    ) -> (Vec3, f64, Rgb) {
        const NONE: (Vec3, f64, Rgb) = (Vec3::ZERO, 0.0, Rgb::ZERO);
        let Some(light) = self.scene.lights.sample(receiver, time, choose, on_light) else {
            return NONE;
        };
        let (f_cos, pdf) = vertex.evaluate(light.wi);
        if f_cos == Rgb::ZERO {
            return NONE;
        }
        let (shadow_ray, end) = light.shadow_ray(receiver, time);
        counters.rays += 1;
        let visible = self.visible(&shadow_ray, end);
        if visible == 0.0 {
            return NONE;
        }
        let weight = if light.delta { 1.0 } else { power_heuristic(light.pdf, pdf) };
        let distance = end * shadow_ray.d.as_dvec3().length();
        (light.wi, distance, f_cos * light.radiance * (visible * weight / light.pdf))
    }

    /// The material of the solid in which a path goes on from a vertex in the direction `wi`, when it
    /// arrived inside `inside`; [`NOTHING`] outside.
    pub(super) fn medium_towards(
        &self,
        wi: Vec3,
        vertex: &Vertex,
        material: u32,
        inside: u32,
    ) -> u32 {
        if !vertex.crosses(wi) || !self.scene.surfaces.materials.is_dielectric(material) {
            return inside;
        }
        let entering = wi.dot(vertex.surface.ng) < 0.0;
        if entering { material } else { NOTHING }
    }

    /// Share of the light which passes along a segment.
    pub(super) fn visible(&self, shadow_ray: &Ray, end: f64) -> f32 {
        if !OPACITY {
            return if self.scene.geometry.occluded(shadow_ray, end) { 0.0 } else { 1.0 };
        }
        // Holes let a share of the light through: follow the segment from surface to surface.
        let mut passed = 1.0;
        let target = shadow_ray.at(if end.is_finite() { end } else { 1.0 });
        let mut ray = *shadow_ray;
        while let Some(hit) = self.scene.geometry.closest_hit(&ray, end, false) {
            let material = self.scene.geometry.instances[hit.instance as usize].material;
            if material == NOTHING || !self.scene.surfaces.materials.has_opacity(material) {
                return 0.0;
            }
            let surface = self.scene.geometry.surface(&ray, &hit);
            passed *= 1.0 - self.scene.surfaces.materials.opacity(material, surface.uv);
            if passed == 0.0 {
                return 0.0;
            }
            ray.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, ray.d);
            if end.is_finite() {
                ray.d = (target - ray.o.as_dvec3()).as_vec3();
                if ray.d.dot(shadow_ray.d) <= 0.0 {
                    break;
                }
            }
        }
        passed
    }

    /// Beer and Lambert's law inside a solid of this material over a distance in metres; 1 outside.
    pub(super) fn transmittance(&self, material: u32, distance: f64) -> Rgb {
        if material == NOTHING {
            return Rgb::ONE;
        }
        match self.scene.surfaces.materials.attenuation(material) {
            // A channel which absorbs nothing stays 1 at any distance, 0·∞ included.
            Some(sigma_a) => sigma_a
                .map(|sigma| if sigma == 0.0 { 1.0 } else { (-sigma * distance as f32).exp() }),
            None => Rgb::ONE,
        }
    }

    /// The knob `clamp_indirect`; what the camera or its first surface sees is never limited.
    pub(super) fn limited(&self, radiance: Rgb, depth: u32) -> Rgb {
        match self.clamp_indirect {
            Some(limit) if depth > 0 => radiance.min(Rgb::splat(limit)),
            _ => radiance,
        }
    }

    pub(super) fn first_hit(
        &self,
        camera_ray: &CameraRay,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
        bsdf: Option<&Bsdf>,
    ) -> FirstHit {
        let scene = &self.scene;
        let normal = if surface.ns.dot(ray.d) > 0.0 { -surface.ns } else { surface.ns };
        let depth = (surface.p - camera_ray.ray.o.as_dvec3()).dot(camera_ray.axis);
        let albedo = bsdf.map_or(Rgb::ZERO, |bsdf| bsdf.albedo(surface.frame().to_local(-ray.d)));
        let film = |time: f32| scene.camera.project(scene.geometry.point_at(ray, hit, time), time);
        let motion = match (film(0.0), film(1.0)) {
            (Some(from), Some(to)) => (to - from).as_vec2(),
            _ => Vec2::ZERO,
        };
        FirstHit {
            albedo,
            normal,
            depth: depth as f32,
            position: surface.p + self.origin,
            motion,
            object_id: scene.geometry.instances[hit.instance as usize].object_id,
        }
    }
}
