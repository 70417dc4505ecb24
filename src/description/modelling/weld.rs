//! Which vertices of a mesh are at the same place.
//!
//! A mesh doubles vertices where texture coordinates or normals change abruptly. What moves its surface must move both
//! alike, or it would tear there.

use crate::description::TriangleMesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// The places of a mesh.
#[derive(Clone, Debug)]
pub struct Weld {
    /// The place of each vertex.
    pub place: Vec<u32>,
    /// How many places there are.
    pub count: usize,
}

impl Weld {
    /// Vertices whose positions are equal share a place; −0 equals 0.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut known: HashMap<[u32; 3], u32> = HashMap::new();
        let place = mesh
            .positions
            .iter()
            .map(|p| {
                let key = p.to_array().map(|x| (x + 0.0).to_bits());
                let next = known.len() as u32;
                *known.entry(key).or_insert(next)
            })
            .collect();
        Self { place, count: known.len() }
    }

    /// The places of the corners of a triangle.
    pub fn corners(&self, triangle: [u32; 3]) -> [u32; 3] {
        triangle.map(|vertex| self.place[vertex as usize])
    }
}

/// Normals of every vertex: the mean of those of the triangles around its place, by their areas.
pub fn smooth_normals(mesh: &TriangleMesh, weld: &Weld) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; weld.count];
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|k| mesh.positions[k as usize].as_dvec3());
        let normal = (b - a).cross(c - a);
        for place in weld.corners(triangle) {
            sums[place as usize] += normal;
        }
    }
    let normal = |place: &u32| sums[*place as usize].normalize_or(DVec3::Z).as_vec3();
    weld.place.iter().map(normal).collect()
}
