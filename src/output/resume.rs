//! Which frames are done already.

use super::{Fingerprint, FrameFiles, PngFacts, read_metadata, read_png_facts};
use crate::description::Development;
use image::{ImageReader, Limits};
use std::path::Path;

/// What is on disk of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameState {
    /// It is to be rendered: there is no whole EXR file of what would be rendered now.
    Missing,
    /// The EXR file is right, the PNG is missing, broken, or developed otherwise.
    Undeveloped,
    /// Both files are as they would be written now.
    Complete,
}

/// What is on disk of a frame, compared with what would be rendered and developed now.
///
/// An EXR file is right only if it carries the same fingerprint and all its pixels decode; a PNG if it decodes to
/// a picture of the same size and says that it was developed from this frame in this way.
pub fn frame_state(
    files: &FrameFiles,
    fingerprint: Fingerprint,
    development: Development,
) -> FrameState {
    let same =
        matches!(read_metadata(&files.exr), Ok(Some(found)) if found.fingerprint == fingerprint);
    let Some(size) = same.then(|| exr_size(&files.exr)).flatten() else {
        return FrameState::Missing;
    };
    let facts = PngFacts { fingerprint: Some(fingerprint), development };
    let developed =
        read_png_facts(&files.png) == Some(facts) && png_size(&files.png, size) == Some(size);
    if developed { FrameState::Complete } else { FrameState::Undeveloped }
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
    use crate::description::{RenderSettings, ToneMap};
    use crate::output::exr_file::tests::{film, metadata};
    use crate::output::{develop_exr, write_exr, write_png};
    use std::fs;

    fn write_frame(folder: &Path) -> FrameFiles {
        let files = FrameFiles::new(folder, "a", 12);
        let settings = RenderSettings::default();
        let film = film(&[0.1, 0.2, 0.3], &settings.layers);
        write_exr(&files.exr, &film, &settings, &metadata(5)).expect("writable");
        write_png(&files.png, &film, &settings, &metadata(5)).expect("writable");
        files
    }

    fn state(files: &FrameFiles, fingerprint: u128) -> FrameState {
        frame_state(files, Fingerprint(fingerprint), Development::default())
    }

    #[test]
    fn only_a_whole_frame_with_the_same_fingerprint_is_complete() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let files = FrameFiles::new(folder.path(), "a", 12);
        assert_eq!(state(&files, 5), FrameState::Missing);
        write_frame(folder.path());
        assert_eq!(state(&files, 5), FrameState::Complete);
        assert_eq!(state(&files, 6), FrameState::Missing);
        let next = FrameFiles::new(folder.path(), "a", 13);
        assert_eq!(state(&next, 5), FrameState::Missing);
        fs::remove_file(&files.png).expect("was written");
        assert_eq!(state(&files, 5), FrameState::Undeveloped);
    }

    /// A PNG from before, as a run leaves it that is killed between its two files, and one that is
    /// developed otherwise.
    #[test]
    fn a_png_of_another_frame_or_another_curve_is_developed_again() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let files = write_frame(folder.path());
        let first = fs::read(&files.png).expect("was written");
        let settings = RenderSettings::default();
        let film = film(&[0.3, 0.2, 0.1], &settings.layers);
        write_exr(&files.exr, &film, &settings, &metadata(6)).expect("writable");
        assert_eq!(state(&files, 6), FrameState::Undeveloped);

        write_frame(folder.path());
        let agx = Development { tonemap: ToneMap::Agx, ..Development::default() };
        develop_exr(&files.exr, &files.png, agx).expect("writable");
        assert_eq!(state(&files, 5), FrameState::Undeveloped);
        assert_eq!(frame_state(&files, Fingerprint(5), agx), FrameState::Complete);
        assert_ne!(fs::read(&files.png).expect("was written"), first);
        develop_exr(&files.exr, &files.png, Development::default()).expect("writable");
        assert_eq!(fs::read(&files.png).expect("was written"), first, "to the byte");
    }

    #[test]
    fn a_frame_cut_at_any_byte_is_not_complete() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let files = write_frame(folder.path());
        for (path, cut) in
            [(&files.exr, FrameState::Missing), (&files.png, FrameState::Undeveloped)]
        {
            let whole = fs::read(path).expect("was written");
            for length in (0..whole.len()).step_by(whole.len() / 40 + 1).chain([whole.len() - 1]) {
                fs::write(path, &whole[..length]).expect("writable");
                // A PNG's last chunk (12 bytes) says only that it ends.
                let only_end_missing = path == &files.png && length + 12 >= whole.len();
                let found = state(&files, 5);
                assert!(found == cut || only_end_missing, "{} cut at {length}", path.display());
            }
            fs::write(path, &whole).expect("writable");
        }
        assert_eq!(state(&files, 5), FrameState::Complete);
    }
}
