//! Particles run along a spiral around a lamp: a world built by a program, moved by a system of its
//! own, and no scene file.
//!
//!     cargo run --release --example spiral -- out/spiral
//!
//! writes 24 frames, which play in a loop, as PNG and EXR into that folder.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use kinora::description::{Clock, EmissionStrength, Layer, RenderSettings};
use kinora::frame::{RenderControl, Simulation};
use kinora::output::{FrameFiles, FrameMetadata, write_exr, write_png};
use kinora::world::{
    Camera, Emission, FrameClock, LookAt, MadeOf, Material, SceneTime, Settings, Shape, Transform,
};
use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;

const FRAMES: i32 = 24;
const PARTICLES: u32 = 63;
/// Metres from the foot of the spiral to its top.
const HEIGHT: f64 = 1.8;
/// Seconds for the way up outside and down inside again, and the turns on it. In a second every
/// particle comes to where the 21st after it was, one of the same material: the film is a loop.
const ROUND: f64 = 3.0;
const TURNS: f64 = 6.0;

/// A particle by its share of the way that lies behind it at time 0, in `[0, 1)`.
#[derive(Component)]
struct Particle {
    phase: f64,
}

/// Where a particle is at a time, in metres.
///
/// A closed curve: a spiral up the outside of a vase, and down its inside. A jump in a shutter would
/// ask for very many motion keys.
fn place_on_spiral(phase: f64, seconds: f64) -> DVec3 {
    let s = TAU * (phase + seconds / ROUND);
    let (sin, cos) = (TURNS * s).sin_cos();
    let distance = 0.6 + 0.3 * s.sin();
    DVec3::new(distance * cos, 0.1 + 0.5 * HEIGHT * (1.0 - s.cos()), distance * sin)
}

/// Puts every particle where it is at the time asked for.
///
/// This is all that a motion needs: the step stage asks at several times of every shutter, and
/// what moved between them is blurred.
fn follow_spiral(time: Res<SceneTime>, mut particles: Query<(&Particle, &mut Transform)>) {
    for (particle, mut transform) in &mut particles {
        transform.translation = place_on_spiral(particle.phase, time.seconds);
    }
}

fn at(x: f64, y: f64, z: f64) -> Transform {
    Transform { translation: DVec3::new(x, y, z), ..Default::default() }
}

/// Everything that stands in the world.
fn furnish(world: &mut World) {
    let aim = LookAt { target: DVec3::new(0.0, 0.9, 0.0), up: DVec3::Y };
    world.spawn((Camera { fov: 34.0, ..Default::default() }, at(0.0, 2.0, 5.0), aim));
    world.spawn((Shape::Plane {}, Material::Diffuse { albedo: Vec3::splat(0.6).into() }));
    let glow = EmissionStrength::Radiance(Vec3::new(30.0, 24.0, 16.0).into());
    let lamp = Emission { strength: glow, two_sided: false };
    world.spawn((Shape::Sphere { radius: 0.12 }, lamp, at(0.0, 1.1, 0.0)));
    // Three materials, each an entity, shared by many particles.
    let gold = kinora::description::Metal::Gold;
    let materials = [
        Material::Plastic {
            albedo: Vec3::new(0.05, 0.25, 0.7).into(),
            ior: 1.5,
            roughness: 0.1.into(),
        },
        Material::Conductor {
            metal: Some(gold),
            f0: None,
            eta: None,
            k: None,
            roughness: 0.3.into(),
        },
        Material::Diffuse { albedo: Vec3::new(0.75, 0.15, 0.1).into() },
    ]
    .map(|material| world.spawn(material).id());
    for k in 0..PARTICLES {
        let phase = f64::from(k) / f64::from(PARTICLES);
        let material = MadeOf(materials[k as usize % materials.len()]);
        world.spawn((Particle { phase }, Shape::Sphere { radius: 0.07 }, material));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.ok_or("name a folder: cargo run --example spiral -- out/spiral")?;
    std::fs::create_dir_all(&folder)?;

    let mut simulation = Simulation::new();
    simulation.add_step_systems(follow_spiral);
    let settings = RenderSettings {
        size: (320, 180),
        samples: 32,
        layers: vec![Layer::Beauty, Layer::Motion],
        ..Default::default()
    };
    let world = simulation.world_mut();
    let clock = Clock { fps: 24.0, frames: (0, FRAMES - 1), shutter: (0.0, 0.5) };
    world.insert_resource(FrameClock { clock, frame: 0 });
    world.insert_resource(Settings(settings.clone()));
    furnish(world);

    for number in 0..FRAMES {
        let frame = simulation.render_frame(number, &RenderControl::default())?;
        let files = FrameFiles::new(&folder, "spiral", number);
        let facts = FrameMetadata::of_world(simulation.world(), &frame);
        write_png(&files.png, &frame.film, &settings, &facts)?;
        write_exr(&files.exr, &frame.film, &settings, &facts)?;
        println!("{}", files.png.display());
    }
    Ok(())
}
