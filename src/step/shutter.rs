//! As many poses over the shutter as a motion needs.
//!
//! The pose systems are asked at evenly spaced times from opening to closing. An entity keeps the
//! smallest number of segments (a power of two) whose interpolation, [`Decomposed::interpolate`],
//! passes through all the other samples within a tolerance: one key for what stands still, two for
//! a straight line or a uniform rotation, three and a curve for even acceleration, more for an arc. While some entity
//! is not satisfied the grid is doubled.
//!
//! Sampling alone cannot see whole turns: a wheel which makes one turn between two samples looks at
//! rest. The angular speeds of velocities and tracks, summed along the ancestors, are therefore
//! turned into a least number of segments of at most 30°. Nor can they see what happens between two keys that lie
//! closer than they do: the first grid has a sample on either side of every key.

use super::pose::{angular_speed_bound, mean_emission_factor, optics_over, shortest_gap};
use crate::math::{Decomposed, curve_slopes, place_between};
use crate::world::{
    Camera, ChildOf, Children, EmissionFactor, FrameClock, Keyframes, Optics, SceneTime, Settings,
    ShutterMotion, Velocity, WorldTransform,
};
use bevy_ecs::entity::{EntityHashMap, EntityHashSet};
use bevy_ecs::prelude::*;
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

/// The widest rotation between two keys for which a path of nearly one turn cannot be mistaken for
/// a small one in the other direction.
const WIDEST_TURN: f64 = std::f64::consts::PI / 6.0;
/// Segments of the coarsest grid; three samples lie between the ends.
const COARSEST_GRID: usize = 4;
/// Segments of the finest grid. A motion which needs more is given these.
const FINEST_GRID: usize = 4096;
/// Motions that one thread fits keys to before it is worth asking another.
const FITTED_AT_ONCE: usize = 64;
/// Motion below this share of a coordinate is rounding noise of the matrix products in `f64`.
const NOISE: f64 = f64::EPSILON * 4096.0;

/// What differs by less than this share of a coordinate is the same. Values between equal keys and each product in a chain of
/// parents round a handful of times, by ε/2 each: room for chains of some ten. It is less than [`NOISE`], which is no more
/// than a part of a motion that is kept, for what is below is not seen to move at all.
pub(crate) const ROUNDING: f64 = f64::EPSILON * 64.0;

/// Runs the pose systems over the shutter and writes [`ShutterMotion`], [`Optics`] and
/// [`EmissionFactor`] where they are different from before.
///
/// Afterwards the world stands as it does when the shutter opens. What rests now and rested in the frame
/// before is not looked at.
pub fn sample_shutter(world: &mut World) {
    let (open, close) = world.resource::<FrameClock>().shutter();
    let tolerance = world.resource::<Settings>().0.motion_tolerance;
    let least = least_segments(world, close - open);
    let most_turning = least.values().copied().max().unwrap_or(1);
    let mut grid = if close > open {
        let between_keys = segments_between_keys(world, open, close);
        (2 * most_turning.next_power_of_two().max(between_keys)).clamp(COARSEST_GRID, FINEST_GRID)
    } else {
        0
    };
    let mut samples = Samples::of_unsettled(world);
    let motions = loop {
        samples.take(world, open, close, grid);
        let motions = samples.motions(&least, tolerance);
        if grid >= FINEST_GRID || motions.iter().all(|fit| fit.known) {
            break motions;
        }
        grid *= 2;
    };
    for (entity, fit) in samples.entities.into_iter().zip(motions) {
        // An entity which was not there at every time has no keys.
        if !fit.motion.keys.is_empty()
            && let Some(mut motion) = world.get_mut::<ShutterMotion>(entity)
        {
            motion.set_if_neq(fit.motion);
        }
    }
    sample_optics(world, open, close);
    sample_emission(world, open, close);
}

/// The poses at evenly spaced times of everything that is not known to rest.
struct Samples {
    /// The entities, in the order in which they were noticed.
    entities: Vec<Entity>,
    known: EntityHashSet,
    /// For each entity its pose at each time; fewer for one which was not always there.
    poses: Vec<Vec<DAffine3>>,
}

