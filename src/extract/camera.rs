//! The camera of a frame: from a point on the film, a point on the lens and a time to a ray.
//!
//! Camera space has x to the right, y up and the view along −z. A thin lens at the origin images
//! the plane at axial distance `f` sharply: the ray from the lens point `l` goes through the point of
//! that plane which the ray through the centre of the lens meets (Pharr, Jakob, Humphreys 2023,
//! *Physically Based Rendering*, 4th ed., section 5.2.3).

use crate::description::Focus;
use crate::math::{Aabb, MotionTransform, Ray, TimeCurve};
use crate::sampling::warp::{square_to_disk, square_to_polygon};
use crate::step::ROUNDING;
use crate::world::{ActiveCamera, Camera, LookAt, Optics, Settings, ShutterMotion};
use bevy_ecs::prelude::*;
use glam::{DMat4, DVec2, DVec3, Vec2};

/// The world position, in metres, which is the origin of render space in this frame.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameOrigin(pub DVec3);

/// The camera which takes the picture.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct ViewCamera {
    /// Render space from camera space.
    pub motion: MotionTransform,
    /// World to camera at shutter opening.
    pub world_to_camera: DMat4,
    /// Width and height of the picture in pixels.
    pub size: (u32, u32),
    pub(super) projection: Projection,
    /// Radius of the lens in metres.
    pub(super) lens_radius: TimeCurve,
    /// Axial distance of the plane in focus; infinite for parallel rays.
    pub(super) focus: TimeCurve,
    pub(super) blades: u32,
    pub(super) blade_rotation: f64,
    /// What the user should know about this camera.
    pub warning: Option<String>,
    /// That the camera is focused on an entity which stands nowhere, in words.
    pub dangling: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Projection {
    /// Tangent of half the vertical field of view.
    Perspective { tan_half_fov: TimeCurve },
    /// Half the height of the field in metres.
    Orthographic { half_height: f64 },
}

impl Default for ViewCamera {
    fn default() -> Self {
        Self {
            motion: MotionTransform::new(&[]),
            world_to_camera: DMat4::IDENTITY,
            size: (1, 1),
            projection: Projection::Perspective { tan_half_fov: TimeCurve::constant(1.0) },
            lens_radius: TimeCurve::constant(0.0),
            focus: TimeCurve::constant(f64::INFINITY),
            blades: 0,
            blade_rotation: 0.0,
            warning: None,
            dangling: None,
        }
    }
}

/// A ray through the film, and how depth along the axis is measured on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// The ray in render space.
    pub ray: Ray,
    /// Unit vector of the camera's axis in render space.
    pub axis: DVec3,
}

impl ViewCamera {
    /// Whether camera rays need a point on a lens.
    pub fn has_lens(&self) -> bool {
        self.lens_radius.values().any(|radius| radius > 0.0)
    }

    /// Whether the camera is the same during the whole shutter. A pinhole has no focus to change.
    pub fn is_static(&self) -> bool {
        let zooms = match &self.projection {
            Projection::Perspective { tan_half_fov } => !tan_half_fov.is_constant(),
            Projection::Orthographic { .. } => false,
        };
        let refocuses = self.has_lens() && !self.focus.is_constant();
        self.motion.is_static() && !zooms && !refocuses
    }

    /// A box around all points where its rays begin, in render space; of a moving camera as a row of
    /// times finds it.
    pub fn reach(&self) -> Aabb {
        const TIMES: u16 = 8;
        let aspect = f64::from(self.size.0) / f64::from(self.size.1);
        let radius = self.lens_radius.values().fold(0.0, f64::max);
        let half = match &self.projection {
            Projection::Perspective { .. } => DVec2::ZERO,
            Projection::Orthographic { half_height } => {
                DVec2::new(half_height * aspect, *half_height)
            }
        };
        let half = (half + radius).extend(0.0).as_vec3();
        let lens = Aabb { min: -half, max: half };
        let times = if self.motion.is_static() { 0..=0 } else { 0..=TIMES };
        times
            .map(|k| lens.transformed(&self.motion.at(f32::from(k) / f32::from(TIMES))))
            .fold(Aabb::EMPTY, Aabb::union)
    }

