//! Meshes made from other meshes and from numbers.

mod dice;
mod extrude;
mod grid;
mod patches;
mod subdivide;
mod tessellate;
mod text;
mod weld;

pub use dice::{TooFine, View, divided_where_long, longest_span, perspective_pixel};
pub use extrude::{Filling, extruded, flattened};
pub use grid::grid;
pub use patches::{Patch, Placed, Run, cells_for, patch_mesh, spline_patches};
pub use subdivide::{Subdivision, subdivided};
pub use tessellate::{TessellationError, tessellated};
pub use text::{Alignment, TextError, text_contours};
pub use weld::{Weld, smooth_normals};

/// What the tests of made meshes share.
#[cfg(test)]
pub(crate) mod solids {
    use super::Weld;
    use crate::description::TriangleMesh;
    use glam::Vec3;
    use std::collections::HashMap;

    /// Corners at distance 1 on the axes.
    pub(crate) fn octahedron() -> TriangleMesh {
        let positions = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let upper = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]];
        let lower = [[1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        let triangles = upper.into_iter().chain(lower).collect();
        TriangleMesh { positions, triangles, ..Default::default() }
    }

    /// Every edge, by its places, and how often triangles pass it that way.
    pub(crate) fn ways(mesh: &TriangleMesh) -> HashMap<[u32; 2], u32> {
        let weld = Weld::new(mesh);
        let mut ways = HashMap::new();
        for &triangle in &mesh.triangles {
            let [a, b, c] = weld.corners(triangle);
            for way in [[a, b], [b, c], [c, a]] {
                *ways.entry(way).or_default() += 1;
            }
        }
        ways
    }

    /// Every edge is passed as often one way as the other: once, or where two corners touch as often as they are many.
    pub(crate) fn assert_closed(mesh: &TriangleMesh) {
        let ways = ways(mesh);
        for (&[a, b], count) in &ways {
            assert_ne!(a, b, "a triangle is a line");
            assert_eq!(ways.get(&[b, a]), Some(count), "an edge is open");
        }
    }

    /// The volume that a closed mesh encloses.
    pub(crate) fn volume(mesh: &TriangleMesh) -> f64 {
        let signed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| mesh.positions[k as usize].as_dvec3());
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles.iter().map(signed).sum()
    }
}
