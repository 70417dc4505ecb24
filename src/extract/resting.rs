//! Which meshes stand still: those may share one tree.

use super::{Instances, Meshes};
use crate::world::{
    Acceleration, ChildOf, Emission, HiddenFromCamera, Keyframes, LookAt, Mesh, Shape,
    ShutterMotion, Velocity,
};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;
use glam::DAffine3;

/// A mesh which stands still and is used once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestingMesh {
    /// Its instance.
    pub instance: u32,
    /// Its mesh.
    pub mesh: u32,
    /// World from the space of the mesh.
    pub world_from_mesh: DAffine3,
}

/// The meshes which stand still, in the order of instances.
///
/// Left out are meshes of several objects (they share their own tree), what the camera does not see,
/// what emits (points of it are drawn from its own mesh), and whatever has a component by which it
/// moves or hangs on something that has: it may rest in this frame and move in the next, and which tree
/// holds it is not to depend on the frame.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct RestingMeshes(pub Vec<RestingMesh>);

/// What moves something.
type Moves = Or<(With<Velocity>, With<Acceleration>, With<Keyframes>, With<LookAt>)>;

/// Writes [`RestingMeshes`] when it is different from before.
#[expect(clippy::type_complexity, reason = "the signature lists what the table depends on")]
pub fn extract_resting_meshes(
    meshes: Res<Meshes>,
    instances: Res<Instances>,
    objects: Query<
        (Entity, &Shape, &ShutterMotion),
        (Without<Emission>, Without<HiddenFromCamera>),
    >,
    users: Query<&Shape>,
    changed: Query<
        (),
        (With<Shape>, Or<(Changed<ShutterMotion>, Changed<Shape>, Changed<ChildOf>)>),
    >,
    movers: Query<Entity, Moves>,
    parents: Query<&ChildOf>,
    kinds: Query<&Mesh>,
    mut table: ResMut<RestingMeshes>,
) {
    if !(meshes.is_changed() || instances.is_changed()) && changed.is_empty() {
        return;
    }
    if kinds.is_empty() {
        table.set_if_neq(RestingMeshes::default());
        return;
    }
    let mut uses = EntityHashMap::<u32>::default();
    for shape in &users {
        if let Shape::Mesh(mesh) = shape {
            *uses.entry(*mesh).or_default() += 1;
        }
    }
    let moves = |entity: Entity| {
        std::iter::successors(Some(entity), |e| parents.get(*e).ok().map(ChildOf::parent))
            .any(|e| movers.contains(e))
    };
    let mut found: Vec<RestingMesh> = objects
        .iter()
        .filter_map(|(entity, shape, motion)| {
            let (Shape::Mesh(mesh), [world_from_mesh]) = (shape, motion.keys.as_slice()) else {
                return None;
            };
            let once = uses.get(mesh) == Some(&1);
            let (instance, mesh) = (instances.slot(entity)?, meshes.slot(*mesh)?);
            (once && !moves(entity)).then_some(RestingMesh {
                instance,
                mesh,
                world_from_mesh: *world_from_mesh,
            })
        })
        .collect();
    found.sort_unstable_by_key(|resting| resting.instance);
    table.set_if_neq(RestingMeshes(found));
}
