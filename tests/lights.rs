//! Direct light against closed forms and quadratures.
//!
//! A diffuse white floor at the origin, facing +z, is seen through so narrow a field that every pixel
//! looks at one point: its radiance is `E/π`, with `E` the irradiance there.

mod common;

use common::{Estimate, Picture, mesh_text, render, scene};
use glam::{DQuat, DVec3, Vec3};
use kinora::description::TriangleMesh;
use std::f64::consts::PI;

/// The floor under lamps. Direct light alone.
fn floor(clock: &str, material: &str, lamps: &str, meshes: &str) -> String {
    format!(
        r#"(
        {clock}
        render: (filter: Box(), max_depth: 1),
        materials: {{"floor": {material}, "black": Diffuse(albedo: (0, 0, 0))}},
        meshes: {{ {meshes} }},
        entities: {{
            "camera": (transform: (translation: (0, 0, 0.3)), camera: (fov: 0.01)),
            "floor": (shape: Rectangle(size: (100, 100)), material: "floor"),
            {lamps}
        }})"#
    )
}

/// The irradiance of the floor at the origin.
fn irradiance(clock: &str, lamps: &str, meshes: &str, samples: u32) -> Estimate {
    let text = floor(clock, "Diffuse(albedo: (1, 1, 1))", lamps, meshes);
    scaled(&render(&text, (8, 8), samples), PI)
}

fn scaled(picture: &Picture, factor: f64) -> Estimate {
    let Estimate { mean, error } = picture.mean();
    Estimate { mean: mean * factor, error: error * factor }
}

fn lamp(translation: DVec3, rotation: &str, shape: &str) -> String {
    let DVec3 { x, y, z } = translation;
    format!(
        r#""lamp": (transform: (translation: ({x}, {y}, {z}), {rotation}), shape: {shape}, emission: Radiance((1, 1, 1)))"#
    )
}

const DOWN: &str = "rotation: (180, 0, 0)";

/// Oracle: `E = π·(R/d)²·cos θ` for a whole sphere above the horizon, and numbers from a quadrature for
/// one cut by it.
#[test]
fn spheres_light_a_floor_as_their_cone_says() {
    let cases = [
        (3.0, 0.0_f64, 0.349_065_9),
        (3.0, 60.0, 0.174_532_9),
        (2.0, 80.0, 0.171_832_0),
        (2.0, 90.0, 0.090_586_1),
    ];
    for (distance, tilt, expected) in cases {
        let (sin, cos) = tilt.to_radians().sin_cos();
        let at = DVec3::new(sin, 0.0, cos) * distance;
        let e = irradiance("", &lamp(at, "", "Sphere()"), "", 256);
        e.assert_agrees(&format!("sphere at {tilt}°"), expected, 1.2e-2);
    }
}

/// Oracle: `πR²/(R² + h²)` on the axis; off it `(π/2)(1 − (1 + H² − R'²)/√(Z² − 4R'²))`, 0.4600756 for
/// R = 1, h = 2, offset 1.
#[test]
fn disks_light_a_floor_as_their_closed_form_says() {
    for (offset, expected) in [(0.0, 0.628_318_5), (1.0, 0.460_075_6)] {
        let at = DVec3::new(offset, 0.0, 2.0);
        irradiance("", &lamp(at, DOWN, "Disk()"), "", 256).assert_agrees(
            &format!("disk, offset {offset}"),
            expected,
            5e-3,
        );
    }
}

/// Oracle: the corner terms of a rectangle: over its centre, under its corner, and with half of it
/// below the horizon of the floor.
#[test]
fn rectangles_light_a_floor_as_their_corner_terms_say() {
    let cases = [
        (DVec3::Z, DOWN, "Rectangle()", 0.752_274_7),
        (DVec3::new(1.0, 0.5, 1.0), DOWN, "Rectangle(size: (2, 1))", 0.525_824_1),
        (DVec3::X, "rotation: (0, -90, 0)", "Rectangle()", 0.087_510_3),
    ];
    for (at, rotation, shape, expected) in cases {
        irradiance("", &lamp(at, rotation, shape), "", 256).assert_agrees(shape, expected, 1.2e-2);
    }
}

