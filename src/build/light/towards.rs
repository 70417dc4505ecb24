//! Drawing a direction from a point towards a light, and the density of that for a direction which
//! was found otherwise.
//!
//! Spheres, rectangles and triangles are drawn evenly by solid angle, other shapes evenly by area.
//! All densities are per unit solid angle at the receiver and include the choice of the light.

use super::shapes::{RectangleLight, ShapeLight, SphereLight};
use super::{Emitted, Emitter, LightTable, ShapeLights};
use crate::build::bvh::{SceneGeometry, SurfacePoint};
use crate::description::{Light, Rgb};
use crate::extract::{Geometry, NOTHING, PunctualLight};
use crate::math::{Chart, Ray, gamma, offset_ray_origin};
use crate::sampling::warp::uniform_cone;
use crate::shade::{MaterialTable, TexturePoint};
use crate::shape::{
    AreaFactor, ConeOfSphere, Primitive, RectangleSampler, sample_rectangle, sample_sphere,
    sample_triangle, triangle_pdf,
};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};
use std::f32::consts::TAU;

/// The point which receives light.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The point in render space.
    pub p: DVec3,
    /// Bound of its error per axis.
    pub p_error: DVec3,
    /// Unit geometric normal.
    pub ng: Vec3,
    /// Unit shading normal on the side from which the path arrives; zero in a medium, which faces nowhere.
    pub facing: Vec3,
    /// The same normal if light from behind it cannot matter; `None` where the surface transmits.
    pub horizon: Option<Vec3>,
    /// Whether it draws once from each of the two groups of lights, those at a place and those
    /// infinitely far away, instead of once from either.
    pub draws_both: bool,
}

impl Receiver {
    /// How many times as many lights it draws.
    #[inline]
    fn draws(&self) -> f32 {
        if self.draws_both { 2.0 } else { 1.0 }
    }
}

/// Where a shadow ray ends.
#[derive(Clone, Copy, Debug)]
pub enum ShadowEnd {
    /// On an emitting surface.
    Surface {
        /// The point.
        p: DVec3,
        /// Bound of its error per axis.
        p_error: DVec3,
        /// Unit normal.
        n: Vec3,
    },
    /// At a point in space.
    Point(DVec3),
    /// Infinitely far away.
    Infinity,
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// Radiance arriving from there when nothing is in between; for lights without extent the
    /// irradiance of a plane which faces them.
    pub radiance: Rgb,
    /// Density per unit solid angle; for lights without extent the probability of the choice.
    pub pdf: f32,
    /// Whether the light has no extent, so that no other technique finds it.
    pub delta: bool,
    /// Where the light is.
    pub end: ShadowEnd,
}

impl LightSample {
    /// The segment from the receiver to the light, and the parameter of its end.
    #[inline]
    pub fn shadow_ray(&self, from: &Receiver, time: f32) -> (Ray, f64) {
        shadow_ray(from, self.wi, &self.end, time)
    }
}

/// The segment from a receiver in the unit direction `wi` to an end, and the parameter of the end.
#[inline]
pub fn shadow_ray(from: &Receiver, wi: Vec3, end: &ShadowEnd, time: f32) -> (Ray, f64) {
    let o = offset_ray_origin(from.p, from.p_error, from.ng, wi);
    let target = match *end {
        ShadowEnd::Infinity => return (Ray { o, d: wi, time }, f64::INFINITY),
        ShadowEnd::Point(p) => p.as_vec3(),
        ShadowEnd::Surface { p, p_error, n } => {
            // The vector to the end is rounded to f32: its error joins that of the point.
            let length = (p - from.p).length() * f64::from(gamma(2));
            offset_ray_origin(p, p_error + DVec3::splat(length), n, -wi)
        }
    };
    (Ray { o, d: target - o, time }, 1.0)
}

