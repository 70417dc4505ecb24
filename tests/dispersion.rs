//! Light which glass splits into its colours, against Snell's law, closed furnaces and other methods.

mod common;

use common::{Picture, mesh_text, render, scene};
use glam::{DVec2, DVec3, Vec3};
use kinora::color::wavelength::density;
use kinora::description::{Dispersion, TriangleMesh};
use kinora::extract::{Feature, Requirements};
use kinora::frame::Simulation;

/// Half the angle of deviation of a 60° prism of SF11 for the d line, at its least: both beams make it with the x axis.
const TILT_DEG: f64 = 33.17;
/// From the middle of the left face to the screen, metres.
const DISTANCE: f64 = 0.6;

/// Middle of the left face of the prism, whose section is an equilateral triangle of 60 mm, apex up.
fn middle() -> DVec2 {
    let r = 0.034_641_016_151;
    (DVec2::new(0.0, r) + DVec2::from_angle(210_f64.to_radians()) * r) * 0.5
}

/// Light of this index which hits the middle of the left face, at its tilt: where it meets the screen, upwards from the d
/// line, and the share of unpolarised light that gets there; `None` where it is reflected inside.
fn traced(index: f64) -> Option<(f64, f64)> {
    let (left, right) =
        (DVec2::from_angle(150_f64.to_radians()), DVec2::from_angle(30_f64.to_radians()));
    let tilt = TILT_DEG.to_radians();
    let refract = |d: DVec2, n: DVec2, eta: f64| {
        // n against d, eta the index before over that beyond.
        let cos_i = -d.dot(n);
        let squared = 1.0 - eta * eta * (1.0 - cos_i * cos_i);
        if squared < 0.0 {
            return None;
        }
        let cos_t = squared.sqrt();
        let parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let across = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        let passed = 1.0 - 0.5 * (parallel * parallel + across * across);
        Some((d * eta + n * (eta * cos_i - cos_t), passed))
    };
    let (inside, first) = refract(DVec2::from_angle(tilt), left, 1.0 / index)?;
    // The right face is 17.32 mm from the middle along its normal.
    let m = middle();
    let t = (0.034_641_016_151 * 0.5 - m.dot(right)) / inside.dot(right);
    let leaves_at = m + inside * t;
    let (out, second) = refract(inside, -right, index)?;
    let along = DVec2::from_angle(-tilt);
    let t = (m + along * DISTANCE - leaves_at).dot(along) / out.dot(along);
    let place = leaves_at + out * t - m;
    Some((place.dot(along.perp()), first * second))
}

/// The numbers of the specification of `scenes/prism.ron`.
#[test]
fn the_oracle_has_the_published_places() {
    let glass = Dispersion::Sf11.curve(1.0);
    for (line, place) in [
        (400.0, -75.7),
        (450.0, -31.4),
        (486.1, -12.8),
        (550.0, 8.1),
        (587.6, 16.4),
        (656.3, 27.4),
        (700.0, 32.5),
    ] {
        let (found, _) = traced(glass.index(line)).expect("it passes");
        assert!((found * 1e3 - place).abs() < 0.5, "{line} nm at {} mm", found * 1e3);
    }
}

fn quads(list: &[[DVec3; 4]]) -> TriangleMesh {
    let positions: Vec<Vec3> = list.iter().flatten().map(|p| p.as_vec3()).collect();
    let corners = (0..list.len() as u32).map(|k| 4 * k);
    let triangles = corners.flat_map(|k| [[k, k + 1, k + 2], [k, k + 2, k + 3]]).collect();
    TriangleMesh { positions, triangles, ..Default::default() }
}

