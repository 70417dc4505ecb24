//! Which frames are done already.

use super::seal::is_sealed;
use super::{Fingerprint, FrameFiles, PngFacts, read_metadata, read_png_facts};
use crate::description::Development;
use exr::meta::MetaData;
use std::fs;
use std::io::Cursor;
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
/// An EXR file is right only if it carries the same fingerprint and the checksum of all its bytes; a PNG if it has the
/// same size and the checksums of all its chunks, and says that it was developed from this frame in this way. A single
/// bit that is another makes a file wrong.
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
    let developed = read_png_facts(&files.png) == Some(facts) && png_size(&files.png) == Some(size);
    if developed { FrameState::Complete } else { FrameState::Undeveloped }
}

/// The size of the picture in an EXR file that is as it was written.
fn exr_size(path: &Path) -> Option<(u32, u32)> {
    let bytes = fs::read(path).ok().filter(|bytes| is_sealed(bytes))?;
    let size =
        MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?.headers.first()?.layer_size;
    Some((u32::try_from(size.0).ok()?, u32::try_from(size.1).ok()?))
}

/// The size of the picture in a PNG file of which each chunk is as its checksum says, up to the last.
///
/// After eight fixed bytes come the chunks: a length, four letters, so many bytes, and the CRC-32 of letters and bytes (PNG,
/// 3rd ed., section 5.3). `IHDR` begins with width and height; after `IEND` comes nothing.
fn png_size(path: &Path) -> Option<(u32, u32)> {
    let bytes = fs::read(path).ok()?;
    let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    let mut size = None;
    loop {
        let (length, after) = rest.split_first_chunk()?;
        let (chunk, after) = after.split_at_checked(4 + u32::from_be_bytes(*length) as usize)?;
        let (sum, after) = after.split_first_chunk()?;
        if crc32(chunk) != u32::from_be_bytes(*sum) {
            return None;
        }
        let (letters, data) = chunk.split_first_chunk()?;
        match letters {
            b"IHDR" => {
                let (width, height) = (data.first_chunk()?, data.get(4..)?.first_chunk()?);
                size = Some((u32::from_be_bytes(*width), u32::from_be_bytes(*height)));
            }
            b"IEND" => return size.filter(|_| after.is_empty()),
            _ => {}
        }
        rest = after;
    }
}

/// The cyclic redundancy check of PNG (3rd ed., annex D).
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut i = 0;
        while i < 256 {
            let (mut remainder, mut bit) = (i as u32, 0);
            while bit < 8 {
                let carry = (remainder & 1) * 0xedb8_8320;
                remainder = (remainder >> 1) ^ carry;
                bit += 1;
            }
            table[i] = remainder;
            i += 1;
        }
        table
    };
    !bytes
        .iter()
        .fold(!0, |sum, &byte| TABLE[((sum ^ u32::from(byte)) & 0xff) as usize] ^ (sum >> 8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Layer, RenderSettings, ToneMap};
    use crate::output::exr_file::tests::{film, metadata};
    use crate::output::{develop_exr, write_exr, write_png};

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
                assert_eq!(state(&files, 5), cut, "{} cut at {length}", path.display());
            }
            fs::write(path, &whole).expect("writable");
        }
        assert_eq!(state(&files, 5), FrameState::Complete);
    }

    /// A flip within a name or a number may leave the file sound: only a checksum finds it.
    #[test]
    fn any_flipped_bit_of_any_byte_is_noticed() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let files = FrameFiles::new(folder.path(), "a", 12);
        let settings = RenderSettings { layers: Layer::ALL.to_vec(), ..Default::default() };
        let film = film(&[0.1, 0.2, 0.3], &settings.layers);
        write_exr(&files.exr, &film, &settings, &metadata(5)).expect("writable");
        write_png(&files.png, &film, &settings, &metadata(5)).expect("writable");
        let mut exr = fs::read(&files.exr).expect("was written");
        assert!(is_sealed(&exr));
        for i in 0..exr.len() {
            for bit in 0..8 {
                exr[i] ^= 1 << bit;
                assert!(!is_sealed(&exr), "bit {bit} of byte {i}");
                exr[i] ^= 1 << bit;
            }
        }
        for (path, flipped) in
            [(&files.exr, FrameState::Missing), (&files.png, FrameState::Undeveloped)]
        {
            let mut bytes = fs::read(path).expect("was written");
            for i in (0..bytes.len()).step_by(bytes.len() / 100 + 1).chain([bytes.len() - 1]) {
                bytes[i] ^= 1 << (i % 8);
                fs::write(path, &bytes).expect("writable");
                assert_eq!(state(&files, 5), flipped, "byte {i} of {}", path.display());
                bytes[i] ^= 1 << (i % 8);
            }
            fs::write(path, &bytes).expect("writable");
        }
        assert_eq!(state(&files, 5), FrameState::Complete);
    }

    /// The customary check of CRC-32, and the last four bytes of every PNG.
    #[test]
    fn the_cyclic_redundancy_check_is_that_of_png() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b"IEND"), 0xae42_6082);
    }
}
