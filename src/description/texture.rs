//! Textures, as a scene file says them.

use super::{Rgb, SpectrumData, Value};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A texture: a value which varies over a surface.
///
/// Textures form a graph: the colours and numbers of one may be other textures. `I` refers to an image and `G` to a grid:
/// a path in a file, decoded data in a world; `R` refers to another texture, as in [`Value`].
///
/// Image and pattern textures are functions of uv; solid ones (`Noise`, `Cells`, `Marble`, `Wood`, `Ramp`, `Radial`,
/// `Grid`) of the place in the space of the object, in metres before its transform, so that they move along with it. In
/// the inside of a solid, where there is no uv, x and y of the place stand for it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[serde(bound(
    deserialize = "I: Deserialize<'de>, G: Deserialize<'de>, R: Deserialize<'de>, Value<Rgb, R>: Deserialize<'de>, Value<f32, R>: Deserialize<'de>"
))]
pub enum Texture<I, G, R> {
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
        /// The field at the origin.
        #[serde(default = "light")]
        a: Value<Rgb, R>,
        /// Its neighbours.
        #[serde(default = "dark")]
        b: Value<Rgb, R>,
    },
    /// Stripes across u.
    Stripes {
        /// Width of a pair of stripes in uv units.
        #[serde(default = "unit")]
        size: f32,
        /// Share of `a` in the width.
        #[serde(default = "half")]
        share: f32,
        /// The stripe that begins at the origin.
        #[serde(default = "light")]
        a: Value<Rgb, R>,
        /// The stripe beside it.
        #[serde(default = "dark")]
        b: Value<Rgb, R>,
    },
    /// From one value at u = 0 to another at u = 1, and those beyond.
    Gradient {
        /// At u = 0.
        #[serde(default = "black")]
        a: Value<Rgb, R>,
        /// At u = 1.
        #[serde(default = "white")]
        b: Value<Rgb, R>,
    },
    /// Bricks or tiles in rows, in uv.
    Bricks {
        /// Width and height of a brick with its share of the mortar, in uv units.
        #[serde(default = "brick")]
        size: Vec2,
        /// Width of the mortar, in uv units.
        #[serde(default = "mortar")]
        mortar: f32,
        /// Width over which a brick falls off to the mortar, in uv units.
        #[serde(default)]
        bevel: f32,
        /// By what share of a brick every second row is shifted.
        #[serde(default = "half")]
        shift: f32,
        /// After how many bricks of a row their colours repeat; 0: never.
        #[serde(default)]
        period: u32,
        /// Which of all walls.
        #[serde(default)]
        seed: u32,
        /// One end of the colours of bricks.
        #[serde(default = "brick_red")]
        a: Value<Rgb, R>,
        /// The other end: each brick has its own mixture.
        #[serde(default = "brick_brown")]
        b: Value<Rgb, R>,
        /// Between the bricks.
        #[serde(default = "grey")]
        between: Value<Rgb, R>,
    },
    /// Clouds: gradient noise, summed over octaves.
    Noise {
        /// Size of the largest features, metres.
        #[serde(default = "unit")]
        size: f32,
        /// How many octaves, each half as large as the one before.
        #[serde(default = "octaves")]
        octaves: u32,
        /// Strength of an octave relative to the one before.
        #[serde(default = "half")]
        gain: f32,
        /// The sum of magnitudes instead of the sum (Perlin's turbulence).
        #[serde(default)]
        turbulence: bool,
        /// Which of all noises.
        #[serde(default)]
        seed: u32,
        /// Where the noise is lowest.
        #[serde(default = "black")]
        a: Value<Rgb, R>,
        /// Where it is highest.
        #[serde(default = "white")]
        b: Value<Rgb, R>,
    },
    /// Cells around scattered points (Worley noise).
    Cells {
        /// Mean distance of neighbouring points, metres.
        #[serde(default = "unit")]
        size: f32,
        /// What of the cells is shown.
        #[serde(default)]
        shows: CellFeature,
        /// How far points stray from a regular grid, 0 to 1.
        #[serde(default = "unit")]
        jitter: f32,
        /// Which of all cells.
        #[serde(default)]
        seed: u32,
        /// At 0.
        #[serde(default = "black")]
        a: Value<Rgb, R>,
        /// At 1.
        #[serde(default = "white")]
        b: Value<Rgb, R>,
    },
    /// Marble: veins across x, bent by turbulence.
    Marble {
        /// Distance of veins, metres.
        #[serde(default = "unit")]
        size: f32,
        /// How far veins are bent, in distances of veins.
        #[serde(default = "marble_distortion")]
        distortion: f32,
        /// How narrow veins are: 1 is a sine, more is narrower.
        #[serde(default = "marble_sharpness")]
        sharpness: f32,
        /// Which of all stones.
        #[serde(default)]
        seed: u32,
        /// The stone.
        #[serde(default = "light")]
        a: Value<Rgb, R>,
        /// The veins.
        #[serde(default = "dark")]
        b: Value<Rgb, R>,
    },
    /// Wood: rings around the y axis.
    Wood {
        /// Distance of rings, metres.
        #[serde(default = "ring")]
        size: f32,
        /// How far rings are bent, in distances of rings.
        #[serde(default = "wood_distortion")]
        distortion: f32,
        /// Strength of the fibres along y, 0 to 1.
        #[serde(default = "wood_grain")]
        grain: f32,
        /// Which of all trees.
        #[serde(default)]
        seed: u32,
        /// Wood of spring.
        #[serde(default = "early_wood")]
        a: Value<Rgb, R>,
        /// Wood of autumn.
        #[serde(default = "late_wood")]
        b: Value<Rgb, R>,
    },
    /// From one value to another along a line in space, and those beyond its ends.
    Ramp {
        /// Where `a` is, metres.
        #[serde(default)]
        from: Vec3,
        /// Where `b` is.
        #[serde(default = "above")]
        to: Vec3,
        /// How values lie between the ends.
        #[serde(default)]
        falloff: Falloff,
        /// At `from`.
        #[serde(default = "black")]
        a: Value<Rgb, R>,
        /// At `to`.
        #[serde(default = "white")]
        b: Value<Rgb, R>,
    },
    /// From one value in the middle of a ball to another at its surface, and that outside.
    Radial {
        /// The middle, metres.
        #[serde(default)]
        centre: Vec3,
        /// Metres.
        #[serde(default = "unit")]
        radius: f32,
        /// How values lie between.
        #[serde(default)]
        falloff: Falloff,
        /// In the middle.
        #[serde(default = "white")]
        a: Value<Rgb, R>,
        /// At the surface.
        #[serde(default = "black")]
        b: Value<Rgb, R>,
    },
    /// Values on a grid in space, interpolated linearly between the centres of its cells; 0 outside.
    Grid {
        /// Where the values come from.
        file: G,
        /// Sides of the box that they fill, metres; `None`: as the file says.
        #[serde(default)]
        size: Option<Vec3>,
        /// The middle of that box, metres; only with `size`.
        #[serde(default)]
        centre: Vec3,
    },
    /// Another texture which moves through the space of the object as time goes on.
    Drift {
        /// What moves.
        of: R,
        /// Metres per second. At 0 s it is where it would be at rest.
        velocity: Vec3,
    },
    /// `(1 − amount)·a + amount·b`.
    Mix {
        /// At amount 0.
        #[serde(default = "black")]
        a: Value<Rgb, R>,
        /// At amount 1.
        #[serde(default = "white")]
        b: Value<Rgb, R>,
        /// The share of `b`.
        #[serde(default = "half_scalar")]
        amount: Value<f32, R>,
    },
    /// The product of two, channel by channel.
    Multiply {
        /// One factor.
        a: Value<Rgb, R>,
        /// The other.
        b: Value<Rgb, R>,
    },
    /// Another range: `from` becomes `to`, channel by channel; what is beyond stays at the end.
    Remap {
        /// What is changed.
        of: R,
        /// The values which become the ends of `to`.
        #[serde(default = "zero_to_one")]
        from: (f32, f32),
        /// The ends.
        #[serde(default = "zero_to_one")]
        to: (f32, f32),
        /// Rounds the ends of the ramp off (a cubic with level ends).
        #[serde(default)]
        smooth: bool,
    },
    /// Another texture moved in uv: repeated, turned about the origin, and shifted, in this order.
    Placed {
        /// What is placed.
        of: R,
        /// How many times it repeats over the unit square of uv.
        #[serde(default = "one_by_one")]
        repeat: Vec2,
        /// Degrees, anticlockwise.
        #[serde(default)]
        rotation: f32,
        /// Added to uv at the end.
        #[serde(default)]
        offset: Vec2,
    },
    /// Another texture laid on from three sides, for shapes without good uv.
    Triplanar {
        /// What is laid on; one unit of its uv is `size` metres.
        of: R,
        /// Metres per unit of uv.
        #[serde(default = "unit")]
        size: f32,
        /// How sharply the sides meet: the power of the share of each.
        #[serde(default = "triplanar_sharpness")]
        sharpness: f32,
    },
    /// The same everywhere, by wavelength. Within another texture its colour counts.
    Spectrum {
        /// Values at wavelengths in nm.
        values: SpectrumData,
        /// Multiplies the values.
        #[serde(default = "unit")]
        scale: f32,
    },
    /// The colours at the corners of a mesh, interpolated; white where there are none.
    VertexColor {},
}

