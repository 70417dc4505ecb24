//! Textures: values which vary over a surface, as functions of uv.
//!
//! `u` runs to the right and `v` **up**: `(0, 0)` is the lower left corner of an image and the row at its
//! top is at `v = 1`. Colours are linear Rec. 709; lookups interpolate linear light.

mod checker;
mod image;

use crate::description::{ImageData, Rgb, Texture};
use glam::Vec2;
use std::sync::Arc;

/// A texture as a frame uses it, its pixels shared.
pub type RenderTexture = Texture<Arc<ImageData>>;

/// Rec. 709 luminance of a linear colour (Rec. ITU-R BT.709-6, item 3.2, rounded weights).
#[inline]
pub(crate) fn luminance(color: Rgb) -> f32 {
    color.dot(Rgb::new(0.2126, 0.7152, 0.0722))
}

/// The colour of a texture at `uv`.
#[inline]
pub fn color(texture: &RenderTexture, uv: Vec2) -> Rgb {
    match texture {
        Texture::Image { file, wrap, filter, repeat, offset, .. } => {
            image::lookup(file, *wrap, *filter, image::place(uv, *repeat, *offset)).truncate()
        }
        Texture::Checker { size, a, b } => checker::color(uv, *size, *a, *b),
    }
}

/// The number which a texture holds at `uv`: the chosen channel of an image, the luminance of a pattern.
#[inline]
pub fn scalar(texture: &RenderTexture, uv: Vec2) -> f32 {
    match texture {
        Texture::Image { file, wrap, filter, repeat, offset, channel, .. } => {
            let texel = image::lookup(file, *wrap, *filter, image::place(uv, *repeat, *offset));
            image::channel(texel, *channel)
        }
        Texture::Checker { size, a, b } => luminance(checker::color(uv, *size, *a, *b)),
    }
}

/// Mean colour of a texture over its period: for the power of a textured light.
pub fn average(texture: &RenderTexture) -> Rgb {
    match texture {
        Texture::Image { file, .. } => image::average(file),
        Texture::Checker { a, b, .. } => 0.5 * (*a + *b),
    }
}
