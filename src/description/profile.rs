//! Profiles of surfaces of revolution, as a scene file says them.

use crate::math::{Cubic, Profile, ProfileError, clamped_knots, spline};
use glam::DVec2;
use serde::Deserialize;
use serde::de::{Deserializer, Error};
use std::sync::Arc;

/// A plane curve; its points are (radius, height) in metres.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename = "profile", deny_unknown_fields)]
pub enum Curve {
    /// Straight lines from point to point.
    Lines {
        /// At least 2.
        points: Vec<DVec2>,
    },
    /// Cubic Bézier curves, each of which begins where the one before ends.
    Bezier {
        /// `3n + 1` of them: every third is on the curve.
        points: Vec<DVec2>,
        /// As many as points, or none: all 1.
        #[serde(default)]
        weights: Vec<f64>,
    },
    /// A cubic B-spline.
    Spline {
        /// At least 4.
        points: Vec<DVec2>,
        /// As many as points, or none: all 1.
        #[serde(default)]
        weights: Vec<f64>,
        /// `points + 4`, not decreasing; none: evenly spaced, such that the curve begins at the first point and
        /// ends at the last.
        #[serde(default)]
        knots: Vec<f64>,
        /// Whether the points are a ring of evenly spaced knots.
        #[serde(default)]
        closed: bool,
    },
}

