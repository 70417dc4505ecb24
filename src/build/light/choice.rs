//! Which light a sample goes to.
//!
//! Lights infinitely far away are one group, all others another, and each gets half of the samples. What
//! a distant light sends into the scene grows with the scene: compared by that, one huge object would
//! starve all lamps. Within the first a light is chosen by power, within the second by power when there
//! are few, by the tree when there are many.

use super::tree::{LightBounds, LightTree};
use crate::sampling::Piecewise1D;
use glam::Vec3;

/// From this number of lights on the tree chooses. Below, what it saves does not pay for its descent:
/// measured with `cargo bench --bench lights`.
const TREE_FROM: usize = 2;

/// Chooses among emitters: those at a place come first, those infinitely far away last.
#[derive(Clone, Debug, Default)]
pub struct LightChoice {
    near: Near,
    near_count: u32,
    far: Option<Piecewise1D>,
    far_share: f64,
}

#[derive(Clone, Debug, Default)]
enum Near {
    #[default]
    None,
    Power(Piecewise1D),
    Tree(LightTree),
}

impl LightChoice {
    /// A choice among lights at a place and then lights infinitely far away, of these powers
    /// through a square metre.
    pub fn new(near: &[LightBounds], far: &[f64]) -> Self {
        let near_power: f64 = near.iter().map(|light| light.flux).sum();
        let far_power: f64 = far.iter().sum();
        let far_share = match (near_power > 0.0, far_power > 0.0) {
            (_, false) => 0.0,
            (false, true) => 1.0,
            (true, true) => 0.5,
        };
        let near_choice = if near.is_empty() {
            Near::None
        } else if near.len() < TREE_FROM {
            Near::Power(Piecewise1D::new(near.iter().map(|light| light.flux)))
        } else {
            Near::Tree(LightTree::new(near))
        };
        Self {
            near: near_choice,
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
        let (emitter, probability) = match &self.near {
            Near::None => return None,
            Near::Power(power) => {
                let (k, _) = power.sample(u);
                (k as u32, power.probability(k) as f32)
            }
            Near::Tree(tree) => tree.sample(p, normal, u)?,
        };
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
        let probability = match &self.near {
            Near::None => 0.0,
            Near::Power(power) => power.probability(emitter as usize) as f32,
            Near::Tree(tree) => tree.probability(emitter, p, normal),
        };
        probability * (1.0 - self.far_share) as f32
    }
}
