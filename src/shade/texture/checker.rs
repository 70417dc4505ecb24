//! A checkerboard in uv.

use crate::description::Rgb;
use glam::Vec2;

/// The field of edge length `size` which holds `uv`: `a` at the origin, `b` beside it.
///
/// Whole fields are counted by `floor`, so that the pattern goes on evenly through zero. Where
/// uv is not finite, or so large that fields can no longer be told apart, the answer is `a`.
#[inline]
#[expect(clippy::float_cmp, reason = "whole numbers")]
pub(super) fn color(uv: Vec2, size: f32, a: Rgb, b: Rgb) -> Rgb {
    let size = f64::from(size);
    let fields = (f64::from(uv.x) / size).floor() + (f64::from(uv.y) / size).floor();
    // The parity of an integer in a float; NaN and infinity compare unequal.
    if fields - 2.0 * (0.5 * fields).floor() == 1.0 { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Rgb = Rgb::new(0.8, 0.7, 0.6);
    const B: Rgb = Rgb::new(0.1, 0.2, 0.3);

    /// Oracle: counting fields by hand, on both sides of zero.
    #[test]
    fn fields_alternate_through_zero() {
        for (uv, expected) in [
            ((0.1, 0.1), A),
            ((0.6, 0.1), B),
            ((0.6, 0.6), A),
            ((-0.1, 0.1), B),
            ((-0.1, -0.1), A),
            ((-0.6, 0.1), A),
            ((0.1, -0.6), A),
            ((-0.6, -0.1), B),
        ] {
            assert_eq!(color(uv.into(), 0.5, A, B), expected, "{uv:?}");
        }
    }

    /// 10 × 10 fields of 0.1 on a unit square: the floor must not depend on rounding of `uv/size`
    /// at the centres of the fields.
    #[test]
    fn ten_by_ten_fields_fill_the_unit_square() {
        for row in 0..10 {
            for col in 0..10 {
                let uv = Vec2::new(col as f32 + 0.5, row as f32 + 0.5) * 0.1;
                let expected = if (row + col) % 2 == 0 { A } else { B };
                assert_eq!(color(uv, 0.1, A, B), expected);
            }
        }
    }

    #[test]
    fn coordinates_that_are_not_finite_have_a_colour() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            assert_eq!(color(Vec2::new(x, 0.25), 0.5, A, B), A);
        }
    }
}
