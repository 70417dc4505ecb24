//! Materials and meshes: their numbers, and the names they use.

use super::Names;
use super::decode::{Report, decode};
use super::limits::{self, Limits};
use super::profile::read_revolution;
use super::source::Cursor;
use crate::description::assets::MAX_MESH_ELEMENTS;
use crate::description::modelling::{Alignment, Subdivision, TessellationError, tessellated};
use crate::description::{
    Curve, Dispersion, Displacement, Material, PhaseFunction, Relief, Rgb, Shape, TriangleMesh,
    Value, Wave,
};
use crate::math::Chart;
use crate::memory::ask;
use glam::{DVec2, DVec3, Vec2, Vec3};
use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::IgnoredAny;

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
        #[serde(default)]
        colors: Vec<Rgb>,
    },
    /// A flat grid in the xy plane, facing +z.
    Grid { size: DVec2, cells: (u32, u32) },
    /// A finer one.
    Subdivided {
        of: String,
        levels: u32,
        #[serde(default)]
        form: Subdivision,
    },
    /// One that is moved by a texture.
    Displaced {
        of: String,
        #[serde(default)]
        height: Option<String>,
        #[serde(default)]
        offset: Option<String>,
        #[serde(default)]
        space: OffsetSpace,
        #[serde(default = "centimetre")]
        strength: f32,
        #[serde(default)]
        middle: f32,
        #[serde(default)]
        adaptive: bool,
    },
    /// A plane figure drawn out.
    Extrusion {
        outline: Vec<Curve>,
        depth: f64,
        tolerance: f64,
        #[serde(default = "crease")]
        smooth: f64,
    },
    /// Words drawn out.
    Text {
        text: String,
        font: String,
        size: f64,
        depth: f64,
        tolerance: f64,
        #[serde(default = "crease")]
        smooth: f64,
        #[serde(default)]
        align: Alignment,
    },
    /// Bicubic Bézier patches.
    Patches {
        points: Vec<DVec3>,
        #[serde(default)]
        weights: Vec<f64>,
        patches: Vec<Vec<u32>>,
        tolerance: f64,
    },
    /// A bicubic B-spline surface, with weights NURBS.
    Spline {
        rows: Vec<Vec<DVec3>>,
        #[serde(default)]
        weights: Vec<Vec<f64>>,
        #[serde(default)]
        knots_u: Vec<f64>,
        #[serde(default)]
        knots_v: Vec<f64>,
        #[serde(default)]
        closed: (bool, bool),
        tolerance: f64,
    },
    /// An analytic shape, which is read by itself.
    Tessellated {
        #[serde(rename = "shape")]
        _shape: IgnoredAny,
        tolerance: f64,
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

/// Along what the coordinates of an offset are.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub(super) enum OffsetSpace {
    /// u, v and the normal.
    #[default]
    Tangent,
    /// x, y and z of the mesh.
    Object,
}

/// From which angle walls meet in an edge, degrees.
fn crease() -> f64 {
    30.0
}

/// The usual strength of a displacement, metres.
fn centimetre() -> f32 {
    0.01
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
            report.hints.suggestion(name, defined.keys().map(String::as_str), plural);
    }
}

/// Checks the parameters of surfaces against limits and names.
pub(super) struct Parameters<'a, 'r> {
    pub(super) cursor: &'a Cursor<'a>,
    pub(super) names: &'a Names<'a>,
    pub(super) report: &'r mut Report,
}

impl Parameters<'_, '_> {
    pub(super) fn texture(&mut self, field: &Cursor, name: &str) {
        if self.names.complete {
            let defined = &self.names.textures;
            reference(self.report, field, name, defined, "texture", "textures");
        }
    }

    pub(super) fn color(&mut self, field: &str, value: &Value<Rgb, String>, limits: &Limits) {
        let place = self.cursor.at(field);
        match value {
            Value::Constant(color) => {
                limits::color(self.report, &place, *color, limits);
            }
            Value::Texture(name) => self.texture(&place, name),
        }
    }

    pub(super) fn scalar(&mut self, field: &str, value: &Value<f32, String>) {
        let place = self.cursor.at(field);
        match value {
            Value::Constant(share) => {
                limits::number(self.report, &place, *share, &limits::SHARE);
            }
            Value::Texture(name) => self.texture(&place, name),
        }
    }

    pub(super) fn number(&mut self, field: &str, value: impl Into<f64>, limits: &Limits) {
        limits::number(self.report, &self.cursor.at(field), value, limits);
    }

