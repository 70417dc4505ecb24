//! Images: PNG, JPEG, Radiance HDR and OpenEXR to [`ImageData`].

use super::{AssetError, MAX_IMAGE_BYTES, MAX_IMAGE_SIDE, ask_for, read_file, too_large};
use crate::description::{Encoding, ImageData, ImagePixels};
use exr::meta::attribute::Text;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

/// The first bytes of every OpenEXR file.
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Reads an image; row 0 is the top.
///
/// * 8-bit PNG and JPEG keep their codes, to be decoded by `encoding` at lookup.
/// * 16-bit PNG is decoded to linear `f32` by `encoding` here.
/// * A PNG or JPEG that says how the camera was held (the EXIF tag `Orientation`) is turned upright.
/// * Radiance HDR and OpenEXR hold linear `f32`, whatever `encoding` says. Of an OpenEXR file the
///   first part with the channels R, G and B is read, or else the first with one channel, as grey, and its A (1 where
///   there is none); its data window is the picture.
///
/// Colours are taken as they are in Rec. 709 primaries: profiles and chromaticities are not read.
///
/// # Errors
/// When the file cannot be read, is of another format, malformed, cut off, without pixels or larger than
/// [`MAX_IMAGE_SIDE`] or [`MAX_IMAGE_BYTES`] allow, or holds numbers which are not finite.
pub fn load_image(path: &Path, encoding: Encoding) -> Result<ImageData, AssetError> {
    parse(&read_file(path)?, encoding, path)
}

fn parse(bytes: &[u8], encoding: Encoding, path: &Path) -> Result<ImageData, AssetError> {
    let image = if bytes.starts_with(&EXR_MAGIC) {
        read_exr(bytes, path)?
    } else {
        decode(bytes, encoding, path)?
    };
    check_numbers(&image, path)?;
    Ok(image)
}

/// Refuses pixels which are not finite: their mean, of which distant surfaces show much, would be none either.
fn check_numbers(image: &ImageData, path: &Path) -> Result<(), AssetError> {
    let ImagePixels::Rgba32F(pixels) = &image.pixels else { return Ok(()) };
    let wrong = |pixel: &[f32; 4]| pixel.iter().any(|value| !value.is_finite());
    let Some(first) = pixels.iter().position(wrong) else { return Ok(()) };
    let [r, g, b, a] = pixels[first];
    let width = image.width as usize;
    Err(AssetError::Pixel {
        path: path.to_owned(),
        found: format!("({r}, {g}, {b}, {a})"),
        column: first % width,
        row: first / width,
        count: pixels.iter().filter(|pixel| wrong(pixel)).count(),
        of: pixels.len(),
    })
}

/// Decodes everything but OpenEXR.
fn decode(bytes: &[u8], encoding: Encoding, path: &Path) -> Result<ImageData, AssetError> {
    let failed = |cause| AssetError::Image { path: path.to_owned(), cause };
    let bytes = without_packed_texts(bytes);
    let mut reader = ImageReader::new(Cursor::new(&bytes[..]))
        .with_guessed_format()
        .map_err(|cause| AssetError::Read { path: path.to_owned(), cause })?;
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Hdr)) {
        return Err(AssetError::UnknownFormat {
            path: path.to_owned(),
            found: if bytes.is_empty() { "empty" } else { "of an unknown format" }.to_owned(),
            expected: "an image: PNG, JPEG, Radiance HDR or OpenEXR",
        });
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_IMAGE_BYTES);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    check_size(width.into(), height.into(), path)?;
    // What is no sound tag says nothing.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut image = DynamicImage::from_decoder(decoder).map_err(failed)?;
    image.apply_orientation(orientation);
    let (width, height) = (image.width(), image.height());
    Ok(ImageData { width, height, pixels: pixels(image, encoding) })
}

/// A PNG without what is packed in it beside the pixels: a colour profile and texts, which are not read. A few
/// kilobytes of them can unpack to gigabytes.
fn without_packed_texts(bytes: &[u8]) -> Cow<'_, [u8]> {
    const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
    let (mut kept, mut at) = (Vec::new(), SIGNATURE.len());
    if !bytes.starts_with(SIGNATURE) {
        return Cow::Borrowed(bytes);
    }
    // Each chunk: its length, its kind, as many bytes, a checksum (PNG specification, section 5.3).
    while let Some(head) = bytes.get(at..at + 8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let end = at.saturating_add(length).saturating_add(12).min(bytes.len());
        if matches!(&head[4..], b"iCCP" | b"zTXt" | b"iTXt") {
            if kept.is_empty() {
                kept.extend_from_slice(&bytes[..at]);
            }
        } else if !kept.is_empty() {
            kept.extend_from_slice(&bytes[at..end]);
        }
        at = end;
    }
    if kept.is_empty() { Cow::Borrowed(bytes) } else { Cow::Owned(kept) }
}

