//! Analytic shapes as meshes within a stated error, for what only meshes can: to be divided and displaced.
//!
//! A round shape is a chain of cones between rings of vertices. The meridian is divided until its chords are within half
//! the error of it, and the rings have so many vertices that their chords are within the other half of the circle: the
//! mesh is within the error of the surface, and inside of it where that is convex.

use crate::description::{Shape, TriangleMesh};
use crate::math::{Chart, Piece, Profile};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Why a shape is not a mesh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TessellationError {
    /// A plane without end, or a mesh.
    #[error("only shapes with an end that are no meshes become a mesh")]
    NoSuchShape,
    /// It would take more triangles than a mesh may have.
    #[error("the mesh would have {0} triangles at least")]
    TooFine(f64),
}

/// Vertices around the y axis, all in one place where the radius is 0.
#[derive(Clone, Copy)]
struct Ring {
    /// Radius and height.
    at: DVec2,
    /// Outwards, away from the axis and up; of any length.
    normal: DVec2,
    v: f64,
}

/// The mesh of a shape, nowhere farther than `tolerance` metres from it, with its normals and uv and at most `most`
/// triangles.
///
/// # Errors
/// For planes and meshes, and when it would have more.
pub fn tessellated<R>(
    shape: &Shape<R>,
    tolerance: f64,
    most: f64,
) -> Result<TriangleMesh, TessellationError> {
    let ring = |at: (f64, f64), normal: (f64, f64), v: f64| Ring {
        at: at.into(),
        normal: normal.into(),
        v,
    };
    let chart = match shape {
        Shape::Plane {} | Shape::Mesh(_) => return Err(TessellationError::NoSuchShape),
        Shape::Rectangle { .. } | Shape::Box { .. } | Shape::Disk { .. } => Chart::SQUARE,
        Shape::Sphere { .. } | Shape::Cylinder { .. } | Shape::Cone { .. } => Chart::AROUND,
        Shape::Revolution { profile, .. } => profile.chart(),
    };
    let mut mesh = TriangleMesh { chart, ..Default::default() };
    match *shape {
        Shape::Plane {} | Shape::Mesh(_) => {}
        Shape::Rectangle { size } => face(&mut mesh, DVec3::ZERO, [DVec3::X, DVec3::Y], size),
        Shape::Box { size } => {
            // As seen from outside, u to the right; below and on top u grows along x.
            let sides = [DVec3::Z, DVec3::X, DVec3::NEG_Z, DVec3::NEG_X].map(|x| [x, DVec3::Y]);
            for [x, y] in sides.into_iter().chain([[DVec3::X, DVec3::NEG_Z], [DVec3::X, DVec3::Z]])
            {
                let extent = DVec2::new(x.dot(size).abs(), y.dot(size).abs());
                face(&mut mesh, x.cross(y) * size * 0.5, [x, y], extent);
            }
        }
        Shape::Disk { radius } => {
            let turns = Turns::of(radius, tolerance, most)?;
            turns.disk(&mut mesh, radius, DVec3::ZERO, [DVec3::X, DVec3::Y]);
        }
        Shape::Sphere { radius } => {
            let turns = Turns::of(radius, tolerance, most)?;
            let rows = (FRAC_PI_2 / half_angle(radius, tolerance)).ceil().max(2.0);
            turns.check(rows)?;
            let rings: Vec<Ring> = (0..=rows as u32)
                .map(|k| {
                    let (sin, cos) = (PI * (f64::from(k) / rows - 0.5)).sin_cos();
                    // The cosine of a quarter of a turn is not quite 0.
                    let cos = if k == 0 || f64::from(k) == rows { 0.0 } else { cos };
                    ring((radius * cos, radius * sin), (cos, sin), f64::from(k) / rows)
                })
                .collect();
            turns.strip(&mut mesh, &rings, 1.0);
        }
        Shape::Cylinder { radius, height, capped } => {
            let turns = Turns::of(radius, tolerance, most)?;
            let low = ring((radius, -0.5 * height), (1.0, 0.0), 0.0);
            let high = ring((radius, 0.5 * height), (1.0, 0.0), 1.0);
            turns.strip(&mut mesh, &[low, high], 1.0);
            if capped {
                turns.end(&mut mesh, low.at, -1.0);
                turns.end(&mut mesh, high.at, 1.0);
            }
        }
        Shape::Cone { radius, height, capped } => {
            let turns = Turns::of(radius, tolerance, most)?;
            let low = ring((radius, -0.5 * height), (height, radius), 0.0);
            let tip = ring((0.0, 0.5 * height), (height, radius), 1.0);
            turns.strip(&mut mesh, &[low, tip], 1.0);
            if capped {
                turns.end(&mut mesh, low.at, -1.0);
            }
        }
        Shape::Revolution { ref profile, capped } => {
            let turns = Turns::of(profile.extent.0, tolerance, most)?;
            turned(&mut mesh, profile, capped, &turns, tolerance)?;
        }
    }
    Ok(mesh)
}

