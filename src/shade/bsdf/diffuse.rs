//! Lambert's ideal diffuse reflector: `f = ρ/π`.

use super::{BsdfSample, BsdfValue};
use crate::description::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Reflects the share `albedo` of all light, equally bright in every direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Reflected share per channel, in `[0, 1]`.
    pub albedo: Rgb,
}

impl Diffuse {
    #[inline]
    pub(super) fn sample(&self, _wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(u);
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
