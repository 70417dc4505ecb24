//! An image with smaller copies of itself, each half as large as the one before.
//!
//! Williams 1983, "Pyramidal Parametrics", SIGGRAPH 83. A texel of a level is the mean of linear light
//! over the area that it covers of the level below, also where sides are odd. Levels have the format of the image:
//! a pyramid takes a third more memory.

use super::image::texel;
use crate::color::srgb::encode_u8;
use crate::description::{Encoding, ImageData, ImagePixels};
use glam::Vec4;
use rayon::prelude::*;
use std::sync::Arc;

/// An image and its levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    /// The image as it was read.
    pub base: Arc<ImageData>,
    /// From half its size down to one texel; empty where filtering does not need them.
    levels: Vec<ImageData>,
}

impl Pyramid {
    /// The pyramid of an image, or the image alone.
    pub fn new(base: Arc<ImageData>, with_levels: bool) -> Self {
        let mut levels: Vec<ImageData> = Vec::new();
        if with_levels {
            let mut last = &*base;
            while last.width > 1 || last.height > 1 {
                levels.push(halved(last));
                last = &levels[levels.len() - 1];
            }
        }
        Self { base, levels }
    }

    /// The level `index`; 0 is the image itself.
    #[inline]
    pub(super) fn level(&self, index: usize) -> &ImageData {
        if index == 0 { &self.base } else { &self.levels[index - 1] }
    }

    /// How many levels there are, the image included.
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.levels.len() + 1
    }

    /// Whether there are all levels.
    pub(super) fn has_levels(&self) -> bool {
        !self.levels.is_empty() || (self.base.width <= 1 && self.base.height <= 1)
    }

    /// Bytes of the levels, without the image.
    pub fn memory(&self) -> usize {
        self.levels.iter().map(ImageData::memory).sum()
    }
}

/// The texels of a row of `n` that texel `i` of `m` covers, and their weights, of sum 1.
fn covered(i: u32, m: u32, n: u32) -> impl Iterator<Item = (u32, f32)> + Clone {
    let (i, m, n) = (u64::from(i), u64::from(m), u64::from(n));
    // In units of 1/m of a texel everything is whole.
    let (begin, end) = (i * n, (i + 1) * n);
    (begin / m..end.div_ceil(m)).map(move |k| {
        let overlap = end.min((k + 1) * m) - begin.max(k * m);
        (k as u32, overlap as f32 / n as f32)
    })
}

fn halved(image: &ImageData) -> ImageData {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let mean = |column: u32, row: u32| {
        let mut sum = Vec4::ZERO;
        for (y, by_row) in covered(row, height, image.height) {
            for (x, by_column) in covered(column, width, image.width) {
                sum += texel(image, x, y) * (by_row * by_column);
            }
        }
        sum
    };
    let rows = (0..height).into_par_iter();
    let pixels = match &image.pixels {
        ImagePixels::Rgba8(_, encoding) => {
            let row = |row| (0..width).map(move |column| encoded(mean(column, row), *encoding));
            ImagePixels::Rgba8(rows.flat_map_iter(row).collect(), *encoding)
        }
        ImagePixels::Rgba32F(_) => {
            let row = |row| (0..width).map(move |column| mean(column, row).to_array());
            ImagePixels::Rgba32F(rows.flat_map_iter(row).collect())
        }
    };
    ImageData { width, height, pixels }
}

/// The nearest codes of a linear colour with coverage.
fn encoded(texel: Vec4, encoding: Encoding) -> [u8; 4] {
    let linear = |v: f32| (v * 255.0).round() as u8;
    let code = match encoding {
        Encoding::Linear => linear,
        Encoding::Srgb => encode_u8,
    };
    [code(texel.x), code(texel.y), code(texel.z), linear(texel.w)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(width: u32, height: u32, f: impl Fn(u32, u32) -> f32) -> ImageData {
        let at = |k: u32| f(k % width, k / width);
        let pixels = (0..width * height).map(|k| [at(k), at(k), at(k), 1.0]).collect();
        ImageData { width, height, pixels: ImagePixels::Rgba32F(pixels) }
    }

    /// Oracle: the mean of the image, which every level keeps, odd sides included; the last is one texel.
    #[test]
    fn every_level_keeps_the_mean() {
        for (width, height) in [(1, 1), (8, 8), (7, 5), (1, 9), (100, 3)] {
            let image = gray(width, height, |x, y| (x * 7 + y * 13) as f32 % 11.0);
            let mean = super::super::image::average(&image).x;
            let pyramid = Pyramid::new(Arc::new(image), true);
            for level in 0..pyramid.len() {
                let at = super::super::image::average(pyramid.level(level)).x;
                assert!((at - mean).abs() < 1e-5 * mean.max(1.0), "{width} × {height}, {level}");
            }
            let last = pyramid.level(pyramid.len() - 1);
            assert_eq!((last.width, last.height), (1, 1));
        }
    }

    /// Half black, half white in linear light is 0.5, whose sRGB code is 188 and not 128.
    #[test]
    fn codes_are_averaged_as_light() {
        let codes = vec![[0, 0, 0, 255], [255, 255, 255, 255]];
        let pixels = ImagePixels::Rgba8(codes, Encoding::Srgb);
        let pyramid = Pyramid::new(Arc::new(ImageData { width: 2, height: 1, pixels }), true);
        let ImagePixels::Rgba8(codes, _) = &pyramid.level(1).pixels else { panic!("same format") };
        assert_eq!(codes, &[[188, 188, 188, 255]]);
    }

    #[test]
    fn without_levels_there_is_only_the_image() {
        let pyramid = Pyramid::new(Arc::new(gray(8, 8, |_, _| 0.5)), false);
        assert_eq!((pyramid.len(), pyramid.memory()), (1, 0));
        assert!(!pyramid.has_levels());
    }
}