/// The lights of a frame together with what they refer to.
#[derive(Clone, Copy, Debug)]
pub struct Lights<'a> {
    /// Which there are.
    pub table: &'a LightTable,
    /// Emitting shapes at rest.
    pub shapes: &'a ShapeLights,
    /// Lights without a shape.
    pub punctual: &'a [PunctualLight],
    /// Shapes.
    pub geometry: SceneGeometry<'a>,
    /// Textures.
    pub materials: &'a MaterialTable,
}

/// How points of an emitting shape are drawn from one receiver.
enum ShapeSampling {
    Cone { cone: ConeOfSphere },
    Rectangle { sampler: RectangleSampler },
    Area,
}

impl ShapeSampling {
    /// The best way for `primitive` under `map` as seen from `from`.
    fn choose(primitive: &Primitive, map: &DAffine3, from: &Receiver) -> Self {
        let m = &map.matrix3;
        let p = from.p;
        match primitive {
            // A point of the sphere itself may lie outside it by its rounding. Its cone would hold the
            // side next to it alone, and none of what it sees across the inside.
            Primitive::Sphere if is_similarity(map) => {
                ConeOfSphere::new(p, map.translation, m.x_axis.length(), from.p_error.length())
                    .map_or(Self::Area, |cone| Self::Cone { cone })
            }
            Primitive::Rectangle if is_perpendicular(m.x_axis, m.y_axis) => {
                let corner = map.translation - (m.x_axis + m.y_axis) * 0.5;
                RectangleSampler::new(p, corner, m.x_axis, m.y_axis)
                    .map_or(Self::Area, |sampler| Self::Rectangle { sampler })
            }
            _ => Self::Area,
        }
    }
}

/// Whether two edges are perpendicular to the precision of `f32`.
pub(super) fn is_perpendicular(a: DVec3, b: DVec3) -> bool {
    a.dot(b).abs() <= f64::from(f32::EPSILON) * a.length() * b.length()
}

