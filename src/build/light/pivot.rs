//! Where a light is, roughly: what distances along a ray through a medium are drawn towards.

use super::{Emitter, Lights};
use crate::description::Light;
use glam::{DVec3, Vec3};

/// Where a light is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pivot {
    /// In this ball.
    Near {
        /// The centre in render space.
        centre: DVec3,
        /// The radius, metres.
        radius: f64,
    },
    /// Infinitely far away.
    Far,
}

impl Lights<'_> {
    /// Chooses a light for the point `p` and tells where it is; `None` where nothing shines.
    pub fn pivot(&self, p: Vec3, time: f32, choose: f64) -> Option<Pivot> {
        let (index, _) = self.table.choice.sample(p, None, choose)?;
        Some(match self.table.emitters[index as usize] {
            Emitter::Shape(instance) => {
                let bounds = self.geometry.instances[instance as usize].bounds;
                let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
                Pivot::Near { centre: 0.5 * (min + max), radius: 0.5 * (max - min).length() }
            }
            Emitter::Triangle { instance, triangle } => {
                let map = self.geometry.instances[instance as usize].motion.at(time);
                let corners = self.triangle(instance, triangle, time, &map);
                let centre = corners.iter().sum::<DVec3>() / 3.0;
                let radius = corners.map(|corner| corner.distance(centre)).into_iter();
                Pivot::Near { centre, radius: radius.fold(0.0, f64::max) }
            }
            Emitter::Punctual(index) => {
                let light = &self.punctual[index as usize];
                match light.light {
                    Light::Point { .. } | Light::Spot { .. } => {
                        let centre = light.motion.at(time).translation;
                        Pivot::Near { centre, radius: 0.0 }
                    }
                    Light::Directional { .. } | Light::Sky { .. } => Pivot::Far,
                }
            }
        })
    }
}
