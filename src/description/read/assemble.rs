//! The definitions of all files of a scene, gathered by name and read one by one.

use super::decode::{Report, decode, decode_fields};
use super::extrude;
use super::files;
use super::limits;
use super::outline::Kind;
use super::overrides::FIELDS;
use super::patches::{bezier_mesh, spline_mesh};
use super::profile::read_profile;
use super::source::{Cursor, Source};
use super::surface::{self, MeshFile};
use super::texture::read_texture;
use super::waves::check_waves;
use super::{ContentHash, LoadOptions, Names, entity, relations, words};
use crate::description::assets::{MAX_FILE_BYTES, load_grid, load_image, load_mesh};
use crate::description::diagnostic::{Diagnostic, Diagnostics, SourceText};
use crate::description::modelling::{grid, subdivided};
use crate::description::{
    Clock, Displacement, Encoding, Filter, GridData, ImageData, PhotonSettings, RenderSettings,
    SceneDescription, SceneTexture, Texture, TriangleMesh, Waves,
};
use crate::math::Profile;
use indexmap::IndexMap;
use indexmap::map::Entry;
use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Everything that the files of a scene define.
#[derive(Default)]
struct Definitions<'a> {
    names: Names<'a>,
    clock: IndexMap<String, Cursor<'a>>,
    render: IndexMap<String, Cursor<'a>>,
    camera: Option<Cursor<'a>>,
}

/// Makes a scene of its files, of which the last is the one that was asked for.
pub(super) fn assemble(
    sources: &[Source],
    complete: bool,
    options: &LoadOptions,
    (files, hash): (Vec<PathBuf>, ContentHash),
    mut report: Report,
) -> Result<SceneDescription, Diagnostics> {
    let report = &mut report;
    let mut definitions = Definitions::default();
    for source in sources {
        let root = source.cursor();
        look_over(&root, report);
        gather(&root, &mut definitions, report);
    }
    // What could not be gathered may hold the names that seem to be missing.
    let complete = complete && !report.found.0.iter().any(|d| d.code == "scene::structure");
    definitions.names.complete = complete;
    definitions.names.made = made_profiles(&definitions.names.profiles, report);
    let names = &definitions.names;
    let mut scene = SceneDescription { files, ..SceneDescription::default() };
    let clock: Vec<_> = definitions.clock.values().cloned().collect();
    if let Some(clock) = decode_fields(&clock, report) {
        scene.clock = clock;
        check_clock(&clock, &definitions.clock, report);
    }
    let render: Vec<_> = definitions.render.values().cloned().collect();
    if let Some(settings) = decode_fields(&render, report) {
        check_render(&settings, &definitions.render, report);
        scene.render = settings;
    }
    for (name, cursor) in &names.materials {
        if let Some(material) = surface::read_material(cursor, names, report) {
            scene.materials.insert(name.clone(), material);
        }
    }
    for (name, cursor) in &names.entities {
        if let Some(entity) = entity::read_entity(cursor, names, report) {
            scene.entities.insert(name.clone(), entity);
        }
    }
    if complete {
        relations::choose_camera(&mut scene, definitions.camera.as_ref(), names, options, report);
    }
    let mut assets = Assets {
        options,
        hash,
        images: HashMap::new(),
        grids: HashMap::new(),
        meshes: HashMap::new(),
        remarks: Vec::new(),
    };
    for (name, cursor) in &names.textures {
        let texture = read_texture(cursor, names, report);
        if let Some(texture) = texture.and_then(|t| assets.texture(cursor, t, &mut scene, report)) {
            scene.textures.insert(name.clone(), texture);
        }
    }
    // A mesh is made from others by recursion, which ends only where they have an order.
    let ordered = relations::check_mesh_parts(names, report);
    let mut made = HashSet::new();
    for (name, mesh) in &names.meshes {
        if ordered || mesh.field("of").is_none() {
            assets.named_mesh(name, names, &mut made, &mut scene, report);
        }
    }
    // In the order of the file, whatever was made from what.
    scene.meshes.sort_by_key(|name, _| names.meshes.get_index_of(name));
    relations::check_cycles(&scene, names, report);
    relations::check_shares(&scene, names, report);
    relations::check_normal_maps(&scene, names, report);
    relations::check_absorption(&scene, names, report);
    scene.content_hash = assets.hash.0.digest128();
    scene.warnings = relations::warnings(&scene, names);
    scene.warnings.0.append(&mut assets.remarks);
    if report.found.has_errors() {
        Err(in_order(std::mem::take(&mut report.found)))
    } else {
        Ok(scene)
    }
}

