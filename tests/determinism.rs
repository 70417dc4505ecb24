//! The same bits: for any number of threads, and for a frame alone or within its sequence.

mod common;

use common::{Picture, icosphere, mesh_text, scene};
use kinora::description::{IntegratorChoice, Layer, SceneDescription};
use kinora::film::{PlaneSamples, Tile};
use kinora::frame::{RenderControl, Simulation};

/// Something of everything: moving camera and objects, textures, every kind of light, holes, glass
/// that absorbs, a lens, a mesh.
fn everything() -> SceneDescription {
    let text = format!(
        r#"(
        clock: (fps: 24, frames: (0, 9), shutter: (0, 0.5)),
        render: (samples: 8, size: (70, 40)),
        textures: {{
            "checks": Checker(size: 0.3), "holes": Checker(size: 0.1, a: (1, 1, 1), b: (0.2, 0.2, 0.2)),
            "sky": Checker(size: 0.25, a: (0.5, 0.6, 0.8), b: (0.1, 0.1, 0.2)),
        }},
        materials: {{
            "floor": Diffuse(albedo: "checks"), "net": Masked(material: "floor", opacity: "holes"),
            "glass": Dielectric(attenuation: Some((color: (0.5, 0.8, 0.5), distance: 1))),
            "gold": Conductor(metal: Some(Gold), roughness: 0.3), "plastic": Plastic(),
            "mix": Mix(a: "gold", b: "plastic", amount: "holes"),
        }},
        meshes: {{ {} }},
        entities: {{
            "arm": (velocity: (angular: (0, 30, 0))),
            "camera": (parent: "arm", transform: (translation: (0, 1, 6), look_at: (0, 0.7, 0)), camera: (fov: 40, aperture: 0.05, focus: Some("ball")),
                       keyframes: (fov: (keys: [(0, 40), (1, 50)]))),
            "floor": (shape: Plane(), material: "floor"),
            "ball": (transform: (translation: (0, 0.7, 0)), velocity: (linear: (1, 2, 0), angular: (0, 900, 0)), acceleration: (0, -9.81, 0),
                     shape: Mesh("ball"), material: "glass"),
            "net": (transform: (translation: (-1.5, 1, 0.5)), shape: Rectangle(size: (1, 2)), material: "net"),
            "can": (transform: (translation: (1.5, 0.5, 0)), velocity: (angular: (0, 0, 400)), shape: Cylinder(radius: 0.4), material: "mix"),
            "lamp": (transform: (translation: (0, 4, 0), rotation: (90, 0, 0)), shape: Disk(), emission: Radiance((3, 3, 3)),
                     keyframes: (emission: (keys: [(0, 0.5), (1, 2)]))),
            "glow": (parent: "can", transform: (translation: (0, 1, 0)), shape: Mesh("ball"), emission: Power((1, 1, 0.5)), ),
            "point": (transform: (translation: (2, 3, 1)), velocity: (linear: (-1, 0, 0)), light: Point(intensity: (2, 2, 2))),
            "spot": (transform: (translation: (-2, 4, 1), look_at: (0, 0, 0)), light: Spot(intensity: (9, 5, 5))),
            "sun": (transform: (rotation: (-60, 20, 0)), light: Directional(irradiance: (1, 1, 0.9), angle: 0.5)),
            "sky": (light: Sky(radiance: "sky")),
        }})"#,
        mesh_text("ball", &icosphere(1, true)),
    );
    let mut description = scene(&text);
    description.render.layers = Layer::ALL.to_vec();
    description
}

fn frame(simulation: &mut Simulation, frame: i32) -> Picture {
    let frame = simulation.render_frame(frame, &RenderControl::default());
    let frame = frame.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(frame.report.non_finite, 0);
    Picture { film: frame.film, report: frame.report }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let description = everything();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| frame(&mut Simulation::from_description(&description), 3))
    };
    let one = with(1);
    for threads in [2, 7] {
        let several = with(threads);
        assert!(one.same_bits(&several), "{threads} threads");
        assert_eq!(one.report.rays, several.report.rays);
    }
    // and the comparison sees a difference where there is one
    let other = frame(&mut Simulation::from_description(&description), 4);
    assert!(!one.same_bits(&other), "another frame is another picture");
}

