//! Finding the files which a scene names, and nothing else.
//!
//! A name is looked for beside the scene file which uses it, then in `assets/` beside that file and
//! beside its folder, then in the asset folders of the job. What is found must, with all
//! links followed, lie inside one of these folders, unless the job allows more.

use super::LoadOptions;
use crate::description::diagnostic::Hints;
use std::path::{Path, PathBuf};

/// Greatest size of a scene file in bytes. Larger things belong into mesh and image files.
pub(super) const MAX_SCENE_BYTES: u64 = 8 << 20;

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum FileError {
    #[error("the file `{name}` does not exist")]
    Missing { name: String, near: Option<String> },
    #[error("the file `{name}` lies outside the folders which this scene may read")]
    Outside { name: String },
    #[error("`{name}` is not a regular file")]
    NotAFile { name: String },
    #[error("the file `{name}` has {bytes} bytes, more than the {limit} allowed")]
    TooLarge { name: String, bytes: u64, limit: u64 },
    #[error("the file `{name}` cannot be read: {source}")]
    Unreadable { name: String, source: std::io::Error },
}

impl FileError {
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "scene::missing-file",
            Self::Outside { .. } => "scene::outside",
            Self::NotAFile { .. } => "scene::not-a-file",
            Self::TooLarge { .. } => "scene::too-large",
            Self::Unreadable { .. } => "scene::unreadable",
        }
    }

    pub(super) fn help(&self) -> Option<String> {
        match self {
            Self::Missing { near: Some(near), .. } => Some(format!("did you mean `{near}`?")),
            Self::Missing { .. } => Some(
                "files are looked for beside the scene, in `assets/` beside it or beside its \
                 folder, and in the asset folders of the command line"
                    .to_owned(),
            ),
            Self::Outside { .. } => {
                Some("name its folder as an asset folder, or allow files from outside".to_owned())
            }
            _ => None,
        }
    }
}

/// The folders in which files named by a scene file in `dir` may lie, first choice first.
fn roots(dir: Option<&Path>, options: &LoadOptions) -> Vec<PathBuf> {
    let mut roots = Vec::new();
    if let Some(dir) = dir {
        roots.push(dir.to_owned());
        roots.push(dir.join("assets"));
        // `..` of a relative folder is found by the system, links included.
        roots.push(dir.join("..").join("assets"));
    }
    roots.extend(options.asset_dirs.iter().cloned());
    roots
}

/// Finds the file `name`, checks that it may be read and that it is small enough.
pub(super) fn find(
    name: &str,
    dir: Option<&Path>,
    options: &LoadOptions,
    limit: u64,
    hints: &mut Hints,
) -> Result<PathBuf, FileError> {
    let owned = || name.to_owned();
    if !options.allow_outside && Path::new(name).has_root() {
        return Err(FileError::Outside { name: owned() });
    }
    let roots = roots(dir, options);
    let inside: Vec<PathBuf> = roots.iter().filter_map(|root| root.canonicalize().ok()).collect();
    let mut outside = false;
    for root in &roots {
        let Ok(path) = root.join(name).canonicalize() else { continue };
        if options.allow_outside || inside.iter().any(|root| path.starts_with(root)) {
            check(name, &path, limit)?;
            return Ok(path);
        }
        outside = true;
    }
    if outside {
        return Err(FileError::Outside { name: owned() });
    }
    Err(FileError::Missing { name: owned(), near: near(name, &roots, hints) })
}

/// Checks that a path leads to a file of at most `limit` bytes.
pub(super) fn check(name: &str, path: &Path, limit: u64) -> Result<(), FileError> {
    let name = name.to_owned();
    match path.metadata() {
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => {
            Err(FileError::Missing { name, near: None })
        }
        Err(source) => Err(FileError::Unreadable { name, source }),
        Ok(about) if !about.is_file() => Err(FileError::NotAFile { name }),
        Ok(about) if about.len() > limit => {
            Err(FileError::TooLarge { name, bytes: about.len(), limit })
        }
        Ok(_) => Ok(()),
    }
}

