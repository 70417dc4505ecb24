//! Meshes for tests and benches, and rays into them.

use glam::{Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// Corners and triangles.
#[derive(Clone, Debug, Default)]
pub struct RawMesh {
    /// Where the corners are.
    pub positions: Vec<Vec3>,
    /// Indices of three corners each.
    pub triangles: Vec<[u32; 3]>,
}

/// A stream of uniforms (Steele, Lea, Flood 2014, "Fast Splittable Pseudorandom Number Generators").
#[derive(Clone, Debug)]
pub struct Uniforms(pub u64);

impl Uniforms {
    /// The next number in `[0, 1)`.
    pub fn one(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 40) as f32 * 2.0_f32.powi(-24)
    }

    /// A point of `[0, 1)²`.
    pub fn two(&mut self) -> Vec2 {
        Vec2::new(self.one(), self.one())
    }

    /// A point of `[0, 1)³`.
    pub fn three(&mut self) -> Vec3 {
        self.two().extend(self.one())
    }

    /// An index below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.one() * count as f32) as usize).min(count - 1)
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vec3 {
        let (z, phi) = (2.0 * self.one() - 1.0, TAU * self.one());
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

impl RawMesh {
    /// Adds another mesh.
    pub fn add(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|k| k + base)));
    }

    /// Changes the corners.
    #[must_use]
    pub fn map(mut self, f: impl Fn(Vec3) -> Vec3) -> Self {
        for p in &mut self.positions {
            *p = f(*p);
        }
        self
    }

    /// Triangles of about the given size in the unit cube, in no order.
    pub fn soup(count: usize, size: f32, seed: u64) -> Self {
        let mut u = Uniforms(seed);
        let mut mesh = Self::default();
        for k in 0..count as u32 {
            let p = u.three();
            mesh.positions.extend([p, p + (u.three() - 0.5) * size, p + (u.three() - 0.5) * size]);
            mesh.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
        }
        mesh
    }

    /// A patch `(s, t) in [0, 1]² -> point` of `n × m` cells.
    pub fn patch(n: u32, m: u32, point: impl Fn(f32, f32) -> Vec3) -> Self {
        let mut mesh = Self::default();
        for j in 0..=m {
            mesh.positions.extend((0..=n).map(|i| point(i as f32 / n as f32, j as f32 / m as f32)));
        }
        let at = |i, j| j * (n + 1) + i;
        for j in 0..m {
            for i in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }

    /// A dented ball of `12·n²` triangles or fewer.
    pub fn blob(n: u32, center: Vec3, radius: f32, seed: u64) -> Self {
        let mut u = Uniforms(seed);
        let (f, phase) = (u.three() * 7.0, u.three() * TAU);
        Self::patch(3 * n, 2 * n, |s, t| {
            let (phi, theta) = (s * TAU, t * TAU / 2.0);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let w = (d * f + phase).map(f32::sin);
            center + d * radius * (1.0 + 0.15 * (w.x + w.y + w.z))
        })
    }

    /// A box with the corners of `[−½, ½]³` carried by `f`.
    pub fn cuboid(f: impl Fn(Vec3) -> Vec3) -> Self {
        let positions = (0..8)
            .map(|k| f(Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) - 0.5))
            .collect();
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { positions, triangles }
    }

    /// Hills of `2·n²` triangles over `[0, 1]²`, y upwards, with blobs of `12·m²` scattered over them.
    pub fn terrain(n: u32, blobs: u64, m: u32) -> Self {
        let height = |x: f32, z: f32| {
            (1..6).fold(0.0, |sum, k| {
                let f = 2.0_f32.powi(k);
                sum + 0.15 / f * ((f * 5.1 * x + f).sin() + (f * 4.3 * z + 2.0 * f + x).sin())
            })
        };
        let mut mesh = Self::patch(n, n, |x, z| Vec3::new(x, height(x, z), z));
        let mut u = Uniforms(7);
        for k in 0..blobs {
            let p = u.two();
            let r = 0.004 + 0.012 * u.one();
            let center = Vec3::new(p.x, height(p.x, p.y) + r, p.y);
            mesh.add(&Self::blob(m, center, r, k));
        }
        mesh
    }

    /// A closed room over `[0, 1]³` of 12 triangles, with long thin slanted beams and with blobs.
    pub fn room(beams: u64, blobs: u64, m: u32) -> Self {
        let mut mesh = Self::cuboid(|p| p + 0.5);
        let mut u = Uniforms(3);
        for _ in 0..beams {
            let (a, mut d) = (u.three(), u.direction() * 0.1);
            d[u.below(3)] = 1.0;
            let turn = Quat::from_rotation_arc(Vec3::Z, d.normalize());
            let length = 0.2 + 0.5 * u.one();
            mesh.add(&Self::cuboid(|p| {
                let p = a + turn * (p * Vec3::new(0.004, 0.004, length));
                p.clamp(Vec3::splat(0.001), Vec3::splat(0.999))
            }));
        }
        for k in 0..blobs {
            let r = 0.01 + 0.03 * u.one();
            let center = u.three() * 0.9 + 0.05;
            mesh.add(&Self::blob(m, center, r, k));
        }
        mesh
    }

    /// A closed ball of `20·4ⁿ` triangles with radius 1, which share their corners.
    pub fn icosphere(n: u32) -> Self {
        let g = f32::midpoint(1.0, 5.0_f32.sqrt());
        let mut positions = Vec::new();
        for (a, b) in [(-1.0, -g), (1.0, -g), (-1.0, g), (1.0, g)] {
            positions.extend([Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]);
        }
        // The faces are the triples of corners 2 apart.
        let near = |a: usize, b: usize| (positions[a] - positions[b]).length() < 2.1;
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if near(a, b) && near(b, c) && near(a, c) {
                        triangles.push([a as u32, b as u32, c as u32]);
                    }
                }
            }
        }
        for p in &mut positions {
            *p = p.normalize();
        }
        for _ in 0..n {
            let mut middles = std::collections::HashMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        Self { positions, triangles }
    }
}
