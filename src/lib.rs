//! Kinora renders animated scenes by simulating light.
//!
//! The world is an entity–component world ([`bevy_ecs`]): objects are entities, and everything that
//! happens to them is a system. A frame is made of it in stages, each of which reads only what
//! earlier ones wrote:
//!
//! ```text
//! scene.ron
//!    │ description   parse, validate, point at the mistake           (plain data; no ECS)
//!    ▼
//!  World ── entities with Transform, Velocity, Keyframes, Shape, Material, Emission, Camera …
//!    │ step          where everything is over the shutter, in closed form
//!    │ extract       what changed is copied into flat arrays         (the ECS ends here)
//!    ▼
//!  tables ── instances, surfaces, lights, camera, Requirements: arrays and indices, no pointers
//!    │ build         trees over triangles and over instances, the table of lights
//!    │ integrate     tiles in parallel; every sample a function of (seed, frame, pixel, index)
//!    ▼
//!  Film ── sums, variance, auxiliary layers
//!    │ output        tone curve, EXR and PNG written whole or not at all, the record of the run
//!    ▼
//!  name.0000.exr, name.0000.png, manifest.json
//! ```
//!
//! [`frame::Simulation`] holds the world and runs the stages. They talk through resources and
//! components alone. What a scene does not require costs nothing: tables and trees are rebuilt when
//! something that they are made of changed, and the integrator is compiled for the features that
//! [`extract::Requirements`] lists. A frame depends on the world and its number, not on the frames
//! rendered before, nor on the number of threads.
//!
//! # Modules, as data flows
//!
//! * [`math`], [`color`], [`sampling`] — frames, motion, rounding bounds; the RGB working space and
//!   tone curves; random streams, warps and tabulated distributions.
//! * [`description`] — scene files, meshes and images to plain, validated data.
//! * [`world`] — the components and resources, and spawning a description.
//! * [`step`] — systems which say where things are at a time.
//! * [`shape`] — one shape per file: bounds, hits with their error, area sampling.
//! * [`extract`], [`build`] — the tables of a frame, and the structures over them.
//! * [`shade`] — how surfaces scatter; textures.
//! * [`integrate`] — the radiance of a pixel sample.
//! * [`film`], [`output`] — sums and variance; files.
//! * [`frame`] — the stages in their order.
//!
//! # A picture without a scene file
//!
//! A program builds a world of its own, and may move things by systems of its own. Such a system
//! says where things are at [`world::SceneTime`]; it is asked for several times in every shutter, so
//! that what it moves is blurred like anything else. Two such systems which write the same
//! component have to be ordered (`.chain()`): a conflict without an order is an error.
//!
//! Besides `kinora` this needs [`bevy_ecs`] and [`glam`] as dependencies, in the versions that
//! `kinora` uses.
//!
//! ```
//! use bevy_ecs::prelude::*;
//! use glam::{DVec3, Vec3};
//! use kinora::description::{EmissionStrength, RenderSettings};
//! use kinora::frame::{RenderControl, Simulation};
//! use kinora::output::{FrameFiles, FrameMetadata, write_exr, write_png};
//! use kinora::world::{Camera, Emission, Material, SceneTime, Settings, Shape, Transform};
//!
//! /// A weight on a string of this length (metres) which swings out to this angle (radians).
//! #[derive(Component)]
//! struct Pendulum {
//!     length: f64,
//!     amplitude: f64,
//! }
//!
//! /// Hangs every pendulum where it is at the time asked for (small oscillations).
//! fn swing_pendulums(time: Res<SceneTime>, mut pendulums: Query<(&Pendulum, &mut Transform)>) {
//!     for (pendulum, mut transform) in &mut pendulums {
//!         let rate = (9.81 / pendulum.length).sqrt();
//!         let angle = pendulum.amplitude * (rate * time.seconds).cos();
//!         transform.translation = pendulum.length * DVec3::new(angle.sin(), -angle.cos(), 0.0);
//!     }
//! }
//!
//! let mut simulation = Simulation::new();
//! simulation.add_step_systems(swing_pendulums);
//! let settings = RenderSettings { size: (16, 9), samples: 2, ..Default::default() };
//! let world = simulation.world_mut();
//! world.insert_resource(Settings(settings.clone()));
//! let back = Transform { translation: DVec3::new(0.0, -0.5, 4.0), ..Default::default() };
//! world.spawn((Camera::default(), back));
//! let sky = kinora::description::Light::Sky { radiance: Vec3::splat(0.2).into(), scale: 1.0 };
//! world.spawn(sky as kinora::world::Light);
//! let red = Material::Diffuse { albedo: Vec3::new(0.8, 0.1, 0.1).into() };
//! let pendulum = Pendulum { length: 1.0, amplitude: 0.5 };
//! world.spawn((Shape::Sphere { radius: 0.3 }, red, pendulum));
//! let glow = EmissionStrength::Radiance(Vec3::new(9.0, 8.0, 7.0).into());
//! let lamp = Transform { translation: DVec3::new(1.0, 1.0, 1.0), ..Default::default() };
//! let emission = Emission { strength: glow, two_sided: false };
//! world.spawn((Shape::Sphere { radius: 0.2 }, emission, lamp));
//!
//! let frame = simulation.render_frame(5, &RenderControl::default())?;
//! assert!(frame.film.radiance(8, 4).is_finite());
//!
//! let folder = tempfile::tempdir()?;
//! let files = FrameFiles::new(folder.path(), "pendulum", 5);
//! let facts = FrameMetadata::of_world(simulation.world(), &frame);
//! write_png(&files.png, &frame.film, &settings, &facts)?;
//! write_exr(&files.exr, &frame.film, &settings, &facts)?;
//! assert!(files.png.exists() && files.exr.exists());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The example `spiral` is a longer one: `cargo run --release --example spiral -- out/spiral`.

pub mod build;
pub mod color;
pub mod description;
pub mod extract;
pub mod film;
pub mod frame;
pub mod integrate;
pub mod math;
pub mod memory;
pub mod output;
pub mod sampling;
pub mod shade;
pub mod shape;
pub mod step;
pub mod world;
