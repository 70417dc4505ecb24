//! Solids which scatter light, against closed forms.

mod common;

use common::{Estimate, mean_of_seeds, render, scene};
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
        "Dielectric(ior: 1, scattering: (coefficient: ({sigma_s}, {sigma_s}, {sigma_s}), phase: HenyeyGreenstein({g})){absorbed})"
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
        render(&text, (8, 8), 2048).mean().assert_agrees(&format!("{sigma} {g}"), 1.0, 2e-3);
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

/// A pencil of sunlight through a square hole in fog, seen from the side and scattered once: what arrives on a film across it is
/// `∫E·exp(−σ(x + 3))·σ_s·p(90°)·A dx` less what the 3 m to the border take, in closed form. By light rays, and by photons, whose
/// blur moves light about but loses none.
#[test]
fn a_pencil_of_light_is_as_bright_as_the_closed_form_says() {
    let (sigma_s, sigma_a, g) = (0.3_f64, 0.1_f64, 0.4_f64);
    let sigma = sigma_s + sigma_a;
    let phase = (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g).powf(1.5));
    // Through a hole of this side, on a film of that.
    let expected = |hole: f64, film: f64| {
        let along = ((0.5 * film - 3.0) * sigma).exp() - ((-0.5 * film - 3.0) * sigma).exp();
        let deep = 2.0 * (0.5 * hole * sigma).sinh() / sigma * (-3.0 * sigma).exp();
        100.0 * along / sigma * sigma_s * phase * hole * deep / (film * film)
    };
    let text = |hole: f64, film: f64| {
        let plate = |name: &str, (y, z): (f64, f64), size: (f64, f64)| {
            format!(
                r#""{name}": (transform: (translation: (-1, {y}, {z}), rotation: (0, 90, 0)), shape: Rectangle(size: {size:?}), material: "black"),"#
            )
        };
        let beside = 0.5 * hole + 1.5;
        in_fog(
            "max_depth: 1",
            &fog(sigma_s, sigma_a, g),
            &format!(
                r#""camera": (transform: (translation: (0, 0, 9), look_at: (0, 0, 0)), camera: (orthographic: Some({film}))),
                "air": (shape: Box(size: (6, 6, 6)), material: "fog"),
                {}{}{}{}
                "sun": (transform: (translation: (-1, 0, 0), look_at: (0, 0, 0)), light: Directional(irradiance: (100, 100, 100)))"#,
                plate("above", (beside, 0.0), (6.0, 3.0)),
                plate("below", (-beside, 0.0), (6.0, 3.0)),
                plate("before", (0.0, beside), (3.0, hole)),
                plate("behind", (0.0, -beside), (3.0, hole))
            ),
        )
    };
    let paths = render(&text(0.2, 0.4), (32, 32), 1024).mean();
    paths.assert_agrees("light rays", expected(0.2, 0.4), 1e-2);
    let photons = "integrator: Sppm, photons: (direct: Photons, per_pass: Some(262144))";
    let text = text(0.5, 1.0).replace("integrator: Path", photons);
    let Estimate { mean, error } = mean_of_seeds(&text, (16, 16), 16);
    let expected = expected(0.5, 1.0);
    assert!(error < 0.01 * expected, "± {error}");
    assert!((mean - expected).abs() < 4.0 * error, "{mean} ± {error}, not {expected}");
}

/// Fog in two boxes which touch is fog in one: what flies through both draws anew in the second. Almost all is absorbed.
#[test]
fn fog_behind_fog_is_thicker() {
    let text = in_fog(
        "",
        &fog(1e-6, 1.0, 0.0),
        r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1))),
        "near": (transform: (translation: (0, 0, 0.5)), shape: Box(size: (9, 9, 1)), material: "fog"),
        "far": (transform: (translation: (0, 0, -0.5)), shape: Box(size: (9, 9, 1)), material: "fog"),
        "sky": (light: Sky(radiance: 1))"#,
    );
    let expected = (-2.0_f64).exp();
    render(&text, (16, 16), 1024).mean().assert_agrees("2 m", expected, 5e-3);
}

