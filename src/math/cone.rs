//! How wide the part of a scene is that one camera sample stands for.

use glam::DVec3;

/// A cone around a path, whose section with a surface is what a sample stands for there.
///
/// It begins as a pixel and grows with the length of the path (Akenine-Möller, Crassin, Boksansky, Belcour,
/// Panteleev, Wright 2021, "Improved Shader and Texture Level of Detail Using Ray Cones", JCGT 10(1)). Mirrors and
/// smooth interfaces keep its spread as if they were flat: the section is then too small behind curved
/// ones that spread light, which is noise but no error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cone {
    /// Diameter where the path is, metres.
    pub width: f32,
    /// Growth of the diameter per metre.
    pub spread: f32,
}

impl Cone {
    /// Whether nothing is to be filtered.
    #[inline]
    pub fn is_ray(&self) -> bool {
        self.width == 0.0 && self.spread == 0.0
    }

    /// Goes on for a distance in metres.
    #[inline]
    pub fn advance(&mut self, distance: f64) {
        self.width += self.spread * distance as f32;
    }

    /// Turns into a direction drawn with the density `pdf` per steradian by each of `samples` paths: one of
    /// them stands for the solid angle `1/(pdf·samples)`. Half the diameter of that is added, so that neighbouring
    /// cones touch rather than overlap.
    #[inline]
    pub fn scatter(&mut self, pdf: f32, samples: f32) {
        self.spread = self.spread.hypot((pdf * samples).sqrt().recip() * 0.5);
    }

    /// The axes of its section with a plane of unit normal `n`, from end to end, in a unit direction `d`: the
    /// shorter and the longer one, metres. At a grazing angle the longer one has no end.
    pub fn section(&self, d: DVec3, n: DVec3) -> [DVec3; 2] {
        let width = f64::from(self.width);
        let across = d.cross(n);
        // Head on any two directions will do.
        let across = across.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        let along = n.cross(across);
        [across * width, along * (width / d.dot(n).abs())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: a cylinder of diameter w meets a plane at angle θ in an ellipse of axes w and w/cos θ.
    #[test]
    fn sections_are_those_of_a_cylinder() {
        let cone = Cone { width: 0.3, spread: 0.0 };
        for degrees in [0.0_f64, 30.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let [a, b] = cone.section(DVec3::new(sin, 0.0, -cos), DVec3::Z);
            assert!((a.length() - 0.3).abs() < 1e-6, "{degrees}");
            assert!((b.length() - 0.3 / cos).abs() < 1e-6, "{degrees}");
            assert!(a.z.abs() < 1e-12 && b.z.abs() < 1e-12 && a.dot(b).abs() < 1e-12);
            assert!(degrees == 0.0 || b.y.abs() < 1e-12, "longer where the ray points: {b}");
        }
        let [_, grazing] = cone.section(DVec3::X, DVec3::Z);
        assert!(!grazing.is_finite());
    }

    /// A pixel of a pinhole camera at a distance: its side there.
    #[test]
    fn cones_grow_with_the_distance() {
        let mut cone = Cone { width: 0.0, spread: 1e-3 };
        cone.advance(2.0);
        cone.advance(3.0);
        assert!((cone.width - 5e-3).abs() < 1e-9);
        cone.scatter(std::f32::consts::FRAC_1_PI, 64.0);
        assert!((cone.spread - 0.5 * (std::f32::consts::PI / 64.0).sqrt()).abs() < 1e-4);
    }
}
