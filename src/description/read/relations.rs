//! What only shows when all definitions are known: cycles, the camera, colours of textures.

use super::decode::Report;
use super::outline::Kind;
use super::source::Cursor;
use super::surface::reference;
use super::{LoadOptions, Names};
use crate::description::diagnostic::{Diagnostic, Diagnostics, Severity};
use crate::description::{
    EmissionStrength, Encoding, ImagePixels, Light, Material, Rgb, SceneDescription, SceneTexture,
    Shape, Texture, Value,
};
use crate::math::{GraphFault, MAX_PARTS_DEPTH, Profile, parts_first};
use indexmap::IndexMap;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The parts of things by name: the field that names each, and its name.
type Parts<'a> = IndexMap<&'a str, Vec<(&'a str, &'a str)>>;

/// Reports entities which are their own ancestors, and materials and textures made of themselves or of too many.
pub(super) fn check_cycles(scene: &SceneDescription, names: &Names, report: &mut Report) {
    let parents: Parts = scene
        .entities
        .iter()
        .map(|(name, entity)| {
            (
                name.as_str(),
                entity.parent.iter().map(|parent| ("parent", parent.as_str())).collect(),
            )
        })
        .collect();
    for (name, field, path) in cycles(&parents) {
        let message = format!("`{name}` is its own ancestor: {path}");
        report.at("scene::cycle", &names.entities[name].at(field), message);
    }
    let parts: Parts = scene
        .materials
        .iter()
        .map(|(name, material)| {
            let parts = match material {
                Material::Mix { a, b, .. } => vec![("a", a.as_str()), ("b", b.as_str())],
                Material::Masked { material, .. }
                | Material::Bump { material, .. }
                | Material::NormalMap { material, .. } => vec![("material", material.as_str())],
                _ => Vec::new(),
            };
            (name.as_str(), parts)
        })
        .collect();
    check_parts(&parts, "material", &names.materials, report);
    let parts = texture_parts(scene);
    check_parts(&parts, "texture", &names.textures, report);
    check_lookups(scene, &parts, names, report);
}

fn texture_parts(scene: &SceneDescription) -> Parts<'_> {
    let textures = scene.textures.iter();
    let parts = textures.map(|(name, texture)| {
        let parts = texture.refs().map(|(field, part)| (field, part.as_str()));
        (name.as_str(), parts.collect())
    });
    parts.collect()
}

/// Reports meshes which are made of themselves or of too many, by what their text says of `of`. Whether there is none.
pub(super) fn check_mesh_parts(names: &Names, report: &mut Report) -> bool {
    let of: HashMap<&str, String> = names
        .meshes
        .iter()
        .filter_map(|(name, mesh)| {
            let part = mesh.field("of")?;
            Some((name.as_str(), super::outline::unquoted(part.text())))
        })
        .collect();
    let parts: Parts = names
        .meshes
        .keys()
        .map(|name| (name.as_str(), of.get(name.as_str()).map(|part| ("of", part.as_str()))))
        .map(|(name, part)| (name, part.into_iter().collect()))
        .collect();
    check_parts(&parts, "mesh", &names.meshes, report)
}

/// Reports things which are made of themselves, or of too many in a row. Whether there is none.
fn check_parts(
    parts: &Parts,
    what: &str,
    defined: &IndexMap<String, Cursor>,
    report: &mut Report,
) -> bool {
    let cycles = cycles(parts);
    for (name, field, path) in &cycles {
        let message = format!("the {what} `{name}` is made of itself: {path}");
        report.at("scene::cycle", &defined[*name].at(field), message);
    }
    let Err(GraphFault::TooDeep(node)) = order(parts) else { return cycles.is_empty() };
    let (name, below) = parts.get_index(node as usize).expect("it is one of them");
    let field = below.first().map_or("", |(field, _)| field);
    let message =
        format!("the {what} `{name}` is made of more than {MAX_PARTS_DEPTH} others in a row");
    report.at("scene::too-deep", &defined[*name].at(field), message).help =
        Some("say it in fewer steps, each made of the one before".to_owned());
    false
}