/// What glows is as bright as it is deep, less what it absorbs (closed form `ε·(1 − exp(−σd))/σ`); where it scatters
/// without absorbing, all of it comes out: the flux through a border, seen from everywhere, is that of its volume.
#[test]
fn media_glow() {
    let slab = |fog: &str| {
        in_fog(
            "",
            fog,
            r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1))),
            "flame": (shape: Box(size: (9, 9, 3)), material: "fog")"#,
        )
    };
    let absorbs = "Dielectric(ior: 1, emission: (2, 2, 2), attenuation: (color: (0.60653066, 0.60653066, 0.60653066)))";
    let seen = render(&slab(absorbs), (4, 4), 4).mean();
    seen.assert_agrees("absorbing", 3.107_479_4, 1e-6);
    // By symmetry a ball which scatters looks the same from everywhere: its mean over the disk that is seen, times π·πR²·4
    // is the flux 4π·ε·4πR³/3.
    let ball = in_fog(
        "roulette_depth: 2000, max_depth: 2000",
        "Dielectric(ior: 1, emission: (2, 2, 2), scattering: (coefficient: (1.5, 1.5, 1.5), phase: HenyeyGreenstein(0.3)))",
        r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(2))),
        "flame": (shape: Sphere(radius: 1), material: "fog")"#,
    );
    let expected = 2.0 * 4.0 / 3.0 * std::f64::consts::FRAC_PI_4;
    render(&ball, (16, 16), 1024).mean().assert_agrees("scattering", expected, 3e-3);
}

/// A camera on the border of a medium is in what it looks into: of a box of 3 m, of a ball of 2 m across the middle, and of nothing
/// when it looks away; along the border nothing goes wrong.
#[test]
fn a_camera_may_stand_on_the_border() {
    let shapes = [("Box(size: (9, 9, 3))", -1.5, 3.0), ("Sphere(radius: 1)", -1.0, 2.0)];
    for (shape, centre, depth) in shapes {
        for (towards, expected) in [
            ((0.0, 0.0, -1.0), Some(f64::exp(-0.5 * depth))),
            ((0.0, 0.0, 1.0), Some(1.0)),
            ((1.0, 0.0, 0.0), None),
        ] {
            for (x, z) in [(0.0, 0.0), (0.1, 300.1)] {
                let (tx, ty, tz) = towards;
                let text = in_fog(
                    "",
                    &fog(0.0, 0.5, 0.0),
                    &format!(
                        r#""camera": (transform: (translation: ({x}, 0, {z}), look_at: ({}, {ty}, {})), camera: (fov: 1)),
                        "mist": (transform: (translation: ({x}, 0, {})), shape: {shape}, material: "fog"),
                        "sky": (light: Sky(radiance: 1))"#,
                        x + tx,
                        z + tz,
                        z + centre
                    ),
                );
                let seen = render(&text, (4, 4), 4);
                let mean = seen.mean().mean;
                match expected {
                    // The view is a degree wide: the way is longer towards its corners by 1/cos, at most 8e-5.
                    Some(expected) => {
                        let error = (mean / expected - 1.0).abs();
                        assert!(error < 0.5 * depth * 8e-5 + 4e-6, "{shape} {towards:?}: {mean}");
                    }
                    None => assert!((0.0..=1.0 + 1e-6).contains(&mean), "{shape}: {mean}"),
                }
                assert!(seen.report.warnings.is_empty(), "{:?}", seen.report.warnings);
            }
        }
    }
}

/// A sheet of stone as thin as can be: what it scatters comes back out, what it absorbs is between nothing and what it
/// should be, and every ray that enters it leaves it.
#[test]
fn a_medium_may_have_no_thickness() {
    for (sigma_s, sigma_a) in [(1e9, 0.0), (0.0, 50.0)] {
        let text = in_fog(
            "",
            &fog(sigma_s, sigma_a, 0.0),
            r#""camera": (transform: (translation: (0.3, 0.2, 4), look_at: (0, 0, 0)), camera: (fov: 20)),
            "sheet": (transform: (rotation: (10, 20, 30)), shape: Box(size: (9, 9, 1e-12)), material: "fog"),
            "sky": (light: Sky(radiance: 1))"#,
        );
        let seen = render(&text, (8, 8), 64);
        let mean = seen.mean().mean;
        assert!((mean - 1.0).abs() < 4e-6, "{sigma_s} {sigma_a}: {mean}");
        assert!(seen.report.warnings.is_empty(), "{:?}", seen.report.warnings);
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

/// Photons lose nothing either where nothing is absorbed: a ball of fog under white light, seen through its middle.
/// What photons there are lies beside the ray as on it, so that the disks over which they are gathered make no difference.
#[test]
fn photons_lose_nothing_where_nothing_is_absorbed() {
    for (integrator, sigma, phase) in [
        ("Sppm", 1.0, "HenyeyGreenstein(0.5)"),
        ("PhotonMap, photons: (per_pass: Some(262144))", 2.0, "Isotropic"),
        ("Sppm, photons: (direct: Photons)", 2.0, "Rayleigh"),
    ] {
        let text = in_fog(
            "max_depth: 2000",
            &format!("Dielectric(ior: 1, scattering: (coefficient: ({sigma}, {sigma}, {sigma}), phase: {phase}))"),
            r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(0.6))),
            "cloud": (shape: Sphere(radius: 1), material: "fog"),
            "sky": (light: Sky(radiance: 1))"#,
        )
        .replace("integrator: Path", &format!("integrator: {integrator}"));
        let Estimate { mean, error } = mean_of_seeds(&text, (16, 16), 32);
        println!("{integrator}: {mean} ± {error}");
        assert!(error < 0.01 && (mean - 1.0).abs() < 4.0 * error, "{integrator}: {mean} ± {error}");
    }
}

