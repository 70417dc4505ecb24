//! Rays among many analytic shapes: spheres at rest in blocks, and the same spheres one by one.
//!
//! Spheres whose map turns them, here by a billionth of a radian, are not put into blocks: so both ways
//! run in turn over the same scene.

use crate::Options;
use crate::clock::{median, thread_seconds};
use crate::common;
use crate::report::{Report, section};
use glam::{DQuat, DVec2, DVec3, Vec3};
use kinora::build::bvh::{MeshTrees, SceneGeometry, TopLevel};
use kinora::extract::Instances;
use kinora::frame::Simulation;
use kinora::math::Ray;
use kinora::world::{Shape, Transform};

/// Which rays through a geometry are counted: those which hit anything, nearest or whichever.
pub type Way = fn(&SceneGeometry, &Ray) -> bool;

pub fn closest(geometry: &SceneGeometry, ray: &Ray) -> bool {
    geometry.closest_hit(ray, f64::INFINITY, true).is_some()
}

pub fn any(geometry: &SceneGeometry, ray: &Ray) -> bool {
    geometry.occluded(ray, f64::INFINITY)
}

/// What rays meet in a prepared world.
pub fn geometry(simulation: &Simulation) -> SceneGeometry<'_> {
    let world = simulation.world();
    SceneGeometry {
        instances: &world.resource::<Instances>().list,
        meshes: &world.resource::<MeshTrees>().list,
        top: world.resource::<TopLevel>(),
    }
}

/// Nanoseconds of a thread per ray through several geometries in turn, as medians.
pub fn times_in_turn<const N: usize>(
    geometries: [&SceneGeometry; N],
    rays: &[Ray],
    way: Way,
    repetitions: usize,
) -> [f64; N] {
    let mut times = [const { Vec::new() }; N];
    let mut hits = [0; N];
    for _ in 0..repetitions {
        for ((geometry, times), hits) in geometries.iter().zip(&mut times).zip(&mut hits) {
            let trace = || rays.iter().filter(|ray| way(geometry, ray)).count();
            let (time, count) = thread_seconds(trace);
            times.push(time * 1e9 / rays.len() as f64);
            *hits = count;
        }
    }
    // Spheres that differ by a rounding are hit by the same rays, but for one that grazes.
    let (least, most) = (hits.iter().min(), hits.iter().max());
    assert!(most.zip(least).is_some_and(|(a, b)| a - b <= rays.len() / 10_000), "{hits:?}");
    times.map(median)
}

/// A world with a shape at every point.
fn world_of(points: &[Vec3], turn: f64, shape: impl Fn(usize) -> Shape) -> Simulation {
    let mut simulation = common::empty_world();
    let rotation = DQuat::from_rotation_x(turn);
    for (k, &p) in points.iter().enumerate() {
        simulation.world_mut().spawn((shape(k), Transform { rotation, ..common::at(p) }));
    }
    simulation.prepare_frame(0).expect("the world has a camera");
    simulation
}

/// Spheres, and every kind of shape.
pub fn run(options: &Options, report: &mut Report) {
    section("shapes: nanoseconds per ray, spheres in blocks and one by one");
    let (count, repetitions) = if options.quick { (100_000, 5) } else { (400_000, 9) };
    let rays = common::rays(count);
    let mut row = |name: &str, points: &[Vec3], shape: &dyn Fn(usize) -> Shape| {
        let worlds = [1e-9, 0.0].map(|turn| world_of(points, turn, shape));
        let [apart, blocks] = worlds.each_ref().map(geometry);
        let mut values = Vec::new();
        for (names, way) in [
            (["closest", "closest_apart", "closest_ratio"], closest as Way),
            (["any", "any_apart", "any_ratio"], any),
        ] {
            let [a, b] = times_in_turn([&blocks, &apart], &rays, way, repetitions);
            values.extend(names.into_iter().zip([a, b, a / b]).map(|(n, v)| (n, v, "")));
        }
        report.row(&format!("shapes.{name}"), &values);
    };
    for n in [10_000, 1_000_000] {
        let radius = 0.6 / (n as f64).sqrt();
        row(&format!("spheres.{n}"), &common::scattered(n), &|_| Shape::Sphere { radius });
        row(&format!("clustered.{n}"), &common::clustered(n), &|_| Shape::Sphere { radius });
        // Neighbours nearly touch.
        let radius = 0.8 / (n as f64).cbrt();
        row(&format!("packed.{n}"), &common::scattered(n), &|_| Shape::Sphere { radius });
    }
    let size = 0.01;
    row("mixed.10000", &common::scattered(10_000), &|k| match k % 4 {
        0 => Shape::Box { size: DVec3::splat(size) },
        1 => Shape::Rectangle { size: DVec2::splat(size) },
        2 => Shape::Cylinder { radius: size * 0.5, height: size, capped: true },
        _ => Shape::Sphere { radius: size * 0.5 },
    });
}
