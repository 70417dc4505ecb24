//! Textures: values which vary over a surface.
//!
//! `u` runs to the right and `v` **up**: `(0, 0)` is the lower left corner of an image and the row at its
//! top is at `v = 1`. Colours are linear Rec. 709; lookups interpolate linear light. What is finer than the footprint
//! of a sample is replaced by its mean: images by a pyramid, patterns in closed form, noise octave by
//! octave.

mod domain;
mod grid;
mod image;
mod memory;
mod moments;
mod pattern;
mod point;
mod pyramid;
mod range;
mod solid;

pub use domain::Domain;
pub(super) use memory::{Known, REMEMBER_ABOVE};
pub use moments::Moments;
pub use point::TexturePoint;
pub use pyramid::Pyramid;
pub use range::{Ranges, Region};

use crate::color::luminance;
use crate::color::spectrum::{WavelengthSet, color_of};
use crate::description::{Falloff, GridData, ImageData, Rgb, Texture, TextureFiltering, Value};
use crate::math::Chart;
use crate::math::parts_first;
use glam::{DMat2, DVec2, Vec2, Vec3, Vec4};
use memory::{Forgetful, Memory, Remembering};
use pattern::Wall;
use solid::Octaves;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// A texture as a frame uses it: its pixels shared, other textures by index.
pub type RenderTexture = Texture<Arc<Pyramid>, Arc<GridData>, u32>;

/// What a texture is asked for: a colour, or a number.
trait Sample:
    Copy
    + std::ops::Add<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Mul<f32, Output = Self>
{
    fn of_color(color: Rgb) -> Self;
    fn of_texel(texel: Vec4, channel: crate::description::Channel) -> Self;
    fn each(self, f: impl Fn(f32) -> f32) -> Self;
    fn known(memory: &Remembering) -> &Known<Self>;
    fn known_mut(memory: &mut Remembering) -> &mut Known<Self>;
}

impl Sample for Rgb {
    fn of_color(color: Rgb) -> Self {
        color
    }

    fn of_texel(texel: Vec4, _: crate::description::Channel) -> Self {
        texel.truncate()
    }

    fn each(self, f: impl Fn(f32) -> f32) -> Self {
        self.map(f)
    }

    fn known(memory: &Remembering) -> &Known<Self> {
        &memory.colors
    }

    fn known_mut(memory: &mut Remembering) -> &mut Known<Self> {
        &mut memory.colors
    }
}

impl Sample for f32 {
    fn of_color(color: Rgb) -> Self {
        luminance(color)
    }

    fn of_texel(texel: Vec4, channel: crate::description::Channel) -> Self {
        image::channel(texel, channel)
    }

    fn each(self, f: impl Fn(f32) -> f32) -> Self {
        f(self)
    }

    fn known(memory: &Remembering) -> &Known<Self> {
        &memory.numbers
    }

    fn known_mut(memory: &mut Remembering) -> &mut Known<Self> {
        &mut memory.numbers
    }
}

/// What a texture needs to know of a point beside uv.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureNeeds {
    /// Place, normal or colour.
    pub place: bool,
    /// How much of the surface a sample stands for.
    pub footprint: bool,
    /// The directions that a normal map was made for.
    pub tangents: bool,
}

impl TextureNeeds {
    /// What either needs.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            place: self.place || other.place,
            footprint: self.footprint || other.footprint,
            tangents: self.tangents || other.tangents,
        }
    }
}

/// Points over the unit square at which textures are looked up for a mean.
const UNIT_POINTS: u32 = UNIT_SIDE * UNIT_SIDE;
const UNIT_SIDE: u32 = 32;

/// The middles of a grid over the unit square, each standing for its field.
fn unit_square() -> impl Iterator<Item = TexturePoint> {
    (0..UNIT_POINTS).map(|k| {
        let uv = Vec2::new((k % UNIT_SIDE) as f32 + 0.5, (k / UNIT_SIDE) as f32 + 0.5);
        let uv = uv / UNIT_SIDE as f32;
        let axes = [Vec2::X, Vec2::Y].map(|axis| axis / UNIT_SIDE as f32);
        TexturePoint { p: uv.extend(0.0).as_dvec3(), axes, ..TexturePoint::at(uv) }
    })
}

/// All textures of a frame.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    list: Vec<RenderTexture>,
    /// What each texture takes together with those that it refers to.
    whole: Vec<Whole>,
    filtering: TextureFiltering,
    /// Opening and closing of the shutter, seconds.
    shutter: (f64, f64),
    /// What stands in for red, green and blue, in a spectral scene.
    seen: Option<Seen>,
}

