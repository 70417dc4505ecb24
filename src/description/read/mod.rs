//! Scene files to a [`SceneDescription`]: reading, settings, checks, assets.
//!
//! A scene is read in steps, each of which tells all mistakes that it can find:
//!
//! 1. [`outline`]: where each value of each file stands; files named by `include` come first.
//! 2. [`overrides`]: settings of the command line are put into the text.
//! 3. [`assemble`]: definitions of all files are gathered by name; each is decoded alone by `ron`
//!    ([`decode`]), its numbers held against [`limits`], its names against the definitions.
//! 4. [`relations`]: parents and mixtures without cycles, a camera to look through.
//! 5. [`files`]: the files of textures and meshes are found and read.

mod assemble;
mod decode;
mod entity;
mod explain;
mod extrude;
mod files;
mod foreign;
mod light;
mod limits;
mod motion;
mod outline;
mod overrides;
mod patches;
mod profile;
mod relations;
mod source;
mod surface;
#[cfg(test)]
mod tests;
mod texture;
mod waves;
mod words;

use super::diagnostic::{Diagnostic, Diagnostics, Place, Severity, SourceText};
use super::scene::SceneDescription;
use crate::math::Profile;
use decode::Report;
use files::{FileError, MAX_SCENE_BYTES};
use indexmap::IndexMap;
use source::{Cursor, Source};
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// How a scene is to be read.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Further folders in which files named by the scene are looked for.
    pub asset_dirs: Vec<PathBuf>,
    /// Whether the scene may name files anywhere. Only for scenes that are trusted.
    pub allow_outside: bool,
    /// Values to replace or add before the scene is checked, each a path and RON:
    /// `("entities.ball.velocity.linear", "(2, 0, 0)")`.
    pub overrides: Vec<(String, String)>,
    /// The entity to look through, if not the one that the scene chooses.
    pub camera: Option<String>,
}

/// Reads and checks a scene file and all files which it names.
///
/// # Errors
/// All mistakes which could be found, each with its place. Scene files over 8 MiB are refused.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<SceneDescription, Diagnostics> {
    let mut loader = Loader::new(options);
    let name = path.display().to_string();
    let dir = path.parent().map(|dir| if dir == Path::new("") { Path::new(".") } else { dir });
    let text = files::check(&name, path, MAX_SCENE_BYTES).and_then(|()| {
        std::fs::read(path).map_err(|source| FileError::Unreadable { name: name.clone(), source })
    });
    match text {
        Ok(bytes) => {
            if let Some(other) = foreign::recognised(path, &bytes) {
                return Err(other);
            }
            loader.files.push(path.to_owned());
            loader.root = path.canonicalize().ok();
            let hashed = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            loader.read_bytes(&name, &hashed, bytes, dir);
        }
        Err(error) => loader.refuse(&error),
    }
    loader.finish()
}

/// Reads and checks a scene which comes from a stream, such as the standard input; files are looked for from
/// `base_dir`, if there is one.
///
/// `name` stands for the file's name in messages.
///
/// # Errors
/// All mistakes which could be found, each with its place. More than 8 MiB are refused.
pub fn read_scene(
    name: &str,
    stream: impl Read,
    base_dir: Option<&Path>,
    options: &LoadOptions,
) -> Result<SceneDescription, Diagnostics> {
    let mut loader = Loader::new(options);
    let mut text = Vec::new();
    // One byte more tells that there is more.
    let read = stream.take(MAX_SCENE_BYTES + 1).read_to_end(&mut text);
    let (name, bytes, limit) = (name.to_owned(), text.len() as u64, MAX_SCENE_BYTES);
    match read {
        Ok(_) if bytes <= limit => {
            loader.files.push(PathBuf::from(&name));
            loader.read_bytes(&name, &name, text, base_dir);
        }
        Ok(_) => loader.refuse(&FileError::TooLarge { name, bytes, limit }),
        Err(source) => loader.refuse(&FileError::Unreadable { name, source }),
    }
    loader.finish()
}

/// Reads and checks a scene given as text; files are looked for from `base_dir`, if there is one.
///
/// `name` stands for the file's name in messages.
///
/// # Errors
/// All mistakes which could be found, each with its place.
pub fn parse_scene_str(
    name: &str,
    text: &str,
    base_dir: Option<&Path>,
    options: &LoadOptions,
) -> Result<SceneDescription, Diagnostics> {
    let mut loader = Loader::new(options);
    loader.read_bytes(name, name, text.as_bytes().to_vec(), base_dir);
    loader.finish()
}

/// The definitions of all files by name, whether or not they could be decoded.
#[derive(Debug, Default)]
struct Names<'a> {
    /// Whether all files could be read; if not, missing names are not reported.
    complete: bool,
    textures: IndexMap<String, Cursor<'a>>,
    materials: IndexMap<String, Cursor<'a>>,
    profiles: IndexMap<String, Cursor<'a>>,
    /// Those of the profiles in which nothing is wrong.
    made: HashMap<String, Arc<Profile>>,
    meshes: IndexMap<String, Cursor<'a>>,
    entities: IndexMap<String, Cursor<'a>>,
}

/// The hash of everything that was read. Names and lengths keep neighbours apart.
struct ContentHash(Xxh3);