impl Samples {
    /// What is new, and what moved in the frame before: it may have come to rest.
    fn of_unsettled(world: &mut World) -> Self {
        let mut motions = world.query::<(Entity, &ShutterMotion)>();
        let unsettled = motions.iter(world).filter(|(_, motion)| motion.keys.len() != 1);
        let entities: Vec<Entity> = unsettled.map(|(entity, _)| entity).collect();
        let known = entities.iter().copied().collect();
        let poses = vec![Vec::new(); entities.len()];
        Self { entities, known, poses }
    }

    /// Asks the pose systems at `grid + 1` times from `open` to `close`, or at the opening alone when
    /// `grid` is 0, and remembers what has changed since the step stage ran last.
    fn take(&mut self, world: &mut World, open: f64, close: f64, grid: usize) {
        let mut changed = world.query_filtered::<Entity, Changed<WorldTransform>>();
        self.poses.iter_mut().for_each(Vec::clear);
        // Backwards, so that the world is left at the opening.
        for (asked, k) in (0..=grid).rev().enumerate() {
            let share = if grid == 0 { 0.0 } else { k as f64 / grid as f64 };
            world.resource_mut::<SceneTime>().seconds = open + (close - open) * share;
            world.run_schedule(super::Pose);
            for entity in changed.iter(world) {
                if self.known.insert(entity) {
                    self.entities.push(entity);
                    self.poses.push(settled(world, entity, asked));
                }
            }
            for (entity, poses) in self.entities.iter().zip(&mut self.poses) {
                poses.extend(world.get::<WorldTransform>(*entity).map(|pose| pose.0));
            }
        }
        for poses in &mut self.poses {
            if poses.len() == grid + 1 {
                poses.reverse();
            } else {
                poses.clear();
            }
        }
    }

    /// For each entity the poses to keep; none for one which was not there at every time.
    fn motions(&self, least: &EntityHashMap<usize>, tolerance: f64) -> Vec<Fit> {
        self.entities
            .par_iter()
            .zip(&self.poses)
            .with_min_len(FITTED_AT_ONCE)
            .map(|(entity, poses)| {
                let least = least.get(entity).copied().unwrap_or(1);
                match poses.split_first() {
                    None => Fit::known(Vec::new(), false),
                    Some((here, _)) if least <= 1 && rests(poses) => Fit::known(vec![*here], false),
                    Some(_) => fewest_keys(poses, least, tolerance),
                }
            })
            .collect()
    }
}

/// The poses at the times asked for so far of an entity which only now moves for the first time in this
/// frame: where the frame before left it, as its only key says. None for one which was not there.
fn settled(world: &World, entity: Entity, asked: usize) -> Vec<DAffine3> {
    match world.get::<ShutterMotion>(entity).map(|motion| motion.keys.as_slice()) {
        Some([here]) => vec![*here; asked],
        _ => Vec::new(),
    }
}

/// The least number of segments for the turns of each entity that turns, its ancestors included.
fn least_segments(world: &mut World, duration: f64) -> EntityHashMap<usize> {
    let mut turning = world.query_filtered::<
        (Entity, Option<&Velocity>, Option<&Keyframes>),
        Or<(With<Velocity>, With<Keyframes>)>,
    >();
    let own: EntityHashMap<f64> = turning
        .iter(world)
        .map(|(entity, velocity, keys)| (entity, angular_speed_bound(velocity, keys)))
        .filter(|(_, speed)| *speed > 0.0)
        .collect();
    let mut least = EntityHashMap::default();
    for &root in own.keys() {
        let mut carried = vec![root];
        while let Some(entity) = carried.pop() {
            let speed = speed_with_ancestors(world, &own, entity);
            let segments = (speed * duration / WIDEST_TURN).ceil();
            if segments > 1.0 {
                least.insert(entity, segments.min(FINEST_GRID as f64) as usize);
            }
            if let Some(children) = world.get::<Children>(entity) {
                // A child that turns by itself is a root of its own.
                carried.extend(children.iter().filter(|child| !own.contains_key(child)));
            }
        }
    }
    least
}

