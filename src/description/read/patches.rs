//! Meshes of bicubic patches: their numbers, and where they go wrong.

use super::decode::Report;
use super::limits::{self, COORDINATE, LENGTH, WEIGHT};
use super::source::Cursor;
use super::surface::check_triangle_count;
use crate::description::TriangleMesh;
use crate::description::modelling::{Patch, Placed, Run, cells_for, patch_mesh, spline_patches};
use crate::description::profile::check_knots;
use crate::math::{Chart, Edge};
use glam::{DVec2, DVec3, DVec4};

/// Bézier patches by their control points.
pub(super) fn bezier_mesh(
    cursor: &Cursor,
    (points, weights): (&[DVec3], Vec<f64>),
    patches: &[Vec<u32>],
    tolerance: f64,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let weights = if weights.is_empty() { vec![1.0; points.len()] } else { weights };
    let mut fine = check_net(cursor, "points", &[points], report);
    fine &= check_weights(cursor, &[&weights], &[points], report);
    let list = cursor.at("patches");
    if patches.is_empty() {
        report.at("scene::mesh", &list, "a mesh of patches needs at least one");
        fine = false;
    }
    for (index, patch) in patches.iter().enumerate() {
        let place = list.nth(index);
        if patch.len() != 16 {
            let message =
                format!("a patch has 16 control points, four rows of four, not {}", patch.len());
            report.at("scene::mesh", &place, message);
            fine = false;
        } else if let Some(k) = patch.iter().position(|k| *k as usize >= points.len()) {
            let message = format!("there are only {} points, counted from 0", points.len());
            report.at("scene::mesh", &place.nth(k), message);
            fine = false;
        }
    }
    if !fine {
        return None;
    }
    let placed = |patch: &Vec<u32>| {
        let at = |k: usize| patch[k] as usize;
        let net = std::array::from_fn(|k| points[at(k)]);
        let weights = std::array::from_fn(|k| weights[at(k)]);
        (Patch::new(net, weights), [DVec2::ZERO, DVec2::ONE])
    };
    mesh_within(cursor, &patches.iter().map(placed).collect::<Vec<_>>(), tolerance, report)
}

/// A B-spline surface by its rows of control points.
pub(super) fn spline_mesh(
    cursor: &Cursor,
    (rows, weights): (&[Vec<DVec3>], &[Vec<f64>]),
    (knots_u, knots_v): (Vec<f64>, Vec<f64>),
    closed: (bool, bool),
    tolerance: f64,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let lists: Vec<&[DVec3]> = rows.iter().map(Vec::as_slice).collect();
    let mut fine = check_net(cursor, "rows", &lists, report);
    let columns = rows.first().map_or(0, Vec::len);
    let place = cursor.at("rows");
    if rows.len() < 4 || columns < 4 {
        let message = format!(
            "a bicubic surface needs at least 4 rows of 4 points, not {} of {columns}",
            rows.len()
        );
        report.at("scene::mesh", &place, message);
        return None;
    }
    for (index, row) in rows.iter().enumerate().filter(|(_, row)| row.len() != columns) {
        let message = format!("this row has {} points, and the first one {columns}", row.len());
        report.at("scene::mesh", &place.nth(index), message);
        fine = false;
    }
    let even: Vec<Vec<f64>> = rows.iter().map(|row| vec![1.0; row.len()]).collect();
    let weights = if weights.is_empty() { &even } else { weights };
    let weight_lists: Vec<&[f64]> = weights.iter().map(Vec::as_slice).collect();
    fine &= check_weights(cursor, &weight_lists, &lists, report);
    let runs =
        [("knots_u", knots_u, closed.0, columns), ("knots_v", knots_v, closed.1, rows.len())]
            .map(|(name, knots, closed, count)| run(cursor, name, knots, (closed, count), report));
    let [Some(along_u), Some(along_v)] = runs else { return None };
    if !fine {
        return None;
    }
    let homogeneous = |(p, w): (&DVec3, &f64)| (*p * *w).extend(*w);
    let net: Vec<Vec<DVec4>> =
        rows.iter().zip(weights).map(|(p, w)| p.iter().zip(w).map(homogeneous).collect()).collect();
    let patches = spline_patches(&net, &[along_u, along_v]);
    let edge = |closed: bool| if closed { Edge::Seam } else { Edge::Border };
    let chart = Chart { u: edge(closed.0), v: edge(closed.1) };
    Some(TriangleMesh { chart, ..mesh_within(cursor, &patches, tolerance, report)? })
}

/// How a surface runs along one of its sides.
fn run(
    cursor: &Cursor,
    name: &str,
    knots: Vec<f64>,
    (closed, count): (bool, usize),
    report: &mut Report,
) -> Option<Run> {
    let place = cursor.at(name);
    match (knots.is_empty(), closed) {
        (true, true) => Some(Run::Closed),
        (true, false) => Some(Run::Open),
        (false, true) => {
            let message = "a closed side has evenly spaced knots of its own";
            report.at("scene::conflict", &place, message).help =
                Some(format!("leave out `{name}`, or `closed`"));
            None
        }
        (false, false) => {
            if !limits::vector(report, &place, &knots, &COORDINATE) {
                return None;
            }
            if let Err(error) = check_knots(&knots, count) {
                report.at("scene::mesh", &place, error.to_string());
                return None;
            }
            Some(Run::Knots(knots))
        }
    }
}

fn check_net(cursor: &Cursor, name: &str, rows: &[&[DVec3]], report: &mut Report) -> bool {
    let place = cursor.at(name);
    let mut fine = true;
    for (index, row) in rows.iter().enumerate() {
        let place = if name == "rows" { place.nth(index) } else { place.clone() };
        for (k, point) in row.iter().enumerate() {
            fine &= limits::vector(report, &place.nth(k), &point.to_array(), &COORDINATE);
        }
    }
    fine
}

fn check_weights(
    cursor: &Cursor,
    weights: &[&[f64]],
    points: &[&[DVec3]],
    report: &mut Report,
) -> bool {
    let place = cursor.at("weights");
    let mut fine = true;
    for row in weights {
        fine &= limits::vector(report, &place, row, &WEIGHT);
    }
    if weights.len() != points.len() || weights.iter().zip(points).any(|(w, p)| w.len() != p.len())
    {
        report.at("scene::mesh", &place, "there must be one weight for each point");
        fine = false;
    }
    fine
}

/// The mesh of patches within `tolerance` metres, unless it is beyond what a mesh may be.
fn mesh_within(
    cursor: &Cursor,
    patches: &[Placed],
    tolerance: f64,
    report: &mut Report,
) -> Option<TriangleMesh> {
    let place = cursor.at("tolerance");
    if !limits::number(report, &place, tolerance, &LENGTH) {
        return None;
    }
    let cells = cells_for(patches, tolerance);
    if !check_triangle_count(&place, 2.0 * cells * cells * patches.len() as f64, report) {
        return None;
    }
    let mesh = patch_mesh(patches, cells as u32);
    if mesh.triangles.is_empty() {
        report.at("scene::mesh", cursor, "no surface comes of these points");
        return None;
    }
    Some(mesh)
}
