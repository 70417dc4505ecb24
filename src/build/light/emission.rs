//! Photons as they leave the lights.
//!
//! A light is chosen with probability `P` in proportion to its flux, a point of it with density `p_A`
//! per area and a direction with density `p_ω` per solid angle. Of `N` photons **emitted**, those
//! that meet nothing included, each carries
//!
//! ```text
//! Φ = Lₑ·|cos θ| / (N·P·p_A·p_ω)          (watts per channel)
//! ```
//!
//! so that the sum over all photons has the flux of all lights as its mean (Pharr, Jakob, Humphreys
//! 2016, *Physically Based Rendering*, 3rd ed., section 16.2.1). [`EmittedPhoton::power`] lacks the
//! `1/N`. A light infinitely far away shines through the disk of the *reach*, the sphere around
//! everything that has bounds, perpendicular to the direction drawn.

use super::towards::{DistantCone, axis_of, spot_falloff};
use super::{Aim, BoundingSphere, Emitter, LightTable, Lights};
use crate::build::bvh::{SurfacePoint, TopLevel};
use crate::description::{Light, PhotonSettings, Rgb};
use crate::extract::{
    Geometry, Instance, Instances, NOTHING, PunctualLight, PunctualLights, Surfaces,
};
use crate::math::{Aabb, Frame, Ray, offset_ray_origin};
use crate::sampling::Piecewise1D;
use crate::sampling::warp::{
    cosine_hemisphere, cosine_hemisphere_pdf, square_to_disk, uniform_cone, uniform_sphere,
};
use crate::shade::MaterialTable;
use crate::shape::{AreaFactor, triangle_area};
use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;

/// How much larger the reach is where the scene has an infinite plane. Light which meets the plane beyond it is not in the photons
/// ([`PhotonSource::covers`]).
const REACH_WITH_PLANES: f64 = 2.0;
/// What of a scene has no end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Endless {
    /// Whether there are planes.
    pub planes: bool,
    /// A point and the normal of each plane that mirrors or lets through, where there is a light without any extent infinitely
    /// far away: what the plane makes of it no path can find.
    pub mirrors: Vec<[DVec3; 2]>,
}

impl Endless {
    /// What instances and lights without an end are.
    pub fn of(instances: &[Instance], materials: &MaterialTable, lights: &[PunctualLight]) -> Self {
        let is_sharp = |l: &PunctualLight| matches!(l.light, Light::Directional { angle: 0.0, .. });
        let is_sharp = lights.iter().any(is_sharp);
        let mut endless = Self::default();
        for plane in instances.iter().filter(|i| !i.bounds.min.is_finite()) {
            endless.planes = true;
            let has_delta = plane.material != NOTHING
                && materials.may_cast_caustics(plane.material, f32::MIN_POSITIVE);
            if is_sharp && has_delta {
                // The plane is y = 0 before its map; a moving one is met at both ends of the shutter.
                endless.mirrors.extend([0.0, 1.0].map(|time| {
                    let (map, inverse) = plane.motion.both_at(time);
                    let normal = inverse.matrix3.transpose() * DVec3::Y;
                    [map.translation, normal.normalize_or(DVec3::Y)]
                }));
            }
        }
        endless
    }

    /// How far photons from infinitely far away reach around everything that has an end. What a plane mirrors to there passes
    /// through the mirror image of the sphere.
    fn reach(&self, sphere: BoundingSphere) -> BoundingSphere {
        let share = if self.planes { REACH_WITH_PLANES } else { 1.0 };
        let images = self.mirrors.iter().map(|[p, n]| {
            let height = (sphere.center - *p).dot(*n).abs();
            sphere.radius + 2.0 * height
        });
        let radius = images.fold(share * sphere.radius, f64::max);
        BoundingSphere { radius, ..sphere }
    }
}

/// A photon at the moment of its emission.
#[derive(Clone, Copy, Debug)]
pub struct EmittedPhoton {
    /// Where it flies.
    pub ray: Ray,
    /// Watts per channel, times the number of photons emitted.
    pub power: Rgb,
}