/// A sunbeam of 2 mm × 40 mm falls through a slit on a prism, and from there on a screen, which the camera sees square on.
fn prism(dispersion: &str) -> String {
    let tilt = TILT_DEG.to_radians();
    let m = middle();
    let (beam, leaves) = (DVec2::from_angle(tilt), DVec2::from_angle(-tilt));
    let plane = |at: DVec2, across: DVec2, [a0, a1]: [f64; 2], [z0, z1]: [f64; 2]| {
        [(a0, z0), (a1, z0), (a1, z1), (a0, z1)].map(|(a, z)| (at + across * a).extend(z))
    };
    let (plate, up) = (m - beam * 0.1, beam.perp());
    let shutter = quads(&[
        plane(plate, up, [0.001, 0.9], [-0.3, 0.3]),
        plane(plate, up, [-0.9, -0.001], [-0.3, 0.3]),
        plane(plate, up, [-0.001, 0.001], [0.02, 0.3]),
        plane(plate, up, [-0.001, 0.001], [-0.3, -0.02]),
    ]);
    let screen = m + leaves * DISTANCE;
    let wall = quads(&[plane(screen, leaves.perp(), [-0.15, 0.15], [-0.06, 0.06])]);
    let corner = |degrees: f64| DVec2::from_angle(degrees.to_radians()) * 0.034_641_016_151;
    let mut solid = TriangleMesh::default();
    for z in [0.04, -0.04] {
        solid.positions.extend([90.0, 210.0, 330.0].map(|a| corner(a).extend(z).as_vec3()));
    }
    solid.triangles = vec![[0, 1, 2], [3, 5, 4]];
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        solid.triangles.extend([[a, a + 3, b + 3], [a, b + 3, b]]);
    }
    let meshes = [("shutter", shutter), ("wall", wall), ("solid", solid)];
    let meshes: Vec<String> = meshes.iter().map(|(name, mesh)| mesh_text(name, mesh)).collect();
    let (eye, from) = (screen - leaves * 0.2, -beam);
    format!(
        r#"(render: (integrator: Path, caustics: Photons, filter: Box(), photons: (per_pass: Some(60000), radius: 1)), meshes: {{ {} }},
        materials: {{"black": Diffuse(albedo: 0), "white": Diffuse(albedo: 0.8), "glass": Dielectric({dispersion})}}, entities: {{
            "camera": (transform: (translation: ({}, {}, 0), look_at: ({}, {}, 0)), camera: (orthographic: Some(0.3))),
            "sun": (transform: (translation: ({}, {}, 0), look_at: (0, 0, 0)), light: Directional(irradiance: (1000, 1000, 1000))),
            "shutter": (shape: Mesh("shutter"), material: "black"),
            "screen": (shape: Mesh("wall"), material: "white"),
            "prism": (shape: Mesh("solid"), material: "glass") }})"#,
        meshes.join(", "),
        eye.x,
        eye.y,
        screen.x,
        screen.y,
        from.x,
        from.y,
    )
}

/// Closed form: flux and mean place of each channel on the screen, integrated over all wavelengths.
#[test]
fn a_prism_lays_its_spectrum_where_the_formula_says() {
    const ROWS: u32 = 120;
    let picture = render(&prism("dispersion: Sf11"), (24, ROWS), 256);
    let glass = Dispersion::Sf11.curve(1.0);
    let (mut flux, mut place) = (DVec3::ZERO, DVec3::ZERO);
    for nm in (380..730).map(|nm| f64::from(nm) + 0.5) {
        if let Some((at, passed)) = traced(glass.index(nm)).filter(|(at, _)| at.abs() < 0.15) {
            flux += density(nm) * passed;
            place += density(nm) * passed * at;
        }
    }
    place /= flux;
    let side = 0.3 / f64::from(ROWS);
    let (mut found, mut mean) = (DVec3::ZERO, DVec3::ZERO);
    for (x, y) in (0..ROWS).flat_map(|y| (0..24).map(move |x| (x, y))) {
        let power = picture.at(x, y).as_dvec3() * (side * side * std::f64::consts::PI / 0.8);
        found += power;
        mean += power * (0.15 - (f64::from(y) + 0.5) * side);
    }
    mean /= found;
    found /= 1000.0 * 0.002 * 0.04;
    for channel in 0..3 {
        let (off, expected) = (mean[channel] - place[channel], flux[channel]);
        assert!(off.abs() < 5e-4, "channel {channel}: {mean} m instead of {place}");
        let ratio = found[channel] / expected;
        assert!((ratio - 1.0).abs() < 0.02, "channel {channel}: {found} instead of {flux}");
    }
    assert!(mean.x > mean.y && mean.y > mean.z, "red is turned least: {mean}");
}

