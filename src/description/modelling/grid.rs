//! A flat grid.

use crate::description::TriangleMesh;
use crate::math::Chart;
use glam::{DVec2, Vec2, Vec3};

/// A rectangle in the xy plane around the origin, facing +z, of so many cells of two triangles; uv is the unit
/// square, as on the shape of that name.
pub fn grid(size: DVec2, (columns, rows): (u32, u32)) -> TriangleMesh {
    let share = |k: u32, n: u32| f64::from(k) / f64::from(n);
    let mut mesh = TriangleMesh { chart: Chart::SQUARE, ..Default::default() };
    for j in 0..=rows {
        for i in 0..=columns {
            let uv = DVec2::new(share(i, columns), share(j, rows));
            let p = (uv - 0.5) * size;
            mesh.positions.push(p.extend(0.0).as_vec3());
            mesh.uvs.push(uv.as_vec2());
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh.normals = vec![Vec3::Z; mesh.positions.len()];
    debug_assert!(mesh.uvs.iter().all(|uv| uv.cmple(Vec2::ONE).all()));
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: the area of the rectangle, all of it facing +z.
    #[test]
    fn a_grid_covers_its_rectangle() {
        let mesh = grid(DVec2::new(3.0, 2.0), (4, 3));
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (20, 24));
        let area: Vec3 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|k| mesh.positions[k as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a) * 0.5)
            .sum();
        assert!(area.distance(Vec3::Z * 6.0) < 1e-5, "{area}");
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            assert!(uv.distance(p.truncate() / Vec2::new(3.0, 2.0) + 0.5) < 1e-6);
        }
    }
}