/// What a texture takes together with all that it refers to.
#[derive(Clone, Copy, Debug)]
struct Whole {
    needs: TextureNeeds,
    /// Places of the unit square that it tells apart.
    resolution: (u32, u32),
    /// How many lookups one would take that forgets what it has found.
    lookups: u64,
}

/// Textures at the wavelengths of a set.
#[derive(Clone, Debug)]
struct Seen {
    at: &'static WavelengthSet,
    /// By texture, the values of what is a spectrum.
    spectra: Vec<Option<Vec3>>,
}

impl Textures {
    /// The textures of a frame; their references are indices into the list. Pyramids are made unless
    /// `filtering` needs none; those in `known` are used again.
    ///
    /// # Panics
    /// If a reference is out of range, or a texture is made of itself or of too many in a row.
    pub fn new(
        list: Vec<Texture<Arc<ImageData>, Arc<GridData>, u32>>,
        filtering: TextureFiltering,
        known: &Pyramids,
    ) -> Self {
        let count = list.len() as u32;
        let levels = filtering != TextureFiltering::Point;
        let mut made = Pyramids::default();
        let list: Vec<RenderTexture> = list
            .into_iter()
            .map(|texture| {
                let mut image = |image: Arc<ImageData>, _| {
                    let pyramid = known.find(&image, levels).or_else(|| made.find(&image, levels));
                    let pyramid = pyramid.unwrap_or_else(|| Arc::new(Pyramid::new(image, levels)));
                    made.keep(&pyramid);
                    Ok::<_, std::convert::Infallible>(pyramid)
                };
                let mut reference = |index: u32| {
                    assert!(index < count, "texture {index} of {count}");
                    Ok(index)
                };
                match texture.map_refs(&mut image, Ok, &mut reference) {
                    Ok(texture) => texture,
                    Err(never) => match never {},
                }
            })
            .collect();
        let whole = whole(&list, filtering);
        Self { list, whole, filtering, shutter: (0.0, 0.0), seen: None }
    }

    /// The same at the time of a frame: when its shutter opens and closes, in seconds.
    #[must_use]
    pub fn at_time(self, shutter: (f64, f64)) -> Self {
        Self { shutter, ..self }
    }

    /// Whether anything is different in the shutter of another frame.
    pub fn must_go_to(&self, shutter: (f64, f64)) -> bool {
        self.shutter != shutter && self.have_drift()
    }

    /// Whether anything drifts while the shutter is open.
    pub fn drift(&self) -> bool {
        self.shutter.1 > self.shutter.0 && self.have_drift()
    }

    fn have_drift(&self) -> bool {
        self.list.iter().any(|texture| matches!(texture, Texture::Drift { .. }))
    }

    /// What is done about fine textures.
    pub fn filtering(&self) -> TextureFiltering {
        self.filtering
    }

    /// The pyramids in use, for the next frame.
    pub fn pyramids(&self) -> Pyramids {
        let mut pyramids = Pyramids::default();
        for texture in &self.list {
            if let Texture::Image { file, .. } = texture {
                pyramids.keep(file);
            }
        }
        pyramids
    }

    /// The textures, in the order given.
    pub fn list(&self) -> &[RenderTexture] {
        &self.list
    }

    /// What a texture, or one that it refers to, needs to know of a point beside uv.
    pub fn needs(&self, index: u32) -> TextureNeeds {
        self.whole[index as usize].needs
    }

    /// The colour of a texture at a point; seen at wavelengths, its values there.
    #[inline]
    pub fn color(&self, index: u32, at: &TexturePoint) -> Rgb {
        let Some(seen) = &self.seen else { return self.vector(index, at) };
        match seen.spectra[index as usize] {
            Some(values) => values,
            None => seen.at.from_rgb * self.vector(index, at),
        }
    }

    /// The three numbers which a texture holds at a point, whatever they mean.
    #[inline]
    pub fn vector(&self, index: u32, at: &TexturePoint) -> Vec3 {
        self.look_up(index, at)
    }

    /// Whether a texture is a spectrum.
    pub fn is_spectrum(&self, index: u32) -> bool {
        matches!(self.list[index as usize], Texture::Spectrum { .. })
    }

    /// The same textures seen at the wavelengths of a set.
    #[must_use]
    pub fn seen_at(&self, set: &'static WavelengthSet) -> Self {
        let values = |texture: &RenderTexture| match texture {
            Texture::Spectrum { values, scale } => Some(set.of_spectrum(values) * *scale),
            _ => None,
        };
        let spectra = self.list.iter().map(values).collect();
        Self { seen: Some(Seen { at: set, spectra }), ..self.clone() }
    }