/// `E = ½ Σ Θᵢ n·Γᵢ` of a polygon above the horizon (Lambert 1760); corners counter-clockwise as seen
/// from the origin.
fn lambert(corners: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for (k, a) in corners.iter().enumerate() {
        let (a, b) = (a.normalize(), corners[(k + 1) % corners.len()].normalize());
        sum += a.angle_between(b) * a.cross(b).normalize().z;
    }
    0.5 * sum.abs()
}

/// A parallelogram as two triangles, and a triangle, as meshes which face the origin.
fn facing_origin(corners: &[DVec3]) -> TriangleMesh {
    let [a, b, c] = [corners[0], corners[1], corners[2]];
    let faces = (b - a).cross(c - a).dot(a) < 0.0;
    let triangles: Vec<[u32; 3]> = (2..corners.len() as u32)
        .map(|k| if faces { [0, k - 1, k] } else { [0, k, k - 1] })
        .collect();
    let positions = corners.iter().map(|p| p.as_vec3()).collect();
    TriangleMesh { positions, triangles, ..Default::default() }
}

/// Oracle: Lambert's formula: 0.2589539 with the floor facing z, 0.2312857 with it facing (2, 3, 6)/7.
#[test]
fn triangles_light_a_floor_as_lambert_says() {
    let corners =
        [DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 2.0), DVec3::new(-1.0, -1.0, 3.0)];
    for (normal, expected) in
        [(DVec3::Z, 0.258_953_9), (DVec3::new(2.0, 3.0, 6.0) / 7.0, 0.231_285_7)]
    {
        let turn = DQuat::from_rotation_arc(normal, DVec3::Z);
        let turned = corners.map(|p| turn * p);
        assert!((lambert(&turned) - expected).abs() < 1e-6, "the oracle itself");
        let mesh = mesh_text("lamp", &facing_origin(&turned));
        irradiance("", &lamp(DVec3::ZERO, "", "Mesh(\"lamp\")"), &mesh, 256).assert_agrees(
            &format!("triangle, floor {normal}"),
            expected,
            5e-3,
        );
    }
}

/// The irradiance at the origin, facing z, of a convex surface given by its points and area vectors
/// (outward normal times area) on a grid of parameters.
fn quadrature(n: u32, element: impl Fn(f64, f64) -> (DVec3, DVec3)) -> f64 {
    let mut sum = 0.0;
    for k in 0..n * n {
        let u = (f64::from(k % n) + 0.5) / f64::from(n);
        let v = (f64::from(k / n) + 0.5) / f64::from(n);
        let (p, area) = element(u, v);
        let towards = -p.dot(area);
        if towards > 0.0 && p.z > 0.0 {
            sum += p.z * towards / p.length_squared().powi(2);
        }
    }
    sum / f64::from(n * n)
}

/// Point and area vector by central differences of a map from the unit square.
fn element(at: impl Fn(f64, f64) -> DVec3) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let h = 1e-5;
        let du = (at(u + h, v) - at(u - h, v)) / (2.0 * h);
        let dv = (at(u, v + h) - at(u, v - h)) / (2.0 * h);
        (at(u, v), du.cross(dv))
    }
}

/// An exact ball of radius 1 from rational curves.
const BALL: &str = "Revolution(profile: Bezier(points: [(0, -1), (0.5857864376269049, -1), (1, -0.5857864376269049), (1, 0), (1, 0.5857864376269049), (0.5857864376269049, 1), (0, 1)], weights: [1, 0.8047378541243649, 0.8047378541243649, 1, 0.8047378541243649, 0.8047378541243649, 1]))";

