//! Photons against closed forms and conservation laws: what lights emit, what is kept, where caustics lie.

mod common;

use common::scene;
use glam::{DVec3, Vec3};
use kinora::build::bvh::{MeshTrees, SceneGeometry, TopLevel};
use kinora::build::density::Densities;
use kinora::build::light::{
    Aim, Endless, LightTable, Lights, PhotonNumbers, PhotonSource, ShapeLights,
};
use kinora::build::nesting::{NestedGeometry, Solids};
use kinora::build::photon::{
    Keep, Photon, PhotonMap, PhotonPass, PhotonStore, PhotonTracer, QueryPoint,
};
use kinora::description::Kernel;
use kinora::extract::{FrameOrigin, Instances, PunctualLights, Surfaces};
use kinora::frame::Simulation;
use kinora::math::Aabb;
use kinora::sampling::Sampler;
use kinora::shade::nesting::OneSolid;
use std::f64::consts::PI;
use std::marker::PhantomData;
use std::sync::atomic::AtomicBool;

/// The tables of the first frame of a scene.
struct Tables(Simulation);

impl Tables {
    fn new(text: &str) -> Self {
        let mut simulation = Simulation::from_description(&scene(text));
        simulation.prepare_frame(0).expect("a sound scene");
        Self(simulation)
    }

    fn get<T: bevy_ecs::prelude::Resource>(&self) -> &T {
        self.0.world().resource::<T>()
    }

    fn geometry(&self) -> SceneGeometry<'_> {
        let (instances, meshes) = (self.get::<Instances>(), self.get::<MeshTrees>());
        SceneGeometry {
            instances: &instances.list,
            meshes: &meshes.list,
            top: self.get::<TopLevel>(),
        }
    }

    fn lights(&self) -> Lights<'_> {
        Lights {
            table: self.get::<LightTable>(),
            shapes: self.get::<ShapeLights>(),
            punctual: &self.get::<PunctualLights>().0,
            geometry: self.geometry(),
            materials: &self.get::<Surfaces>().materials,
        }
    }

    fn source(&self) -> PhotonSource {
        PhotonSource::new(
            self.get::<LightTable>(),
            self.get::<TopLevel>().bounds(),
            &Endless::default(),
        )
    }

    /// World positions in render space.
    fn local(&self, p: DVec3) -> Vec3 {
        (p - self.get::<FrameOrigin>().0).as_vec3()
    }

    /// Traces `n` photons of one pass.
    fn trace(&self, n: u32, keep: Keep, max_depth: u32, aim: Option<&Aim>) -> PhotonStore {
        let materials = &self.get::<Surfaces>().materials;
        let storable: Vec<bool> =
            (0..materials.len() as u32).map(|m| materials.may_be_storable(m, 0.1)).collect();
        let source = self.source();
        let tracer = PhotonTracer::<true, OneSolid> {
            scene: NestedGeometry {
                geometry: self.geometry(),
                materials,
                solids: self.get::<Solids>(),
                densities: self.get::<Densities>(),
            },
            lights: self.lights(),
            source: &source,
            aim,
            storable: &storable,
            min_alpha: 0.1,
            view: None,
            max_depth,
            inner_reflections: 100,
            keep,
            inside: PhantomData,
        };
        let pass = PhotonPass { seed: 5, frame: 0, pass: 0, emitted: n, time: 0.0 };
        let mut store = PhotonStore::default();
        let counters = tracer.trace_pass(&pass, &mut store, &AtomicBool::new(false));
        let counters = counters.expect("not cancelled");
        assert_eq!((counters.emitted, counters.stored), (u64::from(n), store.len() as u64));
        store
    }
}

fn numbers(k: u32) -> PhotonNumbers {
    let s = Sampler::new(8, 0, (1, 2), k);
    PhotonNumbers { light: s.one_fine(0), point: s.two(1), direction: s.two(3), aim: s.one(5) }
}

const CAMERA: &str =
    r#""camera": (transform: (translation: (0, 3, 9), look_at: (0, 0, 0)), camera: ())"#;

/// A ball of radius ½ from rational curves.
const TURNED: &str = "shape: Revolution(profile: Bezier(points: [(0, -0.5), (0.2928932188134524, -0.5), (0.5, -0.2928932188134524), (0.5, 0), (0.5, 0.2928932188134524), (0.2928932188134524, 0.5), (0, 0.5)], weights: [1, 0.8047378541243649, 0.8047378541243649, 1, 0.8047378541243649, 0.8047378541243649, 1])), emission: Radiance((3, 3, 3))";