impl ContentHash {
    fn add(&mut self, name: &str, bytes: &[u8]) {
        for part in [name.as_bytes(), bytes] {
            self.0.update(&(part.len() as u64).to_le_bytes());
            self.0.update(part);
        }
    }
}

/// Reads files, those which they include first.
struct Loader<'o> {
    options: &'o LoadOptions,
    report: Report,
    /// In the order in which definitions are gathered; the root is the last.
    sources: Vec<Source>,
    /// The files that are being read, outermost first: to find cycles.
    open: Vec<PathBuf>,
    files: Vec<PathBuf>,
    /// The file that was asked for, if it is one.
    root: Option<PathBuf>,
    hash: ContentHash,
    complete: bool,
}

/// So many files may include each other in a row.
const MAX_INCLUDE_DEPTH: usize = 16;

impl<'o> Loader<'o> {
    fn new(options: &'o LoadOptions) -> Self {
        Self {
            options,
            report: Report::default(),
            sources: Vec::new(),
            open: Vec::new(),
            files: Vec::new(),
            root: None,
            hash: ContentHash(Xxh3::new()),
            complete: true,
        }
    }

    /// Notes that the scene itself cannot be had.
    fn refuse(&mut self, error: &FileError) {
        self.report.found.0.push(Diagnostic {
            severity: Severity::Error,
            code: error.code(),
            message: error.to_string(),
            place: None,
            label: String::new(),
            related: Vec::new(),
            help: None,
        });
    }

    fn read_bytes(&mut self, name: &str, hashed: &str, bytes: Vec<u8>, dir: Option<&Path>) {
        let (text, invalid) = match String::from_utf8(bytes) {
            Ok(text) => (text, None),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                (String::from_utf8_lossy(error.as_bytes()).into_owned(), Some(at))
            }
        };
        let file = Arc::new(SourceText { name: name.to_owned(), text });
        if let Some(at) = invalid {
            let place = Place { source: file, span: at..at + '\u{fffd}'.len_utf8() };
            self.report.error("scene::encoding", place, "", "the file is not valid UTF-8 here");
            self.complete = false;
            return;
        }
        match Source::new(file.clone(), dir.map(Path::to_owned)) {
            Ok(source) => {
                self.hash.add(hashed, source.without_settings().as_bytes());
                self.read_includes(&source);
                self.sources.push(source);
            }
            Err(error) => {
                self.complete = false;
                let place = Place { source: file.clone(), span: error.span };
                let diagnostic = self.report.error("scene::syntax", place, "", error.message);
                if let Some(span) = error.opened {
                    let opened = Place { source: file, span };
                    diagnostic.related.push((opened, "opened here".to_owned()));
                }
            }
        }
    }

    fn read_includes(&mut self, source: &Source) {
        let Some(include) = source.cursor().field("include") else { return };
        let Some(_): Option<Vec<String>> = decode::decode(&include, &mut self.report) else {
            self.complete = false;
            return;
        };
        for entry in include.entries() {
            let name = outline::unquoted(entry.text());
            let dir = source.dir.as_deref();
            let read =
                files::find(&name, dir, self.options, MAX_SCENE_BYTES, &mut self.report.hints)
                    .and_then(|path| {
                        let unreadable =
                            |source| FileError::Unreadable { name: name.clone(), source };
                        let bytes = std::fs::read(&path).map_err(unreadable)?;
                        Ok((path, bytes))
                    });
            match read {
                Ok((path, bytes)) => self.include(&entry, &name, path, bytes),
                Err(error) => {
                    self.complete = false;
                    self.report.at(error.code(), &entry, error.to_string()).help = error.help();
                }
            }
        }
    }

    /// Reads an included file, unless it has been read; a file that includes itself is an error.
    fn include(&mut self, entry: &Cursor, name: &str, path: PathBuf, bytes: Vec<u8>) {
        if self.open.contains(&path) || self.root.as_ref() == Some(&path) {
            self.report.at("scene::include", entry, format!("`{name}` includes itself"));
            self.complete = false;
        } else if self.open.len() >= MAX_INCLUDE_DEPTH {
            let message =
                format!("files include each other deeper than {MAX_INCLUDE_DEPTH} levels");
            self.report.at("scene::include", entry, message);
            self.complete = false;
        } else if !self.files.contains(&path) {
            self.files.push(path.clone());
            self.open.push(path.clone());
            // Shown as seen from the including file, if that is where it was found.
            let shown = Path::new(&entry.source.file.name).with_file_name(name);
            let beside = shown.canonicalize().is_ok_and(|beside| beside == path);
            let shown = if beside { shown } else { path.clone() };
            self.read_bytes(&shown.display().to_string(), name, bytes, path.parent());
            self.open.pop();
        }
    }

    fn finish(mut self) -> Result<SceneDescription, Diagnostics> {
        if self.sources.is_empty() {
            return Err(self.report.found);
        }
        for (path, value) in &self.options.overrides {
            // What is set under these two shows in the settings and the clock themselves.
            if !["render.", "clock."].iter().any(|prefix| path.starts_with(prefix)) {
                self.hash.add(path, value.as_bytes());
            }
            overrides::apply(&mut self.sources, path, value, &mut self.report);
        }
        if let Some(camera) = &self.options.camera {
            self.hash.add("--camera", camera.as_bytes());
        }
        assemble::assemble(
            &self.sources,
            self.complete,
            self.options,
            (self.files, self.hash),
            self.report,
        )
    }
}
