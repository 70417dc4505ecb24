//! Surfaces of revolution: the numbers of their profiles, and where a profile goes wrong.

use super::Names;
use super::decode::{Report, decode};
use super::limits::{self, COORDINATE, WEIGHT};
use super::outline::{self, Kind};
use super::source::Cursor;
use super::surface::reference;
use crate::description::{Curve, CurveError, Shape};
use crate::math::{Profile, ProfileError};
use serde::Deserialize;
use std::sync::Arc;

/// Points of a profile at most: each takes about a kilobyte when it is made ready for rays.
const MAX_POINTS: usize = 65_536;

/// A surface of revolution as a scene file says it, its profile given there or by name.
#[derive(Deserialize)]
#[serde(rename = "Revolution", deny_unknown_fields)]
struct RevolutionFile<P> {
    #[serde(rename = "profile")]
    _profile: P,
    #[serde(default)]
    capped: bool,
}

/// Reads a surface of revolution and checks it.
pub(super) fn read_revolution(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Shape<String>> {
    let place = cursor.field("profile");
    if let Some(place) = place.as_ref().filter(|place| place.node.kind == Kind::Text) {
        let file = decode::<RevolutionFile<String>>(cursor, report)?;
        let name = outline::unquoted(place.text());
        if names.complete {
            reference(report, place, &name, &names.profiles, "profile", "profiles");
        }
        let profile = names.made.get(&name)?.clone();
        return Some(Shape::Revolution { profile, capped: file.capped });
    }
    let file = decode::<RevolutionFile<Curve>>(cursor, report)?;
    let profile = read_profile(&place?, report)?;
    Some(Shape::Revolution { profile, capped: file.capped })
}

/// Reads a profile and checks it.
pub(super) fn read_profile(cursor: &Cursor, report: &mut Report) -> Option<Arc<Profile>> {
    let curve = decode::<Curve>(cursor, report)?;
    let list = cursor.at("points");
    if curve.points().len() > MAX_POINTS {
        let message = format!("a profile has at most {MAX_POINTS} points");
        report.at("scene::profile", &list, message);
        return None;
    }
    let mut fine = true;
    for (index, point) in curve.points().iter().enumerate() {
        fine &= limits::vector(report, &list.nth(index), &point.to_array(), &COORDINATE);
    }
    let (weights, knots): (&[f64], &[f64]) = match &curve {
        Curve::Lines { .. } => (&[], &[]),
        Curve::Bezier { weights, .. } => (weights, &[]),
        Curve::Spline { weights, knots, .. } => (weights, knots),
    };
    fine &= limits::vector(report, &cursor.at("weights"), weights, &WEIGHT);
    fine &= limits::vector(report, &cursor.at("knots"), knots, &COORDINATE);
    if !fine {
        return None;
    }
    let made = curve.profile();
    made.map(Arc::new).map_err(|error| tell(&error, &curve, cursor, report)).ok()
}

fn tell(error: &CurveError, curve: &Curve, cursor: &Cursor, report: &mut Report) {
    let list = cursor.at("points");
    let (place, message, help) = match error {
        CurveError::Points { .. } | CurveError::Profile(ProfileError::TooLong { .. }) => {
            (list, error.to_string(), None)
        }
        CurveError::Length { list: name, expected: 0, .. } => {
            let message = "a closed spline has evenly spaced knots of its own".to_owned();
            (cursor.at(name), message, Some("leave out `knots`, or `closed`"))
        }
        CurveError::Length { list: name, .. } => (cursor.at(name), error.to_string(), None),
        CurveError::Knot { index, .. } => (cursor.at("knots").nth(*index), error.to_string(), None),
        CurveError::Profile(ProfileError::NegativeRadius { segment, radius }) => {
            let first = first_point(curve, *segment);
            let message = format!(
                "the curve of this point and those after it reaches the radius {radius:.3e}, and \
                 must not cross the axis"
            );
            let help = "the first number of a point is its distance from the axis: at least 0";
            (list.nth(first), message, Some(help))
        }
        CurveError::Profile(ProfileError::OutOfRange { segment }) => {
            let message = "this point or one after it is out of range".to_owned();
            (list.nth(first_point(curve, *segment)), message, None)
        }
        CurveError::Profile(ProfileError::Empty) => {
            let message = "no surface comes of this profile".to_owned();
            let help = "it needs points at different places, not all of them on the axis";
            (list, message, Some(help))
        }
    };
    report.at("scene::profile", &place, message).help = help.map(str::to_owned);
}

/// The first of the points which decide a segment.
fn first_point(curve: &Curve, segment: usize) -> usize {
    match curve {
        Curve::Lines { .. } => segment,
        Curve::Bezier { .. } => 3 * segment,
        Curve::Spline { points, knots, .. } => {
            // Segments are the intervals of knots which are not empty.
            let intervals =
                (3..points.len()).filter(|&k| knots.is_empty() || knots[k] < knots[k + 1]);
            intervals.map(|k| k - 3).nth(segment).unwrap_or(0)
        }
    }
}
