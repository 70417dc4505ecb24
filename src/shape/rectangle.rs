//! The unit square facing +z.

use super::{CanonicalPoint, LocalHit, LocalRay, LocalSurface};
use crate::math::Chart;
use glam::{DVec2, DVec3, Vec2};

pub(super) fn intersect(ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
    let t = -ray.o.z / ray.d.z;
    // A ray in the plane gives t = ±∞ or NaN and fails here.
    if !(t > 0.0 && t < t_max) {
        return None;
    }
    let p = ray.at(t);
    (p.x.abs() <= 0.5 && p.y.abs() <= 0.5).then_some(LocalHit { t, face: 0 })
}

pub(super) fn surface(p: DVec3) -> LocalSurface {
    let p = DVec3::new(p.x, p.y, 0.0);
    LocalSurface::smooth(p, DVec3::Z, (p.x + 0.5, p.y + 0.5), Chart::SQUARE, DVec3::X)
}

pub(super) fn sample(u: Vec2) -> CanonicalPoint {
    let p = DVec3::new(f64::from(u.x) - 0.5, f64::from(u.y) - 0.5, 0.0);
    CanonicalPoint { p, face: 0, pdf_area: 1.0 }
}

/// A rectangle seen from a point: draws evenly by solid angle.
///
/// Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles",
/// Computer Graphics Forum 32(4), sections 3 and 4; symbols as there. In `f64`.
#[derive(Clone, Copy, Debug)]
pub struct RectangleSampler {
    x0: f64,
    x1: f64,
    y0: f64,
    y1: f64,
    /// The plane's distance below the point, negative.
    z0: f64,
    b0: f64,
    b1: f64,
    k: f64,
    solid_angle: f64,
    axes: [DVec3; 3],
}

impl RectangleSampler {
    /// The rectangle with corner `corner` and perpendicular edges `ex`, `ey`, seen from `p`; `None`
    /// when `p` lies in its plane or the solid angle is too small to be computed by differences of
    /// angles (area sampling is as good there).
    pub fn new(p: DVec3, corner: DVec3, ex: DVec3, ey: DVec3) -> Option<Self> {
        let (width, height) = (ex.length(), ey.length());
        let (x, y) = (ex / width, ey / height);
        let mut z = x.cross(y);
        let d = corner - p;
        let mut z0 = d.dot(z);
        if z0 > 0.0 {
            z = -z;
            z0 = -z0;
        }
        let (x0, y0) = (d.dot(x), d.dot(y));
        let (x1, y1) = (x0 + width, y0 + height);
        // z components of the normals of the four planes through the edges and p
        let nz = |a: f64| a / (z0 * z0 + a * a).sqrt();
        let (n0, n1, n2, n3) = (-nz(y0), nz(x1), nz(y1), -nz(x0));
        let g0 = (-n0 * n1).clamp(-1.0, 1.0).acos();
        let g1 = (-n1 * n2).clamp(-1.0, 1.0).acos();
        let g2 = (-n2 * n3).clamp(-1.0, 1.0).acos();
        let g3 = (-n3 * n0).clamp(-1.0, 1.0).acos();
        let k = std::f64::consts::TAU - g2 - g3;
        let solid_angle = g0 + g1 - k;
        // Four angles of size up to π are subtracted; below this their rounding is visible in f32.
        let resolved = f64::EPSILON * 8.0 * std::f64::consts::TAU / f64::from(f32::EPSILON);
        (z0 < 0.0 && solid_angle > resolved).then_some(Self {
            x0,
            x1,
            y0,
            y1,
            z0,
            b0: n0,
            b1: n2,
            k,
            solid_angle,
            axes: [x, y, z],
        })
    }

    /// Density of [`sample_solid_angle`] per unit solid angle.
    pub fn pdf(&self) -> f64 {
        1.0 / self.solid_angle
    }
}

/// Draws a point of the rectangle evenly by solid angle: returns the vector to it, not normalised,
/// and its position as shares of the two edges.
pub fn sample_solid_angle(r: &RectangleSampler, u: Vec2) -> (DVec3, DVec2) {
    let au = f64::from(u.x) * r.solid_angle + r.k;
    let fu = (au.cos() * r.b0 - r.b1) / au.sin();
    let cu = (1.0 / (fu * fu + r.b0 * r.b0).sqrt()).copysign(fu).clamp(-1.0, 1.0);
    // xu = −cu·z0/√(1 − cu²); written so that cu = ±1 goes to the edge
    let xu = (-(cu * r.z0) / (1.0 - cu * cu).sqrt().max(f64::MIN_POSITIVE)).clamp(r.x0, r.x1);
    let d2 = xu * xu + r.z0 * r.z0;
    let h0 = r.y0 / (d2 + r.y0 * r.y0).sqrt();
    let h1 = r.y1 / (d2 + r.y1 * r.y1).sqrt();
    let hv = h0 + f64::from(u.y) * (h1 - h0);
    let hv2 = hv * hv;
    let yv = if hv2 < 1.0 { (hv * d2.sqrt() / (1.0 - hv2).sqrt()).clamp(r.y0, r.y1) } else { r.y1 };
    let [x, y, z] = r.axes;
    let share = DVec2::new((xu - r.x0) / (r.x1 - r.x0), (yv - r.y0) / (r.y1 - r.y0));
    (x * xu + y * yv + z * r.z0, share)
}
