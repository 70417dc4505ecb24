//! Lambert's ideal diffuse reflector: `f = ρ/π`.

use super::{BsdfSample, BsdfValue};
use crate::description::Rgb;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

/// Reflects the share `albedo` of all light, equally bright in every direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Reflected share per channel, in `[0, 1]`.
    pub albedo: Rgb,
}

impl Diffuse {
    #[inline]
    pub(super) fn sample(&self, _wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let wi = cosine_direction(u);
        (wi.z > 0.0).then_some(BsdfSample {
            wi,
            weight: self.albedo,
            pdf: wi.z * FRAC_1_PI,
            delta: false,
            transmitted: false,
            eta: 1.0,
        })
    }

    #[inline]
    pub(super) fn evaluate(&self, wi: Vec3) -> BsdfValue {
        let pdf = wi.z * FRAC_1_PI;
        BsdfValue { f_cos: self.albedo * pdf, pdf }
    }
}

/// Draws a direction around +z with density `cos θ / π` per solid angle.
///
/// `u` in `[0, 1)²`; returns a unit vector with `z >= 0`; `z` is zero only where `u` lies on the
/// border of the square. A uniform point of the disk is lifted to the hemisphere (Malley's
/// method); the disk map of Shirley and Chiu 1997, "A Low Distortion Map Between Disk and
/// Square", keeps strata whole.
#[inline]
pub(super) fn cosine_direction(u: Vec2) -> Vec3 {
    let p = 2.0 * u - Vec2::ONE;
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else if p.y != 0.0 {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    } else {
        (0.0, 0.0)
    };
    let (sin, cos) = phi.sin_cos();
    Vec3::new(r * cos, r * sin, ((1.0 - r) * (1.0 + r)).max(0.0).sqrt())
}