    /// The ray through the film point `film` (pixels, x right, y down, (0, 0) the corner of the upper
    /// left pixel) and the lens point drawn by `lens` in `[0, 1)²`, at `time` in `[0, 1]`.
    pub fn ray(&self, film: DVec2, lens: Vec2, time: f32) -> CameraRay {
        let radius = self.lens_radius.at(f64::from(time));
        let on_lens = if radius > 0.0 { self.lens_point(lens) * radius } else { DVec2::ZERO };
        self.ray_from(film, on_lens, time)
    }

    /// The ray through a film point and the middle of the lens.
    pub fn ray_through_centre(&self, film: DVec2, time: f32) -> CameraRay {
        self.ray_from(film, DVec2::ZERO, time)
    }

    /// The ray through a film point and a point of the lens in metres.
    fn ray_from(&self, film: DVec2, on_lens: DVec2, time: f32) -> CameraRay {
        let u = f64::from(time);
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        // −1…1 from bottom to top, the same unit across
        let plane = DVec2::new(2.0 * film.x - width, height - 2.0 * film.y) / height;
        let (origin, direction) = match &self.projection {
            Projection::Perspective { tan_half_fov } => {
                (DVec3::ZERO, (plane * tan_half_fov.at(u)).extend(-1.0))
            }
            Projection::Orthographic { half_height } => {
                ((plane * *half_height).extend(0.0), DVec3::NEG_Z)
            }
        };
        let (origin, direction) = if on_lens == DVec2::ZERO {
            (origin, direction)
        } else {
            let on_lens = on_lens.extend(0.0);
            let focus = self.focus.at(u);
            // direction.z = −1: the point in focus is focus·direction. Divided by focus, so that an
            // infinite distance gives parallel rays.
            (origin + on_lens, direction - on_lens / focus)
        };
        let m = self.motion.at(time);
        let ray = Ray {
            o: m.transform_point3(origin).as_vec3(),
            d: m.transform_vector3(direction).normalize().as_vec3(),
            time,
        };
        CameraRay { ray, axis: m.transform_vector3(DVec3::NEG_Z).normalize() }
    }

    fn lens_point(&self, u: Vec2) -> DVec2 {
        if self.blades >= 3 {
            let p = square_to_polygon(u, self.blades).as_dvec2();
            DVec2::from_angle(self.blade_rotation.to_radians()).rotate(p)
        } else {
            square_to_disk(u).as_dvec2()
        }
    }

    /// How large a pixel is: its side at the camera, metres, and by how much it grows with each metre of
    /// distance.
    pub fn pixel_size(&self, time: f32) -> (f64, f64) {
        let height = f64::from(self.size.1);
        match &self.projection {
            Projection::Perspective { tan_half_fov } => {
                (0.0, 2.0 * tan_half_fov.at(f64::from(time)) / height)
            }
            Projection::Orthographic { half_height } => (2.0 * half_height / height, 0.0),
        }
    }

    /// The ray at `time` which ends at a point of render space, from the middle of the lens, and its length in metres.
    pub fn ray_to(&self, p: DVec3, time: f32) -> (Ray, f64) {
        let m = self.motion.at(time);
        let axis = m.transform_vector3(DVec3::NEG_Z).normalize();
        let origin = match &self.projection {
            Projection::Perspective { .. } => m.translation,
            Projection::Orthographic { .. } => p - axis * (p - m.translation).dot(axis),
        };
        let (d, distance) = (p - origin).normalize_and_length();
        let d = if distance > 0.0 { d } else { axis };
        (Ray { o: origin.as_vec3(), d: d.as_vec3(), time }, distance)
    }

    /// Where a point of render space appears on the film at `time`, in pixels; `None` behind the
    /// camera.
    pub fn project(&self, p: DVec3, time: f32) -> Option<DVec2> {
        self.on_film(self.motion.inverse_at(time).transform_point3(p), time)
    }

