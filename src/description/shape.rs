//! Shapes, as a scene file says them.

use super::Rgb;
use super::profile::built;
use crate::math::{Chart, Profile};
use glam::{DVec2, DVec3};
use serde::Deserialize;
use std::sync::Arc;

/// A shape in its own space, metres. `R` refers to a mesh.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Shape<R> {
    /// Centred on the origin; poles on the y axis; u is the longitude.
    Sphere {
        /// Metres.
        #[serde(default = "one")]
        radius: f64,
    },
    /// In the xy plane, centred, its front towards +z; uv is (0, 0) at its lower left corner.
    Rectangle {
        /// Width and height in metres.
        #[serde(default = "one_by_one")]
        size: DVec2,
    },
    /// In the xy plane, centred, its front towards +z.
    Disk {
        /// Metres.
        #[serde(default = "one")]
        radius: f64,
    },
    /// The infinite plane y = 0, its front towards +y; uv in metres is (x, −z).
    Plane {},
    /// Centred on the origin, edges along the axes; uv is the unit square on every side.
    Box {
        /// Edge lengths in metres.
        #[serde(default = "one_by_one_by_one")]
        size: DVec3,
    },
    /// Around the y axis, centred on the origin.
    Cylinder {
        /// Metres.
        #[serde(default = "one")]
        radius: f64,
        /// Metres.
        #[serde(default = "one")]
        height: f64,
        /// Whether the two ends are closed by disks.
        #[serde(default = "yes")]
        capped: bool,
    },
    /// Around the y axis, centred on the origin, its tip up.
    Cone {
        /// Radius of the base in metres.
        #[serde(default = "one")]
        radius: f64,
        /// Metres.
        #[serde(default = "one")]
        height: f64,
        /// Whether the base is closed by a disk.
        #[serde(default = "yes")]
        capped: bool,
    },
    /// A plane curve turned around the y axis.
    Revolution {
        /// What is turned, a [`Curve`](super::Curve) in a file: (radius, height) in metres.
        #[serde(deserialize_with = "built")]
        profile: Arc<Profile>,
        /// Whether ends of the curve which are not on the axis are closed by disks.
        #[serde(default)]
        capped: bool,
    },
    /// A triangle mesh by its name in `meshes:`.
    Mesh(R),
}

impl<R> Shape<R> {
    /// The same shape with its reference replaced.
    ///
    /// # Errors
    /// Whatever `f` returns.
    pub fn map_ref<S, E>(self, f: impl FnOnce(R) -> Result<S, E>) -> Result<Shape<S>, E> {
        Ok(match self {
            Self::Sphere { radius } => Shape::Sphere { radius },
            Self::Rectangle { size } => Shape::Rectangle { size },
            Self::Disk { radius } => Shape::Disk { radius },
            Self::Plane {} => Shape::Plane {},
            Self::Box { size } => Shape::Box { size },
            Self::Cylinder { radius, height, capped } => Shape::Cylinder { radius, height, capped },
            Self::Cone { radius, height, capped } => Shape::Cone { radius, height, capped },
            Self::Revolution { profile, capped } => Shape::Revolution { profile, capped },
            Self::Mesh(reference) => Shape::Mesh(f(reference)?),
        })
    }
}

/// Triangles with shared vertices, in metres.
///
/// `normals`, `uvs`, `tangents` and `colors` are empty or as long as `positions`. Counter-clockwise triangles face the
/// viewer. `v` grows upwards in an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<glam::Vec3>,
    /// Unit vertex normals, or empty: flat triangles.
    pub normals: Vec<glam::Vec3>,
    /// Texture coordinates, or empty: (0, 0), (1, 0), (1, 1) on every triangle.
    pub uvs: Vec<glam::Vec2>,
    /// Where the coordinates end, of meshes made from shapes; files do not say.
    pub chart: Chart,
    /// Unit tangents that a normal map was made for, and the sign of `normal × tangent` along its green; 0 where
    /// none is given. Empty where none is: they follow from the coordinates.
    pub tangents: Vec<glam::Vec4>,
    /// Linear colours of the vertices, or empty: white.
    pub colors: Vec<Rgb>,
    /// Three vertex indices per triangle, all in range.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Bytes of its lists.
    pub fn memory(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.triangles[..])
    }
}

fn one() -> f64 {
    1.0
}
fn one_by_one() -> DVec2 {
    DVec2::ONE
}
fn one_by_one_by_one() -> DVec3 {
    DVec3::ONE
}
fn yes() -> bool {
    true
}
