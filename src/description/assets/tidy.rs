//! Makes a mesh sound: what the renderer trusts is established here.

use super::{AssetError, MAX_MESH_ELEMENTS, too_large};
use crate::description::TriangleMesh;
use glam::{DVec3, Vec3, Vec4};
use std::path::Path;

/// Checks a mesh as read and brings it into the form that [`TriangleMesh`] promises.
///
/// Unusable normals (zero or not finite) become the normal of their face, for which their vertex is
/// split; other normals get unit length. Triangles of exactly zero area (in `f64`) and unused
/// vertices are dropped.
///
/// # Errors
/// When an index is out of range, a position or texture coordinate is not finite, attributes differ
/// in length, or no triangle is left.
pub(super) fn tidy(mut mesh: TriangleMesh, path: &Path) -> Result<TriangleMesh, AssetError> {
    check(&mesh, path)?;
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|&triangle| area_vector(positions, triangle) != DVec3::ZERO);
    if mesh.triangles.is_empty() {
        let message = if before == 0 {
            "has no triangles; expected a mesh with at least one face".to_owned()
        } else {
            format!("all {before} triangles have zero area; expected at least one that has not")
        };
        return Err(malformed(path, message));
    }
    if !mesh.normals.is_empty() {
        repair_normals(&mut mesh);
    }
    drop_unused(&mut mesh);
    Ok(mesh)
}

pub(super) fn malformed(path: &Path, message: impl Into<String>) -> AssetError {
    AssetError::Mesh { path: path.to_owned(), message: message.into() }
}