/// Pixels share paths in groups, so that those beside a region count as well.
#[test]
fn a_region_has_the_bits_of_the_whole_picture() {
    let mut described = everything();
    described.render.samples = 3;
    let still = r#"(
        render: (samples: 5, size: (70, 40), layers: [Beauty, Normal, Variance]),
        materials: { "gray": Diffuse(), "glass": Dielectric() },
        entities: {
            "camera": (transform: (translation: (0, 1, 6), look_at: (0, 0.7, 0)), camera: (fov: 40)),
            "floor": (shape: Plane(), material: "gray"),
            "ball": (transform: (translation: (0, 0.7, 0)), shape: Sphere(radius: 0.7), material: "glass"),
            "sky": (light: Sky(radiance: 1)),
        })"#;
    for (mut described, integrator) in [
        (described, IntegratorChoice::Path),
        (scene(still), IntegratorChoice::Path), // shares paths
        (scene(still), IntegratorChoice::Sppm),
    ] {
        described.render.integrator = integrator;
        let whole = frame(&mut Simulation::from_description(&described), 3);
        for region in [(0, 0, 1, 1), (29, 17, 8, 19), (69, 39, 1, 1)] {
            described.render.region = Some(region);
            let part = frame(&mut Simulation::from_description(&described), 3);
            let (x0, y0, width, height) = region;
            assert_eq!((part.film.size(), part.film.window().size()), ((70, 40), (width, height)));
            // Photons are traced for the whole picture.
            let fewer = part.report.rays < whole.report.rays / 2;
            assert!(fewer || integrator == IntegratorChoice::Sppm, "{integrator:?} {region:?}");
            let Tile { x1, y1, .. } = part.film.window();
            for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
                assert_eq!(part.at(x, y), whole.at(x, y), "{integrator:?} {region:?}: ({x}, {y})");
            }
            let plane = |picture: &Picture| {
                let planes = picture.film.image(Layer::Normal).expect("asked for");
                let PlaneSamples::F32(values) = &planes[1].samples else { panic!("numbers") };
                values.clone()
            };
            let (part, whole) = (plane(&part), plane(&whole));
            for (k, value) in part.iter().enumerate() {
                let (x, y) = (x0 + k as u32 % width, y0 + k as u32 / width);
                assert_eq!(
                    *value,
                    whole[(y * 70 + x) as usize],
                    "{region:?}: normal at ({x}, {y})"
                );
            }
        }
    }
}

#[test]
fn frame_seven_alone_is_frame_seven_of_the_sequence() {
    let description = everything();
    let alone = frame(&mut Simulation::from_description(&description), 7);
    let mut sequence = Simulation::from_description(&description);
    for before in 0..7 {
        sequence.prepare_frame(before).expect("a sound scene");
    }
    let after = frame(&mut sequence, 7);
    assert!(alone.same_bits(&after), "after frames 0 to 6");
    // backwards, and rendered for real
    frame(&mut sequence, 9);
    frame(&mut sequence, 2);
    assert!(alone.same_bits(&frame(&mut sequence, 7)), "after frames 9 and 2");
}

/// Frames in which nothing moves: the second rebuilds nothing and differs by its noise alone.
#[test]
fn nothing_is_rebuilt_when_nothing_moves() {
    let mut description = everything();
    for (_, entity) in &mut description.entities {
        (entity.velocity, entity.acceleration, entity.keyframes) = (None, None, None);
    }
    let mut simulation = Simulation::from_description(&description);
    let first = frame(&mut simulation, 0);
    assert!(!first.report.rebuilt.is_empty());
    let second = frame(&mut simulation, 1);
    assert_eq!(second.report.rebuilt, Vec::<String>::new());
    assert!(!first.same_bits(&second), "each frame has its own noise");
    let alone = frame(&mut Simulation::from_description(&description), 1);
    assert!(alone.same_bits(&second));
}

