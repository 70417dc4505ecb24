//! Which meshes stand still: those may share one tree.

use super::{Instances, Meshes};
use crate::world::{
    Acceleration, ChildOf, Deformation, Emission, HiddenFromCamera, Keyframes, LookAt, Shape,
    ShutterMotion, Velocity,
};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemParam;
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

/// Components which move what they are on.
type MovesItself = Or<(With<Velocity>, With<Acceleration>, With<Keyframes>, With<LookAt>)>;

/// What moves an entity: components of its own and of what it hangs on.
#[derive(SystemParam)]
pub struct Moves<'w, 's> {
    movers: Query<'w, 's, Entity, MovesItself>,
    parents: Query<'w, 's, &'static ChildOf>,
    deforming: Query<'w, 's, (), With<Deformation>>,
}

impl Moves<'_, '_> {
    /// Whether an object or its mesh moves.
    fn moves(&self, entity: Entity, mesh: Entity) -> bool {
        if self.deforming.contains(mesh) {
            return true;
        }
        std::iter::successors(Some(entity), |e| self.parents.get(*e).ok().map(ChildOf::parent))
            .any(|e| self.movers.contains(e))
    }
}

/// How many objects use each mesh; counted when the objects changed.
#[derive(Default)]
pub struct Uses(EntityHashMap<u32>);

/// Writes [`RestingMeshes`] when it is different from before.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the table depends on")]
pub fn extract_resting_meshes(
    meshes: Res<Meshes>,
    instances: Res<Instances>,
    objects: Query<
        (Entity, &Shape, &ShutterMotion),
        (Without<Emission>, Without<HiddenFromCamera>),
    >,
    users: Query<&Shape>,
    changed: Query<(Entity, &Shape), Or<(Changed<ShutterMotion>, Changed<ChildOf>)>>,
    moves: Moves,
    mut uses: Local<Uses>,
    mut table: ResMut<RestingMeshes>,
) {
    let restructured = meshes.is_changed() || (instances.is_changed() && instances.restructured);
    if restructured {
        uses.0.clear();
        for shape in &users {
            if let Shape::Mesh(mesh) = shape {
                *uses.0.entry(*mesh).or_default() += 1;
            }
        }
    }
    let once = |mesh: Entity| uses.0.get(&mesh) == Some(&1);
    let concerns = |(entity, shape): (Entity, &Shape)| match shape {
        Shape::Mesh(mesh) => once(*mesh) && !moves.moves(entity, *mesh),
        _ => false,
    };
    if !restructured && !changed.iter().any(concerns) {
        return;
    }
    let mut found: Vec<RestingMesh> = objects
        .iter()
        .filter_map(|(entity, shape, motion)| {
            let (Shape::Mesh(mesh), [world_from_mesh]) = (shape, motion.keys.as_slice()) else {
                return None;
            };
            if !once(*mesh) || moves.moves(entity, *mesh) {
                return None;
            }
            let (instance, (mesh, _)) = (instances.slot(entity)?, meshes.slot(*mesh)?);
            Some(RestingMesh { instance, mesh, world_from_mesh: *world_from_mesh })
        })
        .collect();
    found.sort_unstable_by_key(|resting| resting.instance);
    table.set_if_neq(RestingMeshes(found));
}
