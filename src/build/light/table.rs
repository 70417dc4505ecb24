//! The lights of a frame, and the probability with which each is chosen: in proportion to its
//! power.

use super::SkyLight;
use crate::build::bvh::MeshTrees;
use crate::color::luminance;
use crate::description::{EmissionStrength, Light, Rgb, Value};
use crate::extract::{
    Geometry, Instance, Instances, NOTHING, PunctualLight, PunctualLights, SurfaceEmission,
    Surfaces,
};
use crate::sampling::Piecewise1D;
use crate::shade::{MaterialTable, texture};
use crate::shape::{AreaFactor, triangle_area};
use bevy_ecs::prelude::*;
use glam::Vec3;
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
    /// Probability of each emitter; `None` when there is none to choose.
    pub(super) choice: Option<Piecewise1D>,
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

    /// The probability with which an emitter is chosen.
    pub(super) fn probability(&self, emitter: u32) -> f32 {
        self.choice.as_ref().map_or(0.0, |choice| choice.probability(emitter as usize) as f32)
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
    let mut builder =
        Builder { table: LightTable::default(), weights: Vec::new(), distant: Vec::new() };
    for (index, instance) in (0..).zip(&instances.list) {
        builder.add_instance(index, instance, &surfaces, &meshes);
    }
    for (index, light) in (0..).zip(&punctual.0) {
        builder.add_punctual(index, light, &surfaces.materials);
    }
    *table = builder.finish();
}

struct Builder {
    table: LightTable,
    /// Flux of each emitter; of distant ones what they send through one square metre.
    weights: Vec<f64>,
    /// Emitters infinitely far away.
    distant: Vec<u32>,
}

impl Builder {
    fn add(&mut self, emitter: Emitter, weight: f64) -> u32 {
        let index = self.weights.len() as u32;
        self.table.emitters.push(emitter);
        // A weight beyond the range of f64 would make every other probability 0.
        self.weights.push(if weight.is_finite() { weight } else { 0.0 });
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
        let triangle_areas: Option<Vec<f64>> = match instance.geometry {
            Geometry::Primitive(_) => None,
            Geometry::Mesh(mesh) => {
                let tree = &meshes.list[mesh as usize];
                let factor = AreaFactor::new(&map.matrix3);
                let area = |triangle: u32| {
                    let [a, b, c] = tree.corners(triangle).map(Vec3::as_dvec3);
                    let normal = (b - a).cross(c - a);
                    if normal.length_squared() > 0.0 {
                        triangle_area([a, b, c]) * factor.at(normal)
                    } else {
                        0.0
                    }
                };
                Some((0..tree.mesh.triangles.len() as u32).map(area).collect())
            }
        };
        let area = match (&triangle_areas, instance.geometry) {
            (None, Geometry::Primitive(primitive)) => primitive.world_area(&map),
            (areas, _) => areas.iter().flatten().sum(),
        };
        let emitted = emitted(emission, area);
        let mean = f64::from(luminance(mean_color(&emitted.radiance, &surfaces.materials)))
            * f64::from(emitted.factor);
        let sides = if emitted.two_sided { 2.0 } else { 1.0 };
        let flux_per_area = mean * PI * sides;
        self.table.emitted.push(Some(emitted));
        let first = match triangle_areas {
            // An infinite plane cannot be drawn from; it is found by chance alone.
            None if area.is_infinite() => NOTHING,
            None => self.add(Emitter::Shape(index), flux_per_area * area),
            Some(areas) => {
                let first = self.weights.len() as u32;
                for (triangle, area) in (0..).zip(areas) {
                    self.add(Emitter::Triangle { instance: index, triangle }, flux_per_area * area);
                }
                first
            }
        };
        self.table.first_of_instance.push(first);
    }

    fn add_punctual(&mut self, index: u32, light: &PunctualLight, materials: &MaterialTable) {
        let mut sky = None;
        let mut is_distant = false;
        let weight = match light.light {
            Light::Point { intensity, power } => {
                f64::from(luminance(PunctualLight::point_intensity(intensity, power))) * 4.0 * PI
            }
            Light::Spot { intensity, angle, .. } => {
                f64::from(luminance(intensity)) * TAU * (1.0 - f64::from(angle).to_radians().cos())
            }
            Light::Directional { irradiance, .. } => {
                is_distant = true;
                f64::from(luminance(irradiance))
            }
            Light::Sky { radiance, scale } => {
                let light = SkyLight::new(radiance, scale, materials);
                let per_area = light.mean_radiance() * 4.0 * PI;
                (sky, is_distant) = (Some(light), true);
                per_area
            }
        };
        let emitter = self.add(Emitter::Punctual(index), weight);
        if is_distant {
            self.distant.push(emitter);
        }
        self.table.of_punctual.push(emitter);
        self.table.skies.push(sky);
    }

    /// What is infinitely far away has no flux that could be compared with that of lamps: how much of it
    /// enters the scene grows with the scene, and one huge object would starve all lamps. Both kinds
    /// share the choices evenly, and within each kind the choice follows the power.
    fn finish(mut self) -> LightTable {
        let (mut near, mut far) = (0.0, 0.0);
        for (k, weight) in (0..).zip(&self.weights) {
            let sum = if self.distant.contains(&k) { &mut far } else { &mut near };
            *sum += weight;
        }
        let balance: f64 = near / far;
        if balance.is_normal() && balance > 0.0 {
            for &k in &self.distant {
                self.weights[k as usize] *= balance;
            }
        }
        let choice = (!self.weights.is_empty()).then(|| Piecewise1D::new(self.weights));
        LightTable { choice, built: true, ..self.table }
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