/// All methods see the same fog: a lamp and a ball of glass in it, which throws a caustic into it, and a floor.
#[test]
fn photons_and_paths_see_the_same_fog() {
    let text = in_fog(
        "roulette_depth: 4, max_depth: 30",
        &fog(0.5, 0.1, 0.4),
        r#""camera": (transform: (translation: (0, 1, 5), look_at: (0, 0.2, 0)), camera: (fov: 40)),
        "air": (shape: Box(size: (6, 6, 12)), material: "fog"),
        "floor": (transform: (translation: (0, -1, 0), rotation: (-90, 0, 0)), shape: Rectangle(size: (8, 8)), material: "grey"),
        "ball": (transform: (translation: (0, 0.2, 0)), shape: Sphere(radius: 0.6), material: "glass"),
        "lamp": (transform: (translation: (0.5, 2, 0)), shape: Sphere(radius: 0.5), emission: Radiance((9, 8, 6)))"#,
    )
    .replace(r#""black":"#, r#""grey": Diffuse(albedo: 0.5), "glass": Dielectric(ior: 1.5, priority: 1), "black":"#);
    let paths = mean_of_seeds(&text, (20, 20), 128);
    for (integrator, samples) in [
        ("Path, caustics: Photons", 64),
        ("Sppm, photons: (per_pass: Some(16384))", 32),
        ("PhotonMap, photons: (per_pass: Some(262144))", 8),
        ("PhotonMap, final_gather: 4, photons: (per_pass: Some(262144))", 8),
    ] {
        let text = text.replace("integrator: Path", &format!("integrator: {integrator}"));
        let photons = mean_of_seeds(&text, (20, 20), samples);
        println!("{integrator} {photons:?} {paths:?}");
        let error = photons.error.hypot(paths.error);
        assert!(error < 0.015 * paths.mean, "{integrator}: ± {error}");
        let difference = (photons.mean - paths.mean).abs();
        assert!(
            difference < 4.0 * error + 0.01 * paths.mean,
            "{integrator}: {photons:?}, {paths:?}"
        );
    }
}

/// No photons start inside what glows: methods which have all light from them say so, and `Auto` takes another.
#[test]
fn photons_of_what_glows_are_refused_in_words() {
    let text = |integrator: &str| {
        in_fog(
            "",
            "Dielectric(ior: 1, emission: (1, 0.5, 0.1))",
            r#""camera": (transform: (translation: (0, 0, 4)), camera: ()),
            "flame": (shape: Sphere(), material: "fog")"#,
        )
        .replace("integrator: Path", &format!("integrator: {integrator}"))
    };
    for integrator in ["Sppm", "PhotonMap"] {
        let told = Simulation::from_description(&scene(&text(integrator))).prepare_frame(0);
        let told = told.expect_err("there are no such photons");
        assert!(matches!(told, RenderError::GlowingSolids(_)), "{told}");
        assert!(told.to_string().contains("`integrator: Path`"), "{told}");
    }
    for integrator in ["Path", "Path, caustics: Photons", "Auto"] {
        let frame = Simulation::from_description(&scene(&text(integrator))).prepare_frame(0);
        assert!(frame.is_ok(), "{integrator}");
    }
}