/// The sum of the angular speeds along the ancestors, from the entity up.
fn speed_with_ancestors(world: &World, own: &EntityHashMap<f64>, entity: Entity) -> f64 {
    let mut speed = 0.0;
    let mut ancestor = Some(entity);
    while let Some(current) = ancestor {
        speed += own.get(&current).copied().unwrap_or(0.0);
        ancestor = world.get::<ChildOf>(current).map(ChildOf::parent);
    }
    speed
}

/// Whether the poses are the same but for rounding, as those between equal keys are.
fn rests(poses: &[DAffine3]) -> bool {
    let here = &poses[0];
    if poses.iter().all(|pose| pose == here) {
        return true;
    }
    let noise = Allowance::of(poses, 0.0, ROUNDING);
    poses.iter().all(|pose| noise.covers(here, pose))
}

/// The poses to keep of a motion.
struct Fit {
    motion: ShutterMotion,
    /// Whether they describe it within the tolerance.
    known: bool,
}

impl Fit {
    fn known(keys: Vec<DAffine3>, curved: bool) -> Self {
        Self { motion: ShutterMotion { keys, curved }, known: true }
    }
}

/// The poses to keep.
fn fewest_keys(poses: &[DAffine3], least: usize, tolerance: f64) -> Fit {
    let grid = poses.len() - 1;
    let allowed = Allowance::of(poses, tolerance, NOISE);
    let split: Vec<Decomposed> = poses.iter().map(Decomposed::new).collect();
    let mut segments = least.next_power_of_two().min(grid);
    // A grid that is used up has no samples left to test against.
    while segments < grid {
        let stride = grid / segments;
        let kept = || poses.iter().step_by(stride).copied();
        let fits = |slopes: &[DVec3]| {
            (0..grid).all(|k| {
                let (a, between) = (k / stride * stride, k % stride);
                if between == 0 {
                    return true;
                }
                let (ends, share) = ([a, a + stride], between as f64 / stride as f64);
                let mut pose = split[ends[0]].interpolate(&split[ends[1]], share);
                if !slopes.is_empty() {
                    let slopes = ends.map(|end| slopes[end / stride]);
                    let places = ends.map(|end| poses[end].translation);
                    pose.translation = place_between(places, Some(slopes), share);
                }
                allowed.covers(&pose, &poses[k])
            })
        };
        if fits(&[]) {
            return Fit::known(kept().collect(), false);
        }
        // A curve bends as its keys ask: that it does so between them three samples must confirm.
        if stride >= 4 && segments >= 2 {
            let places: Vec<DVec3> = kept().map(|pose| pose.translation).collect();
            if fits(&curve_slopes(&places)) {
                return Fit::known(kept().collect(), true);
            }
        }
        segments *= 2;
    }
    Fit { known: false, ..Fit::known(poses.to_vec(), false) }
}

/// How many segments of the shutter are as short as the time between two neighbouring keys of a pose, where keys are within
/// it, a power of two; keys that are closer than the finest grid do not count.
fn segments_between_keys(world: &mut World, open: f64, close: f64) -> usize {
    let mut keyed = world.query::<&Keyframes>();
    let least = (close - open) / FINEST_GRID as f64;
    let gaps = keyed.iter(world).filter_map(|keys| shortest_gap(keys, [open, close], least));
    let gap = gaps.fold(close - open, f64::min);
    (((close - open) / gap).ceil() as usize).next_power_of_two().min(FINEST_GRID)
}

/// How far an interpolated pose may lie from the true one.
struct Allowance {
    translation: f64,
    linear: f64,
}

