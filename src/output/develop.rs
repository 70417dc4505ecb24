//! The developed picture: exposure, tone curve, 8-bit sRGB codes.

use super::{OutputError, write_atomically};
use crate::color::{exposure_factor, srgb, tone};
use crate::description::{RenderSettings, Rgb, ToneMap};
use crate::film::Film;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;
use std::path::Path;

/// Turns linear radiance into 8-bit sRGB codes.
///
/// `exposure` is in stops. Only here is anything clipped. A colour outside of the gamut, as a spectrum may have, has
/// white added until no channel is negative: hues keep their order.
pub fn develop(radiance: Rgb, exposure: f32, tonemap: ToneMap) -> [u8; 3] {
    let shown = radiance - radiance.min_element().min(0.0);
    let exposed = shown * exposure_factor(exposure);
    let to_codes = |linear: Rgb| linear.to_array().map(srgb::encode_u8);
    match tonemap {
        ToneMap::Srgb => to_codes(exposed),
        ToneMap::Aces => to_codes(tone::aces(exposed)),
        ToneMap::Reinhard => to_codes(tone::reinhard(exposed)),
        ToneMap::Agx => tone::agx(exposed).to_array().map(|c| srgb::quantize_u8(f64::from(c))),
    }
}

/// Writes the developed picture of a film as an 8-bit PNG.
///
/// # Errors
/// When the file cannot be written.
pub fn write_png(path: &Path, film: &Film, settings: &RenderSettings) -> Result<(), OutputError> {
    let (width, height) = film.size();
    let row = |y| {
        (0..width)
            .flat_map(move |x| develop(film.radiance(x, y), settings.exposure, settings.tonemap))
    };
    let codes: Vec<u8> = (0..height).into_par_iter().flat_map_iter(row).collect();
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(&codes, width, height, ExtendedColorType::Rgb8)
        .map_err(|source| OutputError::Png { path: path.to_owned(), source })?;
    write_atomically(path, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PixelSample;

    #[test]
    fn exposure_and_curve_are_applied_before_the_codes() {
        assert_eq!(develop(Rgb::splat(0.18), 0.0, ToneMap::Srgb), [118; 3]);
        assert_eq!(develop(Rgb::splat(0.045), 2.0, ToneMap::Srgb), [118; 3]);
        assert_eq!(develop(Rgb::new(-0.25, 0.25, 0.0), 0.0, ToneMap::Srgb), [0, 188, 137]);
        assert_eq!(develop(Rgb::new(5.0, 1.0, 0.0), 0.0, ToneMap::Srgb), [255, 255, 0]);
        assert_eq!(develop(Rgb::splat(0.18), 0.0, ToneMap::Agx), [128; 3]);
        assert_eq!(develop(Rgb::ONE, 0.0, ToneMap::Reinhard), [188; 3]); // 255·encode(0.5) = 187.5
        assert_eq!(develop(Rgb::ONE, 0.0, ToneMap::Aces), [232; 3]); // 255·encode(0.8038) = 231.6
    }

    #[test]
    fn a_png_holds_the_codes_of_its_pixels() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("ramp.png");
        let mut film = Film::new((256, 2), &[]).expect("small");
        for tile in film.tiles() {
            let mut buffer = film.tile_buffer(tile);
            for y in tile.y0..tile.y1 {
                for x in tile.x0..tile.x1 {
                    let radiance = Rgb::new(srgb::decode_u8(x as u8), 0.0, y as f32);
                    buffer.add(x, y, &PixelSample { radiance, first_hit: None });
                }
            }
            film.merge(buffer);
        }
        write_png(&path, &film, &RenderSettings::default()).expect("writable");
        let picture = image::open(&path).expect("just written").into_rgb8();
        assert_eq!(picture.dimensions(), (256, 2));
        for (x, y, pixel) in picture.enumerate_pixels() {
            assert_eq!(pixel.0, [x as u8, 0, y as u8 * 255]);
        }
    }
}
