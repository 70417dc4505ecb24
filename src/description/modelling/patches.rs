//! Bicubic patches as meshes within a stated error.
//!
//! A patch is kept in homogeneous form, as the curves of [`crate::math::Cubic`] are, so that with weights it is an
//! exact part of a sphere, a torus or any other quadric. Its mesh is a grid of `n × n` cells of two triangles with
//! corners on the surface. With bounds `M` of the second derivatives such a mesh is within `(Mᵤᵤ + 2·Mᵤᵥ + Mᵥᵥ)/8n²` of
//! the surface (Filip, Magedson, Markot 1986, "Surface algorithms using bounds on derivatives", *Computer Aided
//! Geometric Design* 3, theorem 2.4); differences of control points bound the derivatives.

use super::weld::{Weld, smooth_normals};
use crate::description::TriangleMesh;
use crate::math::{Chart, bezier_of_spline, clamped_knots};
use glam::{DVec2, DVec3, DVec4, Vec2, Vec3};
use rayon::prelude::*;

/// A bicubic patch: control points times their weights, and the weights; by v, then by u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch(pub [[DVec4; 4]; 4]);

/// A patch, and what of uv it covers: the corner at its beginning and the one opposite.
pub type Placed = (Patch, [DVec2; 2]);

/// A point of a patch with its derivatives.
struct PatchPoint {
    p: DVec3,
    du: DVec3,
    dv: DVec3,
}

impl Patch {
    /// The patch of 16 control points, row by row along u.
    pub fn new(points: [DVec3; 16], weights: [f64; 16]) -> Self {
        let at = |k: usize| (points[k] * weights[k]).extend(weights[k]);
        Self([0, 1, 2, 3].map(|v| [0, 1, 2, 3].map(|u| at(4 * v + u))))
    }

    /// Cells along each side with which its mesh is within `tolerance` of it, not rounded. Bounds are those of its parts
    /// after so many halvings, the tighter the smaller the parts are.
    fn cells(&self, tolerance: f64, halvings: u32) -> f64 {
        if halvings == 0 {
            return self.cells_at_once(tolerance);
        }
        let quarters = self.halves().into_iter().flat_map(|half| half.turned().halves());
        let cells = quarters.map(|quarter| quarter.cells(tolerance, halvings - 1));
        2.0 * cells.fold(0.0, f64::max)
    }

    /// The halves along u, by de Casteljau's algorithm.
    fn halves(&self) -> [Self; 2] {
        let halves = self.0.map(|[a, b, c, d]| {
            let middle = |p: DVec4, q: DVec4| (p + q) * 0.5;
            let (ab, bc, cd) = (middle(a, b), middle(b, c), middle(c, d));
            let (abc, bcd) = (middle(ab, bc), middle(bc, cd));
            let whole = middle(abc, bcd);
            [[a, ab, abc, whole], [whole, bcd, cd, d]]
        });
        [0, 1].map(|k: usize| Self(halves.map(|half| half[k])))
    }

    /// The same patch with u and v exchanged.
    fn turned(&self) -> Self {
        Self([0, 1, 2, 3].map(|u: usize| [0, 1, 2, 3].map(|v: usize| self.0[v][u])))
    }

