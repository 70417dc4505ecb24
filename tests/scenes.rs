//! The scenes of the repository, and the commands that the documents show with them.

use kinora::description::{
    Clock, LoadOptions, RenderSettings, SceneDescription, load_scene, parse_scene_str,
};
use kinora::frame::{RenderControl, Simulation};
use std::fs;
use std::path::{Path, PathBuf};

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn scenes() -> Vec<PathBuf> {
    let entries = fs::read_dir(repository().join("scenes")).expect("the folder exists");
    let paths = entries.map(|entry| entry.expect("readable").path());
    let mut scenes: Vec<_> = paths.filter(|p| p.extension().is_some_and(|e| e == "ron")).collect();
    scenes.sort();
    assert!(scenes.len() >= 6, "{scenes:?}");
    scenes
}

#[test]
fn every_scene_loads_without_mistakes_and_warnings() {
    for path in scenes() {
        let scene = load_scene(&path, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        assert!(scene.warnings.0.is_empty(), "{}", scene.warnings.render(false));
    }
}

/// Prepared, not rendered: first and last frame stand for the film.
#[test]
fn every_scene_can_be_put_together_and_nothing_in_it_is_out_of_reach() {
    for path in scenes() {
        let scene = load_scene(&path, &LoadOptions::default()).expect("tested above");
        let mut simulation = Simulation::from_description(&scene);
        for frame in [scene.clock.frames.0, scene.clock.frames.1] {
            simulation.prepare_frame(frame).expect("there is a camera");
            assert_eq!(simulation.warnings(), [""; 0], "{} at frame {frame}", path.display());
        }
    }
}

/// A small picture of a frame from the middle of each film: light arrives, no sample is lost, and
/// no path ends but by itself.
#[test]
fn every_scene_renders() {
    for path in scenes() {
        let mut scene = load_scene(&path, &LoadOptions::default()).expect("tested above");
        let (width, height) = (scene.render.size.0 * 18 / scene.render.size.1, 18);
        (scene.render.size, scene.render.samples) = ((width, height), 2);
        let mut simulation = Simulation::from_description(&scene);
        let frame = scene.clock.frames.1 / 2;
        let rendered = simulation.render_frame(frame, &RenderControl::default());
        let rendered = rendered.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let name = path.display();
        assert_eq!((rendered.report.non_finite, rendered.report.truncated_paths), (0, 0), "{name}");
        let count = width * height;
        let pixels = (0..count).map(|i| rendered.film.radiance(i % width, i / width));
        let lit = pixels.filter(|radiance| radiance.max_element() > 0.0).count();
        assert!(lit as u32 > count * 9 / 10, "{name}: {lit} of {count} pixels are not black");
    }
}

/// "A scene opens with a comment: what it shows, which test or figure uses it, how long it takes."
#[test]
fn every_scene_opens_with_a_comment_that_begins_with_its_name() {
    for path in scenes() {
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).expect("readable");
        assert!(text.starts_with(&format!("// {name}: ")), "{name}");
    }
}

/// Words which are paths into the repository: in commands, and behind `](`.
fn named_files(text: &str) -> Vec<String> {
    let is_end = |c: char| c.is_whitespace() || "()`'\"<>,;".contains(c);
    let words = text.split(is_end).map(|word| word.trim_end_matches(['.', ':']));
    let folders =
        ["scenes/", "assets/", "examples/", "docs/", "src/", "tests/", "benches/", ".ci/"];
    let is_path = |word: &&str| folders.iter().any(|folder| word.starts_with(folder));
    words.filter(is_path).map(str::to_owned).collect()
}

#[test]
fn the_documents_name_only_files_that_exist() {
    let mut checked = 0;
    for document in ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"] {
        let text = fs::read_to_string(repository().join(document)).expect("readable");
        for name in named_files(&text) {
            assert!(repository().join(&name).exists(), "{document} names {name}");
            checked += 1;
        }
        // Links without a folder, such as `](LICENSE-MIT)`.
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let local = !link.contains("://") && !link.starts_with('#');
            assert!(!local || repository().join(link).exists(), "{document} links to {link}");
        }
    }
    assert!(checked >= 10, "only {checked} names were found");
}

/// Every `--example NAME` of the documents is a program of `examples/`.
#[test]
fn the_examples_that_are_named_exist() {
    for document in ["README.md", "CONTRIBUTING.md", "src/lib.rs"] {
        let text = fs::read_to_string(repository().join(document)).expect("readable");
        for rest in text.split("--example ").skip(1) {
            let name: String =
                rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let folder = repository().join("examples");
            let exists = folder.join(format!("{name}.rs")).exists()
                || folder.join(&name).join("main.rs").exists();
            assert!(exists, "{document} names the example {name}");
        }
    }
}

/// A scene of these fields, with a camera and a lamp.
fn scene_with(fields: &str) -> SceneDescription {
    let lamp = r#""lamp": (shape: Sphere(), emission: Radiance(1))"#;
    let text = format!(r#"({fields} entities: {{"eye": (camera: ()), {lamp}}})"#);
    let scene = parse_scene_str("defaults.ron", &text, None, &LoadOptions::default());
    scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)))
}

/// `field: default, …` of the table below a heading of the scene format.
fn documented_defaults(format: &str, heading: &str) -> String {
    let section = format.split(&format!("\n## {heading}\n")).nth(1).expect("the heading exists");
    let section = section.split("\n## ").next().expect("at least one piece");
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let cells = rows.map(|row| row.split('|').map(|cell| cell.trim().trim_matches('`')));
    let fields = cells.filter_map(|mut cells| {
        let (name, default) = (cells.nth(1)?, cells.next()?);
        (default != "off").then(|| format!("{name}: {default}"))
    });
    fields.collect::<Vec<_>>().join(", ")
}

#[test]
fn the_scene_format_tells_the_true_defaults_of_clock_and_settings() {
    let format = fs::read_to_string(repository().join("docs/scene-format.md")).expect("readable");
    let clock = documented_defaults(&format, "Clock");
    let render = documented_defaults(&format, "Render");
    let photons = documented_defaults(&format, "Photons");
    assert!(photons.contains("nearest"), "{photons}");
    assert!(clock.contains("shutter") && render.contains("exr_bits"), "{clock}; {render}");
    let render = render.replace("photons: ()", &format!("photons: ({photons})"));
    let scene = scene_with(&format!("clock: ({clock}), render: ({render}),"));
    assert_eq!(scene.clock, Clock::default(), "{clock}");
    assert_eq!(scene.render, RenderSettings::default(), "{render}");
}

#[test]
fn the_scene_that_the_format_shows_loads() {
    let format = fs::read_to_string(repository().join("docs/scene-format.md")).expect("readable");
    let text = format.split("```ron\n").nth(1).and_then(|rest| rest.split("```").next());
    let text = text.expect("it begins with a scene");
    let scene = parse_scene_str("format.ron", text, None, &LoadOptions::default());
    let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    assert!(scene.warnings.0.is_empty(), "{}", scene.warnings.render(false));
}
