//! The lights of a frame, with what their choice depends on.

use super::SkyLight;
use super::choice::LightChoice;
use super::tree::{Cone, LightBounds};
use crate::build::bvh::{MeshTree, MeshTrees};
use crate::color::luminance;
use crate::description::{EmissionStrength, Light, Rgb, Value};
use crate::extract::{
    Geometry, Instance, Instances, NOTHING, PunctualLight, PunctualLights, SurfaceEmission,
    Surfaces,
};
use crate::math::Aabb;
use crate::shade::{MaterialTable, texture};
use crate::shape::{Primitive, triangle_area};
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec3};
use std::f64::consts::{PI, TAU};

/// Something that can be chosen as the light of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Emitter {
    /// An analytic shape which emits, by instance.
    Shape(u32),
    /// A triangle of an emitting mesh.
    Triangle {
        /// The instance.
        instance: u32,
        /// The triangle of its mesh.
        triangle: u32,
    },
    /// A light without a shape, by its index.
    Punctual(u32),
}

/// What the surface of an instance emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitted {
    /// Radiance before the factor.
    pub radiance: Value<Rgb, u32>,
    /// Multiplies the radiance.
    pub factor: f32,
    /// Whether the back emits as well.
    pub two_sided: bool,
}

/// All lights of a frame.
#[derive(Resource, Clone, Debug, Default)]
pub struct LightTable {
    pub(super) emitters: Vec<Emitter>,
    /// How one of them is chosen.
    pub(super) choice: LightChoice,
    /// Flux of each emitter which has a place, luminance, W.
    pub(super) near_flux: Vec<f64>,
    /// For each emitter infinitely far away the irradiance of a plane which faces it, or of a sky
    /// from all around, luminance, W·m⁻².
    pub(super) far_irradiance: Vec<f64>,
    /// First emitter of each instance, or [`NOTHING`].
    pub(super) first_of_instance: Vec<u32>,
    /// Emitter of each light without a shape.
    pub(super) of_punctual: Vec<u32>,
    /// What each instance emits.
    pub emitted: Vec<Option<Emitted>>,
    /// For each light without a shape, its sky if it is one.
    pub(super) skies: Vec<Option<SkyLight>>,
    /// Whether the table was built anew in this frame.
    pub built: bool,
}

impl LightTable {
    /// Number of emitters.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }
}

/// Builds [`LightTable`] anew when objects, surfaces or lights changed.
pub fn rebuild_light_table(
    instances: Res<Instances>,
    surfaces: Res<Surfaces>,
    punctual: Res<PunctualLights>,
    meshes: Res<MeshTrees>,
    mut table: ResMut<LightTable>,
) {
    let emitters_may_have_moved = instances.is_changed();
    if !(emitters_may_have_moved || surfaces.is_changed() || punctual.is_changed()) {
        if table.built {
            table.bypass_change_detection().built = false;
        }
        return;
    }
    let mut builder = Builder::default();
    for (index, instance) in (0..).zip(&instances.list) {
        builder.add_instance(index, instance, &surfaces, &meshes);
    }
    builder.add_punctual(&punctual.0, &surfaces.materials);
    *table = builder.finish();
}

#[derive(Default)]
struct Builder {
    table: LightTable,
    near: Vec<LightBounds>,
    far: Vec<f64>,
}

impl Builder {
    /// Adds a light which has a place; all of these come before those which have none.
    fn add_near(&mut self, emitter: Emitter, light: LightBounds) -> u32 {
        let index = self.near.len() as u32;
        self.table.emitters.push(emitter);
        // A flux beyond the range of f64 would make every other probability 0.
        let flux = if light.flux.is_finite() { light.flux } else { 0.0 };
        self.near.push(LightBounds { flux, ..light });
        index
    }

    fn add_instance(
        &mut self,
        index: u32,
        instance: &Instance,
        surfaces: &Surfaces,
        meshes: &MeshTrees,
    ) {
        let emission = surfaces.emissions.get(instance.emission as usize);
        let Some(emission) = emission else {
            self.table.first_of_instance.push(NOTHING);
            self.table.emitted.push(None);
            return;
        };
        let map = instance.motion.at(0.0);
        let triangles = match instance.geometry {
            Geometry::Primitive(_) => None,
            Geometry::Mesh(mesh) => Some(triangles(&meshes.list[mesh as usize], &map)),
        };
        let area = match (&triangles, instance.geometry) {
            (None, Geometry::Primitive(primitive)) => primitive.world_area(&map),
            (triangles, _) => triangles.iter().flatten().map(|triangle| triangle.area).sum(),
        };
        let emitted = emitted(emission, area);
        let mean = f64::from(luminance(mean_color(&emitted.radiance, &surfaces.materials)))
            * f64::from(emitted.factor);
        let two_sided = emitted.two_sided;
        let flux_per_area = mean * PI * if two_sided { 2.0 } else { 1.0 };
        self.table.emitted.push(Some(emitted));
        let whole = LightBounds {
            bounds: instance.bounds,
            flux: flux_per_area * area,
            cone: facing(instance, &map),
            two_sided,
        };
        let first = match triangles {
            // An infinite plane cannot be drawn from; it is found by chance alone.
            None if area.is_infinite() => NOTHING,
            None => self.add_near(Emitter::Shape(index), whole),
            Some(triangles) => {
                let first = self.near.len() as u32;
                for (k, triangle) in (0..).zip(triangles) {
                    let flux = flux_per_area * triangle.area;
                    // What moves is somewhere in the bounds of the whole, facing anywhere.
                    let light = if instance.motion.is_static() && triangle.area > 0.0 {
                        let cone = Cone::facing(triangle.normal);
                        LightBounds { bounds: triangle.bounds, flux, cone, two_sided }
                    } else {
                        LightBounds { flux, cone: Cone::everywhere(), ..whole }
                    };
                    self.add_near(Emitter::Triangle { instance: index, triangle: k }, light);
                }
                first
            }
        };
        self.table.first_of_instance.push(first);
    }