/// Whether a map keeps spheres round, to the precision of `f32`.
pub(super) fn is_similarity(map: &DAffine3) -> bool {
    let m = &map.matrix3;
    let (x, y, z) = (m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
    let tolerance = f64::from(f32::EPSILON) * x;
    (x - y).abs() <= tolerance
        && (x - z).abs() <= tolerance
        && is_perpendicular(m.x_axis, m.y_axis)
        && is_perpendicular(m.y_axis, m.z_axis)
        && is_perpendicular(m.z_axis, m.x_axis)
}

impl Lights<'_> {
    /// Whether [`Lights::sample`] looks at its number for the choice of a light.
    #[inline]
    pub fn has_choice(&self) -> bool {
        self.table.emitters.len() > 1
    }

    /// Whether there are lights both at a place and infinitely far away.
    #[inline]
    pub fn has_both_groups(&self) -> bool {
        self.table.choice.has_both_groups()
    }

    /// Draws a light and a direction towards it. For a receiver which draws from both groups a `choose`
    /// below ½ draws from the lights infinitely far away, any other from those at a place. `None` when the draw carries no light.
    pub fn sample(&self, from: &Receiver, time: f32, choose: f64, u: Vec2) -> Option<LightSample> {
        let (index, probability) =
            self.table.choice.sample(from.p.as_vec3(), from.horizon, choose)?;
        let mut sample = match self.table.emitters[index as usize] {
            Emitter::Shape(instance) => self.sample_shape(instance, from, time, u),
            Emitter::Triangle { instance, triangle } => {
                self.sample_mesh(instance, triangle, from, time, u)
            }
            Emitter::Punctual(index) => self.sample_punctual(index, from, time, u),
        }?;
        sample.pdf *= probability * from.draws();
        (sample.pdf > 0.0 && sample.pdf.is_finite() && sample.radiance != Rgb::ZERO)
            .then_some(sample)
    }

    /// The radiance which a surface emits from a point towards the unit direction `wo`.
    #[inline]
    pub fn emitted(&self, instance: u32, surface: &SurfacePoint, wo: Vec3, time: f32) -> Rgb {
        match &self.table.emitted[instance as usize] {
            Some(emitted) if emitted.two_sided || surface.ng.dot(wo) > 0.0 => {
                let at = self.geometry.texture_point(instance, surface, time);
                self.radiance_of(emitted, &at)
            }
            _ => Rgb::ZERO,
        }
    }

    /// Whether [`Lights::is_met_by_chance`] is true of any instance.
    pub fn has_met_by_chance(&self) -> bool {
        (0..self.table.emitted.len() as u32).any(|instance| self.is_met_by_chance(instance))
    }

    /// Whether an instance emits of which no point can be drawn, since it has no end: paths meet it by chance alone.
    #[inline]
    pub fn is_met_by_chance(&self, instance: u32) -> bool {
        let index = instance as usize;
        self.table.emitted[index].is_some() && self.table.first_of_instance[index] == NOTHING
    }

    /// The mean radiance which leaves a surface from a point towards the unit direction `wo`: holes in it emit nothing.
    /// Paths that were stopped there ask [`Lights::emitted`].
    #[inline]
    pub(super) fn sent(&self, instance: u32, surface: &SurfacePoint, wo: Vec3, time: f32) -> Rgb {
        match &self.table.emitted[instance as usize] {
            Some(emitted) if emitted.two_sided || surface.ng.dot(wo) > 0.0 => {
                let at = self.geometry.texture_point(instance, surface, time);
                self.sent_by(emitted, &at)
            }
            _ => Rgb::ZERO,
        }
    }

    /// The mean radiance of a point, which may be in a hole.
    #[inline]
    fn sent_by(&self, emitted: &Emitted, at: &TexturePoint) -> Rgb {
        let radiance = self.radiance_of(emitted, at);
        match emitted.mask {
            None => radiance,
            Some(material) => radiance * self.materials.opacity(material, at),
        }
    }

    /// The density with which [`Lights::sample`] draws the direction from `from` to a point `q` of an
    /// emitting surface with unit normal `n`.
    pub fn pdf(
        &self,
        from: &Receiver,
        instance: u32,
        primitive: u32,
        q: DVec3,
        n: Vec3,
        time: f32,
    ) -> f32 {
        let first = self.table.first_of_instance[instance as usize];
        if first == NOTHING {
            return 0.0;
        }
        // From outside the near side of a sphere is drawn; through holes in it the inside of the far one is seen.
        let is_seen = |p: DVec3| (p - q).dot(n.as_dvec3()) > 0.0;
        let prepared = match self.shapes.of(instance) {
            ShapeLight::Rectangle(rectangle) => Some(rectangle.pdf(from.p, q)),
            ShapeLight::Sphere(sphere) => {
                sphere.cone(from).map(|cone| if is_seen(from.p) { cone.pdf() } else { 0.0 })
            }
            ShapeLight::Other => None,
        };
        if let Some(pdf) = prepared {
            let choice = self.table.choice.probability(first, from.p.as_vec3(), from.horizon);
            return choice * from.draws() * pdf as f32;
        }
        let object = &self.geometry.instances[instance as usize];
        let map = object.motion.at(time);
        let (emitter, pdf) = match &object.geometry {
            Geometry::Primitive(shape) => {
                let pdf = match ShapeSampling::choose(shape, &map, from) {
                    ShapeSampling::Cone { cone } if is_seen(from.p) => cone.pdf(),
                    ShapeSampling::Cone { .. } => 0.0,
                    ShapeSampling::Rectangle { sampler } => sampler.pdf(),
                    ShapeSampling::Area => {
                        let local = map.inverse().transform_point3(q);
                        let normal = shape.surface(local, primitive, false).ng;
                        let area = AreaFactor::new(&map.matrix3).at(normal);
                        area_to_solid_angle(shape.pdf_area(primitive, &map) / area, q - from.p, n)
                    }
                };
                (first, pdf)
            }
            Geometry::Mesh(_) => (
                first + primitive,
                triangle_pdf(from.p, self.triangle(instance, primitive, time, &map), q),
            ),
        };
        let choice = self.table.choice.probability(emitter, from.p.as_vec3(), from.horizon);
        choice * from.draws() * pdf as f32
    }

    /// Radiance from the lights infinitely far away in the unit direction `wi`, each with the density
    /// with which [`Lights::sample`] draws it.
    pub fn infinite(
        &self,
        from: Option<&Receiver>,
        wi: Vec3,
        time: f32,
    ) -> impl Iterator<Item = (Rgb, f32)> {
        (0..self.punctual.len()).filter_map(move |index| {
            let light = &self.punctual[index];
            let probability = from.map_or(0.0, |from| {
                let emitter = self.table.of_punctual[index];
                let choice = self.table.choice.probability(emitter, from.p.as_vec3(), from.horizon);
                choice * from.draws()
            });
            if let Some(sky) = &self.table.skies[index] {
                let map = light.motion.at(time);
                let pdf = from.map_or(0.0, |from| sky.pdf(from.facing, wi, &map));
                return Some((sky.radiance(wi, &map, self.materials), pdf * probability));
            }
            let Light::Directional { irradiance, angle } = light.light else { return None };
            let cone = DistantCone::new(angle)?;
            let axis = -axis_of(&light.motion.at(time));
            // 1 − cos θ from the chord, without cancellation
            let one_minus_cos = 0.5 * (wi - axis).length_squared();
            (one_minus_cos <= cone.one_minus_cos_max).then(|| {
                let radiance = self.materials.seen(irradiance) / cone.projected_solid_angle;
                (radiance, cone.pdf() * probability)
            })
        })
    }

    pub(super) fn radiance_of(&self, emitted: &Emitted, at: &TexturePoint) -> Rgb {
        let seen = match (emitted.blackbody, self.materials.wavelengths()) {
            (Some((body, luminance)), Some(set)) => {
                self.table.blackbodies[body as usize].at(set) * luminance
            }
            _ => self.materials.color(&emitted.radiance, at),
        };
        seen * emitted.factor
    }

    pub(super) fn triangle(
        &self,
        instance: u32,
        triangle: u32,
        time: f32,
        map: &DAffine3,
    ) -> [DVec3; 3] {
        let Geometry::Mesh(mesh) = self.geometry.instances[instance as usize].geometry else {
            unreachable!("only meshes have triangles");
        };
        let corners = self.geometry.meshes[mesh as usize].corners(triangle, time);
        corners.map(|corner| map.transform_point3(corner))
    }

    fn sample_shape(
        &self,
        instance: u32,
        from: &Receiver,
        time: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        match self.shapes.of(instance) {
            ShapeLight::Rectangle(rectangle) => {
                return self.sample_rectangle(rectangle, instance, from, u);
            }
            ShapeLight::Sphere(sphere) => {
                if let Some(cone) = sphere.cone(from) {
                    return self.sample_sphere(sphere, &cone, instance, u);
                }
            }
            ShapeLight::Other => {}
        }
        let object = &self.geometry.instances[instance as usize];
        let Geometry::Primitive(shape) = &object.geometry else { return None };
        let (map, inverse) = object.motion.both_at(time);
        let (local, face, pdf) = match ShapeSampling::choose(shape, &map, from) {
            ShapeSampling::Cone { cone } => {
                let (_, normal) = sample_sphere(&cone, u);
                (inverse.transform_vector3(normal).normalize(), 0, Some(cone.pdf()))
            }
            ShapeSampling::Rectangle { sampler } => {
                let (_, share) = sample_rectangle(&sampler, u);
                ((share - DVec2::splat(0.5)).extend(0.0), 0, Some(sampler.pdf()))
            }
            ShapeSampling::Area => {
                let point = shape.sample(u, &map)?;
                (point.p, point.face, None)
            }
        };
        let canonical = shape.surface(local, face, object.needs_uv);
        let surface = SurfacePoint::new(&canonical, &map, &inverse);
        let pdf = pdf.unwrap_or_else(|| {
            let area = AreaFactor::new(&map.matrix3).at(canonical.ng);
            area_to_solid_angle(shape.pdf_area(face, &map) / area, surface.p - from.p, surface.ng)
        });
        self.surface_sample(instance, from, &surface, time, pdf)
    }

    #[inline]
    fn sample_rectangle(
        &self,
        rectangle: &RectangleLight,
        instance: u32,
        from: &Receiver,
        u: Vec2,
    ) -> Option<LightSample> {
        let emitted = self.table.emitted[instance as usize].as_ref()?;
        if !(emitted.two_sided || rectangle.faces(from.p)) {
            return None;
        }
        let point = rectangle.sample(from.p, u);
        let wi = (point.p - from.p).try_normalize()?.as_vec3();
        let end = ShadowEnd::Surface { p: point.p, p_error: rectangle.p_error, n: rectangle.n };
        let radiance = self.sent_by(emitted, &TexturePoint::on(Chart::SQUARE, point.uv));
        Some(LightSample { wi, radiance, pdf: point.pdf as f32, delta: false, end })
    }

    /// From outside, where the side of a sphere that is seen is its outside.
    #[inline]
    fn sample_sphere(
        &self,
        sphere: &SphereLight,
        cone: &ConeOfSphere,
        instance: u32,
        u: Vec2,
    ) -> Option<LightSample> {
        let emitted = self.table.emitted[instance as usize].as_ref()?;
        let (wi, normal) = sample_sphere(cone, u);
        let end = ShadowEnd::Surface {
            p: sphere.centre + normal * sphere.radius,
            p_error: sphere.p_error,
            n: normal.as_vec3(),
        };
        let radiance = self.sent_by(emitted, &TexturePoint::at(Vec2::ZERO));
        Some(LightSample { wi: wi.as_vec3(), radiance, pdf: cone.pdf() as f32, delta: false, end })
    }

    fn sample_mesh(
        &self,
        instance: u32,
        triangle: u32,
        from: &Receiver,
        time: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        let object = &self.geometry.instances[instance as usize];
        let Geometry::Mesh(mesh) = object.geometry else { return None };
        let (map, inverse) = object.motion.both_at(time);
        let corners = self.triangle(instance, triangle, time, &map);
        let weights = sample_triangle(from.p, corners, u);
        let local =
            self.geometry.meshes[mesh as usize].surface(triangle, weights, time, object.needs_uv);
        let surface = SurfacePoint::new(&local, &map, &inverse);
        let pdf = triangle_pdf(from.p, corners, surface.p);
        self.surface_sample(instance, from, &surface, time, pdf)
    }

    /// The sample for a point of an emitting surface drawn with `pdf` per unit solid angle.
    fn surface_sample(
        &self,
        instance: u32,
        from: &Receiver,
        surface: &SurfacePoint,
        time: f32,
        pdf: f64,
    ) -> Option<LightSample> {
        let wi = (surface.p - from.p).try_normalize()?.as_vec3();
        let radiance = self.sent(instance, surface, -wi, time);
        let end = ShadowEnd::Surface { p: surface.p, p_error: surface.p_error, n: surface.ng };
        Some(LightSample { wi, radiance, pdf: pdf as f32, delta: false, end })
    }

    fn sample_punctual(
        &self,
        index: u32,
        from: &Receiver,
        time: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        let light = &self.punctual[index as usize];
        let map = light.motion.at(time);
        let at_point = |intensity: Rgb| {
            let to = map.translation - from.p;
            let distance2 = to.length_squared();
            let wi = to.try_normalize()?.as_vec3();
            let radiance = self.materials.seen(intensity) / distance2 as f32;
            let end = ShadowEnd::Point(map.translation);
            Some(LightSample { wi, radiance, pdf: 1.0, delta: true, end })
        };
        match light.light {
            Light::Point { intensity, power } => {
                at_point(PunctualLight::point_intensity(intensity, power))
            }
            Light::Spot { intensity, angle, blend } => {
                let mut sample = at_point(intensity)?;
                let cos = -sample.wi.dot(axis_of(&map));
                sample.radiance *= spot_falloff(cos, angle, blend);
                Some(sample)
            }
            Light::Directional { irradiance, angle } => {
                let irradiance = self.materials.seen(irradiance);
                let axis = -axis_of(&map);
                let end = ShadowEnd::Infinity;
                Some(match DistantCone::new(angle) {
                    None => {
                        LightSample { wi: axis, radiance: irradiance, pdf: 1.0, delta: true, end }
                    }
                    Some(cone) => {
                        let local = uniform_cone(u, cone.one_minus_cos_max);
                        let wi = crate::math::Frame::from_z(axis).from_local(local);
                        let radiance = irradiance / cone.projected_solid_angle;
                        LightSample { wi, radiance, pdf: cone.pdf(), delta: false, end }
                    }
                })
            }
            Light::Sky { .. } => {
                let sky = self.table.skies[index as usize].as_ref()?;
                let (wi, pdf) = sky.sample(from.facing, u, &map)?;
                let radiance = sky.radiance(wi, &map, self.materials);
                Some(LightSample { wi, radiance, pdf, delta: false, end: ShadowEnd::Infinity })
            }
        }
    }
}

