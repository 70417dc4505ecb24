//! Plane figures drawn out into solids.

use crate::description::TriangleMesh;
use crate::math::{Chart, Cubic};
use earcut::Earcut;
use glam::{DVec2, DVec3, Vec2, Vec3};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape;
use std::collections::BTreeMap;

/// Which parts of the plane belong to a figure whose contours lie in or across each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filling {
    /// Those around which an odd number of contours goes: one in another is a hole.
    EvenOdd,
    /// Those around which contours go more often one way than the other, as fonts have it.
    NonZero,
}

/// The ways around a figure, without the points at which they begin and end: the outer one counter-clockwise, then
/// its holes, clockwise.
type Figure = Vec<Vec<DVec2>>;

/// A chain of curves as points, each chord within `tolerance` of its curve, which lies between its control points.
/// The first point is left out.
pub fn flattened(curves: &[Cubic], tolerance: f64) -> Vec<DVec2> {
    fn flatten(curve: &Cubic, tolerance: f64, halvings: u32, points: &mut Vec<DVec2>) {
        let [a, b, c, d] = curve.points();
        let chord = d - a;
        let away = |p: DVec2| {
            let along = (p - a).dot(chord) / chord.length_squared();
            // Of a curve which begins where it ends the distance from there counts.
            (p - a - if along.is_finite() { chord * along.clamp(0.0, 1.0) } else { DVec2::ZERO })
                .length()
        };
        if halvings == 0 || away(b).max(away(c)) <= tolerance {
            points.push(d);
        } else {
            flatten(&curve.part(0.0, 0.5), tolerance, halvings - 1, points);
            flatten(&curve.part(0.5, 1.0), tolerance, halvings - 1, points);
        }
    }
    /// Chords of a curve at most, as a power of two.
    const MOST: u32 = 20;
    let mut points = Vec::new();
    for curve in curves {
        flatten(curve, tolerance, MOST, &mut points);
    }
    points
}

/// The figures of contours: parts that touch or overlap become one, contours which cross themselves are cut there.
/// Places are rounded to some 10⁻⁹ of the extent of all.
fn figures(contours: &[Vec<DVec2>], filling: Filling) -> Vec<Figure> {
    let plain: Vec<Vec<[f64; 2]>> =
        contours.iter().map(|contour| contour.iter().map(DVec2::to_array).collect()).collect();
    let rule = match filling {
        Filling::EvenOdd => FillRule::EvenOdd,
        Filling::NonZero => FillRule::NonZero,
    };
    let without_idle = |contour: Vec<[f64; 2]>| {
        let mut points: Vec<DVec2> = contour.into_iter().map(DVec2::from).collect();
        // A point on the line between its neighbours would be on the edge of a wall, but not of a lid.
        loop {
            let n = points.len();
            let idle = (0..n).find(|&k| {
                let (a, b, c) = (points[(k + n - 1) % n], points[k], points[(k + 1) % n]);
                (b - a).perp_dot(c - b) == 0.0
            });
            match idle {
                Some(k) if n > 3 => points.remove(k),
                _ => break points,
            };
        }
    };
    let shapes = plain.simplify_shape(rule);
    shapes.into_iter().map(|shape| shape.into_iter().map(without_idle).collect()).collect()
}

/// The solid between two copies of a figure at z = ±`depth`/2, closed, its front towards +z.
///
/// Walls which meet at less than `smooth` degrees share their normals. uv is the unit square around all on the lids,
/// and on the walls the share of the way around and of the depth.
pub fn extruded(
    contours: &[Vec<DVec2>],
    filling: Filling,
    depth: f64,
    smooth_deg: f64,
) -> TriangleMesh {
    let figures = figures(contours, filling);
    let points = || figures.iter().flatten().flatten();
    let low = points().fold(DVec2::INFINITY, |low, p| low.min(*p));
    let extent = points().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p)) - low;
    let mut mesh = TriangleMesh { chart: Chart::AROUND, ..Default::default() };
    for figure in &figures {
        for front in [true, false] {
            lid(figure, front, depth, |p| (p - low) / extent, &mut mesh);
        }
        for contour in figure {
            wall(contour, depth, smooth_deg.to_radians().cos(), &mut mesh);
        }
    }
    mesh
}

