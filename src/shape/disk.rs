//! The unit disk facing +z.

use super::{CanonicalPoint, LocalHit, LocalRay, LocalSurface};
use crate::math::Chart;
use crate::sampling::warp::square_to_disk;
use glam::{DVec3, Vec2};

/// Density of [`sample`] per unit area.
pub(super) const PDF_AREA: f64 = std::f64::consts::FRAC_1_PI;

pub(super) fn intersect(ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
    let t = -ray.o.z / ray.d.z;
    if !(t > 0.0 && t < t_max) {
        return None;
    }
    let p = ray.at(t);
    (p.x * p.x + p.y * p.y <= 1.0).then_some(LocalHit { t, face: 0 })
}

pub(super) fn surface(p: DVec3) -> LocalSurface {
    let p = DVec3::new(p.x, p.y, 0.0);
    LocalSurface::smooth(p, DVec3::Z, (0.5 + 0.5 * p.x, 0.5 + 0.5 * p.y), Chart::SQUARE, DVec3::X)
}

pub(super) fn sample(u: Vec2) -> CanonicalPoint {
    let p = square_to_disk(u).as_dvec2().extend(0.0);
    CanonicalPoint { p, face: 0, pdf_area: PDF_AREA }
}