/// The pixels in the smallest storage that keeps their precision.
fn pixels(image: DynamicImage, encoding: Encoding) -> ImagePixels {
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            ImagePixels::Rgba32F(image.into_rgba32f().pixels().map(|p| p.0).collect())
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let linear = |code: u16| {
                let value = f64::from(code) / f64::from(u16::MAX);
                match encoding {
                    Encoding::Srgb => srgb_to_linear(value) as f32,
                    Encoding::Linear => value as f32,
                }
            };
            let decode = |[r, g, b, a]: [u16; 4]| {
                // Coverage is never encoded.
                [linear(r), linear(g), linear(b), f32::from(a) / f32::from(u16::MAX)]
            };
            ImagePixels::Rgba32F(image.into_rgba16().pixels().map(|p| decode(p.0)).collect())
        }
        _ => ImagePixels::Rgba8(image.into_rgba8().pixels().map(|p| p.0).collect(), encoding),
    }
}

/// The sRGB curve (IEC 61966-2-1), from code to linear, both in `[0, 1]`.
fn srgb_to_linear(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// Refuses images that are too large or have no pixels, by their header: before their pixels are allocated.
fn check_size(width: u64, height: u64, path: &Path) -> Result<(), AssetError> {
    if width == 0 || height == 0 {
        return Err(AssetError::NoPixels { path: path.to_owned(), width, height });
    }
    let side = u64::from(MAX_IMAGE_SIDE);
    let bytes = width.saturating_mul(height).saturating_mul(size_of::<[f32; 4]>() as u64);
    if width > side || height > side || bytes > MAX_IMAGE_BYTES {
        let limit = format!("{side} pixels on a side and {MAX_IMAGE_BYTES} bytes decoded");
        return Err(too_large(path, format!("{width} × {height} pixels"), limit));
    }
    // At most four numbers of 32 bits of a pixel, and what the decoder holds of it meanwhile.
    ask_for(path, 2 * bytes)
}

fn read_exr(bytes: &[u8], path: &Path) -> Result<ImageData, AssetError> {
    let failed = |cause| AssetError::Exr { path: path.to_owned(), cause };
    // Metadata alone first, so that a forged size is refused before memory is taken for it.
    let metadata =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    for header in &metadata.headers {
        check_size(header.layer_size.0 as u64, header.layer_size.1 as u64, path)?;
    }
    // Colour, or else one number for each pixel, which is grey.
    let names: Vec<Vec<&Text>> = metadata
        .headers
        .iter()
        .map(|header| header.channels.list.iter().map(|channel| &channel.name).collect())
        .collect();
    let is_colour =
        |part: &Vec<&Text>| ["R", "G", "B"].iter().all(|c| part.iter().any(|n| Text::eq(n, c)));
    let alone = |part: &Vec<&Text>| {
        let mut others = part.iter().filter(|name| !Text::eq(name, "A"));
        others.next().filter(|_| others.next().is_none()).map(|name| (*name).clone())
    };
    let found = if names.iter().any(is_colour) {
        read_exr_part(bytes, ["R", "G", "B"].map(Text::from))
    } else if let Some(channel) = names.iter().find_map(alone) {
        read_exr_channel(bytes, channel)
    } else {
        let list =
            |part: &Vec<&Text>| part.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>();
        let found = names.iter().map(|part| list(part).join(", ")).collect::<Vec<_>>().join("; ");
        return Err(AssetError::Channels { path: path.to_owned(), found });
    };
    found.map_err(failed)
}

/// The first part with these channels.
fn read_exr_part(bytes: &[u8], [r, g, b]: [Text; 3]) -> exr::error::Result<ImageData> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(r)
        .required(g)
        .required(b)
        .optional("A", 1.0)
        .collect_pixels(blank, |(width, pixels), at, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.1 * *width + at.0] = [r, g, b, a];
        })
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    Ok(of_floats(image.layer_data.size, image.layer_data.channel_data.pixels))
}

