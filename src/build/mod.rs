//! Structures over the flat arrays: bounding volume hierarchies and the table of lights.

pub mod bvh;
pub mod light;

use crate::frame::FrameSystems;
use bevy_ecs::prelude::*;

/// Adds the resources and the systems of this stage.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(bvh::RestingTree::default());
    world.insert_resource(bvh::MeshTrees::default());
    world.insert_resource(bvh::TopLevel::default());
    world.insert_resource(light::LightTable::default());
    world.insert_resource(light::ShapeLights::default());
    frame.add_systems(
        (
            bvh::join_resting_meshes,
            bvh::rebuild_mesh_trees,
            bvh::rebuild_top_level,
            light::rebuild_light_table,
            light::prepare_shape_lights,
        )
            .chain()
            .in_set(FrameSystems::Build),
    );
}