/// Half the angle whose chord is within half the error of a circle.
fn half_angle(radius: f64, tolerance: f64) -> f64 {
    // 1 − cos x = 2 sin²(x/2), without cancellation.
    2.0 * (0.25 * tolerance / radius).min(1.0).sqrt().asin()
}

/// A profile turned around the axis.
fn turned(
    mesh: &mut TriangleMesh,
    profile: &Profile,
    capped: bool,
    turns: &Turns,
    tolerance: f64,
) -> Result<(), TessellationError> {
    let outward = profile.outward(capped);
    for piece in &profile.pieces {
        let ring = |u: f64| {
            let along = piece.direction(u) * outward;
            let at = match u {
                0.0 => piece.start,
                1.0 => piece.end,
                _ => piece.jet(u).p,
            };
            let v = piece.v.0 + (piece.v.1 - piece.v.0) * u;
            Ring { at, normal: DVec2::new(along.y, -along.x), v }
        };
        let mut rings = vec![ring(0.0)];
        // From the end on: what is to be divided further lies on top.
        let mut ends = vec![1.0];
        let mut from = 0.0;
        while let Some(&to) = ends.last() {
            let middle = f64::midpoint(from, to);
            if arc_height(piece, from, to) > 0.5 * tolerance && middle > from && middle < to {
                ends.push(middle);
                turns.check((rings.len() + ends.len()) as f64)?;
            } else {
                rings.push(ring(to));
                from = to;
                ends.pop();
            }
        }
        turns.check((rings.len() + mesh.triangles.len() / (2 * turns.columns)) as f64)?;
        turns.strip(mesh, &rings, outward);
    }
    for (end, rim) in profile.open_ends.into_iter().enumerate() {
        if let Some(rim) = rim.filter(|_| capped) {
            turns.end(mesh, rim, if end == 0 { -outward } else { outward });
        }
    }
    Ok(())
}

/// The height of the triangle between a chord and the tangents at its ends. A piece bends one way, and is in it.
fn arc_height(piece: &Piece, from: f64, to: f64) -> f64 {
    let chord = piece.jet(to).p - piece.jet(from).p;
    let (leaves, arrives) = (piece.direction(from), piece.direction(to));
    let turn = leaves.perp_dot(arrives).abs();
    let (a, b) = (chord.perp_dot(leaves).abs(), chord.perp_dot(arrives).abs());
    let height = a * b / (chord.length() * turn);
    if height.is_nan() { 0.0 } else { height }
}

/// Two triangles with these directions to the right and up.
fn face(mesh: &mut TriangleMesh, middle: DVec3, [x, y]: [DVec3; 2], size: DVec2) {
    let first = mesh.positions.len() as u32;
    for uv in [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y] {
        let across = (uv - 0.5) * size;
        push(mesh, middle + x * across.x + y * across.y, x.cross(y), uv);
    }
    mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| first + k)));
}

fn push(mesh: &mut TriangleMesh, p: DVec3, normal: DVec3, uv: DVec2) {
    mesh.positions.push(p.as_vec3());
    mesh.normals.push(normal.normalize().as_vec3());
    mesh.uvs.push(uv.as_vec2());
}