    /// The same from the patch as a whole.
    fn cells_at_once(&self, tolerance: f64) -> f64 {
        // From the middle of its control points, so that weights do not count with its distance from the origin.
        let all = || self.0.iter().flatten();
        let centre = all().map(|p| p.truncate() / p.w).sum::<DVec3>() / 16.0;
        let from = |p: DVec4| (p.truncate() - centre * p.w).extend(p.w);
        let net = self.0.map(|row| row.map(from));
        let least = all().fold(f64::INFINITY, |least, p| least.min(p.w));
        let reach = net.iter().flatten().map(|p| p.truncate().length() / p.w).fold(0.0, f64::max);
        let bound =
            |factor: f64, steps: (usize, usize), difference: &dyn Fn(usize, usize) -> DVec4| {
                let (mut point, mut weight) = (0.0_f64, 0.0_f64);
                for v in 0..4 - steps.1 {
                    for u in 0..4 - steps.0 {
                        let d = difference(u, v);
                        (point, weight) = (point.max(d.truncate().length()), weight.max(d.w.abs()));
                    }
                }
                (point * factor, weight * factor)
            };
        let at = |u: usize, v: usize| net[v][u];
        let du = |u, v| at(u + 1, v) - at(u, v);
        let dv = |u, v| at(u, v + 1) - at(u, v);
        let (pu, wu) = bound(3.0, (1, 0), &du);
        let (pv, wv) = bound(3.0, (0, 1), &dv);
        let (puu, wuu) = bound(6.0, (2, 0), &|u, v| du(u + 1, v) - du(u, v));
        let (pvv, wvv) = bound(6.0, (0, 2), &|u, v| dv(u, v + 1) - dv(u, v));
        let (puv, wuv) = bound(9.0, (1, 1), &|u, v| du(u, v + 1) - du(u, v));
        // The quotient rule for P/w, with the largest values of all.
        let (ru, rv) = ((pu + wu * reach) / least, (pv + wv * reach) / least);
        let ruu = (puu + 2.0 * wu * ru + wuu * reach) / least;
        let rvv = (pvv + 2.0 * wv * rv + wvv * reach) / least;
        let ruv = (puv + wu * rv + wv * ru + wuv * reach) / least;
        ((ruu + 2.0 * ruv + rvv) / (8.0 * tolerance)).sqrt()
    }

    /// The point at `(i/n, j/n)`.
    fn at(&self, i: u32, j: u32, n: u32) -> PatchPoint {
        let columns: [(DVec4, DVec4); 4] =
            std::array::from_fn(|u| cubic([0, 1, 2, 3].map(|v| self.0[v][u]), j, n));
        let (point, du) = cubic(columns.map(|column| column.0), i, n);
        let (dv, _) = cubic(columns.map(|column| column.1), i, n);
        let p = point.truncate() / point.w;
        let slope = |d: DVec4| (d.truncate() - p * d.w) / point.w;
        PatchPoint { p: self.collapsed(i, j, n).unwrap_or(p), du: slope(du), dv: slope(dv) }
    }

    /// The point that a side has become whose control points are all the same; it would be rounded otherwise.
    fn collapsed(&self, i: u32, j: u32, n: u32) -> Option<DVec3> {
        let column = |u: usize| [0, 1, 2, 3].map(|v| self.0[v][u]);
        let sides =
            [(j == 0, self.0[0]), (j == n, self.0[3]), (i == 0, column(0)), (i == n, column(3))];
        let points = sides.into_iter().filter(|(on, _)| *on).map(|(_, side)| {
            let points = side.map(|p| p.truncate() / p.w);
            points.iter().all(|p| *p == points[0]).then_some(points[0])
        });
        points.flatten().next()
    }

    /// The normal, from the derivatives; where one of them vanishes, as at a pole, from those a little way in.
    fn normal(&self, i: u32, j: u32, n: u32) -> Vec3 {
        /// Cells are divided so often to look next to a side.
        const INWARDS: u32 = 1024;
        let size = self.0.iter().flatten().map(|p| p.truncate().length() / p.w).fold(0.0, f64::max);
        let still = 64.0 * f64::EPSILON * size;
        let moves = |d: DVec3| d.length() > still;
        let here = self.at(i, j, n);
        let across = here.du.cross(here.dv);
        if moves(here.du) && moves(here.dv) && across.length() > still * here.du.length() {
            return across.normalize().as_vec3();
        }
        let inside = |k: u32| match k {
            0 => 1,
            k if k == n => n * INWARDS - 1,
            k => k * INWARDS,
        };
        let near = self.at(inside(i), inside(j), n * INWARDS);
        near.du.cross(near.dv).normalize_or_zero().as_vec3()
    }
}