    /// The number which a texture holds at a point: the chosen channel of an image, the luminance of a
    /// pattern.
    #[inline]
    pub fn scalar(&self, index: u32, at: &TexturePoint) -> f32 {
        self.look_up(index, at)
    }

    /// How many places of the unit square a texture tells apart: the most of all images that it is made of.
    /// Patterns and solid textures count as fine enough for any that a picture can show.
    pub fn resolution(&self, index: u32) -> (u32, u32) {
        self.whole[index as usize].resolution
    }

    /// How many textures there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Bytes of all grids, images and their pyramids, each counted once.
    pub fn memory(&self) -> usize {
        let (mut images, mut pyramids, mut bytes) = (HashSet::new(), HashSet::new(), 0);
        let mut grids = HashSet::new();
        for texture in &self.list {
            if let Texture::Grid { file, .. } = texture {
                bytes += if grids.insert(Arc::as_ptr(file)) { file.memory() } else { 0 };
            }
            let Texture::Image { file, .. } = texture else { continue };
            bytes += if pyramids.insert(Arc::as_ptr(file)) { file.memory() } else { 0 };
            let image = &file.base;
            bytes += if images.insert(Arc::as_ptr(image)) { image.memory() } else { 0 };
        }
        bytes
    }

    /// Mean colour of a texture over the unit square: for the power of a textured light. Exact for images and
    /// what is filtered in closed form; of a solid texture that of a slice through it.
    pub fn average(&self, index: u32) -> Rgb {
        if let Texture::Spectrum { values, scale } = &self.list[index as usize] {
            // Of a colour outside of the gamut all channels count.
            return (color_of(values) * *scale).abs();
        }
        if let Texture::Image { file, .. } = &self.list[index as usize] {
            return image::average(&file.base);
        }
        unit_square().map(|at| self.color(index, &at)).sum::<Rgb>() / UNIT_POINTS as f32
    }

    /// About the mean of a texture of shares over the unit square, for the power of a light with holes: strictly between 0 and
    /// 1, since there may be more than was looked at.
    pub fn mean_share(&self, index: u32) -> f32 {
        let sum: f32 = unit_square().map(|at| self.scalar(index, &at).clamp(0.0, 1.0)).sum();
        let least = (UNIT_POINTS as f32).recip();
        (sum / UNIT_POINTS as f32).clamp(least, 1.0 - least)
    }

    #[inline]
    fn look_up<T: Sample>(&self, index: u32, at: &TexturePoint) -> T {
        if self.whole[index as usize].lookups <= REMEMBER_ABOVE {
            self.sample(index, at, &mut Forgetful)
        } else {
            self.sample(index, at, &mut Remembering::default())
        }
    }

    fn value<T: Sample>(
        &self,
        value: &Value<Rgb, u32>,
        at: &TexturePoint,
        memory: &mut impl Memory,
    ) -> T {
        match *value {
            Value::Constant(color) => T::of_color(color),
            Value::Texture(index) => self.sample(index, at, memory),
        }
    }

    /// `(1 − share)·a + share·b`; what has no share is not looked up.
    fn mix<T: Sample>(
        &self,
        [a, b]: [&Value<Rgb, u32>; 2],
        share: f32,
        at: &TexturePoint,
        memory: &mut impl Memory,
    ) -> T {
        if share == 0.0 {
            self.value(a, at, memory)
        } else if share == 1.0 {
            self.value(b, at, memory)
        } else {
            self.value::<T>(a, at, memory) * (1.0 - share) + self.value::<T>(b, at, memory) * share
        }
    }

    /// From `a` at a share of 0 to `b` at 1.
    fn fall<T: Sample>(
        &self,
        [a, b]: [&Value<Rgb, u32>; 2],
        share: f64,
        falloff: Falloff,
        at: &TexturePoint,
        memory: &mut impl Memory,
    ) -> T {
        let share = share.clamp(0.0, 1.0);
        match falloff {
            Falloff::Linear => self.mix([a, b], share as f32, at, memory),
            Falloff::Smooth => self.mix([a, b], pattern::smooth(share), at, memory),
            Falloff::Exponential => {
                let (a, b): (T, T) = (self.value(a, at, memory), self.value(b, at, memory));
                a.each(|a| a.powf((1.0 - share) as f32)) * b.each(|b| b.powf(share as f32))
            }
        }
    }

    fn sample<T: Sample, M: Memory>(&self, index: u32, at: &TexturePoint, memory: &mut M) -> T {
        if let Some(value) = memory.recall(index) {
            return value;
        }
        let value = self.found(index, at, memory);
        memory.keep(index, value);
        value
    }

