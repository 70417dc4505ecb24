//! Patterns in uv, filtered by their exact mean over the box around a footprint.
//!
//! A pattern of stripes is a square wave; its mean over an interval is a difference of its integral
//! (Ebert et al. 2003, *Texturing and Modeling: A Procedural Approach*, 3rd ed., chapter 2, "Analytic
//! Prefiltering"). A checkerboard is made of two waves, a wall of bricks of two for each row.

use super::point::TexturePoint;
use glam::{DVec2, Vec2};

/// The mean over `[x − w/2, x + w/2]` of the wave which is 0 on `[0, share)` and 1 on `[share, 1)`, with
/// period 1.
///
/// Whole periods are counted by `floor`, so that the wave goes on evenly through 0. Where `x` is not finite,
/// or so large that periods can no longer be told apart, it is 0.
#[inline]
fn wave(x: f64, w: f64, share: f64) -> f64 {
    let x = x - x.floor();
    if x.is_nan() {
        return 0.0;
    }
    if w <= 0.0 {
        return f64::from(u8::from(x >= share));
    }
    let integral = |x: f64| x.floor() * (1.0 - share) + (x - x.floor() - share).max(0.0);
    // An infinite footprint sees the mean.
    if w < 1e15 { (integral(x + 0.5 * w) - integral(x - 0.5 * w)) / w } else { 1.0 - share }
}

/// How much of a checkerboard is not the field at the origin.
#[inline]
pub(super) fn checker(at: &TexturePoint, size: f32) -> f32 {
    let period = 2.0 * f64::from(size);
    let (uv, w) = (at.uv.as_dvec2() / period, at.extent().as_dvec2() / period);
    let (u, v) = (wave(uv.x, w.x, 0.5), wave(uv.y, w.y, 0.5));
    (u + v - 2.0 * u * v) as f32
}

/// How much of stripes is not the one at the origin.
#[inline]
pub(super) fn stripes(at: &TexturePoint, size: f32, share: f32) -> f32 {
    let period = f64::from(size);
    let (u, w) = (f64::from(at.uv.x) / period, f64::from(at.extent().x) / period);
    wave(u, w, f64::from(share)) as f32
}

/// What of a wall is at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Brick {
    /// How much of it is brick: 1 on a brick, 0 in the mortar, between on a bevel.
    pub(super) solid: f32,
    /// A number of the brick in `[0, 1)`.
    pub(super) number: f32,
}

/// A wall of bricks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    pub(super) size: Vec2,
    pub(super) mortar: f32,
    pub(super) bevel: f32,
    pub(super) shift: f32,
    pub(super) period: u32,
    pub(super) seed: u32,
}

impl Wall {
    /// The brick at a point; bricks and mortar smaller than the footprint fade to their mean.
    pub(super) fn at(&self, at: &TexturePoint) -> Brick {
        let size = self.size.as_dvec2();
        let uv = at.uv.as_dvec2() / size;
        if !uv.is_finite() {
            return Brick { solid: 1.0, number: 0.0 };
        }
        let row = uv.y.floor();
        let x = uv.x + f64::from(self.shift) * row.rem_euclid(2.0);
        let column = x.floor();
        let within = DVec2::new(x - column, uv.y - row) * size;
        let to_edge = within.min(size - within).min_element() - 0.5 * f64::from(self.mortar);
        let mean = {
            let free = (size - f64::from(self.mortar + self.bevel)).max(DVec2::ZERO);
            (free.x * free.y / (size.x * size.y)) as f32
        };
        let extent = at.extent();
        let blur = fade((extent / self.size).max_element());
        if blur == 0.0 {
            return Brick { solid: mean, number: 0.5 };
        }
        // The edge is softened over the footprint; footprints of whole bricks see the mean of all.
        let soft = f64::from(self.bevel.max(extent.max_element()));
        let solid = if soft > 0.0 {
            smooth((to_edge - 0.5 * (f64::from(self.bevel) - soft)) / soft)
        } else {
            f32::from(u8::from(to_edge >= 0.0))
        };
        let column = match self.period {
            0 => column,
            period => column.rem_euclid(f64::from(period)),
        };
        let number = hash(column as i64 as u32, row as i64 as u32, self.seed);
        Brick { solid: mean + (solid - mean) * blur, number: 0.5 + (number - 0.5) * blur }
    }
}

/// A cubic from 0 to 1 with level ends.
#[inline]
pub(super) fn smooth(x: f64) -> f32 {
    let x = x.clamp(0.0, 1.0);
    (x * x * (3.0 - 2.0 * x)) as f32
}

/// How much is left of a feature under a footprint of so many times its size: all below a quarter, nothing
/// above one.
#[inline]
pub(super) fn fade(relative: f32) -> f32 {
    1.0 - smooth(f64::from((relative - 0.25) / 0.75))
}

