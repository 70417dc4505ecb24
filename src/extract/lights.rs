//! Lights without a shape as a table.

use super::{FrameOrigin, NOTHING, SurfaceSlots, spawn_order};
use crate::description::Rgb;
use crate::math::MotionTransform;
use crate::world::{EmissionFactor, Light, ShutterMotion};
use bevy_ecs::prelude::*;
use std::convert::Infallible;

/// A light without a shape in render space. It shines along its local −z.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// What it is, its strengths multiplied by the keyed factor.
    pub light: crate::description::Light<u32>,
    /// Render space from the light's space.
    pub motion: MotionTransform,
}

/// All lights without a shape, in the order of spawning.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct PunctualLights(pub Vec<PunctualLight>);

/// Any change of a light.
type LightChanged =
    (With<Light>, Or<(Changed<Light>, Changed<ShutterMotion>, Changed<EmissionFactor>)>);

/// Writes [`PunctualLights`] when it is different from before.
pub fn extract_lights(
    origin: Res<FrameOrigin>,
    slots: Res<SurfaceSlots>,
    changed: Query<(), LightChanged>,
    mut removed: (RemovedComponents<Light>, RemovedComponents<EmissionFactor>),
    lights: Query<(Entity, &Light, &ShutterMotion, Option<&EmissionFactor>)>,
    mut table: ResMut<PunctualLights>,
) {
    let gone = removed.0.read().count() + removed.1.read().count();
    if !(origin.is_changed() || slots.is_changed() || gone > 0) && changed.is_empty() {
        return;
    }
    let mut found: Vec<(Entity, PunctualLight)> = lights
        .iter()
        .map(|(entity, light, motion, factor)| {
            let mut texture_of = |texture: Entity| {
                Ok::<u32, Infallible>(slots.textures.get(&texture).copied().unwrap_or(NOTHING))
            };
            let Ok(light) = light.clone().map_ref(&mut texture_of);
            let keys: Vec<_> = motion
                .keys
                .iter()
                .map(|key| {
                    let mut key = *key;
                    key.translation -= origin.0;
                    key
                })
                .collect();
            let light = scaled(light, factor.map_or(1.0, |f| f.0 as f32));
            (
                entity,
                PunctualLight { light, motion: MotionTransform::through(&keys, motion.curved) },
            )
        })
        .collect();
    found.sort_unstable_by_key(|(entity, _)| spawn_order(*entity));
    table.set_if_neq(PunctualLights(found.into_iter().map(|(_, light)| light).collect()));
}

/// The light with its strength multiplied.
fn scaled(light: crate::description::Light<u32>, factor: f32) -> crate::description::Light<u32> {
    use crate::description::Light;
    match light {
        Light::Point { intensity, power } => Light::Point {
            intensity: intensity.map(|i| i * factor),
            power: power.map(|p| p * factor),
        },
        Light::Spot { intensity, angle, blend } => {
            Light::Spot { intensity: intensity * factor, angle, blend }
        }
        Light::Directional { irradiance, angle } => {
            Light::Directional { irradiance: irradiance * factor, angle }
        }
        Light::Sky { radiance, scale } => Light::Sky { radiance, scale: scale * factor },
    }
}

impl PunctualLight {
    /// Intensity of a point light, W·sr⁻¹ per channel.
    pub fn point_intensity(intensity: Option<Rgb>, power: Option<Rgb>) -> Rgb {
        intensity.or(power.map(|p| p / (4.0 * std::f32::consts::PI))).unwrap_or(Rgb::ZERO)
    }
}