fn push(mesh: &mut TriangleMesh, p: DVec3, normal: DVec3, uv: DVec2) {
    mesh.positions.push(p.as_vec3());
    mesh.normals.push(normal.as_vec3());
    mesh.uvs.push(uv.as_vec2());
}

/// One of the ends of a figure.
fn lid(
    figure: &Figure,
    front: bool,
    depth: f64,
    uv: impl Fn(DVec2) -> DVec2,
    mesh: &mut TriangleMesh,
) {
    let first = mesh.positions.len() as u32;
    let side = if front { 0.5 } else { -0.5 };
    let points: Vec<[f64; 2]> = figure.iter().flatten().map(DVec2::to_array).collect();
    let mut holes: Vec<u32> = Vec::new();
    let mut count = 0;
    for contour in &figure[..figure.len() - 1] {
        count += contour.len() as u32;
        holes.push(count);
    }
    let mut corners: Vec<u32> = Vec::new();
    Earcut::new().earcut(points.iter().copied(), &holes, &mut corners);
    let mut triangles: Vec<[u32; 3]> =
        corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    for triangle in &mut triangles {
        let [a, b, c] = triangle.map(|k| DVec2::from(points[k as usize]));
        if (b - a).perp_dot(c - a) < 0.0 {
            triangle.swap(1, 2);
        }
    }
    close_slits(figure, &mut triangles);
    for p in figure.iter().flatten() {
        push(mesh, p.extend(side * depth), DVec3::Z * (2.0 * side), uv(*p));
    }
    mesh.triangles.extend(triangles.into_iter().map(|[a, b, c]| {
        let [b, c] = if front { [b, c] } else { [c, b] };
        [first + a, first + b, first + c]
    }));
}

/// Adds triangles without area where others meet only in part along their edges.
///
/// The triangulation drops corners that have come to lie on the line between their neighbours. The edge of a
/// triangle then passes a corner of others, from which rounding may move it away. Every edge, and the
/// contour, which has the walls on its other side, must be passed once each way: what is missing are the ways around
/// such slits.
fn close_slits(figure: &Figure, triangles: &mut Vec<[u32; 3]>) {
    let mut ways: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    let mut pass = |a: u32, b: u32| {
        *ways.entry([a, b]).or_default() += 1;
        *ways.entry([b, a]).or_default() -= 1;
    };
    for &[a, b, c] in triangles.iter() {
        pass(a, b);
        pass(b, c);
        pass(c, a);
    }
    let mut first = 0;
    for contour in figure {
        let n = contour.len() as u32;
        (0..n).for_each(|k| pass(first + (k + 1) % n, first + k));
        first += n;
    }
    // What was passed too seldom is still to be passed.
    let mut missing: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ([a, b], balance) in ways {
        (balance..0).for_each(|_| missing.entry(a).or_default().push(b));
    }
    let mut next = |from: u32| missing.get_mut(&from).and_then(Vec::pop);
    for start in 0..first {
        while let Some(second) = next(start) {
            let mut here = second;
            while let Some(there) = next(here).filter(|there| *there != start) {
                triangles.push([start, here, there]);
                here = there;
            }
        }
    }
}

