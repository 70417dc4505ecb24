//! The lights of a frame, with what their choice depends on.

use super::SkyLight;
use super::bounds::{Cone, LightBounds};
use super::choice::LightChoice;
use crate::build::bvh::{MeshTree, MeshTrees};
use crate::color::{Blackbody, luminance};
use crate::description::{EmissionStrength, Light, Rgb, Value};
use crate::extract::{
    Emissions, Geometry, Instance, Instances, NOTHING, PunctualLight, PunctualLights,
    SurfaceEmission, Surfaces,
};
use crate::math::Aabb;
use crate::shade::MaterialTable;
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
    /// The blackbody whose radiance that is, if it is one: its place among those of the table, and its luminance.
    pub blackbody: Option<(u32, f32)>,
    /// Multiplies the radiance.
    pub factor: f32,
    /// Whether the back emits as well.
    pub two_sided: bool,
    /// The material of the surface if it has holes: these emit nothing.
    pub mask: Option<u32>,
}

/// All lights of a frame.
#[derive(Resource, Clone, Debug, Default)]
pub struct LightTable {
    pub(super) emitters: Vec<Emitter>,
    /// The blackbodies that shine, each temperature once.
    pub(super) blackbodies: Vec<Blackbody>,
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
    /// Mean colour of each texture that an emission was asked for.
    averages: Vec<Option<Rgb>>,
    /// Mean opacity of each material that an emission was asked for.
    opacities: Vec<Option<f32>>,
    /// Whether lights at a place are to be chosen by power alone; read when the table is built. It is
    /// there to measure the tree against: `cargo bench --bench lights`.
    pub by_power: bool,
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

    /// Bytes held by what a light is chosen by, and by the list of lights.
    pub fn memory(&self) -> usize {
        self.choice.memory()
            + self.emitters.capacity() * size_of::<Emitter>()
            + self.emitted.capacity() * size_of::<Option<Emitted>>()
    }
}

/// Builds [`LightTable`] anew when something that shines changed, or the instances have other numbers.
///
/// What the textures alone decide, the maps over skies and the mean colours, is kept until a texture or
/// a material changes.
pub fn rebuild_light_table(
    instances: Res<Instances>,
    surfaces: Res<Surfaces>,
    emissions: Res<Emissions>,
    punctual: Res<PunctualLights>,
    meshes: Res<MeshTrees>,
    mut table: ResMut<LightTable>,
    mut scratch: Local<Scratch>,
) {
    let textures = surfaces.is_changed();
    if !(instances.emitters_rewritten
        || emissions.is_changed()
        || punctual.is_changed()
        || textures)
    {
        if table.built {
            table.bypass_change_detection().built = false;
        }
        return;
    }
    let skies = std::mem::take(&mut table.skies);
    let table = &mut *table;
    if textures {
        table.averages.clear();
        table.averages.resize(surfaces.materials.textures().len(), None);
        table.opacities.clear();
        table.opacities.resize(surfaces.materials.len(), None);
    }
    scratch.near.clear();
    scratch.far.clear();
    for list in [&mut table.first_of_instance, &mut table.of_punctual] {
        list.clear();
    }
    table.emitters.clear();
    table.emitted.clear();
    let mut builder = Builder { table, scratch: &mut scratch, materials: &surfaces.materials };
    for (index, instance) in (0..).zip(&instances.list) {
        let emission = emissions.list.get(instance.emission as usize);
        builder.add_instance(index, instance, emission, &meshes);
    }
    builder.add_punctual(&punctual.0, if textures { &[] } else { &skies });
    let choose = if table.by_power { LightChoice::by_power } else { LightChoice::new };
    table.choice = choose(&scratch.near, &scratch.far);
    table.near_flux.clear();
    table.near_flux.extend(scratch.near.iter().map(|light| light.flux));
    table.far_irradiance.clone_from(&scratch.far);
    table.built = true;
}

/// What the choice is built from; its memory is kept over frames.
#[derive(Debug, Default)]
pub struct Scratch {
    near: Vec<LightBounds>,
    far: Vec<f64>,
}

struct Builder<'a> {
    table: &'a mut LightTable,
    scratch: &'a mut Scratch,
    materials: &'a MaterialTable,
}