/// How a circle is divided.
struct Turns {
    columns: usize,
    most: f64,
}

impl Turns {
    fn of(radius: f64, tolerance: f64, most: f64) -> Result<Self, TessellationError> {
        let columns = (PI / half_angle(radius, tolerance)).ceil().max(3.0);
        let turns = Self { columns: columns.min(most) as usize, most };
        if columns > most { Err(TessellationError::TooFine(columns)) } else { Ok(turns) }
    }

    /// Whether so many rings may be made.
    fn check(&self, rings: f64) -> Result<(), TessellationError> {
        let triangles = 2.0 * rings * self.columns as f64;
        if triangles > self.most { Err(TessellationError::TooFine(triangles)) } else { Ok(()) }
    }

    /// The directions to +x and +z of the place after so many parts of a turn, as shapes count their longitude.
    fn radial(&self, part: f64) -> DVec2 {
        let n = self.columns as f64;
        // The seam has the same bits on both sides.
        let part = if part == n { 0.0 } else { part };
        let (sin, cos) = (TAU * (part / n - 0.5)).sin_cos();
        DVec2::new(sin, cos)
    }

    /// The surface between rings; with `outward` −1 it faces the other way.
    fn strip(&self, mesh: &mut TriangleMesh, rings: &[Ring], outward: f64) {
        let first = mesh.positions.len();
        let n = self.columns;
        for ring in rings {
            let pole = ring.at.x == 0.0;
            for k in 0..=n {
                // At a pole each triangle has its own vertex, in the middle of its side.
                let part = if pole && k < n { k as f64 + 0.5 } else { k as f64 };
                let around = self.radial(part);
                let place = |p: DVec2| DVec3::new(around.x * p.x, p.y, around.y * p.x);
                let uv = DVec2::new(part / n as f64, ring.v);
                push(mesh, place(ring.at), place(ring.normal), uv);
            }
        }
        for (row, pair) in rings.windows(2).enumerate() {
            let [low, high] = [pair[0], pair[1]].map(|ring| ring.at.x > 0.0);
            for k in 0..n {
                let a = (first + row * (n + 1) + k) as u32;
                let [b, d] = [a + 1, a + n as u32 + 1];
                let c = d + 1;
                let parts = match (low, high) {
                    (true, true) => [Some([a, b, c]), Some([a, c, d])],
                    (false, true) => [Some([a, c, d]), None],
                    (true, false) => [Some([a, b, d]), None],
                    (false, false) => [None, None],
                };
                let turned = |t: [u32; 3]| if outward < 0.0 { [t[0], t[2], t[1]] } else { t };
                mesh.triangles.extend(parts.into_iter().flatten().map(turned));
            }
        }
    }

    /// A disk across the axis which faces up (1) or down (−1), with +x to the right.
    fn end(&self, mesh: &mut TriangleMesh, rim: DVec2, side: f64) {
        self.disk(mesh, rim.x, DVec3::Y * rim.y, [DVec3::X, DVec3::Z * -side]);
    }

