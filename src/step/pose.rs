//! The pose of an entity in its parent's frame at an instant, in closed form.
//!
//! From the inside out: what a matrix is beside its rotation, scale, the turn about a fixed axis, rotation, translation; velocity and
//! acceleration then add to it. With `x₀` and `R₀` of the transform or its tracks,
//!
//! ```text
//! x(t) = x₀(t) + v·t + ½·a·t²,      R(t) = exp(ω·t) · R₀(t) · turn(t)
//! ```
//!
//! A constant `ω` makes `exp(ω·t)` the rotation by `|ω|·t` about `ω`, exact at any time.

use crate::description::{Acceleration, Keyframes, LookAt, Track, Transform, Velocity};
use crate::math::TimeCurve;
use crate::world::{Camera, EmissionFactor, Light, LocalPose, Optics, SceneTime};
use bevy_ecs::prelude::*;
use bevy_ecs::query::QueryData;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Everything that decides the pose of an entity.
#[derive(QueryData, Debug)]
pub struct PoseInput {
    transform: &'static Transform,
    velocity: Option<&'static Velocity>,
    acceleration: Option<&'static Acceleration>,
    keyframes: Option<&'static Keyframes>,
    look_at: Option<&'static LookAt>,
    is_camera: Has<Camera>,
    is_light: Has<Light>,
}

/// What moves an entity by itself.
type Animated = Or<(With<Velocity>, With<Acceleration>, With<Keyframes>, With<LookAt>)>;
/// A change of an entity that nothing moves by itself.
type Edited = (
    Changed<Transform>,
    Without<Velocity>,
    Without<Acceleration>,
    Without<Keyframes>,
    Without<LookAt>,
);

/// Writes the [`LocalPose`] of every entity for the instant of [`SceneTime`].
///
/// What stands still is left untouched, so that `Changed<LocalPose>` downstream means "moved".
pub fn pose_moving_entities(
    time: Res<SceneTime>,
    mut animated: Query<(PoseInput, &mut LocalPose), Animated>,
    mut edited: Query<(&Transform, &mut LocalPose), Edited>,
) {
    for (input, mut pose) in &mut animated {
        let now = local_pose(
            time.seconds,
            input.transform,
            input.velocity,
            input.acceleration,
            input.keyframes,
            input.look_at.map(|aim| (aim, input.is_camera || input.is_light)),
        );
        pose.set_if_neq(LocalPose(now));
    }
    for (transform, mut pose) in &mut edited {
        let now = local_pose(time.seconds, transform, None, None, None, None);
        pose.set_if_neq(LocalPose(now));
    }
}

/// The pose in the parent's frame at `t` seconds.
///
/// `look_at` comes with whether the local −z is what looks (cameras and lights) instead of +z.
pub fn local_pose(
    t: f64,
    transform: &Transform,
    velocity: Option<&Velocity>,
    acceleration: Option<&Acceleration>,
    keyframes: Option<&Keyframes>,
    look_at: Option<(&LookAt, bool)>,
) -> DAffine3 {
    let Transform { mut translation, mut rotation, mut scale, stretch } = *transform;
    let mut turn = DQuat::IDENTITY;
    if let Some(keyframes) = keyframes {
        translation = keyframes.translation.as_ref().map_or(translation, |track| track.at(t));
        rotation = keyframes.rotation.as_ref().map_or(rotation, |track| track.at(t));
        scale = keyframes.scale.as_ref().map_or(scale, |track| track.at(t));
        if let Some(track) = &keyframes.turn {
            turn = DQuat::from_axis_angle(track.axis, track.angle.at(t));
        }
    }
    if let Some(velocity) = velocity {
        translation += velocity.linear * t;
        rotation = DQuat::from_scaled_axis(velocity.angular * t) * rotation;
    }
    if let Some(Acceleration(a)) = acceleration {
        translation += *a * (0.5 * t * t);
    }
    if let Some((aim, backwards)) = look_at {
        rotation = aimed(translation, aim, backwards).unwrap_or(rotation);
    }
    let mut pose = DAffine3::from_scale_rotation_translation(scale, rotation * turn, translation);
    if stretch != DMat3::IDENTITY {
        pose.matrix3 *= stretch;
    }
    pose
}

/// The rotation which points local +z, or −z when `backwards`, from `eye` at the target, with local
/// +y as near to `up` as that allows; `None` when the eye is at the target.
fn aimed(eye: DVec3, aim: &LookAt, backwards: bool) -> Option<DQuat> {
    let forward = (aim.target - eye).try_normalize()?;
    let z = if backwards { -forward } else { forward };
    // Looking straight along `up` leaves the roll open; any axis across will do.
    let x = aim.up.cross(z).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    Some(DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)))
}

/// The vertical field of view (degrees) of a camera at `t` seconds, for a picture of this size.
pub fn evaluate_fov_at(
    t: f64,
    camera: &Camera,
    keyframes: Option<&Keyframes>,
    size: (u32, u32),
) -> f64 {
    let keyed = keyframes.and_then(|keys| keys.fov.as_ref());
    keyed.map_or_else(|| camera.vertical_fov(size), |track| track.at(t))
}