/// Oracle: a midpoint rule of 1000² points over the visible (convex) surface, in `f64`. The shapes
/// without a rule of their own for drawing are drawn by area: boxes, cylinders, cones, surfaces of
/// revolution, and spheres that are stretched.
#[test]
fn all_other_shapes_light_a_floor_as_a_quadrature_says() {
    let turn = DQuat::from_rotation_x(40_f64.to_radians());
    let place = move |p: DVec3| turn * p + DVec3::new(0.3, 0.2, 2.0);
    let circle = |u: f64| (std::f64::consts::TAU * u).sin_cos();
    // (u, v) runs so that the normal points outwards
    let side = quadrature(
        1000,
        element(|u, v| {
            let (s, c) = circle(u);
            place(DVec3::new(0.6 * s, 0.9 * (v - 0.5), 0.6 * c))
        }),
    );
    let cap = |y: f64, sign: f64| {
        quadrature(
            1000,
            element(move |u, v| {
                let (s, c) = circle(sign * u);
                place(DVec3::new(0.6 * v * c, y, 0.6 * v * s))
            }),
        )
    };
    let slope = quadrature(
        1000,
        element(|u, v| {
            let (s, c) = circle(u);
            place(DVec3::new(0.6 * (1.0 - v) * s, 0.9 * (v - 0.5), 0.6 * (1.0 - v) * c))
        }),
    );
    let ellipsoid = quadrature(
        1000,
        element(|u, v| {
            let ((s, c), (st, ct)) = (circle(u), (PI * v).sin_cos());
            place(DVec3::new(0.5 * st * s, -0.3 * ct, 0.8 * st * c))
        }),
    );
    let face = |axis: usize, sign: f64| {
        quadrature(
            1000,
            element(move |u, v| {
                let half = DVec3::new(0.4, 0.3, 0.5);
                let mut p = DVec3::ZERO;
                p[axis] = sign * half[axis];
                let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                p[a] = sign * half[a] * (2.0 * u - 1.0);
                p[b] = half[b] * (2.0 * v - 1.0);
                place(p)
            }),
        )
    };
    let faces: f64 = (0..3).map(|axis| face(axis, 1.0) + face(axis, -1.0)).sum();
    let (lower, upper) = (cap(-0.45, -1.0), cap(0.45, 1.0));
    let cases = [
        ("Cylinder(radius: 0.6, height: 0.9, capped: true)", "(1, 1, 1)", side + lower + upper),
        ("Cone(radius: 0.6, height: 0.9)", "(1, 1, 1)", slope + lower),
        ("Sphere()", "(0.5, 0.3, 0.8)", ellipsoid),
        (
            "Revolution(profile: Lines(points: [(1, -0.5), (1, 0.5)]), capped: true)",
            "(0.6, 0.9, 0.6)",
            side + lower + upper,
        ),
        (
            "Revolution(profile: Lines(points: [(0, 0.45), (0.6, -0.45), (0, -0.45)]))",
            "(1, 1, 1)",
            slope + lower,
        ),
        (BALL, "(0.5, 0.3, 0.8)", ellipsoid),
        ("Box(size: (0.8, 0.6, 1))", "(1, 1, 1)", faces),
        ("Box()", "(0.8, 0.6, 1)", faces),
    ];
    for (shape, scale, expected) in cases {
        let lamp = lamp(
            DVec3::new(0.3, 0.2, 2.0),
            &format!("rotation: (40, 0, 0), scale: {scale}"),
            shape,
        );
        irradiance("", &lamp, "", 1024).assert_agrees(shape, expected, 8e-3);
    }
}

/// Oracle: what a lamp gives does not depend on how it is found. A rough metal under a small and a
/// large lamp sees it by light samples, by its own samples, or both: the mirror image of an emitter
/// seen in white metal of any roughness, with the whole sky filled by one emitting sphere, is 1.
#[test]
fn light_samples_and_chance_share_the_light_at_every_roughness() {
    for roughness in [0.0, 0.05, 0.2, 0.5, 1.0] {
        for radius in [1.0, 50.0] {
            // The camera and the floor stand inside the sphere; the floor's disk is small.
            let text = format!(
                r#"(
                render: (filter: Box(), max_depth: 1),
                materials: {{"metal": Conductor(f0: Some((1, 1, 1)), roughness: {roughness})}},
                entities: {{
                    "camera": (transform: (translation: (0.2, 0.1, 0.3), look_at: (0, 0, 0)), camera: (fov: 0.01)),
                    "metal": (shape: Disk(radius: 0.01), material: "metal"),
                    "around": (shape: Sphere(radius: {radius}), two_sided: true, emission: Radiance((1, 1, 1))),
                }})"#
            );
            let mean = render(&text, (8, 8), 1024).mean();
            // The tables of the metal's further bounces are good to 2·10⁻³.
            assert!(
                (mean.mean - 1.0).abs() <= 3.0 * mean.error + 2e-3,
                "{roughness}, {radius}: {mean:?}"
            );
            assert!(mean.error < 4e-3, "{roughness}, {radius}: {mean:?}");
        }
    }
}