    fn disk(&self, mesh: &mut TriangleMesh, radius: f64, middle: DVec3, [x, y]: [DVec3; 2]) {
        let first = mesh.positions.len() as u32;
        let n = self.columns;
        push(mesh, middle, x.cross(y), DVec2::splat(0.5));
        for k in 0..n {
            // The bits of the rim that the side has: its x and z, whatever is seen as up.
            let around = self.radial(k as f64);
            let on_rim = if y.y == 0.0 {
                DVec3::new(around.x * radius, middle.y, around.y * radius)
            } else {
                DVec3::new(around.x, -around.y, 0.0) * radius
            };
            let across = on_rim - middle;
            let uv = DVec2::new(across.dot(x), across.dot(y)) / (2.0 * radius) + 0.5;
            push(mesh, on_rim, x.cross(y), uv);
        }
        for k in 0..n as u32 {
            let (a, b) = (first + 1 + k, first + 1 + (k + 1) % n as u32);
            // Around +y the vertices run counter-clockwise.
            let counter_clockwise = y.z <= 0.0;
            mesh.triangles.push(if counter_clockwise { [first, a, b] } else { [first, b, a] });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::modelling::solids::{assert_closed, volume, ways};
    use crate::math::Cubic;
    use crate::shape::{Primitive as Analytic, Revolution};
    use glam::{Vec2, Vec3};
    use std::sync::Arc;

    const MOST: f64 = 1e7;

    fn mesh(shape: &Shape<()>, tolerance: f64) -> TriangleMesh {
        tessellated(shape, tolerance, MOST).expect("it has an end")
    }

    /// A vase: bulging, waisted, with a corner, open at the rim, solid below.
    fn vase() -> Arc<Profile> {
        let p = |x: f64, y: f64| DVec2::new(x, y);
        let curves = [
            Cubic::new([p(0.0, -1.0), p(0.2, -1.0), p(0.3, -1.0), p(0.5, -1.0)], [1.0; 4]),
            Cubic::new([p(0.5, -1.0), p(1.5, -0.2), p(0.1, 0.3), p(0.6, 1.0)], [1.0; 4]),
        ];
        Arc::new(Profile::new(&curves).expect("a profile"))
    }

    fn assert_same(mesh: &TriangleMesh, shape: &Analytic, scale: DVec3, faces: u32) {
        for (k, p) in mesh.positions.iter().enumerate() {
            let local = p.as_dvec3() / scale;
            let near = |face: u32| {
                let there = shape.surface(local, face, true);
                let uv = there.uv.as_dvec2() - mesh.uvs[k].as_dvec2();
                // At the seam u is 0 or 1, on the axis anything.
                let across = (uv.x - uv.x.round()).abs() * f64::from(Vec2::new(p.x, p.z).length());
                let normal = (there.ng / scale).normalize();
                there.p.distance(local) < 1e-6
                    && across + uv.y.abs() < 1e-6
                    && (normal - mesh.normals[k].as_dvec3()).length() < 1e-5
            };
            let on_axis = |face: u32| {
                // The longitude of a pole is told by its triangle.
                let p = Vec3::new(0.0, p.y, 0.0).distance(*p) == 0.0;
                p && (shape.surface(local, face, true).uv.y - mesh.uvs[k].y).abs() < 1e-6
            };
            let found = (0..faces).any(|face| near(face) || on_axis(face));
            assert!(found, "{shape:?}: vertex {k} at {p}, uv {}", mesh.uvs[k]);
        }
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|k| mesh.positions[k as usize]);
            let faces_out = (b - a).cross(c - a).dot(mesh.normals[triangle[1] as usize]);
            assert!(faces_out > 0.0, "{shape:?} faces in at {a}");
        }
    }

    /// Oracle: the analytic shapes themselves. Vertices lie on them, with their normals and uv; triangles face out.
    #[test]
    fn vertices_are_those_of_the_analytic_shapes() {
        let (radius, height) = (0.7, 1.9);
        let round = DVec3::new(radius, height, radius);
        let capped = true;
        let size = DVec3::new(1.0, 2.0, 3.0);
        let profile = vase();
        let revolution = Analytic::Revolution(Revolution::new(profile.clone(), true));
        let turned = Shape::Revolution { profile: profile.clone(), capped };
        let faces = profile.pieces.len() as u32 + 2;
        let flat = DVec3::new(radius, radius, 1.0);
        for (shape, analytic, scale, faces) in [
            (Shape::Sphere { radius }, Analytic::Sphere, DVec3::splat(radius), 1),
            (Shape::Cylinder { radius, height, capped }, Analytic::Cylinder { capped }, round, 3),
            (Shape::Cone { radius, height, capped }, Analytic::Cone { capped }, round, 2),
            (Shape::Disk { radius }, Analytic::Disk, flat, 1),
            (Shape::Rectangle { size: size.truncate() }, Analytic::Rectangle, size, 1),
            (Shape::Box { size }, Analytic::Cuboid, size, 6),
            (turned, revolution, DVec3::ONE, faces),
        ] {
            assert_same(&mesh(&shape, 0.01), &analytic, scale, faces);
        }
    }

