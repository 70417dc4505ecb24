//! Finer meshes: each triangle becomes four.
//!
//! Loop 1987, "Smooth Subdivision Surfaces Based on Triangles", Master's thesis, University of Utah, with
//! the weights of Warren (3/16 for three neighbours, 3/(8n) for more) and the rules of
//! Hoppe et al. 1994, "Piecewise Smooth Surface Reconstruction", section 3.1, for open edges. The limit surface has a
//! continuous normal everywhere. Texture coordinates and colours are interpolated along edges.

use super::weld::{Weld, smooth_normals};
use crate::description::TriangleMesh;
use glam::{DVec3, Vec2, Vec3};
use serde::Deserialize;
use std::collections::HashMap;

/// How triangles are divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Subdivision {
    /// Into a smooth surface, by Loop's rules.
    #[default]
    Smooth,
    /// Where they are: the form stays.
    Flat,
}

/// The places of a mesh and what is around them.
struct Neighbours {
    /// The triangles at each edge by its places, lower first: the places opposite.
    edges: HashMap<[u32; 2], Vec<u32>>,
    /// The neighbours of each place.
    around: Vec<Vec<u32>>,
    /// Its neighbours along open edges.
    open: Vec<Vec<u32>>,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Neighbours {
    fn new(triangles: &[[u32; 3]], count: usize) -> Self {
        let mut edges: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
        for &[a, b, c] in triangles {
            for (p, q, opposite) in [(a, b, c), (b, c, a), (c, a, b)] {
                edges.entry(key(p, q)).or_default().push(opposite);
            }
        }
        let (mut around, mut open) = (vec![Vec::new(); count], vec![Vec::new(); count]);
        for (&[p, q], opposite) in &edges {
            around[p as usize].push(q);
            around[q as usize].push(p);
            // An edge of more than two triangles is a crease as well.
            if opposite.len() != 2 {
                open[p as usize].push(q);
                open[q as usize].push(p);
            }
        }
        // The order of a hash map is not that of the mesh: sums would differ from run to run.
        for list in around.iter_mut().chain(&mut open) {
            list.sort_unstable();
        }
        Self { edges, around, open }
    }

    /// Where a place goes.
    fn moved(&self, place: usize, positions: &[DVec3]) -> DVec3 {
        let p = positions[place];
        let sum = |list: &[u32]| list.iter().map(|&k| positions[k as usize]).sum::<DVec3>();
        match (self.open[place].as_slice(), self.around[place].as_slice()) {
            ([], []) => p,
            ([], around) => {
                let n = around.len() as f64;
                let weight = if around.len() == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * n) };
                p * (1.0 - n * weight) + sum(around) * weight
            }
            (open @ [_, _], _) => p * 0.75 + sum(open) * 0.125,
            // A corner of the border stays.
            _ => p,
        }
    }

    /// The place in the middle of an edge.
    fn middle(&self, a: u32, b: u32, positions: &[DVec3]) -> DVec3 {
        let at = |k: u32| positions[k as usize];
        match self.edges[&key(a, b)].as_slice() {
            &[c, d] => (at(a) + at(b)) * 0.375 + (at(c) + at(d)) * 0.125,
            _ => (at(a) + at(b)) * 0.5,
        }
    }
}

/// The mesh with every triangle divided into four, `levels` times; with smooth normals if it is made smooth.
pub fn subdivided(mesh: &TriangleMesh, levels: u32, how: Subdivision) -> TriangleMesh {
    let mut mesh = mesh.clone();
    for _ in 0..levels {
        mesh = divided_once(&mesh, how);
    }
    if how == Subdivision::Smooth {
        let weld = Weld::new(&mesh);
        mesh.normals = smooth_normals(&mesh, &weld);
    }
    mesh
}

