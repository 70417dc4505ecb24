//! How noisy caustics would be if paths from the camera had to find them by chance.
//!
//! A path which has left a diffuse surface meets something specular with about the probability `P = C/W`, where `C` is the
//! area of all that casts caustics and `W` that of the whole scene, and from there lamp `i` with about `A_i/W`. If it
//! does, it sees the lamp's radiance `L_i`, and the radiance of the scene is in the mean about `Σ A_i·L_i/W`. The
//! relative variance of what one path brings is therefore about
//!
//! ```text
//! P·Σ (A_i/W)·L_i² / (Σ (A_i/W)·L_i)²  =  C·Σ A_i·L_i² / (Σ A_i·L_i)²
//! ```
//!
//! and `C/A` for a single lamp: the size of the scene does not matter. That of all else is about 1, since lights are
//! drawn and not met by chance. Lamps which are small but contribute little do not weigh much, nor do mirrors that are
//! small. The estimate is coarse, and it is meant for the choice between ways of which either is right.
//!
//! All areas are those of axis-parallel boxes, so that flat things count twice, on both sides of the fraction.

use super::{Emissions, Instances, NOTHING, PunctualLight, Surfaces};
use crate::color::luminance;
use crate::description::{EmissionStrength, Light, Rgb, Value};
use crate::math::Aabb;
use crate::shade::MaterialTable;
use std::f64::consts::PI;

/// `Σ A·L` and `Σ A·L²` over the lamps.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    first: f64,
    second: f64,
}

impl Sums {
    fn add(&mut self, area: f64, radiance: f64) {
        self.first += area * radiance;
        self.second += area * radiance * radiance;
    }
}

/// Luminance of each texture in the mean, where it was asked for.
#[derive(Debug, Default)]
pub struct TextureMeans(Vec<Option<f64>>);

impl TextureMeans {
    /// Forgets them, for textures have changed.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Luminance of a colour, of a texture in the mean.
    fn of(&mut self, value: &Value<Rgb, u32>, materials: &MaterialTable) -> f64 {
        match value {
            Value::Constant(color) => f64::from(luminance(*color)),
            Value::Texture(index) => {
                let textures = materials.textures();
                self.0.resize(textures.len(), None);
                let Some(known) = self.0.get_mut(*index as usize) else { return 0.0 };
                *known.get_or_insert_with(|| f64::from(luminance(textures.average(*index))))
            }
        }
    }
}

/// The relative variance of caustics on one path, points of light left out; 0 where nothing shines.
///
/// `casts` says of a material whether it casts caustics.
pub(super) fn caustic_noise(
    instances: &Instances,
    lights: &[PunctualLight],
    emissions: &Emissions,
    surfaces: &Surfaces,
    means: &mut TextureMeans,
    casts: impl Fn(u32) -> bool,
) -> f64 {
    let (mut whole, mut casters, mut lamps) = (Aabb::EMPTY, 0.0, Sums::default());
    for instance in &instances.list {
        let area = f64::from(instance.bounds.area());
        if area.is_finite() {
            whole = whole.union(instance.bounds);
        }
        if instance.material != NOTHING && casts(instance.material) {
            casters += area;
        }
        if let Some(emission) = emissions.list.get(instance.emission as usize) {
            let strength = match &emission.strength {
                EmissionStrength::Radiance(value) => means.of(value, &surfaces.materials),
                EmissionStrength::Power(power) => f64::from(luminance(*power)) / (PI * area),
                EmissionStrength::Temperature { radiance, .. } => f64::from(*radiance),
            };
            if area.is_finite() && area > 0.0 {
                lamps.add(area, strength * f64::from(emission.factor));
            }
        }
    }
    let whole = f64::from(whole.area());
    for light in lights {
        match &light.light {
            Light::Directional { irradiance, angle } if *angle > 0.0 => {
                // Share of the hemisphere, by the cosine.
                let share = (0.5 * f64::from(*angle).to_radians()).sin().powi(2);
                lamps.add(share * whole, f64::from(luminance(*irradiance)) / (PI * share));
            }
            Light::Sky { radiance, scale } => {
                lamps.add(whole, means.of(radiance, &surfaces.materials) * f64::from(*scale));
            }
            Light::Directional { .. } | Light::Point { .. } | Light::Spot { .. } => {}
        }
    }
    let noise = casters * lamps.second / (lamps.first * lamps.first);
    if noise.is_nan() { 0.0 } else { noise }
}
