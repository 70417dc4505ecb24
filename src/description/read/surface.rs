//! Textures, materials, meshes and lights: their numbers, and the names they use.

use super::Names;
use super::decode::{Report, decode};
use super::limits::{self, Limits};
use super::profile::read_revolution;
use super::source::Cursor;
use crate::description::diagnostic::suggestion;
use crate::description::{
    Emission, EmissionStrength, Light, Material, Rgb, Shape, Texture, TriangleMesh, Value, Wave,
};
use glam::{DVec2, Vec2, Vec3};
use indexmap::IndexMap;
use serde::Deserialize;

/// A mesh as a scene file says it.
#[derive(Debug, Deserialize)]
#[serde(rename = "mesh", deny_unknown_fields)]
pub(super) enum MeshFile {
    /// OBJ, glTF or GLB.
    File(String),
    /// Given in the scene.
    Triangles {
        positions: Vec<Vec3>,
        triangles: Vec<(u32, u32, u32)>,
        #[serde(default)]
        normals: Vec<Vec3>,
        #[serde(default)]
        uvs: Vec<Vec2>,
    },
    /// The moving surface of water.
    Waves {
        size: DVec2,
        cells: (u32, u32),
        waves: Vec<Wave>,
        #[serde(default)]
        steepness: f64,
        #[serde(default = "earth")]
        gravity: f64,
    },
}

/// The acceleration of a fall on earth, metres per second squared.
fn earth() -> f64 {
    9.81
}

/// Reports a name which is not defined.
pub(super) fn reference(
    report: &mut Report,
    cursor: &Cursor,
    name: &str,
    defined: &IndexMap<String, Cursor>,
    what: &str,
    plural: &str,
) {
    if !defined.contains_key(name) {
        let message = format!("there is no {what} named `{name}`");
        report.at("scene::unknown-name", cursor, message).help =
            suggestion(name, defined.keys().map(String::as_str), plural);
    }
}

/// Checks the parameters of surfaces against limits and names.
struct Parameters<'a, 'r> {
    cursor: &'a Cursor<'a>,
    names: &'a Names<'a>,
    report: &'r mut Report,
}

impl Parameters<'_, '_> {
    fn texture(&mut self, field: &Cursor, name: &str) {
        if self.names.complete {
            let defined = &self.names.textures;
            reference(self.report, field, name, defined, "texture", "textures");
        }
    }

    fn color(&mut self, field: &str, value: &Value<Rgb, String>, limits: &Limits) {
        let place = self.cursor.at(field);
        match value {
            Value::Constant(color) => {
                limits::color(self.report, &place, *color, limits);
            }
            Value::Texture(name) => self.texture(&place, name),
        }
    }

    fn scalar(&mut self, field: &str, value: &Value<f32, String>) {
        let place = self.cursor.at(field);
        match value {
            Value::Constant(share) => {
                limits::number(self.report, &place, *share, &limits::SHARE);
            }
            Value::Texture(name) => self.texture(&place, name),
        }
    }

    fn number(&mut self, field: &str, value: impl Into<f64>, limits: &Limits) {
        limits::number(self.report, &self.cursor.at(field), value, limits);
    }

    fn rgb(&mut self, field: &str, value: Rgb, limits: &Limits) {
        limits::color(self.report, &self.cursor.at(field), value, limits);
    }

    fn material(&mut self, field: &str, name: &str) {
        if self.names.complete {
            let place = self.cursor.at(field);
            let defined = &self.names.materials;
            reference(self.report, &place, name, defined, "material", "materials");
        }
    }
}

