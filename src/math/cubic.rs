//! Rational cubic Bézier curves in the plane, and B-splines as sequences of them.
//!
//! A curve is kept in homogeneous form: `P(t) = Σ Bₖ(t)·wₖ·(pₖ, 1)` with the Bernstein polynomials `Bₖ` and the
//! weights `wₖ > 0`, and its point is `(P.x/P.z, P.y/P.z)`. With weights of 1 it is the plain curve; with
//! others it can be an exact circle. The *blossom* `b(x, y, z)` is the symmetric function, affine in each of
//! its three arguments, for which `b(t, t, t) = P(t)`; the control points of the piece from `a` to `b` are its
//! values at `aaa`, `aab`, `abb`, `bbb` (Ramshaw 1989, "Blossoms are polar forms", *Computer Aided Geometric
//! Design* 6, section 4).

use glam::{DVec2, DVec3};
use std::ops::{Add, Mul};

/// A rational cubic Bézier curve: its control points times their weights, and the weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cubic(pub [DVec3; 4]);

impl Cubic {
    /// The curve of four control points with their weights.
    pub fn new(points: [DVec2; 4], weights: [f64; 4]) -> Self {
        Self(std::array::from_fn(|k| (points[k] * weights[k]).extend(weights[k])))
    }

    /// The straight line.
    pub fn line(from: DVec2, to: DVec2) -> Self {
        Self::new([from, from.lerp(to, 1.0 / 3.0), from.lerp(to, 2.0 / 3.0), to], [1.0; 4])
    }

    /// The blossom.
    fn blossom(&self, args: [f64; 3]) -> DVec3 {
        let mut row = self.0;
        for (n, t) in [3, 2, 1].into_iter().zip(args) {
            for k in 0..n {
                row[k] = row[k] * (1.0 - t) + row[k + 1] * t;
            }
        }
        row[0]
    }

    /// The point at `t`.
    pub fn at(&self, t: f64) -> DVec2 {
        let p = self.blossom([t; 3]);
        p.truncate() / p.z
    }

    /// The part from `a` to `b`, its parameter running from 0 to 1.
    #[must_use]
    pub fn part(&self, a: f64, b: f64) -> Self {
        Self([[a, a, a], [a, a, b], [a, b, b], [b, b, b]].map(|args| self.blossom(args)))
    }

    /// The control points without their weights.
    pub fn points(&self) -> [DVec2; 4] {
        self.0.map(|p| p.truncate() / p.z)
    }

    /// Whether all weights are equal: a polynomial curve.
    pub fn is_polynomial(&self) -> bool {
        self.0.iter().all(|p| p.z == self.0[0].z)
    }
}

/// A cubic B-spline with control points `points`, their weights, and `points + 4` knots which do not
/// decrease, as one curve for each interval of knots which is not empty.
pub fn spline(points: &[DVec2], weights: &[f64], knots: &[f64]) -> Vec<Cubic> {
    let homogeneous: Vec<DVec3> =
        points.iter().zip(weights).map(|(p, w)| (*p * *w).extend(*w)).collect();
    bezier_of_spline(&homogeneous, knots).into_iter().map(Cubic).collect()
}

/// What control points are made of: vectors.
pub trait Control: Copy + Add<Output = Self> + Mul<f64, Output = Self> {}

impl<V: Copy + Add<Output = Self> + Mul<f64, Output = Self>> Control for V {}

/// A cubic B-spline of any vectors, with as many knots and 4 more which do not decrease: the control points of one
/// Bézier curve for each interval of knots which is not empty.
///
/// They are blossoms, evaluated by de Boor's algorithm, each step of which takes one of their arguments.
pub fn bezier_of_spline<V: Control>(points: &[V], knots: &[f64]) -> Vec<[V; 4]> {
    let mut curves: Vec<[V; 4]> = Vec::new();
    for i in 3..points.len() {
        let (a, b) = (knots[i], knots[i + 1]);
        if a < b {
            let around: [f64; 6] = std::array::from_fn(|k| knots[i - 2 + k]);
            let control: [V; 4] = std::array::from_fn(|k| points[i - 3 + k]);
            let args = [[a, a, a], [a, a, b], [a, b, b], [b, b, b]];
            let mut curve = args.map(|args| de_boor(control, around, args));
            // The bits of where the one before ends, which are rounded otherwise.
            if let Some([.., end]) = curves.last() {
                curve[0] = *end;
            }
            curves.push(curve);
        }
    }
    curves
}

