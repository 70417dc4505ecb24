//! How the point of a surface moves with its coordinates.

use super::{Primitive, cuboid};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

impl Primitive {
    /// `∂p/∂u` and `∂p/∂v` at a point of `face`, in canonical space. At the poles of a sphere and the tip of
    /// a cone one of them is 0, or has no limit.
    pub fn derivatives(&self, p: DVec3, face: u32) -> [DVec3; 2] {
        let around = DVec3::new(p.z, 0.0, -p.x) * TAU;
        let cap = |y: f64| [DVec3::X * 2.0, DVec3::Z * (-2.0 * y.signum())];
        match (self, face) {
            (Self::Sphere, _) => {
                let r = p.x.hypot(p.z);
                [around, DVec3::new(-p.x * p.y / r, r, -p.z * p.y / r) * PI]
            }
            (Self::Rectangle, _) => [DVec3::X, DVec3::Y],
            (Self::Disk, _) => [DVec3::X * 2.0, DVec3::Y * 2.0],
            (Self::Plane, _) => [DVec3::X, DVec3::NEG_Z],
            (Self::Cuboid, face) => {
                let right = cuboid::right(face);
                [right, cuboid::normal(face).cross(right)]
            }
            (Self::Cylinder { .. }, 0) => [around, DVec3::Y],
            (Self::Cylinder { .. } | Self::Cone { .. }, 1) => cap(-0.5),
            (Self::Cylinder { .. }, _) => cap(0.5),
            (Self::Cone { .. }, _) => {
                let radial = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z);
                [around, DVec3::new(-radial.x, 1.0, -radial.z)]
            }
            (Self::Revolution(revolution), face) => revolution.derivatives(p, face),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Cubic, Profile};
    use crate::sampling::Sampler;
    use crate::shape::Revolution;
    use glam::{DAffine3, DVec2};
    use std::sync::Arc;

    /// Oracle: uv of points a little further along each derivative, on every face of every shape.
    #[test]
    fn uv_grows_by_one_along_its_derivative() {
        let [a, b] = [(0.3, -0.5), (0.6, 0.4)].map(DVec2::from);
        let bend = [a, DVec2::new(1.1, -0.2), DVec2::new(0.2, 0.1), b];
        let vase = Profile::new(&[Cubic::new(bend, [1.0; 4])]).expect("a valid profile");
        let shapes = [
            Primitive::Sphere,
            Primitive::Rectangle,
            Primitive::Disk,
            Primitive::Cuboid,
            Primitive::Cylinder { capped: true },
            Primitive::Cone { capped: true },
            Primitive::Revolution(Revolution::new(Arc::new(vase), true)),
        ];
        let step = 1e-4;
        for shape in shapes {
            for k in 0..500 {
                let u = Sampler::new(4, 0, (k, 0), 0).two(0);
                let point = shape.sample(u, &DAffine3::IDENTITY).expect("it has an area");
                let here = shape.surface(point.p, point.face, true);
                let near_a_pole = here.p.x.hypot(here.p.z) < 0.05;
                let near_the_seam = here.uv.x < 0.01 || here.uv.x > 0.99;
                if near_a_pole || near_the_seam {
                    continue;
                }
                let derivatives = shape.derivatives(here.p, point.face);
                for (axis, derivative) in derivatives.into_iter().enumerate() {
                    let there = shape.surface(here.p + derivative * step, point.face, true);
                    let change = (there.uv - here.uv).as_dvec2() / step;
                    let expected = glam::DVec2::AXES[axis];
                    assert!((change - expected).length() < 0.02, "{shape:?} {point:?}: {change}");
                }
            }
        }
    }
}
