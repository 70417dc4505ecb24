//! Looking up pixels: wrapping, filtering, decoding.
//!
//! Texel `i` of `n` covers `[i, i + 1)/n`; its centre is `(i + ½)/n`. Each of the four taps of the
//! bilinear filter is wrapped by itself, so that a repeating image has no seam. Coordinates are
//! reduced in `f64`: at uv = 10⁷ an `f32` product with the resolution would have lost the texel.
//!
//! Where the surface ends, a tap beyond the end reads the last texel before it, at every level of the pyramid; where it
//! closes, a tap beyond the seam reads what is there. Only what goes on repeats.

use super::domain::{Domain, Interval};
use super::pyramid::Pyramid;
use crate::color::luminance;
use crate::description::{
    Channel, Encoding, ImageData, ImagePixels, Rgb, TextureFilter, TextureFiltering, Wrap,
};
use crate::math::Edge;
use glam::{DVec2, DVec3, Vec2, Vec4};
use std::sync::LazyLock;

/// Linear values of the 256 codes of the sRGB curve (IEC 61966-2-1:1999).
static SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let encoded = code as f64 / 255.0;
        let linear = if encoded <= 0.040_45 {
            encoded / 12.92
        } else {
            ((encoded + 0.055) / 1.055).powf(2.4)
        };
        linear as f32
    })
});

/// How an image is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) wrap: Wrap,
    pub(super) filter: TextureFilter,
    pub(super) filtering: TextureFiltering,
    pub(super) domain: Domain,
}

/// Most probes along the longer axis of a footprint; one that is longer still is looked at with wider probes, unless it
/// goes around an axis of the surface: near a pole wider ones would reach far from it.
const MOST_PROBES: f32 = 16.0;

impl Look {
    /// The mean over an ellipse with these axes (from end to end, in uv) around `uv`.
    ///
    /// Isotropic: between the two levels of the pyramid whose texels are about as wide as the longer axis
    /// (Williams 1983, "Pyramidal Parametrics"). Anisotropic: by levels for the shorter axis, in several
    /// probes along the longer one (`McCormack`, Perry, Farkas, Jouppi 1999, "Feline: Fast Elliptical Lines for
    /// Anisotropic Texture Mapping", SIGGRAPH 99).
    pub(super) fn filtered(self, pyramid: &Pyramid, uv: DVec2, axes: [Vec2; 2]) -> Vec4 {
        let image = &*pyramid.base;
        let uv = self.domain.within(uv);
        let unfiltered = self.filter == TextureFilter::Nearest
            || self.filtering == TextureFiltering::Point
            || axes == [Vec2::ZERO; 2];
        if unfiltered {
            return self.lookup(image, uv);
        }
        let size = Vec2::new(image.width as f32, image.height as f32);
        let axes = axes.map(|axis| self.domain.shortened(axis));
        let [a, b] = axes.map(|axis| (axis * size).length());
        let (longer, axis) = if a >= b { (a, axes[0]) } else { (b, axes[1]) };
        let shorter = a.min(b);
        // Footprints that no number describes see the mean of the image.
        if !longer.is_finite() {
            return self.level(pyramid, f32::INFINITY, uv);
        }
        match self.filtering {
            TextureFiltering::Anisotropic if longer > 1.0 => {
                let around = axis.x.abs() > axis.y.abs() && self.domain.u().edge == Edge::Seam;
                let widest = if around { 0.0 } else { longer / MOST_PROBES };
                let width = shorter.max(widest).max(1.0);
                let probes = (longer / width).ceil().max(1.0);
                let mut sum = Vec4::ZERO;
                for k in 0..probes as u32 {
                    let along = f64::from((k as f32 + 0.5) / probes - 0.5);
                    let uv = self.domain.folded(uv + axis.as_dvec2() * along);
                    sum += self.level(pyramid, width.log2(), uv);
                }
                sum / probes
            }
            _ => self.level(pyramid, longer.log2(), uv),
        }
    }

    /// Between two levels of a pyramid.
    fn level(self, pyramid: &Pyramid, level: f32, uv: DVec2) -> Vec4 {
        let last = pyramid.len() - 1;
        let at = |level: usize| self.lookup(pyramid.level(level), uv);
        if level <= 0.0 {
            return at(0);
        }
        if level >= last as f32 {
            return at(last);
        }
        let below = level.floor();
        let share = level - below;
        let fine = at(below as usize);
        if share == 0.0 { fine } else { fine + (at(below as usize + 1) - fine) * share }
    }

