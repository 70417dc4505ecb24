//! The checksum of an EXR file, over every byte of it.
//!
//! Most of a file is compressed numbers, and a changed bit in them may well decode, to another picture. XXH3-128 over the
//! whole file finds it, faster than decoding does; there is no adversary, so no cryptography. The checksum stands in the
//! file itself, in the facts of its first header, and counts as zeros in its own sum.

use std::ops::Range;
use xxhash_rust::xxh3::Xxh3;

/// Stands where the checksum will: 128 bits in hexadecimal digits.
pub(super) const BLANK: &str = "00000000000000000000000000000000";

/// What stands before it. In names the quotes have backslashes, and a header comes before all pixels: the first such
/// bytes of a file are ours.
const MARK: &[u8] = b"\"checksum\":\"";

/// Puts the checksum in the place of the blank.
///
/// # Panics
/// If there is no place for it.
pub(super) fn seal(file: &mut [u8]) {
    let place = place(file).expect("the facts begin with it");
    let digits = digits(file, &place);
    file[place].copy_from_slice(digits.as_bytes());
}

/// Whether the file is, to the bit, as it was sealed.
pub(super) fn is_sealed(file: &[u8]) -> bool {
    place(file).is_some_and(|place| file[place.clone()] == *digits(file, &place).as_bytes())
}

fn place(file: &[u8]) -> Option<Range<usize>> {
    let start = file.windows(MARK.len()).position(|bytes| bytes == MARK)? + MARK.len();
    Some(start..start + BLANK.len()).filter(|place| place.end <= file.len())
}

fn digits(file: &[u8], place: &Range<usize>) -> String {
    let mut sum = Xxh3::new();
    for bytes in [&file[..place.start], BLANK.as_bytes(), &file[place.end..]] {
        sum.update(bytes);
    }
    format!("{:032x}", sum.digest128())
}