/// The random numbers of an emission.
#[derive(Clone, Copy, Debug)]
pub struct PhotonNumbers {
    /// Chooses the light.
    pub light: f64,
    /// The point on the light, or on the disk of one far away.
    pub point: Vec2,
    /// The direction.
    pub direction: Vec2,
    /// Which object it is aimed at.
    pub aim: f32,
}

/// From where photons come: how a light is chosen, and how far photons have to reach.
#[derive(Resource, Clone, Debug, Default)]
pub struct PhotonSource {
    choice: Option<Piecewise1D>,
    /// Around everything that has bounds; `None` where nothing has.
    pub reach: Option<BoundingSphere>,
    /// Flux of all lights, luminance, W.
    pub flux: f64,
    /// Whether light may come from infinitely far away to something that has no end.
    pub has_beyond: bool,
}

/// Writes [`PhotonSource`] when the lights or the objects changed.
pub fn rebuild_photon_source(
    lights: Res<LightTable>,
    instances: Res<Instances>,
    surfaces: Res<Surfaces>,
    punctual: Res<PunctualLights>,
    top: Res<TopLevel>,
    mut source: ResMut<PhotonSource>,
) {
    let changed = lights.is_changed() || instances.is_changed() || surfaces.is_changed();
    if changed || source.choice.is_none() {
        let endless = Endless::of(&instances.list, &surfaces.materials, &punctual.0);
        *source = PhotonSource::new(&lights, top.bounds(), &endless);
    }
}

impl PhotonSource {
    /// * `bounds` — around everything that has bounds.
    /// * `endless` — what has none.
    pub fn new(lights: &LightTable, bounds: Aabb, endless: &Endless) -> Self {
        let reach = BoundingSphere::around(&bounds).map(|sphere| endless.reach(sphere));
        let disk = reach.map_or(0.0, |reach| PI * reach.radius * reach.radius);
        let far = lights.far_irradiance.iter().map(|irradiance| irradiance * disk);
        let fluxes = lights.near_flux.iter().copied().chain(far);
        // What a light emits may overflow when it is multiplied by a huge disk.
        let fluxes: Vec<f64> = fluxes.map(|f| if f.is_finite() { f } else { f64::MAX }).collect();
        let greatest = fluxes.iter().copied().fold(0.0, f64::max);
        let choice =
            (greatest > 0.0).then(|| Piecewise1D::new(fluxes.iter().map(|flux| flux / greatest)));
        let has_beyond = endless.planes && !lights.far_irradiance.is_empty();
        Self { choice, reach, flux: fluxes.iter().sum(), has_beyond }
    }

    /// The greatest radius over which photons are gathered, metres.
    pub fn largest_radius(&self, photons: &PhotonSettings) -> f32 {
        let reach = self.reach.map_or(f64::INFINITY, |reach| reach.radius);
        photons.largest_radius * reach as f32
    }

    /// Whether photons may come from infinitely far away in the unit direction `wi` to a point: whether the line between passes
    /// through the reach. All that has an end lies within.
    pub fn covers(&self, p: DVec3, wi: Vec3) -> bool {
        self.reach.is_some_and(|reach| {
            let (from, wi) = (p - reach.center, wi.as_dvec3());
            from.cross(wi).length_squared() <= reach.radius * reach.radius * wi.length_squared()
        })
    }

    /// Draws a photon; `None` if it carries nothing. With an `aim`, only photons which may meet what
    /// is aimed at are drawn.
    pub fn emit(
        &self,
        lights: &Lights,
        numbers: &PhotonNumbers,
        time: f32,
        aim: Option<&Aim>,
    ) -> Option<EmittedPhoton> {
        let choice = self.choice.as_ref()?;
        let (index, _) = choice.sample(numbers.light);
        let probability = choice.probability(index);
        let emitter = Emission { lights, numbers, time, aim, has_beyond: self.has_beyond };
        let mut photon = match lights.table.emitters[index] {
            Emitter::Shape(instance) => emitter.shape(instance),
            Emitter::Triangle { instance, triangle } => emitter.triangle(instance, triangle),
            Emitter::Punctual(light) => emitter.punctual(light, self.reach),
        }?;
        photon.power /= probability as f32;
        (photon.power.is_finite() && photon.power.max_element() > 0.0).then_some(photon)
    }
}