/// The wall along a contour, with the figure to the left.
fn wall(contour: &[DVec2], depth: f64, smooth_cos: f64, mesh: &mut TriangleMesh) {
    let n = contour.len();
    let at = |k: usize| contour[k % n];
    let outward = |k: usize| {
        let along = (at(k + 1) - at(k)).normalize_or_zero();
        DVec2::new(along.y, -along.x)
    };
    let around: f64 = (0..n).map(|k| (at(k + 1) - at(k)).length()).sum();
    let mut way = 0.0;
    for k in 0..n {
        let here = outward(k);
        let shared = |other: DVec2| {
            if here.dot(other) > smooth_cos { (here + other).normalize_or(here) } else { here }
        };
        let ends = [(at(k), shared(outward(k + n - 1))), (at(k + 1), shared(outward(k + 1)))];
        let length = (at(k + 1) - at(k)).length();
        let first = mesh.positions.len() as u32;
        for ((p, normal), way) in ends.into_iter().zip([way, way + length]) {
            for z in [0.0, 1.0] {
                let uv = DVec2::new(way / around, z);
                push(mesh, p.extend((z - 0.5) * depth), normal.extend(0.0), uv);
            }
        }
        let [a, above_a, b, above_b] = [0, 1, 2, 3].map(|k| first + k);
        mesh.triangles.extend([[a, b, above_b], [a, above_b, above_a]]);
        way += length;
    }
    debug_assert!(mesh.uvs.iter().all(|uv| uv.cmpge(Vec2::ZERO).all()));
    debug_assert!(mesh.normals.iter().all(|n| *n != Vec3::ZERO));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::modelling::solids::{assert_closed, volume};
    use std::f64::consts::PI;

    fn square(centre: DVec2, half: f64) -> Vec<DVec2> {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| centre + DVec2::new(x, y) * half)
            .to_vec()
    }

    /// A ring of four exact quarters of a circle.
    fn circle(radius: f64, tolerance: f64) -> Vec<DVec2> {
        let (w, h) = ((1.0 + 2.0_f64.sqrt()) / 3.0, 2.0 - 2.0_f64.sqrt());
        let quarter = [DVec2::X, DVec2::new(1.0, h), DVec2::new(h, 1.0), DVec2::Y];
        let turned = |k: u32| {
            let spin = |p: DVec2| (0..k).fold(p, |p, _| p.perp()) * radius;
            Cubic::new(quarter.map(spin), [1.0, w, w, 1.0])
        };
        flattened(&[0, 1, 2, 3].map(turned), tolerance)
    }

    /// Closed forms: the volume of a plate with holes, whichever way its contours run; of a bow tie, whose contour crosses
    /// itself; of squares which overlap, by either rule; of a cylinder within its tolerance.
    #[test]
    fn the_volume_is_area_times_depth() {
        let turned = |mut contour: Vec<DVec2>| {
            contour.reverse();
            contour
        };
        let plate = vec![
            square(DVec2::ZERO, 2.0),
            square(DVec2::new(-1.0, 0.0), 0.5),
            turned(square(DVec2::new(1.0, 0.2), 0.25)),
        ];
        let tie = vec![[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)].map(DVec2::from).to_vec()];
        let overlap = vec![square(DVec2::ZERO, 1.0), square(DVec2::ONE, 1.0)];
        for (contours, filling, area) in [
            (&plate, Filling::EvenOdd, 16.0 - 1.0 - 0.25),
            (&tie, Filling::EvenOdd, 2.0),
            (&overlap, Filling::NonZero, 7.0),
        ] {
            let mesh = extruded(contours, filling, 0.3, 30.0);
            assert_closed(&mesh);
            assert!((volume(&mesh) - 0.3 * area).abs() < 1e-5, "{} for {area}", volume(&mesh));
        }
        for tolerance in [1e-2, 1e-4] {
            let mesh = extruded(&[circle(1.0, tolerance)], Filling::EvenOdd, 2.0, 30.0);
            assert_closed(&mesh);
            let missing = 2.0 * PI - volume(&mesh);
            assert!(missing > 0.0 && missing < 2.0 * 2.0 * PI * tolerance, "{missing}");
        }
    }

    /// A sieve, whose corners lie on common lines: no edge passes the corner of another triangle.
    #[test]
    fn no_slit_stays_open_between_corners_on_a_line() {
        let mut contours = vec![square(DVec2::splat(4.0), 5.0)];
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            contours.push(square(DVec2::new(f64::from(i), f64::from(j)), 0.25));
        }
        let mesh = extruded(&contours, Filling::EvenOdd, 1.0, 30.0);
        assert_closed(&mesh);
        assert!((volume(&mesh) - (100.0 - 81.0 * 0.25)).abs() < 1e-4, "{}", volume(&mesh));
    }

    /// Walls of a circle turn evenly, those of a square do not; all face outwards, and a hole's into it.
    #[test]
    fn walls_are_smooth_where_they_are_round() {
        let ring = [circle(2.0, 1e-3), circle(1.0, 1e-3)];
        let mesh = extruded(&ring, Filling::EvenOdd, 1.0, 30.0);
        for (p, n) in mesh.positions.iter().zip(&mesh.normals).filter(|(_, n)| n.z == 0.0) {
            let out =
                p.truncate().normalize() * if p.truncate().length() > 1.5 { 1.0 } else { -1.0 };
            assert!(n.truncate().dot(out) > 1.0 - 1e-4, "{n} at {p}");
        }
        let cube = extruded(&[square(DVec2::ZERO, 1.0)], Filling::EvenOdd, 2.0, 30.0);
        assert!(cube.normals.iter().all(|n| n.abs().max_element() == 1.0));
    }
}
