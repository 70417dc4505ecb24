//! How noisy caustics would be if paths from the camera had to find them by chance.
//!
//! A path which has left a diffuse surface meets a caster `c` with about the probability `C/W`, where `C` is the area of
//! what has this lobe and `W` that of the whole scene. The lobe passes on the share `R` of the light, and sees
//! lamp `i`, which fills the share `ω_i` of all directions (`A_i/W` of a lamp in the scene) with the radiance `L_i`, blurred
//! over the share `λ` of them that the lobe is wide: as a lamp of share `ω_i + λ` and the same flux. The mean
//! radiance of the scene is about `Σ ω_i·L_i`. The relative variance of what one path brings is therefore about
//!
//! ```text
//! V = Σ_c (C/W)·R²·Σ_i ω_i²·⟨L_i²⟩/(ω_i + λ) / (Σ_i ω_i·L_i)²,      λ = 4·α²
//! ```
//!
//! (a coat on a diffuse base is met by the chance `R`, and brings all of the lamp then: of its `R²` the part `ω_i/(ω_i + λ)`,
//! where the path itself meets the lamp, is `R`)
//! and for a mirror and a single lamp `C/A`: the size of the scene does not matter. That of all else is about 1, since
//! lights are drawn and not met by chance. Lamps which are small but contribute little do not weigh much, nor do mirrors
//! that are small. Where a texture shines, `⟨L²⟩` is the mean square of its means over parts as large as the lobe,
//! [`Moments`]: a sun in an environment map weighs as a sun. A lobe of GGX width α around the mirrored direction is as high
//! as an even one of `4π·α²` steradians, of which the cosine-weighted hemisphere holds π (Walter et al. 2007, "Microfacet
//! Models for Refraction through Rough Surfaces", EGSR, section 3.2: the density of normals is at most `1/(π·α²)`, and
//! that of reflected directions a quarter). Points of light and mirrors have no extent, and V no end.
//!
//! The estimate is coarse, and it is meant for the choice between ways of which either is right. All areas are those of
//! axis-parallel boxes, so that flat things count twice, on both sides of the fraction.

use super::{Emissions, Instances, PunctualLight, Surfaces};
use crate::color::luminance;
use crate::description::{EmissionStrength, Light, Rgb, Value};
use crate::math::Aabb;
use crate::shade::{CausticLobe, MaterialTable, Moments, TexturePoint};
use glam::Vec2;
use std::collections::HashMap;
use std::f64::consts::PI;

/// What was found out about materials and textures, until these change.
#[derive(Debug, Default)]
pub struct CausticFacts {
    /// By material; `None` of one that is not in use.
    lobes: Vec<Option<Vec<CausticLobe>>>,
    /// By texture, and whether it is seen all around.
    moments: HashMap<(u32, bool), Moments>,
}

/// The relative variance of caustics on one path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct CausticNoise {
    /// Over lobes behind which photons of caustics are kept.
    pub for_photons: f64,
    /// Over all others.
    pub others: f64,
}

/// A lamp as what casts caustics sees it.
struct Lamp {
    /// Share of all directions; 0 of a point.
    share: f64,
    /// Mean radiance times that share.
    strength: f64,
    /// Its texture.
    texture: Option<(u32, bool)>,
}

impl CausticFacts {
    /// Forgets all, for materials or textures have changed.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether anything casts caustics so sharply, and so strongly, that those of points are worth having and paths cannot
    /// find them.
    pub(super) fn has_mirrors(
        &mut self,
        instances: &Instances,
        materials: &MaterialTable,
        min_alpha: f32,
    ) -> bool {
        self.look_at(instances, materials, min_alpha);
        let is_mirror = |lobe: &CausticLobe| lobe.alpha == 0.0 && lobe.is_strong();
        instances.list.iter().any(|i| self.lobes(i.material).iter().any(is_mirror))
    }

