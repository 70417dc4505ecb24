//! Components and resources, and spawning a description into a world.

mod components;
mod deformation;
mod resources;
mod spawn;

pub use components::{
    Acceleration, ActiveCamera, Camera, ChildOf, Children, Displacement, Emission, EmissionFactor,
    HiddenFromCamera, Keyframes, Light, LocalPose, LookAt, MadeOf, Material, Mesh, Name, Optics,
    Shape, ShutterMotion, Texture, Transform, Velocity, Views, WorldTransform,
};
pub(crate) use deformation::ShutterSpan;
pub use deformation::{Deformation, VertexMotion, Vertices};
pub use resources::{FrameClock, SceneTime, Settings};
pub use spawn::{SceneEntities, spawn_scene};
