//! Dividing a mesh until no edge looks long.
//!
//! Whether an edge is divided is told by its two ends alone, which both triangles share: so neighbours agree, and
//! no crack opens between a fine part and a coarse one (Moreton 2001, "Watertight Tessellation using Forward
//! Differencing", Graphics Hardware, section 3, on rates by edge).

use crate::description::TriangleMesh;
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

/// From where a mesh is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Camera space, which has the size of the world, from that of the mesh.
    pub camera_from_mesh: DAffine3,
    /// The least side of a pixel at the camera, metres, and by how much it grows with each metre of distance.
    pub pixel: (f64, f64),
}

impl View {
    /// How many pixels an edge spans where it looks longest: seen square on, from its nearer end.
    ///
    /// The direction in which it is seen does not count. Mirrors and shadows show as well what is beside or
    /// behind the camera.
    #[inline]
    pub fn span(&self, p: Vec3, q: Vec3) -> f64 {
        let at = |p: Vec3| self.camera_from_mesh.transform_point3(p.as_dvec3());
        let (a, b) = (at(p), at(q));
        let nearer = a.length_squared().min(b.length_squared()).sqrt();
        (a - b).length() / (self.pixel.0 + self.pixel.1 * nearer)
    }
}

/// A mesh would have too many triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooFine {
    /// So many at least.
    pub triangles: usize,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The point halfway between two vertices; the same bits from either end.
fn halfway(mesh: &TriangleMesh, [a, b]: [u32; 2]) -> Vec3 {
    let at = |k: u32| mesh.positions[k as usize].as_dvec3();
    ((at(a) + at(b)) * 0.5).as_vec3()
}

/// The mesh with each long edge divided in the middle, once; `None` where none is long. Positions stay on the
/// triangles as they were; normals, uv and colours are interpolated. An edge between neighbouring numbers of
/// `f32` is not divided.
///
/// `is_long` must say the same of any two vertices at the same two places. `fits` is asked with numbers of
/// triangles and vertices before any memory is taken.
///
/// # Errors
/// When the result does not fit.
pub fn divided_where_long(
    mesh: &TriangleMesh,
    is_long: impl Fn(u32, u32) -> bool + Sync,
    fits: impl Fn(usize, usize) -> bool,
) -> Result<Option<TriangleMesh>, TooFine> {
    let long = |a: u32, b: u32| {
        let between = halfway(mesh, [a, b]);
        is_long(a, b)
            && between != mesh.positions[a as usize]
            && between != mesh.positions[b as usize]
    };
    let flags: Vec<[bool; 3]> =
        mesh.triangles.par_iter().map(|&[a, b, c]| [long(a, b), long(b, c), long(c, a)]).collect();
    let sides = |&[a, b, c]: &[u32; 3]| [key(a, b), key(b, c), key(c, a)];
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles
        .par_iter()
        .zip(&flags)
        .flat_map_iter(|(triangle, flags)| {
            sides(triangle).into_iter().zip(flags).filter(|(_, long)| **long).map(|(edge, _)| edge)
        })
        .collect();
    if edges.is_empty() {
        return Ok(None);
    }
    edges.par_sort_unstable();
    edges.dedup();
    let more: usize = flags.iter().flatten().filter(|long| **long).count();
    let (triangles, vertices) = (mesh.triangles.len() + more, mesh.positions.len() + edges.len());
    if u32::try_from(vertices).is_err() || !fits(triangles, vertices) {
        return Err(TooFine { triangles });
    }
    let first = mesh.positions.len() as u32;
    // Every long edge was gathered, so that the place is that of the edge.
    let middle = |edge: [u32; 2]| first + edges.partition_point(|before| *before < edge) as u32;
    let mut fine = TriangleMesh {
        positions: extended(&mesh.positions, &edges, |_, _, edge| halfway(mesh, edge)),
        normals: extended(&mesh.normals, &edges, |a, b, _| (a + b).normalize_or(a)),
        uvs: extended(&mesh.uvs, &edges, |a, b, _| (a + b) * 0.5),
        colors: extended(&mesh.colors, &edges, |a, b, _| (a + b) * 0.5),
        chart: mesh.chart,
        ..Default::default()
    };
    let parts = |(triangle, flags): (&[u32; 3], &[bool; 3])| {
        let edges = sides(triangle);
        let middles: [Option<u32>; 3] = std::array::from_fn(|k| flags[k].then(|| middle(edges[k])));
        divided(*triangle, middles, |p, q| {
            let at = |k: u32| fine.positions[k as usize].as_dvec3();
            at(p).distance_squared(at(q))
        })
    };
    fine.triangles = mesh.triangles.par_iter().zip(&flags).flat_map_iter(parts).collect();
    debug_assert_eq!(fine.triangles.len(), triangles);
    Ok(Some(fine))
}

/// Values of vertices, and behind them those of the middles of edges; none where there are none.
fn extended<T: Copy + Send + Sync>(
    values: &[T],
    edges: &[[u32; 2]],
    between: impl Fn(T, T, [u32; 2]) -> T + Sync,
) -> Vec<T> {
    let mut list = Vec::new();
    if !values.is_empty() {
        list.reserve_exact(values.len() + edges.len());
        list.extend_from_slice(values);
        let at = |k: u32| values[k as usize];
        list.par_extend(edges.par_iter().map(|&[a, b]| between(at(a), at(b), [a, b])));
    }
    list
}