/// The places of things in an order in which each comes after its parts; names of nothing are left out.
fn order(parts: &Parts) -> Result<Vec<u32>, GraphFault> {
    parts_first(parts.len() as u32, |index| {
        let (_, below) = parts.get_index(index as usize).expect("it is one of them");
        below.iter().filter_map(|(_, part)| parts.get_index_of(part)).map(|k| k as u32).collect()
    })
}

/// So many lookups of others may a texture take at one point.
const MAX_LOOKUPS: u64 = 1 << 16;

/// Reports textures which take too many lookups of others at one point.
///
/// Each counts once there, however many ways lead to it. But `Placed`, `Triplanar` and `Drift` look elsewhere, so that two
/// of them made of the same, and that of two again, double the work with every level.
fn check_lookups(scene: &SceneDescription, parts: &Parts, names: &Names, report: &mut Report) {
    let Ok(order) = order(parts) else { return };
    let elsewhere = |name: &str| match scene.textures[name] {
        Texture::Triplanar { .. } => 3,
        Texture::Placed { .. } | Texture::Drift { .. } => 1,
        _ => 0,
    };
    let below =
        |index: usize| parts[index].iter().filter_map(|(_, part)| parts.get_index_of(*part));
    // At most so many; found exactly, by walking, only where the sum over all ways would be too many.
    let mut lookups = vec![1_u64; parts.len()];
    for index in order.into_iter().map(|index| index as usize) {
        let (name, _) = parts.get_index(index).expect("it is one of them");
        let times = elsewhere(name).max(1);
        let sum = below(index).map(|part| lookups[part].saturating_mul(times));
        lookups[index] = sum.fold(1, u64::saturating_add);
        if lookups[index] <= MAX_LOOKUPS {
            continue;
        }
        let (mut open, mut seen, mut count) = (vec![index], HashSet::new(), 0_u64);
        while let Some(at) = open.pop() {
            if !seen.insert(at) {
                continue;
            }
            count = count.saturating_add(1);
            match elsewhere(parts.get_index(at).expect("it is one of them").0) {
                0 => open.extend(below(at)),
                times => {
                    let moved = below(at).map(|part| lookups[part].saturating_mul(times));
                    count = moved.fold(count, u64::saturating_add);
                }
            }
        }
        lookups[index] = count;
        if count > MAX_LOOKUPS {
            let message = format!(
                "the texture `{name}` looks up more than {MAX_LOOKUPS} others for every point"
            );
            report.at("scene::too-many", &names.textures[*name], message).help =
                Some("put fewer `Placed`, `Triplanar` and `Drift` into one another".to_owned());
            return;
        }
    }
}

/// So many names of a way around are told.
const TOLD: usize = 8;

/// The cycles of a graph, each once: the node and edge that close it, and the way around.
fn cycles<'a>(edges: &Parts<'a>) -> Vec<(&'a str, &'a str, String)> {
    let mut found = Vec::new();
    let mut done = vec![false; edges.len()];
    let mut on_way = vec![false; edges.len()];
    for start in 0..edges.len() {
        // Depth first, without recursion: a chain of parents may be long.
        let mut way: Vec<(usize, usize)> = Vec::new();
        if !done[start] {
            way.push((start, 0));
            on_way[start] = true;
        }
        while let Some((node, next)) = way.last_mut() {
            let (name, targets) = edges.get_index(*node).expect("it came from the map");
            let Some((field, target)) = targets.get(*next) else {
                done[*node] = true;
                on_way[*node] = false;
                way.pop();
                continue;
            };
            *next += 1;
            let Some(target) = edges.get_index_of(target) else { continue };
            if on_way[target] {
                let from = way.iter().position(|(node, _)| *node == target).unwrap_or(0);
                let label =
                    |node: usize| format!("`{}`", edges.get_index(node).map_or("", |e| e.0));
                let around = way[from..].iter().take(TOLD);
                let mut around: Vec<_> = around.map(|(node, _)| label(*node)).collect();
                if way.len() - from > TOLD {
                    around.push("…".to_owned());
                }
                found.push((*name, *field, format!("{} → {}", around.join(" → "), label(target))));
            } else if !done[target] {
                on_way[target] = true;
                way.push((target, 0));
            }
        }
    }
    found
}

