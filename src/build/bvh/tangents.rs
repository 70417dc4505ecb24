//! The directions that normal maps on a mesh are made for.
//!
//! A normal map means something only in the frame in which it was made: red counts along the tangent, green along the
//! bitangent, blue along the normal between those of the corners. Tools agree on the tangents of Mikkelsen 2008,
//! "Simulation of Wrinkled Surfaces Revisited", master's thesis, University of Copenhagen: one for each corner of a
//! triangle, from the directions in which u grows on the triangles around it, apart where uv is mirrored.
//! Between the corners the tangent is interpolated and not brought to unit length, as is the normal, and the bitangent
//! is `± normal × tangent`. Tangents which came with the mesh go first.

use super::MeshTree;
use super::surface::{Facet, interpolated, uvs_of};
use super::wide::segment_of;
use crate::description::TriangleMesh;
use crate::world::Vertices;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec2, DVec3, DVec4, Vec3, Vec4};

/// The tangents at the corners of each triangle of a mesh, as [`TriangleMesh::tangents`] has them; 0 where uv has no
/// direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangents {
    /// At each key of the shutter.
    keys: Vec<Vec<[Vec4; 3]>>,
}

impl Tangents {
    /// The tangents of a mesh which has these vertices later in the shutter.
    pub fn new(mesh: &TriangleMesh, later: &[Vertices]) -> Self {
        let first = corner_tangents(mesh, &mesh.positions, &mesh.normals);
        let later = later.iter().map(|key| corner_tangents(mesh, &key.positions, &key.normals));
        Self { keys: std::iter::once(first).chain(later).collect() }
    }

    /// Bytes.
    pub fn memory(&self) -> usize {
        self.keys.iter().map(|key| size_of_val(key.as_slice())).sum()
    }

    /// Those of a triangle at `time` in the shutter.
    fn at(&self, triangle: u32, time: f32) -> [DVec4; 3] {
        let key = |k: usize| self.keys[k][triangle as usize].map(Vec4::as_dvec4);
        if self.keys.len() == 1 {
            return key(0);
        }
        let (segment, share) = segment_of(time, self.keys.len() - 1);
        let (begin, end) = (key(segment), key(segment + 1));
        std::array::from_fn(|k| begin[k].lerp(end[k], f64::from(share)))
    }
}

impl MeshTree {
    /// The tangent, the bitangent and the normal that a normal map counts along at a point of a triangle, in the space
    /// of the mesh; `None` where uv has no direction, and where no normal map was known to look.
    pub(super) fn tangent_frame(
        &self,
        triangle: u32,
        weights: DVec2,
        time: f32,
    ) -> Option<[DVec3; 3]> {
        let [a, b, c] = self.tangents.as_ref()?.at(triangle, time);
        let between = a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
        let normal = interpolated(self.normals(triangle, time), weights).unwrap_or_else(|| {
            Facet::new(self.corners(triangle, time), weights).ng.normalize_or_zero()
        });
        let tangent = between.truncate();
        let bitangent = normal.cross(tangent) * between.w.signum();
        (bitangent != DVec3::ZERO).then_some([tangent, bitangent, normal])
    }
}

fn corner_tangents(mesh: &TriangleMesh, positions: &[Vec3], normals: &[Vec3]) -> Vec<[Vec4; 3]> {
    let largest = positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let mut corners = Corners {
        mesh,
        positions,
        normals,
        // A power of two moves no point against another; both it and its inverse are normal numbers.
        scale: (-largest.log2().floor()).clamp(-126.0, 126.0).exp2(),
        tangents: vec![[Vec4::ZERO; 3]; mesh.triangles.len()],
    };
    let Ok(()) = generate_tangents(&mut corners) else { unreachable!("there is no error yet") };
    corners.tangents
}