/// A material, a lamp and an object changed between frames: what is rendered then is what a new world of
/// the changed scene gives, whatever the old one held.
#[test]
fn a_world_changed_between_frames_equals_a_new_one() {
    use kinora::description::{EmissionStrength, Rgb, Value};
    use kinora::world::{Emission, HiddenFromCamera, Name, Shape, Transform};
    let description = everything();
    let mut old = Simulation::from_description(&description);
    frame(&mut old, 0);
    let named = |simulation: &mut Simulation, name: &str| {
        let world = simulation.world_mut();
        let mut names = world.query::<(bevy_ecs::prelude::Entity, &Name)>();
        names.iter(world).find(|(_, n)| n.as_str() == name).map(|(entity, _)| entity).expect(name)
    };
    let change = |simulation: &mut Simulation| {
        let lamp = named(simulation, "lamp");
        let world = simulation.world_mut();
        world.entity_mut(lamp).insert(Emission {
            strength: EmissionStrength::Radiance(Value::Constant(Rgb::new(1.0, 9.0, 1.0))),
            two_sided: true,
        });
        world.get_mut::<Transform>(lamp).expect("placed").translation.x = 1.0;
        let point = named(simulation, "point");
        simulation.world_mut().entity_mut(point).despawn();
        let floor = {
            let world = simulation.world_mut();
            let mut shapes = world.query::<(bevy_ecs::prelude::Entity, &Shape)>();
            shapes
                .iter(world)
                .find(|(_, s)| matches!(s, Shape::Plane {}))
                .map(|(e, _)| e)
                .expect("the floor")
        };
        simulation.world_mut().entity_mut(floor).insert(HiddenFromCamera);
    };
    change(&mut old);
    let mut new = Simulation::from_description(&description);
    change(&mut new);
    assert!(frame(&mut old, 1).same_bits(&frame(&mut new, 1)), "changed");
    // A lamp that stops to shine becomes an ordinary object.
    for simulation in [&mut old, &mut new] {
        let lamp = named(simulation, "lamp");
        simulation.world_mut().entity_mut(lamp).remove::<Emission>();
    }
    frame(&mut new, 5);
    assert!(frame(&mut old, 2).same_bits(&frame(&mut new, 2)), "an emission removed");
}

/// `bvh` set anew between frames of one world: the trees of meshes are built again, those at rest in their
/// shared tree among them, and the picture keeps its bits.
#[test]
fn another_quality_of_trees_rebuilds_them_and_shows_the_same() {
    use kinora::build::bvh::{MeshTrees, RestingTree, WideTree};
    use kinora::description::BvhQuality;
    use kinora::world::Settings;
    let text = format!(
        r#"(
        render: (samples: 8, size: (60, 40), max_depth: 4),
        materials: {{ "clay": Diffuse(albedo: (0.7, 0.6, 0.5)) }},
        meshes: {{ {}, {}, {} }},
        entities: {{
            "camera": (transform: (translation: (0, 1, 6), look_at: (0, 0, 0)), camera: (fov: 50)),
            "left": (transform: (translation: (-2, 0, 0)), shape: Mesh("one"), material: "clay"),
            "right": (transform: (translation: (2, 0, 0)), shape: Mesh("two"), material: "clay"),
            "ball": (transform: (translation: (0, 0, 1)), velocity: (linear: (3, 1, 0)),
                     shape: Mesh("three"), material: "clay"),
            "sky": (light: Sky(radiance: (1, 1, 1))),
        }})"#,
        mesh_text("one", &icosphere(2, true)),
        mesh_text("two", &icosphere(3, true)),
        mesh_text("three", &icosphere(3, false)),
    );
    let description = scene(&text);
    let mut world = Simulation::from_description(&description);
    let first = frame(&mut world, 0);
    assert_eq!(frame(&mut world, 0).report.rebuilt, Vec::<String>::new());
    for quality in [BvhQuality::Fast, BvhQuality::Best, BvhQuality::Balanced] {
        world.world_mut().resource_mut::<Settings>().0.bvh = quality;
        let again = frame(&mut world, 0);
        let rebuilt = &again.report.rebuilt;
        assert!(rebuilt.contains(&"tree of resting meshes".to_owned()), "{rebuilt:?}");
        assert!(rebuilt.contains(&"mesh trees: 1 of 3".to_owned()), "{rebuilt:?}");
        assert!(first.same_bits(&again), "{quality:?}");
        let tables = world.world();
        let ball = &tables.resource::<MeshTrees>().list[2];
        assert_eq!(ball.memory(), WideTree::build(&ball.mesh, quality).memory(), "{quality:?}");
        assert!(tables.resource::<RestingTree>().built);
        let rebuilt = frame(&mut world, 0).report.rebuilt;
        assert!(rebuilt.is_empty(), "the same quality again: {rebuilt:?}");
    }
}
