//! Textures, as a scene file says them.

use super::Rgb;
use glam::Vec2;
use serde::Deserialize;

/// A texture: a function of uv. `I` refers to an image: a path in a file, decoded data in a world.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Texture<I> {
    /// An image file.
    Image {
        /// Where the pixels come from.
        file: I,
        /// Whether 8- and 16-bit codes are sRGB colours (default) or linear data.
        #[serde(default)]
        encoding: Encoding,
        /// What lies outside the unit square.
        #[serde(default)]
        wrap: Wrap,
        /// Between the texels.
        #[serde(default)]
        filter: TextureFilter,
        /// Which channel counts where a single number is asked for.
        #[serde(default)]
        channel: Channel,
        /// How many times the image repeats over the unit square of uv.
        #[serde(default = "one_by_one")]
        repeat: Vec2,
        /// Added to uv after `repeat`.
        #[serde(default)]
        offset: Vec2,
    },
    /// A checkerboard in uv.
    Checker {
        /// Edge length of one field in uv units (metres on a plane).
        #[serde(default = "unit")]
        size: f32,
        /// Colour of the field at the origin.
        #[serde(default = "light")]
        a: Rgb,
        /// Colour of its neighbours.
        #[serde(default = "dark")]
        b: Rgb,
    },
}

/// How integer codes of an image become numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
pub enum Encoding {
    /// Colours encoded with the sRGB curve (IEC 61966-2-1).
    #[default]
    Srgb,
    /// Data such as roughness or opacity.
    Linear,
}

/// The channel of an image which a scalar parameter reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Channel {
    /// Rec. 709 luminance of the colour.
    #[default]
    Luminance,
    Red,
    Green,
    Blue,
    Alpha,
}

/// What a texture shows outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// Every second copy is mirrored.
    Mirror,
    /// The border continues.
    Clamp,
}

/// How texels are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
pub enum TextureFilter {
    /// Linear in both directions.
    #[default]
    Bilinear,
    /// The texel which contains the point.
    Nearest,
}

impl<I> Texture<I> {
    /// The same texture with its image replaced.
    ///
    /// # Errors
    /// Whatever `f` returns.
    pub fn map_image<J, E>(
        self,
        f: impl FnOnce(I, Encoding) -> Result<J, E>,
    ) -> Result<Texture<J>, E> {
        Ok(match self {
            Self::Image { file, encoding, wrap, filter, channel, repeat, offset } => {
                Texture::Image {
                    file: f(file, encoding)?,
                    encoding,
                    wrap,
                    filter,
                    channel,
                    repeat,
                    offset,
                }
            }
            Self::Checker { size, a, b } => Texture::Checker { size, a, b },
        })
    }
}

/// A decoded image: linear, row 0 at the **top**.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// Pixels per row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Linear colour and coverage of every pixel.
    pub pixels: ImagePixels,
}

/// Storage of a decoded image: as small as its precision allows.
#[derive(Clone, Debug, PartialEq)]
pub enum ImagePixels {
    /// 8-bit codes, decoded at lookup by the image's [`Encoding`].
    Rgba8(Vec<[u8; 4]>, Encoding),
    /// Linear colour and coverage.
    Rgba32F(Vec<[f32; 4]>),
}

fn one_by_one() -> Vec2 {
    Vec2::ONE
}
fn unit() -> f32 {
    1.0
}
fn light() -> Rgb {
    Rgb::splat(0.8)
}
fn dark() -> Rgb {
    Rgb::splat(0.1)
}