/// Oracles: the flux of each light in closed form; for those far away, through the disk of the sphere
/// around a ball of radius 1 (its box has the half diagonal √3).
#[test]
fn emitted_photons_carry_the_flux_of_every_light() {
    let disk = 3.0 * PI;
    let lights = [
        ("sphere", r"shape: Sphere(radius: 0.5), emission: Radiance((3, 3, 3))", 29.608_813_2),
        ("disk", r"shape: Disk(radius: 0.5), emission: Radiance((3, 3, 3))", 7.402_203_3),
        (
            "rectangle",
            r"shape: Rectangle(size: (2, 1)), emission: Radiance((3, 3, 3))",
            18.849_555_9,
        ),
        (
            "two sides",
            r"shape: Disk(radius: 0.5), two_sided: true, emission: Radiance((3, 3, 3))",
            14.804_406_6,
        ),
        ("turned", TURNED, 29.608_813_2),
        ("power", r"shape: Cone(), emission: Power((7, 7, 7))", 7.0),
        ("texture", r#"shape: Rectangle(size: (2, 1)), emission: Radiance("checks")"#, PI),
        ("stretched", r"shape: Sphere(), emission: Power((5, 5, 5))", 5.0),
        ("mesh", r#"shape: Mesh("pair"), emission: Radiance((3, 3, 3))"#, 18.849_555_9),
        ("point", r"light: Point(power: Some((4, 4, 4)))", 4.0),
        ("spot", r"light: Spot(intensity: (1, 1, 1), angle: 30, blend: 0)", 0.841_787_2),
        ("sun", r"light: Directional(irradiance: (2, 2, 2))", 2.0 * disk),
        ("wide sun", r"light: Directional(irradiance: (2, 2, 2), angle: 30)", 2.0 * disk / 0.983),
        ("sky", r"light: Sky(radiance: (0.5, 0.5, 0.5))", 2.0 * PI * disk),
        ("map", r#"light: Sky(radiance: "checks", scale: 2)"#, 4.0 * PI * disk),
    ];
    for (name, light, expected) in lights {
        let body = if light.starts_with("light") { r#""body": (shape: Sphere()),"# } else { "" };
        let tables = Tables::new(&format!(
            r#"(textures: {{"checks": Checker(size: 0.125, a: (1, 1, 1), b: (0, 0, 0))}},
            meshes: {{"pair": Triangles(positions: [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], triangles: [(0, 1, 2), (0, 2, 3)])}},
            entities: {{ {CAMERA}, {body}
            "light": (transform: (rotation: (20, 30, 40), scale: {}), {light}) }})"#,
            if name == "stretched" { "(0.3, 1, 2)" } else { "1" },
        ));
        let (source, lights) = (tables.source(), tables.lights());
        let n = 1 << 16;
        let sum: f64 = (0..n)
            .filter_map(|k| source.emit(&lights, &numbers(k), 0.0, None))
            .map(|photon| f64::from(photon.power.y))
            .sum();
        let ratio = sum / f64::from(n) / expected;
        // A checker is the hard case: half of the photons carry nothing.
        assert!((ratio - 1.0).abs() < 6e-3, "{name}: {ratio} of {expected}");
    }
}

/// Oracle: photons drawn without an aim. What hits the aimed-at balls carries the same flux, and many
/// more photons hit.
#[test]
fn aiming_changes_how_many_photons_hit_but_not_their_flux() {
    let lights = [
        r"shape: Rectangle(size: (2, 1)), emission: Radiance((3, 3, 3)), two_sided: true",
        r"light: Point(intensity: Some((1, 1, 1)))",
        r"light: Spot(intensity: (1, 1, 1), angle: 70)",
        r"light: Directional(irradiance: (2, 2, 2), angle: 5)",
        r"light: Sky(radiance: (0.5, 0.5, 0.5))",
    ];
    for light in lights {
        let tables = Tables::new(&format!(
            r#"(entities: {{ {CAMERA},
            "a": (transform: (translation: (0, -2, 0)), shape: Sphere(radius: 0.5)),
            "b": (transform: (translation: (0.6, -2, 0.3)), shape: Sphere(radius: 0.3)),
            "far": (transform: (translation: (5, 5, 5)), shape: Sphere(radius: 0.1)),
            "light": (transform: (rotation: (-70, 10, 0)), {light}) }})"#
        ));
        let balls = [(DVec3::new(0.0, -2.0, 0.0), 0.5), (DVec3::new(0.6, -2.0, 0.3), 0.3)];
        let balls = balls.map(|(c, r)| (tables.local(c).as_dvec3(), r));
        let boxes =
            balls.map(|(c, r)| Aabb { min: c.as_vec3() - r as f32, max: c.as_vec3() + r as f32 });
        let aim = Aim::new(&boxes).expect("bounded");
        let (source, lights) = (tables.source(), tables.lights());
        let hits = |photon: &kinora::build::light::EmittedPhoton| {
            let (o, d) = (photon.ray.o.as_dvec3(), photon.ray.d.as_dvec3());
            balls.iter().any(|(c, r)| {
                let along = (*c - o).dot(d);
                along > 0.0 && (*c - o - d * along).length() < *r
            })
        };
        let flux = |aim: Option<&Aim>, n: u32| {
            let photons = (0..n).filter_map(|k| source.emit(&lights, &numbers(k), 0.0, aim));
            let found: Vec<f64> =
                photons.filter(hits).map(|photon| f64::from(photon.power.y)).collect();
            (found.iter().sum::<f64>() / f64::from(n), found.len() as f64 / f64::from(n))
        };
        let (plain, plain_share) = flux(None, 1 << 18);
        let (aimed, aimed_share) = flux(Some(&aim), 1 << 16);
        assert!((aimed / plain - 1.0).abs() < 0.03, "{light}: {aimed} against {plain}");
        assert!(aimed_share > 2.0 * plain_share, "{light}: {aimed_share} of {plain_share}");
    }
}

