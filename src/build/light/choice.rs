//! Which light a sample goes to.
//!
//! Lights infinitely far away are one group, all others another; the groups are taken in proportion to
//! their power. Within the first a light is chosen by power, within the second by the tree. Choosing
//! those by power as well was measured against it: already for 10 equal lights in a hall the tree's
//! relative error is a fifth (0.042 for 0.237 at 16 samples), for 8 % more time.

use super::tree::{LightBounds, LightTree};
use crate::sampling::Piecewise1D;
use glam::Vec3;

/// Chooses among emitters: those at a place come first, those infinitely far away last.
#[derive(Clone, Debug, Default)]
pub struct LightChoice {
    near: LightTree,
    near_count: u32,
    far: Option<Piecewise1D>,
    far_share: f64,
}

impl LightChoice {
    /// A choice among lights at a place and then lights of these powers infinitely far away.
    pub fn new(near: &[LightBounds], far: &[f64]) -> Self {
        let near_power: f64 = near.iter().map(|light| light.flux).sum();
        let far_power: f64 = far.iter().sum();
        let far_share = match (near.is_empty(), far.is_empty()) {
            (_, true) => 0.0,
            (true, false) => 1.0,
            (false, false) if near_power + far_power > 0.0 => far_power / (near_power + far_power),
            (false, false) => 0.5,
        };
        Self {
            near: LightTree::new(near),
            near_count: near.len() as u32,
            far: (!far.is_empty()).then(|| Piecewise1D::new(far.iter().copied())),
            far_share,
        }
    }

    /// Draws an emitter for the point `p`; `normal` is where an opaque receiver faces. Returns it with
    /// its probability; `None` where no light can matter.
    pub fn sample(&self, p: Vec3, normal: Option<Vec3>, u: f64) -> Option<(u32, f32)> {
        if u < self.far_share {
            let far = self.far.as_ref()?;
            let (k, _) = far.sample(u / self.far_share);
            let probability = far.probability(k) * self.far_share;
            return Some((self.near_count + k as u32, probability as f32));
        }
        let share = 1.0 - self.far_share;
        let u = ((u - self.far_share) / share).min(1.0_f64.next_down());
        let (emitter, probability) = self.near.sample(p, normal, u)?;
        Some((emitter, probability * share as f32))
    }

    /// The probability with which [`LightChoice::sample`] draws an emitter.
    pub fn probability(&self, emitter: u32, p: Vec3, normal: Option<Vec3>) -> f32 {
        if emitter >= self.near_count {
            let k = (emitter - self.near_count) as usize;
            return self
                .far
                .as_ref()
                .map_or(0.0, |far| (far.probability(k) * self.far_share) as f32);
        }
        self.near.probability(emitter, p, normal) * (1.0 - self.far_share) as f32
    }
}