/// Where the index does not change with the wavelength, the picture is that without wavelengths, and has no hue.
#[test]
fn white_light_stays_white_without_dispersion() {
    let with = |glass: &str, integrator: &str| {
        let text = format!(
            r#"(render: (filter: Box(), integrator: {integrator}), materials: {{"glass": Dielectric({glass}), "floor": Diffuse(albedo: 0.6)}}, entities: {{
            "camera": (transform: (translation: (0, 2, 5), look_at: (0, 0.5, 0)), camera: (fov: 30)),
            "ball": (transform: (translation: (0, 1, 0)), shape: Sphere(), material: "glass"),
            "floor": (shape: Plane(), material: "floor"),
            "lamp": (transform: (translation: (1, 4, 1), rotation: (90, 0, 0)), shape: Rectangle(size: (2, 2)), emission: Radiance(3)) }})"#
        );
        render(&text, (32, 24), 1024).mean_of_channels()
    };
    for integrator in ["Path", "Sppm"] {
        let plain = with("ior: 1.5", integrator);
        let drawn = with("dispersion: Cauchy(a: 1.5, b: 0)", integrator);
        let [r, g, b] = drawn;
        for channel in [r, g, b] {
            assert!((channel / plain[0] - 1.0).abs() < 0.01, "{integrator}: {drawn:?}, {plain:?}");
        }
    }
}

/// The furnace: inside of radiance 1 everything that absorbs nothing looks like 1, whatever its index.
#[test]
fn nothing_is_lost_in_dispersive_solids() {
    for (glass, share) in [
        ("dispersion: Diamond", 1.0),
        ("dispersion: Sf11, roughness: 0.5", 1.0),
        ("ior: 1.6, dispersion: Abbe(20)", 1.0),
    ] {
        let text = format!(
            r#"(render: (filter: Box(), integrator: Path, roulette_depth: 30), materials: {{"glass": Dielectric({glass}), "water": Dielectric(dispersion: Water, priority: 1)}}, entities: {{
            "camera": (transform: (translation: (0, 0, 5), look_at: (0, 0, 0)), camera: (fov: 20)),
            "ball": (shape: Sphere(radius: 0.9), material: "glass"),
            "drop": (transform: (translation: (0.4, 0, 0.6)), shape: Sphere(radius: 0.5), material: "water"),
            "sky": (light: Sky(radiance: 1)) }})"#
        );
        let seen = render(&text, (16, 16), 1024).mean_of_channels();
        for channel in seen {
            assert!((channel - share).abs() < 4e-3, "{glass}: {seen:?}");
        }
    }
}

/// Paths and photons see the same colours under a dispersive ball.
#[test]
fn paths_and_photons_agree_on_colours() {
    let text = |integrator: &str| {
        format!(
            r#"(render: (filter: Box(), integrator: {integrator}), materials: {{"glass": Dielectric(ior: 1.6, dispersion: Abbe(8)), "floor": Diffuse(albedo: 0.6)}}, entities: {{
            "camera": (transform: (translation: (0, 6, 0.01), look_at: (0, 0, 0)), camera: (fov: 30)),
            "ball": (transform: (translation: (0, 1, 0)), shape: Sphere(radius: 0.5), material: "glass"),
            "floor": (shape: Plane(), material: "floor"),
            "lamp": (transform: (translation: (3, 3.5, 0)), shape: Sphere(radius: 1.5), emission: Radiance(8)) }})"#
        )
    };
    let path = render(&text("Path"), (24, 24), 8192);
    let photons = "Path, caustics: Photons, photons: (per_pass: Some(40000), radius: 1)";
    let photons = render(&text(photons), (24, 24), 256);
    // Where the ball throws its light: on the left.
    for columns in [2..6, 6..10] {
        let mean = |picture: &Picture| {
            let mut sum = DVec3::ZERO;
            for (x, y) in columns.clone().flat_map(|x| (8..16).map(move |y| (x, y))) {
                sum += picture.at(x, y).as_dvec3();
            }
            sum
        };
        let ratio = mean(&photons) / mean(&path);
        assert!((ratio - 1.0).abs().max_element() < 0.03, "columns {columns:?}: {ratio}");
    }
}

/// Only scenes which disperse know of wavelengths.
#[test]
fn wavelengths_are_required_where_they_matter() {
    for (dispersion, required) in [("", false), ("dispersion: Bk7", true)] {
        let mut simulation = Simulation::from_description(&scene(&prism(dispersion)));
        simulation.prepare_frame(0).expect("a frame");
        let requirements = simulation.world().resource::<Requirements>();
        assert_eq!(requirements.has(Feature::Dispersion), required);
    }
}