/// A number in `[0, 1)` for a cell (O'Neill 2014, "PCG", as used by Jarzynski and Olano 2020, "Hash Functions
/// for GPU Rendering", JCGT 9(3), chained).
pub(super) fn hash(i: u32, j: u32, seed: u32) -> f32 {
    let pcg = |v: u32| {
        let v = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let w = ((v >> ((v >> 28) + 4)) ^ v).wrapping_mul(277_803_737);
        (w >> 22) ^ w
    };
    let bits = pcg(i.wrapping_add(pcg(j.wrapping_add(pcg(seed)))));
    (bits >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(uv: (f32, f32), axes: [Vec2; 2]) -> TexturePoint {
        TexturePoint { axes, ..TexturePoint::at(uv.into()) }
    }

    /// Oracle: counting fields by hand, on both sides of zero.
    #[test]
    fn fields_alternate_through_zero() {
        for (uv, expected) in [
            ((0.1, 0.1), 0.0),
            ((0.6, 0.1), 1.0),
            ((0.6, 0.6), 0.0),
            ((-0.1, 0.1), 1.0),
            ((-0.1, -0.1), 0.0),
            ((-0.6, 0.1), 0.0),
            ((0.1, -0.6), 0.0),
            ((-0.6, -0.1), 1.0),
        ] {
            assert_eq!(checker(&TexturePoint::at(uv.into()), 0.5), expected, "{uv:?}");
        }
    }

    /// 10 × 10 fields of 0.1 on a unit square: the floor must not depend on rounding of `uv/size`
    /// at the centres of the fields.
    #[test]
    fn ten_by_ten_fields_fill_the_unit_square() {
        for row in 0..10 {
            for col in 0..10 {
                let uv = Vec2::new(col as f32 + 0.5, row as f32 + 0.5) * 0.1;
                let expected = if (row + col) % 2 == 0 { 0.0 } else { 1.0 };
                assert_eq!(checker(&TexturePoint::at(uv), 0.1), expected);
            }
        }
    }

    #[test]
    fn coordinates_that_are_not_finite_have_a_value() {
        let wall =
            Wall { size: Vec2::ONE, mortar: 0.1, bevel: 0.0, shift: 0.5, period: 0, seed: 0 };
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            let at = TexturePoint::at(Vec2::new(x, 0.25));
            assert_eq!(checker(&at, 0.5), 0.0);
            assert_eq!(stripes(&at, 0.5, 0.3), 0.0);
            assert!(wall.at(&at).solid.is_finite());
            let wide = seen((0.2, 0.3), [Vec2::new(x, 0.0), Vec2::Y]);
            for value in [checker(&wide, 0.5), stripes(&wide, 0.5, 0.3), wall.at(&wide).solid] {
                assert!((0.0..=1.0).contains(&value) || x.is_nan(), "{x}: {value}");
            }
        }
    }

    /// Oracle: the mean of many points of the footprint, for footprints along the axes.
    #[test]
    fn filtered_patterns_are_means() {
        for (k, axes) in [(0.03, 0.02), (0.4, 0.1), (1.7, 3.1), (0.0, 0.6)].into_iter().enumerate()
        {
            let (w, h) = axes;
            let uv = (0.13 + 0.21 * k as f32, -0.37);
            let at = seen(uv, [Vec2::new(w, 0.0), Vec2::new(0.0, h)]);
            let n = 400;
            let mut sums = [0.0_f64; 2];
            for i in 0..n * n {
                let s = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32 - 0.5;
                let point = TexturePoint::at(at.uv + s * Vec2::new(w, h));
                sums[0] += f64::from(checker(&point, 0.25));
                sums[1] += f64::from(stripes(&point, 0.3, 0.2));
            }
            let [a, b] = sums.map(|sum| sum / f64::from(n * n));
            assert!((f64::from(checker(&at, 0.25)) - a).abs() < 4e-3, "{axes:?}: {a}");
            assert!((f64::from(stripes(&at, 0.3, 0.2)) - b).abs() < 4e-3, "{axes:?}: {b}");
        }
    }

    /// A wall wrapped around a ball has no seam: the bricks after so many are those before, and else they are not.
    #[test]
    fn bricks_repeat_after_their_period() {
        let wall = |period| Wall {
            size: Vec2::new(0.24, 0.08),
            mortar: 0.01,
            bevel: 0.016,
            shift: 0.5,
            period,
            seed: 9,
        };
        let mut differ = 0;
        for k in 0..200 {
            let uv = Vec2::new(0.037 * k as f32 - 3.0, 0.011 * k as f32);
            let at = |wall: Wall, around: f32| wall.at(&TexturePoint::at(uv + Vec2::X * around));
            let (here, there) = (at(wall(24), 0.0), at(wall(24), 24.0 * 0.24));
            assert!((here.solid - there.solid).abs() < 1e-3);
            // In the mortar it is a matter of rounding which brick is meant.
            assert!(here.solid < 0.01 || here.number == there.number);
            differ += u32::from(at(wall(0), 0.0).number != at(wall(0), 24.0 * 0.24).number);
        }
        assert!(differ > 190);
    }

    /// Oracle: the area of bricks in a wall, counted; and a footprint of many bricks sees about that share.
    #[test]
    fn a_wall_has_its_share_of_mortar() {
        let wall = Wall {
            size: Vec2::new(0.3, 0.1),
            mortar: 0.02,
            bevel: 0.0,
            shift: 0.5,
            period: 0,
            seed: 3,
        };
        let n = 600;
        let mut solid = 0.0;
        for i in 0..n * n {
            let uv = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32 * 3.0;
            solid += f64::from(wall.at(&TexturePoint::at(uv)).solid);
        }
        let share = 0.28 * 0.08 / (0.3 * 0.1);
        assert!((solid / f64::from(n * n) - share).abs() < 3e-3);
        let far = wall.at(&seen((0.1, 0.2), [Vec2::new(2.0, 0.0), Vec2::new(0.0, 2.0)]));
        assert!((f64::from(far.solid) - share).abs() < 1e-6 && far.number == 0.5);
    }
}
