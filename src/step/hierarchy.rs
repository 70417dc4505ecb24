//! Parents carry their children.

use crate::world::{ChildOf, Children, LocalPose, WorldTransform};
use bevy_ecs::prelude::*;
use glam::DAffine3;

/// Writes the [`WorldTransform`] of every entity from the [`LocalPose`]s along its ancestors.
///
/// Does nothing when no pose and no parent changed; writes only what is different. A parent
/// without a pose of its own counts as standing at the origin.
pub fn propagate_poses(
    moved: Query<(), Or<(Changed<LocalPose>, Changed<ChildOf>)>>,
    mut orphaned: RemovedComponents<ChildOf>,
    roots: Query<Entity, (With<LocalPose>, Without<ChildOf>)>,
    bare_parents: Query<Entity, (With<Children>, Without<LocalPose>, Without<ChildOf>)>,
    children: Query<&Children>,
    mut nodes: Query<(&LocalPose, &mut WorldTransform)>,
) {
    if moved.is_empty() && orphaned.read().count() == 0 {
        return;
    }
    let mut stack: Vec<(Entity, DAffine3)> =
        roots.iter().chain(&bare_parents).map(|root| (root, DAffine3::IDENTITY)).collect();
    while let Some((entity, parent)) = stack.pop() {
        let world = match nodes.get_mut(entity) {
            Ok((local, mut world)) => {
                let now = WorldTransform(parent * local.0);
                world.set_if_neq(now);
                now.0
            }
            Err(_) => parent,
        };
        if let Ok(children) = children.get(entity) {
            stack.extend(children.iter().map(|child| (child, world)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Transform;
    use glam::{DQuat, DVec3};

    /// Oracle: the product of the matrices, two levels deep.
    #[test]
    fn children_move_with_their_parents() {
        let mut world = World::new();
        let a = DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.5), DVec3::X);
        let b = DAffine3::from_scale(DVec3::splat(2.0));
        let c = DAffine3::from_translation(DVec3::new(0.0, 3.0, 1.0));
        let root = world.spawn((Transform::default(), LocalPose(a))).id();
        let middle = world.spawn((Transform::default(), LocalPose(b), ChildOf(root))).id();
        let leaf = world.spawn((Transform::default(), LocalPose(c), ChildOf(middle))).id();
        let mut schedule = Schedule::default();
        schedule.add_systems(propagate_poses);
        schedule.run(&mut world);
        assert_eq!(world.get::<WorldTransform>(leaf), Some(&WorldTransform(a * b * c)));
    }
}
