//! `kinora check`: is a scene right, what does it contain, what will it cost?

use super::arguments::CheckArguments;
use super::engine;
use super::failure::Failure;
use super::format;
use super::survey::{Survey, scene_warnings, sum};
use kinora::description::{
    EntityDescription, Light, SceneDescription, SceneTexture, Shape, Texture,
};
use kinora::film::Tile;
use std::collections::HashSet;
use std::io::{self, IsTerminal, Write};
use std::sync::Arc;

pub fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let scene = engine::load(&arguments.scene)?;
    let survey = Survey::new(&scene)?;
    let mut out = io::stdout().lock();
    let path = arguments.scene.path.display().to_string();
    writeln!(out, "{} is a valid scene\n", format::harmless(&path))?;
    let lines = contents(&scene).into_iter().chain(requirements(&survey));
    let lines = lines.chain(cost(&scene)).chain([("memory", memory(&survey))]);
    for (label, text) in lines {
        writeln!(out, "  {label:<10} {}", format::harmless(&text))?;
    }
    for warning in scene_warnings(&scene, io::stdout().is_terminal()) {
        writeln!(out, "\n{warning}")?;
    }
    for warning in &survey.warnings {
        writeln!(out, "\nwarning: {}", format::harmless(warning))?;
    }
    out.flush()?;
    Ok(())
}

/// What the renderer has to do for this scene, each with its reason, and which integrator does it.
fn requirements(survey: &Survey) -> Vec<(&'static str, String)> {
    let frames: Vec<String> = survey.frames.iter().map(i32::to_string).collect();
    let seen = match frames.as_slice() {
        [frame] => format!("(seen at frame {frame})"),
        [rest @ .., last] => format!("(seen at frames {} and {last})", rest.join(", ")),
        [] => String::new(),
    };
    let mut lines = match survey.features.len() {
        0 => vec![("requires", format!("nothing beyond still and opaque surfaces {seen}"))],
        count => vec![("requires", format!("{} {seen}", format::plural(count, "feature")))],
    };
    lines.extend(survey.features.iter().map(|(name, why)| ("", format!("  {name}: {why}"))));
    lines.extend(survey.diced.iter().map(|(name, triangles, bytes)| {
        let (triangles, bytes) = (format::count(*triangles as f64), format::bytes(*bytes as u64));
        ("diced", format!("`{name}` to {triangles} triangles for the camera, {bytes}"))
    }));
    lines.push(("integrator", survey.integrator.clone()));
    lines
}

/// What there is, line by line.
fn contents(scene: &SceneDescription) -> Vec<(&'static str, String)> {
    let (first, last) = scene.clock.frames;
    let (open, close) = scene.clock.shutter;
    let (width, height) = scene.render.size;
    vec![
        (
            "frames",
            format!(
                "{} ({first} to {last}) at {} per second, shutter {open} to {close} of a frame",
                frame_count(scene),
                scene.clock.fps
            ),
        ),
        (
            "picture",
            format!(
                "{width} × {height} pixels, {} per pixel",
                format::plural(scene.render.samples as usize, "sample"),
            ),
        ),
        ("camera", camera(scene)),
        ("entities", scene.entities.len().to_string()),
        ("shapes", kinds(scene, |entity| entity.shape.as_ref().map(shape_name))),
        ("meshes", meshes(scene)),
        ("materials", scene.materials.len().to_string()),
        ("textures", textures(scene)),
        ("lights", kinds(scene, light_name)),
        ("files", scene.files.len().to_string()),
    ]
}

/// An honest hint: how much there is to do, not how long it takes.
fn cost(scene: &SceneDescription) -> Vec<(&'static str, String)> {
    let (width, height) = Tile::rendered(&scene.render).size();
    let paths = f64::from(width) * f64::from(height) * f64::from(scene.render.samples);
    vec![(
        "cost",
        format!(
            "{} paths per frame (pixels × samples), {} in all",
            format::count(paths),
            format::count(paths * frame_count(scene) as f64)
        ),
    )]
}

/// The memory of a frame and what holds it; photons come on top.
fn memory(survey: &Survey) -> String {
    let parts = survey.memory.iter().filter(|(_, bytes)| *bytes > 0);
    let parts = parts.map(|(name, bytes)| format!("{name} {}", format::bytes(*bytes)));
    let list = parts.collect::<Vec<_>>().join(", ");
    format!("{} for a frame: {list}", format::bytes(sum(&survey.memory)))
}

fn frame_count(scene: &SceneDescription) -> u64 {
    let (first, last) = scene.clock.frames;
    u64::try_from(i64::from(last) + 1 - i64::from(first)).unwrap_or(0)
}

fn camera(scene: &SceneDescription) -> String {
    let others = scene.entities.values().filter(|entity| entity.camera.is_some()).count();
    match others {
        0 | 1 => format!("`{}`", scene.camera),
        all => format!("`{}` (of {all}; --camera chooses)", scene.camera),
    }
}