impl Allowance {
    fn of(poses: &[DAffine3], tolerance: f64, noise: f64) -> Self {
        let first = poses[0];
        let mut moved = (0.0_f64, 0.0_f64);
        let mut size = (0.0_f64, 0.0_f64);
        for pose in poses {
            moved.0 = moved.0.max(pose.translation.distance(first.translation));
            moved.1 = moved.1.max(largest(pose.matrix3 - first.matrix3));
            size.0 = size.0.max(pose.translation.length());
            size.1 = size.1.max(largest(pose.matrix3));
        }
        Self {
            translation: tolerance * moved.0 + noise * size.0,
            linear: tolerance * moved.1 + noise * size.1,
        }
    }

    fn covers(&self, interpolated: &DAffine3, true_pose: &DAffine3) -> bool {
        let translation: DVec3 = interpolated.translation - true_pose.translation;
        translation.length() <= self.translation
            && largest(interpolated.matrix3 - true_pose.matrix3) <= self.linear
    }
}

fn largest(m: DMat3) -> f64 {
    m.to_cols_array().into_iter().fold(0.0, |a, x| a.max(x.abs()))
}

/// Writes the [`Optics`] of every camera.
fn sample_optics(world: &mut World, open: f64, close: f64) {
    let size = world.resource::<Settings>().0.size;
    let mut cameras = world.query::<(Entity, &Camera, Option<&Keyframes>)>();
    let sampled: Vec<(Entity, Optics)> = cameras
        .iter(world)
        .map(|(entity, camera, keyframes)| {
            (entity, optics_over(open, close, camera, keyframes, size))
        })
        .collect();
    for (entity, optics) in sampled {
        if world.get::<Optics>(entity) != Some(&optics) {
            world.entity_mut(entity).insert(optics);
        }
    }
}

