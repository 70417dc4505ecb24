//! Grids of numbers in space: the `.vol` files of Mitsuba (Jakob 2010 and later, plugin `gridvolume`).
//!
//! ```text
//! bytes   contents, little-endian
//! 0–2     `VOL`
//! 3       version, 3
//! 4–7     encoding: 1 for f32, 3 for u8 (255 is 1)
//! 8–19    cells along x, y and z
//! 20–23   channels
//! 24–47   the box: least x, y, z, greatest x, y, z as f32
//! 48–     values: channels next to each other, then x, then y, then z
//! ```

use super::{AssetError, ask_for, read_file, too_large};
use crate::description::GridData;
use glam::Vec3;
use std::path::Path;

/// Greatest number of values in a grid.
pub const MAX_GRID_VALUES: u64 = 1 << 29;
/// Bytes before the values.
const HEADER: usize = 48;

/// Reads a grid of numbers in space: one number of each cell, or three.
///
/// # Errors
/// When the file cannot be read, is malformed or cut off, exceeds a limit of this module, or holds a number which is
/// negative or not finite.
pub fn load_grid(path: &Path) -> Result<GridData, AssetError> {
    parse(&read_file(path)?, path)
}

fn parse(bytes: &[u8], path: &Path) -> Result<GridData, AssetError> {
    let wrong = |message: String| AssetError::Grid { path: path.to_owned(), message };
    let Some((header, values)) = bytes.split_at_checked(HEADER).filter(|(h, _)| &h[..3] == b"VOL")
    else {
        return Err(AssetError::UnknownFormat {
            path: path.to_owned(),
            found: "not a grid".to_owned(),
            expected: "a grid: a file `.vol` of version 3 as Mitsuba reads them",
        });
    };
    if header[3] != 3 {
        return Err(wrong(format!("this is version {} of the format, expected 3", header[3])));
    }
    let word = |at: usize| -> [u8; 4] { header[at..at + 4].try_into().expect("four bytes") };
    let integer = |at: usize| i32::from_le_bytes(word(at));
    let real = |at: usize| f32::from_le_bytes(word(at));
    let (size, channels) = ([integer(8), integer(12), integer(16)], integer(20));
    if size.iter().any(|&cells| cells < 1) || !matches!(channels, 1 | 3) {
        let [x, y, z] = size;
        return Err(wrong(format!(
            "it has {x} × {y} × {z} cells of {channels} channels, expected at least one cell and 1 or 3 channels"
        )));
    }
    let size = size.map(|cells| cells as u32);
    // At most 2^31 each: three of them and three channels are fewer than 2^128.
    let count = size.iter().map(|&cells| u128::from(cells)).product::<u128>() * channels as u128;
    if count > u128::from(MAX_GRID_VALUES) {
        return Err(too_large(path, format!("{count} values"), MAX_GRID_VALUES));
    }
    let count = count as usize;
    let encoding = integer(4);
    let width = match encoding {
        1 => 4,
        3 => 1,
        _ => {
            return Err(wrong(format!(
                "its values have the encoding {encoding}, expected 1 (f32) or 3 (u8)"
            )));
        }
    };
    if values.len() < count * width {
        let (found, expected) = (values.len(), count * width);
        return Err(wrong(format!(
            "it is cut off: its values take {found} bytes, expected {expected}"
        )));
    }
    ask_for(path, 4 * count as u64)?;
    let values: Vec<f32> = if width == 1 {
        values[..count].iter().map(|&code| f32::from(code) / 255.0).collect()
    } else {
        let words = values[..4 * count].chunks_exact(4);
        words.map(|word| f32::from_le_bytes(word.try_into().expect("four bytes"))).collect()
    };
    if let Some(place) = values.iter().position(|value| !(value.is_finite() && *value >= 0.0)) {
        let cell = place / channels as usize;
        let [x, y, _] = size.map(|cells| cells as usize);
        let place = (cell % x, cell / x % y, cell / (x * y));
        let value = values[cell * channels as usize];
        return Err(wrong(format!(
            "cell {place:?} holds {value}, expected finite numbers from 0 on"
        )));
    }
    let corner = |at: usize| Vec3::new(real(at), real(at + 4), real(at + 8));
    let (min, max) = (corner(24), corner(36));
    if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
        return Err(wrong(format!("its box goes from {min} to {max}, expected one with a volume")));
    }
    Ok(GridData { size, channels: channels as u32, values, bounds: (min, max) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of 2 × 1 × 2 cells.
    fn file(encoding: i32, channels: i32, values: &[u8]) -> Vec<u8> {
        let mut bytes = b"VOL\x03".to_vec();
        for word in [encoding, 2, 1, 2, channels] {
            bytes.extend(word.to_le_bytes());
        }
        for corner in [-1.0_f32, -2.0, -3.0, 1.0, 2.0, 3.0] {
            bytes.extend(corner.to_le_bytes());
        }
        bytes.extend(values);
        bytes
    }

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    #[test]
    fn both_encodings_are_read() {
        let grid = parse(&file(1, 1, &floats(&[0.0, 1.5, 2.0, 7.0])), Path::new("a.vol")).unwrap();
        assert_eq!((grid.size, grid.channels), ([2, 1, 2], 1));
        assert_eq!(grid.values, [0.0, 1.5, 2.0, 7.0]);
        assert_eq!(grid.bounds, (Vec3::new(-1.0, -2.0, -3.0), Vec3::new(1.0, 2.0, 3.0)));
        let grid = parse(&file(3, 1, &[0, 51, 255, 102]), Path::new("a.vol")).unwrap();
        assert_eq!(grid.values, [0.0, 0.2, 1.0, 0.4]);
        let grid = parse(&file(3, 3, &[255; 12]), Path::new("a.vol")).unwrap();
        assert_eq!(grid.values.len(), 12);
    }

    /// Each mistake is told; nothing is taken that is not there.
    #[test]
    fn malformed_grids_are_refused_in_words() {
        let sound = file(1, 1, &floats(&[0.0, 1.5, 2.0, 7.0]));
        let with = |at: usize, word: [u8; 4]| {
            let mut bytes = sound.clone();
            bytes[at..at + 4].copy_from_slice(&word);
            bytes
        };
        let huge = i32::MAX.to_le_bytes();
        for (bytes, expected) in [
            (b"P6".to_vec(), "not a grid"),
            (sound[..40].to_vec(), "not a grid"),
            (sound[..60].to_vec(), "cut off"),
            (with(0, *b"VOL\x02"), "version 2"),
            (with(4, 2_i32.to_le_bytes()), "encoding 2"),
            (with(8, 0_i32.to_le_bytes()), "0 × 1 × 2 cells"),
            (with(8, huge), "too large"),
            (with(20, 4_i32.to_le_bytes()), "4 channels"),
            (with(36, f32::NAN.to_le_bytes()), "box"),
            (with(24, 2.0_f32.to_le_bytes()), "box"),
            (with(56, (-1.0_f32).to_le_bytes()), "cell (0, 0, 1) holds -1"),
            (with(52, f32::INFINITY.to_le_bytes()), "cell (1, 0, 0) holds inf"),
        ] {
            let error = parse(&bytes, Path::new("smoke.vol")).unwrap_err().to_string();
            assert!(error.contains("smoke.vol") && error.contains(expected), "{error}");
        }
    }
}