/// The direction in which a light shines: its local −z.
pub(super) fn axis_of(map: &DAffine3) -> Vec3 {
    -map.matrix3.z_axis.normalize().as_vec3()
}

/// A density per unit area as one per unit solid angle; 0 for a surface seen edge on.
fn area_to_solid_angle(pdf_area: f64, to: DVec3, n: Vec3) -> f64 {
    let distance2 = to.length_squared();
    let cos = (n.as_dvec3().dot(to) / distance2.sqrt()).abs();
    if cos > 0.0 { pdf_area * distance2 / cos } else { 0.0 }
}

/// The cone of directions from which a distant light with an extent shines.
pub(super) struct DistantCone {
    pub(super) one_minus_cos_max: f32,
    /// `π·sin²θ`: what turns the irradiance of a facing plane into radiance.
    pub(super) projected_solid_angle: f32,
}

impl DistantCone {
    /// For an angular diameter in degrees; `None` for 0.
    pub(super) fn new(angle_deg: f32) -> Option<Self> {
        let half = 0.5 * f64::from(angle_deg).to_radians();
        let sin2 = half.sin().powi(2);
        // The smaller of the two forms of 1 − cos θ which does not cancel
        let one_minus_cos = 2.0 * (0.5 * half).sin().powi(2);
        (angle_deg > 0.0).then_some(Self {
            one_minus_cos_max: one_minus_cos as f32,
            projected_solid_angle: (std::f64::consts::PI * sin2) as f32,
        })
    }

    pub(super) fn pdf(&self) -> f32 {
        1.0 / (TAU * self.one_minus_cos_max)
    }
}

/// Falloff of a spot light: 1 inside, 0 outside the half angle, a smooth cubic in the cosine over the
/// outer `blend` of the angle.
pub(super) fn spot_falloff(cos: f32, angle_deg: f32, blend: f32) -> f32 {
    let outer = angle_deg.to_radians().cos();
    let inner = (angle_deg * (1.0 - blend)).to_radians().cos();
    if cos >= inner {
        1.0
    } else if cos <= outer {
        0.0
    } else {
        let s = (cos - outer) / (inner - outer);
        s * s * (3.0 - 2.0 * s)
    }
}
