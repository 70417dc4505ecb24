//! The linear picture from which the PNG is developed: the beauty as the EXR holds it.
//!
//! A PNG is a function of its EXR and of how it is to be developed, and of nothing else. So the picture
//! has the precision of the file also where it comes from the film.

use super::OutputError;
use crate::description::{Layer, RenderSettings, Rgb};
use crate::film::{Film, PlaneSamples};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, f16};
use std::path::Path;

/// Most pixels of a picture that is read: no scene asks for more.
const MOST_PIXELS: usize = 1 << 28;

/// Radiance, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Picture {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// One for each pixel.
    pub radiance: Vec<Rgb>,
    /// How much of each pixel is covered, where the background is transparent: radiance is premultiplied by it.
    pub alpha: Option<Vec<f32>>,
}

impl Picture {
    /// What [`write_exr`](super::write_exr) would write.
    pub fn of_film(film: &Film, settings: &RenderSettings) -> Self {
        let mut radiance = vec![Rgb::ZERO; film.window().area()];
        let mut alpha = None;
        for (channel, plane) in film.image(Layer::Beauty).into_iter().flatten().enumerate() {
            let PlaneSamples::F32(mut values) = plane.samples else { continue };
            if settings.exr_bits == 16 {
                for value in &mut values {
                    *value = to_half(*value).to_f32();
                }
            }
            if channel < 3 {
                let pixels = radiance.iter_mut().zip(values);
                pixels.for_each(|(pixel, value)| pixel[channel] = value);
            } else {
                alpha = Some(values);
            }
        }
        Self { size: film.window().size(), radiance, alpha }
    }

    /// Reads the first part of an EXR file that has colours.
    ///
    /// # Errors
    /// When there is none, or the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let failed = |source| OutputError::Read { path: path.to_owned(), source };
        // A forged size is refused before memory is taken for it.
        for header in MetaData::read_from_file(path, false).map_err(failed)?.headers {
            if header.layer_size.area() > MOST_PIXELS {
                let (width, height) = (header.layer_size.0, header.layer_size.1);
                return Err(OutputError::TooLarge { path: path.to_owned(), width, height });
            }
        }
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgba_channels(
                |size, (.., alpha)| {
                    let opaque = alpha.as_ref().map(|_| vec![1.0; size.area()]);
                    (size.0, vec![Rgb::ZERO; size.area()], opaque)
                },
                |(width, radiance, alpha), at, (r, g, b, a): (f32, f32, f32, f32)| {
                    let index = at.1 * *width + at.0;
                    radiance[index] = Rgb::new(r, g, b);
                    if let Some(alpha) = alpha {
                        alpha[index] = a;
                    }
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_file(path)
            .map_err(failed)?;
        let size = image.layer_data.size;
        let (_, radiance, alpha) = image.layer_data.channel_data.pixels;
        Ok(Self { size: (size.0 as u32, size.1 as u32), radiance, alpha })
    }
}

/// A number for a file of 16 bits; beyond its range the end of it.
pub(super) fn to_half(value: f32) -> f16 {
    let limit = f16::MAX.to_f32();
    f16::from_f32(value.clamp(-limit, limit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::exr_file::tests::{film, metadata};
    use crate::output::write_exr;

    #[test]
    fn a_file_gives_the_bits_of_its_film() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("f.exr");
        let film = film(&[0.0, 0.1, 1e30, 1e-30, 0.333], &[Layer::Albedo]);
        for exr_bits in [16, 32] {
            let settings =
                RenderSettings { exr_bits, layers: vec![Layer::Albedo], ..Default::default() };
            write_exr(&path, &film, &settings, &metadata(7)).expect("writable");
            let read = Picture::read(&path).expect("just written");
            assert_eq!(read, Picture::of_film(&film, &settings), "{exr_bits} bits");
        }
    }

    #[test]
    fn what_is_no_picture_is_an_error_with_its_name() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("f.exr");
        for bytes in [&b""[..], b"no EXR", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]] {
            std::fs::write(&path, bytes).expect("writable");
            let error = Picture::read(&path).expect_err("broken").to_string();
            assert!(error.contains("f.exr"), "{error}");
        }
    }
}