    pub(super) fn colors<const N: usize>(&mut self, values: [(&str, &Value<Rgb, String>); N]) {
        for (field, value) in values {
            self.color(field, value, &limits::STRENGTH);
        }
    }

    pub(super) fn uv(&mut self, field: &str, value: Vec2) {
        let uv = value.to_array().map(f64::from);
        limits::vector(self.report, &self.cursor.at(field), &uv, &limits::UV);
    }

    pub(super) fn place(&mut self, field: &str, value: Vec3) {
        let value = value.to_array().map(f64::from);
        limits::vector(self.report, &self.cursor.at(field), &value, &limits::COORDINATE);
    }

    pub(super) fn rgb(&mut self, field: &str, value: Rgb, limits: &Limits) {
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
        Material::Dielectric { ior, dispersion, roughness, tint, .. } => {
            let fine = limits::number(check.report, &cursor.at("ior"), *ior, &limits::IOR);
            if let Some(dispersion) = dispersion.as_ref().filter(|_| fine) {
                check_dispersion(cursor, *ior, dispersion, check.report);
            }
            check.scalar("roughness", roughness);
            check.color("tint", tint, &limits::SHARE);
            check_inside(&mut check, &material);
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
        Material::Bump { material, height, strength } => {
            check.material("material", material);
            check.texture(&cursor.at("height"), height);
            check.number("strength", *strength, &limits::COORDINATE);
        }
        Material::NormalMap { material, map, strength, green: _ } => {
            check.material("material", material);
            check.texture(&cursor.at("map"), map);
            check.number("strength", *strength, &limits::STRENGTH);
        }
    }
    Some(material)
}

/// Checks what is inside a solid.
fn check_inside(check: &mut Parameters, material: &Material<String>) {
    let Material::Dielectric { attenuation, absorption, scattering, emission, density, .. } =
        material
    else {
        return;
    };
    let (cursor, names) = (check.cursor, check.names);
    if let Some(attenuation) = attenuation {
        let cursor = &cursor.at("attenuation");
        let mut check = Parameters { cursor, names, report: check.report };
        check.rgb("color", attenuation.color, &limits::TRANSMITTANCE);
        check.number("distance", attenuation.distance, &limits::LENGTH);
    }
    if let Some(name) = absorption {
        check.texture(&cursor.at("absorption"), name);
        if let Some(given) = cursor.field("attenuation").filter(|_| attenuation.is_some()) {
            let message = "a solid absorbs by `attenuation` or by `absorption`, not both";
            check.report.at("scene::conflict", &given, message);
        }
    }
    if let Some(scattering) = scattering {
        let cursor = &cursor.at("scattering");
        let mut check = Parameters { cursor, names, report: check.report };
        check.rgb("coefficient", scattering.coefficient, &limits::COEFFICIENT);
        if let PhaseFunction::HenyeyGreenstein(g) = scattering.phase {
            check.number("phase", g, &limits::MEAN_COSINE);
        }
    }
    check.rgb("emission", *emission, &limits::STRENGTH);
    let place = cursor.at("density");
    match density {
        Value::Constant(density) => {
            limits::number(check.report, &place, *density, &limits::STRENGTH);
        }
        Value::Texture(name) => check.texture(&place, name),
    }
}

fn check_dispersion(cursor: &Cursor, ior: f32, dispersion: &Dispersion, report: &mut Report) {
    let place = cursor.at("dispersion");
    if let Dispersion::Abbe(number) = dispersion
        && !limits::number(report, &place.nth(0), *number, &limits::ABBE)
    {
        return;
    }
    if let Err(error) = dispersion.check(ior) {
        report.at("scene::out-of-range", &place, error.to_string());
    } else if let Some(given) = cursor.field("ior").filter(|_| !dispersion.needs_ior()) {
        let message = "this dispersion says the index of refraction itself";
        report.at("scene::conflict", &given, message).help = Some("leave out `ior`".to_owned());
    }
}

/// Checks a mesh given in the scene.
pub(super) fn check_triangles(
    cursor: &Cursor,
    positions: Vec<Vec3>,
    triangles: &[(u32, u32, u32)],
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<Rgb>,
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
    let place = cursor.at("colors");
    for (index, color) in colors.iter().enumerate() {
        fine &= limits::color(report, &place.nth(index), *color, &limits::STRENGTH);
    }
    let lists = [("normals", normals.len()), ("uvs", uvs.len()), ("colors", colors.len())];
    for (field, length) in lists {
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
    let tangents = Vec::new();
    let chart = Chart::ENDLESS;
    let mesh = TriangleMesh { positions, normals: unit, uvs, chart, tangents, colors, triangles };
    fine.then_some(mesh)
}

/// Checks a grid; `None` when something in it is wrong.
pub(super) fn check_grid(
    cursor: &Cursor,
    size: DVec2,
    (columns, rows): (u32, u32),
    report: &mut Report,
) -> Option<()> {
    let mut fine = limits::vector(report, &cursor.at("size"), &size.to_array(), &limits::LENGTH);
    let place = cursor.at("cells");
    let cells = [columns, rows].map(f64::from);
    fine &= limits::vector(report, &place, &cells, &limits::CELLS);
    if fine {
        fine = check_triangle_count(&place, 2.0 * cells[0] * cells[1], report);
    }
    fine.then_some(())
}

/// The mesh of an analytic shape.
pub(super) fn tessellation(
    cursor: &Cursor,
    tolerance: f64,
    names: &Names,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let place = cursor.field("shape")?;
    let shape = read_shape(&place, names, report)?;
    if !limits::number(report, &cursor.at("tolerance"), tolerance, &limits::LENGTH) {
        return None;
    }
    match tessellated(&shape, tolerance, MAX_MESH_ELEMENTS as f64) {
        Ok(mesh) => Some(mesh),
        Err(TessellationError::TooFine(triangles)) => {
            check_triangle_count(&cursor.at("tolerance"), triangles.ceil(), report);
            None
        }
        Err(error @ TessellationError::NoSuchShape) => {
            report.at("scene::mesh", &place, error.to_string());
            None
        }
    }
}

/// Checks how finely a mesh is divided.
pub(super) fn check_levels(
    cursor: &Cursor,
    mesh: &TriangleMesh,
    levels: u32,
    report: &mut Report,
) -> Option<()> {
    let place = cursor.at("levels");
    let count = mesh.triangles.len() as f64 * 4_f64.powi(levels.min(64) as i32);
    check_triangle_count(&place, count, report).then_some(())
}

/// Whether a mesh of so many triangles may be made: by the limit of all meshes, and by the memory that there is.
pub(super) fn check_triangle_count(place: &Cursor, count: f64, report: &mut Report) -> bool {
    /// Three indices, and half a vertex with place, normal and coordinates; the lists double while they grow, and a
    /// subdivision looks for the neighbours of every edge.
    const BYTES: f64 = 64.0;
    let fine = count <= MAX_MESH_ELEMENTS as f64;
    if fine && let Err(shortage) = ask((count * BYTES) as u64) {
        let message = format!("there is no memory for a mesh of {count} triangles: {shortage}");
        report.at("scene::memory", place, message);
        return false;
    }
    if !fine {
        let message = format!(
            "a mesh has at most {MAX_MESH_ELEMENTS} triangles, but this would have {count}"
        );
        report.at("scene::out-of-range", place, message);
    }
    fine
}

/// What a displacement says, and by which texture.
pub(super) fn relief(
    cursor: &Cursor,
    height: Option<String>,
    offset: Option<String>,
    space: OffsetSpace,
    report: &mut Report,
) -> Option<(Relief, String)> {
    match (height, offset, space) {
        (Some(texture), None, _) => Some((Relief::Height, texture)),
        (None, Some(texture), OffsetSpace::Tangent) => Some((Relief::Tangent, texture)),
        (None, Some(texture), OffsetSpace::Object) => Some((Relief::Object, texture)),
        (None, None, _) => {
            let message = "nothing displaces this: give it a `height` or an `offset`, a texture";
            report.at("scene::missing", cursor, message);
            None
        }
        (Some(_), Some(_), _) => {
            let message = "`height` and `offset` exclude each other: displace by one of them";
            report.at("scene::conflict", &cursor.at("offset"), message);
            None
        }
    }
}

/// Checks a displacement.
pub(super) fn check_displacement(
    cursor: &Cursor,
    displacement: &Displacement<String>,
    names: &Names,
    report: &mut Report,
) {
    let mut check = Parameters { cursor, names, report };
    let field = if displacement.says == Relief::Height { "height" } else { "offset" };
    check.texture(&cursor.at(field), &displacement.texture);
    check.number("strength", displacement.strength, &limits::COORDINATE);
    check.number("middle", displacement.middle, &limits::COORDINATE);
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
