//! From a film to files: EXR, PNG and the record of the run.
//!
//! A frame `n` of a run called `name` is `name.NNNN.exr` (linear, every layer asked for, with the
//! facts of the run in its header) and `name.NNNN.png` (developed: exposure, tone curve, sRGB). All files
//! appear whole or not at all, see [`write_atomically`]. `manifest.json` beside them tells what
//! happened, see [`Manifest`]. Whether a frame has to be rendered or developed again is answered by
//! [`frame_state`].

mod atomic;
mod claim;
mod develop;
mod exr_file;
mod fingerprint;
mod manifest;
mod memory;
mod picture;
mod record;
mod resume;
mod seal;

pub use atomic::{check_writable, write_atomically};
pub use develop::{PngFacts, develop, develop_exr, read_png_facts, write_png};
pub use exr_file::{FrameMetadata, read_metadata, write_exr};
pub use fingerprint::{Fingerprint, JobFingerprint};
pub use manifest::{FrameEntry, Manifest, RunFacts};
pub use memory::peak_memory_bytes;
pub use resume::{FrameState, frame_state};

use std::io;
use std::path::{Path, PathBuf};

/// Name and version of this software, as the files carry it.
pub const SOFTWARE: &str = concat!("kinora ", env!("CARGO_PKG_VERSION"));

/// The file in the output folder that records the run.
pub const MANIFEST_NAME: &str = "manifest.json";

/// Why a file could not be written, or not be read again.
#[expect(missing_docs, reason = "each message names its fields")]
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    #[error("cannot create the folder `{}`; choose another with --out", .folder.display())]
    Folder { folder: PathBuf, source: io::Error },
    #[error("cannot write into the folder `{}`; check its permissions and free space, or choose another with --out", .folder.display())]
    NotWritable { folder: PathBuf, source: io::Error },
    #[error("another render is at work in the folder `{}`: {}; wait for its end, or choose another folder with --out", .folder.display(), .by.escape_debug())]
    InUse { folder: PathBuf, by: String },
    #[error("cannot write `{}`; check the free space and the permissions of its folder", .path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("cannot encode `{}` as EXR", .path.display())]
    Exr { path: PathBuf, source: exr::error::Error },
    #[error("cannot encode `{}` as PNG", .path.display())]
    Png { path: PathBuf, source: png::EncodingError },
    #[error("cannot read a picture from `{}`", .path.display())]
    Read { path: PathBuf, source: exr::error::Error },
    #[error("`{}` says that it has {width} × {height} pixels, which is too large", .path.display())]
    TooLarge { path: PathBuf, width: usize, height: usize },
    #[error("cannot put the record of the run into JSON")]
    Json { source: serde_json::Error },
}

/// The files of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct FrameFiles {
    pub exr: PathBuf,
    pub png: PathBuf,
}

impl FrameFiles {
    /// Where frame `frame` of the run `name` belongs in `folder`: `name.0000.exr` and so on, with
    /// more digits only where four do not suffice, and a minus sign before them where the number is negative.
    pub fn new(folder: &Path, name: &str, frame: i32) -> Self {
        let (sign, number) = (if frame < 0 { "-" } else { "" }, frame.unsigned_abs());
        let file = |extension| folder.join(format!("{name}.{sign}{number:04}.{extension}"));
        Self { exr: file("exr"), png: file("png") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_with_at_least_four_digits() {
        let names = |frame| FrameFiles::new(Path::new("out"), "my.scene", frame).png;
        assert_eq!(names(7), Path::new("out/my.scene.0007.png"));
        assert_eq!(names(-7), Path::new("out/my.scene.-0007.png"));
        assert_eq!(names(123_456), Path::new("out/my.scene.123456.png"));
    }
}