fn check(mesh: &TriangleMesh, path: &Path) -> Result<(), AssetError> {
    let vertices = mesh.positions.len();
    if vertices.max(mesh.triangles.len()) > MAX_MESH_ELEMENTS {
        let found = format!("{vertices} vertices, {} triangles", mesh.triangles.len());
        return Err(too_large(path, found, MAX_MESH_ELEMENTS));
    }
    for (name, length) in [
        ("normals", mesh.normals.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("tangents", mesh.tangents.len()),
        ("colours", mesh.colors.len()),
    ] {
        if length != 0 && length != vertices {
            return Err(malformed(path, format!("has {length} {name} for {vertices} positions")));
        }
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        let message = format!("position {i} is {}, which is not finite", mesh.positions[i]);
        return Err(malformed(path, message));
    }
    if let Some(i) = mesh.uvs.iter().position(|uv| !uv.is_finite()) {
        let message = format!("texture coordinate {i} is {}, which is not finite", mesh.uvs[i]);
        return Err(malformed(path, message));
    }
    if let Some(i) = mesh.colors.iter().position(|color| !color.is_finite()) {
        let message = format!("colour {i} is {}, which is not finite", mesh.colors[i]);
        return Err(malformed(path, message));
    }
    let out_of_range = |t: &&[u32; 3]| t.iter().any(|&i| i as usize >= vertices);
    if let Some(triangle) = mesh.triangles.iter().find(out_of_range) {
        let message =
            format!("triangle {triangle:?} refers beyond the last of {vertices} vertices");
        return Err(malformed(path, message));
    }
    Ok(())
}

/// Twice the area times the unit normal. In `f64` the product of two `f32` differences neither
/// overflows nor underflows, so that zero means collinear corners and not a small triangle.
fn area_vector(positions: &[Vec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

fn repair_normals(mesh: &mut TriangleMesh) {
    for normal in &mut mesh.normals {
        // f64: the squared length of a small f32 vector would underflow.
        let wide = normal.as_dvec3();
        *normal =
            wide.try_normalize().filter(|_| wide.is_finite()).unwrap_or(DVec3::ZERO).as_vec3();
    }
    for triangle in &mut mesh.triangles {
        let face = *triangle;
        for corner in triangle {
            let vertex = *corner as usize;
            if mesh.normals[vertex] == Vec3::ZERO {
                let normal = area_vector(&mesh.positions, face).normalize().as_vec3();
                *corner = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[vertex]);
                mesh.normals.push(normal);
                if !mesh.uvs.is_empty() {
                    mesh.uvs.push(mesh.uvs[vertex]);
                }
                if !mesh.tangents.is_empty() {
                    // It was given for a normal which is not there.
                    mesh.tangents.push(Vec4::ZERO);
                }
                if !mesh.colors.is_empty() {
                    mesh.colors.push(mesh.colors[vertex]);
                }
            }
        }
    }
}

/// Keeps the order of the vertices that are left.
fn drop_unused(mesh: &mut TriangleMesh) {
    let mut used = vec![false; mesh.positions.len()];
    for &vertex in mesh.triangles.as_flattened() {
        used[vertex as usize] = true;
    }
    if used.iter().all(|&used| used) {
        return;
    }
    let mut count = 0;
    let renumbered: Vec<u32> = used
        .iter()
        .map(|&used| {
            let index = count;
            count += u32::from(used);
            index
        })
        .collect();
    for vertex in mesh.triangles.as_flattened_mut() {
        *vertex = renumbered[*vertex as usize];
    }
    keep(&mut mesh.positions, &used);
    keep(&mut mesh.normals, &used);
    keep(&mut mesh.uvs, &used);
    keep(&mut mesh.tangents, &used);
    keep(&mut mesh.colors, &used);
}

fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
    let mut flags = used.iter();
    values.retain(|_| *flags.next().expect("as long as the positions, or empty"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn quad() -> TriangleMesh {
        TriangleMesh {
            positions: [(0, 0), (1, 0), (1, 1), (0, 1)]
                .map(|(x, y)| Vec3::new(x as f32, y as f32, 0.0))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        }
    }

    fn message(mesh: TriangleMesh) -> String {
        tidy(mesh, Path::new("mesh.obj")).unwrap_err().to_string()
    }

    #[test]
    fn a_sound_mesh_is_left_as_it_is() {
        assert_eq!(tidy(quad(), Path::new("m")).unwrap(), quad());
    }

    #[test]
    fn zero_area_triangles_and_unused_vertices_go() {
        let mut mesh = quad();
        mesh.positions.insert(0, Vec3::splat(9.0));
        mesh.uvs = (0..5).map(|i| Vec2::splat(i as f32)).collect();
        mesh.triangles = vec![[1, 2, 3], [2, 2, 3], [1, 3, 4]];
        let tidied = tidy(mesh, Path::new("m")).unwrap();
        assert_eq!(tidied.triangles, quad().triangles);
        assert_eq!(tidied.positions, quad().positions);
        assert_eq!(tidied.uvs[0], Vec2::ONE);
    }

    /// Edges of 1e-30 m: their cross product, 1e-60, would be zero in `f32`.
    #[test]
    fn a_tiny_triangle_has_an_area() {
        let mut mesh = quad();
        mesh.positions.iter_mut().for_each(|p| *p *= 1e-30);
        assert_eq!(tidy(mesh, Path::new("m")).unwrap().triangles.len(), 2);
    }

    #[test]
    fn normals_get_unit_length_and_missing_ones_are_the_face_s() {
        let mut mesh = quad();
        mesh.normals = vec![Vec3::ZERO, Vec3::X * 1e-30, Vec3::splat(f32::NAN), Vec3::Y * 1e30];
        mesh.positions[3].z = 1.0;
        let tidied = tidy(mesh, Path::new("m")).unwrap();
        let faces = [Vec3::Z, Vec3::new(1.0, -1.0, 1.0).normalize()];
        for (triangle, face) in tidied.triangles.iter().zip(faces) {
            for &vertex in triangle {
                let (p, n) = (tidied.positions[vertex as usize], tidied.normals[vertex as usize]);
                let expected = match (p.x, p.y) {
                    (1.0, 0.0) => Vec3::X,
                    (0.0, 1.0) => Vec3::Y,
                    _ => face,
                };
                assert!(n.distance(expected) < 1e-6, "{n} at {p}");
            }
        }
    }

    #[test]
    fn faults_are_told_with_their_place() {
        let mut mesh = quad();
        mesh.positions[2].y = f32::NAN;
        assert!(message(mesh).contains("position 2"));
        let mut mesh = quad();
        mesh.triangles[1][1] = 4;
        assert!(message(mesh).contains("[0, 4, 3]"));
        let mut mesh = quad();
        mesh.triangles = vec![[0, 0, 1]];
        assert!(message(mesh).contains("zero area"));
        assert!(message(TriangleMesh::default()).contains("no triangles"));
    }
}
