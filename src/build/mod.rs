//! Structures over the flat arrays: bounding volume hierarchies, the table of lights, photon maps.

pub mod bvh;
pub mod light;
pub mod photon;

use crate::frame::FrameSystems;
use bevy_ecs::prelude::*;

/// Adds the resources and the systems of this stage.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(bvh::MeshTrees::default());
    world.insert_resource(bvh::TopLevel::default());
    world.insert_resource(light::LightTable::default());
    world.insert_resource(light::PhotonSource::default());
    frame.add_systems(
        (
            bvh::rebuild_mesh_trees,
            bvh::rebuild_top_level,
            light::rebuild_light_table,
            light::rebuild_photon_source.run_if(photons_are_traced),
        )
            .chain()
            .in_set(FrameSystems::Build),
    );
}

/// Whether the integrator of this frame works with photons.
fn photons_are_traced(integrator: Res<crate::extract::ChosenIntegrator>) -> bool {
    integrator.method.has_photons()
}