/// A file in the folders whose name is like the one looked for.
fn near(name: &str, roots: &[PathBuf], hints: &mut Hints) -> Option<String> {
    let wanted = Path::new(name);
    let folder = wanted.parent().unwrap_or(Path::new(""));
    if folder.components().any(|part| part == std::path::Component::ParentDir) {
        return None;
    }
    // A folder of many thousands of files is not searched to its end for a hint.
    let names: Vec<String> = roots
        .iter()
        .filter_map(|root| root.join(folder).read_dir().ok())
        .flat_map(|entries| entries.take(4096).filter_map(Result::ok))
        .filter_map(|entry| folder.join(entry.file_name()).to_str().map(str::to_owned))
        .collect();
    hints.nearest(name, names.iter().map(String::as_str)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A project with a scene folder, assets beside it, and a secret outside.
    fn project() -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().expect("a temporary folder");
        let scenes = root.path().join("project/scenes");
        fs::create_dir_all(scenes.join("assets/deep")).expect("fresh folder");
        fs::create_dir_all(root.path().join("project/assets")).expect("fresh folder");
        for file in [
            "project/scenes/beside.png",
            "project/scenes/assets/below.png",
            "project/scenes/assets/deep/deep.png",
            "project/assets/shared.png",
            "secret.png",
        ] {
            fs::write(root.path().join(file), file).expect("writable");
        }
        (root, scenes)
    }

    fn found(name: &str, dir: &Path, options: &LoadOptions) -> Result<String, &'static str> {
        find(name, Some(dir), options, 100, &mut Hints::default())
            .map(|path| fs::read_to_string(path).expect("it was found"))
            .map_err(|error| error.code())
    }

    #[test]
    fn files_are_found_beside_the_scene_and_in_the_asset_folders() {
        let (root, scenes) = project();
        let options = LoadOptions::default();
        let ok = |file: &str| Ok(format!("project/{file}"));
        assert_eq!(found("beside.png", &scenes, &options), ok("scenes/beside.png"));
        assert_eq!(found("below.png", &scenes, &options), ok("scenes/assets/below.png"));
        assert_eq!(found("deep/deep.png", &scenes, &options), ok("scenes/assets/deep/deep.png"));
        assert_eq!(found("shared.png", &scenes, &options), ok("assets/shared.png"));
        assert_eq!(found("../assets/shared.png", &scenes, &options), ok("assets/shared.png"));
        assert_eq!(found("secret.png", &scenes, &options), Err("scene::missing-file"));
        let options = LoadOptions { asset_dirs: vec![root.path().into()], ..options };
        assert_eq!(found("secret.png", &scenes, &options), Ok("secret.png".into()));
    }

    #[test]
    fn files_outside_are_refused_unless_allowed() {
        let (root, scenes) = project();
        let secret = root.path().join("secret.png");
        let absolute = secret.to_str().expect("a plain name");
        #[cfg(unix)]
        std::os::unix::fs::symlink(&secret, scenes.join("link.png")).expect("a link");
        let names: &[&str] = if cfg!(unix) {
            &["../../secret.png", absolute, "link.png"]
        } else {
            &["../../secret.png", absolute]
        };
        let loose = LoadOptions { allow_outside: true, ..LoadOptions::default() };
        for name in names {
            assert_eq!(
                found(name, &scenes, &LoadOptions::default()),
                Err("scene::outside"),
                "{name}"
            );
            assert_eq!(found(name, &scenes, &loose), Ok("secret.png".into()), "{name}");
        }
        // Whether an absolute name exists is not told.
        let gone = found("/no/such/file.png", &scenes, &LoadOptions::default());
        assert_eq!(gone, Err("scene::outside"));
    }

    #[test]
    fn what_is_no_small_file_is_refused() {
        let (_root, scenes) = project();
        let options = LoadOptions::default();
        assert_eq!(found("assets", &scenes, &options), Err("scene::not-a-file"));
        assert_eq!(found("", &scenes, &options), Err("scene::not-a-file"));
        let too_large = find("beside.png", Some(&scenes), &options, 5, &mut Hints::default())
            .expect_err("25 bytes");
        assert_eq!(too_large.code(), "scene::too-large");
    }

    #[test]
    fn a_misspelt_file_is_told_with_the_one_that_was_meant() {
        let (_root, scenes) = project();
        let error =
            find("besid.png", Some(&scenes), &LoadOptions::default(), 100, &mut Hints::default());
        let help = error.expect_err("it is misspelt").help();
        assert_eq!(help.as_deref(), Some("did you mean `beside.png`?"));
    }
}
