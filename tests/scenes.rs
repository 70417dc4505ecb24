//! The scenes of the repository, and the commands that the documents show with them.

use kinora::description::{LoadOptions, load_scene};
use kinora::frame::Simulation;
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
    assert!(scenes.len() >= 3, "{scenes:?}");
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
