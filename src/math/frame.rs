//! Orthonormal frames around a direction.

use glam::Vec3;

/// A right-handed orthonormal frame; `z` is the direction it was made around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent, `z × x`.
    pub y: Vec3,
    /// The axis, usually a normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around the unit vector `z`, continuous except at `z.z` changing sign.
    ///
    /// Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1).
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Components of `v` along the axes of the frame.
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// The vector with components `v` along the axes of the frame.
    pub fn from_local(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Octants, poles and signed zeros: orthonormal to a few ε.
    #[test]
    fn frames_are_orthonormal_everywhere() {
        let mut axes = Vec::new();
        for x in [-1.0, -1e-20, -0.0, 0.0, 1e-4, 1.0] {
            for y in [-1.0, -0.0, 0.0, 1e-4, 1.0] {
                for z in [-1.0, -1e-7, -0.0, 0.0, 1.0_f32] {
                    let v = Vec3::new(x, y, z);
                    if v.length() > 0.5 {
                        axes.push(v.normalize());
                    }
                }
            }
        }
        for z in axes {
            let f = Frame::from_z(z);
            let tolerance = 8.0 * f32::EPSILON;
            assert!((f.x.length() - 1.0).abs() < tolerance, "{z}");
            assert!((f.y.length() - 1.0).abs() < tolerance, "{z}");
            assert!(f.x.dot(f.y).abs() < tolerance && f.x.dot(f.z).abs() < tolerance, "{z}");
            assert!((f.x.cross(f.y) - f.z).length() < tolerance, "{z}");
        }
    }
}