    /// What a texture is at a point where that is not known yet.
    #[inline]
    fn found<T: Sample, M: Memory>(&self, index: u32, at: &TexturePoint, memory: &mut M) -> T {
        match &self.list[index as usize] {
            Texture::Image { file, wrap, filter, repeat, offset, channel, .. } => {
                let domain =
                    at.domain.placed(DMat2::from_diagonal(repeat.as_dvec2()), offset.as_dvec2());
                let look =
                    image::Look { wrap: *wrap, filter: *filter, filtering: self.filtering, domain };
                // In f64: far coordinates keep their texel.
                let uv = at.uv.as_dvec2() * repeat.as_dvec2() + offset.as_dvec2();
                let axes = at.axes.map(|axis| axis * *repeat);
                T::of_texel(look.filtered(file, uv, axes), *channel)
            }
            Texture::Checker { size, a, b } => {
                self.mix([a, b], pattern::checker(at, *size), at, memory)
            }
            Texture::Stripes { size, share, a, b } => {
                self.mix([a, b], pattern::stripes(at, *size, *share), at, memory)
            }
            Texture::Gradient { a, b } => {
                let share = if at.uv.x.is_nan() { 0.0 } else { at.uv.x.clamp(0.0, 1.0) };
                self.mix([a, b], share, at, memory)
            }
            Texture::Bricks { size, mortar, bevel, shift, period, seed, a, b, between } => {
                let wall = Wall {
                    size: *size,
                    mortar: *mortar,
                    bevel: *bevel,
                    shift: *shift,
                    period: *period,
                    seed: *seed,
                };
                let brick = wall.at(at);
                if brick.solid == 0.0 {
                    return self.value(between, at, memory);
                }
                let face: T = self.mix([a, b], brick.number, at, memory);
                if brick.solid == 1.0 {
                    return face;
                }
                face * brick.solid + self.value::<T>(between, at, memory) * (1.0 - brick.solid)
            }
            Texture::Noise { size, octaves, gain, turbulence, seed, a, b } => {
                let octaves =
                    Octaves { count: *octaves, gain: *gain, turbulence: *turbulence, seed: *seed };
                self.mix([a, b], solid::noise(at, *size, &octaves), at, memory)
            }
            Texture::Cells { size, shows, jitter, seed, a, b } => {
                self.mix([a, b], solid::cells(at, *size, *shows, *jitter, *seed), at, memory)
            }
            Texture::Marble { size, distortion, sharpness, seed, a, b } => self.mix(
                [a, b],
                solid::marble(at, *size, *distortion, *sharpness, *seed),
                at,
                memory,
            ),
            Texture::Wood { size, distortion, grain, seed, a, b } => {
                self.mix([a, b], solid::wood(at, *size, *distortion, *grain, *seed), at, memory)
            }
            Texture::Ramp { from, to, falloff, a, b } => {
                let (from, way) = (from.as_dvec3(), (*to - *from).as_dvec3());
                let share = (at.p - from).dot(way) / way.length_squared();
                self.fall([a, b], share, *falloff, at, memory)
            }
            Texture::Radial { centre, radius, falloff, a, b } => {
                let share = at.p.distance(centre.as_dvec3()) / f64::from(*radius);
                self.fall([a, b], share, *falloff, at, memory)
            }
            Texture::Grid { file, size, centre } => {
                T::of_color(grid::Placed::new(file, *size, *centre).at(at.p))
            }
            Texture::Drift { of, velocity } => {
                let (open, close) = self.shutter;
                let seconds = open + (close - open) * f64::from(at.time);
                let at = at.moved(velocity.as_dvec3() * -seconds);
                self.sample(*of, &at, &mut M::elsewhere())
            }
            Texture::Mix { a, b, amount } => {
                let amount = match *amount {
                    Value::Constant(amount) => amount,
                    Value::Texture(index) => self.sample(index, at, memory),
                };
                self.mix([a, b], amount.clamp(0.0, 1.0), at, memory)
            }
            Texture::Multiply { a, b } => {
                self.value::<T>(a, at, memory) * self.value::<T>(b, at, memory)
            }
            Texture::Remap { of, from, to, smooth } => {
                self.sample::<T, M>(*of, at, memory).each(|value| remap(value, *from, *to, *smooth))
            }
            Texture::Placed { of, repeat, rotation, offset } => {
                let m = domain::turn(*rotation) * DMat2::from_diagonal(repeat.as_dvec2());
                self.sample(*of, &at.placed(m, offset.as_dvec2()), &mut M::elsewhere())
            }
            Texture::Triplanar { of, size, sharpness } => {
                self.triplanar::<T, M>(*of, *size, *sharpness, at)
            }
            Texture::Spectrum { values, scale } => T::of_color(color_of(values) * *scale),
            Texture::VertexColor {} => T::of_color(at.color),
        }
    }