/// Finds the camera to look through: the one asked for, the one the scene names, the only one.
pub(super) fn choose_camera(
    scene: &mut SceneDescription,
    chosen: Option<&Cursor>,
    names: &Names,
    options: &LoadOptions,
    report: &mut Report,
) {
    // Whether an entity has a camera is asked of the text: one that is wrong is a camera, too.
    let cameras: Vec<(&str, Cursor)> = names
        .entities
        .iter()
        .filter_map(|(name, entity)| Some((name.as_str(), entity.field("camera")?)))
        .collect();
    let available = || cameras.iter().map(|(name, _)| *name);
    if let Some(name) = &options.camera {
        if available().any(|camera| camera == name) {
            scene.camera.clone_from(name);
        } else {
            let help = report.hints.suggestion(name, available(), "cameras");
            report.found.0.push(Diagnostic {
                severity: Severity::Error,
                code: "scene::camera",
                message: format!("there is no camera named `{name}`"),
                place: None,
                label: String::new(),
                related: Vec::new(),
                help,
            });
        }
        return;
    }
    if let Some(cursor) = chosen {
        if cursor.node.kind != Kind::Text {
            let message = "`camera` is the name of the entity to look through, in double quotes";
            report.at("scene::wrong-type", cursor, message).help = Some(
                "a camera is an entity: `entities: {\"camera\": (transform: (translation: (0, 1, 5), \
                 look_at: (0, 0, 0)), camera: (fov: 40))}`"
                    .to_owned(),
            );
            return;
        }
        let Some(name) = super::decode::decode::<String>(cursor, report) else { return };
        if available().any(|camera| camera == name) {
            scene.camera = name;
        } else if names.entities.contains_key(&name) {
            let message = format!("the entity `{name}` has no camera");
            report.at("scene::camera", cursor, message).help =
                report.hints.suggestion(&name, available(), "cameras");
        } else {
            reference(report, cursor, &name, &names.entities, "entity", "entities");
        }
        return;
    }
    match cameras.as_slice() {
        [(name, _)] => (*name).clone_into(&mut scene.camera),
        [] => {
            report.found.0.push(Diagnostic {
                severity: Severity::Error,
                code: "scene::camera",
                message: "the scene has no camera".to_owned(),
                place: None,
                label: String::new(),
                related: Vec::new(),
                help: Some(
                    "add an entity such as \"camera\": (transform: (translation: (0, 1, 5)), \
                     camera: ())"
                        .to_owned(),
                ),
            });
        }
        [(first, at), (_, other), ..] => {
            let message = format!("the scene has {} cameras and chooses none", cameras.len());
            let diagnostic = report.error("scene::camera", at.key_place(), &at.path, message);
            diagnostic.related.push((other.key_place(), other.path.clone()));
            diagnostic.help = Some(format!("choose one, as in `camera: \"{first}\"`"));
        }
    }
}

/// Reports procedural textures which reflect more light than there is. Colours are only known as
/// shares where they are used, for the same texture may give radiance elsewhere.
pub(super) fn check_shares(scene: &SceneDescription, names: &Names, report: &mut Report) {
    let greatest = greatest_values(scene);
    for (name, material) in &scene.materials {
        let colors = match material {
            Material::Diffuse { albedo } | Material::Plastic { albedo, .. } => ("albedo", albedo),
            Material::Mirror { reflectance } => ("reflectance", reflectance),
            Material::ThinGlass { tint, .. } => ("tint", tint),
            Material::Conductor { f0: Some(f0), .. } => ("f0", f0),
            Material::Principled { base_color, .. } => ("base_color", base_color),
            _ => continue,
        };
        let (field, Value::Texture(texture)) = colors else { continue };
        if greatest.get(texture.as_str()).is_some_and(|greatest| *greatest > 1.0) {
            let message =
                format!("`{field}` must be at most 1, but the texture `{texture}` goes beyond");
            report.at("scene::out-of-range", &names.materials[name].at(field), message);
        }
    }
}