/// What one emission depends on.
struct Emission<'a> {
    lights: &'a Lights<'a>,
    numbers: &'a PhotonNumbers,
    time: f32,
    aim: Option<&'a Aim>,
    has_beyond: bool,
}

impl Emission<'_> {
    /// From an analytic shape: a point evenly by canonical area, a direction by the cosine.
    fn shape(&self, instance: u32) -> Option<EmittedPhoton> {
        let object = &self.lights.geometry.instances[instance as usize];
        let Geometry::Primitive(shape) = &object.geometry else { return None };
        let (map, inverse) = object.motion.both_at(self.time);
        let point = shape.sample(self.numbers.point, &map)?;
        let local = shape.surface(point.p, point.face, object.needs_uv);
        let factor = AreaFactor::new(&map.matrix3).at(local.ng);
        let surface = SurfacePoint::new(&local, &map, &inverse);
        self.surface(instance, &surface, factor / point.pdf_area)
    }

    /// From a triangle of a mesh, evenly by area.
    fn triangle(&self, instance: u32, triangle: u32) -> Option<EmittedPhoton> {
        let object = &self.lights.geometry.instances[instance as usize];
        let Geometry::Mesh(mesh) = object.geometry else { return None };
        let (map, inverse) = object.motion.both_at(self.time);
        let root = f64::from(self.numbers.point.x).sqrt();
        let weights = DVec2::new(1.0 - root, root * f64::from(self.numbers.point.y));
        let local = self.lights.geometry.meshes[mesh as usize].surface(
            triangle,
            weights,
            self.time,
            object.needs_uv,
        );
        let area = triangle_area(self.lights.triangle(instance, triangle, self.time, &map));
        self.surface(instance, &SurfacePoint::new(&local, &map, &inverse), area)
    }

    /// From a point of a surface which was drawn with density `1/area`.
    fn surface(&self, instance: u32, surface: &SurfacePoint, area: f64) -> Option<EmittedPhoton> {
        let emitted = self.lights.table.emitted[instance as usize].as_ref()?;
        let sides = if emitted.two_sided { 2.0 } else { 1.0 };
        let frame = Frame::from_z(surface.ng);
        let natural = |u: Vec2| {
            // One number chooses the side and is stretched back to its interval.
            let back = emitted.two_sided && u.x >= 0.5;
            let x = if emitted.two_sided { 2.0 * u.x - f32::from(u8::from(back)) } else { u.x };
            let local = cosine_hemisphere(Vec2::new(x.min(1.0_f32.next_down()), u.y));
            frame.from_local(local.with_z(if back { -local.z } else { local.z })).normalize()
        };
        let natural_pdf = |wi: Vec3| {
            let cos = wi.dot(surface.ng);
            cosine_hemisphere_pdf(if emitted.two_sided { cos.abs() } else { cos }) / sides
        };
        let (wi, weight) = match self.aim {
            None => (natural(self.numbers.direction), sides / FRAC_1_PI),
            Some(aim) => {
                let PhotonNumbers { aim: choose, direction, .. } = *self.numbers;
                let (wi, pdf) = aim.direction(surface.p, choose, direction, natural, natural_pdf);
                (wi, natural_pdf(wi) * sides / FRAC_1_PI / pdf)
            }
        };
        let power = self.lights.sent(instance, surface, wi, self.time) * (weight * area as f32);
        let o = offset_ray_origin(surface.p, surface.p_error, surface.ng, wi);
        Some(EmittedPhoton { ray: Ray { o, d: wi, time: self.time }, power })
    }

    fn punctual(&self, index: u32, reach: Option<BoundingSphere>) -> Option<EmittedPhoton> {
        let light = &self.lights.punctual[index as usize];
        match light.light {
            Light::Point { .. } | Light::Spot { .. } => self.at_point(light),
            Light::Directional { .. } | Light::Sky { .. } => self.far_away(index, light, reach?),
        }
    }

    fn at_point(&self, light: &PunctualLight) -> Option<EmittedPhoton> {
        let map = light.motion.at(self.time);
        let p = map.translation;
        let axis = axis_of(&map);
        // 1 − cos of the half angle of the cone; 2 is all around.
        let (intensity, one_minus_cos) = match light.light {
            Light::Point { intensity, power } => {
                (PunctualLight::point_intensity(intensity, power), 2.0)
            }
            Light::Spot { intensity, angle, .. } => {
                (intensity, 2.0 * (0.5 * f64::from(angle).to_radians()).sin().powi(2))
            }
            Light::Directional { .. } | Light::Sky { .. } => return None,
        };
        let one_minus_cos = one_minus_cos as f32;
        let natural = |u: Vec2| {
            let local = if one_minus_cos >= 2.0 {
                uniform_sphere(u)
            } else {
                uniform_cone(u, one_minus_cos)
            };
            Frame::from_z(axis).from_local(local).normalize()
        };
        let natural_pdf = |wi: Vec3| {
            let inside = 0.5 * (wi - axis).length_squared() <= one_minus_cos;
            if inside || one_minus_cos >= 2.0 { 1.0 / (TAU * one_minus_cos) } else { 0.0 }
        };
        let PhotonNumbers { aim: choose, direction, .. } = *self.numbers;
        let (wi, pdf) = match self.aim {
            None => (natural(direction), 1.0 / (TAU * one_minus_cos)),
            Some(aim) => aim.direction(p, choose, direction, natural, natural_pdf),
        };
        let falloff = match light.light {
            Light::Spot { angle, blend, .. } => spot_falloff(wi.dot(axis), angle, blend),
            _ => 1.0,
        };
        let ray = Ray { o: p.as_vec3(), d: wi, time: self.time };
        let power = self.lights.materials.seen(intensity) * (falloff / pdf);
        Some(EmittedPhoton { ray, power })
    }

    /// From infinitely far away: a direction, then a point of the disk perpendicular to it.
    fn far_away(
        &self,
        index: u32,
        light: &PunctualLight,
        reach: BoundingSphere,
    ) -> Option<EmittedPhoton> {
        let map = light.motion.at(self.time);
        let PhotonNumbers { point, direction, aim: choose, .. } = *self.numbers;
        // Towards the light, and radiance over the density of the direction.
        let (wi, irradiance) = match light.light {
            Light::Directional { irradiance, angle } => {
                let irradiance = self.lights.materials.seen(irradiance);
                let axis = -axis_of(&map);
                match DistantCone::new(angle) {
                    None => (axis, irradiance),
                    Some(cone) => {
                        let local = uniform_cone(direction, cone.one_minus_cos_max);
                        let wi = Frame::from_z(axis).from_local(local).normalize();
                        (wi, irradiance / (cone.projected_solid_angle * cone.pdf()))
                    }
                }
            }
            Light::Sky { .. } => {
                let sky = self.lights.table.skies[index as usize].as_ref()?;
                let (wi, pdf) = sky.sample_all_around(direction, &map)?;
                (wi, sky.radiance(wi, &map, self.lights.materials) / pdf)
            }
            Light::Point { .. } | Light::Spot { .. } => return None,
        };
        let d = -wi;
        let (p, pdf_area) = match self.aim {
            None => {
                let disk = (square_to_disk(point).as_dvec2() * reach.radius).extend(0.0);
                let across = Frame::from_z(d).from_local(disk.as_vec3()).as_dvec3();
                (reach.center + across, 1.0 / (PI * reach.radius * reach.radius))
            }
            Some(aim) => aim.point_across(d, choose, point),
        };
        // Back along the ray to where it enters the reach.
        let axis = d.as_dvec3();
        let o: DVec3 = p - axis * ((p - reach.center).dot(axis) + reach.radius);
        let mut ray = Ray { o: o.as_vec3(), d, time: self.time };
        if self.has_beyond {
            self.begin_beyond(&mut ray);
        }
        Some(EmittedPhoton { ray, power: irradiance / pdf_area as f32 })
    }

    /// Has a ray from infinitely far away begin before the planes on its way to the reach: these may stop it.
    fn begin_beyond(&self, ray: &mut Ray) {
        let mut back = Ray { d: -ray.d, ..*ray };
        while let Some(hit) = self.lights.geometry.closest_hit(&back, f64::INFINITY, false) {
            let surface = self.lights.geometry.surface(&back, &hit);
            back.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, back.d);
        }
        ray.o = back.o;
    }
}