fn divided_once(mesh: &TriangleMesh, how: Subdivision) -> TriangleMesh {
    let weld = Weld::new(mesh);
    let corners: Vec<[u32; 3]> = mesh.triangles.iter().map(|&t| weld.corners(t)).collect();
    let mut positions = vec![DVec3::ZERO; weld.count];
    for (&place, p) in weld.place.iter().zip(&mesh.positions) {
        positions[place as usize] = p.as_dvec3();
    }
    let around = Neighbours::new(&corners, weld.count);
    let smooth = how == Subdivision::Smooth;
    let mut fine = mesh.clone();
    if smooth {
        for (p, &place) in fine.positions.iter_mut().zip(&weld.place) {
            *p = around.moved(place as usize, &positions).as_vec3();
        }
    }
    fine.triangles.clear();
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    for (&triangle, &places) in mesh.triangles.iter().zip(&corners) {
        let mut middle = |i: usize, j: usize| {
            let (a, b) = (triangle[i], triangle[j]);
            *middles.entry(key(a, b)).or_insert_with(|| {
                // From the lower place to the higher one: both sides of a seam get the same bits.
                let [p, q] = key(places[i], places[j]);
                let at = if smooth {
                    around.middle(p, q, &positions)
                } else {
                    (positions[p as usize] + positions[q as usize]) * 0.5
                };
                fine.positions.push(at.as_vec3());
                push_middle(&mut fine.normals, a, b, |n: Vec3| n.normalize_or(Vec3::Z));
                push_middle(&mut fine.uvs, a, b, |uv: Vec2| uv * 0.5);
                push_middle(&mut fine.colors, a, b, |color: Vec3| color * 0.5);
                (fine.positions.len() - 1) as u32
            })
        };
        let [ab, bc, ca] = [middle(0, 1), middle(1, 2), middle(2, 0)];
        let [a, b, c] = triangle;
        fine.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    fine
}

/// Adds what is between two vertices, from their sum.
fn push_middle<T: Copy + std::ops::Add<Output = T>>(
    values: &mut Vec<T>,
    a: u32,
    b: u32,
    of_sum: impl FnOnce(T) -> T,
) {
    if !values.is_empty() {
        values.push(of_sum(values[a as usize] + values[b as usize]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::modelling::grid;
    use crate::description::modelling::solids::{octahedron, volume};
    use glam::DVec2;

    /// Closed forms: a vertex of four neighbours keeps 5/8 of itself in one step (β = 3/32 for each of them); in the limit
    /// each of them counts 1/(3/(8β) + 4) = 1/8, so that the vertex of the octahedron ends at half its height (Loop
    /// 1987). The surface is closed, and its normals point outwards.
    #[test]
    fn an_octahedron_becomes_round() {
        let once = subdivided(&octahedron(), 1, Subdivision::Smooth);
        assert_eq!((once.positions.len(), once.triangles.len()), (18, 32));
        assert!((once.positions[0] - Vec3::X * 0.625).length() < 1e-6);
        let fine = subdivided(&octahedron(), 6, Subdivision::Smooth);
        assert!((fine.positions[0] - Vec3::X * 0.5).length() < 1e-3, "{}", fine.positions[0]);
        // After one step the middle of an edge has six neighbours, each of which counts 1/12 in the limit.
        let middle = Vec3::new(0.302_083, 0.302_083, 0.0);
        assert!(fine.positions.iter().any(|p| p.distance(middle) < 1e-3));
        let ratio = volume(&subdivided(&octahedron(), 5, Subdivision::Smooth)) / volume(&fine);
        assert!((ratio - 1.0).abs() < 1e-2, "converged: {ratio}");
        for (p, n) in fine.positions.iter().zip(&fine.normals) {
            assert!(n.dot(p.normalize()) > 0.9, "{n} at {p}");
        }
    }

    /// A flat mesh with a border stays flat, keeps its corners' sides straight, and its area.
    #[test]
    fn a_border_stays_where_it_is() {
        let mesh = grid(DVec2::new(2.0, 2.0), (2, 2));
        let fine = subdivided(&mesh, 3, Subdivision::Smooth);
        let reach = fine.positions.iter().fold(Vec3::ZERO, |reach, p| reach.max(p.abs()));
        assert!(reach.x <= 1.0 + 1e-6 && reach.y <= 1.0 + 1e-6 && reach.z == 0.0, "{reach}");
        assert!(fine.positions.iter().any(|p| (p.x - 1.0).abs() < 1e-6 && p.y.abs() < 1e-6));
    }

    /// Oracle: the form of the mesh and its area; a seam of uv stays closed in both ways.
    #[test]
    fn flat_division_keeps_the_form_and_seams_stay_closed() {
        let flat = subdivided(&octahedron(), 3, Subdivision::Flat);
        assert!((volume(&flat) - 4.0 / 3.0).abs() < 1e-5);
        // Two squares of a folded sheet, with doubled vertices along the fold.
        let mut sheet = octahedron();
        sheet.positions.extend([Vec3::X, Vec3::Y]);
        sheet.triangles[0] = [6, 7, 2];
        sheet.uvs = (0..8).map(|k| Vec2::splat(k as f32)).collect();
        for how in [Subdivision::Smooth, Subdivision::Flat] {
            let fine = subdivided(&sheet, 3, how);
            let whole = subdivided(&octahedron(), 3, how);
            assert!((volume(&fine) - volume(&whole)).abs() < 1e-6);
            assert_eq!(Weld::new(&fine).count, Weld::new(&whole).count);
            assert!(fine.positions.len() > whole.positions.len());
            assert_eq!(fine.uvs.len(), fine.positions.len());
        }
    }
}
