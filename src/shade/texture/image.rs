//! Looking up pixels: wrapping, filtering, decoding.
//!
//! Texel `i` of `n` covers `[i, i + 1)/n`; its centre is `(i + ½)/n`. Each of the four taps of the
//! bilinear filter is wrapped by itself, so that a repeating image has no seam. Coordinates are
//! reduced in `f64`: at uv = 10⁷ an `f32` product with the resolution would have lost the texel.

use super::pyramid::Pyramid;
use crate::color::luminance;
use crate::description::{
    Channel, Encoding, ImageData, ImagePixels, Rgb, TextureFilter, TextureFiltering, Wrap,
};
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
}

/// Most probes along the longer axis of a footprint; one that is longer still is looked at with wider probes.
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
        let unfiltered = self.filter == TextureFilter::Nearest
            || self.filtering == TextureFiltering::Point
            || axes == [Vec2::ZERO; 2];
        if unfiltered {
            return lookup(image, self.wrap, self.filter, uv);
        }
        let size = Vec2::new(image.width as f32, image.height as f32);
        let [a, b] = axes.map(|axis| (axis * size).length());
        let (longer, axis) = if a >= b { (a, axes[0]) } else { (b, axes[1]) };
        let shorter = a.min(b);
        // Footprints that no number describes see the mean of the image.
        if !longer.is_finite() {
            return self.level(pyramid, f32::INFINITY, uv);
        }
        match self.filtering {
            TextureFiltering::Anisotropic if longer > 1.0 => {
                let width = shorter.max(longer / MOST_PROBES).max(1.0);
                let probes = (longer / width).ceil().max(1.0);
                let mut sum = Vec4::ZERO;
                for k in 0..probes as u32 {
                    let along = f64::from((k as f32 + 0.5) / probes - 0.5);
                    sum += self.level(pyramid, width.log2(), uv + axis.as_dvec2() * along);
                }
                sum / probes
            }
            _ => self.level(pyramid, longer.log2(), uv),
        }
    }

    /// Between two levels of a pyramid.
    fn level(self, pyramid: &Pyramid, level: f32, uv: DVec2) -> Vec4 {
        let last = pyramid.len() - 1;
        let at = |level: usize| lookup(pyramid.level(level), self.wrap, self.filter, uv);
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
}

/// Linear colour and coverage at `uv`. An axis whose coordinate is not finite reads texel 0.
#[inline]
pub(super) fn lookup(image: &ImageData, wrap: Wrap, filter: TextureFilter, uv: DVec2) -> Vec4 {
    let (width, height) = (image.width, image.height);
    // Rows are stored from the top, v points up.
    let x = texel_coordinate(uv.x, wrap, width);
    let y = texel_coordinate(1.0 - uv.y, wrap, height);
    match filter {
        TextureFilter::Nearest => {
            let column = tap(x.floor() as i64, wrap, width);
            texel(image, column, tap(y.floor() as i64, wrap, height))
        }
        TextureFilter::Bilinear => {
            let (x, y) = (x - 0.5, y - 0.5);
            let (x0, y0) = (x.floor(), y.floor());
            let (tx, ty) = ((x - x0) as f32, (y - y0) as f32);
            let columns = [x0 as i64, x0 as i64 + 1].map(|x| tap(x, wrap, width));
            let rows = [y0 as i64, y0 as i64 + 1].map(|y| tap(y, wrap, height));
            let [top, bottom] = rows.map(|row| {
                let [left, right] = columns.map(|column| texel(image, column, row));
                left + (right - left) * tx
            });
            top + (bottom - top) * ty
        }
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

/// A coordinate in texels, reduced to about one period so that it converts to an integer.
#[inline]
fn texel_coordinate(u: f64, wrap: Wrap, size: u32) -> f64 {
    if !u.is_finite() {
        return 0.5; // the centre of texel 0
    }
    let reduced = match wrap {
        Wrap::Repeat => u - u.floor(),
        Wrap::Mirror => u - 2.0 * (0.5 * u).floor(),
        Wrap::Clamp => u.clamp(0.0, 1.0),
    };
    reduced * f64::from(size)
}

/// The texel which a tap at integer position `i` reads; `i` lies at most one beyond the period.
#[inline]
fn tap(i: i64, wrap: Wrap, size: u32) -> u32 {
    let size = i64::from(size);
    let wrapped = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * size);
            if i < size { i } else { 2 * size - 1 - i }
        }
        Wrap::Clamp => i.clamp(0, size - 1),
    };
    wrapped as u32
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

    fn value(image: &ImageData, wrap: Wrap, filter: TextureFilter, u: f64, v: f64) -> f32 {
        lookup(image, wrap, filter, DVec2::new(u, v)).x
    }

    /// Oracle: the 18 % grey of the sRGB standard has the code 118, and 0 and 255 are the ends.
    #[test]
    fn srgb_codes_decode_to_linear_light() {
        let codes = vec![[118, 0, 255, 128]];
        for (encoding, red) in [(Encoding::Srgb, 0.18), (Encoding::Linear, 118.0 / 255.0)] {
            let pixels = ImagePixels::Rgba8(codes.clone(), encoding);
            let image = ImageData { width: 1, height: 1, pixels };
            let t = lookup(&image, Wrap::Repeat, Bilinear, DVec2::new(0.3, 0.7));
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
}
