//! The library without a scene file: a world built by hand, systems of one's own, and mistakes which
//! become errors.

mod common;

use bevy_ecs::prelude::*;
use common::Picture;
use glam::{DQuat, DVec3};
use kinora::description::{
    Clock, EmissionStrength, Extend, Filter, Focus, Interpolation, Key, Layer, RenderSettings, Rgb,
    Track, Value,
};
use kinora::frame::{RenderControl, RenderError, Simulation};
use kinora::world::{
    Camera, Emission, FrameClock, Keyframes, MadeOf, Material, Name, SceneTime, Settings, Shape,
    Transform,
};

fn settings() -> Settings {
    Settings(RenderSettings {
        size: (24, 24),
        samples: 64,
        filter: Filter::Box { radius: 0.5 },
        layers: vec![Layer::Beauty, Layer::Variance],
        ..RenderSettings::default()
    })
}

fn at(x: f64, y: f64, z: f64) -> Transform {
    Transform { translation: DVec3::new(x, y, z), ..Transform::default() }
}

fn glow(radiance: f32) -> Emission {
    let strength = EmissionStrength::Radiance(Value::Constant(Rgb::splat(radiance)));
    Emission { strength, two_sided: true }
}

/// A simulation with a camera, a lamp and a clock of 10 frames per second with an open shutter.
fn studio() -> Simulation {
    let mut simulation = Simulation::new();
    let world = simulation.world_mut();
    world.insert_resource(settings());
    let clock = Clock { fps: 10.0, frames: (0, 9), shutter: (0.0, 1.0) };
    world.insert_resource(FrameClock { clock, frame: 0 });
    world.spawn((at(0.0, 0.0, 5.0), Camera::default()));
    simulation
}

fn render(simulation: &mut Simulation, frame: i32) -> Picture {
    let frame = simulation.render_frame(frame, &RenderControl::default());
    let frame = frame.unwrap_or_else(|error| panic!("{error}"));
    Picture { film: frame.film, report: frame.report }
}

#[derive(Component)]
struct Pendulum {
    length: f64,
}

/// The angle of a pendulum at a time, radians.
fn swing(seconds: f64) -> f64 {
    0.8 * (4.0 * seconds).cos()
}

fn swing_pendulums(time: Res<SceneTime>, mut bobs: Query<(&Pendulum, &mut Transform)>) {
    for (pendulum, mut bob) in &mut bobs {
        let (sin, cos) = swing(time.seconds).sin_cos();
        bob.translation = DVec3::new(sin, 1.0 - cos, 0.0) * pendulum.length;
    }
}

/// Oracle: the same motion as keys of a turn: an arm of the pendulum's length turns about its pivot.
#[test]
fn a_system_of_ones_own_gives_the_motion_blur_of_keyframes() {
    let mut by_system = studio();
    by_system.add_step_systems(swing_pendulums);
    let ball = Shape::Sphere { radius: 0.2 };
    by_system.world_mut().spawn((
        Pendulum { length: 1.5 },
        Transform::default(),
        ball.clone(),
        glow(1.0),
    ));

    let mut by_keys = studio();
    let keys = (0..=400)
        .map(|k| {
            let time = f64::from(k) / 400.0;
            Key { time, value: DQuat::from_rotation_z(swing(time)), tangents: None }
        })
        .collect();
    let track = Track { keys, interpolation: Interpolation::Linear, extend: Extend::Hold };
    let keyframes = Keyframes { rotation: Some(track), ..Keyframes::default() };
    let world = by_keys.world_mut();
    let arm = world.spawn((at(0.0, 1.5, 0.0), keyframes)).id();
    world.spawn((at(0.0, -1.5, 0.0), ball, glow(1.0), ChildOf(arm)));

    for frame in [0, 3] {
        let (a, b) = (render(&mut by_system, frame), render(&mut by_keys, frame));
        let difference: f64 = a.green().iter().zip(b.green()).map(|(a, b)| (a - b).abs()).sum();
        let total: f64 = a.green().iter().sum();
        // one pixel is 0.15 m: the ball covers about six
        assert!(total > 4.0, "frame {frame}: the ball is in the picture: {total}");
        assert!(difference < 0.02 * total, "frame {frame}: {difference} of {total}");
    }
}

/// A spiral of a thousand shared-material particles moved by a system: each at its own place.
#[test]
fn a_spiral_of_particles_is_rendered() {
    #[derive(Component)]
    struct Particle(u32);
    fn wind(time: Res<SceneTime>, mut particles: Query<(&Particle, &mut Transform)>) {
        for (Particle(index), mut transform) in &mut particles {
            let share = f64::from(*index) / 1000.0;
            let (sin, cos) = (40.0 * share + time.seconds).sin_cos();
            transform.translation = DVec3::new(cos, sin, 0.0) * (0.2 + 1.3 * share);
        }
    }
    let mut simulation = studio();
    simulation.add_step_systems(wind);
    let world = simulation.world_mut();
    let white = world.spawn(Material::Diffuse { albedo: Value::Constant(Rgb::ONE) }).id();
    for index in 0..1000 {
        let ball = Shape::Sphere { radius: 0.02 };
        world.spawn((Particle(index), Transform::default(), ball, MadeOf(white)));
    }
    world.spawn((at(0.0, 0.0, 9.0), Shape::Sphere { radius: 1.0 }, glow(10.0)));
    let picture = render(&mut simulation, 0);
    let lit = picture.green().iter().filter(|v| **v > 0.0).count();
    assert!(lit > 250, "{lit} of 576 pixels see a particle");
    assert!(picture.report.rebuilt.iter().any(|what| what.starts_with("instances: 1001")));
}

