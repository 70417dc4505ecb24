//! The components: what an entity can be.
//!
//! Those of a scene file are the types of [`crate::description`] with an [`Entity`] wherever the
//! file has a name. Textures, materials and meshes are entities too: an object made of a material
//! of its own carries a [`Material`]; one that shares it points there with [`MadeOf`].

use crate::description::modelling::View;
use crate::description::{self, Clock, GridData, ImageData, TriangleMesh};
use crate::math::{Aabb, TimeCurve};
use bevy_ecs::component::{Mutable, RequiredComponentsRegistrator, StorageType};
use bevy_ecs::prelude::*;
use glam::DAffine3;
use std::sync::Arc;

pub use bevy_ecs::hierarchy::{ChildOf, Children};
pub use bevy_ecs::name::Name;
pub use description::{Acceleration, Keyframes, LookAt, Transform, Velocity};

/// What a surface is made of.
pub type Material = description::Material<Entity>;
/// A texture.
pub type Texture = description::Texture<Arc<ImageData>, Arc<GridData>, Entity>;
/// The form of an object.
pub type Shape = description::Shape<Entity>;
/// Light which leaves the surface of a shape.
pub type Emission = description::Emission<Entity>;
/// How a mesh is moved by a texture; it stands beside the [`Mesh`].
pub type Displacement = description::Displacement<Entity>;
/// A light without a shape.
pub type Light = description::Light<Entity>;
/// A camera.
pub type Camera = description::Camera<Entity>;

/// Makes a type of the description a component which needs a place in the world.
macro_rules! placed_component {
    ($($component:ty),+) => {$(
        impl Component for $component {
            const STORAGE_TYPE: StorageType = StorageType::Table;
            type Mutability = Mutable;
            fn register_required_components(_: bevy_ecs::component::ComponentId, required: &mut RequiredComponentsRegistrator) {
                required.register_required(Transform::default);
            }
        }
    )+};
}

/// Makes a type of the description a plain component.
macro_rules! plain_component {
    ($($component:ty),+) => {$(
        impl Component for $component {
            const STORAGE_TYPE: StorageType = StorageType::Table;
            type Mutability = Mutable;
        }
    )+};
}

placed_component!(Shape, Light, Camera, Velocity, Acceleration, Keyframes, LookAt);
plain_component!(Material, Texture, Emission, Displacement);

impl Component for Transform {
    const STORAGE_TYPE: StorageType = StorageType::Table;
    type Mutability = Mutable;
    fn register_required_components(
        _: bevy_ecs::component::ComponentId,
        required: &mut RequiredComponentsRegistrator,
    ) {
        required.register_required(LocalPose::default);
        required.register_required(WorldTransform::default);
        required.register_required(ShutterMotion::default);
    }
}

/// The pose in the parent's frame at the time of [`super::SceneTime`]; written by the step stage.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
pub struct LocalPose(pub DAffine3);

/// The pose in the world at the time of [`super::SceneTime`]; written by the step stage.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
pub struct WorldTransform(pub DAffine3);

/// Poses in the world at evenly spaced times from shutter opening to closing, both included; one
/// key for what stands still. Written by the step stage.
#[derive(Component, Clone, Debug, Default, PartialEq)]
pub struct ShutterMotion {
    /// World from object.
    pub keys: Vec<DAffine3>,
    /// Whether a curve joins their translations, and not lines.
    pub curved: bool,
}

/// Vertical field of view and focus of a camera over the shutter. Written by the step stage.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Optics {
    /// Vertical field of view in degrees.
    pub fov_deg: TimeCurve,
    /// Keyed focus distance in metres.
    pub focus: Option<TimeCurve>,
}

/// The mean over the shutter of the keyed factor on an emission or a light. Written by the step
/// stage.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct EmissionFactor(pub f64);

/// A triangle mesh; objects refer to its entity with [`Shape::Mesh`](description::Shape::Mesh).
#[derive(Component, Clone, Debug)]
#[component(immutable)]
pub struct Mesh {
    data: Arc<TriangleMesh>,
    bounds: Aabb,
}

impl Mesh {
    /// A mesh around its triangles.
    pub fn new(data: Arc<TriangleMesh>) -> Self {
        let bounds = Aabb::from_points(data.positions.iter().copied());
        Self { data, bounds }
    }

    /// The triangles.
    pub fn data(&self) -> &Arc<TriangleMesh> {
        &self.data
    }

    /// The box around all vertices, in the mesh's own space.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// From where the camera sees the instances of a mesh over all frames of the clock; only beside an adaptive
/// [`Displacement`]. Written by the step stage.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Views {
    /// All views.
    pub list: Vec<View>,
    /// The clock of which these are the frames.
    pub clock: Clock,
    /// The size of the picture in pixels.
    pub size: (u32, u32),
}

/// Points from an object to the entity which holds its [`Material`].
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct MadeOf(pub Entity);

/// The camera which takes the picture, when there are several.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct ActiveCamera;

/// Not met by the camera's own rays; shadows, mirrors and light see it.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct HiddenFromCamera;