/// The profiles which can be made.
fn made_profiles(
    profiles: &IndexMap<String, Cursor>,
    report: &mut Report,
) -> HashMap<String, Arc<Profile>> {
    let made = profiles.iter().map(|(name, cursor)| (name, read_profile(cursor, report)));
    made.filter_map(|(name, profile)| Some((name.clone(), profile?))).collect()
}

/// The mistakes of each text together and in its order; those without a place at the end.
fn in_order(mut mistakes: Diagnostics) -> Diagnostics {
    let mut texts: Vec<Arc<SourceText>> = Vec::new();
    for place in mistakes.0.iter().filter_map(|mistake| mistake.place.as_ref()) {
        if !texts.iter().any(|text| Arc::ptr_eq(text, &place.source)) {
            texts.push(place.source.clone());
        }
    }
    mistakes.0.sort_by_key(|mistake| {
        mistake.place.as_ref().map_or((usize::MAX, 0), |place| {
            let text = texts.iter().position(|text| Arc::ptr_eq(text, &place.source));
            (text.unwrap_or(usize::MAX), place.span.start)
        })
    });
    mistakes
}

/// Finds what is wrong wherever it stands: numbers which are none, and names given twice.
fn look_over(cursor: &Cursor, report: &mut Report) {
    if cursor.node.kind == Kind::Word && is_not_finite(cursor.text()) {
        let message = format!("`{}` is not a finite number", cursor.text());
        report.at("scene::not-finite", cursor, message);
    }
    let mut seen: HashMap<String, Cursor> = HashMap::new();
    for entry in cursor.entries() {
        look_over(&entry, report);
        if !entry.key.is_empty() {
            match seen.entry(entry.key()) {
                std::collections::hash_map::Entry::Vacant(vacant) => {
                    vacant.insert(entry);
                }
                std::collections::hash_map::Entry::Occupied(first) => {
                    duplicate(&entry, first.get(), report);
                }
            }
        }
    }
}

fn duplicate(second: &Cursor, first: &Cursor, report: &mut Report) {
    let message = format!("`{}` is given twice", second.key());
    let place = second.key_place();
    let related = (first.key_place(), "first given here".to_owned());
    let diagnostic = report.error("scene::duplicate", place, &second.path, message);
    if diagnostic.related.is_empty() {
        diagnostic.related.push(related);
    }
}

/// Whether a word is a number, but not a finite one of 64 bits.
fn is_not_finite(word: &str) -> bool {
    let plain = word.trim_start_matches(['+', '-']);
    if plain.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        let digits = plain.replace('_', "");
        return digits.parse::<f64>().is_ok_and(|number| !number.is_finite());
    }
    let named = plain.to_ascii_lowercase();
    let named = named.trim_end_matches("f32").trim_end_matches("f64");
    matches!(named, "nan" | "inf" | "infinity")
}

/// Sorts the parts of a file by what they define.
fn gather<'a>(root: &Cursor<'a>, definitions: &mut Definitions<'a>, report: &mut Report) {
    let is_scene = matches!(root.name(), "" | "Scene");
    let named = root.node.entries.iter().all(|entry| !entry.key.is_empty());
    if root.node.kind != Kind::Tuple || !is_scene || !named {
        let message = "a scene file holds `Scene(entities: {…}, …)`";
        report.at("scene::structure", root, message);
        return;
    }
    for part in root.entries() {
        let names = &mut definitions.names;
        match part.key().as_str() {
            "include" => {}
            "camera" => definitions.camera = Some(part),
            "clock" => gather_fields(&part, &mut definitions.clock, report),
            "render" => gather_fields(&part, &mut definitions.render, report),
            "textures" => gather_names(&part, &mut names.textures, report),
            "materials" => gather_names(&part, &mut names.materials, report),
            "profiles" => gather_names(&part, &mut names.profiles, report),
            "meshes" => gather_names(&part, &mut names.meshes, report),
            "entities" => gather_names(&part, &mut names.entities, report),
            other => {
                let message = format!("a scene has no field `{other}`");
                let help = words::hint(other, &FIELDS)
                    .or_else(|| report.hints.suggestion(other, FIELDS, "fields"));
                report.error("scene::unknown-field", part.key_place(), &part.path, message).help =
                    help;
            }
        }
    }
}

