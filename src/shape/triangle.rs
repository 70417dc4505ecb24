//! Triangles: a watertight intersection, and sampling by solid angle.

use super::LocalRay;
use super::plane_of_triangle::decide;
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A ray prepared for the test against many triangles of one space.
///
/// Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1): the vertices are
/// moved to the ray's origin and sheared so that the ray runs along the last axis. The edge function
/// of an edge is then the exact negative of what the neighbouring triangle computes for it, so that
/// no ray passes between them. Here in `f64` with vertices from `f32`.
///
/// Along the ray this is not as sound as across: of a strip `r` times as long as its distance `t` loses `r²`
/// roundings. So a bound of them decides whether the sign of `t`, and for a hit its size, is known; where it is
/// not, in some rays of a million, `t` is computed in twice the bits. What is hit has a `t` which is right to
/// half a rounding of `f32`, less than the boxes of a tree of `f32` allow for.
#[derive(Clone, Copy, Debug)]
pub struct TriangleTest {
    pub(crate) o: DVec3,
    pub(crate) d: DVec3,
    pub(crate) axes: [usize; 3],
    pub(crate) shear: DVec3,
}

/// Relative error of the ray parameter of a hit, half a rounding of `f32`.
const T_ERROR: f64 = f32::EPSILON as f64 * 0.25;

/// [`TriangleTest::is_open`]: the error of the sum of volumes, by the sizes of the sheared corners.
///
/// With ε half the distance from 1 to the next `f64`, and X, Y, Z the largest coordinates of the corners, x and y
/// are off by ε·(2·X + 4·Z): the difference to the origin, the slope, its product and the difference are
/// rounded, and neither the slope nor what it moves is larger than 1 and Z. An edge function is then off by
/// ε·(12·X·Y + 8·Z·(X + Y)), at most 2·X·Y large, and the sum of its products with z rounded 4 times: in all
/// 3·Z·ε·(20·X·Y + 8·Z·(X + Y)).
pub(crate) const OPEN: f64 = 64.0 * 0.5 * f64::EPSILON;
/// The same for the size of `t`: the errors of numerator and denominator are no larger, each.
pub(crate) const INEXACT: f64 = T_ERROR * 0.5;

/// The two axes before each, in turn. A table that stays where it is: one on the stack would be written for
/// every ray.
static BEFORE: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

impl TriangleTest {
    /// Prepares a ray.
    #[inline]
    pub fn new(ray: &LocalRay) -> Self {
        let size = ray.d.abs();
        // Without branches, which the directions of bounced rays would mislead.
        let other = if size.y > size.z { size.y } else { size.z };
        let z = usize::from(size.x <= other) * (2 - usize::from(size.y > size.z));
        let [x, y] = BEFORE[z];
        let d = ray.d.to_array();
        let shear = DVec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]);
        Self { o: ray.o, d: ray.d, axes: [x, y, z], shear }
    }

    /// The hit with `0 < t < t_max` and the weights of the second and third vertex.
    #[inline]
    pub fn intersect(&self, triangle: [Vec3; 3], t_max: f64) -> Option<(f64, DVec2)> {
        self.intersect_exact(triangle.map(Vec3::as_dvec3), t_max)
    }

    /// The same for corners in `f64`.
    #[inline]
    pub fn intersect_exact(&self, triangle: [DVec3; 3], t_max: f64) -> Option<(f64, DVec2)> {
        let [kx, ky, kz] = self.axes;
        let sheared = triangle.map(|v| {
            let v = v - self.o;
            DVec3::new(v[kx] - self.shear.x * v[kz], v[ky] - self.shear.y * v[kz], v[kz])
        });
        let [a, b, c] = sheared;
        let u = c.x * b.y - c.y * b.x;
        let v = a.x * c.y - a.y * c.x;
        let w = b.x * a.y - b.y * a.x;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let inv = 1.0 / det;
        let depth = u * a.z + v * b.z + w * c.z;
        let t = depth * self.shear.z * inv;
        if is_open(depth, t, sheared) {
            return self.decide(triangle, t_max);
        }
        (t > 0.0 && t < t_max).then(|| (t, DVec2::new(v * inv, w * inv)))
    }

    /// The hit with `0 < t < t_max` where rounding leaves it open.
    pub(crate) fn decide(&self, triangle: [DVec3; 3], t_max: f64) -> Option<(f64, DVec2)> {
        decide(self.o, self.d, triangle).filter(|(t, _)| *t < t_max)
    }
}

/// Whether rounding may have changed the sign of `t`, or for a positive one more than [`T_ERROR`] of it.
/// `depth` is the sum of the volumes.
#[inline]
fn is_open(depth: f64, t: f64, [a, b, c]: [DVec3; 3]) -> bool {
    let largest = |a: f64, b: f64, c: f64| {
        let (a, b, c) = (a.abs(), b.abs(), c.abs());
        let ab = if a > b { a } else { b };
        if ab > c { ab } else { c }
    };
    let (x, y, z) = (largest(a.x, b.x, c.x), largest(a.y, b.y, c.y), largest(a.z, b.z, c.z));
    let known = depth.abs() * if t > 0.0 { INEXACT } else { 1.0 };
    known < z * (x * y + z * (x + y)) * OPEN
}