/// A cubic Bézier curve and its derivative at `i/n`. Turned around it has the same bits: neighbours which share a side
/// meet on it, whichever way it runs in each.
fn cubic([a, b, c, d]: [DVec4; 4], i: u32, n: u32) -> (DVec4, DVec4) {
    let (t, s) = (f64::from(i) / f64::from(n), f64::from(n - i) / f64::from(n));
    let st = s * t;
    let p = (a * (s * s * s) + d * (t * t * t)) + (b * (3.0 * st * s) + c * (3.0 * st * t));
    let dp = ((b - a) * (s * s) + (d - c) * (t * t) + (c - b) * (2.0 * st)) * 3.0;
    (p, dp)
}

/// Cells along the sides of all patches with which their mesh is within `tolerance` metres of them.
pub fn cells_for(patches: &[Placed], tolerance: f64) -> f64 {
    /// Halvings: a sixty-fourth of a quarter of a sphere is flat enough.
    const HALVINGS: u32 = 3;
    let cells = patches.par_iter().map(|(patch, _)| patch.cells(tolerance, HALVINGS));
    cells.reduce(|| 1.0, f64::max).ceil()
}

/// The mesh of patches, each of `n × n` cells; seen with u to the right and v upwards it faces the eye.
pub fn patch_mesh(patches: &[Placed], n: u32) -> TriangleMesh {
    let side = n + 1;
    let vertices: Vec<(Vec3, Vec3, Vec2)> = patches
        .par_iter()
        .flat_map_iter(|(patch, [from, to])| {
            (0..side * side).map(move |k| {
                let (i, j) = (k % side, k / side);
                let share = DVec2::new(f64::from(i), f64::from(j)) / f64::from(n);
                let uv = *from + (*to - *from) * share;
                (patch.at(i, j, n).p.as_vec3(), patch.normal(i, j, n), uv.as_vec2())
            })
        })
        .collect();
    let mut mesh = TriangleMesh {
        positions: vertices.iter().map(|vertex| vertex.0).collect(),
        normals: vertices.iter().map(|vertex| vertex.1).collect(),
        uvs: vertices.iter().map(|vertex| vertex.2).collect(),
        chart: Chart::SQUARE,
        ..Default::default()
    };
    for patch in 0..patches.len() as u32 {
        for cell in 0..n * n {
            let a = patch * side * side + cell / n * side + cell % n;
            let [b, c, d] = [a + 1, a + side + 1, a + side];
            // At a pole one of the two is a line.
            let is_there = |t: &[u32; 3]| {
                let [p, q, r] = t.map(|k| mesh.positions[k as usize]);
                p != q && q != r && r != p
            };
            mesh.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(is_there));
        }
    }
    if mesh.normals.contains(&Vec3::ZERO) {
        let smooth = smooth_normals(&mesh, &Weld::new(&mesh));
        let missing = mesh.normals.iter_mut().zip(smooth).filter(|(n, _)| **n == Vec3::ZERO);
        missing.for_each(|(normal, smooth)| *normal = smooth);
    }
    mesh
}

/// How a bicubic B-spline surface runs along one of its sides.
#[derive(Clone, Debug, PartialEq)]
pub enum Run {
    /// Between these knots: as many as control points and 4 more.
    Knots(Vec<f64>),
    /// Evenly from the first control point to the last.
    Open,
    /// Evenly around: the control points are a ring.
    Closed,
}

impl Run {
    fn knots(&self, count: usize) -> Vec<f64> {
        match self {
            Self::Knots(knots) => knots.clone(),
            Self::Open => clamped_knots(count),
            Self::Closed => (0..count + 7).map(|k| k as f64).collect(),
        }
    }

    /// The curves of a row of control points.
    fn curves(&self, points: &[DVec4]) -> Vec<[DVec4; 4]> {
        let mut row = points.to_vec();
        if *self == Self::Closed {
            row.extend((0..3).map(|k| points[k % points.len()]));
        }
        let mut curves = bezier_of_spline(&row, &self.knots(points.len()));
        if *self == Self::Closed
            && let Some(&[start, ..]) = curves.first()
            && let Some(last) = curves.last_mut()
        {
            last[3] = start;
        }
        curves
    }
}