/// The irradiance on the plane y = 0 at `p` from photons on a disk of radius `r`.
fn irradiance(tables: &Tables, store: &PhotonStore, p: DVec3, r: f32) -> (f64, f64) {
    let mut map = PhotonMap::default();
    map.rebuild(store, |_| true);
    let query = QueryPoint { position: tables.local(p), normal: Vec3::Y, radius: r };
    let (mut sum, mut count) = (0.0, 0.0_f64);
    map.gather(&query, |photon, d2| {
        sum += f64::from(photon.power.y * Kernel::Constant.weight(d2, r * r));
        count += 1.0;
    });
    (sum, sum / count.sqrt())
}

/// Oracles: `πR²/(R² + h²)` under the middle of a disk light and its closed form beside it; under a
/// point light the mean over the gather disk, `2I/r²·(1 − h/√(h² + r²))`. Within 4 Poisson errors, and
/// those below 3 %.
#[test]
fn irradiance_under_a_disk_and_a_point_is_the_closed_form() {
    let floor = r#""floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (8, 8)), material: "grey")"#;
    let of = |light: &str, points: &[(f64, f32, f64)]| {
        let tables = Tables::new(&format!(
            r#"(materials: {{"grey": Diffuse()}}, entities: {{ {CAMERA}, {floor}, "light": ({light}) }})"#
        ));
        let store = tables.trace(1 << 20, Keep::All, 1, None);
        for &(x, r, expected) in points {
            let (e, error) = irradiance(&tables, &store, DVec3::new(x, 0.0, 0.0), r);
            assert!(error < 0.03 * expected, "{light} at {x}: error {error} of {e}");
            assert!(
                (e - expected).abs() < 4.0 * error,
                "{light} at {x}: {e} ± {error}, {expected}"
            );
        }
    };
    of(
        r"transform: (translation: (0, 2, 0), rotation: (90, 0, 0)), shape: Disk(radius: 1), emission: Radiance((1, 1, 1))",
        &[(0.0, 0.1, 0.628_318_5), (1.0, 0.1, 0.460_075_6)],
    );
    of(
        r"transform: (translation: (0, 1, 0)), light: Point(intensity: Some((1, 1, 1)))",
        &[(0.0, 0.5, 0.844_582_5), (0.0, 0.1, 0.992_562_0)],
    );
}

/// Oracle: the albedo series. In a closed sphere each photon is kept `1/(1 − ρ)` times on average, and
/// the surfaces receive `Φ/(1 − ρ)`; an emitting wall adds nothing to what it reflects. With a limit of three
/// interactions, `Φ(1 + ρ + ρ²)`.
#[test]
fn a_closed_sphere_receives_the_albedo_series() {
    for (rho, depth, factor) in [(0.6, 1000, 2.5), (0.95, 1000, 20.0), (0.6, 3, 1.96)] {
        for (light, flux) in [
            (
                r#""lamp": (transform: (translation: (0.5, 0.2, 0)), light: Point(power: Some((2, 2, 2))))"#,
                2.0,
            ),
            (
                r#""lamp": (transform: (translation: (0.4, 0, 0)), shape: Sphere(radius: 0.1), material: "white", emission: Power((3, 3, 3)))"#,
                3.0,
            ),
        ] {
            let tables = Tables::new(&format!(
                r#"(materials: {{"wall": Diffuse(albedo: {rho}), "white": Mirror()}}, entities: {{
                "camera": (camera: ()), "wall": (shape: Sphere(radius: 1), material: "wall"), {light} }})"#
            ));
            let store = tables.trace(1 << 16, Keep::All, depth, None);
            let sum: f64 = store.iter().map(|photon| f64::from(photon.power.y)).sum();
            let expected = flux * factor;
            // A mirror ball takes interactions of its own from the limit.
            let loose = if depth == 3 && light.contains("Sphere") { 0.02 } else { 0.01 };
            assert!((sum / expected - 1.0).abs() < loose, "ρ = {rho}, {light}: {sum}, {expected}");
        }
    }
}

