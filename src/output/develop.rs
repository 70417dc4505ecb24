//! The developed picture: exposure, tone curve, 8-bit sRGB codes.
//!
//! A PNG says that it is sRGB, how it was developed, and from which frame: one text chunk `kinora` holds
//! a JSON object of [`PngFacts`]. So a run can tell whether a picture is as it would be developed now.

use super::picture::Picture;
use super::{Fingerprint, FrameMetadata, OutputError, SOFTWARE, read_metadata, write_atomically};
use crate::color::{exposure_factor, srgb, tone};
use crate::description::{Development, RenderSettings, Rgb, ToneMap};
use crate::film::Film;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// The text chunk with our facts.
const KEYWORD: &str = "kinora";

/// What a PNG tells about itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PngFacts {
    /// That of the EXR from which it was developed, if that has one.
    pub fingerprint: Option<Fingerprint>,
    /// How it was developed.
    #[serde(flatten)]
    pub development: Development,
}

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

/// Writes the developed picture of a film as an 8-bit PNG: what [`develop_exr`] would make of its EXR.
///
/// # Errors
/// When the file cannot be written.
pub fn write_png(
    path: &Path,
    film: &Film,
    settings: &RenderSettings,
    metadata: &FrameMetadata,
) -> Result<(), OutputError> {
    let (fingerprint, development) = (Some(metadata.fingerprint), settings.development());
    write_picture(path, &Picture::of_film(film, settings), PngFacts { fingerprint, development })
}

/// Writes the PNG of a frame anew, from its EXR.
///
/// # Errors
/// When the EXR cannot be read or has no colours, or when the PNG cannot be written.
pub fn develop_exr(exr: &Path, png: &Path, development: Development) -> Result<(), OutputError> {
    let picture = Picture::read(exr)?;
    let metadata =
        read_metadata(exr).map_err(|source| OutputError::Read { path: exr.to_owned(), source })?;
    let fingerprint = metadata.map(|metadata| metadata.fingerprint);
    write_picture(png, &picture, PngFacts { fingerprint, development })
}

fn write_picture(path: &Path, picture: &Picture, facts: PngFacts) -> Result<(), OutputError> {
    let Development { exposure, tonemap } = facts.development;
    let pixels = picture.radiance.par_iter();
    let codes: Vec<u8> = match &picture.alpha {
        None => pixels.flat_map_iter(|&light| develop(light, exposure, tonemap)).collect(),
        Some(alpha) => pixels
            .zip(alpha)
            .flat_map_iter(|(&light, &alpha)| {
                let [r, g, b] = develop(straight(light, alpha), exposure, tonemap);
                [r, g, b, srgb::quantize_u8(f64::from(alpha))]
            })
            .collect(),
    };
    let facts = serde_json::to_string(&facts).map_err(|source| OutputError::Json { source })?;
    let color = if picture.alpha.is_some() { png::ColorType::Rgba } else { png::ColorType::Rgb };
    let bytes = encode(picture.size, color, &codes, facts)
        .map_err(|source| OutputError::Png { path: path.to_owned(), source })?;
    write_atomically(path, &bytes)
}

/// The colour of what covers a pixel, as a PNG holds it (PNG, 3rd ed., section 6.2: alpha is not premultiplied).
/// Light of what covers nothing, such as a glow without a body, has no place there.
fn straight(light: Rgb, alpha: f32) -> Rgb {
    if alpha > 0.0 { light / alpha } else { Rgb::ZERO }
}

fn encode(
    (width, height): (u32, u32),
    color: png::ColorType,
    codes: &[u8],
    facts: String,
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_filter(png::Filter::Adaptive);
    // The tone curve has fitted the picture to the screen already: whatever is still out of its gamut is
    // to be clipped alone.
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.add_text_chunk("Software".to_owned(), SOFTWARE.to_owned())?;
    encoder.add_text_chunk(KEYWORD.to_owned(), facts)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(codes)?;
    writer.finish()?;
    Ok(bytes)
}

