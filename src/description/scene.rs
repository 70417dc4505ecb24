//! A whole scene as plain, validated data.

use super::{
    Acceleration, Camera, Clock, Diagnostics, Emission, Keyframes, Light, LookAt, Material,
    RenderSettings, SceneTexture, Shape, Transform, TriangleMesh, Velocity, Waves,
};
use indexmap::IndexMap;
use std::path::PathBuf;
use std::sync::Arc;

/// How a mesh is moved by a texture. `R` refers to a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Displacement<R> {
    /// The texture.
    pub texture: R,
    /// What it says.
    pub says: Relief,
    /// Metres of a height or a coordinate of 1.
    pub strength: f32,
    /// The height or the coordinate which stays where it is.
    pub middle: f32,
    /// Whether the mesh is divided first, to edges of [`RenderSettings::dicing`] pixels.
    pub adaptive: bool,
}

/// What a texture says that displaces a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relief {
    /// A height along the normal: its number.
    Height,
    /// A vector along the tangent in the direction of u, the tangent across it in the direction of v, and the
    /// normal: its colour.
    Tangent,
    /// A vector in the space of the mesh: its colour.
    Object,
}

/// A scene: everything that `load_scene` found, checked, with every named file read.
///
/// All references are names which exist; all numbers are finite and in range.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// The scene file and everything it includes and names, in the order of reading.
    pub files: Vec<PathBuf>,
    /// XXH3-128 over the bytes and names of all those files, and over what was set from outside: in both
    /// without the clock and the settings of the render.
    pub content_hash: u128,
    /// What is probably not meant: definitions which nothing uses, a scene without light.
    pub warnings: Diagnostics,
    /// Frames and shutter.
    pub clock: Clock,
    /// Settings of the render.
    pub render: RenderSettings,
    /// The name of the camera entity to look through; there is always one.
    pub camera: String,
    /// Textures by name, with their images decoded.
    pub textures: IndexMap<String, SceneTexture>,
    /// Materials by name.
    pub materials: IndexMap<String, Material<String>>,
    /// Meshes by name.
    pub meshes: IndexMap<String, Arc<TriangleMesh>>,
    /// The meshes which textures displace, by name; `meshes` holds them before.
    pub displacements: IndexMap<String, Displacement<String>>,
    /// The meshes which are surfaces of water, by name; `meshes` holds them at rest.
    pub waves: IndexMap<String, Waves>,
    /// Entities by name, in the order of the file.
    pub entities: IndexMap<String, EntityDescription>,
}

/// An entity: its components, each optional.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EntityDescription {
    /// The entity in whose frame this one moves.
    pub parent: Option<String>,
    /// Pose at time 0.
    pub transform: Option<Transform>,
    /// Keeps it aimed at a point.
    pub look_at: Option<LookAt>,
    /// Uniform motion.
    pub velocity: Option<Velocity>,
    /// Constant acceleration.
    pub acceleration: Option<Acceleration>,
    /// Tracks over time.
    pub keyframes: Option<Keyframes>,
    /// Its form.
    pub shape: Option<Shape<String>>,
    /// The name of what it is made of.
    pub material: Option<String>,
    /// The light that its surface emits.
    pub emission: Option<Emission<String>>,
    /// A light without a shape.
    pub light: Option<Light<String>>,
    /// A camera.
    pub camera: Option<Camera<String>>,
    /// Seen by the camera's own rays (mirrors and shadows see everything).
    pub hidden_from_camera: bool,
}
