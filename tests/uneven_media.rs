//! Solids whose density is uneven: against closed forms, quadrature, and media of even density.

mod common;

use common::{mean_of_seeds, render, render_description, scene};
use kinora::description::{LoadOptions, load_scene};
use kinora::frame::{RenderControl, Simulation};

/// A scene with the material `fog`, whose density is the texture `density`.
fn in_fog(settings: &str, fog: &str, textures: &str, entities: &str) -> String {
    format!(
        r#"(render: (filter: Box(), integrator: Path, {settings}),
        textures: {{ {textures} }},
        materials: {{
            "fog": Dielectric(ior: 1, density: "density", {fog}),
            "black": Diffuse(albedo: 0),
        }},
        entities: {{ {entities} }})"#
    )
}

const SCATTERS: &str = "scattering: (coefficient: (1, 1, 1))";
const CLOUDS: &str = r#""density": Noise(size: 0.6, octaves: 4, a: 0, b: 6)"#;
/// Orthographic, along −z through the origin.
const CAMERA: &str = r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1)))"#;

/// White light from all around clouds which absorb nothing stays white: paths.
#[test]
fn nothing_is_lost_where_nothing_is_absorbed() {
    for density in [CLOUDS, r#""density": Cells(size: 0.4, a: 5, b: 0)"#] {
        let text = in_fog(
            "roulette_depth: 2000, max_depth: 2000",
            "scattering: (coefficient: (1, 1, 1), phase: HenyeyGreenstein(0.5))",
            density,
            r#""camera": (transform: (translation: (0, 0, 4)), camera: (fov: 20)),
            "cloud": (shape: Sphere(radius: 1), material: "fog"),
            "sky": (light: Sky(radiance: 1))"#,
        );
        let seen = render(&text, (8, 8), 2048);
        seen.mean().assert_agrees(density, 1.0, 2e-3);
        assert!(seen.report.warnings.is_empty(), "{:?}", seen.report.warnings);
    }
}

