//! Planes without an end under lights infinitely far away, and photons: no light is lost.

mod common;

use common::{Estimate, mean_of_seeds, scene};
use kinora::frame::Simulation;

/// A small disk of albedo ½ which looks down on a plane 1 m below, seen from between; a glass ball stands aside.
fn looking_down(plane: &str, light: &str, settings: &str) -> String {
    format!(
        r#"(
        render: (filter: Box(), {settings}),
        materials: {{
            "grey": Diffuse(albedo: 0.5), "white": Diffuse(albedo: 0.8), "mirror": Mirror(reflectance: 0.8),
            "black": Diffuse(albedo: 0),
            "glass": Dielectric(ior: 1.5),
        }},
        entities: {{
            "camera": (transform: (translation: (0, 0.8, 0), rotation: (90, 0, 0)), camera: (fov: 5)),
            "disk": (transform: (translation: (0, 1, 0), rotation: (90, 0, 0)), shape: Disk(radius: 0.05), material: "grey"),
            "ball": (transform: (translation: (0.3, 1.1, 0)), shape: Sphere(radius: 0.05), material: "glass"),
            "ground": (shape: Plane(), material: "{plane}"),
            {light}
        }})"#
    )
}

const SKY: &str = r#""sky": (light: Sky(radiance: 1)),"#;
const SUN: &str = r#""sun": (transform: (rotation: (-60, 0, 0)), light: Directional(irradiance: (3.14159265, 3.14159265, 3.14159265))),"#;

/// Within 4 standard errors of six seeds and a share of what is expected, and not lost in noise.
fn assert_near(what: &str, found: Estimate, expected: f64, share: f64) {
    let allowed = 4.0 * found.error + share * expected;
    assert!((found.mean - expected).abs() < allowed, "{what}: {found:?}, {expected}");
    assert!(found.error < 0.1 * expected, "{what}: {found:?}, {expected}");
}

/// Oracle: the ground is as bright as its albedo, ⅘, or times the cosine of that in a sun 30° from the zenith; a mirror
/// sends the disk the sun at that angle. The disk reflects half. The two small bodies hide about a percent of the light; nearly
/// all of it comes over ground farther away than photons reach.
#[test]
fn the_ground_beyond_the_photons_lights_what_is_above_it() {
    let cosine = 0.75_f64.sqrt();
    for (plane, light, expected) in
        [("white", SKY, 0.4), ("white", SUN, 0.4 * cosine), ("mirror", SKY, 0.4)]
    {
        for settings in [
            "integrator: Path, caustics: Photons, photons: (per_pass: Some(1024), radius: 5)",
            "integrator: Sppm, photons: (per_pass: Some(1024), radius: 5)",
            "integrator: Sppm, photons: (per_pass: Some(1024), radius: 5, direct: Photons)",
            "integrator: PhotonMap, final_gather: 4, photons: (per_pass: Some(4096))",
        ] {
            let found = mean_of_seeds(&looking_down(plane, light, settings), (3, 3), 64);
            assert_near(&format!("{plane}, {light} {settings}"), found, expected, 0.05);
        }
    }
}

/// A ball of glass and one of plaster over ground without an end, under a sky that shines from below as well: what comes from
/// there is stopped by the ground, also where it would meet it far away. Oracle: path tracing.
#[test]
fn nothing_shines_through_the_ground() {
    let text = |settings: &str| {
        format!(
            r#"(
            render: (filter: Box(), {settings}),
            materials: {{"white": Diffuse(albedo: 0.6), "glass": Dielectric(ior: 1.5)}},
            entities: {{
                "camera": (transform: (translation: (0, 1.2, 4), look_at: (0, 0.6, 0)), camera: (fov: 40)),
                "plaster": (transform: (translation: (-0.6, 0.7, 0)), shape: Sphere(radius: 0.5), material: "white"),
                "glass": (transform: (translation: (0.6, 0.7, 0)), shape: Sphere(radius: 0.5), material: "glass"),
                "ground": (shape: Plane(), material: "white"),
                "sky": (light: Sky(radiance: 1)),
            }})"#
        )
    };
    let expected = mean_of_seeds(&text("integrator: Path"), (12, 8), 32);
    for settings in [
        "integrator: Path, caustics: Photons, photons: (radius: 0.5)",
        "integrator: Sppm, photons: (radius: 0.5)",
        "integrator: PhotonMap, final_gather: 4, photons: (per_pass: Some(16384))",
    ] {
        let found = mean_of_seeds(&text(settings), (12, 8), 8);
        assert_near(settings, found, expected.mean, 0.05);
    }
}

/// An emitting plane lights at second hand as well, though no photon starts from it. Oracle: a disk of albedo ½ looks down on ground
/// of albedo ⅘ under a black ceiling without an end of radiance 1.
#[test]
fn an_emitting_plane_lights_at_second_hand() {
    let ceiling = r#""ceiling": (transform: (translation: (0, 3, 0), rotation: (180, 0, 0)), shape: Plane(), material: "black", emission: Radiance(1)),"#;
    for settings in [
        "integrator: Path, caustics: Photons",
        "integrator: Sppm",
        "integrator: PhotonMap, final_gather: 4",
    ] {
        let found = mean_of_seeds(&looking_down("white", ceiling, settings), (3, 3), 64);
        assert_near(settings, found, 0.4, 0.03);
    }
}

fn warnings(settings: &str) -> Vec<String> {
    let mut simulation =
        Simulation::from_description(&scene(&looking_down("white", SKY, settings)));
    simulation.prepare_frame(0).expect("a sound scene");
    simulation.warnings()
}

/// What is done about ground without an end needs no word. A radius that is cut off is told with the one that is used, and
/// so is one that the method does not look at.
#[test]
fn what_a_setting_comes_to_is_told_before_rendering() {
    for method in
        ["integrator: Path, caustics: Photons", "integrator: Sppm", "integrator: PhotonMap"]
    {
        assert_eq!(warnings(method), [""; 0], "{method}");
    }
    for method in
        ["integrator: Sppm", "integrator: PhotonMap", "integrator: Path, caustics: Photons"]
    {
        let told = warnings(&format!("{method}, photons: (radius: 3000)"));
        assert!(
            told.iter().any(|line| line.starts_with("`photons.radius` 3000 ")),
            "{method}: {told:?}"
        );
    }
}