fn total(photons: impl Iterator<Item = Photon>) -> f64 {
    photons.map(|photon| f64::from(photon.power.y)).sum()
}

/// Oracle: Snell and Fresnel on each ray of a parallel beam through a ball of index 1.5, two refractions,
/// on the plane 2.5 radii behind its centre: flux within `ρ` over π.
#[test]
fn the_caustic_of_a_ball_lies_where_its_rays_go() {
    let tables = Tables::new(&format!(
        r#"(materials: {{"glass": Dielectric(ior: 1.5), "grey": Diffuse()}}, entities: {{ {CAMERA},
        "ball": (transform: (translation: (0, 2.5, 0)), shape: Sphere(), material: "glass"),
        "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (9, 9)), material: "grey"),
        "sun": (transform: (rotation: (-90, 0, 0)), light: Directional(irradiance: (1, 1, 1))) }})"#
    ));
    let centre = tables.local(DVec3::new(0.0, 2.5, 0.0));
    let aim = Aim::new(&[Aabb { min: centre - 1.0, max: centre + 1.0 }]).expect("bounded");
    let nadir = tables.local(DVec3::ZERO);
    for aim in [None, Some(&aim)] {
        let n = if aim.is_none() { 1 << 20 } else { 1 << 18 };
        // Two refractions and the floor are three interactions: reflected orders have more.
        let store = tables.trace(n, Keep::Caustics, 3, aim);
        for (rho, flux) in [
            (0.138_365_3, 0.036_863_3),
            (0.310_878_1, 0.147_404_7),
            (0.580_074_9, 0.331_013_4),
            (1.162_013_1, 0.582_912_5),
        ] {
            let within = |p: &&Photon| f64::from((p.position - nadir).length()) < rho;
            let found = total(store.iter().filter(within).copied()) / PI;
            assert!((found / flux - 1.0).abs() < 0.012, "ρ = {rho}: {found} instead of {flux}");
        }
    }
}

/// Oracle: parallel light inside a mirror ring of radius 1 makes a nephroid whose cusp lies half way
/// between the centre and the wall; a ray at distance `h` from the axis crosses it at `1/(2 cos i)`, sin i = h.
/// Light is densest at the cusp, and none of one reflection crosses the axis closer to the centre.
#[test]
fn the_cusp_of_a_mirror_ring_lies_at_half_its_radius() {
    let tables = Tables::new(&format!(
        r#"(materials: {{"mirror": Mirror(), "grey": Diffuse()}}, entities: {{ {CAMERA},
        "ring": (transform: (translation: (0, 0.25, 0)), shape: Cylinder(radius: 1, height: 0.5, capped: false), material: "mirror"),
        "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (4, 4)), material: "grey"),
        "sun": (transform: (rotation: (-45, -90, 0)), light: Directional(irradiance: (1, 1, 1))) }})"#
    ));
    // The sun shines along +x and down: light from the wall at +x comes back towards the centre.
    let store = tables.trace(1 << 20, Keep::Caustics, 2, None);
    let origin = tables.local(DVec3::ZERO);
    let mut bins = [0.0; 40];
    for photon in store.iter() {
        let p = photon.position - origin;
        if p.z.abs() < 0.02 && (0.0..1.0).contains(&p.x) {
            bins[(p.x * 40.0) as usize] += f64::from(photon.power.y);
        }
    }
    let peak = (0..40).max_by(|&a, &b| bins[a].total_cmp(&bins[b])).expect("bins");
    let cusp = (peak as f64 + 0.5) / 40.0;
    assert!((cusp - 0.5).abs() < 0.04, "the light is densest at {cusp}");
}

/// A wall a millimetre thick, lit from one side, is black on the other; and the photons of a floor do not
/// count on the wall that stands on it.
#[test]
fn no_light_leaks_through_thin_walls() {
    let tables = Tables::new(&format!(
        r#"(materials: {{"grey": Diffuse()}}, entities: {{ {CAMERA},
        "wall": (transform: (translation: (0, 1, 0)), shape: Box(size: (2, 0.001, 2)), material: "grey"),
        "lamp": (transform: (translation: (0, 2, 0)), light: Point(intensity: Some((1, 1, 1)))) }})"#
    ));
    let store = tables.trace(1 << 14, Keep::All, 4, None);
    let mut map = PhotonMap::default();
    map.rebuild(&store, |_| true);
    let count = |y: f64, normal: Vec3| {
        let mut count = 0;
        let position = tables.local(DVec3::new(0.0, y, 0.0));
        map.gather(&QueryPoint { position, normal, radius: 0.1 }, |_, _| count += 1);
        count
    };
    assert!(count(1.0005, Vec3::Y) > 0);
    assert_eq!(count(0.9995, -Vec3::Y), 0);
}