/// Three lamps of very different power and kind.
const THREE: [&str; 3] = [
    r#""a": (transform: (translation: (1, 0, 2), rotation: (180, 0, 0)), shape: Disk(radius: 0.3), emission: Radiance((1000, 1000, 1000)))"#,
    r#""b": (transform: (translation: (-1, 0, 1)), shape: Sphere(radius: 0.2), emission: Radiance((1, 1, 1)))"#,
    r#""c": (transform: (translation: (0, 1, 1.5)), light: Point(intensity: (2, 2, 2)))"#,
];

/// Oracle: light adds up.
#[test]
fn many_lights_equal_the_sum_of_each_alone() {
    let alone: Vec<Estimate> = THREE.iter().map(|lamp| irradiance("", lamp, "", 512)).collect();
    let together = irradiance("", &THREE.join(", "), "", 512);
    let sum: f64 = alone.iter().map(|e| e.mean).sum();
    let error = alone.iter().map(|e| e.error.powi(2)).sum::<f64>() + together.error.powi(2);
    Estimate { mean: together.mean, error: error.sqrt() }.assert_agrees("three lamps", sum, 5e-3);
    // without the strong one, which would hide a mistake in the others
    let weak = irradiance("", &THREE[1..].join(", "), "", 512);
    let sum = alone[1].mean + alone[2].mean;
    weak.assert_agrees("two lamps", sum, 5e-3);
}

/// Oracle: a square of one large and 999 tiny triangles is the square of the corner terms.
#[test]
fn a_lamp_of_uneven_triangles_equals_the_rectangle() {
    // A fan around one corner: the first triangle takes half the square, slivers the rest.
    let mut corners =
        vec![DVec3::new(-0.5, -0.5, 1.0), DVec3::new(0.5, -0.5, 1.0), DVec3::new(0.5, 0.5, 1.0)];
    for k in 1..=999 {
        corners.push(DVec3::new(0.5 - f64::from(k) / 999.0, 0.5, 1.0));
    }
    let mesh = mesh_text("lamp", &facing_origin(&corners));
    irradiance("", &lamp(DVec3::ZERO, "", "Mesh(\"lamp\")"), &mesh, 512).assert_agrees(
        "fan",
        0.752_274_7,
        5e-3,
    );
}

/// Oracle: nothing comes through an opaque screen, and nothing from the back of a one-sided lamp,
/// neither to the floor nor to the camera.
#[test]
fn screens_hide_lamps_and_one_sided_lamps_are_black_from_behind() {
    let screen = r#""screen": (transform: (translation: (0, 0, 0.7)), shape: Rectangle(size: (9, 9)), material: "black"), "#;
    for (hides, lamp) in [
        (screen, lamp(DVec3::Z, DOWN, "Rectangle()")),
        (
            screen,
            r#""lamp": (transform: (translation: (0, 0, 1)), light: Point(intensity: (1, 1, 1)))"#
                .to_owned(),
        ),
        ("", lamp(DVec3::Z, "", "Rectangle()")),
        ("", lamp(DVec3::Z, "", "Disk()")),
    ] {
        let e = irradiance("", &format!("{hides}{lamp}"), "", 64);
        assert_eq!(e.mean, 0.0, "{lamp}");
    }
    for (two_sided, from, expected) in [(false, 1, 1.0), (false, -1, 0.0), (true, -1, 1.0)] {
        let text = format!(
            r#"(entities: {{
                "camera": (transform: (translation: (0, 0, {from}), look_at: (0, 0, 0)), camera: (fov: 10)),
                "lamp": (shape: Disk(), two_sided: {two_sided}, emission: Radiance((1, 1, 1))),
            }})"#
        );
        assert_eq!(render(&text, (4, 4), 4).mean().mean, expected, "{two_sided}, from {from}");
    }
}