    /// Linear colour and coverage at `uv`. An axis whose coordinate is not finite reads texel 0.
    #[inline]
    fn lookup(self, image: &ImageData, uv: DVec2) -> Vec4 {
        // Rows are stored from the top, v points up.
        let across = Taps::new(self.wrap, image.width, self.domain.u(), uv.x);
        let down = Taps::new(self.wrap, image.height, self.domain.v().flipped(), 1.0 - uv.y);
        match self.filter {
            TextureFilter::Nearest => {
                texel(image, across.tap(across.x.floor() as i64), down.tap(down.x.floor() as i64))
            }
            TextureFilter::Bilinear => {
                let (columns, tx) = across.pair();
                let (rows, ty) = down.pair();
                let [top, bottom] = rows.map(|row| {
                    let [left, right] = columns.map(|column| texel(image, column, row));
                    left + (right - left) * tx
                });
                top + (bottom - top) * ty
            }
        }
    }
}

/// What a lookup reads along one axis of an image.
#[derive(Clone, Copy)]
struct Taps {
    wrap: Wrap,
    size: u32,
    /// Where it looks, in texels, reduced to about one period so that it converts to an integer.
    x: f64,
    edge: Edge,
    /// The first texel that is laid on the surface and the one after the last, from the same origin.
    first: i64,
    end: i64,
}

impl Taps {
    #[inline]
    fn new(wrap: Wrap, size: u32, domain: Interval, u: f64) -> Self {
        let n = f64::from(size);
        let shift = match wrap {
            Wrap::Repeat => u.floor(),
            Wrap::Mirror => 2.0 * (0.5 * u).floor(),
            Wrap::Clamp => 0.0,
        };
        let x = match wrap {
            _ if !u.is_finite() => 0.5, // the centre of texel 0
            Wrap::Clamp => u.clamp(0.0, 1.0) * n,
            _ => (u - shift) * n,
        };
        let taps = Self { wrap, size, x, edge: Edge::Endless, first: 0, end: 0 };
        if domain.edge == Edge::Endless || !u.is_finite() {
            return taps;
        }
        // Places and repeats are `f32`: what of a texel lies beyond an edge by less than their rounding does not count.
        let rounding = |bound: f64| bound.abs().max(1.0) * n * f64::from(f32::EPSILON);
        let low = (domain.low - shift) * n + rounding(domain.low);
        let high = (domain.high - shift) * n - rounding(domain.high);
        let (first, end) = (low.floor() as i64, high.ceil() as i64);
        // A seam within a texel joins what the image shows on both sides of it.
        let whole = |bound: f64| {
            let texels = bound * n;
            (texels - texels.round()).abs() <= rounding(bound)
        };
        let meets = domain.edge == Edge::Border || (whole(domain.low) && whole(domain.high));
        let edge = if meets && end > first { domain.edge } else { Edge::Endless };
        Self { edge, first, end, ..taps }
    }

    /// The texel which a tap at integer position `i` reads; `i` lies at most one beyond the period.
    #[inline]
    fn tap(self, i: i64) -> u32 {
        let i = match self.edge {
            Edge::Endless => i,
            Edge::Border => i.clamp(self.first, self.end - 1),
            Edge::Seam => self.first + (i - self.first).rem_euclid(self.end - self.first),
        };
        let size = i64::from(self.size);
        let wrapped = match self.wrap {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * size);
                if i < size { i } else { 2 * size - 1 - i }
            }
            Wrap::Clamp => i.clamp(0, size - 1),
        };
        wrapped as u32
    }

    /// The texels between whose centres it looks, and the share of the second.
    #[inline]
    fn pair(self) -> ([u32; 2], f32) {
        let x = self.x - 0.5;
        let below = x.floor();
        let i = below as i64;
        ([self.tap(i), self.tap(i + 1)], (x - below) as f32)
    }
}

/// The number that a channel stands for.
#[inline]
pub(super) fn channel(texel: Vec4, channel: Channel) -> f32 {
    match channel {
        Channel::Luminance => luminance(texel.truncate()),
        Channel::Red => texel.x,
        Channel::Green => texel.y,
        Channel::Blue => texel.z,
        Channel::Alpha => texel.w,
    }
}