/// The area of a triangle.
pub fn area_of([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Solid angles, in steradian, for which the spherical sampling of a triangle is used: below, the
/// angles of the spherical triangle lose their digits, above it covers nearly the hemisphere and the
/// map degenerates. Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., section
/// 6.5.4; outside the range points are drawn evenly by area.
const SPHERICAL_RANGE: std::ops::RangeInclusive<f64> = 3e-4..=6.22;

/// The solid angle of a triangle given by unit vectors to its corners, in steradian.
///
/// Van Oosterom and Strackee 1983, "The Solid Angle of a Plane Triangle", IEEE Trans. Biomed. Eng.
/// 30(2).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + a.dot(c) + b.dot(c)).abs()
}

/// The density per unit solid angle at `p` with which [`sample_triangle`] draws the point `q` of the
/// triangle.
pub fn triangle_pdf(p: DVec3, triangle: [DVec3; 3], q: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|v| v - p);
    if let (Some(a), Some(b), Some(c)) = (a.try_normalize(), b.try_normalize(), c.try_normalize()) {
        let omega = solid_angle([a, b, c]);
        if SPHERICAL_RANGE.contains(&omega) {
            return 1.0 / omega;
        }
    }
    // by area: pdf = d²/(A·cos θ) = d³/(½·|(b − a)×(c − a)·d|)
    let to = q - p;
    let normal = (b - a).cross(c - a);
    let projected = 0.5 * normal.dot(to).abs();
    if projected > 0.0 { to.length_squared() * to.length() / projected } else { 0.0 }
}

/// Draws a point of the triangle as seen from `p`: returns the weights of the second and third
/// vertex. The density is [`triangle_pdf`].
pub fn sample_triangle(p: DVec3, triangle: [DVec3; 3], u: Vec2) -> DVec2 {
    let corners = triangle.map(|v| (v - p).try_normalize());
    if let [Some(a), Some(b), Some(c)] = corners {
        let omega = solid_angle([a, b, c]);
        if SPHERICAL_RANGE.contains(&omega)
            && let Some(w) = sample_spherical(a, b, c, omega, u)
        {
            return weights_along(p, triangle, w);
        }
    }
    let root = f64::from(u.x).sqrt();
    DVec2::new(root * (1.0 - f64::from(u.y)), root * f64::from(u.y))
}

/// A direction drawn evenly from a spherical triangle.
///
/// Arvo 1995, "Stratified Sampling of Spherical Triangles", SIGGRAPH, section 3: the first uniform
/// cuts off a triangle with the same share of the area at the corner `a`, the second picks a point
/// on the arc from `b` to the new corner.
fn sample_spherical(a: DVec3, b: DVec3, c: DVec3, omega: f64, u: Vec2) -> Option<DVec3> {
    let n_ab = a.cross(b).try_normalize()?;
    let n_ca = c.cross(a).try_normalize()?;
    // the angle at a, and the cosine of the arc from a to b
    let cos_alpha = -n_ab.dot(n_ca);
    let sin_alpha = n_ab.cross(n_ca).length();
    let cos_c = a.dot(b);
    let (s, t) = {
        let alpha = sin_alpha.atan2(cos_alpha);
        let phi = f64::from(u.x) * omega - alpha;
        (phi.sin(), phi.cos())
    };
    let v = s + sin_alpha * cos_c;
    let w = t - cos_alpha;
    // cosine of the arc from a to the new corner
    let numerator = (v * t - w * s) * cos_alpha - v;
    let denominator = (v * s + w * t) * sin_alpha;
    let q = if denominator == 0.0 { 1.0 } else { (numerator / denominator).clamp(-1.0, 1.0) };
    let towards_c = (c - a * c.dot(a)).try_normalize()?;
    let new_c = a * q + towards_c * (1.0 - q * q).max(0.0).sqrt();
    let z = 1.0 - f64::from(u.y) * (1.0 - new_c.dot(b));
    let across = (new_c - b * new_c.dot(b)).try_normalize().unwrap_or(DVec3::ZERO);
    Some(b * z + across * (1.0 - z * z).max(0.0).sqrt())
}

/// The weights of the second and third vertex where the direction `w` from `p` meets the triangle's
/// plane, brought into the triangle if rounding left it.
fn weights_along(p: DVec3, [a, b, c]: [DVec3; 3], w: DVec3) -> DVec2 {
    let (e1, e2, s) = (b - a, c - a, p - a);
    let h = w.cross(e2);
    let det = e1.dot(h);
    if det == 0.0 {
        return DVec2::splat(1.0 / 3.0);
    }
    let b1 = (s.dot(h) / det).clamp(0.0, 1.0);
    let b2 = (w.dot(s.cross(e1)) / det).clamp(0.0, 1.0);
    let sum = b1 + b2;
    if sum > 1.0 { DVec2::new(b1 / sum, b2 / sum) } else { DVec2::new(b1, b2) }
}