/// Oracle: a lamp of flux Φ and area A has the radiance `Φ/(π·A)`, a two-sided one half of it.
#[test]
fn a_lamp_of_given_power_has_the_radiance_of_its_area() {
    let lens = DVec3::new(0.0, 0.0, 3.0);
    let cases = [
        ("Sphere(radius: 0.5)", false, PI * PI),
        ("Rectangle(size: (2, 1))", false, 2.0 * PI),
        ("Disk(radius: 0.5)", true, 0.5 * PI * PI),
        ("Box(size: (1, 2, 3))", false, 22.0 * PI),
        ("Cylinder(radius: 0.5, height: 2)", false, 2.5 * PI * PI),
        ("Cone(radius: 3, height: 4)", false, 24.0 * PI * PI),
        (
            "Revolution(profile: Lines(points: [(3, -2), (0, 2)]), capped: true)",
            false,
            24.0 * PI * PI,
        ),
    ];
    for (shape, two_sided, area_pi) in cases {
        let text = format!(
            r#"(entities: {{
                "camera": (transform: (translation: (0, 0, {})), camera: (fov: 0.1)),
                "lamp": (shape: {shape}, two_sided: {two_sided}, emission: Power((7, 7, 7))),
            }})"#,
            lens.z
        );
        let seen = render(&text, (2, 2), 2).mean().mean;
        assert!(
            (seen / (7.0 / area_pi) - 1.0).abs() < 1e-5,
            "{shape}: {seen} instead of {}",
            7.0 / area_pi
        );
    }
}