/// Reads what a PNG tells about itself; `None` where the file cannot be read or is not ours.
pub fn read_png_facts(path: &Path) -> Option<PngFacts> {
    let reader = png::Decoder::new(BufReader::new(File::open(path).ok()?)).read_info().ok()?;
    let mut texts = reader.info().uncompressed_latin1_text.iter();
    let text = &texts.find(|chunk| chunk.keyword == KEYWORD)?.text;
    serde_json::from_str(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Background;
    use crate::film::PixelSample;
    use crate::output::exr_file::tests::metadata;
    use crate::output::write_exr;

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

    /// Two rows over all codes of red.
    fn ramp() -> Film {
        let mut film = Film::new((256, 2), &[]).expect("small");
        for tile in film.tiles() {
            let mut buffer = film.tile_buffer(tile);
            for y in tile.y0..tile.y1 {
                for x in tile.x0..tile.x1 {
                    let radiance = Rgb::new(srgb::decode_u8(x as u8), 0.0, y as f32);
                    let sample = PixelSample { radiance, ..PixelSample::default() };
                    buffer.add(x, y, &sample);
                }
            }
            film.merge(buffer);
        }
        film
    }

    #[test]
    fn a_png_holds_the_codes_of_its_pixels() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("ramp.png");
        write_png(&path, &ramp(), &RenderSettings::default(), &metadata(5)).expect("writable");
        let picture = image::open(&path).expect("just written").into_rgb8();
        assert_eq!(picture.dimensions(), (256, 2));
        for (x, y, pixel) in picture.enumerate_pixels() {
            assert_eq!(pixel.0, [x as u8, 0, y as u8 * 255]);
        }
    }

    /// By hand: half of a pixel is covered with radiance 0.5, premultiplied 0.25.
    #[test]
    fn a_png_holds_straight_alpha() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let (exr, png) = (folder.path().join("a.exr"), folder.path().join("a.png"));
        let settings = RenderSettings {
            size: (2, 1),
            background: Background::Transparent,
            ..Default::default()
        };
        let mut film = Film::for_settings(&settings).expect("small");
        let mut buffer = film.tile_buffer(film.tiles()[0]);
        let covered = PixelSample { radiance: Rgb::splat(0.5), ..PixelSample::default() };
        let empty = PixelSample { transmittance: 1.0, ..PixelSample::default() };
        buffer.add(0, 0, &covered);
        buffer.add(0, 0, &empty);
        buffer.add(1, 0, &empty);
        film.merge(buffer);
        write_png(&png, &film, &settings, &metadata(5)).expect("writable");
        let picture = image::open(&png).expect("just written").into_rgba8();
        assert_eq!(picture.into_raw(), [188, 188, 188, 128, 0, 0, 0, 0]);
        let rendered = std::fs::read(&png).expect("just written");
        write_exr(&exr, &film, &settings, &metadata(5)).expect("writable");
        let linear = Picture::read(&exr).expect("just written");
        assert_eq!(linear.radiance, [Rgb::splat(0.25), Rgb::ZERO]);
        assert_eq!(linear.alpha, Some(vec![0.5, 0.0]));
        develop_exr(&exr, &png, settings.development()).expect("writable");
        assert!(std::fs::read(&png).expect("just written") == rendered, "to the byte");
    }

    /// The chunk `sRGB` (PNG, 3rd ed., section 11.3.2.5) holds one byte, the intent.
    #[test]
    fn a_png_says_that_it_is_srgb_and_how_it_was_developed() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("ramp.png");
        let settings =
            RenderSettings { exposure: -1.5, tonemap: ToneMap::Agx, ..Default::default() };
        write_png(&path, &ramp(), &settings, &metadata(5)).expect("writable");
        let bytes = std::fs::read(&path).expect("just written");
        assert!(bytes.windows(9).any(|part| part == b"\0\0\0\x01sRGB\x01"));
        let fingerprint = Some(Fingerprint(5));
        let development = settings.development();
        assert_eq!(read_png_facts(&path), Some(PngFacts { fingerprint, development }));
        std::fs::write(&path, &bytes[..60]).expect("writable");
        assert_eq!(read_png_facts(&path), None);
    }
}
