//! Water: a mesh whose vertices move, from the scene file to the tables of a frame.

use glam::{DVec2, DVec3};
use kinora::description::{LoadOptions, TriangleMesh, load_scene, parse_scene_str};
use kinora::extract::Meshes;
use kinora::frame::{RenderControl, Simulation};
use kinora::world::{Name, WorldTransform};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// A small pool with a still block beside it.
const POOL: &str = r#"(
    clock: (fps: 24, frames: (0, 47)),
    render: (size: (24, 16), samples: 2),
    materials: { "water": Dielectric(ior: 1.33) },
    meshes: {
        "block": Triangles(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], triangles: [(0, 1, 2)]),
        "water": Waves(size: (2, 1), cells: (40, 20), steepness: 0.5, gravity: 9.81, waves: [
            (amplitude: 0.02, frequency: 1.0, direction: 30, phase: 45),
            (amplitude: 0.01, frequency: 1.5, direction: 110),
        ]),
    },
    entities: {
        "camera": (transform: (translation: (0, 1, 2), look_at: (0, 0, 0)), camera: ()),
        "sky": (light: Sky(radiance: 1)),
        "ground": (transform: (translation: (0, -0.5, 0)), shape: Plane()),
        "block": (transform: (translation: (0.5, 0.2, 0)), shape: Mesh("block")),
        "water": (shape: Mesh("water"), material: "water"),
    },
)"#;

fn pool() -> Simulation {
    let scene = parse_scene_str("pool.ron", POOL, None, &LoadOptions::default());
    let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    Simulation::from_description(&scene)
}

/// The meshes of the table in the order of the file, with the number of their keys.
fn meshes(simulation: &Simulation) -> Vec<(Arc<TriangleMesh>, usize)> {
    let table = simulation.world().resource::<Meshes>();
    let keys = table.later_keys.iter().map(|later| later.len() + 1);
    table.list.iter().cloned().zip(keys).collect()
}

/// Oracle: the formula in `f64`, written out for both waves; the mesh is that of the shutter's opening.
#[test]
fn the_table_holds_the_surface_of_each_frame() {
    let mut simulation = pool();
    for frame in [0, 7, 31] {
        simulation.prepare_frame(frame).expect("it can be rendered");
        let t = f64::from(frame) / 24.0;
        let (water, keys) = meshes(&simulation).swap_remove(1);
        assert_eq!((water.positions.len(), water.triangles.len()), (41 * 21, 1600));
        assert!(keys > 2, "{keys}");
        for (i, (found, normal)) in water.positions.iter().zip(&water.normals).enumerate() {
            let rest = DVec2::new((i % 41) as f64 / 40.0 * 2.0 - 1.0, (i / 41) as f64 / 20.0 - 0.5);
            let mut p = DVec3::new(rest.x, 0.0, rest.y);
            let (mut dx, mut dz) = (DVec3::X, DVec3::Z);
            for (a, f, degrees, phase) in [(0.02, 1.0, 30.0, 45.0), (0.01, 1.5, 110.0, 0.0_f64)] {
                let (omega, angle) = (2.0 * PI * f, f64::to_radians(degrees));
                let k = omega * omega / 9.81;
                let d = DVec2::new(angle.cos(), angle.sin());
                let psi = k * d.dot(rest) - omega * t + phase.to_radians();
                p.x -= 0.5 * a * d.x * psi.sin();
                p.y += a * psi.cos();
                p.z -= 0.5 * a * d.y * psi.sin();
                let along = DVec3::new(
                    -0.5 * a * d.x * psi.cos(),
                    -a * psi.sin(),
                    -0.5 * a * d.y * psi.cos(),
                );
                dx += k * d.x * along;
                dz += k * d.y * along;
            }
            // The place at rest is f32: half a unit of 1 m there, and one for the result.
            assert!((found.as_dvec3() - p).length() < 2.0 * f64::from(f32::EPSILON), "{found} {p}");
            let n = dz.cross(dx).normalize();
            assert!((normal.as_dvec3() - n).length() < 1e-6, "{normal} {n}");
        }
    }
}

/// A frame costs the trees of what deforms, and no other.
#[test]
fn only_the_mesh_that_deforms_is_built_anew() {
    let mut simulation = pool();
    let mut rebuilt = |frame: i32| {
        let rendered = simulation.render_frame(frame, &RenderControl::default());
        let report = rendered.expect("it can be rendered").report;
        (
            report.rebuilt.into_iter().find(|what| what.starts_with("mesh trees")),
            meshes(&simulation),
        )
    };
    let (first, before) = rebuilt(0);
    assert_eq!(first.as_deref(), Some("mesh trees: 2 of 2"));
    let (second, after) = rebuilt(1);
    assert_eq!(second.as_deref(), Some("mesh trees: 1 of 2"));
    assert!(Arc::ptr_eq(&before[0].0, &after[0].0) && !Arc::ptr_eq(&before[1].0, &after[1].0));
    // The same frame again moves nothing.
    assert_eq!(rebuilt(1).0, None);
}