/// Oracles: `I·cos θ/d²`; a spot is a point inside its inner cone and nothing outside the outer one;
/// a distant light has the irradiance `E·cos θ` at any angular size as long as it is wholly up.
#[test]
fn lights_without_shape_have_their_closed_forms() {
    let cases = [
        ("translation: (3, 0, 4)", "Point(intensity: (50, 50, 50))", 50.0 * 0.8 / 25.0),
        ("translation: (0, 0, 2)", "Point(power: (1, 1, 1))", 1.0 / (16.0 * PI)),
        ("translation: (0, 0, 2)", "Spot(intensity: (1, 1, 1))", 0.25),
        (
            "translation: (2, 0, 2), look_at: (0, 0, 0), up: (0, 1, 0)",
            "Spot(intensity: (1, 1, 1), angle: 10)",
            0.125 * 0.5_f64.sqrt(),
        ),
        ("translation: (2, 0, 2)", "Spot(intensity: (1, 1, 1), angle: 44)", 0.0),
        (
            "translation: (2, 0, 2)",
            "Spot(intensity: (1, 1, 1), angle: 60, blend: 0.2)",
            0.125 * 0.5_f64.sqrt(),
        ),
        ("rotation: (0, 60, 0)", "Directional(irradiance: (2, 2, 2))", 1.0),
        ("rotation: (0, 60, 0)", "Directional(irradiance: (2, 2, 2), angle: 0.53)", 1.0),
        ("rotation: (0, 60, 0)", "Directional(irradiance: (2, 2, 2), angle: 30)", 1.0),
        ("rotation: (0, 0, 0)", "Sky(radiance: (2, 2, 2))", 2.0 * PI),
    ];
    for (place, light, expected) in cases {
        let e =
            irradiance("", &format!(r#""lamp": (transform: ({place}), light: {light})"#), "", 256);
        assert!(
            (e.mean - expected).abs() <= 3.0 * e.error + 1e-5 * expected,
            "{light} at {place}: {e:?}, {expected}"
        );
        assert!(e.error <= 4e-3 * expected, "{light}: {e:?}");
    }
}

/// Oracle: the mean of the irradiance over the motion, not the irradiance of the mean place:
/// `I/(h·√(a² + h²)) = 0.05` for a point from −3 to 3 at height 4, `πR²/(h·√(a² + h²))` for a sphere.
#[test]
fn moving_lights_give_the_mean_over_their_path() {
    let clock = "clock: (fps: 1, shutter: (0, 1)),";
    let point = r#""lamp": (transform: (translation: (-3, 0, 4)), velocity: (linear: (6, 0, 0)), light: Point(intensity: (1, 1, 1)))"#;
    irradiance(clock, point, "", 512).assert_agrees("point", 0.05, 4e-3);
    let sphere = r#""lamp": (transform: (translation: (-2, 0, 2)), velocity: (linear: (4, 0, 0)), shape: Sphere(radius: 0.2), emission: Radiance((1, 1, 1)))"#;
    irradiance(clock, sphere, "", 512).assert_agrees("sphere", 0.022_214_4, 5e-3);
}

/// Oracle: a mean of keyed strengths over the shutter: a linear fade from 0 to 2 shines like 1.
#[test]
fn a_fading_lamp_shines_with_its_mean() {
    let clock = "clock: (fps: 1, shutter: (0, 1)),";
    let fade = "keyframes: (emission: (keys: [(0, 0), (1, 2)]))";
    let lamp = format!(
        r#""lamp": (transform: (translation: (0, 0, 1), rotation: (180, 0, 0)), {fade}, shape: Rectangle(), emission: Radiance((1, 1, 1)))"#
    );
    irradiance(clock, &lamp, "", 256).assert_agrees("fade", 0.752_274_7, 5e-3);
}

/// Oracle: `E = L·Δφ·½(sin²θ₂ − sin²θ₁)` of one bright texel in a black map, θ from the zenith: the
/// light of the map is found although it fills one direction in 8192.
#[test]
fn one_bright_texel_of_a_map_lights_the_floor() {
    use kinora::description::{
        Channel, Encoding, ImageData, ImagePixels, Texture, TextureFilter, Wrap,
    };
    // The map's top is +y: the lamp's rotation brings it to +z.
    let sky = r#""sky": (transform: (rotation: (90, 0, 0)), light: Sky(radiance: "map"))"#;
    let text = floor("", "Diffuse(albedo: (1, 1, 1))", sky, "");
    let text = text.replacen("materials:", "textures: {\"map\": Checker()}, materials:", 1);
    let mut description = scene(&text);
    (description.render.size, description.render.samples) = ((8, 8), 512);
    let (width, height, row) = (128_u32, 64_u32, 20);
    let mut pixels = vec![[0.0, 0.0, 0.0, 1.0]; (width * height) as usize];
    pixels[(row * width + 37) as usize] = [1e6, 1e6, 1e6, 1.0];
    let file = ImageData { width, height, pixels: ImagePixels::Rgba32F(pixels) };
    let image = Texture::Image {
        file: file.into(),
        encoding: Encoding::Linear,
        wrap: Wrap::Repeat,
        filter: TextureFilter::Nearest,
        channel: Channel::Luminance,
        repeat: glam::Vec2::ONE,
        offset: glam::Vec2::ZERO,
    };
    description.textures.insert("map".to_owned(), image);
    let e = scaled(&common::render_description(&description, 0), PI);
    let theta = |k: u32| PI * f64::from(k) / f64::from(height);
    let strip = 0.5 * (theta(row + 1).sin().powi(2) - theta(row).sin().powi(2));
    let expected = 1e6 * 2.0 * PI / f64::from(width) * strip;
    // The floor faces one way only if the texel is above it, which the row above the middle is.
    e.assert_agrees("texel", expected, 1.2e-2);
}

/// Oracle: colours keep their strengths side by side over sixty orders of magnitude; here as far as
/// scene files go.
#[test]
fn very_bright_and_very_dim_lamps_stand_side_by_side() {
    let text = r#"(
        render: (filter: Box()),
        entities: {
            "camera": (transform: (translation: (0, 0, 2)), camera: (fov: 40)),
            "bright": (transform: (translation: (-1, 0, 0)), shape: Rectangle(size: (2, 8)), emission: Radiance((1e18, 1e18, 1e18))),
            "dim": (transform: (translation: (1, 0, 0)), shape: Rectangle(size: (2, 8)), emission: Radiance((1e-18, 1e-18, 1e-18))),
        })"#;
    let picture = render(text, (4, 2), 16);
    assert_eq!([picture.at(0, 0), picture.at(3, 1)], [Vec3::splat(1e18), Vec3::splat(1e-18)]);
}

/// Oracle: a textured lamp gives the mean of what its texture says to a distant floor.
#[test]
fn a_textured_lamp_shines_with_its_mean_from_afar() {
    let text = floor(
        "",
        "Diffuse(albedo: (1, 1, 1))",
        r#""lamp": (transform: (translation: (0, 0, 20), rotation: (180, 0, 0)), shape: Rectangle(), emission: Radiance("checks"))"#,
        "",
    );
    let checks =
        r#"textures: {"checks": Checker(size: 0.25, a: (3, 3, 3), b: (1, 1, 1))}, materials:"#;
    let text = text.replacen("materials:", checks, 1);
    let e = scaled(&render(&text, (8, 8), 256), PI);
    // `2·A/d²` but for (size/d)² ≈ 2.5·10⁻³ of it, of which half
    let corners =
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| DVec3::new(x, y, 20.0));
    e.assert_agrees("checks", 2.0 * lambert(&corners), 5e-3);
}