    /// The relative variance of caustics on one path; 0 where nothing shines.
    pub(super) fn noise(
        &mut self,
        instances: &Instances,
        lights: &[PunctualLight],
        emissions: &Emissions,
        surfaces: &Surfaces,
        min_alpha: f32,
    ) -> CausticNoise {
        self.look_at(instances, &surfaces.materials, min_alpha);
        if instances.list.iter().all(|i| self.lobes(i.material).is_empty()) {
            return CausticNoise::default();
        }
        let finite = |area: f64| area.is_finite().then_some(area);
        let area_of = |bounds: Aabb| f64::from(bounds.area());
        let ended = instances.list.iter().filter(|i| area_of(i.bounds).is_finite());
        let whole = area_of(ended.map(|i| i.bounds).fold(Aabb::EMPTY, Aabb::union));
        let mut weights: HashMap<Key, Weights> = HashMap::new();
        for instance in &instances.list {
            // What has no end is met as often as anything.
            let met = finite(area_of(instance.bounds)).map_or(1.0, |area| (area / whole).min(1.0));
            for lobe in self.lobes(instance.material) {
                let Weights { met: by_path, drawn } = weights.entry(Key::new(lobe)).or_default();
                let area = met * lobe.area;
                *by_path += area * lobe.share.powi(if lobe.is_coat { 1 } else { 2 });
                *drawn += area * lobe.share.powi(2);
            }
        }
        let mut lamps: Vec<Lamp> = Vec::new();
        for instance in &instances.list {
            let area = area_of(instance.bounds);
            if let Some(emission) = emissions.list.get(instance.emission as usize)
                && area.is_finite()
                && area > 0.0
            {
                let factor = f64::from(emission.factor);
                lamps.push(self.surface(&emission.strength, area, whole, factor, surfaces));
            }
        }
        lamps.extend(lights.iter().map(|light| self.light(&light.light, whole, surfaces)));
        let light: f64 = lamps.iter().map(|lamp| lamp.strength).sum();
        // In an order of their own, so that sums are the same however the table was filled.
        let mut weights: Vec<(Key, Weights)> = weights.into_iter().collect();
        weights.sort_by_key(|(key, _)| *key);
        let mut noise = CausticNoise::default();
        for (key, weights) in weights {
            let sum: f64 = lamps.iter().map(|lamp| self.square(lamp, key, weights)).sum();
            let variance = sum / (light * light);
            let variance = if variance.is_nan() { 0.0 } else { variance };
            if key.for_photons {
                noise.for_photons += variance;
            } else {
                noise.others += variance;
            }
        }
        noise
    }

    /// Sees to it that the lobes of all materials in use are known.
    fn look_at(&mut self, instances: &Instances, materials: &MaterialTable, min_alpha: f32) {
        self.lobes.resize(materials.len(), None);
        for instance in &instances.list {
            let material = instance.material;
            if let Some(lobes @ None) = self.lobes.get_mut(material as usize) {
                *lobes = Some(if materials.is_invisible(material, None) {
                    Vec::new()
                } else {
                    materials.caustic_lobes(material, min_alpha)
                });
            }
        }
    }

    fn lobes(&self, material: u32) -> &[CausticLobe] {
        self.lobes.get(material as usize).and_then(Option::as_deref).unwrap_or_default()
    }

    /// `ω²·⟨L²⟩/(ω + λ)` of a lamp, times the weights of the lobes that see it.
    fn square(&self, lamp: &Lamp, key: Key, weights: Weights) -> f64 {
        let wide = (4.0 * key.alpha().powi(2)).min(1.0);
        let seen = lamp.share + wide;
        if seen == 0.0 && !key.is_strong {
            return 0.0;
        }
        let met = if seen > 0.0 { lamp.share / seen } else { 1.0 };
        let part = if lamp.share > 0.0 { (wide / lamp.share).min(1.0) } else { 1.0 };
        let moments = lamp.texture.and_then(|texture| self.moments.get(&texture));
        let variation = moments.map_or(1.0, |moments| moments.variation(part));
        let weight = weights.met * met + weights.drawn * (1.0 - met);
        weight * lamp.strength * lamp.strength * variation / seen.min(1.0)
    }