/// Rendering frame 5 of a sequence gives bit for bit what rendering it alone gives.
#[test]
fn a_frame_of_the_sequence_equals_the_frame_alone() {
    let picture = |frames: &[i32]| {
        let mut simulation = pool();
        let mut last = None;
        for &frame in frames {
            let rendered = simulation.render_frame(frame, &RenderControl::default());
            last = Some(rendered.expect("it can be rendered").film);
        }
        let film = last.expect("at least one frame");
        (0..16 * 24).map(|i| film.radiance(i % 24, i / 24)).collect::<Vec<_>>()
    };
    let alone = picture(&[5]);
    assert!(alone == picture(&[3, 4, 5]));
    assert!(alone != picture(&[6]), "the water moves");
}

/// Oracle: the triangles that are rendered. The ball's middle is 6 cm above the water there, and the
/// middle of the frame where it lies leans with the surface; the grid of 10 mm cuts the crests by at
/// most h²/8 times the curvature, which is below 7 m⁻¹ in either direction.
#[test]
fn the_beach_ball_floats_on_the_water_that_is_rendered() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/water.ron");
    let scene = load_scene(&path, &LoadOptions::default()).expect("a scene of the repository");
    let number = scene.meshes.get_index_of("water").expect("it has water");
    let mut simulation = Simulation::from_description(&scene);
    for frame in [0, 11, 29] {
        simulation.prepare_frame(frame).expect("it can be rendered");
        let (water, keys) = meshes(&simulation).swap_remove(number);
        assert_eq!((water.positions.len(), keys), (313 * 213, 9));
        let world = simulation.world_mut();
        let mut named = world.query::<(&Name, &WorldTransform)>();
        let mut pose = |name: &str| {
            named.iter(world).find(|(n, _)| n.as_str() == name).expect("it is there").1.0
        };
        let ball = pose("beach ball").translation;
        let lean = pose("lean").transform_vector3(DVec3::Y);
        let at = DVec2::new(ball.x, ball.z);
        assert!(at.distance(DVec2::new(-0.55, -0.35)) < 1e-9);
        let (height, normal) = under(&water, at).expect("the ball is over the water");
        assert!((ball.y - 0.06 - height).abs() < 0.01 * 0.01 / 8.0 * 14.0, "{height} {ball}");
        // Across a cell the normal turns by no more than h times the curvature.
        assert!(lean.angle_between(normal) < 0.0142 * 7.0, "{lean} {normal}");
    }
}

/// Height and normal of the triangle above or below `(x, z)`.
fn under(mesh: &TriangleMesh, at: DVec2) -> Option<(f64, DVec3)> {
    mesh.triangles.iter().find_map(|t| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
        let flat = |p: DVec3| DVec2::new(p.x, p.z) - at;
        let (p, q, r) = (flat(a), flat(b), flat(c));
        let weights = [q.perp_dot(r), r.perp_dot(p), p.perp_dot(q)];
        let inside = weights.iter().all(|w| *w <= 0.0);
        let sum: f64 = weights.iter().sum();
        let height = (a.y * weights[0] + b.y * weights[1] + c.y * weights[2]) / sum;
        inside.then(|| (height, (b - a).cross(c - a).normalize()))
    })
}

/// Oracle: the mean of 32 pictures of the surface at rest at times spread over the shutter. Slopes change
/// the light of a distant lamp; nothing else moves.
#[test]
fn a_surface_which_moves_in_the_shutter_is_the_mean_of_its_moments() {
    let picture = |shutter: (f64, f64), samples: u32| {
        let text = format!(
            r#"(
            clock: (fps: 1, frames: (0, 0), shutter: ({}, {})),
            render: (size: (12, 12), samples: {samples}, max_depth: 1, filter: Box(radius: 0.5)),
            materials: {{ "clay": Diffuse(albedo: (0.8, 0.8, 0.8)) }},
            meshes: {{ "water": Waves(size: (4, 4), cells: (60, 60), waves: [(amplitude: 0.12, frequency: 1)]) }},
            entities: {{
                "camera": (transform: (translation: (0, 3, 0.01), look_at: (0, 0, 0)), camera: (fov: 40)),
                "sun": (transform: (rotation: (-40, 90, 0)), light: Directional(irradiance: (3, 3, 3))),
                "water": (shape: Mesh("water"), material: "clay"),
            }})"#,
            shutter.0, shutter.1
        );
        let scene = parse_scene_str("waves.ron", &text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        let mut simulation = Simulation::from_description(&scene);
        let frame = simulation.render_frame(0, &RenderControl::default()).expect("a camera");
        assert_eq!(frame.report.non_finite, 0);
        let at = |k: u32| f64::from(frame.film.radiance(k % 12, k / 12).y);
        (0..144).map(at).collect::<Vec<f64>>()
    };
    let difference = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.iter().sum::<f64>()
    };
    let moving = picture((0.0, 0.5), 256);
    let mut mean = vec![0.0; 144];
    for k in 0..32 {
        let t = (f64::from(k) + 0.5) / 64.0;
        for (sum, value) in mean.iter_mut().zip(picture((t, t), 16)) {
            *sum += value / 32.0;
        }
    }
    assert!(difference(&moving, &mean) < 5e-3, "{}", difference(&moving, &mean));
    let opening = picture((0.0, 0.0), 64);
    assert!(difference(&moving, &opening) > 0.1, "{}", difference(&moving, &opening));
}