    /// The same for what is infinitely far away in a direction; `None` for an orthographic camera, to which that is nowhere.
    pub fn project_direction(&self, d: DVec3, time: f32) -> Option<DVec2> {
        match &self.projection {
            Projection::Perspective { .. } => {
                self.on_film(self.motion.inverse_at(time).transform_vector3(d), time)
            }
            Projection::Orthographic { .. } => None,
        }
    }

    /// Where a point of camera space appears on the film.
    fn on_film(&self, q: DVec3, time: f32) -> Option<DVec2> {
        let plane = match &self.projection {
            Projection::Perspective { tan_half_fov } => {
                if q.z >= 0.0 {
                    return None;
                }
                q.truncate() / (-q.z * tan_half_fov.at(f64::from(time)))
            }
            Projection::Orthographic { half_height } => q.truncate() / *half_height,
        };
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        Some(DVec2::new(0.5 * (plane.x * height + width), 0.5 * (height - plane.y * height)))
    }
}

/// Writes [`FrameOrigin`] and [`ViewCamera`] from the active camera, or from the only one.
///
/// Without a camera both keep their values; the frame's driver reports that as an error.
pub fn extract_camera(
    settings: Res<Settings>,
    cameras: Query<(Entity, &Camera, &ShutterMotion, Option<&Optics>, Option<&LookAt>)>,
    active: Query<Entity, With<ActiveCamera>>,
    targets: Query<&ShutterMotion>,
    mut origin: ResMut<FrameOrigin>,
    mut view: ResMut<ViewCamera>,
) {
    let chosen = active.iter().min().or_else(|| cameras.iter().map(|c| c.0).min());
    let Some((_, camera, motion, optics, look_at)) = chosen.and_then(|e| cameras.get(e).ok())
    else {
        return;
    };
    let Some(opening) = motion.keys.first() else { return };
    let here = opening.translation;
    let moved: Vec<_> = motion
        .keys
        .iter()
        .map(|key| {
            let mut key = *key;
            key.translation -= here;
            key
        })
        .collect();
    let fov_deg = optics.map_or_else(
        || TimeCurve::constant(camera.vertical_fov(settings.0.size)),
        |optics| optics.fov_deg.clone(),
    );
    let mut warning = None;
    let keyed = optics.and_then(|optics| optics.focus.clone());
    let focus = match (keyed, camera.focus, look_at) {
        (Some(focus), _, _) => focus,
        (None, Some(Focus::Distance(metres)), _) => TimeCurve::constant(metres),
        (None, Some(Focus::Entity(target)), _) => {
            axial_distances(motion, targets.get(target).unwrap_or(&ShutterMotion::default()))
        }
        (None, None, Some(aim)) => TimeCurve::constant((aim.target - here).length()),
        (None, None, None) => TimeCurve::constant(f64::INFINITY),
    };
    let dangling = match camera.focus {
        Some(Focus::Entity(target)) if !targets.contains(target) => {
            Some(format!("the camera is focused on {target}, which stands nowhere"))
        }
        _ => None,
    };
    let lens_radius = fov_deg.map(|fov| camera.lens_radius(fov));
    if lens_radius.values().any(|r| r > 0.0) && focus.values().any(|f| f <= 0.0) {
        warning = Some("the camera is focused on something behind it: nothing is sharp".to_owned());
    }
    let projection = match camera.orthographic {
        Some(height) => Projection::Orthographic { half_height: 0.5 * height },
        None => Projection::Perspective {
            tan_half_fov: fov_deg.map(|fov| (fov.to_radians() * 0.5).tan()),
        },
    };
    origin.set_if_neq(FrameOrigin(here));
    view.set_if_neq(ViewCamera {
        motion: MotionTransform::through(&moved, motion.curved),
        world_to_camera: DMat4::from(*opening).inverse(),
        size: settings.0.size,
        projection,
        lens_radius,
        focus,
        blades: camera.blades,
        blade_rotation: camera.blade_rotation,
        warning,
        dangling,
    });
}