/// The parts of a triangle with these points in the middle of its sides, turning the same way. Where two sides
/// are divided, what is left is cut along its shorter diagonal.
fn divided(
    [a, b, c]: [u32; 3],
    [ab, bc, ca]: [Option<u32>; 3],
    squared_distance: impl Fn(u32, u32) -> f64,
) -> impl Iterator<Item = [u32; 3]> {
    // Cuts off the corner `q` between `p` and `r`.
    let two = |[p, q, r]: [u32; 3], [pq, qr]: [u32; 2]| {
        if squared_distance(pq, r) <= squared_distance(p, qr) {
            [Some([pq, q, qr]), Some([pq, qr, r]), Some([pq, r, p]), None]
        } else {
            [Some([pq, q, qr]), Some([p, pq, qr]), Some([p, qr, r]), None]
        }
    };
    let one = |[p, q, r]: [u32; 3], pq: u32| [Some([p, pq, r]), Some([pq, q, r]), None, None];
    let parts = match (ab, bc, ca) {
        (None, None, None) => [Some([a, b, c]), None, None, None],
        (Some(ab), None, None) => one([a, b, c], ab),
        (None, Some(bc), None) => one([b, c, a], bc),
        (None, None, Some(ca)) => one([c, a, b], ca),
        (Some(ab), Some(bc), None) => two([a, b, c], [ab, bc]),
        (None, Some(bc), Some(ca)) => two([b, c, a], [bc, ca]),
        (Some(ab), None, Some(ca)) => two([c, a, b], [ca, ab]),
        (Some(ab), Some(bc), Some(ca)) => {
            [Some([a, ab, ca]), Some([ab, b, bc]), Some([ca, bc, c]), Some([ab, bc, ca])]
        }
    };
    parts.into_iter().flatten()
}

/// The most pixels that an edge spans in any view.
pub fn longest_span(views: &[View], p: Vec3, q: Vec3) -> f64 {
    views.iter().map(|view| view.span(p, q)).fold(0.0, f64::max)
}

/// The view of a perspective camera whose picture is `height` pixels high and `aspect` times as wide: the least
/// pixel for a distance from the camera is the one in a corner of the picture.
pub fn perspective_pixel(tan_half_fov: f64, height: f64, aspect: f64) -> (f64, f64) {
    let corner = DVec3::new(tan_half_fov * aspect, tan_half_fov, 1.0).length();
    (0.0, 2.0 * tan_half_fov / height / corner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::modelling::solids::{assert_closed, octahedron, volume};
    use glam::Vec2;

    /// A camera at a place in the space of the mesh, whose pixel grows by a thousandth of the distance.
    fn seen_from(p: DVec3) -> View {
        View { camera_from_mesh: DAffine3::from_translation(-p), pixel: (0.0, 1e-3) }
    }

    fn diced(mesh: &TriangleMesh, views: &[View], pixels: f64) -> TriangleMesh {
        let mut mesh = mesh.clone();
        loop {
            let p = &mesh.positions;
            let long = |a: u32, b: u32| longest_span(views, p[a as usize], p[b as usize]) > pixels;
            match divided_where_long(&mesh, long, |_, _| true) {
                Ok(Some(finer)) => mesh = finer,
                Ok(None) => return mesh,
                Err(_) => unreachable!("all fits"),
            }
        }
    }

    /// A solid near one of whose corners the camera is, with a seam: closed by its places, each edge between two
    /// triangles which pass it in opposite ways, its form kept, no edge long, and where the camera is far the
    /// triangles are large.
    #[test]
    fn no_crack_opens_between_fine_and_coarse() {
        let mut solid = octahedron();
        solid.positions.extend([Vec3::X, Vec3::Y]);
        solid.triangles[0] = [6, 7, 2];
        solid.uvs = (0..8).map(|k| Vec2::splat(k as f32)).collect();
        let view = seen_from(DVec3::new(1.02, 0.01, 0.02));
        let fine = diced(&solid, &[view], 20.0);
        assert!((volume(&fine) - 4.0 / 3.0).abs() < 1e-6, "{}", volume(&fine));
        assert_closed(&fine);
        let (mut least, mut greatest) = (f32::INFINITY, 0.0_f32);
        for &[a, b, c] in &fine.triangles {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let (p, q) = (fine.positions[p as usize], fine.positions[q as usize]);
                assert!(view.span(p, q) <= 20.0);
                least = least.min(p.distance(q));
                greatest = greatest.max(p.distance(q));
            }
        }
        assert!(greatest > 10.0 * least, "{least} to {greatest}");
    }

    /// Closed form: the corner pixel of a square picture of 90° is seen at 54.7°, where a length square on to the
    /// ray at distance d has √3 times as many pixels as in the middle.
    #[test]
    fn the_least_pixel_is_in_the_corner() {
        let (_, growth) = perspective_pixel(1.0, 100.0, 1.0);
        assert!((growth * 3.0_f64.sqrt() - 0.02).abs() < 1e-15);
    }

    /// What does not fit is told before it is made, with its number.
    #[test]
    fn too_fine_a_mesh_is_refused() {
        let refused = divided_where_long(
            &octahedron(),
            |_, _| true,
            |triangles, vertices| {
                assert_eq!((triangles, vertices), (32, 18));
                false
            },
        );
        assert_eq!(refused, Err(TooFine { triangles: 32 }));
    }

    /// An edge of one unit in the last place has no middle, and a needle ends there.
    #[test]
    fn the_division_ends_where_numbers_do() {
        let x = 1.0_f32;
        let positions = vec![Vec3::X * x, Vec3::X * x.next_up(), Vec3::new(x, x, 0.0)];
        let needle = TriangleMesh { positions, triangles: vec![[0, 1, 2]], ..Default::default() };
        let long = |a: u32, b: u32| key(a, b) == [0, 1];
        assert_eq!(divided_where_long(&needle, long, |_, _| true), Ok(None));
    }
}
