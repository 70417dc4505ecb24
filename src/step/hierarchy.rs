//! Parents carry their children.

use crate::world::{ChildOf, Children, LocalPose, WorldTransform};
use bevy_ecs::prelude::*;
use glam::DAffine3;

/// What changes where an entity and those that it carries are.
type Moved = Or<(Changed<LocalPose>, Changed<ChildOf>)>;

/// Writes the [`WorldTransform`] of every entity from the [`LocalPose`]s along its ancestors.
///
/// Looks only at what moved or has another parent and at what that carries; writes only what is
/// different. A parent without a pose of its own counts as standing at the origin of its parent.
pub fn propagate_poses(
    moved: Query<Entity, Moved>,
    mut orphaned: RemovedComponents<ChildOf>,
    parents: Query<&ChildOf>,
    children: Query<&Children>,
    mut nodes: Query<(&LocalPose, &mut WorldTransform)>,
    mut stack: Local<Vec<(Entity, DAffine3)>>,
) {
    for entity in moved.iter().chain(orphaned.read()) {
        let ancestors = || parents.iter_ancestors(entity);
        // Whoever is carried by something that moved is written with it.
        if ancestors().any(|ancestor| moved.contains(ancestor)) {
            continue;
        }
        let parent = ancestors().find_map(|ancestor| nodes.get(ancestor).ok().map(|n| n.1.0));
        stack.push((entity, parent.unwrap_or(DAffine3::IDENTITY)));
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

    /// Oracle: the products of the matrices. Whatever of a tree moves, changes its parent or loses it,
    /// also below a parent without a pose, and nothing else is written.
    #[test]
    fn parts_of_a_tree_move_alone() {
        let at = |x: f64| LocalPose(DAffine3::from_translation(DVec3::X * x));
        let mut world = World::new();
        let root = world.spawn((Transform::default(), at(1.0))).id();
        let bare = world.spawn(ChildOf(root)).id();
        let arm = world.spawn((Transform::default(), at(10.0), ChildOf(bare))).id();
        let hand = world.spawn((Transform::default(), at(100.0), ChildOf(arm))).id();
        let other = world.spawn((Transform::default(), at(5.0))).id();
        let mut schedule = Schedule::default();
        schedule.add_systems(propagate_poses);
        let mut run = |world: &mut World| {
            schedule.run(world);
            let x = |e: Entity| world.get::<WorldTransform>(e).expect("placed").0.translation.x;
            let places = [root, arm, hand, other].map(x);
            let mut written = world.query_filtered::<Entity, Changed<WorldTransform>>();
            let written = written.iter(world).count();
            world.clear_trackers();
            (places, written)
        };
        assert_eq!(run(&mut world), ([1.0, 11.0, 111.0, 5.0], 4));
        assert_eq!(run(&mut world).1, 0, "nothing moved");
        *world.get_mut::<LocalPose>(arm).expect("placed") = at(20.0);
        assert_eq!(run(&mut world), ([1.0, 21.0, 121.0, 5.0], 2));
        *world.get_mut::<LocalPose>(hand).expect("placed") = at(200.0);
        *world.get_mut::<LocalPose>(root).expect("placed") = at(2.0);
        assert_eq!(run(&mut world), ([2.0, 22.0, 222.0, 5.0], 3));
        world.entity_mut(bare).insert(ChildOf(other));
        assert_eq!(run(&mut world), ([2.0, 25.0, 225.0, 5.0], 2));
        world.entity_mut(arm).remove::<ChildOf>();
        assert_eq!(run(&mut world), ([2.0, 20.0, 220.0, 5.0], 2));
    }
}
