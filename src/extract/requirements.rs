//! What a scene requires, with the reason; everything else is left out of the work.

use super::{Instances, PunctualLights, Surfaces, ViewCamera};
use crate::description::Light;
use crate::world::{Name, Settings, Shape, ShutterMotion};
use bevy_ecs::prelude::*;

/// Something that a scene may require.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// Objects or lights which move within the shutter.
    Motion,
    /// A camera which moves, turns or zooms within the shutter.
    CameraMotion,
    /// A lens with an aperture.
    Lens,
    /// Surfaces with holes.
    Opacity,
    /// Solids which absorb light inside.
    Absorption,
    /// Light from all around.
    Sky,
    /// Light which reaches diffuse surfaces through mirrors or glass.
    Caustics,
}

/// What the scene of this frame requires.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct Requirements {
    /// Each feature once, with what asks for it.
    pub features: Vec<(Feature, String)>,
}

impl Requirements {
    /// Whether a feature is required.
    pub fn has(&self, feature: Feature) -> bool {
        self.features.iter().any(|(f, _)| *f == feature)
    }
}

/// Writes [`Requirements`] when they are different from before.
pub fn derive_requirements(
    instances: Res<Instances>,
    surfaces: Res<Surfaces>,
    lights: Res<PunctualLights>,
    camera: Res<ViewCamera>,
    settings: Res<Settings>,
    named: Query<(&Name, &ShutterMotion), With<Shape>>,
    mut requirements: ResMut<Requirements>,
) {
    let mut found = Requirements::default();
    let mut require = |feature, reason: String| found.features.push((feature, reason));
    let moving = instances.list.iter().filter(|i| !i.motion.is_static()).count()
        + lights.0.iter().filter(|l| !l.motion.is_static()).count();
    if moving > 0 {
        let mut names: Vec<&str> = named
            .iter()
            .filter(|(_, motion)| motion.keys.len() > 1)
            .map(|(name, _)| name.as_str())
            .collect();
        names.sort_unstable();
        let shown = names.iter().take(3).map(|name| format!("`{name}`")).collect::<Vec<_>>();
        let who = if shown.is_empty() { String::new() } else { format!(": {}", shown.join(", ")) };
        require(Feature::Motion, format!("{moving} moving in the shutter{who}"));
    }
    if !camera.is_static() {
        require(Feature::CameraMotion, "the camera moves in the shutter".to_owned());
    }
    if camera.has_lens() {
        require(Feature::Lens, "the camera has an aperture".to_owned());
    }
    let used = |test: &dyn Fn(u32) -> bool| {
        instances.list.iter().filter(|i| i.material != super::NOTHING && test(i.material)).count()
    };
    let masked = used(&|m| surfaces.materials.has_opacity(m));
    if masked > 0 {
        require(Feature::Opacity, format!("{masked} objects with a mask"));
    }
    let absorbing = used(&|m| surfaces.materials.attenuation(m).is_some());
    if absorbing > 0 {
        require(Feature::Absorption, format!("{absorbing} absorbing solids"));
    }
    let skies = lights.0.iter().filter(|l| matches!(l.light, Light::Sky { .. })).count();
    if skies > 0 {
        require(Feature::Sky, format!("{skies} sky lights"));
    }
    let min_alpha = settings.0.photons.min_alpha();
    let specular = used(&|m| surfaces.materials.may_cast_caustics(m, min_alpha));
    let storable = used(&|m| surfaces.materials.may_be_storable(m, min_alpha));
    if specular > 0 && storable > 0 {
        require(Feature::Caustics, format!("{specular} mirrors, clear or polished objects"));
    }
    requirements.set_if_neq(found);
}
