//! A wine glass and the wine in it: profiles of cubic Bézier curves, turned about the y axis.
//!
//! Profiles run from axis to axis with the solid on their left; their points are (radius, height) in
//! millimetres, the meshes are in metres.

use super::glb::Mesh;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A cubic Bézier curve by its four points.
type Curve = [[f64; 2]; 4];

/// Under the foot, foot edge, foot top, stem, under the bowl, bowl lower, bowl upper, rim, and the
/// inside: upper, lower, bottom.
const GLASS: [Curve; 11] = [
    [[0.0, 0.8], [10.0, 0.8], [24.0, 0.0], [35.0, 0.0]],
    [[35.0, 0.0], [36.2, 0.0], [36.2, 1.6], [35.0, 1.8]],
    [[35.0, 1.8], [20.0, 3.6], [6.5, 5.5], [4.6, 13.0]],
    [[4.6, 13.0], [3.4, 19.0], [3.4, 60.0], [3.8, 84.0]],
    [[3.8, 84.0], [4.6, 93.0], [15.0, 93.5], [27.0, 104.0]],
    [[27.0, 104.0], [37.5, 113.0], [43.0, 126.0], [43.0, 142.0]],
    [[43.0, 142.0], [43.0, 168.0], [36.5, 192.0], [33.0, 214.0]],
    [[33.0, 214.0], [32.8, 215.3], [31.9, 215.3], [31.8, 214.0]],
    [[31.8, 214.0], [35.2, 192.0], [41.7, 168.0], [41.7, 142.0]],
    [[41.7, 142.0], [41.7, 127.0], [36.4, 114.2], [26.1, 105.4]],
    [[26.1, 105.4], [15.5, 97.0], [7.0, 95.5], [0.0, 95.5]],
];

/// The first curve of the inside.
const INSIDE: usize = 8;
/// How far the wine reaches into the glass, so that no gap is between them.
const OVERLAP: f64 = 0.25;
/// Where the wine ends at the wall.
const FILL_HEIGHT: f64 = 147.0;
/// The surface of the wine from its rim: radius inwards and height.
const MENISCUS: [[f64; 2]; 4] = [[0.0, 147.0], [0.6, 146.25], [1.4, 145.9], [3.0, 145.75]];

/// Points along each curve.
const ALONG: u32 = 16;
/// Corners of a ring.
const AROUND: u32 = 128;

/// A point of a profile and its unit normal, out of the solid.
type ProfilePoint = (DVec2, DVec2);

/// The glass.
pub fn glass() -> Mesh {
    turned(&[profile(&GLASS)])
}

/// What fills it.
pub fn wine() -> Mesh {
    let inside = &GLASS[INSIDE..];
    // From the axis upwards: against the profile of the glass, whose normals point into the wine.
    let mut wall: Vec<ProfilePoint> = cut_at(inside, FILL_HEIGHT)
        .into_iter()
        .rev()
        .map(|(p, normal)| (p - OVERLAP * normal, -normal))
        .collect();
    let axis = wall.first_mut().expect("a profile has points");
    axis.0.x = 0.0;
    let rim = wall.last_mut().expect("a profile has points");
    rim.0.y = FILL_HEIGHT;
    let radius = rim.0.x;
    let surface: Vec<DVec2> =
        MENISCUS.iter().map(|&[inwards, h]| DVec2::new(radius - inwards, h)).collect();
    let normal = |i: usize| match i {
        // It bends up to the wall and is level from its last point on.
        3.. => DVec2::Y,
        _ => right_of(surface[i + 1] - surface[i.saturating_sub(1)]),
    };
    let mut surface: Vec<ProfilePoint> =
        surface.iter().enumerate().map(|(i, &p)| (p, normal(i))).collect();
    surface.push((DVec2::new(0.0, MENISCUS[3][1]), DVec2::Y));
    turned(&[wall, surface])
}

/// The direction to the right of a way along a profile: out of the solid.
fn right_of(along: DVec2) -> DVec2 {
    DVec2::new(along.y, -along.x).normalize()
}

fn point(curve: &Curve, t: f64) -> DVec2 {
    let [a, b, c, d] = curve.map(DVec2::from);
    let s = 1.0 - t;
    a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
}

fn normal(curve: &Curve, t: f64) -> DVec2 {
    let [a, b, c, d] = curve.map(DVec2::from);
    let s = 1.0 - t;
    right_of((b - a) * (s * s) + (c - b) * (2.0 * s * t) + (d - c) * (t * t))
}

/// All curves as one smooth line; where two join their normals, nearly the same, are averaged.
fn profile(curves: &[Curve]) -> Vec<ProfilePoint> {
    let mut points: Vec<ProfilePoint> = Vec::new();
    for curve in curves {
        for k in 0..=ALONG {
            let t = f64::from(k) / f64::from(ALONG);
            let here = (point(curve, t), normal(curve, t));
            match points.last_mut() {
                Some(last) if k == 0 => last.1 = (last.1 + here.1).normalize(),
                _ => points.push(here),
            }
        }
    }
    points
}

/// The part of a falling profile below a height, its first point exactly there.
fn cut_at(curves: &[Curve], height: f64) -> Vec<ProfilePoint> {
    let first = &curves[0];
    // Heights fall along the curve: bisection to the last bit.
    let (mut above, mut below) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = f64::midpoint(above, below);
        if point(first, middle).y > height {
            above = middle;
        } else {
            below = middle;
        }
    }
    let mut points: Vec<ProfilePoint> = vec![(point(first, below), normal(first, below))];
    points.extend(profile(curves).into_iter().filter(|(p, _)| p.y < height));
    points
}

/// The surface of revolution of a closed profile in smooth pieces; between pieces is a crease.
fn turned(pieces: &[Vec<ProfilePoint>]) -> Mesh {
    let mut mesh = Mesh::default();
    for piece in pieces {
        let mut below: Option<Ring> = None;
        for &(p, normal) in piece {
            let ring = Ring::add(&mut mesh, p, normal);
            if let Some(below) = below {
                below.join(ring, &mut mesh);
            }
            below = Some(ring);
        }
    }
    mesh
}

/// A ring of vertices, or one on the axis.
#[derive(Clone, Copy)]
struct Ring {
    first: u32,
    count: u32,
}

impl Ring {
    fn add(mesh: &mut Mesh, p: DVec2, normal: DVec2) -> Self {
        let first = mesh.positions.len() as u32;
        let count = if p.x == 0.0 { 1 } else { AROUND };
        for k in 0..count {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
            mesh.positions.push(DVec3::new(p.x * cos, p.y, p.x * sin) / 1000.0);
            let normal = if count == 1 { DVec2::new(0.0, normal.y.signum()) } else { normal };
            mesh.normals.push(DVec3::new(normal.x * cos, normal.y, normal.x * sin));
        }
        Self { first, count }
    }

    fn vertex(self, k: u32) -> u32 {
        self.first + k % self.count
    }

    /// The strip to the next ring of the profile.
    fn join(self, next: Self, mesh: &mut Mesh) {
        for k in 0..AROUND {
            // Angles grow from +x to +z: downwards round the y axis.
            let [a, b] = [k, k + 1].map(|k| self.vertex(k));
            let [d, c] = [k, k + 1].map(|k| next.vertex(k));
            if a != b {
                mesh.triangles.push([a, d, b]);
            }
            if c != d {
                mesh.triangles.push([b, d, c]);
            }
        }
    }
}
