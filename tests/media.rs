//! Solids which scatter light, against closed forms.

mod common;

use common::{render, scene};
use kinora::frame::{RenderError, Simulation};

/// Fog as a solid without a surface of its own: index 1.
fn fog(sigma_s: f64, sigma_a: f64, g: f64) -> String {
    let absorbed = if sigma_a > 0.0 {
        let left = (-sigma_a).exp();
        format!(", attenuation: (color: ({left}, {left}, {left}))")
    } else {
        String::new()
    };
    format!(
        "Dielectric(ior: 1, scattering: (coefficient: ({sigma_s}, {sigma_s}, {sigma_s}), g: {g}){absorbed})"
    )
}

fn in_fog(settings: &str, fog: &str, entities: &str) -> String {
    format!(
        r#"(render: (filter: Box(), integrator: Path, {settings}), materials: {{"fog": {fog}, "black": Diffuse(albedo: 0)}}, entities: {{ {entities} }})"#
    )
}

/// White light from all around a medium that absorbs nothing stays white, whatever it scatters and wherever the camera is.
#[test]
fn nothing_is_lost_where_nothing_is_absorbed() {
    for (sigma, g, z) in [(0.3, 0.0, 4.0), (3.0, 0.0, 4.0), (3.0, 0.9, 0.2), (1e-9, 0.999, 4.0)] {
        let text = in_fog(
            "roulette_depth: 2000, max_depth: 2000",
            &fog(sigma, 0.0, g),
            &format!(
                r#""camera": (transform: (translation: (0, 0, {z})), camera: (fov: 20)),
                "cloud": (shape: Sphere(radius: 1), material: "fog"),
                "sky": (light: Sky(radiance: 1))"#
            ),
        );
        render(&text, (8, 8), 1024).mean().assert_agrees(&format!("{sigma} {g}"), 1.0, 2e-3);
    }
}

/// Chandrasekhar 1960, *Radiative Transfer*, section 50: a half-space which scatters isotropically under even light reflects
/// `1 − √(1 − ϖ)·H(μ)`.
#[test]
fn a_half_space_reflects_its_plane_albedo() {
    for (albedo, mu, expected) in [
        (0.9, 1.0, 0.414_947_5),
        (0.9, 0.5, 0.507_938_9),
        (0.8, 1.0, 0.285_254_5),
        (0.5, 1.0, 0.115_225_9),
    ] {
        let sin = f64::sqrt(1.0 - mu * mu);
        let text = in_fog(
            "roulette_depth: 30, max_depth: 4000",
            &fog(albedo, 1.0 - albedo, 0.0),
            &format!(
                r#""camera": (transform: (translation: ({}, 0, {}), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1))),
                "slab": (transform: (translation: (0, 0, -50)), shape: Box(size: (4000, 4000, 100)), material: "fog"),
                "sky": (light: Sky(radiance: 1))"#,
                6.0 * sin,
                6.0 * mu
            ),
        );
        let seen = render(&text, (16, 16), 1024).mean();
        seen.assert_agrees(&format!("albedo {albedo}, μ {mu}"), expected, 5e-3);
    }
}

/// The airlight integral of a point light of 1 W/sr, 1 m beside a ray which begins 2 m before and ends 3 m behind it,
/// scattered once; quadrature in f64 for 0.2/0.2 and 1/2 per metre (scattering, extinction).
#[test]
fn light_is_scattered_once_as_the_airlight_integral_says() {
    for (sigma_s, sigma_a, expected) in [(0.2, 0.0, 0.019_062_869_5), (1.0, 1.0, 0.000_623_379_814)]
    {
        let text = in_fog(
            "max_depth: 1",
            &fog(sigma_s, sigma_a, 0.0),
            r#""camera": (transform: (translation: (0, 0, 2), look_at: (0, 0, 0)), camera: (orthographic: Some(1e-4))),
            "room": (shape: Sphere(radius: 2000), material: "fog"),
            "wall": (transform: (translation: (0, 0, -3)), shape: Rectangle(size: (1, 1)), material: "black"),
            "lamp": (transform: (translation: (0, 1, 0)), light: Point(intensity: (1, 1, 1)))"#,
        );
        let seen = render(&text, (16, 16), 4096).mean();
        seen.assert_agrees(&format!("{sigma_s}"), expected, 1e-2);
    }
}

/// Beer and Lambert, channel by channel, of light on a wall which comes and is seen through coloured air: its borders are
/// none, for the sun as well.
#[test]
fn borders_between_equal_indices_are_no_surfaces() {
    let text = |ior: &str| {
        in_fog(
            "max_depth: 1",
            &format!("Dielectric({ior}attenuation: (color: (0.9, 0.5, 0.1)))"),
            r#""camera": (transform: (translation: (0, 0, 9), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1))),
            "mist": (transform: (translation: (0, 0, 3)), shape: Box(size: (90, 90, 2)), material: "fog"),
            "screen": (shape: Rectangle(size: (90, 90)), material: "white"),
            "sun": (light: Directional(irradiance: (1, 1, 1)))"#,
        )
        .replace(r#""black":"#, r#""white": Diffuse(albedo: 0.5), "black":"#)
    };
    // Both ways through 2 m.
    let seen = render(&text("ior: 1, "), (4, 4), 16).mean_of_channels();
    for (found, color) in seen.into_iter().zip([0.9_f64, 0.5, 0.1]) {
        let expected = 0.5 / std::f64::consts::PI * color.powi(4);
        assert!((found / expected - 1.0).abs() < 1e-4, "{seen:?}");
    }
    // A surface which bends light hides the sun from a path.
    assert_eq!(render(&text(""), (4, 4), 16).mean_of_channels(), [0.0; 3]);
}

/// Methods which trace photons say what they do not know, and `Auto` takes another.
#[test]
fn photons_in_media_are_refused_in_words() {
    let text = |integrator: &str| {
        in_fog(
            "",
            &fog(1.0, 0.0, 0.0),
            r#""camera": (transform: (translation: (0, 0, 4)), camera: ()),
            "cloud": (shape: Sphere(), material: "fog"), "sky": (light: Sky(radiance: 1))"#,
        )
        .replace("integrator: Path", &format!("integrator: {integrator}"))
    };
    for integrator in ["Sppm", "PhotonMap", "Path, caustics: Photons"] {
        let told = Simulation::from_description(&scene(&text(integrator))).prepare_frame(0);
        let told = told.expect_err("it knows no media");
        assert!(matches!(told, RenderError::Scattering(_)), "{told}");
        assert!(told.to_string().contains("`integrator: Path`"), "{told}");
    }
    for integrator in ["Path", "Auto"] {
        let frame = Simulation::from_description(&scene(&text(integrator))).prepare_frame(0);
        assert!(frame.is_ok(), "{integrator}");
    }
}
