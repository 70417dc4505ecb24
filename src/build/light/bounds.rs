//! Where a light is, how much it gives off and where it shines: one light, or several together.
//!
//! The cone of normals: Conty Estevez and Kulla 2018,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting", Proc. ACM Comput. Graph. Interact.
//! Tech. 1(2), section 4.1.

use crate::math::Aabb;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Directions within `theta_o` of an axis, in which a light's surfaces face, and how far to the side
/// of these it still shines, `theta_e`. Radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit axis.
    pub axis: DVec3,
    /// Half angle of the cone of normals, in `[0, π]`.
    pub theta_o: f64,
    /// Angle beyond it, in `[0, π/2]`.
    pub theta_e: f64,
}

impl Cone {
    /// A flat surface which faces along `axis`.
    pub fn facing(axis: DVec3) -> Self {
        Self { axis, theta_o: 0.0, theta_e: FRAC_PI_2 }
    }

    /// Light in all directions.
    pub fn everywhere() -> Self {
        Self { axis: DVec3::Z, theta_o: PI, theta_e: FRAC_PI_2 }
    }

    /// A cone around those of several lights.
    ///
    /// The axis is the mean of theirs, each weighted by the flux that comes with it.
    pub fn around(cones: impl Iterator<Item = (Self, f64)> + Clone) -> Self {
        let theta_e = cones.clone().fold(0.0, |widest: f64, (cone, _)| widest.max(cone.theta_e));
        let sum = cones.clone().map(|(cone, flux)| cone.axis * flux).sum::<DVec3>();
        let wide = Self { theta_e, ..Self::everywhere() };
        let Some(axis) = sum.try_normalize() else { return wide };
        let (mut theta_o, mut least_cos) = (0.0_f64, 1.0_f64);
        for (cone, _) in cones {
            let cos = axis.dot(cone.axis);
            if cone.theta_o == 0.0 {
                least_cos = least_cos.min(cos);
            } else {
                theta_o = theta_o.max(cos.clamp(-1.0, 1.0).acos() + cone.theta_o);
            }
        }
        let theta_o = theta_o.max(least_cos.clamp(-1.0, 1.0).acos());
        if theta_o < PI { Self { axis, theta_o, theta_e } } else { wide }
    }
}

/// One light, or several together, as a node sees them.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Around the light during the whole shutter.
    pub bounds: Aabb,
    /// Watts, of any channel or mean of channels.
    pub flux: f64,
    /// Where it shines.
    pub cone: Cone,
    /// Whether it shines backwards as well.
    pub two_sided: bool,
}

impl LightBounds {
    /// Several together; there is at least one.
    pub fn around<'a>(lights: impl Iterator<Item = &'a Self> + Clone) -> Self {
        Self {
            bounds: lights.clone().fold(Aabb::EMPTY, |all, light| all.union(light.bounds)),
            flux: lights.clone().map(|light| light.flux).sum(),
            cone: Cone::around(lights.clone().map(|light| (light.cone, light.flux))),
            two_sided: lights.clone().any(|light| light.two_sided),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use glam::DQuat;
    use std::f64::consts::TAU;

    /// The cone of several cones holds each: checked by directions on the rims.
    #[test]
    fn cones_around_cones_hold_them_all() {
        for k in 0..500 {
            let s = Sampler::new(12, 0, (k, 0), 0);
            let cone = |d: u32| Cone {
                axis: crate::sampling::warp::uniform_sphere(s.two(d)).as_dvec3().normalize(),
                theta_o: if k % 3 == 0 { 0.0 } else { f64::from(s.one(d + 2)) * 1.7 },
                theta_e: f64::from(s.one(d + 3)),
            };
            let cones = [(cone(0), 1.0), (cone(4), 2.0), (cone(8), 0.3)];
            let all = Cone::around(cones.into_iter());
            for (cone, _) in cones {
                assert!(all.theta_e >= cone.theta_e);
                for j in 0..32 {
                    let across = cone.axis.any_orthonormal_vector();
                    let turn = DQuat::from_axis_angle(cone.axis, f64::from(j) * TAU / 32.0);
                    let rim = DQuat::from_axis_angle(turn * across, cone.theta_o) * cone.axis;
                    assert!(all.axis.angle_between(rim) <= all.theta_o + 1e-7, "case {k}");
                }
            }
        }
    }
}