/// Reads a material and checks it.
pub(super) fn read_material(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Material<String>> {
    let material: Material<String> = decode(cursor, report)?;
    let mut check = Parameters { cursor, names, report };
    match &material {
        Material::Diffuse { albedo } => check.color("albedo", albedo, &limits::SHARE),
        Material::Mirror { reflectance } => {
            check.color("reflectance", reflectance, &limits::SHARE);
        }
        Material::Dielectric { ior, roughness, attenuation, priority: _ } => {
            check.number("ior", *ior, &limits::IOR);
            check.scalar("roughness", roughness);
            if let Some(attenuation) = attenuation {
                let cursor = &cursor.at("attenuation");
                let mut check = Parameters { cursor, names, report: check.report };
                check.rgb("color", attenuation.color, &limits::TRANSMITTANCE);
                check.number("distance", attenuation.distance, &limits::LENGTH);
            }
        }
        Material::ThinGlass { ior, tint } => {
            check.number("ior", *ior, &limits::IOR);
            check.color("tint", tint, &limits::SHARE);
        }
        Material::Conductor { metal, f0, eta, k, roughness } => {
            if let Some(f0) = f0 {
                check.color("f0", f0, &limits::SHARE);
            }
            for (field, index) in [("eta", eta), ("k", k)] {
                if let Some(index) = index {
                    check.rgb(field, *index, &limits::METAL_INDEX);
                }
            }
            check.scalar("roughness", roughness);
            let given = [metal.is_some(), f0.is_some(), eta.is_some() && k.is_some()];
            let halves = eta.is_some() != k.is_some();
            if halves || given.iter().filter(|&&is_given| is_given).count() != 1 {
                let message = "a `Conductor` needs exactly one of `metal`, `f0`, or `eta` and `k`";
                check.report.at("scene::conflict", cursor, message);
            }
        }
        Material::Plastic { albedo, ior, roughness } => {
            check.color("albedo", albedo, &limits::SHARE);
            check.number("ior", *ior, &limits::IOR);
            check.scalar("roughness", roughness);
        }
        Material::Principled { base_color, metallic, roughness, ior, transmission } => {
            check.color("base_color", base_color, &limits::SHARE);
            check.scalar("metallic", metallic);
            check.scalar("roughness", roughness);
            check.number("ior", *ior, &limits::IOR);
            check.scalar("transmission", transmission);
        }
        Material::Mix { a, b, amount } => {
            check.material("a", a);
            check.material("b", b);
            check.scalar("amount", amount);
        }
        Material::Masked { material, opacity } => {
            check.material("material", material);
            check.scalar("opacity", opacity);
        }
    }
    Some(material)
}

/// Reads a texture and checks its numbers; its file is only named.
pub(super) fn read_texture(cursor: &Cursor, report: &mut Report) -> Option<Texture<String>> {
    let texture: Texture<String> = decode(cursor, report)?;
    match &texture {
        Texture::Image { repeat, offset, .. } => {
            for (field, uv) in [("repeat", repeat), ("offset", offset)] {
                let uv = uv.to_array().map(f64::from);
                limits::vector(report, &cursor.at(field), &uv, &limits::UV);
            }
        }
        Texture::Checker { size, a, b } => {
            limits::number(report, &cursor.at("size"), *size, &limits::UV_LENGTH);
            limits::color(report, &cursor.at("a"), *a, &limits::STRENGTH);
            limits::color(report, &cursor.at("b"), *b, &limits::STRENGTH);
        }
    }
    Some(texture)
}

/// Checks a mesh given in the scene.
pub(super) fn check_triangles(
    cursor: &Cursor,
    positions: Vec<Vec3>,
    triangles: &[(u32, u32, u32)],
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let mut fine = true;
    let place = cursor.at("positions");
    for (index, position) in positions.iter().enumerate() {
        let p = position.to_array().map(f64::from);
        fine &= limits::vector(report, &place.nth(index), &p, &limits::COORDINATE);
    }
    let place = cursor.at("uvs");
    for (index, uv) in uvs.iter().enumerate() {
        let uv = uv.to_array().map(f64::from);
        fine &= limits::vector(report, &place.nth(index), &uv, &limits::UV);
    }
    let place = cursor.at("normals");
    let mut unit = Vec::with_capacity(normals.len());
    for (index, normal) in normals.iter().enumerate() {
        // In f64 neither a tiny nor a huge normal loses its direction.
        if let Some(normal) = normal.as_dvec3().try_normalize() {
            unit.push(normal.as_vec3());
        } else {
            let message = "a normal must be a direction other than zero";
            report.at("scene::out-of-range", &place.nth(index), message);
            fine = false;
        }
    }
    for (field, length) in [("normals", normals.len()), ("uvs", uvs.len())] {
        if length != 0 && length != positions.len() {
            let message =
                format!("`{field}` has {length} entries for {} positions", positions.len());
            report.at("scene::mesh", &cursor.at(field), message);
            fine = false;
        }
    }
    let place = cursor.at("triangles");
    if triangles.is_empty() {
        report.at("scene::mesh", &place, "a mesh needs at least one triangle");
        fine = false;
    }
    for (index, &(a, b, c)) in triangles.iter().enumerate() {
        let wrong = [a, b, c].into_iter().position(|v| v as usize >= positions.len());
        if let Some(corner) = wrong {
            let message = format!("there are only {} positions, counted from 0", positions.len());
            report.at("scene::mesh", &place.nth(index).nth(corner), message);
            fine = false;
        }
    }
    let triangles = triangles.iter().map(|&(a, b, c)| [a, b, c]).collect();
    fine.then_some(TriangleMesh { positions, normals: unit, uvs, triangles })
}

/// Reads a shape and checks it.
pub(super) fn read_shape(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Shape<String>> {
    if cursor.name() == "Revolution" {
        return read_revolution(cursor, names, report);
    }
    let shape: Shape<String> = decode(cursor, report)?;
    let length = &limits::LENGTH;
    match &shape {
        Shape::Sphere { radius } | Shape::Disk { radius } => {
            limits::number(report, &cursor.at("radius"), *radius, length);
        }
        Shape::Rectangle { size } => {
            limits::vector(report, &cursor.at("size"), &size.to_array(), length);
        }
        Shape::Plane {} | Shape::Revolution { .. } => {}
        Shape::Box { size } => {
            limits::vector(report, &cursor.at("size"), &size.to_array(), length);
        }
        Shape::Cylinder { radius, height, .. } | Shape::Cone { radius, height, .. } => {
            limits::number(report, &cursor.at("radius"), *radius, length);
            limits::number(report, &cursor.at("height"), *height, length);
        }
        Shape::Mesh(name) => {
            if names.complete {
                let place = cursor.nth(0);
                reference(report, &place, name, &names.meshes, "mesh", "meshes");
            }
        }
    }
    Some(shape)
}

/// Reads the strength of an emitting shape and checks it.
pub(super) fn read_emission(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Emission<String>> {
    let strength: EmissionStrength<String> = decode(cursor, report)?;
    let place = cursor.nth(0);
    match &strength {
        EmissionStrength::Power(power) => {
            limits::color(report, &place, *power, &limits::STRENGTH);
        }
        EmissionStrength::Radiance(Value::Constant(radiance)) => {
            limits::color(report, &place, *radiance, &limits::STRENGTH);
        }
        EmissionStrength::Radiance(Value::Texture(name)) => {
            Parameters { cursor, names, report }.texture(&place, name);
        }
    }
    Some(Emission { strength, two_sided: false })
}

/// Reads a light without a shape and checks it.
pub(super) fn read_light(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Light<String>> {
    let light: Light<String> = decode(cursor, report)?;
    let mut check = Parameters { cursor, names, report };
    match &light {
        Light::Point { intensity, power } => {
            for (field, strength) in [("intensity", intensity), ("power", power)] {
                if let Some(strength) = strength {
                    check.rgb(field, *strength, &limits::STRENGTH);
                }
            }
            if intensity.is_some() == power.is_some() {
                let message = "a `Point` needs exactly one of `intensity` and `power`";
                check.report.at("scene::conflict", cursor, message);
            }
        }
        Light::Spot { intensity, angle, blend } => {
            check.rgb("intensity", *intensity, &limits::STRENGTH);
            check.number("angle", *angle, &limits::CONE);
            check.number("blend", *blend, &limits::SHARE);
        }
        Light::Directional { irradiance, angle } => {
            check.rgb("irradiance", *irradiance, &limits::STRENGTH);
            check.number("angle", *angle, &limits::DIAMETER);
        }
        Light::Sky { radiance, scale } => {
            check.color("radiance", radiance, &limits::STRENGTH);
            check.number("scale", *scale, &limits::STRENGTH);
        }
    }
    Some(light)
}