/// Beer and Lambert, channel by channel: `exp(−σ∫ρ)` for densities that grow linearly and decay exponentially, of a solid
/// that is turned, scaled and moved, so that its own z is along the view; what is seen through it, and what arrives behind
/// it from the sun.
#[test]
fn what_is_left_is_that_of_the_closed_form() {
    // Along 2 m of its own, 6 m of the scene.
    let linear = r#""density": Ramp(from: (0, 0, -1), to: (0, 0, 1), a: 0, b: 1)"#;
    let exponential =
        r#""density": Ramp(from: (0, 0, -1), to: (0, 0, 1), a: 1, b: 0.01, falloff: Exponential)"#;
    let rate = -(0.01_f64.ln()) / 2.0;
    let decayed = (1.0 - (-2.0 * rate).exp()) / rate;
    for (density, integral) in [(linear, 3.0), (exponential, 3.0 * decayed)] {
        let colors = "attenuation: (color: (0.9, 0.6, 0.3))";
        let box_of_fog = r#""mist": (transform: (translation: (5, 0, -3), rotation: (0, 180, 0), scale: 3), shape: Box(size: (4, 4, 2)), material: "fog")"#;
        let seen_through = in_fog(
            "max_depth: 1",
            colors,
            density,
            &format!(r#"{CAMERA}, {box_of_fog}, "sky": (light: Sky(radiance: 1))"#),
        );
        let lit_through = in_fog(
            "max_depth: 1",
            colors,
            density,
            &format!(
                r#""camera": (transform: (translation: (0, 0, -8), look_at: (0, 0, -9)), camera: (orthographic: Some(0.1))), {box_of_fog},
                "screen": (transform: (translation: (0, 0, -9)), shape: Rectangle(size: (9, 9)), material: "white"),
                "sun": (light: Directional(irradiance: (1, 1, 1)))"#
            ),
        )
        .replace(r#""black":"#, r#""white": Diffuse(albedo: 1), "black":"#);
        let pi = std::f64::consts::PI;
        for (text, full) in [(seen_through, 1.0), (lit_through, 1.0 / pi)] {
            let picture = render(&text, (16, 16), 1024);
            let error = picture.mean().error / picture.mean().mean;
            assert!(error < 5e-3, "{error}");
            let found = picture.mean_of_channels();
            for (channel, color) in [0.9_f64, 0.6, 0.3].into_iter().enumerate() {
                let expected = full * color.powf(integral);
                let off = found[channel] / expected - 1.0;
                // The thickest channel is noisiest; its error is at most that of a coin.
                let coin = ((1.0 / color.powf(integral) - 1.0) / (256.0 * 1024.0)).sqrt();
                assert!(off.abs() < 4.0 * coin.max(error), "{density} {channel}: off by {off}");
            }
        }
    }
}

/// Density 1/2 by a texture is the half of all coefficients: the plane albedo of a half-space (Chandrasekhar 1960), and light
/// of a lamp scattered once, where both ways to find it share it.
#[test]
fn an_even_texture_is_an_even_medium() {
    let half = r#""density": Gradient(a: 0.5, b: 0.5)"#;
    let slab = in_fog(
        "roulette_depth: 30, max_depth: 4000",
        "scattering: (coefficient: (1, 1, 1)), attenuation: (color: (0.36787945, 0.36787945, 0.36787945))",
        half,
        r#""camera": (transform: (translation: (0, 0, 6), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1))),
        "slab": (transform: (translation: (0, 0, -25)), shape: Box(size: (400, 400, 50)), material: "fog"),
        "sky": (light: Sky(radiance: 1))"#,
    );
    render(&slab, (16, 16), 1024).mean().assert_agrees("half-space", 0.115_225_9, 5e-3);
    for (sigma_s, sigma_a, expected, samples) in
        [(0.2, 0.0, 0.019_062_869_5, 1024), (1.0, 1.0, 0.000_623_379_814, 6144)]
    {
        let text = in_fog(
            "max_depth: 1",
            &format!(
                "scattering: (coefficient: ({0}, {0}, {0})), attenuation: (color: ({1}, {1}, {1}))",
                2.0 * sigma_s,
                f64::exp(-2.0 * sigma_a)
            ),
            half,
            r#""camera": (transform: (translation: (0, 0, 2), look_at: (0, 0, 0)), camera: (orthographic: Some(1e-4))),
            "room": (shape: Sphere(radius: 200), material: "fog"),
            "wall": (transform: (translation: (0, 0, -3)), shape: Rectangle(size: (1, 1)), material: "black"),
            "lamp": (transform: (translation: (0, 1, 0)), light: Point(intensity: (1, 1, 1)))"#,
        );
        let seen = render(&text, (16, 16), samples).mean();
        seen.assert_agrees(&format!("airlight, {sigma_s}"), expected, 1e-2);
    }
}

/// A lamp beside a ray through a density which grows along it, scattered once: quadrature in f64.
#[test]
fn light_is_scattered_once_as_quadrature_says() {
    // 5 m along −z from (0, 0, 2) to a black wall; the lamp is 1 m beside the origin; ρ(z) = (3 − z)/5 in a box from −3 to 2.
    let sigma = 0.8;
    let rho = |z: f64| (2.0 - z) / 5.0 + 0.1;
    // ∫ρ between two heights.
    let depth = |a: f64, b: f64| {
        let f = |z: f64| 0.5 * z - z * z / 10.0;
        (f(a) - f(b)).abs()
    };
    let (n, mut expected) = (20_000, 0.0);
    for k in 0..n {
        let z = 2.0 - 5.0 * (f64::from(k) + 0.5) / f64::from(n);
        let distance2 = 1.0 + z * z;
        // The way to the lamp rises from z to 0: the mean density on it is that between the heights.
        let to_lamp = if z == 0.0 {
            rho(0.0) * distance2.sqrt()
        } else {
            depth(z, 0.0) / z.abs() * distance2.sqrt()
        };
        let left = (-sigma * (depth(2.0, z) + to_lamp)).exp();
        expected +=
            sigma * rho(z) * left / (4.0 * std::f64::consts::PI * distance2) * 5.0 / f64::from(n);
    }
    let text = |integrator: &str| {
        in_fog(
            "max_depth: 1",
            "scattering: (coefficient: (0.8, 0.8, 0.8))",
            r#""density": Ramp(from: (0, 0, 2), to: (0, 0, -3), a: 0.1, b: 1.1)"#,
            r#""camera": (transform: (translation: (0, 0, 1.9999999), look_at: (0, 0, 0)), camera: (orthographic: Some(1e-4))),
            "air": (transform: (translation: (0, 0, -0.5)), shape: Box(size: (50, 50, 5)), material: "thick"),
            "wall": (transform: (translation: (0, 0, -3)), shape: Rectangle(size: (1, 1)), material: "black"),
            "lamp": (transform: (translation: (0, 1, 0)), light: Point(intensity: (1, 1, 1)))"#,
        )
        .replace("integrator: Path", &format!("integrator: {integrator}"))
        // The box is moved, the density is that of its own space.
        .replace("to: (0, 0, -3)", "to: (0, 0, -2.5)")
        .replace("from: (0, 0, 2)", "from: (0, 0, 2.5)")
        .replace(r#""thick""#, r#""fog""#)
    };
    for integrator in ["Path", "Sppm, photons: (per_pass: Some(1024))"] {
        let seen = render(&text(integrator), (16, 16), 2048).mean();
        seen.assert_agrees(integrator, expected, 1e-2);
    }
}

/// What glows more and more: `∫ε·ρ·exp(−∫σρ)` in closed form for ρ = z/4 over 4 m.
#[test]
fn flames_of_uneven_density_glow() {
    let text = in_fog(
        "",
        "emission: (3, 3, 3), attenuation: (color: (0.1353353, 0.1353353, 0.1353353))",
        r#""density": Ramp(from: (0, 0, 2), to: (0, 0, -2), a: 0, b: 1)"#,
        &format!(r#"{CAMERA}, "flame": (shape: Box(size: (9, 9, 4)), material: "fog")"#),
    );
    let expected = 1.5 * (1.0 - (-4.0_f64).exp());
    render(&text, (16, 16), 1024).mean().assert_agrees("flame", expected, 5e-3);
}

/// All methods see the same clouds: a lamp and a ball of glass in them, which throws a caustic into them, and a floor.
#[test]
fn photons_and_paths_see_the_same_clouds() {
    let text = in_fog(
        "roulette_depth: 4, max_depth: 5",
        "scattering: (coefficient: (0.5, 0.4, 0.3), phase: HenyeyGreenstein(0.4)), attenuation: (color: (0.9, 0.9, 0.8))",
        r#""density": Noise(size: 2, octaves: 2, a: 0, b: 2.5)"#,
        r#""camera": (transform: (translation: (0, 1, 5), look_at: (0, 0.2, 0)), camera: (fov: 40)),
        "air": (shape: Box(size: (6, 6, 12)), material: "fog"),
        "floor": (transform: (translation: (0, -1, 0), rotation: (-90, 0, 0)), shape: Rectangle(size: (8, 8)), material: "grey"),
        "ball": (transform: (translation: (0, 0.2, 0)), shape: Sphere(radius: 0.6), material: "glass"),
        "lamp": (transform: (translation: (0.5, 2, 0)), shape: Sphere(radius: 0.5), emission: Radiance((9, 8, 6)))"#,
    )
    .replace(r#""black":"#, r#""grey": Diffuse(albedo: 0.5), "glass": Dielectric(ior: 1.5, priority: 1), "black":"#);
    let paths = mean_of_seeds(&text, (20, 20), 128);
    for (integrator, samples) in
        [("Path, caustics: Photons", 128), ("Sppm, photons: (per_pass: Some(16384))", 32)]
    {
        let text = text.replace("integrator: Path", &format!("integrator: {integrator}"));
        let photons = mean_of_seeds(&text, (20, 20), samples);
        println!("{integrator} {photons:?} {paths:?}");
        let error = photons.error.hypot(paths.error);
        assert!(error < 0.015 * paths.mean, "{integrator}: ± {error}");
        // 1 % for disks that reach beyond surfaces.
        let difference = (photons.mean - paths.mean).abs();
        assert!(
            difference < 4.0 * error + 0.01 * paths.mean,
            "{integrator}: {photons:?}, {paths:?}"
        );
    }
}

/// Clouds that drift look in one frame as those look which stand where they have got to; over an open shutter
/// they are the mean over the way.
#[test]
fn clouds_drift_with_time() {
    let picture = |density: &str, shutter: &str, frame: i32| {
        let text = in_fog(
            "max_depth: 1",
            "attenuation: (color: (0.3, 0.3, 0.3))",
            density,
            r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(2))),
            "cloud": (shape: Box(size: (2, 2, 1)), material: "fog"),
            "sky": (light: Sky(radiance: 1))"#,
        );
        let clock = format!("(clock: (fps: 2, frames: (0, 4), shutter: {shutter}), ");
        let mut described = scene(&text.replacen('(', &clock, 1));
        (described.render.size, described.render.samples) = ((8, 8), 8192);
        render_description(&described, frame)
    };
    // Bright at the left, and brighter to the right by as much as u is; frame 3 is at 1.5 s.
    let still = |shift: f64| {
        format!(
            r#""density": Ramp(from: ({}, 0, 0), to: ({}, 0, 0), a: 0, b: 3)"#,
            shift - 1.0,
            shift + 1.0
        )
    };
    let drifting = r#""ramp": Ramp(from: (-1, 0, 0), to: (1, 0, 0), a: 0, b: 3), "density": Drift(of: "ramp", velocity: (0.4, 0.1, 0))"#;
    let row = |picture: &common::Picture, x: u32| picture.mean_where(|column, _| column == x);
    let (moved, there) = (picture(drifting, "(0, 0)", 3), picture(&still(0.6), "(0, 0)", 0));
    for x in 0..8 {
        let (a, b) = (row(&moved, x), row(&there, x));
        assert!((a.mean - b.mean).abs() <= 4.0 * a.error.hypot(b.error), "{x}: {a:?} {b:?}");
    }
    // Over the shutter from 1.5 s to 2 s: from 0.6 m to 0.8 m.
    let blurred = picture(drifting, "(0, 1)", 3);
    for x in 2..8 {
        // Within a column and over the shutter exp(−σρ) is the mean of an exponential: sampled finely in f64.
        let sigma = -(0.3_f64.ln());
        let (n, mut expected) = (200, 0.0);
        for k in 0..n * n {
            let (i, j) = (f64::from(k % n) + 0.5, f64::from(k / n) + 0.5);
            let place = -1.0 + (f64::from(x) + i / f64::from(n)) / 4.0;
            let shift = 0.6 + 0.2 * j / f64::from(n);
            let rho = (1.5 * (place - shift + 1.0)).clamp(0.0, 3.0);
            expected += (-sigma * rho).exp() / f64::from(n * n);
        }
        row(&blurred, x).assert_agrees(&format!("column {x}"), expected, 1e-2);
    }
}

/// A grid from a file: the share of light that is left through each of its halves, and nothing outside of its box.
#[test]
fn grids_are_read_from_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = b"VOL\x03".to_vec();
    for word in [1_i32, 2, 1, 1, 1] {
        bytes.extend(word.to_le_bytes());
    }
    for corner in [-1.0_f32, -1.0, -1.0, 1.0, 1.0, 1.0] {
        bytes.extend(corner.to_le_bytes());
    }
    for value in [0.5_f32, 1.0] {
        bytes.extend(value.to_le_bytes());
    }
    std::fs::write(folder.path().join("smoke.vol"), bytes).expect("written");
    let text = in_fog(
        "max_depth: 1, size: (8, 8), samples: 16384",
        "attenuation: (color: (0.5, 0.5, 0.5))",
        r#""density": Grid(file: "smoke.vol")"#,
        r#""camera": (transform: (translation: (0, 0, 4), look_at: (0, 0, 0)), camera: (orthographic: Some(4))),
        "cloud": (shape: Box(size: (4, 4, 4)), material: "fog"),
        "sky": (light: Sky(radiance: 1))"#,
    );
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).expect("written");
    let described = load_scene(&path, &LoadOptions::default()).expect("sound");
    let seen = render_description(&described, 0);
    // Columns of half a metre; the first quarter of the box holds the value of the left cell, the last that of the right.
    for (x, density) in [(2, 0.5_f64), (5, 1.0), (0, 0.0), (7, 0.0)] {
        let column = seen.mean_where(|column, row| column == x && (2..6).contains(&row));
        column.assert_agrees(&format!("column {x}"), 0.5_f64.powf(2.0 * density), 1e-2);
    }
    assert!((seen.at(3, 0).y - 1.0).abs() < 1e-6, "above the grid is nothing");
}

/// A density without an end cannot have bounds, and what is wrong with a density is told.
#[test]
fn what_cannot_be_is_refused_in_words() {
    let endless = in_fog(
        "",
        SCATTERS,
        CLOUDS,
        r#""camera": (transform: (translation: (0, 0, 4)), camera: ()),
        "sea": (shape: Plane(), material: "fog"),
        "sky": (light: Sky(radiance: 1))"#,
    );
    let mut simulation = Simulation::from_description(&scene(&endless));
    let told = simulation.render_frame(0, &RenderControl::default()).map(|_| ());
    let told = told.expect_err("it is endless").to_string();
    assert!(told.contains("`sea` is endless") && told.contains("density"), "{told}");
}