/// A mesh and its tangents as the library asks for them and gives them.
struct Corners<'a> {
    mesh: &'a TriangleMesh,
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    /// Brings positions near 1: products of lengths neither over- nor underflow.
    scale: f32,
    tangents: Vec<[Vec4; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        (self.positions[self.vertex(face, corner)] * self.scale).to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        if self.normals.is_empty() {
            let [a, b, c] = [0, 1, 2].map(|k| self.positions[self.vertex(face, k)].as_dvec3());
            return (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array();
        }
        self.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        uvs_of(self.mesh, face as u32)[corner].as_vec2().to_array()
    }

    fn set_tangent(&mut self, tangents: Option<TangentSpace>, face: usize, corner: usize) {
        let given = self.mesh.tangents.get(self.vertex(face, corner)).copied();
        let computed = || tangents.map(|tangents| Vec4::from_array(tangents.tangent_encoded()));
        let tangent = given.filter(|given| given.w != 0.0).or_else(computed);
        self.tangents[face][corner] = tangent.filter(|t| t.is_finite()).unwrap_or(Vec4::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::BvhQuality;
    use glam::Vec2;
    use std::sync::Arc;

    /// Two squares side by side in the plane z = 0; on the left one u grows to the left.
    fn mirrored(size: f32) -> TriangleMesh {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0) * size;
        TriangleMesh {
            positions: [-1.0, 0.0, 1.0].map(|x| [corner(x, 0.0), corner(x, 1.0)]).concat(),
            uvs: [1.0, 0.0, 1.0].map(|u| [Vec2::new(u, 0.0), Vec2::new(u, 1.0)]).concat(),
            normals: vec![Vec3::Z; 6],
            triangles: vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]],
            ..Default::default()
        }
    }

    /// Closed form: u grows outwards on both sides, and v up. The corners in the middle are the same vertices, and yet
    /// have two tangents. Whatever the size.
    #[test]
    fn where_uv_is_mirrored_the_bitangent_still_follows_v() {
        for size in [1e-30_f32, 1.0, 3e37] {
            for flat in [false, true] {
                let mut mesh = mirrored(size);
                if flat {
                    mesh.normals = Vec::new();
                }
                let [left, right] = [-Vec3::X.extend(1.0), Vec3::X.extend(1.0)];
                let expected = vec![vec![[left; 3], [left; 3], [right; 3], [right; 3]]];
                assert_eq!(Tangents::new(&mesh, &[]).keys, expected, "size {size:e}");
                let mut tree = MeshTree::build(Arc::new(mesh), BvhQuality::default());
                assert_eq!(tree.tangent_frame(0, DVec2::ZERO, 0.0), None);
                tree.tangents = Some(Arc::new(Tangents::new(&tree.mesh, &[])));
                for (triangle, u) in [(1, -DVec3::X), (2, DVec3::X)] {
                    let frame = tree.tangent_frame(triangle, DVec2::splat(0.25), 0.5);
                    let frame = frame.expect("uv grows there");
                    for (found, expected) in frame.into_iter().zip([u, DVec3::Y, DVec3::Z]) {
                        assert!((found - expected).length() < 1e-12, "{found} {expected}");
                    }
                }
            }
        }
    }

    /// Closed form: on a cylinder with u along its turn the tangent at a vertex is that of the circle, and between two
    /// vertices, `β` apart, shorter by `cos β/2` at most.
    #[test]
    fn on_a_cylinder_tangents_are_those_of_its_circle() {
        let turn = |k: u32| (f64::from(k) * 0.2).sin_cos();
        let point = |k: u32, y: f32| Vec3::new(turn(k).0 as f32, y, turn(k).1 as f32);
        let columns = 8;
        let quad = |k: u32| [[2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1]];
        let mesh = TriangleMesh {
            positions: (0..=columns).flat_map(|k| [point(k, 0.0), point(k, 1.0)]).collect(),
            normals: (0..=columns).flat_map(|k| [point(k, 0.0); 2]).collect(),
            uvs: (0..=columns).flat_map(|k| [0.0, 1.0].map(|v| Vec2::new(k as f32, v))).collect(),
            triangles: (0..columns).flat_map(quad).collect(),
            ..Default::default()
        };
        let mut tree = MeshTree::build(Arc::new(mesh), BvhQuality::default());
        let tangents = Tangents::new(&tree.mesh, &[]);
        assert_eq!(tangents.memory(), 16 * 3 * 16);
        for (triangle, corners) in tree.mesh.triangles.iter().zip(&tangents.keys[0]) {
            for (&vertex, tangent) in triangle.iter().zip(corners) {
                let (sin, cos) = turn(vertex / 2);
                let expected = Vec4::new(cos as f32, 0.0, -sin as f32, 1.0);
                assert!((*tangent - expected).length() < 1e-6, "{vertex}: {tangent} {expected}");
            }
        }
        tree.tangents = Some(Arc::new(tangents));
        let middle = tree.tangent_frame(6, DVec2::new(0.5, 0.0), 0.0).expect("uv grows there");
        let (sin, cos) = (0.2_f64 * 3.5).sin_cos();
        let shorter = 0.1_f64.cos();
        let expected = DVec3::new(cos, 0.0, -sin) * shorter;
        assert!((middle[0] - expected).length() < 1e-6, "{}", middle[0]);
        assert!((middle[1] - DVec3::Y * shorter * shorter).length() < 1e-6, "{}", middle[1]);
    }

    /// Tangents of the file go before computed ones, vertex by vertex; a triangle whose corners share one uv has none.
    #[test]
    fn given_tangents_go_first_and_a_point_of_uv_has_none() {
        let mut mesh = mirrored(1.0);
        let given = Vec4::new(0.6, 0.8, 0.0, -1.0);
        mesh.tangents = vec![Vec4::ZERO; 6];
        mesh.tangents[4] = given;
        let right = Vec3::X.extend(1.0);
        assert_eq!(Tangents::new(&mesh, &[]).keys[0][2], [right, given, right]);
        let mut point = mirrored(1.0);
        point.uvs = vec![Vec2::splat(0.3); 6];
        let mut tree = MeshTree::build(Arc::new(point), BvhQuality::default());
        tree.tangents = Some(Arc::new(Tangents::new(&tree.mesh, &[])));
        assert_eq!(tree.tangent_frame(0, DVec2::splat(0.25), 0.0), None);
    }

    /// Closed form: a square that turns a quarter about z while the shutter is open.
    #[test]
    fn tangents_of_a_deforming_mesh_go_with_it() {
        let mesh = mirrored(1.0);
        let positions = mesh.positions.iter().map(|p| Vec3::new(-p.y, p.x, p.z)).collect();
        let later = vec![Vertices { positions, normals: mesh.normals.clone() }];
        let mut tree =
            MeshTree::deforming(Arc::new(mesh), Arc::new(later.clone()), BvhQuality::default());
        tree.tangents = Some(Arc::new(Tangents::new(&tree.mesh, &later)));
        for (time, tangent) in [(0.0, DVec3::X), (0.5, DVec3::new(0.5, 0.5, 0.0)), (1.0, DVec3::Y)]
        {
            let [found, ..] = tree.tangent_frame(2, DVec2::splat(0.3), time).expect("it has uv");
            assert!((found - tangent).length() < 1e-6, "{time}: {found}");
        }
    }
}