/// Reports normal maps which are decoded as colours: all their normals would be wrong.
pub(super) fn check_normal_maps(scene: &SceneDescription, names: &Names, report: &mut Report) {
    for (name, material) in &scene.materials {
        let Material::NormalMap { map, .. } = material else { continue };
        let Some(Texture::Image { file, encoding: Encoding::Srgb, .. }) = scene.textures.get(map)
        else {
            continue;
        };
        if matches!(file.pixels, ImagePixels::Rgba8(..)) {
            let message = format!("the texture `{map}` is read as colours, but holds normals");
            let place = names.materials[name].at("map");
            report.at("scene::conflict", &place, message).help =
                Some(format!("add `encoding: Linear` to the texture `{map}`"));
        }
    }
}

/// Reports solids whose absorption by wavelength is no spectrum.
pub(super) fn check_absorption(scene: &SceneDescription, names: &Names, report: &mut Report) {
    for (name, material) in &scene.materials {
        let Material::Dielectric { absorption: Some(texture), .. } = material else { continue };
        let is_spectrum = |texture| matches!(texture, &Texture::Spectrum { .. });
        if scene.textures.get(texture).is_some_and(|texture| !is_spectrum(texture)) {
            let message =
                format!("`absorption` must be a `Spectrum`, but the texture `{texture}` is none");
            report.at("scene::wrong-type", &names.materials[name].at("absorption"), message).help =
                Some("say it by colour as `attenuation`, or define a `Spectrum`".to_owned());
        }
    }
}

/// The greatest value of each texture made of patterns; 0 where it is not known before looking at pixels. None where
/// textures have no order, which is reported elsewhere.
fn greatest_values(scene: &SceneDescription) -> HashMap<&str, f32> {
    let parts = texture_parts(scene);
    let mut known = HashMap::new();
    for index in order(&parts).unwrap_or_default() {
        let (&name, _) = parts.get_index(index as usize).expect("it is one of them");
        known.insert(name, greatest(&scene.textures[name], &known));
    }
    known
}

/// The greatest value of a texture, when those of its parts are known.
fn greatest(texture: &SceneTexture, known: &HashMap<&str, f32>) -> f32 {
    let of = |name: &String| known.get(name.as_str()).copied().unwrap_or(0.0);
    let value = |value: &Value<Rgb, String>| match value {
        Value::Constant(color) => color.max_element(),
        Value::Texture(name) => of(name),
    };
    match texture {
        Texture::Image { .. } | Texture::Grid { .. } | Texture::VertexColor {} => 0.0,
        Texture::Spectrum { values, scale } => {
            values.points().iter().map(|point| point.1 * scale).fold(0.0, f32::max)
        }
        Texture::Checker { a, b, .. }
        | Texture::Stripes { a, b, .. }
        | Texture::Gradient { a, b }
        | Texture::Noise { a, b, .. }
        | Texture::Cells { a, b, .. }
        | Texture::Marble { a, b, .. }
        | Texture::Wood { a, b, .. }
        | Texture::Ramp { a, b, .. }
        | Texture::Radial { a, b, .. }
        | Texture::Mix { a, b, .. } => value(a).max(value(b)),
        Texture::Bricks { a, b, between, .. } => value(a).max(value(b)).max(value(between)),
        Texture::Multiply { a, b } => value(a) * value(b),
        Texture::Remap { to, .. } => to.0.max(to.1),
        Texture::Placed { of: name, .. }
        | Texture::Triplanar { of: name, .. }
        | Texture::Drift { of: name, .. } => of(name),
    }
}