/// Fields of later files replace those of the files which they include.
fn gather_fields<'a>(
    part: &Cursor<'a>,
    fields: &mut IndexMap<String, Cursor<'a>>,
    report: &mut Report,
) {
    let named = part.node.entries.iter().all(|entry| !entry.key.is_empty());
    if part.node.kind != Kind::Tuple || !part.name().is_empty() || !named {
        let message = format!("`{}` is written as `(field: value, …)`", part.path);
        report.at("scene::wrong-type", part, message);
        return;
    }
    for field in part.entries() {
        fields.insert(field.key(), field);
    }
}

/// Names are unique in all files together.
fn gather_names<'a>(
    part: &Cursor<'a>,
    names: &mut IndexMap<String, Cursor<'a>>,
    report: &mut Report,
) {
    if part.node.kind != Kind::Map {
        let message = format!("`{}` is written as `{{\"name\": …, …}}`", part.path);
        report.at("scene::structure", part, message);
        return;
    }
    for entry in part.entries() {
        let written = &entry.source.text[entry.key.range()];
        if !written.ends_with(['"', '#']) || entry.key().is_empty() {
            let message = "a name stands in double quotes and is not empty";
            report.error("scene::structure", entry.key_place(), &entry.path, message);
            continue;
        }
        match names.entry(entry.key()) {
            Entry::Vacant(vacant) => {
                vacant.insert(entry);
            }
            Entry::Occupied(first) => duplicate(&entry, first.get(), report),
        }
    }
}

fn check_clock(clock: &Clock, fields: &IndexMap<String, Cursor>, report: &mut Report) {
    if let Some(fps) = fields.get("fps") {
        limits::number(report, fps, clock.fps, &limits::FPS);
    }
    if let Some(frames) = fields.get("frames") {
        let (first, last) = clock.frames;
        let numbers = [first, last].map(f64::from);
        if limits::vector(report, frames, &numbers, &limits::FRAME) && last < first {
            let message =
                format!("no frames: the last frame, {last}, comes before the first, {first}");
            report.at("scene::empty-range", frames, message);
        }
    }
    if let Some(shutter) = fields.get("shutter") {
        let (open, close) = clock.shutter;
        if limits::vector(report, shutter, &[open, close], &limits::SHUTTER) && close < open {
            let message = format!("the shutter closes at {close}, before it opens at {open}");
            report.at("scene::empty-range", shutter, message);
        }
    }
}