/// An upper bound of the angular speed of the pose in its parent's frame, radians per second.
pub(super) fn angular_speed_bound(
    velocity: Option<&Velocity>,
    keyframes: Option<&Keyframes>,
) -> f64 {
    let spin = velocity.map_or(0.0, |v| v.angular.length());
    let keyed = keyframes.map_or(0.0, |k| {
        k.rotation.as_ref().map_or(0.0, Track::fastest)
            + k.turn.as_ref().map_or(0.0, |turn| turn.angle.fastest())
    });
    spin + keyed
}

/// The mean of the keyed emission factor over the shutter `[open, close]`, seconds: exactly, see [`Track::mean`].
pub(super) fn mean_emission_factor(
    keyframes: &Keyframes,
    open: f64,
    close: f64,
) -> Option<EmissionFactor> {
    Some(EmissionFactor(keyframes.emission.as_ref()?.mean(open, close)))
}

/// The field of view and the focus of a camera over the shutter `[open, close]`, seconds.
pub(super) fn optics_over(
    open: f64,
    close: f64,
    camera: &Camera,
    keyframes: Option<&Keyframes>,
    size: (u32, u32),
) -> Optics {
    /// Lines for each piece of a track that bends.
    const SEGMENTS: u32 = 16;
    let over = |track: &Track<f64>| {
        let curve = track.curve(open, close, SEGMENTS);
        let size = curve.values().fold(0.0, f64::max);
        curve.merged(super::ROUNDING * size)
    };
    let fov = keyframes.and_then(|keys| keys.fov.as_ref());
    Optics {
        fov_deg: fov.map_or_else(|| TimeCurve::constant(camera.vertical_fov(size)), over),
        focus: keyframes.and_then(|keys| keys.focus.as_ref()).map(over),
    }
}

/// The shortest time between two keys of a pose in a span, see [`Track::shortest_gap`].
pub(super) fn shortest_gap(keyframes: &Keyframes, span: [f64; 2], least: f64) -> Option<f64> {
    let Keyframes { translation, rotation, turn, scale, .. } = keyframes;
    let gaps = [
        translation.as_ref().and_then(|track| track.shortest_gap(span, least)),
        rotation.as_ref().and_then(|track| track.shortest_gap(span, least)),
        turn.as_ref().and_then(|turn| turn.angle.shortest_gap(span, least)),
        scale.as_ref().and_then(|track| track.shortest_gap(span, least)),
    ];
    gaps.into_iter().flatten().reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: the parabola of a thrown body.
    #[test]
    fn velocity_and_acceleration_make_a_parabola() {
        let velocity = Velocity { linear: DVec3::new(2.0, 3.0, 0.0), ..Velocity::default() };
        let fall = Acceleration(DVec3::new(0.0, -9.81, 0.0));
        let start = Transform { translation: DVec3::new(0.0, 1.0, 0.0), ..Transform::default() };
        for t in [0.0, 0.25, 1.5] {
            let pose = local_pose(t, &start, Some(&velocity), Some(&fall), None, None);
            let expected = DVec3::new(2.0 * t, 1.0 + 3.0 * t - 4.905 * t * t, 0.0);
            assert!((pose.translation - expected).length() < 1e-14, "t = {t}");
        }
    }

    /// Oracle: the frame of a camera which looks down from above.
    #[test]
    fn a_camera_aims_minus_z_and_a_lamp_plus_z() {
        let at = Transform { translation: DVec3::new(0.0, 4.0, 0.0), ..Transform::default() };
        let aim = LookAt { target: DVec3::ZERO, up: DVec3::Y };
        for (backwards, axis) in [(true, -DVec3::Z), (false, DVec3::Z)] {
            let pose = local_pose(0.0, &at, None, None, None, Some((&aim, backwards)));
            let looks = pose.transform_vector3(axis);
            assert!((looks - DVec3::NEG_Y).length() < 1e-12, "{looks}");
            assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-12, "a rotation, not a mirror");
        }
    }

    /// The system touches only what moves.
    #[test]
    fn entities_at_rest_do_not_change() {
        let mut world = World::new();
        world.insert_resource(SceneTime::default());
        let still = world.spawn(Transform::default()).id();
        let spin = Velocity { angular: DVec3::Y, ..Velocity::default() };
        let moving = world.spawn(spin).id();
        let mut schedule = Schedule::default();
        schedule.add_systems(pose_moving_entities);
        schedule.run(&mut world);
        world.clear_trackers();
        world.resource_mut::<SceneTime>().seconds = 0.5;
        schedule.run(&mut world);
        let turned = world.get::<LocalPose>(moving).expect("spawned above").0;
        let z = turned.transform_vector3(DVec3::Z);
        assert!((z - DVec3::new(0.5_f64.sin(), 0.0, 0.5_f64.cos())).length() < 1e-14);
        let mut changed = world.query_filtered::<Entity, Changed<LocalPose>>();
        let changed: Vec<_> = changed.iter(&world).collect();
        assert!(changed.contains(&moving) && !changed.contains(&still));
    }
}