/// How values lie between two ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
pub enum Falloff {
    /// `(1 − s)·a + s·b`.
    #[default]
    Linear,
    /// The same with level ends: `3s² − 2s³` for s.
    Smooth,
    /// By equal factors over equal distances: `a^(1 − s)·b^s`, as air thins out upwards.
    Exponential,
}

/// A texture of a scene: images and grids decoded, other textures by name.
pub type SceneTexture = Texture<Arc<ImageData>, Arc<GridData>, String>;

/// What of scattered cells a texture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
pub enum CellFeature {
    /// The distance to the nearest point, in units of the size.
    #[default]
    Distance,
    /// How much farther the second nearest is: 0 on the borders of cells.
    Border,
    /// A number of each cell.
    Number,
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

/// What is done about textures which are finer than what a sample stands for; a setting of the render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum TextureFiltering {
    /// Nothing: textures are looked up at a point. Exact with very many samples, noisy with few.
    Point,
    /// The mean over a circle: right head on, too soft at a slant.
    Isotropic,
    /// The mean over the ellipse that a sample stands for.
    #[default]
    Anisotropic,
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

impl<I, G, R> Texture<I, G, R> {
    /// The same texture with its references replaced: `image` for images, `grid` for grids, `texture` for other
    /// textures.
    ///
    /// # Errors
    /// The first error of any function.
    pub fn map_refs<J, H, S, E>(
        self,
        image: impl FnOnce(I, Encoding) -> Result<J, E>,
        grid: impl FnOnce(G) -> Result<H, E>,
        texture: &mut impl FnMut(R) -> Result<S, E>,
    ) -> Result<Texture<J, H, S>, E> {
        Ok(match self {
            Self::Image { file, encoding, wrap, filter, channel, repeat, offset } => {
                let file = image(file, encoding)?;
                Texture::Image { file, encoding, wrap, filter, channel, repeat, offset }
            }
            Self::Checker { size, a, b } => {
                Texture::Checker { size, a: a.map_ref(texture)?, b: b.map_ref(texture)? }
            }
            Self::Stripes { size, share, a, b } => {
                Texture::Stripes { size, share, a: a.map_ref(texture)?, b: b.map_ref(texture)? }
            }
            Self::Gradient { a, b } => {
                Texture::Gradient { a: a.map_ref(texture)?, b: b.map_ref(texture)? }
            }
            Self::Bricks { size, mortar, bevel, shift, period, seed, a, b, between } => {
                Texture::Bricks {
                    size,
                    mortar,
                    bevel,
                    shift,
                    period,
                    seed,
                    a: a.map_ref(texture)?,
                    b: b.map_ref(texture)?,
                    between: between.map_ref(texture)?,
                }
            }
            Self::Noise { size, octaves, gain, turbulence, seed, a, b } => Texture::Noise {
                size,
                octaves,
                gain,
                turbulence,
                seed,
                a: a.map_ref(texture)?,
                b: b.map_ref(texture)?,
            },
            Self::Cells { size, shows, jitter, seed, a, b } => Texture::Cells {
                size,
                shows,
                jitter,
                seed,
                a: a.map_ref(texture)?,
                b: b.map_ref(texture)?,
            },
            Self::Marble { size, distortion, sharpness, seed, a, b } => Texture::Marble {
                size,
                distortion,
                sharpness,
                seed,
                a: a.map_ref(texture)?,
                b: b.map_ref(texture)?,
            },
            Self::Wood { size, distortion, grain, seed, a, b } => Texture::Wood {
                size,
                distortion,
                grain,
                seed,
                a: a.map_ref(texture)?,
                b: b.map_ref(texture)?,
            },
            Self::Ramp { from, to, falloff, a, b } => {
                Texture::Ramp { from, to, falloff, a: a.map_ref(texture)?, b: b.map_ref(texture)? }
            }
            Self::Radial { centre, radius, falloff, a, b } => Texture::Radial {
                centre,
                radius,
                falloff,
                a: a.map_ref(texture)?,
                b: b.map_ref(texture)?,
            },
            Self::Grid { file, size, centre } => Texture::Grid { file: grid(file)?, size, centre },
            Self::Drift { of, velocity } => Texture::Drift { of: texture(of)?, velocity },
            Self::Mix { a, b, amount } => Texture::Mix {
                a: a.map_ref(texture)?,
                b: b.map_ref(texture)?,
                amount: amount.map_ref(texture)?,
            },
            Self::Multiply { a, b } => {
                Texture::Multiply { a: a.map_ref(texture)?, b: b.map_ref(texture)? }
            }
            Self::Remap { of, from, to, smooth } => {
                Texture::Remap { of: texture(of)?, from, to, smooth }
            }
            Self::Placed { of, repeat, rotation, offset } => {
                Texture::Placed { of: texture(of)?, repeat, rotation, offset }
            }
            Self::Triplanar { of, size, sharpness } => {
                Texture::Triplanar { of: texture(of)?, size, sharpness }
            }
            Self::Spectrum { values, scale } => Texture::Spectrum { values, scale },
            Self::VertexColor {} => Texture::VertexColor {},
        })
    }