/// Warnings about definitions which nothing uses, and about a scene without light.
pub(super) fn warnings(scene: &SceneDescription, names: &Names) -> Diagnostics {
    let mut used = HashSet::new();
    for entity in scene.entities.values() {
        used.extend(entity.material.iter().map(|name| ("material", name.clone())));
        match &entity.shape {
            Some(Shape::Mesh(name)) => {
                let mut of = Some(name.clone());
                while let Some(name) = of {
                    let height = scene.displacements.get(&name).map(|by| by.texture.clone());
                    used.extend(height.map(|height| ("texture", height)));
                    let mesh = names.meshes.get(&name);
                    let shape = mesh.and_then(|mesh| mesh.field("shape"));
                    let profile = shape.and_then(|shape| shape.field("profile"));
                    let named = profile.map(|name| super::outline::unquoted(name.text()));
                    used.extend(named.map(|name| ("profile", name)));
                    let part = mesh.and_then(|mesh| mesh.field("of"));
                    of = part.map(|part| super::outline::unquoted(part.text()));
                    if !used.insert(("mesh", name)) {
                        break;
                    }
                }
            }
            Some(Shape::Revolution { profile, .. }) => {
                let is_it = |made: &&Arc<Profile>| Arc::ptr_eq(made, profile);
                let name = names.made.iter().find(|(_, made)| is_it(made));
                used.extend(name.map(|(name, _)| ("profile", name.clone())));
            }
            _ => {}
        }
        let emitted = entity.emission.as_ref().and_then(|emission| match &emission.strength {
            EmissionStrength::Radiance(value) => value.texture(),
            EmissionStrength::Power(_) | EmissionStrength::Temperature { .. } => None,
        });
        let shining = entity.light.as_ref().and_then(|light| match light {
            Light::Sky { radiance, .. } => radiance.texture(),
            _ => None,
        });
        used.extend(emitted.into_iter().chain(shining).map(|name| ("texture", name.clone())));
    }
    // What a used material refers to is used; following the parts ends, for each is opened once.
    let mut open: Vec<String> = scene.materials.keys().cloned().collect();
    open.retain(|name| used.contains(&("material", name.clone())));
    while let Some(name) = open.pop() {
        let Some(material) = scene.materials.get(&name) else { continue };
        let mut textures = Vec::new();
        let mut parts = Vec::new();
        let mapped: Result<Material<()>, std::convert::Infallible> = material.clone().map_refs(
            &mut |name| {
                textures.push(name);
                Ok(())
            },
            &mut |name| {
                parts.push(name);
                Ok(())
            },
        );
        debug_assert!(mapped.is_ok());
        used.extend(textures.into_iter().map(|name| ("texture", name)));
        for part in parts {
            if used.insert(("material", part.clone())) {
                open.push(part);
            }
        }
    }
    let mut open: Vec<String> = scene.textures.keys().cloned().collect();
    open.retain(|name| used.contains(&("texture", name.clone())));
    while let Some(name) = open.pop() {
        let Some(texture) = scene.textures.get(&name) else { continue };
        for (_, part) in texture.refs() {
            if used.insert(("texture", part.clone())) {
                open.push(part.clone());
            }
        }
    }
    let mut warnings = Vec::new();
    let kinds = [
        ("texture", &names.textures),
        ("material", &names.materials),
        ("profile", &names.profiles),
        ("mesh", &names.meshes),
    ];
    for (kind, defined) in kinds {
        for (name, cursor) in defined {
            if !used.contains(&(kind, name.clone())) {
                let message = format!("nothing uses the {kind} `{name}`");
                warnings.push(warning("scene::unused", message, Some(cursor)));
            }
        }
    }
    if scene.entities.values().all(|entity| entity.emission.is_none() && entity.light.is_none()) {
        let message = "the scene has no light: every picture of it is black".to_owned();
        warnings.push(warning("scene::dark", message, None));
    }
    Diagnostics(warnings)
}

/// A warning about the value or the entry at a place.
pub(super) fn warning(code: &'static str, message: String, cursor: Option<&Cursor>) -> Diagnostic {
    Diagnostic {
        severity: Severity::Warning,
        code,
        message,
        place: cursor.map(Cursor::key_place),
        label: cursor.map(|cursor| cursor.path.clone()).unwrap_or_default(),
        related: Vec::new(),
        help: None,
    }
}