/// The first part with this channel, as grey.
fn read_exr_channel(bytes: &[u8], channel: Text) -> exr::error::Result<ImageData> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(channel)
        .optional("A", 1.0)
        .collect_pixels(blank, |(width, pixels), at, (v, a): (f32, f32)| {
            pixels[at.1 * *width + at.0] = [v, v, v, a];
        })
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    Ok(of_floats(image.layer_data.size, image.layer_data.channel_data.pixels))
}

/// Its width and the pixels of a part before they are read.
fn blank<Channels>(size: exr::math::Vec2<usize>, _: &Channels) -> (usize, Vec<[f32; 4]>) {
    (size.0, vec![[0.0; 4]; size.0 * size.1])
}

fn of_floats(size: exr::math::Vec2<usize>, pixels: (usize, Vec<[f32; 4]>)) -> ImageData {
    let (width, height) = (size.0 as u32, size.1 as u32);
    ImageData { width, height, pixels: ImagePixels::Rgba32F(pixels.1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType, ImageBuffer, ImageEncoder, Rgb, Rgba};
    use std::path::PathBuf;
    use tempfile::TempDir;

    fn in_folder(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    /// Oracle: the same picture without the profile, and that the profile is gone. A profile that unpacks to gigabytes is
    /// not unpacked.
    #[test]
    fn packed_profiles_are_left_out_unread() {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.set_icc_profile(vec![7; 1 << 20]).expect("PNG has profiles");
        encoder.write_image(&[10, 20, 30], 1, 1, ExtendedColorType::Rgb8).expect("it is small");
        let find = |bytes: &[u8]| bytes.windows(4).any(|kind| kind == b"iCCP");
        assert!(find(&bytes) && !find(&without_packed_texts(&bytes)));
        let image = parse(&bytes, Encoding::Srgb, Path::new("a.png")).expect("it is sound");
        assert_eq!(image.pixels, ImagePixels::Rgba8(vec![[10, 20, 30, 255]], Encoding::Srgb));
        // Cut off anywhere it is an error, and never a panic.
        for end in 0..bytes.len().min(200) {
            assert!(parse(&bytes[..end], Encoding::Srgb, Path::new("a.png")).is_err());
        }
    }

    fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Vec::new();
        image.into().write_to(&mut Cursor::new(&mut bytes), format).unwrap();
        bytes
    }

    fn small_png() -> Vec<u8> {
        let image = ImageBuffer::from_fn(3, 2, |x, y| Rgba([x as u8 * 80, y as u8 * 200, 7, 9]));
        encoded(image, ImageFormat::Png)
    }

    fn small_exr() -> Vec<u8> {
        use exr::prelude::{Image, SpecificChannels, WritableImage};
        let mut bytes = Vec::new();
        let pixel = |at: exr::math::Vec2<usize>| (at.0 as f32, at.1 as f32 + 0.5, 1e6_f32);
        Image::from_channels((3, 2), SpecificChannels::rgb(pixel))
            .write()
            .to_buffered(Cursor::new(&mut bytes))
            .unwrap();
        bytes
    }

    /// Oracle: the codes that were written, top row first.
    #[test]
    fn eight_bit_codes_are_kept_and_row_0_is_the_top() {
        let (_folder, path) = in_folder("codes.png", &small_png());
        let image = load_image(&path, Encoding::Linear).unwrap();
        assert_eq!((image.width, image.height), (3, 2));
        let ImagePixels::Rgba8(codes, Encoding::Linear) = image.pixels else {
            panic!("8-bit codes and their encoding")
        };
        assert_eq!(codes[..4], [[0, 0, 7, 9], [80, 0, 7, 9], [160, 0, 7, 9], [0, 200, 7, 9]]);
    }

    /// Oracle: published values of the sRGB curve: 0.4613561 is the code of 0.18, 0.7353570 of ½.
    #[test]
    fn sixteen_bit_codes_become_linear_by_their_encoding() {
        let code = |x: f64| (x * 65535.0).round() as u16;
        let texel = [code(0.461_356_1), code(0.735_357), code(0.040_449_9), code(0.25)];
        let image = ImageBuffer::from_fn(1, 1, |_, _| Rgba(texel));
        let (_folder, path) = in_folder("deep.png", &encoded(image, ImageFormat::Png));
        for (encoding, expected) in [
            (Encoding::Srgb, [0.18, 0.5, 0.003_130_8, 0.25]),
            (Encoding::Linear, [0.461_356_1, 0.735_357, 0.040_449_9, 0.25]),
        ] {
            let ImagePixels::Rgba32F(pixels) = load_image(&path, encoding).unwrap().pixels else {
                panic!("16-bit codes need floats")
            };
            for (found, expected) in pixels[0].iter().zip(expected) {
                // Half a 16-bit code, times the greatest slope of the curve (2.28).
                assert!(
                    (found - expected).abs() < 2.28 * 0.5 / 65535.0 + 1e-7,
                    "{found} {expected}"
                );
            }
        }
    }

    /// Oracle: RGBE keeps 8 bits of mantissa, so powers of two are exact.
    #[test]
    fn radiance_hdr_is_linear_and_unbounded() {
        let image = ImageBuffer::from_fn(2, 1, |x, _| Rgb([64.0 + 64.0 * x as f32, 64.0, 64.0]));
        let (_folder, path) = in_folder("sky.hdr", &encoded(image, ImageFormat::Hdr));
        let ImagePixels::Rgba32F(pixels) = load_image(&path, Encoding::Srgb).unwrap().pixels else {
            panic!("floats")
        };
        assert_eq!(pixels, [[64.0, 64.0, 64.0, 1.0], [128.0, 64.0, 64.0, 1.0]]);
    }

    #[test]
    fn exr_is_read_exactly_and_without_alpha_it_is_opaque() {
        let (_folder, path) = in_folder("sky.exr", &small_exr());
        let image = load_image(&path, Encoding::Srgb).unwrap();
        let ImagePixels::Rgba32F(pixels) = image.pixels else { panic!("floats") };
        assert_eq!((image.width, image.height), (3, 2));
        assert_eq!(pixels[1].map(f32::to_bits), [1.0, 0.5, 1e6, 1.0].map(f32::to_bits));
        assert_eq!(pixels[5].map(f32::to_bits), [2.0, 1.5, 1e6, 1.0].map(f32::to_bits));
    }

    /// Oracle: the numbers that were written. One channel of any name is grey, with or without coverage; of several that
    /// are no colours all are told.
    #[test]
    fn exr_of_one_channel_is_grey() {
        use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage};
        let written = |names: &[&str]| {
            let channel = |(k, name): (usize, &&str)| {
                let samples = (0..6).map(|i| (10 * k + i) as f32 / 8.0).collect();
                AnyChannel::new(*name, FlatSamples::F32(samples))
            };
            let list: SmallVec<[_; 4]> = names.iter().enumerate().map(channel).collect();
            let mut bytes = Vec::new();
            Image::from_channels((3, 2), AnyChannels::sort(list))
                .write()
                .to_buffered(Cursor::new(&mut bytes))
                .unwrap();
            parse(&bytes, Encoding::Srgb, Path::new("one.exr"))
        };
        for name in ["Y", "R", "Z", "height"] {
            let image = written(&[name]).unwrap();
            let ImagePixels::Rgba32F(pixels) = image.pixels else { panic!("floats") };
            assert_eq!((image.width, image.height), (3, 2));
            assert_eq!(pixels[5], [0.625, 0.625, 0.625, 1.0], "{name}");
        }
        let ImagePixels::Rgba32F(pixels) = written(&["Y", "A"]).unwrap().pixels else {
            panic!("floats")
        };
        assert_eq!(pixels[1], [0.125, 0.125, 0.125, 1.375]);
        let told = written(&["diffuse.R", "Z"]).unwrap_err().to_string();
        assert!(told.contains("`Z`") && told.contains("`diffuse.R`"), "{told}");
    }

    /// An EXIF block with one tag, the orientation of the picture: TIFF 6.0, big-endian.
    fn exif(orientation: u8) -> Vec<u8> {
        let mut tiff = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
        tiff.extend([orientation, 0, 0, 0, 0, 0, 0]);
        tiff
    }

    /// Oracle: Exif 2.32, section 4.6.4, table of `Orientation`: where row 0 and column 0 of what is stored belong. A
    /// picture of 24 × 16 whose lower left corner is white.
    #[test]
    fn pictures_are_turned_as_their_camera_was_held() {
        let stored = ImageBuffer::from_fn(24, 16, |x, y| {
            let white = x < 8 && y >= 8;
            Rgb([if white { 255_u8 } else { 0 }; 3])
        });
        let (left, top) = (true, true);
        let corners = [
            (1, (left, !top)),
            (2, (!left, !top)),
            (3, (!left, top)),
            (4, (left, top)),
            (5, (!left, top)),
            (6, (left, top)),
            (7, (left, !top)),
            (8, (!left, !top)),
            // No such number: as it is stored.
            (9, (left, !top)),
        ];
        for (orientation, (at_left, at_top)) in corners {
            let mut jpeg = encoded(stored.clone(), ImageFormat::Jpeg);
            let block = [&b"Exif\0\0"[..], &exif(orientation)].concat();
            let length = (block.len() as u16 + 2).to_be_bytes();
            jpeg.splice(2..2, [&[0xff, 0xe1][..], &length, &block].concat());
            let mut png = encoded(stored.clone(), ImageFormat::Png);
            let mut chunk = [&b"eXIf"[..], &exif(orientation)].concat();
            let crc = crc32(&chunk);
            chunk.splice(0..0, (chunk.len() as u32 - 4).to_be_bytes());
            chunk.extend(crc.to_be_bytes());
            // After the signature and the header.
            png.splice(33..33, chunk);
            for bytes in [jpeg, png] {
                let image = parse(&bytes, Encoding::Linear, Path::new("held")).unwrap();
                let (width, height) = (image.width as usize, image.height as usize);
                let on_its_side = (5..=8).contains(&orientation);
                assert_eq!((width, height), if on_its_side { (16, 24) } else { (24, 16) });
                let ImagePixels::Rgba8(codes, _) = image.pixels else { panic!("8 bits") };
                for (x, y) in [(3, 3), (width - 4, 3), (3, height - 4), (width - 4, height - 4)] {
                    let white = (x == 3) == at_left && (y == 3) == at_top;
                    assert_eq!(codes[y * width + x][0] > 127, white, "{orientation}: {x}, {y}");
                }
            }
        }
    }

    /// An image is known by its contents: a wrong ending does no harm.
    #[test]
    fn the_name_does_not_matter_and_other_formats_are_refused() {
        let (_folder, path) = in_folder("really_a_png.jpg", &small_png());
        assert!(load_image(&path, Encoding::Srgb).is_ok());
        for bytes in [&b""[..], b"GIF89a\x01\0\x01\0\0\0\0;", b"not an image at all"] {
            let (_folder, path) = in_folder("texture.png", bytes);
            let error = load_image(&path, Encoding::Srgb).unwrap_err();
            assert!(matches!(error, AssetError::UnknownFormat { .. }), "{error}");
        }
    }

    /// A PNG of a few bytes which says that it is of another size.
    fn forged_png(width: u32, height: u32) -> Vec<u8> {
        let mut png = small_png();
        png[16..20].copy_from_slice(&width.to_be_bytes());
        png[20..24].copy_from_slice(&height.to_be_bytes());
        let crc = crc32(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        png
    }

    /// A JPEG likewise: its frame header holds the size, height first.
    fn forged_jpeg(width: u16, height: u16) -> Vec<u8> {
        let image = ImageBuffer::from_fn(9, 9, |x, y| Rgb([x as u8, y as u8, 1]));
        let mut jpeg = encoded(image, ImageFormat::Jpeg);
        let frame = jpeg.windows(2).position(|bytes| bytes == [0xff, 0xc0]).unwrap();
        jpeg[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
        jpeg[frame + 7..frame + 9].copy_from_slice(&width.to_be_bytes());
        jpeg
    }

    fn forged_hdr(width: u32, height: u32) -> Vec<u8> {
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes()
    }

    /// An EXR likewise: the last corner of its data window, which is part of it.
    fn forged_exr(width: i32, height: i32) -> Vec<u8> {
        let mut exr = small_exr();
        let name = b"dataWindow\0box2i\0";
        let window = exr.windows(name.len()).position(|bytes| bytes == name).unwrap();
        let last = window + name.len() + 4 + 8;
        exr[last..last + 4].copy_from_slice(&(width - 1).to_le_bytes());
        exr[last + 4..last + 8].copy_from_slice(&(height - 1).to_le_bytes());
        exr
    }

    /// Files of a few bytes which say that they are huge. Whether memory is taken for them `tests/forged.rs` finds out;
    /// here, that the size is what is told of them.
    #[test]
    fn forged_sizes_are_refused_by_their_header() {
        let path = Path::new("forged");
        for (what, bytes) in [
            ("65535 × 65535", forged_png(65535, 65535)),
            ("65535 × 65535", forged_jpeg(65535, 65535)),
            ("65535 × 65535", forged_hdr(65535, 65535)),
            ("65535 × 65535", forged_exr(65535, 65535)),
            ("32769 × 1", forged_png(MAX_IMAGE_SIDE + 1, 1)),
            // Each side is allowed, but not all these pixels.
            ("32768 × 32768", forged_png(MAX_IMAGE_SIDE, MAX_IMAGE_SIDE)),
            ("32768 × 32768", forged_hdr(MAX_IMAGE_SIDE, MAX_IMAGE_SIDE)),
        ] {
            let error = parse(&bytes, Encoding::Srgb, path).unwrap_err();
            assert!(matches!(error, AssetError::TooLarge { .. }), "{what}: {error}");
            assert!(error.to_string().contains(what), "{what}: {error}");
        }
        for bytes in [forged_png(u32::MAX / 2, 7), forged_exr(i32::MAX, i32::MAX)] {
            assert!(parse(&bytes, Encoding::Srgb, path).is_err());
        }
    }

    #[test]
    fn images_without_pixels_are_refused() {
        let path = Path::new("empty");
        for bytes in [
            forged_png(1, 0),
            forged_png(0, 1),
            forged_jpeg(1, 0),
            forged_jpeg(0, 1),
            forged_hdr(1, 0),
            forged_hdr(0, 1),
            forged_exr(1, 0),
            forged_exr(0, 1),
        ] {
            assert!(parse(&bytes, Encoding::Srgb, path).is_err(), "{bytes:?}");
        }
        let error = parse(&forged_hdr(1, 0), Encoding::Srgb, path).unwrap_err().to_string();
        assert!(error.contains("1 × 0 pixels; expected at least 1 × 1"), "{error}");
    }

    /// An OpenEXR file can hold what is no number; the first is told with its place, and how many there are.
    #[test]
    fn pixels_which_are_not_finite_are_told_with_their_place() {
        use exr::prelude::{Image, SpecificChannels, WritableImage};
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let pixel = |at: exr::math::Vec2<usize>| {
                (0.25_f32, if at.1 == 1 && at.0 > 0 { wrong } else { 0.5 }, 1.0_f32)
            };
            let mut bytes = Vec::new();
            Image::from_channels((3, 2), SpecificChannels::rgb(pixel))
                .write()
                .to_buffered(Cursor::new(&mut bytes))
                .unwrap();
            let error = parse(&bytes, Encoding::Linear, Path::new("sky.exr")).unwrap_err();
            let error = error.to_string();
            let expected = format!("(0.25, {wrong}, 1, 1) in column 1 of row 1");
            assert!(error.contains(&expected) && error.contains("2 of its 6"), "{error}");
        }
    }

    /// CRC-32 of PNG, annex D, bit by bit.
    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
        })
    }

    /// Every cut and every changed byte gives an image or an error; a cut PNG or EXR is an error.
    #[test]
    fn cut_and_mutated_images_never_panic() {
        let hdr = encoded(
            ImageBuffer::from_fn(9, 2, |x, y| Rgb([x as f32, y as f32, 1.0])),
            ImageFormat::Hdr,
        );
        let jpeg = encoded(
            ImageBuffer::from_fn(9, 9, |x, y| Rgb([x as u8, y as u8, 1])),
            ImageFormat::Jpeg,
        );
        let path = Path::new("mutant");
        for (bytes, cut_is_error) in
            [(small_png(), true), (small_exr(), true), (hdr, false), (jpeg, false)]
        {
            for at in 0..bytes.len() {
                let cut = parse(&bytes[..at], Encoding::Srgb, path);
                // The last bytes of a PNG are its IEND chunk, without which all pixels are there.
                assert!(!cut_is_error || cut.is_err() || at + 12 >= bytes.len(), "cut at {at}");
                for flip in [0xff, 0x80, 0x01] {
                    let mut mutant = bytes.clone();
                    mutant[at] ^= flip;
                    let _ = parse(&mutant, Encoding::Srgb, path);
                }
            }
        }
    }
}
