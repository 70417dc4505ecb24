//! From where the camera sees what is diced for it, over the whole sequence.

use super::pose::evaluate_fov_at;
use crate::description::modelling::{View, perspective_pixel};
use crate::world::{
    ActiveCamera, Camera, Displacement, FrameClock, Keyframes, Mesh, SceneTime, Settings, Shape,
    Views, WorldTransform,
};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;

/// Writes the [`Views`] of the meshes which are divided adaptively, when one of them is new, or it, the camera, the
/// clock or the size of the picture has changed.
///
/// The pose systems are asked at the opening and the closing of the shutter of every frame of the clock. A mesh is
/// then the same in all frames, whichever are rendered, and its edges do not pop.
pub fn survey_views(world: &mut World) {
    let mut displaced = world.query::<(Entity, &Displacement, Ref<Mesh>, Option<&Views>)>();
    let clock = world.resource::<FrameClock>().clock;
    let size = world.resource::<Settings>().0.size;
    let mut wanted = EntityHashMap::default();
    let mut outdated = false;
    for (entity, displacement, mesh, views) in displaced.iter(world) {
        if displacement.adaptive {
            wanted.insert(entity, Vec::new());
            let fits = views.is_some_and(|views| views.clock == clock && views.size == size);
            outdated |= !fits || mesh.is_changed();
        }
    }
    if wanted.is_empty() {
        return;
    }
    let mut cameras = world.query_filtered::<(), Changed<Camera>>();
    if !outdated && cameras.iter(world).next().is_none() {
        return;
    }
    let before = *world.resource::<SceneTime>();
    for frame in clock.frames.0..=clock.frames.1 {
        let (open, close) = FrameClock { clock, frame }.shutter();
        for seconds in if close > open { vec![open, close] } else { vec![open] } {
            *world.resource_mut::<SceneTime>() = SceneTime { seconds };
            world.run_schedule(super::Pose);
            look(world, seconds, &mut wanted);
        }
    }
    *world.resource_mut::<SceneTime>() = before;
    for (entity, list) in wanted {
        let views = Views { list, clock, size };
        let mut mesh = world.entity_mut(entity);
        if mesh.get::<Views>() != Some(&views) {
            mesh.insert(views);
        }
    }
}

/// Adds the views of this instant, unless they are as before.
fn look(world: &mut World, seconds: f64, wanted: &mut EntityHashMap<Vec<View>>) {
    let size = world.resource::<Settings>().0.size;
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let active = world.query_filtered::<Entity, With<ActiveCamera>>().iter(world).min();
    let mut cameras = world.query::<(Entity, &Camera, &WorldTransform, Option<&Keyframes>)>();
    let chosen = active.or_else(|| cameras.iter(world).map(|camera| camera.0).min());
    let Some((_, camera, pose, keyframes)) = chosen.and_then(|e| cameras.get(world, e).ok()) else {
        return;
    };
    let pixel = if let Some(across) = camera.orthographic {
        (across / height, 0.0)
    } else {
        let fov = evaluate_fov_at(seconds, camera, keyframes, size);
        perspective_pixel((0.5 * fov.to_radians()).tan(), height, width / height)
    };
    let camera_from_world = pose.0.inverse();
    let mut shapes = world.query::<(Entity, &Shape, &WorldTransform)>();
    let mut seen: Vec<_> = shapes
        .iter(world)
        .filter_map(|(entity, shape, pose)| match shape {
            Shape::Mesh(mesh) if wanted.contains_key(mesh) => Some((entity, *mesh, pose.0)),
            _ => None,
        })
        .collect();
    seen.sort_by_key(|(entity, ..)| *entity);
    for (_, mesh, world_from_mesh) in seen {
        let view = View { camera_from_mesh: camera_from_world * world_from_mesh, pixel };
        let views = wanted.entry(mesh).or_default();
        if !views.contains(&view) {
            views.push(view);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Clock, Relief, TriangleMesh};
    use crate::frame::Simulation;
    use crate::world::{Transform, Velocity};
    use glam::DVec3;
    use std::sync::Arc;

    /// A world in which a mesh is seen, by a camera that comes nearer by a metre in each frame.
    fn approached(adaptive: bool) -> (Simulation, Entity) {
        let mut simulation = Simulation::new();
        let world = simulation.world_mut();
        let clock = Clock { fps: 1.0, frames: (0, 3), shutter: (0.0, 0.0) };
        world.insert_resource(FrameClock { clock, frame: 0 });
        let positions = vec![glam::Vec3::ZERO, glam::Vec3::X, glam::Vec3::Y];
        let mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2]], ..Default::default() };
        let texture = world.spawn_empty().id();
        let displacement =
            Displacement { texture, says: Relief::Height, strength: 0.0, middle: 0.0, adaptive };
        let mesh = world.spawn((Mesh::new(Arc::new(mesh)), displacement)).id();
        world.spawn(Shape::Mesh(mesh));
        let translation = DVec3::Z * 10.0;
        world.spawn((
            Camera::default(),
            Transform { translation, ..Default::default() },
            Velocity { linear: DVec3::NEG_Z, angular: DVec3::ZERO },
        ));
        (simulation, mesh)
    }

    /// Oracle: where the camera is in each frame. It is the same whichever frame is made first, and the instant of the
    /// world is not disturbed.
    #[test]
    fn a_mesh_is_seen_from_all_frames() {
        for first in [0, 2] {
            let (mut simulation, mesh) = approached(true);
            simulation.world_mut().resource_mut::<FrameClock>().frame = first;
            survey_views(simulation.world_mut());
            let views = &simulation.world().get::<Views>(mesh).expect("a survey").list;
            let distances: Vec<f64> =
                views.iter().map(|view| -view.camera_from_mesh.translation.z).collect();
            assert_eq!(distances, [10.0, 9.0, 8.0, 7.0]);
            assert_eq!(simulation.world().resource::<SceneTime>().seconds, 0.0);
        }
    }

    /// A mesh which is not divided is not looked at.
    #[test]
    fn what_stays_as_it_is_is_not_surveyed() {
        let (mut simulation, mesh) = approached(false);
        survey_views(simulation.world_mut());
        assert!(simulation.world().get::<Views>(mesh).is_none());
    }
}
