//! Inputs of the benches: numbers, points, meshes, scenes. The same in every run.

#![allow(dead_code, reason = "every bench is a program of its own and uses a part of this")]

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec2, Vec3};
use kinora::description::{LoadOptions, SceneDescription, TriangleMesh, load_scene};
use kinora::frame::Simulation;
use kinora::math::Ray;
use kinora::world::{Camera, Mesh, Shape, Transform};
use std::path::Path;
use std::sync::Arc;

/// A stream of uniforms: `SplitMix64` (Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom
/// Number Generators", OOPSLA, section 4).
pub struct Uniforms(u64);

impl Uniforms {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In `[0, 1)`.
    pub fn one(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    pub fn square(&mut self) -> Vec2 {
        Vec2::new(self.one(), self.one())
    }

    /// In `[-1, 1)³`.
    pub fn cube(&mut self) -> Vec3 {
        Vec3::new(self.one(), self.one(), self.one()) * 2.0 - 1.0
    }

    /// Any direction; not evenly over the sphere.
    pub fn direction(&mut self) -> Vec3 {
        (self.cube() + Vec3::splat(1e-3)).normalize()
    }
}

/// Points in `[-1, 1)³`: evenly, which is the easy case for a tree.
pub fn scattered(count: usize) -> Vec<Vec3> {
    let mut uniforms = Uniforms::new(7);
    (0..count).map(|_| uniforms.cube()).collect()
}

/// Points around a few of them, ever closer: nearly all lie in a thousandth of the volume, which is
/// the hard case.
pub fn clustered(count: usize) -> Vec<Vec3> {
    let mut uniforms = Uniforms::new(11);
    let centres: Vec<Vec3> = (0..8).map(|_| uniforms.cube()).collect();
    (0..count)
        .map(|k| {
            let distance = uniforms.one().powi(8);
            (centres[k % centres.len()] + uniforms.cube() * distance).clamp(-Vec3::ONE, Vec3::ONE)
        })
        .collect()
}

/// A small triangle at every point; sizes keep the share of space that they fill.
pub fn triangles_at(points: &[Vec3]) -> Arc<TriangleMesh> {
    let mut uniforms = Uniforms::new(13);
    let size = 0.7 / (points.len() as f32).cbrt();
    let positions: Vec<Vec3> =
        points.iter().flat_map(|&p| [p; 3].map(|p| p + uniforms.cube() * size)).collect();
    let triangles = (0..points.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    Arc::new(TriangleMesh { positions, triangles, ..Default::default() })
}

/// Rays through the cube, from everywhere to everywhere.
pub fn rays(count: usize) -> Vec<Ray> {
    let mut uniforms = Uniforms::new(17);
    (0..count)
        .map(|_| {
            let o = uniforms.direction() * 3.0;
            Ray { o, d: (uniforms.cube() - o).normalize(), time: uniforms.one() }
        })
        .collect()
}

/// A scene of the repository at another size.
pub fn scene(name: &str, size: (u32, u32), samples: u32) -> SceneDescription {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let scene = load_scene(&path, &LoadOptions::default());
    let mut scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    scene.render.size = size;
    scene.render.samples = samples;
    scene
}

/// A world with a camera in its origin, so that render space is world space.
pub fn empty_world() -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world_mut().spawn((Camera::default(), Transform::default()));
    simulation
}

pub fn at(p: Vec3) -> Transform {
    Transform { translation: p.as_dvec3(), ..Default::default() }
}

/// A world with one mesh, at every point an instance of it of this size.
pub fn world_of_instances(mesh: &Arc<TriangleMesh>, points: &[Vec3], size: f64) -> Simulation {
    let mut simulation = empty_world();
    let world = simulation.world_mut();
    let mesh: Entity = world.spawn(Mesh::new(mesh.clone())).id();
    for &p in points {
        world.spawn((Shape::Mesh(mesh), Transform { scale: DVec3::splat(size), ..at(p) }));
    }
    simulation
}

/// A hall with a floor, sixty boxes and `count` small lamps of equal power under its ceiling.
pub fn hall(count: usize, size: (u32, u32), samples: u32) -> Simulation {
    use kinora::description::{EmissionStrength, RenderSettings};
    use kinora::world::{Emission, Settings};
    let mut uniforms = Uniforms::new(19);
    let mut simulation = Simulation::new();
    let world = simulation.world_mut();
    world.insert_resource(Settings(RenderSettings { size, samples, ..Default::default() }));
    let eye = Transform { translation: DVec3::new(0.0, 1.7, 18.0), ..Default::default() };
    world.spawn((Camera { fov: 50.0, ..Default::default() }, eye));
    world.spawn(Shape::Plane {});
    for _ in 0..60 {
        let p = uniforms.cube().as_dvec3() * 15.0;
        let place = Transform { translation: DVec3::new(p.x, 0.5, p.z), ..Default::default() };
        world.spawn((Shape::Box { size: DVec3::ONE }, place));
    }
    let columns = (count as f64).sqrt().ceil() as usize;
    let place = |k: usize| ((k as f64 + 0.5) / columns as f64 - 0.5) * 40.0;
    for k in 0..count {
        let lamp = Transform {
            translation: DVec3::new(place(k % columns), 3.9, place(k / columns)),
            rotation: glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2),
            ..Default::default()
        };
        let watts = Vec3::splat(2000.0 / count as f32);
        let emission = Emission { strength: EmissionStrength::Power(watts), two_sided: false };
        world.spawn((Shape::Rectangle { size: glam::DVec2::splat(0.05) }, emission, lamp));
    }
    simulation
}