/// A lamp with holes over a floor that a camera from below the lamp sees: `lamp` says its shape and material.
fn under_holes(lamp: &str, settings: &str) -> String {
    format!(
        r#"(
        render: (filter: Box(), {settings}),
        textures: {{ "half": Checker(size: 0.125, a: 0, b: 1) }},
        meshes: {{ "square": Triangles(positions: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], triangles: [(0, 1, 2), (0, 2, 3)], uvs: [(0, 0), (1, 0), (1, 1), (0, 1)]) }},
        materials: {{
            "floor": Diffuse(albedo: 0.5), "black": Diffuse(albedo: 0),
            "whole": Masked(opacity: 1, material: "black"),
            "quarter": Masked(opacity: 0.25, material: "black"),
            "none": Masked(opacity: 0, material: "black"),
            "checked": Masked(opacity: "half", material: "black"),
            "mixed": Mix(a: "quarter", b: "black", amount: 0.25),
        }},
        entities: {{
            "camera": (transform: (translation: (0, 0.5, 0), rotation: (-90, 0, 0)), camera: (fov: 20)),
            "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (8, 8)), material: "floor"),
            "lamp": (transform: (translation: (0, 2, 0), rotation: (90, 0, 0)), {lamp}),
        }})"#
    )
}

/// Oracle: the floor under the whole lamp, times the mean opacity, and 0 without. A lamp of two sides which one sees through is seen
/// twice, from the inside as well: a sphere of opacity `o` is `o·(2 − o)` as bright. By light rays and chance, and by photons.
#[test]
fn a_lamp_lights_by_as_much_as_its_holes_leave() {
    let sphere = "shape: Sphere(radius: 0.5), two_sided: true";
    let lamps = [
        ("shape: Disk(radius: 1)", "none", 0.0),
        ("shape: Disk(radius: 1)", "quarter", 0.25),
        ("shape: Rectangle(size: (2, 2))", "mixed", 0.4375),
        ("shape: Rectangle(size: (2, 2))", "checked", 0.5),
        (r#"shape: Mesh("square")"#, "checked", 0.5),
        ("shape: Disk(radius: 1), velocity: (linear: (0.1, 0, 0))", "quarter", 0.25),
        ("shape: Sphere(radius: 0.5)", "quarter", 0.25),
        (sphere, "quarter", 0.4375),
    ];
    for settings in [
        "integrator: Path",
        "integrator: Sppm, photons: (direct: Photons, per_pass: Some(1024), radius: 20)",
    ] {
        for (shape, material, share) in lamps {
            let of = |material: &str| {
                let lamp = format!(r#"{shape}, material: "{material}", emission: Radiance(3)"#);
                common::mean_of_seeds(&under_holes(&lamp, settings), (6, 6), 16)
            };
            let (found, whole) = (of(material), of("whole"));
            let expected = share * whole.mean;
            let what = format!("{settings}, {shape}, {material}: {found:?}, {expected}");
            let error = found.error.hypot(share * whole.error);
            assert!((found.mean - expected).abs() <= 4.0 * error + 1e-3 * expected, "{what}");
            // The far side of the sphere is met by chance alone: one path in eighty.
            assert!(error <= 0.15 * expected, "{what}");
        }
    }
}