    /// A surface which shines.
    fn surface(
        &mut self,
        strength: &EmissionStrength<u32>,
        area: f64,
        whole: f64,
        factor: f64,
        surfaces: &Surfaces,
    ) -> Lamp {
        let share = (area / whole).min(1.0);
        let (mean, texture) = match strength {
            EmissionStrength::Radiance(value) => self.mean(value, false, &surfaces.materials),
            EmissionStrength::Power(power) => (f64::from(luminance(*power)) / (PI * area), None),
            EmissionStrength::Temperature { radiance, .. } => (f64::from(*radiance), None),
        };
        Lamp { share, strength: share * mean * factor, texture }
    }

    /// A light without a shape. One that stands somewhere lights the whole scene with its flux.
    fn light(&mut self, light: &Light<u32>, whole: f64, surfaces: &Surfaces) -> Lamp {
        let point = |intensity: f64, directions: f64| {
            let strength = if whole > 0.0 { intensity * directions / (PI * whole) } else { 0.0 };
            Lamp { share: 0.0, strength, texture: None }
        };
        match light {
            Light::Point { intensity, power } => {
                let intensity = intensity.map(|rgb| f64::from(luminance(rgb)));
                let power = power.map(|rgb| f64::from(luminance(rgb)) / (4.0 * PI));
                point(intensity.or(power).unwrap_or(0.0), 4.0 * PI)
            }
            Light::Spot { intensity, angle, .. } => {
                let cone = 2.0 * PI * (1.0 - f64::from(*angle).to_radians().cos());
                point(f64::from(luminance(*intensity)), cone)
            }
            Light::Directional { irradiance, angle } => {
                // Share of the hemisphere, by the cosine.
                let share = (0.5 * f64::from(*angle).to_radians()).sin().powi(2);
                let strength = f64::from(luminance(*irradiance)) / PI;
                Lamp { share, strength, texture: None }
            }
            Light::Sky { radiance, scale } => {
                let (mean, texture) = self.mean(radiance, true, &surfaces.materials);
                Lamp { share: 1.0, strength: mean * f64::from(*scale), texture }
            }
        }
    }

    /// Mean luminance of a colour, and its texture if it has one; all around, or over a surface.
    fn mean(
        &mut self,
        value: &Value<Rgb, u32>,
        all_around: bool,
        materials: &MaterialTable,
    ) -> (f64, Option<(u32, bool)>) {
        let texture = match value {
            Value::Constant(color) => return (f64::from(luminance(*color)), None),
            Value::Texture(texture) => (*texture, all_around),
        };
        let moments = self
            .moments
            .entry(texture)
            .or_insert_with(|| moments_of(texture.0, all_around, materials));
        (moments.mean(), Some(texture))
    }
}

/// The moments of a texture which shines; those of a solid one are of a slice through it.
fn moments_of(texture: u32, all_around: bool, materials: &MaterialTable) -> Moments {
    let textures = materials.textures();
    let (width, height) = textures.resolution(texture);
    let value = |x: usize, y: usize| {
        let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        let at = TexturePoint { p: uv.extend(0.0).as_dvec3(), ..TexturePoint::at(uv) };
        f64::from(luminance(textures.color(texture, &at))).max(0.0)
    };
    let weight = |y: usize| {
        if all_around { (PI * (y as f64 + 0.5) / f64::from(height)).sin() } else { 1.0 }
    };
    Moments::new((width as usize, height as usize), value, weight)
}

/// Chance to meet lobes times what they then bring, squared: of a lamp that the path meets by itself, and of one that is
/// drawn.
#[derive(Clone, Copy, Debug, Default)]
struct Weights {
    met: f64,
    drawn: f64,
}

/// Lobes which count alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Key {
    for_photons: bool,
    is_strong: bool,
    /// The bits of α.
    alpha: u64,
}

impl Key {
    fn new(lobe: &CausticLobe) -> Self {
        Self {
            for_photons: lobe.for_photons,
            is_strong: lobe.is_strong(),
            alpha: lobe.alpha.to_bits(),
        }
    }

    fn alpha(self) -> f64 {
        f64::from_bits(self.alpha)
    }
}