/// What is wrong with a [`Curve`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// The number of points does not make a curve.
    #[error("{expected}, but there are {found}")]
    Points {
        /// How many there should be, in words.
        expected: &'static str,
        /// How many there are.
        found: usize,
    },
    /// A list beside the points has another length than it should.
    #[error("`{list}` needs {expected} numbers for {points} points, but has {found}")]
    Length {
        /// The name of the list.
        list: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many points there are.
        points: usize,
        /// How many there are.
        found: usize,
    },
    /// A knot is less than the one before, or four in the middle or five anywhere are equal.
    #[error("knot {index} {what}")]
    Knot {
        /// Which knot, from 0.
        index: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// The curve makes no surface.
    #[error(transparent)]
    Profile(#[from] ProfileError),
}

impl Curve {
    /// Its points.
    pub fn points(&self) -> &[DVec2] {
        match self {
            Self::Lines { points } | Self::Bezier { points, .. } | Self::Spline { points, .. } => {
                points
            }
        }
    }

    /// The curve as a chain of Bézier curves.
    ///
    /// # Errors
    /// When the lists do not fit together.
    pub fn segments(&self) -> Result<Vec<Cubic>, CurveError> {
        let found = self.points().len();
        let expected = |enough: bool, expected| {
            if enough { Ok(()) } else { Err(CurveError::Points { expected, found }) }
        };
        match self {
            Self::Lines { points } => {
                expected(found >= 2, "`Lines` needs at least 2 points")?;
                Ok(points.windows(2).map(|p| Cubic::line(p[0], p[1])).collect())
            }
            Self::Bezier { points, weights } => {
                let is_chain = found >= 4 && found % 3 == 1;
                expected(is_chain, "`Bezier` needs 3·n + 1 points (4, 7, 10, …)")?;
                let weights = padded(weights, found)?;
                let curve = |k: usize| {
                    let at = |i: usize| 3 * k + i;
                    Cubic::new(
                        [0, 1, 2, 3].map(|i| points[at(i)]),
                        [0, 1, 2, 3].map(|i| weights[at(i)]),
                    )
                };
                Ok((0..found / 3).map(curve).collect())
            }
            Self::Spline { points, weights, knots, closed } => {
                expected(found >= 4, "`Spline` needs at least 4 points")?;
                let weights = padded(weights, found)?;
                if *closed {
                    return closed_spline(points, &weights, knots);
                }
                let knots = if knots.is_empty() { clamped_knots(found) } else { knots.clone() };
                check_knots(&knots, found)?;
                Ok(spline(points, &weights, &knots))
            }
        }
    }

    /// The profile of the curve.
    ///
    /// # Errors
    /// When the lists do not fit together, or no surface comes of the curve.
    pub fn profile(&self) -> Result<Profile, CurveError> {
        Ok(Profile::new(&self.segments()?)?)
    }
}

fn padded(weights: &[f64], points: usize) -> Result<Vec<f64>, CurveError> {
    match weights.len() {
        0 => Ok(vec![1.0; points]),
        found if found == points => Ok(weights.to_vec()),
        found => Err(CurveError::Length { list: "weights", expected: points, points, found }),
    }
}

fn closed_spline(
    points: &[DVec2],
    weights: &[f64],
    knots: &[f64],
) -> Result<Vec<Cubic>, CurveError> {
    let count = points.len();
    if !knots.is_empty() {
        let found = knots.len();
        return Err(CurveError::Length { list: "knots", expected: 0, points: count, found });
    }
    let around = |k: usize| k % count;
    let points: Vec<DVec2> = (0..count + 3).map(|k| points[around(k)]).collect();
    let weights: Vec<f64> = (0..count + 3).map(|k| weights[around(k)]).collect();
    let even: Vec<f64> = (0..count + 7).map(|k| k as f64).collect();
    Ok(spline(&points, &weights, &even))
}

/// A curve of degree 3 is whole with at most 3 equal knots inside and 4 at either end.
pub(super) fn check_knots(knots: &[f64], points: usize) -> Result<(), CurveError> {
    let found = knots.len();
    if found != points + 4 {
        return Err(CurveError::Length { list: "knots", expected: points + 4, points, found });
    }
    if let Some(index) = (1..found).find(|&k| knots[k] < knots[k - 1]) {
        return Err(CurveError::Knot { index, what: "is less than the one before it" });
    }
    let equal = |index: &usize| knots[*index] == knots[*index + 3];
    if let Some(index) = (1..points).find(equal) {
        return Err(CurveError::Knot {
            index,
            what: "and three after it are equal: the curve breaks",
        });
    }
    Ok(())
}

/// Reads the curve of a shape and makes its profile.
pub(super) fn built<'d, D: Deserializer<'d>>(deserializer: D) -> Result<Arc<Profile>, D::Error> {
    let curve = Curve::deserialize(deserializer)?;
    curve.profile().map(Arc::new).map_err(D::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(list: &[[f64; 2]]) -> Vec<DVec2> {
        list.iter().copied().map(DVec2::from).collect()
    }

    const FOUR: [[f64; 2]; 4] = [[0.5, 0.0], [1.2, 0.3], [0.2, 0.9], [0.8, 1.2]];

    /// Oracle: a clamped spline of four points is the Bézier curve of these points.
    #[test]
    fn a_spline_of_four_points_is_their_bezier_curve() {
        let points = points(&FOUR);
        let bezier = Curve::Bezier { points: points.clone(), weights: vec![] };
        let spline = Curve::Spline { points, weights: vec![], knots: vec![], closed: false };
        assert_eq!(bezier.segments(), spline.segments());
        assert_eq!(bezier.profile(), spline.profile());
    }

    /// Oracle: each segment of a ring begins where the one before ends, the first after the last, with one
    /// tangent.
    #[test]
    fn a_closed_spline_is_a_smooth_ring() {
        let curve = Curve::Spline {
            points: points(&[[2.5, 0.0], [2.0, 0.5], [1.5, 0.0], [2.0, -0.5]]),
            weights: vec![1.0, 2.0, 1.0, 3.0],
            knots: vec![],
            closed: true,
        };
        let segments = curve.segments().expect("it is valid");
        assert_eq!(segments.len(), 4);
        for (k, segment) in segments.iter().enumerate() {
            let next = &segments[(k + 1) % 4];
            assert!(segment.at(1.0).distance(next.at(0.0)) < 1e-15);
            let [_, _, c, d] = segment.points();
            let [a, b, ..] = next.points();
            assert!((d - c).normalize().distance((b - a).normalize()) < 1e-12);
        }
        let profile = curve.profile().expect("it is valid");
        assert_eq!(profile.open_ends, [None, None]);
    }

    #[test]
    fn lists_which_do_not_fit_are_errors() {
        let four = points(&FOUR);
        let spline = |weights: &[f64], knots: &[f64], closed| {
            let (weights, knots) = (weights.to_vec(), knots.to_vec());
            let curve = Curve::Spline { points: points(&FOUR), weights, knots, closed };
            curve.segments().map_err(|error| error.to_string())
        };
        let told = |error: &str| Err(error.to_owned());
        assert_eq!(
            Curve::Bezier { points: four[..3].to_vec(), weights: vec![] }.segments(),
            Err(CurveError::Points {
                expected: "`Bezier` needs 3·n + 1 points (4, 7, 10, …)",
                found: 3
            })
        );
        assert_eq!(
            spline(&[1.0], &[], false),
            told("`weights` needs 4 numbers for 4 points, but has 1")
        );
        assert_eq!(
            spline(&[], &[0.0, 1.0], false),
            told("`knots` needs 8 numbers for 4 points, but has 2")
        );
        assert_eq!(
            spline(&[], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 5.5], false),
            told("knot 7 is less than the one before it")
        );
        assert_eq!(
            spline(&[], &[0.0, 1.0, 1.0, 1.0, 1.0, 5.0, 6.0, 7.0], false),
            told("knot 1 and three after it are equal: the curve breaks")
        );
        assert!(spline(&[], &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], false).is_ok());
        assert!(spline(&[], &[0.0; 8], true).is_err());
    }
}
