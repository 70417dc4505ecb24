//! A perfect mirror whose reflectance does not depend on the angle.

use super::BsdfSample;
use crate::description::Rgb;
use glam::Vec3;

/// Reflects the share `reflectance` into the mirror direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Reflected share per channel, in `[0, 1]`.
    pub reflectance: Rgb,
}

impl Mirror {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> BsdfSample {
        BsdfSample::mirrored(wo, self.reflectance)
    }
}
