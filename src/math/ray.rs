//! Rays in render space.

use glam::{DVec3, Vec3};

/// A ray in render space: metres, relative to the origin of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts; already outside the surface that it leaves.
    pub o: Vec3,
    /// Unit direction, or for a segment the vector to its end.
    pub d: Vec3,
    /// Time in the shutter, in `[0, 1]`.
    pub time: f32,
}

impl Ray {
    /// The point at parameter `t`, in `f64`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.o.as_dvec3() + self.d.as_dvec3() * t
    }
}
