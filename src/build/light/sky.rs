//! Light from all around.
//!
//! An environment map in latitude–longitude form is a piecewise-constant density over its pixels,
//! proportional to radiance times the sine of the polar angle, which is what the map's rows stretch
//! over (Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., section 12.5).

use crate::description::{Rgb, Value};
use crate::math::{Chart, Frame};
use crate::sampling::Piecewise2D;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere};
use crate::shade::{MaterialTable, TexturePoint};
use glam::{DAffine3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

/// Sky light ready to be sampled.
#[derive(Clone, Debug)]
pub struct SkyLight {
    radiance: Value<Rgb, u32>,
    scale: f32,
    /// Density over the unit square of uv; `None` for a constant sky.
    map: Option<Arc<Piecewise2D>>,
    /// Mean luminance of the radiance over the sphere, before the scale.
    mean: f64,
}

impl SkyLight {
    /// Prepares a sky.
    pub fn new(radiance: Value<Rgb, u32>, scale: f32, materials: &MaterialTable) -> Self {
        let texture = match &radiance {
            Value::Constant(_) => None,
            Value::Texture(texture) => Some(*texture),
        };
        let map = texture.map(|texture| {
            let (width, height) = materials.textures().resolution(texture);
            let (width, height) = (width as usize, height as usize);
            Arc::new(Piecewise2D::new(width, height, |x, y| {
                // A bilinear lookup shows a texel's neighbours too: the greatest of the corners and
                // the middle keeps the density above 0 wherever the radiance is.
                let brightest = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
                    .into_iter()
                    .map(|(dx, dy)| {
                        let u = (x as f32 + dx) / width as f32;
                        let v = (y as f32 + dy) / height as f32;
                        let uv = Vec2::new(u, v);
                        let color = materials.color(&radiance, &seen(uv_to_direction(uv), uv));
                        f64::from(crate::color::luminance(color))
                    })
                    .fold(0.0, f64::max);
                // Row y spans v from y/height, v = 0 at the south pole.
                let polar = std::f64::consts::PI * (y as f64 + 0.5) / height as f64;
                brightest * polar.sin()
            }))
        });
        let mean = match (&radiance, &map) {
            // The mean of L·sin θ over the square is that of L over the sphere times 2/π.
            (_, Some(map)) => map.mean() * std::f64::consts::FRAC_PI_2,
            (Value::Constant(rgb), None) => f64::from(crate::color::luminance(*rgb)),
            (Value::Texture(_), None) => 0.0,
        };
        Self { radiance, scale, map, mean }
    }

    /// The same sky at another scale, when it shows this radiance: the map over its pixels is shared.
    /// The textures must be those that it was made with.
    pub fn rescaled(&self, radiance: &Value<Rgb, u32>, scale: f32) -> Option<Self> {
        (self.radiance == *radiance).then(|| Self { scale, ..self.clone() })
    }

    /// Mean luminance over the sphere, W·m⁻²·sr⁻¹.
    pub fn mean_radiance(&self) -> f64 {
        self.mean * f64::from(self.scale)
    }

    /// Radiance from a unit direction in the light's own space.
    fn radiance_local(&self, direction: Vec3, materials: &MaterialTable) -> Rgb {
        materials.color(&self.radiance, &seen(direction, direction_to_uv(direction))) * self.scale
    }

    /// Radiance from the unit direction `wi` of render space.
    pub fn radiance(
        &self,
        wi: Vec3,
        render_from_light: &DAffine3,
        materials: &MaterialTable,
    ) -> Rgb {
        match self.radiance {
            // The same everywhere: where it comes from is not asked.
            Value::Constant(radiance) => materials.seen(radiance) * self.scale,
            Value::Texture(_) => self.radiance_local(to_light(render_from_light, wi), materials),
        }
    }

    /// Draws a direction towards the sky and its density per unit solid angle. `normal` is where the
    /// receiving surface faces: a constant sky is drawn by the cosine around it, and evenly where that is zero.
    pub fn sample(
        &self,
        normal: Vec3,
        u: Vec2,
        render_from_light: &DAffine3,
    ) -> Option<(Vec3, f32)> {
        match &self.map {
            None if normal == Vec3::ZERO => Some((uniform_sphere(u), 0.5 / TAU)),
            None => {
                let local = cosine_hemisphere(u);
                Some((Frame::from_z(normal).from_local(local), cosine_hemisphere_pdf(local.z)))
            }
            Some(map) => {
                let (uv, pdf_square) = map.sample(u);
                let direction = uv_to_direction(uv);
                let pdf = pdf_square * jacobian(uv.y)?;
                Some((from_light(render_from_light, direction), pdf))
            }
        }
    }

    /// Draws a direction towards the sky for no receiver in particular, and its density per unit
    /// solid angle: evenly over the sphere for a constant sky, by the map otherwise.
    pub fn sample_all_around(&self, u: Vec2, render_from_light: &DAffine3) -> Option<(Vec3, f32)> {
        self.sample(Vec3::ZERO, u, render_from_light)
    }

    /// The density with which [`SkyLight::sample`] draws `wi`, per unit solid angle.
    pub fn pdf(&self, normal: Vec3, wi: Vec3, render_from_light: &DAffine3) -> f32 {
        match &self.map {
            None if normal == Vec3::ZERO => 0.5 / TAU,
            None => cosine_hemisphere_pdf(wi.dot(normal)),
            Some(map) => {
                let uv = direction_to_uv(to_light(render_from_light, wi));
                jacobian(uv.y).map_or(0.0, |j| map.pdf(uv) * j)
            }
        }
    }
}

/// Unit square to solid angle: `1/(2π²·sin θ)`; `None` at the poles.
fn jacobian(v: f32) -> Option<f32> {
    let sin = (PI * v).sin();
    (sin > 0.0).then(|| 1.0 / (TAU * PI * sin))
}

/// What a sky texture looks at: solid ones the unit sphere around the viewer; images close around it, and end above
/// and below.
fn seen(direction: Vec3, uv: Vec2) -> TexturePoint {
    let at = TexturePoint::on(Chart::AROUND, uv);
    TexturePoint { p: direction.as_dvec3(), n: -direction, ..at }
}

/// The light's space turned into render space: rotation only, directions stay unit.
fn from_light(render_from_light: &DAffine3, direction: Vec3) -> Vec3 {
    render_from_light.transform_vector3(direction.as_dvec3()).normalize().as_vec3()
}

fn to_light(render_from_light: &DAffine3, direction: Vec3) -> Vec3 {
    (render_from_light.matrix3.inverse() * direction.as_dvec3()).normalize().as_vec3()
}

/// u = ½ at −z, growing to the right of a viewer inside; v = 1 at +y.
fn direction_to_uv(d: Vec3) -> Vec2 {
    let u = 0.5 + d.x.atan2(-d.z) / TAU;
    let v = 0.5 + d.y.clamp(-1.0, 1.0).asin() * FRAC_1_PI;
    Vec2::new(u.min(1.0_f32.next_down()), v.min(1.0_f32.next_down()))
}

fn uv_to_direction(uv: Vec2) -> Vec3 {
    let (sin_phi, cos_phi) = ((uv.x - 0.5) * TAU).sin_cos();
    let (sin_v, cos_v) = ((uv.y - 0.5) * PI).sin_cos();
    Vec3::new(sin_phi * cos_v, sin_v, -cos_phi * cos_v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_uv_are_inverse() {
        for k in 0..200 {
            let a = k as f32;
            let d = Vec3::new(a.sin(), (1.3 * a).cos() * 0.9, (0.7 * a).cos()).normalize();
            assert!((uv_to_direction(direction_to_uv(d)) - d).length() < 2e-6, "{d}");
        }
        // −z is the middle, to the right of it comes +x, up is up
        assert!((direction_to_uv(Vec3::NEG_Z) - 0.5).length() < 1e-6);
        assert!(direction_to_uv(Vec3::X).x > 0.7 && direction_to_uv(Vec3::Y).y > 0.99);
    }
}