/// Distances along the camera's axis to the origin of a target, over the shutter; one where all are the same but for
/// the rounding of the places that they are between: a target may spin, or go across the axis.
fn axial_distances(camera: &ShutterMotion, target: &ShutterMotion) -> TimeCurve {
    const SEGMENTS: usize = 16;
    let [camera, target] = [camera, target].map(|m| MotionTransform::through(&m.keys, m.curved));
    let segments = if camera.is_static() && target.is_static() { 0 } else { SEGMENTS };
    let mut reach = 0.0_f64;
    let distances: Vec<f64> = (0..=segments)
        .map(|k| {
            let u = if segments == 0 { 0.0 } else { k as f32 / segments as f32 };
            let m = camera.at(u);
            let axis = m.transform_vector3(DVec3::NEG_Z).normalize();
            let target = target.at(u).translation;
            reach = reach.max(target.length()).max(m.translation.length());
            (target - m.translation).dot(axis)
        })
        .collect();
    TimeCurve::even(&distances).merged(ROUNDING * reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Extend, Interpolation, Key, Track};
    use crate::frame::Simulation;
    use crate::world::{ChildOf, FrameClock, Keyframes, Transform, Velocity};

    fn camera(fov_deg: f64, size: (u32, u32)) -> ViewCamera {
        let tan_half_fov = TimeCurve::constant((fov_deg.to_radians() * 0.5).tan());
        ViewCamera {
            size,
            projection: Projection::Perspective { tan_half_fov },
            ..Default::default()
        }
    }

    /// Oracle: a point in front of a pinhole, by the similar triangles of its film.
    #[test]
    fn points_appear_where_the_pinhole_puts_them() {
        let camera = camera(60.0, (1920, 1080));
        let p = DVec3::new(1.0, 0.5, -5.0);
        let film = camera.project(p, 0.0).expect("in front");
        assert!((film - DVec2::new(1_147.061_487, 446.469_256)).length() < 1e-5, "{film}");
        let ray = camera.ray(film, Vec2::ZERO, 0.3).ray;
        assert!((ray.d - p.normalize().as_vec3()).length() < 1e-6);
    }

    /// Oracle: a point at depth z spreads over a disk of diameter `A·|z − f|/z` on the plane in focus;
    /// in pixels 18.545 at z = 8 and 37.091 at z = 2.
    #[test]
    fn the_thin_lens_blurs_by_its_formula() {
        let mut camera = camera(40.0, (1920, 1080));
        camera.lens_radius = TimeCurve::constant(0.05);
        camera.focus = TimeCurve::constant(4.0);
        for (z, diameter) in [(8.0, 18.545_472_6), (2.0, 37.090_945_2)] {
            // The film points whose ray through the lens point l meets (0, 0, −z): by bisection.
            let mut widest = 0.0_f64;
            for k in 0..64 {
                let lens = Vec2::new((k as f32 + 0.5) / 64.0, 0.0);
                let l = square_to_disk(lens).as_dvec2() * 0.05;
                // through l and (0, 0, −z): on the plane at 4 it is at l·(1 − 4/z)
                let on_focus = l * (1.0 - 4.0 / z);
                let film = camera.project(on_focus.extend(-4.0), 0.0).expect("in front");
                let ray = camera.ray(film, lens, 0.0).ray;
                let t = z / f64::from(-ray.d.z);
                assert!(ray.at(t).truncate().length() < 1e-5, "the ray meets the point");
                widest = widest.max((film - DVec2::new(960.0, 540.0)).length());
            }
            assert!((2.0 * widest / diameter - 1.0).abs() < 1e-3, "{widest}");
        }
        // a far focus is an infinite one
        camera.focus = TimeCurve::constant(1e30);
        let near = camera.ray(DVec2::new(3.0, 7.0), Vec2::new(0.9, 0.2), 0.0);
        camera.focus = TimeCurve::constant(f64::INFINITY);
        assert_eq!(near, camera.ray(DVec2::new(3.0, 7.0), Vec2::new(0.9, 0.2), 0.0));
    }

    /// An orthographic camera has parallel rays, `height` metres apart from edge to edge.
    #[test]
    fn orthographic_rays_are_parallel() {
        let mut camera = camera(40.0, (200, 100));
        camera.projection = Projection::Orthographic { half_height: 1.5 };
        let top = camera.ray(DVec2::new(100.0, 0.0), Vec2::ZERO, 0.0).ray;
        let bottom = camera.ray(DVec2::new(100.0, 100.0), Vec2::ZERO, 0.0).ray;
        assert_eq!(top.d, bottom.d);
        assert!((top.o - bottom.o - glam::Vec3::Y * 3.0).length() < 1e-6);
    }

    /// Extreme fields of view still make finite unit directions.
    #[test]
    fn extreme_fields_of_view_are_finite() {
        for fov in [1e-4, 179.9] {
            let ray = camera(fov, (100, 100)).ray(DVec2::ZERO, Vec2::ZERO, 0.0).ray;
            assert!((ray.d.length() - 1.0).abs() < 1e-6);
        }
    }

    /// The camera of a world, half way through a second, with a shutter of half a second.
    fn seen_from(spawn: impl FnOnce(&mut World)) -> ViewCamera {
        let mut simulation = Simulation::new();
        let world = simulation.world_mut();
        let mut clock = FrameClock::default();
        (clock.clock.fps, clock.clock.shutter) = (1.0, (0.5, 1.0));
        world.insert_resource(clock);
        spawn(world);
        simulation.prepare_frame(0).expect("a camera");
        simulation.world().resource::<ViewCamera>().clone()
    }

    fn place(x: f64, y: f64, z: f64) -> Transform {
        Transform { translation: DVec3::new(x, y, z), ..Default::default() }
    }

    /// A camera with a lens at z = 3 m, focused on something at `at` m along x, which moves like this.
    fn focused(at: f64, linear: DVec3, angular: DVec3, aperture: f64) -> ViewCamera {
        seen_from(|world| {
            let target = world.spawn((place(at, 0.1, 0.7), Velocity { linear, angular })).id();
            let focus = Some(Focus::Entity(target));
            let camera = crate::world::Camera { aperture, focus, ..Default::default() };
            world.spawn((camera, place(0.3, 0.1, 3.0)));
        })
    }

    /// What spins, or goes across the axis, is in focus at one distance; what comes nearer is not, but a pinhole does not
    /// mind.
    #[test]
    fn a_camera_focused_on_what_keeps_its_distance_stands_still() {
        let spin = DVec3::new(0.3, 7.0, 0.1);
        assert!(focused(0.3, DVec3::ZERO, spin, 0.1).is_static());
        assert!(focused(0.3, DVec3::new(0.7, -0.1, 0.0), spin, 0.1).is_static());
        assert!(!focused(0.3, DVec3::Z * 0.01, DVec3::ZERO, 0.1).is_static());
        assert!(focused(0.3, DVec3::Z * 0.01, DVec3::ZERO, 0.0).is_static());
    }

    fn constant<T: Copy>(value: T, interpolation: Interpolation) -> Track<T> {
        let key = |time| Key { time, value, tangents: None };
        Track { keys: vec![key(0.0), key(1.7)], interpolation, extend: Extend::Hold }
    }

    /// Between equal keys nothing moves, however `a·(1 − s) + a·s` rounds.
    #[test]
    fn a_camera_whose_keys_are_equal_stands_still() {
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let p = DVec3::new(0.1, 0.7, 1e3 / 3.0);
            let translation = Some(constant(p, interpolation));
            let fov = Some(constant(33.3, interpolation));
            let focus = Some(constant(0.7, interpolation));
            let keys = Keyframes { translation, fov, focus, ..Default::default() };
            let camera = seen_from(|world| {
                let camera = crate::world::Camera { aperture: 0.1, ..Default::default() };
                let parent = world.spawn(place(0.1, 0.2, 0.3)).id();
                world.spawn((camera, keys, place(0.3, 0.1, 3.0), ChildOf(parent)));
            });
            assert!(camera.is_static(), "{interpolation:?}: {camera:?}");
        }
    }
}