fn meshes(scene: &SceneDescription) -> String {
    let triangles: usize = scene.meshes.values().map(|mesh| mesh.triangles.len()).sum();
    let named = |shape: &Shape<String>| match shape {
        Shape::Mesh(name) => scene.meshes.get(name).map(|mesh| mesh.triangles.len()),
        _ => None,
    };
    let placed: usize = scene.entities.values().filter_map(|e| named(e.shape.as_ref()?)).sum();
    match scene.meshes.len() {
        0 => "0".to_owned(),
        count => format!(
            "{count} with {}; {} over all instances",
            format::plural(triangles, "triangle"),
            format::count(placed as f64)
        ),
    }
}

fn textures(scene: &SceneDescription) -> String {
    let (mut images, mut grids) = (HashSet::new(), HashSet::new());
    let memory = |texture: &SceneTexture| match texture {
        Texture::Image { file, .. } if images.insert(Arc::as_ptr(file)) => file.memory() as u64,
        Texture::Grid { file, .. } if grids.insert(Arc::as_ptr(file)) => file.memory() as u64,
        _ => 0,
    };
    let bytes: u64 = scene.textures.values().map(memory).sum();
    match scene.textures.len() {
        count if bytes == 0 => count.to_string(),
        count => format!("{count}, {} of decoded images and grids", format::bytes(bytes)),
    }
}

fn shape_name(shape: &Shape<String>) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "sphere",
        Shape::Rectangle { .. } => "rectangle",
        Shape::Disk { .. } => "disk",
        Shape::Plane {} => "plane",
        Shape::Box { .. } => "box",
        Shape::Cylinder { .. } => "cylinder",
        Shape::Cone { .. } => "cone",
        Shape::Revolution { .. } => "surface of revolution",
        Shape::Mesh(_) => "mesh",
    }
}

fn light_name(entity: &EntityDescription) -> Option<&'static str> {
    Some(match &entity.light {
        None if entity.emission.is_some() => "emitting shape",
        None => return None,
        Some(Light::Point { .. }) => "point",
        Some(Light::Spot { .. }) => "spot",
        Some(Light::Directional { .. }) => "directional",
        Some(Light::Sky { .. }) => "sky",
    })
}

/// `5: 3 × sphere, 2 × box`, in the order in which the kinds first occur.
fn kinds(
    scene: &SceneDescription,
    kind: impl Fn(&EntityDescription) -> Option<&'static str>,
) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for name in scene.entities.values().filter_map(kind) {
        match counts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    let total: usize = counts.iter().map(|(_, count)| count).sum();
    let list: Vec<_> = counts.iter().map(|(name, count)| format!("{count} × {name}")).collect();
    if list.is_empty() { "0".to_owned() } else { format!("{total}: {}", list.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinora::description::{
        Channel, Encoding, ImageData, ImagePixels, TextureFilter, TriangleMesh, Wrap,
    };

    #[test]
    fn the_contents_of_a_scene_are_counted() {
        let mut scene = SceneDescription { camera: "eye".into(), ..Default::default() };
        let mesh = TriangleMesh { triangles: vec![[0, 1, 2]; 7], ..Default::default() };
        scene.meshes.insert("m".into(), Arc::new(mesh));
        let pixels = ImagePixels::Rgba32F(vec![[0.0; 4]; 6]);
        let image = Arc::new(ImageData { width: 3, height: 2, pixels });
        for name in ["t", "u"] {
            let texture = Texture::Image {
                file: image.clone(),
                encoding: Encoding::Srgb,
                wrap: Wrap::Repeat,
                filter: TextureFilter::Bilinear,
                channel: Channel::Luminance,
                repeat: glam::Vec2::ONE,
                offset: glam::Vec2::ZERO,
            };
            scene.textures.insert(name.into(), texture);
        }
        let shaped = |shape| EntityDescription { shape: Some(shape), ..Default::default() };
        for name in ["a", "b", "c"] {
            scene.entities.insert(name.into(), shaped(Shape::Mesh("m".into())));
        }
        scene.entities.insert("d".into(), shaped(Shape::Sphere { radius: 1.0 }));
        let light = Light::Point { intensity: None, power: None };
        let lamp = EntityDescription { light: Some(light), ..Default::default() };
        scene.entities.insert("e".into(), lamp);

        let lines = contents(&scene);
        let line = |label| &lines.iter().find(|(name, _)| *name == label).expect("printed").1;
        assert_eq!(line("shapes"), "4: 3 × mesh, 1 × sphere");
        assert_eq!(line("meshes"), "1 with 7 triangles; 21 over all instances");
        assert_eq!(
            line("textures"),
            "2, 96 B of decoded images and grids",
            "shared images count once"
        );
        assert_eq!(line("lights"), "1: 1 × point");
        assert_eq!(line("camera"), "`eye`");
    }
}
