//! Which light a sample goes to.
//!
//! Lights infinitely far away are one group, all others another. How much of the first enters the scene
//! grows with the scene, so that it has no flux to be compared with that of lamps, and one huge object
//! would starve all lamps: the groups share the choices evenly. Within the first a light is chosen by
//! the irradiance that it brings, within the second by the tree, from two lights on. Choosing those by
//! power is worse for any number of them (`docs/decisions/light-tree.md`) and is kept for measuring that.

use super::bounds::LightBounds;
use super::tree::LightTree;
use crate::sampling::Piecewise1D;
use glam::Vec3;

/// Chooses among emitters: those at a place come first, those infinitely far away last.
#[derive(Clone, Debug, Default)]
pub struct LightChoice {
    near: Near,
    near_count: u32,
    far: Option<Piecewise1D>,
    far_share: f64,
}

/// How one of the lights at a place is chosen.
#[derive(Clone, Debug, Default)]
enum Near {
    /// None of them shines.
    #[default]
    Nothing,
    /// One alone shines: there is nothing to choose.
    One(u32),
    /// By what each can bring to the point.
    Tree(LightTree),
    /// By power, wherever the point is.
    Table(Piecewise1D),
}

impl Near {
    fn new(lights: &[LightBounds]) -> Self {
        let mut shining = (0..).zip(lights).filter(|(_, light)| light.flux > 0.0);
        match (shining.next(), shining.next()) {
            (None, _) => Self::Nothing,
            (Some((only, _)), None) => Self::One(only),
            _ => Self::Tree(LightTree::new(lights)),
        }
    }

    fn by_power(lights: &[LightBounds]) -> Self {
        match Self::new(lights) {
            Self::Tree(_) => Self::Table(Piecewise1D::new(lights.iter().map(|light| light.flux))),
            simple => simple,
        }
    }
}

impl LightChoice {
    /// A choice among lights at a place and then lights infinitely far away, which bring this much
    /// irradiance each.
    pub fn new(near: &[LightBounds], far: &[f64]) -> Self {
        Self::with(Near::new(near), near, far)
    }

    /// The same, but lights at a place are chosen by their power alone.
    pub fn by_power(near: &[LightBounds], far: &[f64]) -> Self {
        Self::with(Near::by_power(near), near, far)
    }

    fn with(choice: Near, near: &[LightBounds], far: &[f64]) -> Self {
        let near_power: f64 = near.iter().map(|light| light.flux).sum();
        let far_power: f64 = far.iter().sum();
        let far_share = match (near_power > 0.0, far_power > 0.0) {
            (_, false) => 0.0,
            (false, true) => 1.0,
            (true, true) => 0.5,
        };
        Self {
            near: choice,
            near_count: near.len() as u32,
            far: (!far.is_empty()).then(|| Piecewise1D::new(far.iter().copied())),
            far_share,
        }
    }

    /// Whether there are lights in both groups, so that either is drawn with probability ½: by a number
    /// below ½ a distant light, by any other one at a place.
    #[inline]
    pub fn has_both_groups(&self) -> bool {
        self.far_share > 0.0 && self.far_share < 1.0
    }

    /// Bytes that the tree over lights at a place holds.
    pub fn memory(&self) -> usize {
        match &self.near {
            Near::Tree(tree) => tree.memory(),
            Near::Table(table) => (table.len() + 1) * size_of::<f64>(),
            Near::Nothing | Near::One(_) => 0,
        }
    }

    /// Draws an emitter for the point `p`; `normal` is where an opaque receiver faces. Returns it with
    /// its probability; `None` where no light can matter.
    #[inline]
    pub fn sample(&self, p: Vec3, normal: Option<Vec3>, u: f64) -> Option<(u32, f32)> {
        if u < self.far_share {
            let far = self.far.as_ref()?;
            let (k, _) = far.sample(u / self.far_share);
            let probability = far.probability(k) * self.far_share;
            return Some((self.near_count + k as u32, probability as f32));
        }
        let share = 1.0 - self.far_share;
        let rescaled = || ((u - self.far_share) / share).min(1.0_f64.next_down());
        let (emitter, probability) = match &self.near {
            Near::Nothing => return None,
            Near::One(only) => (*only, 1.0),
            Near::Tree(tree) => tree.sample(p, normal, rescaled())?,
            Near::Table(table) => {
                let (k, _) = table.sample(rescaled());
                (k as u32, table.probability(k) as f32)
            }
        };
        Some((emitter, probability * share as f32))
    }

    /// The probability with which [`LightChoice::sample`] draws an emitter.
    #[inline]
    pub fn probability(&self, emitter: u32, p: Vec3, normal: Option<Vec3>) -> f32 {
        if emitter >= self.near_count {
            let k = (emitter - self.near_count) as usize;
            return self
                .far
                .as_ref()
                .map_or(0.0, |far| (far.probability(k) * self.far_share) as f32);
        }
        let probability = match &self.near {
            Near::Nothing => 0.0,
            Near::One(only) => f32::from(u8::from(*only == emitter)),
            Near::Tree(tree) => tree.probability(emitter, p, normal),
            Near::Table(table) => table.probability(emitter as usize) as f32,
        };
        probability * (1.0 - self.far_share) as f32
    }
}
