//! Reads the files that a scene names: images, grids and triangle meshes.
//!
//! - [`image`](load_image): PNG, JPEG, Radiance HDR, OpenEXR; known by their contents, not by name;
//! - [`grid`](load_grid): numbers in space, `.vol`;
//! - `obj`: Wavefront OBJ; `polygon` cuts its faces into triangles;
//! - `gltf`: the geometry of glTF 2.0, as `.gltf` or `.glb`; `accessor` reads its numbers,
//!   `gather` puts its parts together;
//! - `tidy`: what every mesh must hold before a renderer may trust it.
//!
//! Any bytes may stand in a file. Whatever they are, the answer is a sound value or an
//! [`AssetError`], within the limits below; never a panic.

mod accessor;
mod gather;
mod gltf;
mod grid;
mod image;
mod obj;
mod polygon;
mod tidy;

pub use grid::{MAX_GRID_VALUES, load_grid};
pub use image::load_image;

use super::TriangleMesh;
use crate::memory::{self, Shortage};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Largest file that is read, in bytes. Larger ones are refused before any memory is taken.
pub const MAX_FILE_BYTES: u64 = 2 << 30;

/// Greatest width and height of an image, in pixels.
pub const MAX_IMAGE_SIDE: u32 = 1 << 15;

/// Greatest memory of a decoded image, in bytes.
pub const MAX_IMAGE_BYTES: u64 = 2 << 30;

/// Greatest number of triangles, and of vertices, in one mesh. Instances do not count: this bounds
/// the memory that a small file can ask for by naming its geometry many times.
pub const MAX_MESH_ELEMENTS: usize = 1 << 26;

/// Why a file that a scene names could not be used. Messages are whole: they end with their cause.
#[expect(missing_docs, reason = "each message names its fields")]
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    #[error("cannot read `{path}`: {cause}", path = .path.display())]
    Read { path: PathBuf, cause: io::Error },
    #[error(
        "`{path}` is too large: {found}, where at most {limit} are allowed",
        path = .path.display()
    )]
    TooLarge { path: PathBuf, found: String, limit: String },
    #[error(
        "`{path}` is {found}; expected {expected}",
        path = .path.display()
    )]
    UnknownFormat { path: PathBuf, found: String, expected: &'static str },
    #[error(
        "`{path}` is not a sound image, or is cut off: {cause}",
        path = .path.display()
    )]
    Image { path: PathBuf, cause: ::image::ImageError },
    #[error(
        "`{path}` is not a sound OpenEXR file: {cause}",
        path = .path.display()
    )]
    Exr { path: PathBuf, cause: exr::error::Error },
    #[error(
        "`{path}` has the channels {found}; expected R, G and B, or a single one, which is grey: write the layer that \
         is meant to a file of its own",
        path = .path.display()
    )]
    Channels { path: PathBuf, found: String },
    #[error(
        "`{path}` is {width} × {height} pixels; expected at least 1 × 1",
        path = .path.display()
    )]
    NoPixels { path: PathBuf, width: u64, height: u64 },
    #[error(
        "`{path}` holds {found} in column {column} of row {row}, counted from the top left from 0, and {count} of its {of} \
         pixels are not finite; expected finite numbers: repair it in the program that wrote it",
        path = .path.display()
    )]
    Pixel { path: PathBuf, found: String, column: usize, row: usize, count: usize, of: usize },
    #[error("`{path}` is not a sound grid: {message}", path = .path.display())]
    Grid { path: PathBuf, message: String },
    #[error("`{path}`, line {line}: {message}", path = .path.display())]
    Obj { path: PathBuf, line: usize, message: String },
    #[error("`{path}`: {message}", path = .path.display())]
    Mesh { path: PathBuf, message: String },
    #[error("`{path}` is too large for this machine: {cause}", path = .path.display())]
    Memory { path: PathBuf, cause: Shortage },
    #[error(
        "`{path}` names the buffer `{uri}`, which is not a file beside it: \
         use a relative path without `..`, or embed the buffer",
        path = .path.display()
    )]
    OutsideFile { path: PathBuf, uri: String },
}