    /// Closed forms: the volumes of solids, from below and within the error times the area; and all are closed.
    #[test]
    fn solids_are_closed_and_have_their_volume() {
        let (radius, height, capped) = (0.7, 1.9, true);
        let third = PI * radius * radius * height / 3.0;
        let profile = vase();
        for tolerance in [0.03, 1e-3] {
            for (shape, exact, area) in [
                (Shape::Sphere { radius }, 4.0 / 3.0 * PI * radius.powi(3), 4.0 * PI * 0.49),
                (Shape::Cylinder { radius, height, capped }, 3.0 * third, TAU * radius * height),
                (Shape::Cone { radius, height, capped }, third, PI * radius * 2.1),
                (Shape::Box { size: DVec3::new(1.0, 2.0, 3.0) }, 6.0, 0.0),
                (
                    Shape::Revolution { profile: profile.clone(), capped },
                    profile.volume.abs(),
                    profile.area(),
                ),
            ] {
                let mesh = mesh(&shape, tolerance);
                assert_closed(&mesh);
                let missing = exact - volume(&mesh);
                let allowed = tolerance * area + 1e-6;
                assert!(missing.abs() < allowed, "{shape:?}: {missing} at {tolerance}");
                // Within a factor of the count that the error asks for.
                assert!(area == 0.0 || missing.abs() > 0.05 * allowed, "{shape:?}: {missing}");
            }
        }
    }

    /// Oracle: the distance to the surface, closed form for a sphere, a dense meridian for the vase, over all triangles.
    #[test]
    fn meshes_keep_their_tolerance() {
        let profile = vase();
        let meridian: Vec<DVec2> = profile
            .pieces
            .iter()
            .flat_map(|piece| (0..=2000).map(|k| piece.jet(f64::from(k) / 2000.0).p))
            .collect();
        let to_vase = |p: DVec2| meridian.iter().map(|q| q.distance(p)).fold(9.0, f64::min);
        for tolerance in [0.05, 2e-3] {
            let sphere = mesh(&Shape::Sphere { radius: 0.7 }, tolerance);
            let turned =
                mesh(&Shape::Revolution { profile: profile.clone(), capped: false }, tolerance);
            let mut greatest = [0.0_f64; 2];
            for (which, mesh) in [&sphere, &turned].into_iter().enumerate() {
                for triangle in mesh.triangles.iter().step_by(7) {
                    let [a, b, c] = triangle.map(|k| mesh.positions[k as usize].as_dvec3());
                    for p in [(a + b + c) / 3.0, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0] {
                        let radius = DVec2::new(p.x, p.z).length();
                        let off = match which {
                            0 => 0.7 - p.length(),
                            _ => to_vase(DVec2::new(radius, p.y)),
                        };
                        greatest[which] = greatest[which].max(off);
                    }
                }
            }
            for off in greatest {
                assert!(off < tolerance && off > 0.2 * tolerance, "{greatest:?} at {tolerance}");
            }
        }
    }

    /// What is too fine is told before it is made, also along a meridian; planes and meshes have no such mesh.
    #[test]
    fn what_cannot_be_made_is_told() {
        let none = |shape| tessellated(&shape, 1.0, MOST).expect_err("no mesh comes of it");
        assert_eq!(none(Shape::Plane {}), TessellationError::NoSuchShape);
        assert_eq!(none(Shape::Mesh(())), TessellationError::NoSuchShape);
        let profile = vase();
        for shape in [
            Shape::Sphere { radius: 1.0 },
            Shape::Disk { radius: 1.0 },
            Shape::Revolution { profile, capped: false },
        ] {
            let told = tessellated::<()>(&shape, 1e-15, MOST);
            assert!(matches!(told, Err(TessellationError::TooFine(n)) if n > MOST), "{told:?}");
        }
        let open = mesh(&Shape::Cone { radius: 1.0, height: 1.0, capped: false }, 1e9);
        assert_eq!((open.triangles.len(), ways(&open).len()), (3, 9), "never less than a pyramid");
    }
}
