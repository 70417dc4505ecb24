//! `kinora develop`: PNG files again from EXR files.

use super::arguments::DevelopArguments;
use super::engine::split_overrides;
use super::failure::Failure;
use super::format;
use super::progress::say;
use kinora::description::{Development, LoadOptions, ToneMap, parse_scene_str};
use kinora::output::{OutputError, check_writable, develop_exr, read_png_facts};
use rayon::prelude::*;
use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A scene to put settings into, so that they are read and checked as those of every scene.
const EMPTY_SCENE: &str = r#"(entities: {"camera": (camera: ())})"#;

/// What can change without rendering.
const OURS: [&str; 2] = ["render.exposure", "render.tonemap"];

/// What `--set` changes.
struct Changes {
    exposure: Option<f32>,
    tonemap: Option<ToneMap>,
}

pub fn run(arguments: &DevelopArguments) -> Result<(), Failure> {
    let changes = Changes::new(&arguments.overrides)?;
    let mut files = Vec::new();
    for path in &arguments.paths {
        files.extend(exr_files(path)?);
    }
    let target = |exr: &PathBuf| png_of(exr, arguments.out.as_deref());
    let mut targets = HashSet::new();
    if let Some(twice) = files.iter().map(target).find(|png| !targets.insert(png.clone())) {
        return Err(Failure::Usage(format!(
            "two of the EXR files would both become `{}`: develop them one after the other",
            twice.display()
        )));
    }
    if let Some(folder) = &arguments.out {
        check_writable(folder)?;
    }
    let developed: Vec<Result<(), OutputError>> =
        files.par_iter().map(|exr| changes.develop(exr, &target(exr))).collect();
    let mut failures: Vec<Failure> =
        developed.into_iter().filter_map(|outcome| Some(outcome.err()?.into())).collect();
    let done = format::plural(files.len() - failures.len(), "PNG");
    say(&format!("{done} developed"));
    // All are told, the last by the program's end.
    let last = failures.pop();
    failures.iter().for_each(Failure::print);
    last.map_or(Ok(()), Err)
}

/// The EXR files of a folder in the order of their names, or the file itself.
fn exr_files(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    let unreadable = |error| Failure::Input(format!("cannot read `{}`: {error}", path.display()));
    if !fs::metadata(path).map_err(unreadable)?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut files = Vec::new();
    for entry in fs::read_dir(path).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let is_exr = file.extension().is_some_and(|name| name.eq_ignore_ascii_case("exr"));
        let hidden = file.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_exr && !hidden && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(Failure::Input(format!(
            "no EXR file in `{}`: name a folder into which `kinora render` has written, or EXR files",
            path.display()
        )));
    }
    Ok(files)
}

/// The PNG of an EXR file: beside it or in another folder.
fn png_of(exr: &Path, folder: Option<&Path>) -> PathBuf {
    let beside = exr.with_extension("png");
    match (folder, beside.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => beside,
    }
}

impl Changes {
    fn new(overrides: &[String]) -> Result<Self, Failure> {
        let overrides = split_overrides(overrides);
        if let Some((path, _)) = overrides.iter().find(|(path, _)| !OURS.contains(&path.as_str())) {
            return Err(Failure::Usage(format!(
                "`{path}` cannot be set here: what is developed is not rendered again, and only {} can \
                 change; use `kinora render SCENE --set {path}=…`",
                OURS.map(|path| format!("`{path}`")).join(" and ")
            )));
        }
        let is_set = |path: &str| overrides.iter().any(|(set, _)| set == path);
        let [exposure, tonemap] = OURS.map(is_set);
        let options = LoadOptions { overrides, ..LoadOptions::default() };
        let scene = parse_scene_str("--set", EMPTY_SCENE, None, &options)?;
        Ok(Self {
            exposure: exposure.then_some(scene.render.exposure),
            tonemap: tonemap.then_some(scene.render.tonemap),
        })
    }

    /// Develops a file; what is not set stays as it is in the PNG beside it.
    fn develop(&self, exr: &Path, png: &Path) -> Result<(), OutputError> {
        let before = read_png_facts(&png_of(exr, None));
        let before = before.map(|facts| facts.development).unwrap_or_default();
        let development = Development {
            exposure: self.exposure.unwrap_or(before.exposure),
            tonemap: self.tonemap.unwrap_or(before.tonemap),
        };
        develop_exr(exr, png, development)
    }
}