impl Builder<'_> {
    /// Adds a light which has a place; all of these come before those which have none.
    fn add_near(&mut self, emitter: Emitter, light: LightBounds) -> u32 {
        let near = &mut self.scratch.near;
        let index = near.len() as u32;
        self.table.emitters.push(emitter);
        // A flux beyond the range of f64 would make every other probability 0.
        let flux = if light.flux.is_finite() { light.flux } else { 0.0 };
        near.push(LightBounds { flux, ..light });
        index
    }

    /// The emission of a surface of this area: a total power is spread evenly over it, `L = Φ/(π·A)` for
    /// each side. Holes emit nothing of it.
    fn emitted(&mut self, emission: &SurfaceEmission, area: f64, material: u32) -> Emitted {
        let two_sided = emission.two_sided;
        let mut blackbody = None;
        let (radiance, factor) = match emission.strength {
            EmissionStrength::Radiance(radiance) => (radiance, 1.0),
            EmissionStrength::Power(watts) => {
                let sides = if two_sided { 2.0 } else { 1.0 };
                (Value::Constant(watts), 1.0 / (PI * area * sides))
            }
            EmissionStrength::Temperature { kelvin, radiance } => {
                let known = &mut self.table.blackbodies;
                let place = known.iter().position(|body| body.kelvin == kelvin);
                let place = place.unwrap_or_else(|| {
                    known.push(Blackbody::new(kelvin));
                    known.len() - 1
                });
                blackbody = Some((place as u32, radiance));
                (Value::Constant(known[place].color * radiance), 1.0)
            }
        };
        let factor = emission.factor * factor as f32;
        let masked = material != NOTHING && self.materials.has_opacity(material);
        let mask = masked.then_some(material);
        Emitted { radiance, blackbody, factor, two_sided, mask }
    }

    /// The mean of a colour over a surface.
    fn mean_color(&mut self, value: &Value<Rgb, u32>) -> Rgb {
        match value {
            Value::Constant(color) => *color,
            Value::Texture(index) => {
                let textures = self.materials.textures();
                let Some(known) = self.table.averages.get_mut(*index as usize) else {
                    return Rgb::ZERO;
                };
                *known.get_or_insert_with(|| textures.average(*index))
            }
        }
    }

    /// The mean opacity of a surface: 1 but where it has holes.
    fn mean_opacity(&mut self, mask: Option<u32>) -> f32 {
        let Some(material) = mask else { return 1.0 };
        let materials = self.materials;
        let Some(known) = self.table.opacities.get_mut(material as usize) else { return 1.0 };
        *known.get_or_insert_with(|| materials.mean_opacity(material))
    }

    fn add_instance(
        &mut self,
        index: u32,
        instance: &Instance,
        emission: Option<&SurfaceEmission>,
        meshes: &MeshTrees,
    ) {
        let Some(emission) = emission else {
            self.table.first_of_instance.push(NOTHING);
            self.table.emitted.push(None);
            return;
        };
        let map = instance.motion.at(0.0);
        let (triangles, rigid) = match instance.geometry {
            Geometry::Primitive(_) => (None, true),
            Geometry::Mesh(mesh) => {
                let tree = &meshes.list[mesh as usize];
                (Some(triangles(tree, &map)), !tree.deforms())
            }
        };
        let area = match (&triangles, &instance.geometry) {
            (None, Geometry::Primitive(primitive)) => primitive.world_area(&map),
            (triangles, _) => triangles.iter().flatten().map(|triangle| triangle.area).sum(),
        };
        let emitted = self.emitted(emission, area, instance.material);
        let mean =
            f64::from(luminance(self.mean_color(&emitted.radiance))) * f64::from(emitted.factor);
        let mean = mean * f64::from(self.mean_opacity(emitted.mask));
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
                let first = self.scratch.near.len() as u32;
                for (k, triangle) in (0..).zip(triangles) {
                    let flux = flux_per_area * triangle.area;
                    // What moves is somewhere in the bounds of the whole, facing anywhere.
                    let at_rest = rigid && instance.motion.is_static();
                    let light = if at_rest && triangle.area > 0.0 {
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

    /// Adds lights without a shape; the maps of skies are taken from `known` where they are there.
    fn add_punctual(&mut self, lights: &[PunctualLight], known: &[Option<SkyLight>]) {
        self.table.of_punctual.resize(lights.len(), NOTHING);
        self.table.skies.resize(lights.len(), None);
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
            let bounds = Aabb::from_points(light.motion.hull().map(DVec3::as_vec3));
            let light = LightBounds { bounds, flux, cone, two_sided: false };
            self.table.of_punctual[index as usize] = self.add_near(Emitter::Punctual(index), light);
        }
        for (index, light) in (0..).zip(lights) {
            let irradiance = match light.light {
                Light::Directional { irradiance, .. } => f64::from(luminance(irradiance)),
                Light::Sky { radiance, scale } => {
                    let sky = known
                        .iter()
                        .flatten()
                        .find_map(|sky| sky.rescaled(&radiance, scale))
                        .unwrap_or_else(|| SkyLight::new(radiance, scale, self.materials));
                    let irradiance = sky.mean_radiance() * 4.0 * PI;
                    self.table.skies[index as usize] = Some(sky);
                    irradiance
                }
                Light::Point { .. } | Light::Spot { .. } => continue,
            };
            self.table.of_punctual[index as usize] = self.table.emitters.len() as u32;
            self.table.emitters.push(Emitter::Punctual(index));
            self.scratch.far.push(if irradiance.is_finite() { irradiance } else { 0.0 });
        }
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
        let corners = tree.corners(triangle, 0.0);
        let [a, b, c] = corners.map(|corner| map.transform_point3(corner));
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
