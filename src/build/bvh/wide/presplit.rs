//! Cutting large triangles into several references before the build.
//!
//! The box of a long slanted triangle is mostly empty, and no tree over whole triangles can mend
//! that. So some triangles enter the tree in parts, each with the box of its part. Every triangle
//! gets a share of a fixed budget by the priority
//!
//! ```text
//! p = (longest side of its box · (area of its box − area of its projections on the axes))^⅓
//! ```
//!
//! and is cut at planes of a grid over the mesh, the coarsest first, so that the cuts of neighbours
//! agree (Karras and Aila 2013, "Fast Parallel Construction of High-Quality Bounding Volume
//! Hierarchies", section 4; their priority has the grid level in place of the side).

use super::binary::{Reference, bounds_of};
use super::corners;
use super::pages::vec_on_large_pages;
use crate::description::TriangleMesh;
use crate::math::Aabb;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Halvings by which the shares are fitted to the budget: more would move it by less than one in a
/// thousand.
const FIT_STEPS: usize = 24;
/// Levels of the grid: cells of finer ones are within rounding of the coordinates.
const LEVELS: u32 = 24;

/// The references to all triangles of a mesh: one for each, and at most `budget` times as many more.
/// Triangles with a corner that is not finite are left out.
pub(super) fn references(mesh: &TriangleMesh, budget: f32) -> Vec<Reference> {
    let count = mesh.triangles.len() as u32;
    let extra = (f64::from(count) * f64::from(budget)) as u64;
    let mut list = vec_on_large_pages(count as usize + extra as usize);
    let whole = |triangle: u32| bounds_of(corners(mesh, triangle)).unwrap_or(Aabb::EMPTY);
    if extra == 0 {
        let reference = |triangle| Reference::new(&whole(triangle), triangle);
        list.par_extend((0..count).into_par_iter().map(reference));
    } else {
        let priorities: Vec<f32> =
            (0..count).into_par_iter().map(|triangle| priority(corners(mesh, triangle))).collect();
        let per_priority = fit(&priorities, extra);
        let scene = mesh.positions.iter().filter(|p| p.is_finite()).copied();
        let scene = Aabb::from_points(scene);
        let cuts = |triangle: u32| share(priorities[triangle as usize], per_priority);
        let parts = |triangle: u32| {
            let mut parts = Vec::new();
            cut(corners(mesh, triangle), whole(triangle), cuts(triangle), &scene, &mut parts);
            parts
        };
        // First one part of each triangle, which is all of most, to its place in the list; then the
        // others, for which the few cut triangles are cut again.
        let first = |triangle| {
            let part = if cuts(triangle) == 0 { whole(triangle) } else { parts(triangle)[0] };
            Reference::new(&part, triangle)
        };
        list.par_extend((0..count).into_par_iter().map(first));
        let others = |triangle| {
            parts(triangle).into_iter().skip(1).map(move |part| Reference::new(&part, triangle))
        };
        let is_cut = |&triangle: &u32| cuts(triangle) > 0;
        list.par_extend((0..count).into_par_iter().filter(is_cut).flat_map_iter(others));
    }
    if !mesh.positions.iter().all(|p| p.is_finite()) {
        list.retain(|reference| !reference.is_empty());
    }
    list
}

/// How much a triangle gains by being cut; 0 where that is not a number.
fn priority([a, b, c]: [Vec3; 3]) -> f32 {
    let bounds = Aabb::from_points([a, b, c]);
    let projections = (b - a).cross(c - a).abs().element_sum();
    let gain = (bounds.max - bounds.min).max_element() * (bounds.area() - projections);
    if gain > 0.0 && gain.is_finite() { gain.cbrt() } else { 0.0 }
}

/// Number of cuts of a triangle.
fn share(priority: f32, per_priority: f64) -> u64 {
    (f64::from(priority) * per_priority) as u64
}

/// The largest number of cuts per priority, up to rounding, which stays in the budget.
fn fit(priorities: &[f32], budget: u64) -> f64 {
    let total: f64 = priorities.iter().map(|&p| f64::from(p)).sum();
    if total == 0.0 {
        return 0.0;
    }
    // Rounded down, the cuts are too few at this rate; they are too many where each priority of
    // above the mean gets its whole share, at the latest.
    let (mut low, mut high) =
        (budget as f64 / total, 2.0 * (budget as f64 + priorities.len() as f64) / total);
    for _ in 0..FIT_STEPS {
        let middle = low.midpoint(high);
        let cuts: u64 = priorities.par_iter().map(|&p| share(p, middle)).sum();
        if cuts <= budget {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Appends the boxes of the parts of a triangle inside `bounds`, after at most `cuts` cuts.
fn cut(triangle: [Vec3; 3], bounds: Aabb, cuts: u64, scene: &Aabb, parts: &mut Vec<Aabb>) {
    let size = bounds.max - bounds.min;
    let axis = size.max_position();
    let plane = if cuts == 0 { None } else { grid_plane(&bounds, scene, axis) };
    let Some(plane) = plane else {
        parts.push(bounds);
        return;
    };
    let [below, above] = halves(triangle, bounds, axis, plane);
    let cuts = cuts - 1;
    let (a, b) = (length_of(&below), length_of(&above));
    let cuts_below = ((cuts as f32 * (a / (a + b))).round() as u64).min(cuts);
    for (half, cuts) in [(below, cuts_below), (above, cuts - cuts_below)] {
        if !half.is_empty() {
            cut(triangle, half, cuts, scene, parts);
        }
    }
}

fn length_of(bounds: &Aabb) -> f32 {
    if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).max_element() }
}

/// The plane of the coarsest grid which lies inside the box.
fn grid_plane(bounds: &Aabb, scene: &Aabb, axis: usize) -> Option<f32> {
    let (origin, end) = (f64::from(scene.min[axis]), f64::from(scene.max[axis]));
    let cells = |x: f32| (f64::from(x) - origin) / (end - origin);
    let (low, high) = (cells(bounds.min[axis]), cells(bounds.max[axis]));
    (1..=LEVELS).find_map(|level| {
        let count = f64::from(1_u32 << level);
        let line = (low * count).floor() + 1.0;
        let plane = (origin + (end - origin) * (line / count)) as f32;
        let inside = line < high * count && bounds.min[axis] < plane && plane < bounds.max[axis];
        inside.then_some(plane)
    })
}

/// The boxes of what is below and above a plane, of the part of the triangle in `bounds`.
fn halves(triangle: [Vec3; 3], bounds: Aabb, axis: usize, plane: f32) -> [Aabb; 2] {
    let mut halves = [Aabb::EMPTY; 2];
    let mut add = |half: usize, low: Vec3, high: Vec3| {
        halves[half] = halves[half].union(Aabb { min: low, max: high });
    };
    for k in 0..3 {
        let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
        if a[axis] <= plane {
            add(0, a, a);
        }
        if a[axis] >= plane {
            add(1, a, a);
        }
        if (a[axis] < plane) != (b[axis] < plane) {
            // In f64 and rounded to both sides: the point lies between.
            let (p, q): (DVec3, DVec3) = (a.as_dvec3(), b.as_dvec3());
            let s = (f64::from(plane) - p[axis]) / (q[axis] - p[axis]);
            let on_plane = (p + (q - p) * s).as_vec3();
            let (mut low, mut high) = (on_plane.map(f32::next_down), on_plane.map(f32::next_up));
            (low[axis], high[axis]) = (plane, plane);
            add(0, low, high);
            add(1, low, high);
        }
    }
    halves.map(|half| Aabb { min: half.min.max(bounds.min), max: half.max.min(bounds.max) })
}
