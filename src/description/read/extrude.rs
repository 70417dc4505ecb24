//! Solids drawn out of outlines and of words.

use super::decode::Report;
use super::limits::{self, COORDINATE, CREASE, LENGTH, WEIGHT};
use super::source::Cursor;
use crate::description::modelling::{
    Alignment, Filling, TextError, extruded, flattened, text_contours,
};
use crate::description::{Curve, TriangleMesh};
use glam::DVec2;
use std::path::Path;

/// What is said of a solid beside its outline: depth, tolerance and from which angle on edges are sharp.
pub(super) type Drawn = (f64, f64, f64);

fn check_drawn(cursor: &Cursor, (depth, tolerance, smooth): Drawn, report: &mut Report) -> bool {
    let depth = limits::number(report, &cursor.at("depth"), depth, &LENGTH);
    let tolerance = limits::number(report, &cursor.at("tolerance"), tolerance, &LENGTH);
    depth & tolerance & limits::number(report, &cursor.at("smooth"), smooth, &CREASE)
}

/// The solid of a figure.
pub(super) fn extrusion(
    cursor: &Cursor,
    outline: &[Curve],
    drawn: Drawn,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let mut fine = check_drawn(cursor, drawn, report);
    let list = cursor.at("outline");
    let mut contours: Vec<Vec<DVec2>> = Vec::new();
    for (index, curve) in outline.iter().enumerate() {
        let place = list.nth(index);
        for (k, point) in curve.points().iter().enumerate() {
            let place = place.at("points").nth(k);
            fine &= limits::vector(report, &place, &point.to_array(), &COORDINATE);
        }
        if let Curve::Bezier { weights, .. } | Curve::Spline { weights, .. } = curve {
            fine &= limits::vector(report, &place.at("weights"), weights, &WEIGHT);
        }
        if let Curve::Spline { knots, .. } = curve {
            fine &= limits::vector(report, &place.at("knots"), knots, &COORDINATE);
        }
        if !fine {
            continue;
        }
        match curve.segments() {
            Ok(segments) => {
                // It goes straight back to where it began, unless it is there.
                let mut points = flattened(&segments, drawn.1);
                let start = segments.first().map(|first| first.points()[0]);
                points.extend(start.filter(|start| points.last() != Some(start)));
                contours.push(points);
            }
            Err(error) => {
                report.at("scene::profile", &place, error.to_string());
                fine = false;
            }
        }
    }
    if !fine {
        return None;
    }
    let (depth, _, smooth) = drawn;
    solid(&list, extruded(&contours, Filling::EvenOdd, depth, smooth), report)
}

/// The solid of a text in the font of a file.
pub(super) fn words(
    cursor: &Cursor,
    (text, size, align): (&str, f64, Alignment),
    path: &Path,
    drawn: Drawn,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let fine = check_drawn(cursor, drawn, report);
    if !limits::number(report, &cursor.at("size"), size, &LENGTH) || !fine {
        return None;
    }
    let (depth, tolerance, smooth) = drawn;
    let font = std::fs::read(path).map_err(|error| {
        report.at("scene::asset", &cursor.at("font"), format!("cannot be read: {error}"));
    });
    match text_contours(&font.ok()?, text, (size, tolerance), align) {
        Ok(contours) => {
            let mesh = extruded(&contours, Filling::NonZero, depth, smooth);
            solid(&cursor.at("text"), mesh, report)
        }
        Err(error) => {
            let field = if matches!(error, TextError::NotAFont(_)) { "font" } else { "text" };
            report.at("scene::asset", &cursor.at(field), error.to_string());
            None
        }
    }
}

/// The mesh, unless nothing came of the outline.
fn solid(place: &Cursor, mesh: TriangleMesh, report: &mut Report) -> Option<TriangleMesh> {
    if mesh.triangles.is_empty() {
        report.at("scene::mesh", place, "this outline goes around nothing");
        return None;
    }
    Some(mesh)
}
