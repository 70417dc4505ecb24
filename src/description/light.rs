//! What emits light, as a scene file says it.

use super::{Rgb, Value};
use serde::Deserialize;

/// Emission of a shape. In a scene file `emission:` holds the strength and `two_sided:` the sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission<R> {
    /// How much.
    pub strength: EmissionStrength<R>,
    /// Whether the back of the surface emits as well.
    pub two_sided: bool,
}

/// The strength of an emitting shape.
#[derive(Clone, Debug, PartialEq)]
pub enum EmissionStrength<R> {
    /// Radiance leaving every point, W·m⁻²·sr⁻¹ per channel.
    Radiance(Value<Rgb, R>),
    /// Flux of the whole shape in watts per channel, spread evenly over its area.
    Power(Rgb),
    /// Radiance of a blackbody, as white as that of 6504 K.
    Temperature {
        /// Kelvin.
        kelvin: f32,
        /// Luminance in units of radiance, W·m⁻²·sr⁻¹.
        radiance: f32,
    },
}

/// A light without a shape. It shines along its local −z and stands at its local origin.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[serde(bound(deserialize = "Value<Rgb, R>: Deserialize<'de>"))]
pub enum Light<R> {
    /// A point which shines evenly in all directions. Exactly one of the two strengths.
    Point {
        /// Intensity in W·sr⁻¹ per channel.
        #[serde(default, deserialize_with = "super::value::some_color")]
        intensity: Option<Rgb>,
        /// Flux in watts per channel: `4π` times the intensity.
        #[serde(default, deserialize_with = "super::value::some_color")]
        power: Option<Rgb>,
    },
    /// A point which shines into a cone.
    Spot {
        /// Intensity on the axis in W·sr⁻¹ per channel.
        #[serde(deserialize_with = "super::value::color")]
        intensity: Rgb,
        /// Half angle of the cone in degrees; no light outside.
        #[serde(default = "spot_angle")]
        angle: f32,
        /// Share of the half angle over which the light falls off smoothly to the rim, in `[0, 1]`.
        #[serde(default = "spot_blend")]
        blend: f32,
    },
    /// Parallel light from infinitely far away, such as the sun.
    Directional {
        /// Irradiance of a plane which faces it, W·m⁻² per channel.
        #[serde(deserialize_with = "super::value::color")]
        irradiance: Rgb,
        /// Angular **diameter** in degrees; 0 is perfectly parallel. The sun has 0.53.
        #[serde(default)]
        angle: f32,
    },
    /// Light from all around: a constant radiance, or an environment map in latitude–longitude form.
    ///
    /// The middle of the map lies at the entity's −z, its top at +y, u grows to the right as seen
    /// from inside.
    Sky {
        /// Radiance, W·m⁻²·sr⁻¹ per channel.
        radiance: Value<Rgb, R>,
        /// Multiplies the radiance.
        #[serde(default = "unit")]
        scale: f32,
    },
}

impl<R> Emission<R> {
    /// The same emission with its reference replaced.
    ///
    /// # Errors
    /// Whatever `f` returns.
    pub fn map_ref<S, E>(self, f: &mut impl FnMut(R) -> Result<S, E>) -> Result<Emission<S>, E> {
        let strength = match self.strength {
            EmissionStrength::Radiance(value) => EmissionStrength::Radiance(value.map_ref(f)?),
            EmissionStrength::Power(watts) => EmissionStrength::Power(watts),
            EmissionStrength::Temperature { kelvin, radiance } => {
                EmissionStrength::Temperature { kelvin, radiance }
            }
        };
        Ok(Emission { strength, two_sided: self.two_sided })
    }
}

impl<R> Light<R> {
    /// The same light with its reference replaced.
    ///
    /// # Errors
    /// Whatever `f` returns.
    pub fn map_ref<S, E>(self, f: &mut impl FnMut(R) -> Result<S, E>) -> Result<Light<S>, E> {
        Ok(match self {
            Self::Point { intensity, power } => Light::Point { intensity, power },
            Self::Spot { intensity, angle, blend } => Light::Spot { intensity, angle, blend },
            Self::Directional { irradiance, angle } => Light::Directional { irradiance, angle },
            Self::Sky { radiance, scale } => Light::Sky { radiance: radiance.map_ref(f)?, scale },
        })
    }
}

fn spot_angle() -> f32 {
    30.0
}
fn spot_blend() -> f32 {
    0.15
}
fn unit() -> f32 {
    1.0
}