fn check_render(render: &RenderSettings, fields: &IndexMap<String, Cursor>, report: &mut Report) {
    let (width, height) = render.size;
    if let Some(size) = fields.get("size") {
        let sides = [width, height].map(f64::from);
        if limits::vector(report, size, &sides, &limits::PIXELS) {
            limits::number(report, size, f64::from(width) * f64::from(height), &limits::AREA);
        }
    }
    if let (Some(region), Some((x, y, w, h))) = (fields.get("region"), render.region) {
        let ends = |start: u32, length: u32, side: u32| {
            length > 0 && start.checked_add(length).is_some_and(|end| end <= side)
        };
        if !(ends(x, w, width) && ends(y, h, height)) {
            let message = format!(
                "`region` is left, top, width and height of a part of the picture, {width} × {height} pixels, but is ({x}, \
                 {y}, {w}, {h})"
            );
            report.at("scene::out-of-range", region, message);
        }
    }
    let numbers = [
        ("samples", f64::from(render.samples), &limits::SAMPLES),
        ("max_depth", f64::from(render.max_depth), &limits::DEPTH),
        ("roulette_depth", f64::from(render.roulette_depth), &limits::ROULETTE),
        ("roulette_gain", f64::from(render.roulette_gain), &limits::ROULETTE_GAIN),
        ("inner_reflections", f64::from(render.inner_reflections), &limits::DEPTH),
        ("share", f64::from(render.share), &limits::GROUP),
        ("clamp_indirect", f64::from(render.clamp_indirect.unwrap_or(1.0)), &limits::POSITIVE),
        ("final_gather", f64::from(render.final_gather), &limits::GATHER),
        ("motion_tolerance", render.motion_tolerance, &limits::TOLERANCE),
        ("dicing", render.dicing, &limits::POSITIVE),
        ("dicing_memory", f64::from(render.dicing_memory), &limits::MEBIBYTES),
        ("exposure", f64::from(render.exposure), &limits::STOPS),
    ];
    for (name, value, limits) in numbers {
        if let Some(field) = fields.get(name) {
            limits::number(report, field, value, limits);
        }
    }
    if let Some(photons) = fields.get("photons") {
        check_photons(&render.photons, photons, report);
    }
    if let Some(filter) = fields.get("filter") {
        let (sigma, radius) = match render.filter {
            Filter::Gaussian { sigma, radius } => (sigma, radius),
            Filter::Box { radius } | Filter::BlackmanHarris { radius } => (1.0, radius),
        };
        limits::number(report, &filter.at("sigma"), sigma, &limits::FILTER);
        limits::number(report, &filter.at("radius"), radius, &limits::FILTER);
    }
    if let (Some(bits), false) = (fields.get("exr_bits"), matches!(render.exr_bits, 16 | 32)) {
        let message = format!("`exr_bits` must be 16 or 32, but is {}", render.exr_bits);
        report.at("scene::out-of-range", bits, message);
    }
    if let Some(layers) = fields.get("layers") {
        if render.layers.is_empty() {
            report.at("scene::empty", layers, "`layers` needs at least one layer");
        }
        for (index, layer) in render.layers.iter().enumerate() {
            if render.layers[..index].contains(layer) {
                let message = format!("the layer `{layer:?}` is given twice");
                report.at("scene::duplicate", &layers.nth(index), message);
            }
        }
    }
}

fn check_photons(photons: &PhotonSettings, cursor: &Cursor, report: &mut Report) {
    let numbers = [
        ("per_pass", f64::from(photons.per_pass.unwrap_or(1)), &limits::PHOTONS),
        ("alpha", f64::from(photons.alpha), &limits::ALPHA),
        ("radius", f64::from(photons.radius), &limits::RADIUS),
        ("enough", f64::from(photons.enough), &limits::ENOUGH),
        ("largest_radius", f64::from(photons.largest_radius), &limits::POSITIVE_SHARE),
        ("nearest", f64::from(photons.nearest), &limits::NEAREST),
        ("places", f64::from(photons.places), &limits::PLACES),
        ("min_roughness", f64::from(photons.min_roughness), &limits::SHARE),
        ("max_memory", f64::from(photons.max_memory), &limits::MEBIBYTES),
    ];
    for (name, value, limits) in numbers {
        limits::number(report, &cursor.at(name), value, limits);
    }
}

/// Finds and reads the files of textures and meshes, each once.
struct Assets<'o> {
    options: &'o LoadOptions,
    hash: ContentHash,
    images: HashMap<(PathBuf, Encoding), Arc<ImageData>>,
    grids: HashMap<PathBuf, Arc<GridData>>,
    meshes: HashMap<PathBuf, Arc<TriangleMesh>>,
    /// What was read otherwise than it is written.
    remarks: Vec<Diagnostic>,
}