/// The patches of a bicubic B-spline surface (with weights, NURBS): one for each rectangle of knots. `net` has its
/// rows along u; uv is the unit square over all patches.
///
/// # Panics
/// When rows are not of one length or knots do not fit them.
pub fn spline_patches(net: &[Vec<DVec4>], [along_u, along_v]: &[Run; 2]) -> Vec<Placed> {
    let rows: Vec<Vec<[DVec4; 4]>> = net.iter().map(|row| along_u.curves(row)).collect();
    let columns = rows[0].len();
    let mut patches = Vec::new();
    for column in 0..columns {
        // Each of the four control points along u of this column runs along v.
        let runs: [Vec<[DVec4; 4]>; 4] = std::array::from_fn(|k| {
            let points: Vec<DVec4> = rows.iter().map(|row| row[column][k]).collect();
            along_v.curves(&points)
        });
        let strips = runs[0].len();
        let corner =
            |i: usize, j: usize| DVec2::new(i as f64 / columns as f64, j as f64 / strips as f64);
        patches.extend((0..strips).map(|strip| {
            let patch = [0, 1, 2, 3].map(|v: usize| [0, 1, 2, 3].map(|u: usize| runs[u][strip][v]));
            (Patch(patch), [corner(column, strip), corner(column + 1, strip + 1)])
        }));
    }
    patches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::modelling::solids::{assert_closed, volume, ways};
    use std::f64::consts::PI;

    const UNIT: [DVec2; 2] = [DVec2::ZERO, DVec2::ONE];

    /// Control points and weights of an exact quarter of the unit circle.
    fn quarter() -> ([DVec2; 4], [f64; 4]) {
        let (w, h) = ((1.0 + 2.0_f64.sqrt()) / 3.0, 2.0 - 2.0_f64.sqrt());
        ([DVec2::X, DVec2::new(1.0, h), DVec2::new(h, 1.0), DVec2::Y], [1.0, w, w, 1.0])
    }

    /// Quarters of a circle of this radius around (`centre`, 0), turned around the y axis in quarters: a sphere or a
    /// torus, exactly.
    fn turned(centre: f64, radius: f64, arcs: u32) -> Vec<Placed> {
        let (points, weights) = quarter();
        let spin = |p: DVec2, k: u32| (0..k).fold(p, |p, _| p.perp());
        let mut patches = Vec::new();
        for (arc, turn) in (0..arcs).flat_map(|arc| (0..4).map(move |turn| (arc, turn))) {
            // From the lowest point on, for a sphere to the highest.
            let meridian = points.map(|p| spin(p, arc + 3) * radius + DVec2::X * centre);
            let patch = [0, 1, 2, 3].map(|v: usize| {
                [0, 1, 2, 3].map(|u: usize| {
                    let around = spin(points[u], turn);
                    let p = meridian[v];
                    let w = weights[u] * weights[v];
                    DVec3::new(p.x * around.x, p.y, -p.x * around.y).extend(1.0) * w
                })
            });
            patches.push((Patch(patch), UNIT));
        }
        patches
    }

    /// How far the middles and edges of the triangles are from where `distance` is 0.
    fn error(mesh: &TriangleMesh, distance: impl Fn(DVec3) -> f64) -> f64 {
        let mut greatest = 0.0_f64;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|k| mesh.positions[k as usize].as_dvec3());
            for (s, t) in (0..=8).flat_map(|i| (0..=8 - i).map(move |j| (i, j))) {
                let (s, t) = (f64::from(s) / 8.0, f64::from(t) / 8.0);
                greatest = greatest.max(distance(a + (b - a) * s + (c - a) * t).abs());
            }
        }
        greatest
    }

    /// Closed forms: a torus and a sphere with poles, whose points, normals and volumes are known. The meshes are within
    /// the error they were asked for, and closed.
    #[test]
    fn exact_quadrics_are_met_within_the_tolerance() {
        for tolerance in [1e-2, 1e-3] {
            for (major, minor, arcs) in [(2.0, 0.5, 4), (0.0, 1.0, 2)] {
                let patches = turned(major, minor, arcs);
                let n = cells_for(&patches, tolerance) as u32;
                let mesh = patch_mesh(&patches, n);
                assert_closed(&mesh);
                let to_ring = |p: DVec3| {
                    let out = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::X) * major;
                    p - out
                };
                let off = error(&mesh, |p| to_ring(p).length() - minor);
                assert!(off <= tolerance, "{off} at {tolerance}");
                assert!(off > tolerance / 8.0, "the bound is not loose beyond use: {off}");
                for (p, normal) in mesh.positions.iter().zip(&mesh.normals) {
                    let away = to_ring(p.as_dvec3());
                    assert!((away.length() - minor).abs() < 3e-7, "corners lie on the surface");
                    let turn = normal.as_dvec3().distance(away / minor);
                    // Next to a pole the normal is that of a place 1/1024 of a cell away.
                    assert!(turn < 2e-6 + 2.0 / (1024.0 * f64::from(n)), "{normal} at {p}");
                }
                let exact = if major > 0.0 {
                    2.0 * PI * PI * major * minor * minor
                } else {
                    4.0 / 3.0 * PI
                };
                let area = if major > 0.0 { 4.0 * PI * PI * major * minor } else { 4.0 * PI };
                assert!((volume(&mesh) - exact).abs() < tolerance * area);
            }
        }
    }

    /// A polynomial patch of a known second derivative: of z = u²/2 over 1 m the chord of 1/n is off by 1/8n².
    #[test]
    fn the_bound_is_sharp_for_a_parabola() {
        let height = [0.0, 0.0, 1.0 / 6.0, 0.5];
        let points = std::array::from_fn(|k| {
            DVec3::new((k % 4) as f64 / 3.0, (k / 4) as f64 / 3.0, height[k % 4])
        });
        let patches = [(Patch::new(points, [1.0; 16]), UNIT)];
        let n = cells_for(&patches, 1.0 / (8.0 * 49.5));
        assert_eq!(n, 8.0, "7 cells are off by 1/392");
        let mesh = patch_mesh(&patches, 8);
        let off = error(&mesh, |p| p.z - 0.5 * p.x * p.x);
        assert!((off - 1.0 / 512.0).abs() < 1e-4, "{off}");
    }

    /// Oracle: the spline as a sum over its control points: a net on a plane with even knots reproduces the plane, and a
    /// closed net in one way is a tube whose edges meet.
    #[test]
    fn spline_surfaces_run_from_end_to_end_or_around() {
        let net: Vec<Vec<DVec4>> = (0..5)
            .map(|j| (0..6).map(|i| DVec4::new(f64::from(i), f64::from(j), 0.5, 1.0)).collect())
            .collect();
        let patches = spline_patches(&net, &[Run::Open, Run::Open]);
        assert_eq!(patches.len(), 3 * 2);
        let mesh = patch_mesh(&patches, 4);
        let reach = mesh.positions.iter().fold(Vec3::ZERO, |reach, p| reach.max(*p));
        assert_eq!(reach, Vec3::new(5.0, 4.0, 0.5));
        let area: Vec3 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|k| mesh.positions[k as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a) * 0.5)
            .sum();
        assert!(area.distance(Vec3::Z * 20.0) < 1e-4, "{area}");
        let ring = |k: u32| {
            let (sin, cos) = (f64::from(k) * PI / 4.0).sin_cos();
            move |y: f64| DVec4::new(cos, y, -sin, 1.0)
        };
        let net: Vec<Vec<DVec4>> =
            (0..4).map(|j| (0..8).map(|k| ring(k)(f64::from(j))).collect()).collect();
        let patches = spline_patches(&net, &[Run::Closed, Run::Open]);
        assert_eq!(patches.len(), 8);
        let tube = patch_mesh(&patches, 4);
        // By its places it is a tube: of its edges only those at both ends have one triangle.
        let ways = ways(&tube);
        let open: Vec<_> = ways.keys().filter(|&&[a, b]| !ways.contains_key(&[b, a])).collect();
        assert_eq!(open.len(), 2 * 8 * 4);
        for n in tube.normals.iter().zip(&tube.positions) {
            assert!(n.0.dot(Vec3::new(n.1.x, 0.0, n.1.z).normalize()) > 0.99, "outwards");
        }
    }
}