    fn add_punctual(&mut self, lights: &[PunctualLight], materials: &MaterialTable) {
        self.table.of_punctual = vec![NOTHING; lights.len()];
        self.table.skies = vec![None; lights.len()];
        for (index, light) in (0..).zip(lights) {
            let (flux, cone) = match light.light {
                Light::Point { intensity, power } => {
                    let intensity = luminance(PunctualLight::point_intensity(intensity, power));
                    (f64::from(intensity) * 4.0 * PI, Cone::everywhere())
                }
                Light::Spot { intensity, angle, .. } => {
                    let angle = f64::from(angle).to_radians();
                    let axis = -light.motion.at(0.0).matrix3.z_axis.normalize();
                    let cone = if light.motion.is_static() {
                        Cone { axis, theta_o: angle, theta_e: 0.0 }
                    } else {
                        Cone::everywhere()
                    };
                    (f64::from(luminance(intensity)) * TAU * (1.0 - angle.cos()), cone)
                }
                Light::Directional { .. } | Light::Sky { .. } => continue,
            };
            let keys = light.motion.keys_translations();
            let bounds = Aabb::from_points(keys.map(DVec3::as_vec3));
            let light = LightBounds { bounds, flux, cone, two_sided: false };
            self.table.of_punctual[index as usize] = self.add_near(Emitter::Punctual(index), light);
        }
        for (index, light) in (0..).zip(lights) {
            let irradiance = match light.light {
                Light::Directional { irradiance, .. } => f64::from(luminance(irradiance)),
                Light::Sky { radiance, scale } => {
                    let sky = SkyLight::new(radiance, scale, materials);
                    let irradiance = sky.mean_radiance() * 4.0 * PI;
                    self.table.skies[index as usize] = Some(sky);
                    irradiance
                }
                Light::Point { .. } | Light::Spot { .. } => continue,
            };
            self.table.of_punctual[index as usize] = self.table.emitters.len() as u32;
            self.table.emitters.push(Emitter::Punctual(index));
            self.far.push(if irradiance.is_finite() { irradiance } else { 0.0 });
        }
    }

    fn finish(self) -> LightTable {
        let choice = LightChoice::new(&self.near, &self.far);
        let near_flux = self.near.iter().map(|light| light.flux).collect();
        LightTable { choice, near_flux, far_irradiance: self.far, built: true, ..self.table }
    }
}

/// A triangle of an emitting mesh in render space.
struct Triangle {
    area: f64,
    normal: DVec3,
    bounds: Aabb,
}

fn triangles(tree: &MeshTree, map: &DAffine3) -> Vec<Triangle> {
    let count = tree.mesh.triangles.len() as u32;
    let triangle = |triangle: u32| {
        let corners = tree.corners(triangle);
        let [a, b, c] = corners.map(|corner| map.transform_point3(corner.as_dvec3()));
        // The side that is outside stays outside under a mirroring map.
        let normal = (b - a).cross(c - a) * map.matrix3.determinant().signum();
        Triangle {
            area: triangle_area([a, b, c]),
            normal: normal.normalize_or(DVec3::Z),
            bounds: Aabb::from_points([a, b, c].map(DVec3::as_vec3)),
        }
    };
    (0..count).map(triangle).collect()
}

/// Where the surface of an analytic shape faces.
fn facing(instance: &Instance, map: &DAffine3) -> Cone {
    match instance.geometry {
        Geometry::Primitive(Primitive::Rectangle | Primitive::Disk)
            if instance.motion.is_static() =>
        {
            let normal = map.matrix3.inverse().transpose() * DVec3::Z;
            Cone::facing(normal.normalize())
        }
        _ => Cone::everywhere(),
    }
}

/// The emission of a surface of this area: a total power is spread evenly over it, `L = Φ/(π·A)` for
/// each side.
fn emitted(emission: &SurfaceEmission, area: f64) -> Emitted {
    let two_sided = emission.two_sided;
    let (radiance, factor) = match emission.strength {
        EmissionStrength::Radiance(radiance) => (radiance, 1.0),
        EmissionStrength::Power(watts) => {
            let sides = if two_sided { 2.0 } else { 1.0 };
            (Value::Constant(watts), 1.0 / (PI * area * sides))
        }
    };
    Emitted { radiance, factor: emission.factor * factor as f32, two_sided }
}

fn mean_color(value: &Value<Rgb, u32>, materials: &MaterialTable) -> Rgb {
    match value {
        Value::Constant(color) => *color,
        Value::Texture(index) => {
            materials.textures().get(*index as usize).map_or(Rgb::ZERO, texture::average)
        }
    }
}
