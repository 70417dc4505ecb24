//! Which integrator takes a frame, and which paths of it that integrator cannot find.

use super::{Feature, Geometry, Instances, PunctualLights, Requirements};
use crate::description::{Caustics, IntegratorChoice, Light};
use crate::math::Aabb;
use crate::world::Settings;
use bevy_ecs::prelude::*;

/// A lamp which appears smaller than this share of the scene's cross-section is small: by chance a
/// path from a diffuse surface over a mirror meets it less than once in a hundred times.
const SMALL_SHARE: f32 = 0.01;
/// A distant light is small below this angular diameter, degrees: it fills the same share of the
/// hemisphere.
const SMALL_ANGLE_DEG: f32 = 11.5;

/// The integrators as they are run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// Path tracing.
    #[default]
    Path,
    /// Path tracing, the caustics from photons.
    PathWithPhotons,
    /// Photon mapping in two passes.
    PhotonMap,
    /// Stochastic progressive photon mapping.
    Sppm,
}

impl Method {
    /// Whether photons are traced.
    pub fn has_photons(self) -> bool {
        self != Self::Path
    }

    /// Its name, as the record of a run has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "Path",
            Self::PathWithPhotons => "Path with photon caustics",
            Self::PhotonMap => "PhotonMap",
            Self::Sppm => "Sppm",
        }
    }
}

/// The integrator of this frame.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct ChosenIntegrator {
    /// Which.
    pub method: Method,
    /// For `Auto`, why.
    pub reason: Option<String>,
    /// What it cannot find, in words for the user.
    pub warnings: Vec<String>,
}

impl ChosenIntegrator {
    /// The integrator, and for `Auto` why it is taken.
    pub fn description(&self) -> String {
        match &self.reason {
            None => self.method.name().to_owned(),
            Some(reason) => format!("{} (Auto takes it: {reason})", self.method.name()),
        }
    }
}

/// Lights by how hard they are to be met by chance.
#[derive(Clone, Copy, Debug, Default)]
struct LightCounts {
    /// Without any extent.
    points: usize,
    /// With an extent, but a small one.
    small: usize,
    /// Emitting planes, which photons cannot start from.
    planes: usize,
}

/// Writes [`ChosenIntegrator`] when it is different from before.
pub fn choose_integrator(
    settings: Res<Settings>,
    requirements: Res<Requirements>,
    instances: Res<Instances>,
    lights: Res<PunctualLights>,
    mut chosen: ResMut<ChosenIntegrator>,
) {
    let settings = &settings.0;
    let counts = count_lights(&instances, &lights);
    let caustics = requirements.has(Feature::Caustics);
    let hard = counts.points + counts.small;
    let (method, reason) = match (settings.integrator, settings.caustics) {
        (IntegratorChoice::Path, Caustics::Traced) => (Method::Path, None),
        (IntegratorChoice::Path, Caustics::Photons) => (Method::PathWithPhotons, None),
        (IntegratorChoice::PhotonMap, _) => (Method::PhotonMap, None),
        (IntegratorChoice::Sppm, _) => (Method::Sppm, None),
        (IntegratorChoice::Auto, _) if !caustics => {
            (Method::Path, Some("nothing casts caustics".to_owned()))
        }
        (IntegratorChoice::Auto, _) if hard == 0 => {
            (Method::Path, Some("all lights are large enough to be met by chance".to_owned()))
        }
        (IntegratorChoice::Auto, _) => {
            let lights = if hard == 1 { "light" } else { "lights" };
            (Method::PathWithPhotons, Some(format!("caustics of {hard} small {lights}")))
        }
    };
    let mut warnings = Vec::new();
    if method == Method::Path && caustics && counts.points > 0 {
        warnings.push(format!(
            "paths from {} point-like lights over mirrors or through glass are out of reach of \
             `Path`: their caustics and what stands behind glass stay dark; use `caustics: Photons`, \
             `Sppm`, or give the light a size",
            counts.points
        ));
    }
    if method.has_photons() && counts.planes > 0 {
        warnings.push(format!(
            "no photons start from {} emitting planes, which have no end: what they light over \
             mirrors, through glass or (with `Sppm` and `PhotonMap`) at second hand stays dark; \
             use `Path`, or rectangles",
            counts.planes
        ));
    }
    let endless = || instances.list.iter().any(|i| !i.bounds.min.is_finite());
    if method.has_photons() && has_far_light(&lights) && endless() {
        warnings.push(
            "photons of distant lights cover twice the radius of everything that has an end: what an \
             infinite plane beyond it sends back is left out"
                .to_owned(),
        );
    }
    chosen.set_if_neq(ChosenIntegrator { method, reason, warnings });
}

fn has_far_light(lights: &PunctualLights) -> bool {
    let far = |light: &Light<u32>| matches!(light, Light::Directional { .. } | Light::Sky { .. });
    lights.0.iter().any(|l| far(&l.light))
}

fn count_lights(instances: &Instances, lights: &PunctualLights) -> LightCounts {
    let mut counts = LightCounts::default();
    for light in &lights.0 {
        match light.light {
            Light::Point { .. } | Light::Spot { .. } | Light::Directional { angle: 0.0, .. } => {
                counts.points += 1;
            }
            Light::Directional { angle, .. } if angle < SMALL_ANGLE_DEG => counts.small += 1,
            Light::Directional { .. } | Light::Sky { .. } => {}
        }
    }
    let bounded = || instances.list.iter().filter(|i| i.bounds.min.is_finite());
    let whole = bounded().fold(Aabb::EMPTY, |whole, i| whole.union(i.bounds));
    for instance in instances.list.iter().filter(|i| i.emission != super::NOTHING) {
        let plane = Geometry::Primitive(crate::shape::Primitive::Plane);
        if instance.geometry == plane {
            counts.planes += 1;
        } else if instance.bounds.area() < SMALL_SHARE * whole.area() {
            counts.small += 1;
        }
    }
    counts
}
