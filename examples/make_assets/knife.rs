//! A kitchen knife in two parts, since it has two materials.
//!
//! Lengths below are millimetres, in the files metres. The knife lies along +x with its tip at
//! x = 260 mm, its edge towards −y, its thickness along z.

use std::f64::consts::TAU;
use std::fmt::Write;

type Point = [f64; 3];

/// Sections of the blade: x, spine y, edge y, half thickness.
const BLADE: [[f64; 4]; 8] = [
    [0.0, 15.0, -13.0, 1.7],
    [30.0, 15.0, -15.0, 1.7],
    [90.0, 14.5, -17.0, 1.6],
    [150.0, 13.0, -17.0, 1.5],
    [190.0, 10.0, -14.5, 1.3],
    [220.0, 5.5, -10.0, 1.0],
    [243.0, 0.5, -4.6, 0.6],
    [260.0, -4.0, -4.0, 0.0],
];

/// Sections of the handle: x, top y, bottom y, half thickness.
const HANDLE: [[f64; 4]; 8] = [
    [-2.0, 14.0, -13.0, 7.5],
    [-12.0, 14.5, -14.0, 9.0],
    [-35.0, 14.5, -12.0, 10.0],
    [-65.0, 14.0, -13.5, 10.5],
    [-95.0, 14.0, -12.0, 10.0],
    [-120.0, 15.0, -15.5, 10.0],
    [-132.0, 14.0, -17.0, 8.5],
    [-138.0, 10.0, -13.0, 4.0],
];

/// Corners of a section of the handle.
const AROUND: usize = 32;

/// Faces with the normals of their corners, where they have any.
struct Solid {
    points: Vec<Point>,
    normals: Vec<Point>,
    /// Corners: index of the point, index of the normal.
    faces: Vec<Vec<(usize, Option<usize>)>>,
}

/// The blade as OBJ: five flat strips from the heel to the tip.
pub fn blade() -> String {
    let rings: Vec<Vec<Point>> = BLADE.iter().map(|&section| blade_section(section)).collect();
    let mut solid = Solid { points: rings.concat(), normals: Vec::new(), faces: Vec::new() };
    let flat = |i: usize| (i, None);
    for near in (0..rings.len() - 1).map(|ring| 5 * ring) {
        for j in 0..5 {
            let next = (j + 1) % 5;
            let quad = [near + j, near + next, near + 5 + next, near + 5 + j];
            solid.faces.push(quad.map(flat).to_vec());
        }
    }
    solid.faces.push((0..5).rev().map(flat).collect());
    solid.to_obj("Blade of the knife; flat faces.")
}

/// Spine, bevel and edge of one side, then the other: counter-clockwise seen from the tip.
fn blade_section([x, spine, edge, t]: [f64; 4]) -> Vec<Point> {
    let bevel = edge + 0.45 * (spine - edge);
    vec![[x, spine, t], [x, bevel, t], [x, edge, 0.0], [x, bevel, -t], [x, spine, -t]]
}

/// The handle as OBJ: rounded sections with smooth sides and two flat ends.
pub fn handle() -> String {
    let mut points: Vec<Point> =
        HANDLE.iter().flat_map(|&s| (0..AROUND).map(move |j| on_handle(s, j))).collect();
    let mut faces: Vec<Vec<usize>> = Vec::new();
    for near in (0..HANDLE.len() - 1).map(|ring| AROUND * ring) {
        for j in 0..AROUND {
            let next = (j + 1) % AROUND;
            // x falls from ring to ring, so that the sides go round the other way than the blade's.
            faces.push(vec![near + j, near + AROUND + j, near + AROUND + next, near + next]);
        }
    }
    let mut normals = smooth_normals(&points, &faces);
    let mut faces: Vec<Vec<_>> =
        faces.into_iter().map(|face| face.into_iter().map(|i| (i, Some(i))).collect()).collect();
    for (section, outward) in [(0, 1.0), (HANDLE.len() - 1, -1.0)] {
        let [x, top, bottom, _] = HANDLE[section];
        let (centre, normal) = (points.len(), normals.len());
        points.push([x, f64::midpoint(top, bottom), 0.0]);
        normals.push([outward, 0.0, 0.0]);
        for j in 0..AROUND {
            let (a, b) = (section * AROUND + j, section * AROUND + (j + 1) % AROUND);
            let [a, b] = if outward > 0.0 { [a, b] } else { [b, a] };
            faces.push([centre, a, b].map(|i| (i, Some(normal))).to_vec());
        }
    }
    Solid { points, normals, faces }.to_obj("Handle of the knife; smooth sides, flat ends.")
}

/// A point of a superellipse of exponent 2/0.7; `j` goes from +y to +z.
fn on_handle([x, top, bottom, t]: [f64; 4], j: usize) -> Point {
    let (sin, cos) = (TAU * j as f64 / AROUND as f64).sin_cos();
    let bulge = |c: f64| c.signum() * c.abs().powf(0.7);
    [x, f64::midpoint(top, bottom) + (top - bottom) / 2.0 * bulge(cos), t * bulge(sin)]
}

/// Per point the sum of the area vectors of its faces, brought to unit length.
fn smooth_normals(points: &[Point], faces: &[Vec<usize>]) -> Vec<Point> {
    let mut sums = vec![[0.0; 3]; points.len()];
    for face in faces {
        let [a, b, c, d] = [face[0], face[1], face[2], face[3]].map(|i| points[i]);
        // The area vector of a quadrangle is half the cross product of its diagonals.
        let (p, q) = (minus(c, a), minus(d, b));
        let area =
            [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        for &i in face {
            sums[i] = std::array::from_fn(|k| sums[i][k] + area[k]);
        }
    }
    sums.into_iter()
        .map(|n| {
            let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
            n.map(|c| c / length)
        })
        .collect()
}

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

impl Solid {
    /// Writes the solid, millimetres turned to metres, to a micrometre.
    #[expect(clippy::float_cmp, reason = "corners at the tip are the same numbers")]
    fn to_obj(&self, what: &str) -> String {
        let mut text = format!("# {what}\n# Metres. Written by the example `make_assets`.\n");
        for p in &self.points {
            line(&mut text, "v", p.map(|c| c / 1000.0));
        }
        for &n in &self.normals {
            line(&mut text, "vn", n);
        }
        for face in &self.faces {
            text.push('f');
            for (k, &(point, normal)) in face.iter().enumerate() {
                // The tip is one point in five corners: a face there loses an edge.
                let neighbour = face[(k + 1) % face.len()].0;
                if self.points[point] == self.points[neighbour] {
                    continue;
                }
                let written = match normal {
                    Some(normal) => write!(text, " {}//{}", point + 1, normal + 1),
                    None => write!(text, " {}", point + 1),
                };
                written.expect("writing to a string does not fail");
            }
            text.push('\n');
        }
        text
    }
}

fn line(text: &mut String, statement: &str, numbers: Point) {
    // Rounded before it is printed, so that no "-0.000000" depends on the last bit of a sine.
    let [x, y, z] = numbers.map(|c| (c * 1e6).round() / 1e6 + 0.0);
    writeln!(text, "{statement} {x:.6} {y:.6} {z:.6}").expect("writing to a string does not fail");
}