/// The blossom of an interval of a B-spline: its four control points and the three knots to either side.
fn de_boor<V: Control>(mut row: [V; 4], knots: [f64; 6], args: [f64; 3]) -> V {
    for (step, t) in args.into_iter().enumerate() {
        for k in 0..3 - step {
            let (from, to) = (knots[k + step], knots[k + 3]);
            let share = (t - from) / (to - from);
            row[k] = row[k] * (1.0 - share) + row[k + 1] * share;
        }
    }
    row[0]
}

/// Knots for `count` points such that the curve begins at the first and ends at the last, evenly spaced
/// between.
pub fn clamped_knots(count: usize) -> Vec<f64> {
    let last = count.saturating_sub(3);
    (0..count + 4).map(|k| k.saturating_sub(3).min(last) as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [DVec2; 6] = [
        DVec2::new(0.5, 0.0),
        DVec2::new(1.2, 0.3),
        DVec2::new(0.2, 0.9),
        DVec2::new(0.8, 1.2),
        DVec2::new(0.1, 1.5),
        DVec2::new(0.4, 1.9),
    ];

    /// Oracle: the Cox–de Boor recursion.
    fn basis(knots: &[f64], i: usize, degree: usize, t: f64) -> f64 {
        if degree == 0 {
            return f64::from(u8::from(knots[i] <= t && t < knots[i + 1]));
        }
        let side =
            |from: f64, to: f64, x: f64| if to > from { (x - from) / (to - from) } else { 0.0 };
        side(knots[i], knots[i + degree], t) * basis(knots, i, degree - 1, t)
            + (knots[i + degree + 1] - t).max(0.0)
                / (knots[i + degree + 1] - knots[i + 1]).max(1e-300)
                * basis(knots, i + 1, degree - 1, t)
    }

    #[test]
    fn a_spline_is_the_sum_of_its_basis_functions() {
        let weights = [1.0, 0.5, 2.0, 1.0, 3.0, 1.0];
        let even: Vec<f64> = (0..10).map(f64::from).collect();
        let uneven = vec![0.0, 0.0, 0.0, 0.0, 0.3, 1.0, 2.0, 2.0, 2.0, 2.0];
        for knots in [even, uneven, clamped_knots(6)] {
            let curves = spline(&POINTS, &weights, &knots);
            assert_eq!(curves.len(), 3);
            for (k, curve) in curves.iter().enumerate() {
                let (a, b) = (knots[k + 3], knots[k + 4]);
                for j in 0..10_u8 {
                    let u = f64::from(j) / 10.0;
                    let t = a + (b - a) * u;
                    let shares: Vec<f64> =
                        (0..6).map(|i| weights[i] * basis(&knots, i, 3, t)).collect();
                    let sum: f64 = shares.iter().sum();
                    let expected: DVec2 =
                        shares.iter().zip(POINTS).map(|(share, p)| p * *share / sum).sum();
                    assert!(curve.at(u).distance(expected) < 1e-14, "{knots:?} at {t}");
                }
            }
        }
        let curves = spline(&POINTS, &weights, &clamped_knots(6));
        assert_eq!((curves[0].at(0.0), curves[2].at(1.0)), (POINTS[0], POINTS[5]));
    }

    /// Oracle: a uniform spline weighs the points at a knot by 1/6, 2/3, 1/6.
    #[test]
    fn a_knot_of_an_even_spline_is_weighed_by_sixths() {
        let knots: Vec<f64> = (0..8).map(f64::from).collect();
        let start = spline(&POINTS[..4], &[1.0; 4], &knots)[0].at(0.0);
        let expected = (POINTS[0] + POINTS[1] * 4.0 + POINTS[2]) / 6.0;
        assert!(start.distance(expected) < 1e-15);
    }

    /// Oracle: the circle, exact with weights 1, (1+√2)/3, (1+√2)/3, 1.
    #[test]
    fn weights_make_an_exact_quarter_circle_and_parts_lie_on_the_whole() {
        let w = (1.0 + 2.0_f64.sqrt()) / 3.0;
        let h = 2.0 - 2.0_f64.sqrt();
        let points = [DVec2::X, DVec2::new(1.0, h), DVec2::new(h, 1.0), DVec2::Y];
        let quarter = Cubic::new(points, [1.0, w, w, 1.0]);
        let part = quarter.part(0.2, 0.7);
        for k in 0..=16_u8 {
            let t = f64::from(k) / 16.0;
            assert!((quarter.at(t).length() - 1.0).abs() < 1e-15, "{t}");
            assert!(part.at(t).distance(quarter.at(0.2 + 0.5 * t)) < 1e-15);
        }
        assert!(!quarter.is_polynomial() && Cubic::line(DVec2::X, DVec2::Y).is_polynomial());
    }
}