/// Reads a triangle mesh, in the units of the file (taken as metres).
///
/// The ending of the name tells the format: `.obj`, `.gltf` or `.glb`. All parts of the file become
/// one mesh; materials, skins and morph targets are not read.
///
/// * Vertex normals have unit length; one which is missing, zero or not finite in a mesh that has
///   normals is replaced by the normal of the face. A mesh without any normals stays without.
/// * `v` grows upwards: glTF, where it grows downwards, is flipped.
/// * Tangents are read from glTF; one of a vertex whose normal was replaced is left out.
/// * Triangles of zero area are dropped, and vertices that no triangle uses.
///
/// What was read otherwise than it is written is put into words in `remarks`.
///
/// # Errors
/// When the file cannot be read, is malformed, holds positions or texture coordinates which are not
/// finite, exceeds a limit of this module, or has no triangle of positive area.
pub fn load_mesh(path: &Path, remarks: &mut Vec<String>) -> Result<TriangleMesh, AssetError> {
    match mesh_format(path)? {
        MeshFormat::Obj => {
            let mesh = obj::parse(&read_file(path)?, path, remarks)?;
            tidy::tidy(mesh, path)
        }
        MeshFormat::Gltf => {
            let mesh = gltf::Asset::open(path)?.triangles()?;
            tidy::tidy(mesh, path)
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MeshFormat {
    Obj,
    Gltf,
}

fn mesh_format(path: &Path) -> Result<MeshFormat, AssetError> {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("obj") => Ok(MeshFormat::Obj),
        Some("gltf" | "glb") => Ok(MeshFormat::Gltf),
        other => Err(AssetError::UnknownFormat {
            path: path.to_owned(),
            found: other.map_or_else(
                || "a file without an ending".to_owned(),
                |ending| format!("a file with the ending `.{ending}`"),
            ),
            expected: "a mesh: `.obj`, `.gltf` or `.glb`",
        }),
    }
}

/// Reads a whole file of at most [`MAX_FILE_BYTES`].
fn read_file(path: &Path) -> Result<Vec<u8>, AssetError> {
    let failed = |cause| AssetError::Read { path: path.to_owned(), cause };
    // Asked before it is opened: opening a pipe waits for somebody to write into it, and a device may never end.
    let metadata = path.metadata().map_err(failed)?;
    if !metadata.is_file() {
        return Err(failed(io::Error::other("it is not a regular file")));
    }
    ask_for(path, metadata.len())?;
    let file = File::open(path).map_err(failed)?;
    if metadata.len() > MAX_FILE_BYTES {
        return Err(too_large(path, format!("{} bytes", metadata.len()), MAX_FILE_BYTES));
    }
    let mut bytes = Vec::new();
    // A file may grow meanwhile: the reader is limited as well.
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(too_large(path, "more bytes than it said".to_owned(), MAX_FILE_BYTES));
    }
    Ok(bytes)
}

/// Whether there is memory for so many bytes, before they are taken.
fn ask_for(path: &Path, bytes: u64) -> Result<(), AssetError> {
    memory::ask(bytes).map_err(|cause| AssetError::Memory { path: path.to_owned(), cause })
}

fn too_large(path: &Path, found: String, limit: impl ToString) -> AssetError {
    AssetError::TooLarge { path: path.to_owned(), found, limit: limit.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Encoding;

    #[test]
    fn a_missing_file_and_an_unknown_ending_are_named_in_the_error() {
        let error = load_mesh(Path::new("nowhere/rabbit.obj"), &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("rabbit.obj"), "{error}");
        let error = load_mesh(Path::new("rabbit.stl"), &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("`.stl`") && error.to_string().contains("`.glb`"));
        let error = load_image(Path::new("nowhere/wood.png"), Encoding::Srgb).unwrap_err();
        assert!(error.to_string().contains("wood.png"), "{error}");
    }

    #[test]
    fn a_folder_is_not_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let error = read_file(folder.path()).expect_err("it is none").to_string();
        assert!(error.contains("not a regular file"), "{error}");
    }

    /// The program would wait for ever for somebody to write into a pipe.
    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.bin");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo is there").success());
        let scene = folder.path().join("m.gltf");
        std::fs::write(
            &scene,
            r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 9, "uri": "pipe.bin"}]}"#,
        )
        .unwrap();
        let errors = [
            read_file(&pipe).map(drop),
            read_file(Path::new("/dev/zero")).map(drop),
            load_mesh(&scene, &mut Vec::new()).map(drop),
            load_image(&pipe, Encoding::Srgb).map(drop),
            load_grid(&pipe).map(drop),
        ];
        for error in errors {
            let error = error.expect_err("it is no file").to_string();
            assert!(error.contains("not a regular file"), "{error}");
        }
    }
}
