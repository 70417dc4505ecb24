//! Cameras, as a scene file says them.

use serde::de::{self, Deserialize, Deserializer, Visitor};
use std::fmt;

/// A camera at its local origin which looks along its local −z with +y up. `R` refers to an entity.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[serde(bound(deserialize = "Focus<R>: Deserialize<'de>"))]
pub struct Camera<R> {
    /// Vertical field of view in degrees, in `(0, 180)`. Not used by an orthographic camera.
    #[serde(default = "default_fov")]
    pub fov: f64,
    /// Horizontal field of view in degrees, in `(0, 180)`. Excludes `fov`.
    #[serde(default)]
    pub fov_x: Option<f64>,
    /// Height of the visible field in metres; makes the camera orthographic.
    #[serde(default)]
    pub orthographic: Option<f64>,
    /// Radius of the lens in metres; 0 is a pinhole. Excludes `f_number`.
    #[serde(default)]
    pub aperture: f64,
    /// Aperture as an f-number on a sensor 24 mm high. Excludes `aperture`.
    #[serde(default)]
    pub f_number: Option<f64>,
    /// What is sharp: the plane at this distance along the axis, or through this entity's origin.
    #[serde(default)]
    pub focus: Option<Focus<R>>,
    /// Blades of the diaphragm: 0 is a round aperture, otherwise a regular polygon of 3 or more.
    #[serde(default)]
    pub blades: u32,
    /// Turns the polygon, degrees.
    #[serde(default)]
    pub blade_rotation: f64,
}

/// The height of the sensor to which [`Camera::f_number`] refers, in metres (36 mm × 24 mm film).
pub const SENSOR_HEIGHT: f64 = 0.024;

/// What a lens is focused on. In a scene file: a number, or the name of an entity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Focus<R> {
    /// Axial distance in metres.
    Distance(f64),
    /// The origin of this entity, wherever it moves.
    Entity(R),
}

impl<'de> Deserialize<'de> for Focus<String> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct FocusVisitor;
        impl Visitor<'_> for FocusVisitor {
            type Value = Focus<String>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a distance in metres or the name of an entity")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Self::Value, E> {
                Ok(Focus::Distance(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Self::Value, E> {
                Ok(Focus::Distance(v as f64))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Self::Value, E> {
                Ok(Focus::Distance(v as f64))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Self::Value, E> {
                Ok(Focus::Entity(v.to_owned()))
            }
        }
        deserializer.deserialize_any(FocusVisitor)
    }
}

impl<R> Default for Camera<R> {
    fn default() -> Self {
        Self {
            fov: default_fov(),
            fov_x: None,
            orthographic: None,
            aperture: 0.0,
            f_number: None,
            focus: None,
            blades: 0,
            blade_rotation: 0.0,
        }
    }
}

impl<R> Camera<R> {
    /// The vertical field of view in degrees in a picture of this width and height.
    pub fn vertical_fov(&self, (width, height): (u32, u32)) -> f64 {
        let Some(fov_x) = self.fov_x else { return self.fov };
        let tan = (0.5 * fov_x.to_radians()).tan() * f64::from(height) / f64::from(width);
        2.0 * tan.atan().to_degrees()
    }

    /// Radius of the lens in metres for the vertical field of view `fov_deg`.
    ///
    /// With an f-number `N` the focal length is `f = h / (2 tan(fov/2))`, `h` the height of the
    /// sensor, and the radius `f / (2 N)`.
    pub fn lens_radius(&self, fov_deg: f64) -> f64 {
        match self.f_number {
            Some(n) => SENSOR_HEIGHT / (2.0 * (fov_deg.to_radians() * 0.5).tan()) / (2.0 * n),
            None => self.aperture,
        }
    }

    /// The same camera with its reference replaced.
    ///
    /// # Errors
    /// Whatever `f` returns.
    pub fn map_ref<S, E>(self, f: impl FnOnce(R) -> Result<S, E>) -> Result<Camera<S>, E> {
        let focus = match self.focus {
            None => None,
            Some(Focus::Distance(metres)) => Some(Focus::Distance(metres)),
            Some(Focus::Entity(reference)) => Some(Focus::Entity(f(reference)?)),
        };
        Ok(Camera {
            fov: self.fov,
            fov_x: self.fov_x,
            orthographic: self.orthographic,
            aperture: self.aperture,
            f_number: self.f_number,
            focus,
            blades: self.blades,
            blade_rotation: self.blade_rotation,
        })
    }
}

fn default_fov() -> f64 {
    40.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: a square picture has one field of view, and 90° across 2:1 are 2·atan(½) up.
    #[test]
    fn a_horizontal_field_of_view_follows_the_picture() {
        let camera = Camera::<()> { fov_x: Some(90.0), ..Camera::default() };
        assert!((camera.vertical_fov((100, 100)) - 90.0).abs() < 1e-12);
        assert!((camera.vertical_fov((200, 100)) - 53.130_102_354_155_98).abs() < 1e-12);
        assert!((camera.vertical_fov((100, 200)) - 126.869_897_645_844_02).abs() < 1e-12);
        assert!((Camera::<()>::default().vertical_fov((7, 3)) - 40.0).abs() < f64::EPSILON);
    }
}