#[test]
fn a_world_without_a_camera_is_an_error() {
    let mut simulation = Simulation::new();
    simulation.world_mut().spawn((Shape::Sphere { radius: 1.0 }, glow(1.0)));
    let outcome = simulation.render_frame(0, &RenderControl::default());
    assert!(matches!(outcome, Err(RenderError::NoCamera)), "{:?}", outcome.err());
}

#[test]
fn an_empty_world_with_a_camera_is_black() {
    let mut simulation = studio();
    let picture = render(&mut simulation, 0);
    assert_eq!(picture.mean().mean, 0.0);
    assert!(picture.report.warnings.iter().any(|w| w.contains("no light")), "{:?}", picture.report);
}

/// References to what is not there, or is something else, are errors which name both ends.
#[test]
fn dangling_references_are_errors() {
    type Spoil = fn(&mut World, Entity, Entity);
    let spoilers: [(&str, Spoil); 7] = [
        ("a mixture of itself", |world, object, _| {
            let amount = Value::Constant(0.5);
            world.entity_mut(object).insert(Material::Mix { a: object, b: object, amount });
        }),
        ("a texture", |world, object, gone| {
            world.entity_mut(object).insert(Material::Diffuse { albedo: Value::Texture(gone) });
        }),
        ("a part of a mixture", |world, object, gone| {
            let amount = Value::Constant(0.5);
            world.entity_mut(object).insert(Material::Mix { a: gone, b: gone, amount });
        }),
        ("a material", |world, object, gone| {
            world.entity_mut(object).insert(MadeOf(gone));
        }),
        ("a mesh", |world, object, gone| {
            world.entity_mut(object).insert(Shape::Mesh(gone));
        }),
        ("what is in focus", |world, _, gone| {
            let mut cameras = world.query::<&mut Camera>();
            for mut camera in cameras.iter_mut(world) {
                (camera.aperture, camera.focus) = (0.1, Some(Focus::Entity(gone)));
            }
        }),
        ("the texture of a lamp", |world, object, gone| {
            let strength = EmissionStrength::Radiance(Value::Texture(gone));
            world.entity_mut(object).insert(Emission { strength, two_sided: false });
        }),
    ];
    for (what, spoil) in spoilers {
        let mut simulation = studio();
        let world = simulation.world_mut();
        let object = world.spawn((Name::new("thing"), Shape::Sphere { radius: 1.0 })).id();
        // An entity which is alive but neither a texture, a material nor a mesh.
        let gone = world.spawn_empty().id();
        spoil(world, object, gone);
        let outcome = simulation.render_frame(0, &RenderControl::default());
        let Err(RenderError::Dangling(message)) = outcome else {
            panic!("{what}: {:?}", outcome.err())
        };
        assert!(!message.is_empty(), "{what}");
    }
}

/// A clock that cannot run is an error, as is a picture without pixels; the world can be repaired.
#[test]
fn impossible_settings_are_errors_and_can_be_repaired() {
    let mut simulation = studio();
    simulation.world_mut().spawn((Shape::Sphere { radius: 1.0 }, glow(1.0)));
    let good = *simulation.world().resource::<FrameClock>();
    for (fps, shutter) in [
        (0.0, (0.0, 0.5)),
        (f64::NAN, (0.0, 0.5)),
        (24.0, (0.5, 0.0)),
        (24.0, (0.0, f64::INFINITY)),
    ] {
        simulation.world_mut().resource_mut::<FrameClock>().clock =
            Clock { fps, shutter, frames: (0, 0) };
        let outcome = simulation.render_frame(0, &RenderControl::default());
        assert!(
            matches!(outcome, Err(RenderError::Clock(_))),
            "{fps}, {shutter:?}: {:?}",
            outcome.err()
        );
    }
    simulation.world_mut().insert_resource(good);
    simulation.world_mut().resource_mut::<Settings>().0.size = (0, 4);
    let outcome = simulation.render_frame(0, &RenderControl::default());
    assert!(matches!(outcome, Err(RenderError::Film(_))), "{:?}", outcome.err());
    simulation.world_mut().insert_resource(settings());
    assert!(render(&mut simulation, 0).mean().mean > 0.1);
}

/// A render that is cancelled says so and leaves the world usable.
#[test]
fn a_cancelled_render_is_an_error() {
    let mut simulation = studio();
    let control = RenderControl::default();
    control.cancel.store(true, std::sync::atomic::Ordering::Relaxed);
    let outcome = simulation.render_frame(0, &control);
    assert!(matches!(outcome, Err(RenderError::Cancelled)), "{:?}", outcome.err());
    simulation.world_mut().spawn((Shape::Sphere { radius: 1.0 }, glow(1.0)));
    assert!(render(&mut simulation, 0).mean().mean > 0.1);
}

/// The control counts samples and rays.
#[test]
fn the_control_counts() {
    use std::sync::atomic::Ordering::Relaxed;
    let mut simulation = studio();
    simulation.world_mut().spawn((Shape::Sphere { radius: 1.0 }, glow(1.0)));
    let control = RenderControl::default();
    let frame = simulation.render_frame(0, &control).expect("a sound world");
    assert_eq!(control.samples_total.load(Relaxed), 24 * 24 * 64);
    assert_eq!(control.samples_done.load(Relaxed), 24 * 24 * 64);
    assert_eq!(control.rays.load(Relaxed), frame.report.rays);
    assert_eq!(frame.report.samples, 24 * 24 * 64);
    assert!(frame.report.rays >= frame.report.samples);
    assert_eq!(frame.report.stage_seconds.len(), 4);
}
