//! Which frames are done already.

use super::{Fingerprint, FrameFiles, read_metadata};
use image::{ImageReader, Limits};
use std::path::Path;

/// Whether the files of a frame are whole and hold what would be rendered now.
///
/// Yes only if the EXR file carries the same fingerprint and all its pixels decode, and the PNG decodes
/// to a picture of the same size. Anything else, from a missing file to one cut short, means that the
/// frame is rendered again.
pub fn frame_is_complete(folder: &Path, name: &str, frame: u32, fingerprint: Fingerprint) -> bool {
    let files = FrameFiles::new(folder, name, frame);
    let same =
        matches!(read_metadata(&files.exr), Ok(Some(found)) if found.fingerprint == fingerprint);
    same && exr_size(&files.exr).is_some_and(|size| png_size(&files.png, size) == Some(size))
}

/// Decodes every pixel of an EXR file and returns its size.
fn exr_size(path: &Path) -> Option<(u32, u32)> {
    let image = exr::prelude::read_all_flat_layers_from_file(path).ok()?;
    let size = image.layer_data.first()?.size;
    Some((u32::try_from(size.0).ok()?, u32::try_from(size.1).ok()?))
}

/// Decodes every pixel of a PNG file no larger than `limit` and returns its size.
fn png_size(path: &Path, limit: (u32, u32)) -> Option<(u32, u32)> {
    let mut reader = ImageReader::open(path).ok()?.with_guessed_format().ok()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(limit.0);
    limits.max_image_height = Some(limit.1);
    limits.max_alloc = None; // the size says it already
    reader.limits(limits);
    let picture = reader.decode().ok()?;
    Some((picture.width(), picture.height()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::RenderSettings;
    use crate::output::exr_file::tests::{film, metadata};
    use crate::output::{write_exr, write_png};
    use std::fs;

    fn write_frame(folder: &Path) -> FrameFiles {
        let files = FrameFiles::new(folder, "a", 12);
        let settings = RenderSettings::default();
        let film = film(&[0.1, 0.2, 0.3], &settings.layers);
        write_exr(&files.exr, &film, &settings, &metadata(5)).expect("writable");
        write_png(&files.png, &film, &settings).expect("writable");
        files
    }

    #[test]
    fn only_a_whole_frame_with_the_same_fingerprint_is_complete() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let complete =
            |fingerprint| frame_is_complete(folder.path(), "a", 12, Fingerprint(fingerprint));
        assert!(!complete(5));
        let files = write_frame(folder.path());
        assert!(complete(5));
        assert!(!complete(6));
        assert!(!frame_is_complete(folder.path(), "a", 13, Fingerprint(5)));
        fs::remove_file(&files.png).expect("was written");
        assert!(!complete(5));
    }

    #[test]
    fn a_frame_cut_at_any_byte_is_not_complete() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let files = write_frame(folder.path());
        for path in [&files.exr, &files.png] {
            let whole = fs::read(path).expect("was written");
            for length in (0..whole.len()).step_by(whole.len() / 40 + 1).chain([whole.len() - 1]) {
                fs::write(path, &whole[..length]).expect("writable");
                let complete = frame_is_complete(folder.path(), "a", 12, Fingerprint(5));
                // A PNG's last chunk (12 bytes) says only that it ends.
                let only_end_missing = path == &files.png && length + 12 >= whole.len();
                assert!(!complete || only_end_missing, "{} cut at {length}", path.display());
            }
            fs::write(path, &whole).expect("writable");
        }
        assert!(frame_is_complete(folder.path(), "a", 12, Fingerprint(5)));
    }
}
