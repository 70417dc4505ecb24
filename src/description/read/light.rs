//! What emits light: its numbers, and the names it uses.

use super::Names;
use super::decode::{Report, decode};
use super::limits;
use super::source::Cursor;
use super::surface::Parameters;
use crate::description::{Emission, EmissionStrength, Light, Rgb, Value};
use serde::Deserialize;

/// The strength of an emitting shape as a scene file says it.
#[derive(Debug, Deserialize)]
#[serde(rename = "emission", deny_unknown_fields)]
enum EmissionFile {
    Radiance(Value<Rgb, String>),
    Power(#[serde(deserialize_with = "crate::description::value::color")] Rgb),
    /// The colour of a blackbody, and its luminance in units of radiance.
    Temperature {
        kelvin: f32,
        radiance: f32,
    },
}

/// Reads the strength of an emitting shape and checks it.
pub(super) fn read_emission(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Emission<String>> {
    let place = cursor.nth(0);
    let strength = match decode(cursor, report)? {
        EmissionFile::Radiance(radiance) => EmissionStrength::Radiance(radiance),
        EmissionFile::Power(power) => EmissionStrength::Power(power),
        EmissionFile::Temperature { kelvin, radiance } => {
            limits::number(report, &cursor.at("kelvin"), kelvin, &limits::TEMPERATURE);
            limits::number(report, &cursor.at("radiance"), radiance, &limits::STRENGTH);
            EmissionStrength::Temperature { kelvin, radiance }
        }
    };
    match &strength {
        EmissionStrength::Power(power) => {
            limits::color(report, &place, *power, &limits::STRENGTH);
        }
        EmissionStrength::Radiance(Value::Constant(radiance)) => {
            limits::color(report, &place, *radiance, &limits::STRENGTH);
        }
        EmissionStrength::Radiance(Value::Texture(name)) => {
            Parameters { cursor, names, report }.texture(&place, name);
        }
        EmissionStrength::Temperature { .. } => {}
    }
    Some(Emission { strength, two_sided: false })
}

/// Reads a light without a shape and checks it.
pub(super) fn read_light(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Light<String>> {
    let light: Light<String> = decode(cursor, report)?;
    let mut check = Parameters { cursor, names, report };
    match &light {
        Light::Point { intensity, power } => {
            for (field, strength) in [("intensity", intensity), ("power", power)] {
                if let Some(strength) = strength {
                    check.rgb(field, *strength, &limits::STRENGTH);
                }
            }
            if intensity.is_some() == power.is_some() {
                let message = "a `Point` needs exactly one of `intensity` and `power`";
                check.report.at("scene::conflict", cursor, message);
            }
        }
        Light::Spot { intensity, angle, blend } => {
            check.rgb("intensity", *intensity, &limits::STRENGTH);
            check.number("angle", *angle, &limits::CONE);
            check.number("blend", *blend, &limits::SHARE);
        }
        Light::Directional { irradiance, angle } => {
            check.rgb("irradiance", *irradiance, &limits::STRENGTH);
            check.number("angle", *angle, &limits::DIAMETER);
        }
        Light::Sky { radiance, scale } => {
            check.color("radiance", radiance, &limits::STRENGTH);
            check.number("scale", *scale, &limits::STRENGTH);
        }
    }
    Some(light)
}