    /// The textures that this one refers to, by the field that does.
    pub fn refs(&self) -> impl Iterator<Item = (&'static str, &R)> {
        let none = ("", None);
        let list = match self {
            Self::Image { .. }
            | Self::Grid { .. }
            | Self::Spectrum { .. }
            | Self::VertexColor {} => [none; 3],
            Self::Checker { a, b, .. }
            | Self::Stripes { a, b, .. }
            | Self::Gradient { a, b }
            | Self::Noise { a, b, .. }
            | Self::Cells { a, b, .. }
            | Self::Marble { a, b, .. }
            | Self::Wood { a, b, .. }
            | Self::Ramp { a, b, .. }
            | Self::Radial { a, b, .. }
            | Self::Multiply { a, b } => [("a", a.texture()), ("b", b.texture()), none],
            Self::Bricks { a, b, between, .. } => {
                [("a", a.texture()), ("b", b.texture()), ("between", between.texture())]
            }
            Self::Mix { a, b, amount } => {
                [("a", a.texture()), ("b", b.texture()), ("amount", amount.texture())]
            }
            Self::Remap { of, .. }
            | Self::Placed { of, .. }
            | Self::Triplanar { of, .. }
            | Self::Drift { of, .. } => [("of", Some(of)), none, none],
        };
        list.into_iter().filter_map(|(field, reference)| Some((field, reference?)))
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

impl ImageData {
    /// Bytes of the pixels.
    pub fn memory(&self) -> usize {
        match &self.pixels {
            ImagePixels::Rgba8(pixels, _) => size_of_val(pixels.as_slice()),
            ImagePixels::Rgba32F(pixels) => size_of_val(pixels.as_slice()),
        }
    }
}

/// Storage of a decoded image: as small as its precision allows.
#[derive(Clone, Debug, PartialEq)]
pub enum ImagePixels {
    /// 8-bit codes, decoded at lookup by the image's [`Encoding`].
    Rgba8(Vec<[u8; 4]>, Encoding),
    /// Linear colour and coverage.
    Rgba32F(Vec<[f32; 4]>),
}

/// Numbers on a grid in space.
#[derive(Clone, Debug, PartialEq)]
pub struct GridData {
    /// Cells along x, y and z.
    pub size: [u32; 3],
    /// Numbers of each cell: 1, or 3 for a colour.
    pub channels: u32,
    /// The numbers, finite and not negative: channels next to each other, then x, then y, then z.
    pub values: Vec<f32>,
    /// Corners of the box that the cells fill, metres.
    pub bounds: (Vec3, Vec3),
}

impl GridData {
    /// Bytes of the values.
    pub fn memory(&self) -> usize {
        size_of_val(self.values.as_slice())
    }
}

fn above() -> Vec3 {
    Vec3::Y
}
fn one_by_one() -> Vec2 {
    Vec2::ONE
}
fn unit() -> f32 {
    1.0
}
fn half() -> f32 {
    0.5
}
fn half_scalar<R>() -> Value<f32, R> {
    Value::Constant(0.5)
}
fn zero_to_one() -> (f32, f32) {
    (0.0, 1.0)
}
fn octaves() -> u32 {
    5
}
fn brick() -> Vec2 {
    Vec2::new(0.24, 0.08)
}
fn mortar() -> f32 {
    0.01
}
fn ring() -> f32 {
    0.02
}
fn marble_distortion() -> f32 {
    1.5
}
fn marble_sharpness() -> f32 {
    4.0
}
fn wood_distortion() -> f32 {
    0.6
}
fn wood_grain() -> f32 {
    0.3
}
fn triplanar_sharpness() -> f32 {
    4.0
}
fn rgb<R>(r: f32, g: f32, b: f32) -> Value<Rgb, R> {
    Value::Constant(Rgb::new(r, g, b))
}
fn light<R>() -> Value<Rgb, R> {
    rgb(0.8, 0.8, 0.8)
}
fn dark<R>() -> Value<Rgb, R> {
    rgb(0.1, 0.1, 0.1)
}
fn black<R>() -> Value<Rgb, R> {
    rgb(0.0, 0.0, 0.0)
}
fn white<R>() -> Value<Rgb, R> {
    rgb(1.0, 1.0, 1.0)
}
fn grey<R>() -> Value<Rgb, R> {
    rgb(0.5, 0.5, 0.5)
}
fn brick_red<R>() -> Value<Rgb, R> {
    rgb(0.45, 0.14, 0.08)
}
fn brick_brown<R>() -> Value<Rgb, R> {
    rgb(0.25, 0.09, 0.06)
}
fn early_wood<R>() -> Value<Rgb, R> {
    rgb(0.50, 0.28, 0.13)
}
fn late_wood<R>() -> Value<Rgb, R> {
    rgb(0.27, 0.13, 0.055)
}
