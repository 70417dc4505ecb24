//! The infinite plane y = 0.

use super::{LocalHit, LocalRay, LocalSurface};
use crate::math::Chart;
use glam::DVec3;

pub(super) fn intersect(ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
    let t = -ray.o.y / ray.d.y;
    (t > 0.0 && t < t_max).then_some(LocalHit { t, face: 0 })
}

pub(super) fn surface(p: DVec3) -> LocalSurface {
    let p = DVec3::new(p.x, 0.0, p.z);
    LocalSurface::smooth(p, DVec3::Y, (p.x, -p.z), Chart::ENDLESS, DVec3::X)
}
