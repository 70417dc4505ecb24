//! A triangle mesh of the zero surface of a field.
//!
//! Surface nets (Gibson 1998, "Constrained Elastic Surface Nets"): each cell of a grid through which the
//! surface passes has one vertex, the mean of the crossings on its edges; four cells around a
//! crossed edge make a quadrangle. Vertices are then moved onto the surface by Newton's method.

use super::figure::Figure;
use super::glb::Mesh;
use glam::{DVec3, UVec3};

/// Field values at the points of a grid.
struct Grid {
    min: DVec3,
    cell: f64,
    /// Points along each axis.
    size: UVec3,
    values: Vec<f64>,
}

impl Grid {
    fn new(figure: &Figure, cell: f64) -> Self {
        let size = ((figure.max - figure.min) / cell).ceil().as_uvec3() + 1;
        let mut grid = Self { min: figure.min, cell, size, values: Vec::new() };
        for z in 0..size.z {
            for y in 0..size.y {
                for x in 0..size.x {
                    grid.values.push(figure.distance(grid.point(UVec3::new(x, y, z))));
                }
            }
        }
        grid
    }

    fn point(&self, at: UVec3) -> DVec3 {
        self.min + self.cell * at.as_dvec3()
    }

    fn index(&self, at: UVec3) -> usize {
        ((at.z * self.size.y + at.y) * self.size.x + at.x) as usize
    }

    fn value(&self, at: UVec3) -> f64 {
        self.values[self.index(at)]
    }

    /// Points from which the edge or cell towards larger coordinates exists.
    fn corners(&self) -> impl Iterator<Item = UVec3> + use<> {
        let size = self.size - 1;
        (0..size.z).flat_map(move |z| {
            (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec3::new(x, y, z)))
        })
    }

    /// The mean of the crossings on the twelve edges of a cell.
    fn vertex(&self, cell: UVec3) -> Option<DVec3> {
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for (axis, u, v) in [
            (UVec3::X, UVec3::Y, UVec3::Z),
            (UVec3::Y, UVec3::Z, UVec3::X),
            (UVec3::Z, UVec3::X, UVec3::Y),
        ] {
            for from in [cell, cell + u, cell + v, cell + u + v] {
                let (a, b) = (self.value(from), self.value(from + axis));
                if (a < 0.0) != (b < 0.0) {
                    sum += self.point(from) + axis.as_dvec3() * (self.cell * a / (a - b));
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }
}

/// The surface of a figure in cells of the given edge, metres, with the normals of the field.
pub fn surface_net(figure: &Figure, cell: f64) -> Mesh {
    let grid = Grid::new(figure, cell);
    let mut vertex_of = vec![u32::MAX; grid.values.len()];
    let mut mesh = Mesh::default();
    for at in grid.corners() {
        if let Some(p) = grid.vertex(at) {
            vertex_of[grid.index(at)] = mesh.positions.len() as u32;
            let p = onto_surface(figure, p);
            mesh.positions.push(p);
            mesh.normals.push(figure.gradient(p).normalize());
        }
    }
    for at in grid.corners() {
        for (axis, u, v) in [
            (UVec3::X, UVec3::Y, UVec3::Z),
            (UVec3::Y, UVec3::Z, UVec3::X),
            (UVec3::Z, UVec3::X, UVec3::Y),
        ] {
            let inside = [at, at + axis].map(|point| grid.value(point) < 0.0);
            if inside[0] == inside[1] || at.dot(u) == 0 || at.dot(v) == 0 {
                continue;
            }
            let around = [at - u - v, at - v, at, at - u].map(|cell| vertex_of[grid.index(cell)]);
            // Counter-clockwise as seen from where the axis points; turned round if that is inside.
            let [a, b, c, d] = around;
            quadrangle(&mut mesh, if inside[0] { [a, b, c, d] } else { [d, c, b, a] });
        }
    }
    mesh
}

/// Cut along its shorter diagonal.
fn quadrangle(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    let length = |i: u32, j: u32| mesh.positions[i as usize].distance(mesh.positions[j as usize]);
    if length(a, c) <= length(b, d) {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    } else {
        mesh.triangles.extend([[a, b, d], [b, c, d]]);
    }
}

/// Newton's method along the gradient; each step squares the error.
fn onto_surface(figure: &Figure, mut p: DVec3) -> DVec3 {
    for _ in 0..4 {
        let gradient = figure.gradient(p);
        p -= gradient * (figure.distance(p) / gradient.length_squared());
    }
    p
}