impl Assets<'_> {
    /// Finds a file and adds its bytes to the hash.
    fn find(
        &mut self,
        place: &Cursor,
        name: &str,
        scene: &mut SceneDescription,
        report: &mut Report,
    ) -> Option<PathBuf> {
        let dir = place.source.dir.as_deref();
        let found = files::find(name, dir, self.options, MAX_FILE_BYTES, &mut report.hints)
            .and_then(|path| {
                if !scene.files.contains(&path) {
                    self.hash_file(name, &path).map_err(|source| files::FileError::Unreadable {
                        name: name.to_owned(),
                        source,
                    })?;
                }
                Ok(path)
            });
        match found {
            Ok(path) => {
                if !scene.files.contains(&path) {
                    scene.files.push(path.clone());
                }
                Some(path)
            }
            Err(error) => {
                report.at(error.code(), place, error.to_string()).help = error.help();
                None
            }
        }
    }

    fn hash_file(&mut self, name: &str, path: &Path) -> std::io::Result<()> {
        self.hash.add(name, &[]);
        let mut file = std::fs::File::open(path)?;
        let mut block = vec![0; 1 << 16];
        let mut length = 0_u64;
        loop {
            let count = file.read(&mut block)?;
            if count == 0 {
                self.hash.0.update(&length.to_le_bytes());
                return Ok(());
            }
            length += count as u64;
            self.hash.0.update(&block[..count]);
        }
    }

    fn texture(
        &mut self,
        cursor: &Cursor,
        texture: Texture<String, String, String>,
        scene: &mut SceneDescription,
        report: &mut Report,
    ) -> Option<SceneTexture> {
        let place = cursor.at("file");
        let grid = match &texture {
            Texture::Grid { file, .. } => self.grid(&place, file, scene, report),
            _ => None,
        };
        let image = |name: String, encoding: Encoding| {
            let path = self.find(&place, &name, scene, report).ok_or(())?;
            let key = (path, encoding);
            if let Some(image) = self.images.get(&key) {
                return Ok::<_, ()>(image.clone());
            }
            let image = load_image(&key.0, encoding).map_err(|error| {
                let message = format!("this image cannot be used: {error}");
                report.at("scene::asset", &place, message);
            })?;
            Ok(self.images.entry(key).or_insert(Arc::new(image)).clone())
        };
        texture.map_refs(image, |_| grid.ok_or(()), &mut Ok).ok()
    }

    fn grid(
        &mut self,
        place: &Cursor,
        name: &str,
        scene: &mut SceneDescription,
        report: &mut Report,
    ) -> Option<Arc<GridData>> {
        let path = self.find(place, name, scene, report)?;
        if let Some(grid) = self.grids.get(&path) {
            return Some(grid.clone());
        }
        match load_grid(&path) {
            Ok(grid) => Some(self.grids.entry(path).or_insert(Arc::new(grid)).clone()),
            Err(error) => {
                let message = format!("this grid cannot be used: {error}");
                report.at("scene::asset", place, message);
                None
            }
        }
    }

    /// Makes a mesh and, before it, those that it is made from; each once.
    fn named_mesh(
        &mut self,
        name: &str,
        names: &Names,
        made: &mut HashSet<String>,
        scene: &mut SceneDescription,
        report: &mut Report,
    ) -> Option<Arc<TriangleMesh>> {
        if made.insert(name.to_owned())
            && let Some(mesh) = self.mesh(name, names, made, scene, report)
        {
            scene.meshes.insert(name.to_owned(), mesh);
        }
        scene.meshes.get(name).cloned()
    }

    /// The mesh that another is made from: one that keeps its form.
    fn part(
        &mut self,
        cursor: &Cursor,
        of: &str,
        names: &Names,
        made: &mut HashSet<String>,
        scene: &mut SceneDescription,
        report: &mut Report,
    ) -> Option<Arc<TriangleMesh>> {
        let place = cursor.at("of");
        if names.complete {
            surface::reference(report, &place, of, &names.meshes, "mesh", "meshes");
        }
        let mesh = self.named_mesh(of, names, made, scene, report)?;
        if scene.waves.contains_key(of) || scene.displacements.contains_key(of) {
            let what = if scene.waves.contains_key(of) { "moves" } else { "is displaced" };
            let message = format!("`{of}` {what}: other meshes cannot be made from it");
            report.at("scene::conflict", &place, message);
            return None;
        }
        Some(mesh)
    }

    fn mesh(
        &mut self,
        name: &str,
        names: &Names,
        made: &mut HashSet<String>,
        scene: &mut SceneDescription,
        report: &mut Report,
    ) -> Option<Arc<TriangleMesh>> {
        let cursor = &names.meshes.get(name)?.clone();
        match decode(cursor, report)? {
            MeshFile::Grid { size, cells } => {
                surface::check_grid(cursor, size, cells, report)?;
                Some(Arc::new(grid(size, cells)))
            }
            MeshFile::Subdivided { of, levels, form } => {
                let mesh = self.part(cursor, &of, names, made, scene, report)?;
                surface::check_levels(cursor, &mesh, levels, report)?;
                Some(Arc::new(subdivided(&mesh, levels, form)))
            }
            MeshFile::Displaced { of, height, offset, space, strength, middle, adaptive } => {
                let (says, texture) = surface::relief(cursor, height, offset, space, report)?;
                let displacement = Displacement { texture, says, strength, middle, adaptive };
                surface::check_displacement(cursor, &displacement, names, report);
                let mesh = self.part(cursor, &of, names, made, scene, report)?;
                scene.displacements.insert(name.to_owned(), displacement);
                Some(mesh)
            }
            MeshFile::Triangles { positions, triangles, normals, uvs, colors } => {
                surface::check_triangles(
                    cursor, positions, &triangles, normals, uvs, colors, report,
                )
                .map(Arc::new)
            }
            MeshFile::Extrusion { outline, depth, tolerance, smooth } => {
                let drawn = (depth, tolerance, smooth);
                extrude::extrusion(cursor, &outline, drawn, report).map(Arc::new)
            }
            MeshFile::Text { text, font, size, depth, tolerance, smooth, align } => {
                let path = self.find(&cursor.at("font"), &font, scene, report)?;
                let (words, drawn) = ((&text[..], size, align), (depth, tolerance, smooth));
                extrude::words(cursor, words, &path, drawn, report).map(Arc::new)
            }
            MeshFile::Patches { points, weights, patches, tolerance } => {
                let net = (&points[..], weights);
                bezier_mesh(cursor, net, &patches, tolerance, report).map(Arc::new)
            }
            MeshFile::Spline { rows, weights, knots_u, knots_v, closed, tolerance } => {
                let (net, knots) = ((&rows[..], &weights[..]), (knots_u, knots_v));
                spline_mesh(cursor, net, knots, closed, tolerance, report).map(Arc::new)
            }
            MeshFile::Tessellated { tolerance, .. } => {
                surface::tessellation(cursor, tolerance, names, report).map(Arc::new)
            }
            MeshFile::Waves { size, cells, waves, steepness, gravity } => {
                let waves = Waves { size, cells, steepness, gravity, waves };
                let waves = check_waves(cursor, waves, report)?;
                let rest = Arc::new(waves.at_rest());
                scene.waves.insert(cursor.key(), waves);
                Some(rest)
            }
            MeshFile::File(name) => {
                let place = cursor.nth(0);
                let path = self.find(&place, &name, scene, report)?;
                if let Some(mesh) = self.meshes.get(&path) {
                    return Some(mesh.clone());
                }
                let mut remarks = Vec::new();
                let mesh = load_mesh(&path, &mut remarks).map_err(|error| {
                    let message = format!("this mesh cannot be used: {error}");
                    report.at("scene::asset", &place, message);
                });
                let remarks = remarks.into_iter();
                let warned =
                    remarks.map(|text| relations::warning("scene::asset", text, Some(&place)));
                self.remarks.extend(warned);
                let mesh = Arc::new(mesh.ok()?);
                self.hash_mesh(&mesh);
                Some(self.meshes.entry(path).or_insert(mesh).clone())
            }
        }
    }

    /// A mesh file may keep its vertices in another file: what was read from it counts as well.
    fn hash_mesh(&mut self, mesh: &TriangleMesh) {
        self.hash.add("positions", bytemuck::cast_slice(&mesh.positions));
        self.hash.add("normals", bytemuck::cast_slice(&mesh.normals));
        self.hash.add("uvs", bytemuck::cast_slice(&mesh.uvs));
        self.hash.add("colors", bytemuck::cast_slice(&mesh.colors));
        self.hash.add("triangles", bytemuck::cast_slice(&mesh.triangles));
    }
}
