//! World to flat arrays: here the ECS ends.
//!
//! Each table is a resource of its own, written only when something it is made of changed, so that
//! the build stage can ask each table whether it must do anything. Everything is relative to the
//! *origin of the frame*, the position of the camera when the shutter opens: subtracted in `f64`, so
//! that a scene may be anywhere.

mod camera;
mod camera_facts;
mod caustic_noise;
mod displace;
mod emissions;
mod instance;
mod instances;
mod lights;
mod method;
mod object_ids;
mod requirements;
mod resting;
mod solids;
mod surfaces;

pub use camera::{CameraRay, FrameOrigin, ViewCamera, extract_camera};
pub use camera_facts::{CameraFacts, CameraState};
pub(crate) use displace::meshes_fit;
pub use displace::{DicingRefused, Displaced, Refusal, displace_meshes};
pub use emissions::{Emissions, SurfaceEmission, extract_emissions};
pub use instance::{Geometry, Instance, NOTHING};
pub use instances::{Instances, Meshes, extract_instances, extract_meshes};
pub use lights::{PunctualLight, PunctualLights, extract_lights};
pub(crate) use method::method_suffices;
pub use method::{ChosenIntegrator, Method, choose_integrator};
pub use object_ids::object_ids;
pub use requirements::{Feature, Requirements, derive_requirements};
pub use resting::{RestingMesh, RestingMeshes, extract_resting_meshes};
pub use solids::{may_enclose, overlap, overlapping_pairs, solids};
pub use surfaces::{SurfaceSlots, Surfaces, extract_surfaces};

use crate::frame::{FrameSystems, stamp};
use bevy_ecs::prelude::*;

/// Adds the tables and the systems of this stage.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(FrameOrigin::default());
    world.insert_resource(ViewCamera::default());
    world.insert_resource(Meshes::default());
    world.insert_resource(DicingRefused::default());
    world.insert_resource(Instances::default());
    world.insert_resource(RestingMeshes::default());
    world.insert_resource(Surfaces::default());
    world.insert_resource(SurfaceSlots::default());
    world.insert_resource(Emissions::default());
    world.insert_resource(PunctualLights::default());
    world.insert_resource(Requirements::default());
    world.insert_resource(ChosenIntegrator::default());
    frame.add_systems(
        (
            extract_camera,
            stamp("camera"),
            extract_surfaces,
            stamp("surfaces"),
            extract_emissions,
            stamp("emissions"),
            displace_meshes,
            extract_meshes,
            extract_instances,
            stamp("instances"),
            extract_resting_meshes,
            stamp("resting meshes"),
            extract_lights,
            stamp("lights"),
            derive_requirements,
            choose_integrator,
            stamp("requirements"),
        )
            .chain()
            .in_set(FrameSystems::Extract),
    );
}

/// The key by which tables order entities: that of spawning, as long as none was despawned; two
/// living entities never share it.
fn spawn_order(entity: Entity) -> u32 {
    entity.index_u32()
}