    /// The texture seen along each axis, weighted by how much the surface faces it.
    fn triplanar<T: Sample, M: Memory>(
        &self,
        of: u32,
        size: f32,
        sharpness: f32,
        at: &TexturePoint,
    ) -> T {
        let weights = at.n.abs().map(|n| n.powf(sharpness));
        let weights = weights / weights.element_sum();
        let p = at.p / f64::from(size);
        // From +x z runs to the left, from +y it runs down: the picture is upright and not mirrored.
        let sides = [DVec2::new(-p.z, p.y), DVec2::new(p.x, -p.z), DVec2::new(p.x, p.y)];
        let axes = [Vec2::X, Vec2::Y].map(|axis| axis * (at.width / size));
        let seen = |side: usize| {
            let (uv, domain) = (sides[side].as_vec2(), Domain::new(Chart::ENDLESS));
            let at = TexturePoint { uv, domain, axes, ..*at };
            self.sample::<T, M>(of, &at, &mut M::elsewhere()) * weights[side]
        };
        let mut sum = T::of_color(Vec3::ZERO);
        for side in 0..3 {
            if weights[side] > 0.0 {
                sum = sum + seen(side);
            }
        }
        sum
    }
}

/// [`Whole`] of each texture, asked in an order in which its parts come first.
fn whole(list: &[RenderTexture], filtering: TextureFiltering) -> Vec<Whole> {
    let parts = |index: u32| list[index as usize].refs().map(|(_, part)| *part).collect();
    let order = parts_first(list.len() as u32, parts);
    let order = order.expect("the description rejects what has no order");
    let none = Whole { needs: TextureNeeds::default(), resolution: (1, 1), lookups: 1 };
    let mut all = vec![none; list.len()];
    for index in order {
        let texture = &list[index as usize];
        let footprint = filtering != TextureFiltering::Point;
        let needs = TextureNeeds { place: needs_place(texture), footprint, tangents: false };
        let resolution = match texture {
            Texture::Image { file, .. } => (file.base.width, file.base.height),
            Texture::Mix { .. }
            | Texture::Multiply { .. }
            | Texture::Remap { .. }
            | Texture::Drift { .. } => (1, 1),
            _ => (1024, 512),
        };
        let mut own = Whole { needs, resolution, lookups: 1 };
        for (_, part) in texture.refs() {
            let part = all[*part as usize];
            own.needs = own.needs.and(part.needs);
            own.resolution.0 = own.resolution.0.max(part.resolution.0);
            own.resolution.1 = own.resolution.1.max(part.resolution.1);
            own.lookups = own.lookups.saturating_add(part.lookups);
        }
        all[index as usize] = own;
    }
    all
}

/// Whether a texture by itself looks at more than uv.
fn needs_place(texture: &RenderTexture) -> bool {
    matches!(
        texture,
        Texture::Noise { .. }
            | Texture::Cells { .. }
            | Texture::Marble { .. }
            | Texture::Wood { .. }
            | Texture::Ramp { .. }
            | Texture::Radial { .. }
            | Texture::Grid { .. }
            | Texture::Drift { .. }
            | Texture::Triplanar { .. }
            | Texture::VertexColor {}
    )
}

/// A value of one range as one of another; beyond the ends it stays there.
fn remap(value: f32, from: (f32, f32), to: (f32, f32), smooth: bool) -> f32 {
    let share = ((value - from.0) / (from.1 - from.0)).clamp(0.0, 1.0);
    let share = if smooth { pattern::smooth(f64::from(share)) } else { share };
    to.0 + (to.1 - to.0) * share
}

/// Pyramids that were made, by the address of their image, which each of them keeps alive.
#[derive(Clone, Debug, Default)]
pub struct Pyramids(HashMap<usize, Arc<Pyramid>>);

impl Pyramids {
    fn find(&self, image: &Arc<ImageData>, levels: bool) -> Option<Arc<Pyramid>> {
        let pyramid = self.0.get(&Arc::as_ptr(image).addr())?;
        (pyramid.has_levels() == levels).then(|| pyramid.clone())
    }

    fn keep(&mut self, pyramid: &Arc<Pyramid>) {
        self.0.insert(Arc::as_ptr(&pyramid.base).addr(), pyramid.clone());
    }
}