/// Writes the [`EmissionFactor`] of everything whose emission is keyed.
fn sample_emission(world: &mut World, open: f64, close: f64) {
    let mut keyed = world.query::<(Entity, &Keyframes)>();
    let factors: Vec<(Entity, EmissionFactor)> = keyed
        .iter(world)
        .filter_map(|(entity, keys)| Some((entity, mean_emission_factor(keys, open, close)?)))
        .collect();
    for (entity, factor) in factors {
        if world.get::<EmissionFactor>(entity) != Some(&factor) {
            world.entity_mut(entity).insert(factor);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Clock, RenderSettings, Transform};
    use crate::math::MotionTransform;
    use crate::step::PoseSystems;

    /// A world with the step stage alone, its shutter open for `seconds` from time 0.
    fn world_with_shutter(seconds: f64) -> (World, Schedule) {
        let mut world = World::new();
        let clock = Clock { fps: 1.0, frames: (0, 10), shutter: (0.0, seconds) };
        world.insert_resource(FrameClock { clock, frame: 0 });
        world.insert_resource(Settings(RenderSettings::default()));
        let mut frame = Schedule::default();
        crate::step::install(&mut world, &mut frame);
        (world, frame)
    }

    fn keys(world: &World, entity: Entity) -> &[DAffine3] {
        &world.get::<ShutterMotion>(entity).expect("every placed entity has one").keys
    }

    fn motion_of(world: &World, entity: Entity) -> MotionTransform {
        let motion = world.get::<ShutterMotion>(entity).expect("every placed entity has one");
        MotionTransform::through(&motion.keys, motion.curved)
    }

    /// One key at rest, two on a line and in a uniform rotation about the own origin.
    #[test]
    fn simple_motion_needs_few_keys() {
        let (mut world, mut frame) = world_with_shutter(0.5);
        let rest = world.spawn(Transform::default()).id();
        let line = world.spawn(Velocity { linear: DVec3::X, ..Velocity::default() }).id();
        let slow = Velocity { angular: DVec3::Y * 0.9, ..Velocity::default() };
        let turn = world.spawn(slow).id();
        frame.run(&mut world);
        assert_eq!(keys(&world, rest).len(), 1);
        assert_eq!(keys(&world, line).len(), 2);
        assert_eq!(keys(&world, turn).len(), 2);
        assert_eq!(keys(&world, line)[1].translation, DVec3::X * 0.5);
        // shutter closed: nothing moves
        world.resource_mut::<FrameClock>().clock.shutter = (0.0, 0.0);
        frame.run(&mut world);
        assert_eq!(keys(&world, line).len(), 1);
    }

    /// Even acceleration is a parabola: a curve through three keys, which meets it at every time. Oracle: `½·a·t²`.
    #[test]
    fn accelerated_motion_is_followed_within_the_tolerance() {
        let (mut world, mut frame) = world_with_shutter(1.0);
        let body = world.spawn(crate::world::Acceleration(DVec3::X * 2.0)).id();
        frame.run(&mut world);
        assert_eq!(keys(&world, body).len(), 3);
        let motion = motion_of(&world, body);
        for k in 0..=64_u8 {
            let u = f32::from(k) / 64.0;
            let x = f64::from(u * u);
            assert!((motion.at(u).translation.x - x).abs() < 1e-14, "u = {u}");
        }
    }

    /// Ten whole turns within the shutter are neither lost nor slowed down: every pose between the
    /// keys is the rotation by the true angle.
    #[test]
    fn whole_turns_are_counted() {
        let (mut world, mut frame) = world_with_shutter(0.5);
        let speed = 20.0 * std::f64::consts::TAU;
        let wheel = world.spawn(Velocity { angular: DVec3::Z * speed, ..Velocity::default() }).id();
        frame.run(&mut world);
        let motion = motion_of(&world, wheel);
        for k in 0..=997_u16 {
            let u = f32::from(k) / 997.0;
            let angle = speed * 0.5 * f64::from(u);
            let expected = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let got = motion.at(u).transform_vector3(DVec3::X);
            assert!((got - expected).length() < 1e-4, "u = {u}");
        }
    }

    /// Oracle: the same motion written as one entity. A wheel on a cart which accelerates.
    #[test]
    fn a_moving_child_of_a_moving_parent_equals_the_motion_flattened() {
        let (mut world, mut frame) = world_with_shutter(0.5);
        let cart = world
            .spawn((
                Velocity { linear: DVec3::X * 3.0, angular: DVec3::Y * 0.7 },
                crate::world::Acceleration(DVec3::X),
            ))
            .id();
        let wheel = world
            .spawn((
                Transform { translation: DVec3::new(0.0, 0.3, 1.0), ..Transform::default() },
                Velocity { angular: DVec3::Z * 9.0, ..Velocity::default() },
                ChildOf(cart),
            ))
            .id();
        frame.run(&mut world);
        let motion = motion_of(&world, wheel);
        for k in 0..=100_u8 {
            let u = f32::from(k) / 100.0;
            let t = 0.5 * f64::from(u);
            let cart = DAffine3::from_rotation_translation(
                glam::DQuat::from_rotation_y(0.7 * t),
                DVec3::X * (3.0 * t + 0.5 * t * t),
            );
            let own = DAffine3::from_rotation_translation(
                glam::DQuat::from_rotation_z(9.0 * t),
                DVec3::new(0.0, 0.3, 1.0),
            );
            let expected = cart * own;
            let p = DVec3::new(0.3, 0.0, 0.0);
            let error = motion.at(u).transform_point3(p) - expected.transform_point3(p);
            // the tolerance is 0.001 of the distance moved, at most 1.7 m here
            assert!(error.length() < 2.0e-3, "u = {u}: {error}");
        }
    }

    /// A system of a program moves things by writing transforms; it is asked at several instants and
    /// its blur follows the arc. Oracle: a pendulum stays on its circle.
    #[test]
    fn custom_systems_get_motion_blur() {
        #[derive(Component)]
        struct Pendulum;
        fn swing(time: Res<SceneTime>, mut bobs: Query<&mut Transform, With<Pendulum>>) {
            for mut bob in &mut bobs {
                let angle = (time.seconds * 4.0).cos();
                bob.translation = DVec3::new(angle.sin(), -angle.cos(), 0.0);
            }
        }
        let (mut world, mut frame) = world_with_shutter(0.5);
        world.schedule_scope(super::super::Pose, |_, poses| {
            poses.add_systems(swing.in_set(PoseSystems::Custom));
        });
        let bob = world.spawn((Transform::default(), Pendulum)).id();
        frame.run(&mut world);
        let motion = motion_of(&world, bob);
        assert!(!motion.is_static());
        for k in 0..=50_u8 {
            let p = motion.at(f32::from(k) / 50.0).translation;
            assert!((p.length() - 1.0).abs() < 2e-3, "{p}");
        }
        // the world is left at shutter opening
        let opening = world.get::<Transform>(bob).expect("spawned above").translation;
        assert!((opening - DVec3::new(1.0_f64.sin(), -1.0_f64.cos(), 0.0)).length() < 1e-12);
    }

    /// An entity that comes to rest has one key again, one that swings back to where it was included, and
    /// one that begins to move late in the shutter has its pose from before. Oracle: a world which
    /// sees only the frame.
    #[test]
    fn what_starts_and_what_stops_is_noticed() {
        #[derive(Component)]
        struct Knock;
        /// Moves in frame 0 and, late, in frame 2; rests in frame 1 where frame 0 began.
        fn knock(time: Res<SceneTime>, mut doors: Query<&mut Transform, With<Knock>>) {
            let t = time.seconds;
            let x = if t < 1.0 { t * (1.0 - t) } else { (t - 2.4).max(0.0) };
            for mut door in &mut doors {
                door.translation.x = x;
            }
        }
        let run = |frames: &[i32]| {
            let (mut world, mut schedule) = world_with_shutter(0.5);
            world.schedule_scope(super::super::Pose, |_, poses| {
                poses.add_systems(knock.in_set(PoseSystems::Custom));
            });
            let door = world.spawn((Transform::default(), Knock)).id();
            let handle = world.spawn((Transform::default(), ChildOf(door))).id();
            for &frame in frames {
                world.resource_mut::<FrameClock>().frame = frame;
                schedule.run(&mut world);
                world.clear_trackers();
            }
            [door, handle].map(|entity| keys(&world, entity).to_vec())
        };
        for frame in 0..3 {
            let alone = run(&[frame]);
            assert_eq!(alone[0].len() == 1, frame == 1, "frame {frame}");
            assert_eq!(alone, run(&(0..=frame).collect::<Vec<_>>()), "frame {frame}");
            assert_eq!(alone, run(&[2, 0, frame]), "frame {frame}");
        }
    }

    /// What rests is not written.
    #[test]
    fn a_body_which_moves_leaves_the_others_untouched() {
        let (mut world, mut schedule) = world_with_shutter(0.5);
        let still: Vec<Entity> = (0..5).map(|_| world.spawn(Transform::default()).id()).collect();
        let moving = world.spawn(Velocity { linear: DVec3::X, ..Velocity::default() }).id();
        schedule.run(&mut world);
        world.clear_trackers();
        world.resource_mut::<FrameClock>().frame = 1;
        schedule.run(&mut world);
        let mut changed = world.query_filtered::<Entity, Changed<ShutterMotion>>();
        assert_eq!(changed.iter(&world).collect::<Vec<_>>(), [moving]);
        let mut written = world.query_filtered::<Entity, Changed<WorldTransform>>();
        assert!(written.iter(&world).all(|entity| !still.contains(&entity)));
    }

    /// Frame 7 gives the same keys alone and after the frames before it.
    #[test]
    fn frames_do_not_depend_on_those_before() {
        let run = |frames: &[i32]| {
            let (mut world, mut schedule) = world_with_shutter(0.5);
            let spin = Velocity { linear: DVec3::Y, angular: DVec3::new(0.3, 2.0, 0.1) };
            let parent = world.spawn(spin).id();
            let body = world.spawn((spin, ChildOf(parent))).id();
            for &frame in frames {
                world.resource_mut::<FrameClock>().frame = frame;
                schedule.run(&mut world);
                world.clear_trackers();
            }
            keys(&world, body).to_vec()
        };
        assert_eq!(run(&[7]), run(&[0, 3, 7]));
    }
}
