//! Whether there is memory for the trees of a frame, asked before they are built.
//!
//! A tree which cannot be held would end the program in the midst of its building, or drown the machine.
//! Its size follows from the number of triangles ([`WideTree::forecast`]), so the system is asked for
//! as much first: what it refuses becomes an error of the frame.

use super::bvh::{MeshTrees, WideTree};
use crate::extract::Meshes;
use crate::world::Settings;
use bevy_ecs::prelude::*;
use std::collections::{HashSet, TryReserveError};
use std::sync::Arc;

/// The memory that the trees of new meshes will take.
#[derive(Resource, Debug, Default)]
pub struct TreeMemory {
    /// Bytes of the trees to be built in this frame, before they are; 0 when none is.
    pub forecast: usize,
    /// What the system answered, when it does not have them.
    pub refused: Option<TryReserveError>,
}

/// Writes [`TreeMemory`] when a mesh was added, replaced or removed, or a frame was refused before.
pub fn forecast_tree_memory(
    meshes: Res<Meshes>,
    trees: Res<MeshTrees>,
    settings: Res<Settings>,
    mut memory: ResMut<TreeMemory>,
) {
    if !meshes.is_changed() && memory.refused.is_none() {
        if memory.forecast != 0 {
            memory.bypass_change_detection().forecast = 0;
        }
        return;
    }
    let known: HashSet<_> = trees.list.iter().map(|tree| Arc::as_ptr(&tree.mesh)).collect();
    let forecast = meshes
        .list
        .iter()
        .filter(|mesh| !known.contains(&Arc::as_ptr(mesh)))
        .map(|mesh| WideTree::forecast(mesh.triangles.len(), settings.0.bvh))
        .sum();
    *memory = TreeMemory { forecast, refused: ask_for(forecast).err() };
}

/// Whether the trees of this frame can be held.
pub(crate) fn trees_fit(memory: Res<TreeMemory>) -> bool {
    memory.refused.is_none()
}

/// Asks the system for memory and gives it back.
fn ask_for(bytes: usize) -> Result<(), TryReserveError> {
    Vec::<u8>::new().try_reserve_exact(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{BvhQuality, TriangleMesh};
    use crate::frame::{RenderError, Simulation};
    use crate::world::{Camera, Mesh, Shape};
    use glam::Vec3;

    /// The forecast is that of new meshes alone, and a refusal is an error until there is memory again.
    #[test]
    fn new_trees_are_forecast_and_a_refusal_is_an_error() {
        let mut simulation = Simulation::new();
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = TriangleMesh {
            positions: corners,
            triangles: vec![[0, 1, 2]; 5],
            ..Default::default()
        };
        let world = simulation.world_mut();
        world.spawn(Camera::default());
        let mesh = world.spawn(Mesh::new(Arc::new(mesh))).id();
        world.spawn(Shape::Mesh(mesh));
        world.resource_mut::<TreeMemory>().refused = ask_for(usize::MAX).err();
        assert!(world.resource::<TreeMemory>().refused.is_some(), "no machine has that");
        simulation.prepare_frame(0).expect("five triangles fit");
        let forecast =
            |simulation: &Simulation| simulation.world().resource::<TreeMemory>().forecast;
        assert_eq!(forecast(&simulation), WideTree::forecast(5, BvhQuality::default()));
        simulation.prepare_frame(1).expect("five triangles fit");
        assert_eq!(forecast(&simulation), 0, "nothing new");
    }

    /// What a frame whose trees do not fit says.
    #[test]
    fn a_refusal_names_the_size() {
        let source = ask_for(usize::MAX).expect_err("no machine has that");
        let error = RenderError::TreeMemory { megabytes: 12, source };
        assert!(error.to_string().contains("12 MB"), "{error}");
    }
}