/// Mean linear colour of all pixels.
pub(super) fn average(image: &ImageData) -> Rgb {
    let (width, height) = (image.width, image.height);
    let mut sum = DVec3::ZERO;
    for row in 0..height {
        for column in 0..width {
            sum += texel(image, column, row).truncate().as_dvec3();
        }
    }
    (sum / (f64::from(width) * f64::from(height))).as_vec3()
}

/// Bounds of a channel over all pixels.
pub(super) fn range(image: &ImageData, wanted: Channel) -> [f32; 2] {
    let rows = (0..image.height).flat_map(|row| (0..image.width).map(move |column| (column, row)));
    let values = rows.map(|(column, row)| channel(texel(image, column, row), wanted));
    values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

#[inline]
pub(super) fn texel(image: &ImageData, column: u32, row: u32) -> Vec4 {
    let index = row as usize * image.width as usize + column as usize;
    match &image.pixels {
        ImagePixels::Rgba8(codes, encoding) => {
            let [r, g, b, a] = codes[index];
            // Coverage is linear under either encoding.
            let coverage = f32::from(a) / 255.0;
            match encoding {
                Encoding::Srgb => {
                    let table = &*SRGB;
                    Vec4::new(table[r as usize], table[g as usize], table[b as usize], coverage)
                }
                Encoding::Linear => {
                    (Vec4::new(r.into(), g.into(), b.into(), 0.0) / 255.0).with_w(coverage)
                }
            }
        }
        ImagePixels::Rgba32F(values) => Vec4::from_array(values[index]),
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "values which are passed through unchanged")]
mod tests {
    use super::*;
    use crate::math::Chart;
    use TextureFilter::{Bilinear, Nearest};

    fn gray(width: u32, height: u32, f: impl Fn(u32, u32) -> f32) -> ImageData {
        let pixels = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| {
                let v = f(column, row);
                [v, v, v, 1.0]
            })
            .collect();
        ImageData { width, height, pixels: ImagePixels::Rgba32F(pixels) }
    }

    fn look(wrap: Wrap, filter: TextureFilter, chart: Chart) -> Look {
        let filtering = TextureFiltering::Anisotropic;
        Look { wrap, filter, filtering, domain: Domain::new(chart) }
    }

    fn value(image: &ImageData, wrap: Wrap, filter: TextureFilter, u: f64, v: f64) -> f32 {
        look(wrap, filter, Chart::ENDLESS).lookup(image, DVec2::new(u, v)).x
    }

    /// Oracle: the 18 % grey of the sRGB standard has the code 118, and 0 and 255 are the ends.
    #[test]
    fn srgb_codes_decode_to_linear_light() {
        let codes = vec![[118, 0, 255, 128]];
        for (encoding, red) in [(Encoding::Srgb, 0.18), (Encoding::Linear, 118.0 / 255.0)] {
            let pixels = ImagePixels::Rgba8(codes.clone(), encoding);
            let image = ImageData { width: 1, height: 1, pixels };
            let t =
                look(Wrap::Repeat, Bilinear, Chart::ENDLESS).lookup(&image, DVec2::new(0.3, 0.7));
            assert!((t.x - red).abs() < 0.002, "{encoding:?}: {t}");
            assert_eq!((t.y, t.z), (0.0, 1.0));
            assert!((t.w - 128.0 / 255.0).abs() < 1e-6, "coverage is never sRGB: {t}");
        }
    }

    /// Oracle: the curve and its inverse at its standard test points.
    #[test]
    fn srgb_table_inverts_the_encoding_curve() {
        for (linear, encoded) in [(0.18, 0.461_356_1), (0.5, 0.735_357), (0.003_130_8, 0.040_449_9)]
        {
            let code = encoded * 255.0_f64;
            let (low, high) = (SRGB[code.floor() as usize], SRGB[code.ceil() as usize]);
            let between = f64::from(low) + f64::from(high - low) * code.fract();
            assert!((between - linear).abs() < 2e-5, "{linear}: {between}");
        }
    }

    #[test]
    fn v_points_up_and_row_zero_is_the_top() {
        let image = gray(1, 4, |_, row| row as f32);
        assert_eq!(value(&image, Wrap::Repeat, Nearest, 0.5, 0.9), 0.0);
        assert_eq!(value(&image, Wrap::Repeat, Nearest, 0.5, 0.1), 3.0);
        assert_eq!(value(&image, Wrap::Repeat, Bilinear, 0.5, 0.875), 0.0);
        assert_eq!(value(&image, Wrap::Repeat, Bilinear, 0.5, 0.75), 0.5);
    }

    /// A sine which is periodic on the image, looked up across u = −1, 0, 1: steps between
    /// neighbouring lookups stay below the steepest slope of the sine. A clamp or a truncation toward
    /// zero would give a step of up to a whole texel.
    #[test]
    fn a_repeating_image_has_no_seam() {
        let n = 64;
        let image = gray(n, 1, |column, _| {
            (std::f32::consts::TAU * (column as f32 + 0.5) / n as f32).sin()
        });
        let step = 1.0 / 4096.0;
        for centre in [-1.0, 0.0, 1.0] {
            for k in -64..64 {
                let u = centre + f64::from(k) * step;
                let a = value(&image, Wrap::Repeat, Bilinear, u, 0.5);
                let b = value(&image, Wrap::Repeat, Bilinear, u + step, 0.5);
                assert!(
                    (a - b).abs() < 1.01 * std::f32::consts::TAU * step as f32,
                    "u = {u}: {a} {b}"
                );
                let exact = (std::f64::consts::TAU * u).sin() as f32;
                assert!((a - exact).abs() < 2.0 / 255.0);
            }
        }
    }

    /// Oracle: writing out what each wrap shows beside the unit square.
    #[test]
    fn wraps_continue_as_they_are_named() {
        let image = gray(4, 1, |column, _| column as f32);
        let at = |wrap, u| value(&image, wrap, Nearest, u, 0.5);
        let sample = |wrap| [-1.1, -0.1, 0.1, 0.9, 1.1, 1.9, 2.1].map(|u| at(wrap, u));
        assert_eq!(sample(Wrap::Repeat), [3.0, 3.0, 0.0, 3.0, 0.0, 3.0, 0.0]);
        assert_eq!(sample(Wrap::Mirror), [3.0, 0.0, 0.0, 3.0, 3.0, 0.0, 0.0]);
        assert_eq!(sample(Wrap::Clamp), [0.0, 0.0, 0.0, 3.0, 3.0, 3.0, 3.0]);
    }

    /// u = 10⁷ + ¼ is the same point as ¼, in every column.
    #[test]
    fn far_coordinates_keep_their_texel() {
        let image = gray(16, 16, |column, row| (column + 16 * row) as f32);
        for k in 0..16 {
            let u = (f64::from(k) + 0.25) / 16.0;
            for filter in [Nearest, Bilinear] {
                let near = value(&image, Wrap::Repeat, filter, u, 0.25);
                for far in [1e7, -1e7] {
                    let far = value(&image, Wrap::Repeat, filter, far + u, 0.25);
                    assert!((far - near).abs() < 1e-5, "{u} {filter:?}: {far} {near}");
                }
            }
        }
    }

    /// No panic and a value of the image, for every wrap, filter and 1 × 1 images too.
    #[test]
    fn coordinates_that_are_not_finite_read_a_texel() {
        for image in [gray(1, 1, |_, _| 0.5), gray(3, 2, |_, _| 0.5)] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                for filter in [Nearest, Bilinear] {
                    for u in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -1e-300, 1.0] {
                        assert_eq!(value(&image, wrap, filter, u, 0.5), 0.5);
                        assert_eq!(value(&image, wrap, filter, 0.5, u), 0.5);
                    }
                }
            }
        }
    }

    #[test]
    fn the_average_is_the_mean_of_linear_pixels() {
        let image = gray(3, 2, |column, row| (column + 3 * row) as f32);
        assert_eq!(average(&image), Rgb::splat(2.5));
    }

    /// What a look at every edge may see: rows and columns that differ, of which those at opposite ends are as far apart
    /// as they can be.
    fn ramp(columns: u32, rows: u32) -> Pyramid {
        let image = gray(columns, rows, |column, row| 100.0 * column as f32 + row as f32);
        Pyramid::new(std::sync::Arc::new(image), true)
    }

    /// Oracle: writing out the taps. Beyond an end there is the last texel, beyond a seam the other end, whatever the
    /// image repeats, is shifted or mirrored by; a quarter turn goes along.
    #[test]
    fn taps_beyond_an_edge_read_what_the_surface_has_there() {
        let pyramid = ramp(4, 8);
        let at = |chart: Chart, wrap: Wrap, m: [f64; 2], offset: DVec2, uv: DVec2| {
            let m = glam::DMat2::from_diagonal(DVec2::from(m));
            let domain = Domain::new(chart).placed(m, offset);
            let look = Look { domain, ..look(wrap, Bilinear, chart) };
            look.filtered(&pyramid, m * uv + offset, [Vec2::ZERO; 2]).x
        };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let once =
                |chart, u: f64, v: f64| at(chart, wrap, [1.0, 1.0], DVec2::ZERO, DVec2::new(u, v));
            for end in [1.0, 1.0 - 1e-9, 0.97] {
                assert_eq!(once(Chart::SQUARE, 0.125, end), 0.0, "{wrap:?}: the top row");
                assert_eq!(once(Chart::SQUARE, 0.125, 1.0 - end), 7.0, "{wrap:?}: the lowest row");
                assert_eq!(once(Chart::SQUARE, end, 0.9375), 300.0, "{wrap:?}: the last column");
            }
            // Halfway between the last column and the first, whatever the wrap.
            for u in [0.0, 1.0] {
                assert_eq!(once(Chart::AROUND, u, 0.9375), 150.0, "{wrap:?}");
                assert_eq!(once(Chart::TORUS, u, 0.9375), 150.0, "{wrap:?}");
            }
            assert_eq!(once(Chart::TORUS, 0.125, 0.0), 3.5, "{wrap:?}");
        }
        // Twice around and three times up: the image's own edges meet within, as it repeats, and not at the ends.
        let thrice = |v: f64| {
            at(Chart::AROUND, Wrap::Repeat, [2.0, 3.0], DVec2::ZERO, DVec2::new(0.0625, v))
        };
        assert_eq!((thrice(0.0), thrice(1.0)), (7.0, 0.0));
        assert!((thrice(1.0 / 3.0) - 3.5).abs() < 1e-5);
        // Upside down, and shifted by whole images.
        let turned = |v: f64| {
            at(Chart::AROUND, Wrap::Repeat, [1.0, -1.0], DVec2::new(0.0, 5.0), DVec2::new(0.125, v))
        };
        assert_eq!((turned(0.0), turned(1.0)), (0.0, 7.0));
        // Shifted by a half, an end lies where the image goes on.
        let shifted = at(
            Chart::AROUND,
            Wrap::Repeat,
            [1.0, 1.0],
            DVec2::new(0.0, 0.5),
            DVec2::new(0.125, 0.0),
        );
        assert_eq!(shifted, 3.0);
    }

    /// Around a pole a footprint is as long as a turn, or longer, and still narrow: it sees the rows that it covers and none
    /// from the other end, at any level of the pyramid. Oracle: the mean row over the part of the footprint that is
    /// on the surface.
    #[test]
    fn footprints_at_a_pole_stay_there() {
        let (columns, rows) = (64_u32, 32_u32);
        let image = gray(columns, rows, |_, row| (row as f32 + 0.5) / rows as f32);
        let pyramid = Pyramid::new(std::sync::Arc::new(image), true);
        let look = look(Wrap::Repeat, Bilinear, Chart::AROUND);
        for turns in [0.5, 1.0, 40.0, 1e9] {
            for high in [1.0, 2.0, 4.0] {
                let high = high / rows as f32;
                let axes = [Vec2::new(turns, 0.0), Vec2::new(0.0, high)];
                for (v, expected) in [(1.0, 0.0), (0.0, 1.0)] {
                    let seen = look.filtered(&pyramid, DVec2::new(0.3, v), axes).x;
                    assert!((seen - expected).abs() <= high, "{turns} {high} {v}: {seen}");
                }
            }
        }
        // Standing up, over half of the image: it is folded at the end.
        let upright = [Vec2::new(1.0 / 64.0, 0.0), Vec2::new(0.0, 0.5)];
        let seen = look.filtered(&pyramid, DVec2::new(0.3, 1.0), upright).x;
        assert!((seen - 0.125).abs() < 0.02, "{seen}");
    }
}
