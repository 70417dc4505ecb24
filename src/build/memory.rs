//! Whether there is memory for the trees of a frame, asked before they are built.
//!
//! A tree which cannot be held would end the program in the midst of its building, or drown the machine.
//! Its size follows from the number of triangles ([`WideTree::forecast`]), so [`ask`] is asked for
//! as much first: what there is not becomes an error of the frame.

use super::bvh::{MeshTrees, RestingTree, WideTree};
use crate::extract::{Meshes, RestingMeshes};
use crate::memory::{Shortage, ask};
use crate::world::Settings;
use bevy_ecs::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// The memory that the trees of new meshes will take.
#[derive(Resource, Debug, Default)]
pub struct TreeMemory {
    /// Bytes of the trees to be built in this frame, before they are; 0 when none is.
    pub forecast: usize,
    /// What is missing, when there are not so many.
    pub refused: Option<Shortage>,
}

/// Writes [`TreeMemory`] when a mesh was added, replaced or removed, when others stand still than before,
/// for another quality of trees, or when a frame was refused before.
pub fn forecast_tree_memory(
    meshes: Res<Meshes>,
    trees: Res<MeshTrees>,
    resting: Res<RestingMeshes>,
    shared: Res<RestingTree>,
    settings: Res<Settings>,
    mut memory: ResMut<TreeMemory>,
) {
    let quality = settings.0.bvh;
    let outdated =
        shared.is_outdated(quality) || trees.list.iter().any(|tree| tree.is_outdated(quality));
    let changed = meshes.is_changed() || resting.is_changed() || outdated;
    if !changed && memory.refused.is_none() {
        if memory.forecast != 0 {
            memory.bypass_change_detection().forecast = 0;
        }
        return;
    }
    let known: HashSet<_> = trees
        .list
        .iter()
        .filter(|tree| !tree.is_elsewhere() && !tree.is_outdated(quality))
        .map(|tree| Arc::as_ptr(&tree.mesh))
        .collect();
    let joined: HashSet<u32> = if resting.0.len() < 2 {
        HashSet::new()
    } else {
        resting.0.iter().map(|member| member.mesh).collect()
    };
    let own = (0..)
        .zip(&meshes.list)
        .filter(|(slot, mesh)| !joined.contains(slot) && !known.contains(&Arc::as_ptr(mesh)));
    let own: usize = own.map(|(_, mesh)| WideTree::forecast(mesh.triangles.len(), quality)).sum();
    let forecast = own + RestingTree::forecast(&resting.0, &meshes.list, quality);
    *memory = TreeMemory { forecast, refused: ask(forecast as u64).err() };
}

/// Whether the trees of this frame can be held.
pub(crate) fn trees_fit(memory: Res<TreeMemory>) -> bool {
    memory.refused.is_none()
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
        world.resource_mut::<TreeMemory>().refused = ask(u64::MAX).err();
        assert!(world.resource::<TreeMemory>().refused.is_some(), "no machine has that");
        simulation.prepare_frame(0).expect("five triangles fit");
        let forecast =
            |simulation: &Simulation| simulation.world().resource::<TreeMemory>().forecast;
        assert_eq!(forecast(&simulation), WideTree::forecast(5, BvhQuality::default()));
        simulation.prepare_frame(1).expect("five triangles fit");
        assert_eq!(forecast(&simulation), 0, "nothing new");
    }

    /// 5000 triangles over hills.
    fn hills(number: u32) -> TriangleMesh {
        let corner = |k: u32| {
            let (x, z) = ((k % 51) as f32, (k / 51) as f32);
            Vec3::new(x, (0.3 * x + number as f32).sin() + (0.4 * z).cos(), z)
        };
        let cell = |k: u32| {
            let a = k / 50 * 51 + k % 50;
            [[a, a + 51, a + 1], [a + 1, a + 51, a + 52]]
        };
        TriangleMesh {
            positions: (0..51 * 51).map(corner).collect(),
            triangles: (0..2500).flat_map(cell).collect(),
            ..Default::default()
        }
    }

    /// Bytes that the trees of a world hold, the copy of what stands still among them.
    fn held(simulation: &Simulation) -> usize {
        let own = &simulation.world().resource::<MeshTrees>().list;
        let own: usize = own.iter().map(|tree| tree.memory()).sum();
        own + simulation.world().resource::<RestingTree>().memory()
    }

    /// Oracle: what is held afterwards. Three meshes of thousands of triangles at rest, in one tree with
    /// their second copy, and one of two objects, in its own; then for another quality.
    #[test]
    fn the_forecast_is_what_trees_and_copies_take() {
        let mut simulation = Simulation::new();
        let world = simulation.world_mut();
        world.spawn(Camera::default());
        for (number, objects) in [(0, 1), (1, 1), (2, 1), (3, 2)] {
            let raw = hills(number);
            let mesh = world.spawn(Mesh::new(Arc::new(raw))).id();
            for _ in 0..objects {
                world.spawn(Shape::Mesh(mesh));
            }
        }
        for quality in BvhQuality::ALL {
            simulation.world_mut().resource_mut::<Settings>().0.bvh = quality;
            simulation.prepare_frame(0).expect("they fit");
            assert!(simulation.world().resource::<RestingTree>().built);
            let forecast = simulation.world().resource::<TreeMemory>().forecast as f64;
            let share = forecast / held(&simulation) as f64;
            // As WideTree::forecast promises.
            assert!((share - 1.0).abs() < 0.2, "{quality:?}: {share}");
        }
        simulation.prepare_frame(1).expect("they fit");
        assert_eq!(simulation.world().resource::<TreeMemory>().forecast, 0, "nothing new");
    }

    /// What a frame whose trees do not fit says.
    #[test]
    fn a_refusal_names_the_size() {
        let source = ask(u64::MAX).expect_err("no machine has that");
        let error = RenderError::TreeMemory { megabytes: 12, source };
        assert!(error.to_string().contains("12 MB"), "{error}");
    }
}
