//! The camera of a frame as files tell it to other programs.

use super::FrameOrigin;
use super::camera::{Projection, ViewCamera};
use crate::description::SENSOR_HEIGHT;
use glam::{DAffine3, DMat4, DVec4};
use serde::{Deserialize, Serialize};

/// The camera at the opening and the closing of the shutter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraFacts {
    /// When the shutter opens.
    pub opening: CameraState,
    /// When it closes.
    pub closing: CameraState,
    /// Blades of the diaphragm; 0 is round.
    pub blades: u32,
    /// Turns the diaphragm, degrees.
    pub blade_rotation: f64,
}

/// The camera at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraState {
    /// World to camera, column-major, metres. The camera looks along its −z, +y is up.
    pub world_to_camera: [f64; 16],
    /// Horizontal and vertical field of view in degrees; `None` for an orthographic camera.
    pub fov_deg: Option<(f64, f64)>,
    /// Width and height of the picture in metres on a plane across the axis: at a distance of 1 m, and for an
    /// orthographic camera at any.
    pub screen_window: (f64, f64),
    /// Radius of the lens in metres; 0 is a pinhole.
    pub lens_radius: f64,
    /// That radius as an f-number on a sensor 24 mm high; `None` for a pinhole or an orthographic camera.
    pub f_number: Option<f64>,
    /// Axial distance in metres of what is sharp; `None` where that is infinitely far away.
    pub focus: Option<f64>,
}

impl CameraFacts {
    /// Of the camera of a frame.
    pub fn new(camera: &ViewCamera, origin: &FrameOrigin) -> Self {
        let mut pose: DAffine3 = camera.motion.at(1.0);
        pose.translation += origin.0;
        let closing = DMat4::from(pose).inverse();
        let is_same = camera.motion.is_static();
        Self {
            opening: CameraState::new(camera, camera.world_to_camera, 0.0),
            closing: CameraState::new(
                camera,
                if is_same { camera.world_to_camera } else { closing },
                1.0,
            ),
            blades: camera.blades,
            blade_rotation: camera.blade_rotation,
        }
    }
}

impl CameraState {
    fn new(camera: &ViewCamera, world_to_camera: DMat4, u: f64) -> Self {
        let aspect = f64::from(camera.size.0) / f64::from(camera.size.1);
        let lens_radius = camera.lens_radius.at(u);
        let (half_height, tan) = match &camera.projection {
            Projection::Perspective { tan_half_fov } => {
                let tan = tan_half_fov.at(u);
                (tan, Some(tan))
            }
            Projection::Orthographic { half_height } => (*half_height, None),
        };
        let degrees = |tan: f64| 2.0 * tan.atan().to_degrees();
        let focus = camera.focus.at(u);
        Self {
            world_to_camera: world_to_camera.to_cols_array(),
            fov_deg: tan.map(|tan| (degrees(tan * aspect), degrees(tan))),
            screen_window: (2.0 * half_height * aspect, 2.0 * half_height),
            lens_radius,
            f_number: tan
                .filter(|_| lens_radius > 0.0)
                .map(|tan| SENSOR_HEIGHT / (2.0 * tan) / (2.0 * lens_radius)),
            focus: focus.is_finite().then_some(focus),
        }
    }

    /// World to normalized device coordinates, column-major: x from −1 at the left edge of the picture to 1 at the right
    /// one, y from −1 at the lower to 1 at the upper one. There are no clipping planes; z is 1/depth, and the depth
    /// for an orthographic camera.
    pub fn world_to_ndc(&self) -> [f64; 16] {
        let (width, height) = self.screen_window;
        let (x, y) = (2.0 / width, 2.0 / height);
        let columns = if self.fov_deg.is_some() {
            [DVec4::X * x, DVec4::Y * y, DVec4::NEG_W, DVec4::Z]
        } else {
            [DVec4::X * x, DVec4::Y * y, DVec4::NEG_Z, DVec4::W]
        };
        let [a, b, c, d] = columns;
        (DMat4::from_cols(a, b, c, d) * DMat4::from_cols_array(&self.world_to_camera))
            .to_cols_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Simulation;
    use crate::world::{Camera, FrameClock, Settings, Transform, Velocity};
    use glam::{DVec2, DVec3};

    /// The facts and the camera of a frame of a world with this camera, which goes 3 m/s along x in a shutter of 0.5 s.
    fn of(camera: Camera) -> (CameraFacts, ViewCamera, FrameOrigin) {
        let mut simulation = Simulation::new();
        let world = simulation.world_mut();
        let mut clock = FrameClock::default();
        (clock.clock.fps, clock.clock.shutter) = (1.0, (0.0, 0.5));
        world.insert_resource(clock);
        world.resource_mut::<Settings>().0.size = (128, 64);
        let place = Transform { translation: DVec3::new(5.0, 1.0, 2.0), ..Default::default() };
        world.spawn((camera, place, Velocity { linear: DVec3::X * 3.0, ..Default::default() }));
        simulation.prepare_frame(0).expect("a camera");
        let world = simulation.world();
        let (view, origin) = (world.resource::<ViewCamera>(), world.resource::<FrameOrigin>());
        (CameraFacts::new(view, origin), view.clone(), *origin)
    }

    /// Oracles: tan 45° = 1, so that the picture is 2 m high at 1 m; a lens of f/2 on a sensor of 24 mm.
    #[test]
    fn the_facts_of_a_camera_are_those_of_its_closed_forms() {
        let camera = Camera { fov: 90.0, f_number: Some(2.0), ..Default::default() };
        let (facts, ..) = of(camera);
        let CameraState { fov_deg, screen_window, f_number, lens_radius, focus, .. } =
            facts.opening;
        let (across, up) = fov_deg.expect("a perspective");
        assert!((up - 90.0).abs() < 1e-12 && (across - 126.869_897_645_844).abs() < 1e-9);
        assert!((screen_window.0 - 4.0).abs() < 1e-12 && (screen_window.1 - 2.0).abs() < 1e-12);
        assert!((f_number.expect("a lens") - 2.0).abs() < 1e-12);
        assert!((lens_radius - 0.003).abs() < 1e-12 && focus.is_none());
        // 3 m/s over 0.5 s
        let x = |state: CameraState| state.world_to_camera[12];
        assert!((x(facts.opening) + 5.0).abs() < 1e-12 && (x(facts.closing) + 6.5).abs() < 1e-12);
    }

    /// Oracle: where the camera itself sees the point.
    #[test]
    fn device_coordinates_are_where_the_camera_sees_a_point() {
        for orthographic in [None, Some(3.0)] {
            let (facts, view, origin) =
                of(Camera { fov: 70.0, orthographic, ..Default::default() });
            let p = DVec3::new(6.0, 1.5, -2.0);
            for (state, time) in [(facts.opening, 0.0), (facts.closing, 1.0)] {
                let ndc = DMat4::from_cols_array(&state.world_to_ndc()).project_point3(p);
                let film = view.project(p - origin.0, time).expect("in front");
                let expected = DVec2::new(film.x / 64.0 - 1.0, 1.0 - film.y / 32.0);
                assert!((ndc.truncate() - expected).length() < 1e-12, "{ndc} {expected}");
                let depth = if orthographic.is_some() { 4.0 } else { 0.25 };
                assert!((ndc.z - depth).abs() < 1e-12);
            }
        }
    }
}
