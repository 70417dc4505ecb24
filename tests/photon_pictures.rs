//! Pictures by the methods with photons: against closed forms, against path tracing, and the same bits.

mod common;

use common::{Estimate, Picture, render_description, scene};
use kinora::description::SceneDescription;

/// Renders with several seeds: neighbouring pixels share their photons, so that only whole pictures are
/// independent.
fn seeds(description: &SceneDescription, count: u64) -> Vec<Picture> {
    (0..count)
        .map(|seed| {
            let mut description = description.clone();
            description.render.seed = 100 + seed;
            render_description(&description, 0)
        })
        .collect()
}

/// The mean over the pixels chosen, its error from the spread over the pictures.
fn mean_over(pictures: &[Picture], chosen: impl Fn(u32, u32) -> bool + Copy) -> Estimate {
    let means: Vec<f64> = pictures.iter().map(|p| p.mean_where(chosen).mean).collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Estimate { mean, error: (variance / n).sqrt() }
}

fn described(text: &str, settings: &str, size: (u32, u32), samples: u32) -> SceneDescription {
    let mut description = scene(&text.replace("SETTINGS", settings));
    (description.render.size, description.render.samples) = (size, samples);
    description
}

/// A closed diffuse sphere of radius 1 with a point light at its centre.
const SPHERE: &str = r#"(
    render: (filter: Box(), SETTINGS),
    materials: {"wall": Diffuse(albedo: 0.5)},
    entities: {
        "camera": (transform: (translation: (0.2, -0.1, 0.3), look_at: (0, 0, -1)), camera: (fov: 70)),
        "wall": (shape: Sphere(radius: 1), material: "wall"),
        "light": (light: Point(intensity: Some((3.14159265, 3.14159265, 3.14159265)))),
    })"#;

/// Oracle: intensity π, albedo ½: `ρI/(πR²(1 − ρ)) = 1` everywhere. At every size of picture, also with
/// disks as large as the scene allows: no photon is counted twice, none is lost at a rim.
#[test]
fn a_lit_diffuse_sphere_reads_one_at_every_size() {
    for direct in ["Sampled", "Photons"] {
        for (side, passes) in [(1, 32), (4, 16), (10, 8), (256, 1)] {
            let settings =
                format!("integrator: Sppm, photons: (direct: {direct}, per_pass: Some(8192))");
            let description = described(SPHERE, &settings, (side, side), passes);
            let mean = mean_over(&seeds(&description, 4), |_, _| true);
            let what = format!("{direct}, {side} pixels");
            assert!((mean.mean - 1.0).abs() < 4.0 * mean.error + 2e-3, "{what}: {mean:?}");
            assert!(mean.error < 0.02, "{what}: {mean:?}");
        }
    }
}

/// Flat water of index 1.333 over a floor, between four perfect mirrors, under an even sky of radiance 1;
/// the camera is in the water.
const WATER: &str = r#"(
    render: (filter: Box(), SETTINGS),
    materials: {"floor": Diffuse(albedo: 0.5), "mirror": Mirror(), "water": Dielectric(ior: 1.333)},
    entities: {
        "camera": (transform: (translation: (0.1, 0.5, 0.1), rotation: (-90, 0, 0)), camera: (fov: 60)),
        "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (2, 2)), material: "floor"),
        "water": (transform: (translation: (0, 1, 0), rotation: (-90, 0, 0)), shape: Rectangle(size: (2, 2)), material: "water"),
        "w0": (transform: (translation: (0, 0.5, -1)), shape: Rectangle(size: (2, 1)), material: "mirror"),
        "w1": (transform: (translation: (0, 0.5, 1)), shape: Rectangle(size: (2, 1)), material: "mirror"),
        "w2": (transform: (translation: (-1, 0.5, 0), rotation: (0, 90, 0)), shape: Rectangle(size: (2, 1)), material: "mirror"),
        "w3": (transform: (translation: (1, 0.5, 0), rotation: (0, 90, 0)), shape: Rectangle(size: (2, 1)), material: "mirror"),
        "sky": (light: Sky(radiance: (1, 1, 1))),
    })"#;

/// Oracle: `E = π(1 − F̄)/(1 − ρF̄_in)` = 3.8454893 for ρ = ½; the camera sees `ρE/π`. Refraction does not scale
/// the power of photons, and does scale the radiance of camera paths.
#[test]
fn light_through_flat_water_is_the_closed_form() {
    let expected = 3.845_489_3 * 0.5 / std::f64::consts::PI;
    for settings in [
        "integrator: Path",
        "integrator: Path, caustics: Photons, photons: (per_pass: Some(8192))",
        "integrator: Sppm, photons: (per_pass: Some(32768))",
        "integrator: PhotonMap, final_gather: 4, photons: (per_pass: Some(524288))",
    ] {
        let description = described(WATER, settings, (12, 12), 16);
        // away from the mirrors, where disks are cut off
        let mean =
            mean_over(&seeds(&description, 4), |x, y| (3..9).contains(&x) && (3..9).contains(&y));
        let difference = mean.mean - expected;
        assert!(
            difference.abs() < 4.0 * mean.error + 3e-3 * expected,
            "{settings}: {mean:?}, {expected}"
        );
        assert!(mean.error < 0.015 * expected, "{settings}: {mean:?}");
    }
}

/// A box with a glass ball, a mirror ball and a lamp.
const BALLS: &str = r#"(
    render: (filter: Box(), SETTINGS),
    materials: {"white": Diffuse(albedo: 0.6), "glass": Dielectric(ior: 1.5), "mirror": Mirror(reflectance: 0.9)},
    entities: {
        "camera": (transform: (translation: (0, 1, 2.5), look_at: (0, 0.8, 0)), camera: (fov: 50)),
        "box": (transform: (translation: (0, 1, 0)), shape: Box(size: (3, 2, 6)), material: "white"),
        "mirror": (transform: (translation: (-0.6, 0.45, -0.4)), shape: Sphere(radius: 0.4), material: "mirror"),
        "glass": (transform: (translation: (0.6, 0.5, 0.2)), shape: Sphere(radius: 0.4), material: "glass" MOTION),
        "lamp": (transform: (translation: (0.2, 1.98, 0), rotation: (90, 0, 0)), shape: Rectangle(size: (1, 1)), emission: Radiance((3, 3, 3))),
    })"#;

/// Mean squared difference of the mean of several pictures to a reference, over blocks of pixels.
fn error(pictures: &[Picture], reference: &[f64]) -> f64 {
    let n = reference.len() as f64;
    pictures
        .iter()
        .map(|picture| {
            let squares = picture.green().into_iter().zip(reference);
            squares.map(|(a, b)| (a - b).powi(2) / (b * b + 0.01)).sum::<f64>() / n
        })
        .sum::<f64>()
        / pictures.len() as f64
}

const METHODS: [&str; 3] = [
    "integrator: Sppm, photons: (per_pass: Some(4096))",
    "integrator: Path, caustics: Photons, photons: (per_pass: Some(2048))",
    "integrator: PhotonMap, final_gather: 8, photons: (per_pass: Some(16384), nearest: 50)",
];

/// Reference: path tracing with many samples. The progressive methods come nearer to it from pass to
/// pass, by about the published rate `N^(−2/3)`; a quarter of that is asked for. `PhotonMap` has a bias
/// which stays, and is held to a bound.
#[test]
fn all_methods_converge_to_the_same_picture() {
    let text = BALLS.replace("MOTION", "");
    let reference = described(&text, "integrator: Path", (16, 12), 4096);
    let reference = render_description(&reference, 0).green();
    for method in &METHODS[..2] {
        let at =
            |samples| error(&seeds(&described(&text, method, (16, 12), samples), 2), &reference);
        let errors = [at(4), at(16), at(256)];
        println!("{method}: {errors:?}");
        let slope = (errors[2] / errors[0]).ln() / 64.0_f64.ln();
        assert!(slope < -0.4, "{method}: {errors:?}, slope {slope}");
        assert!(errors[2] < 2e-3, "{method}: {errors:?}");
    }
    let map = error(&seeds(&described(&text, METHODS[2], (16, 12), 16), 2), &reference);
    println!("{map}");
    assert!(map < 1e-2, "{}: {map}", METHODS[2]);
}

/// Energy: the mean of the whole picture agrees, with a caustic of a moving ball as well, whose photons
/// belong to the place where it is at their time.
#[test]
fn a_moving_glass_ball_agrees_with_path_tracing() {
    let text = BALLS.replace("MOTION", ", velocity: (linear: (-12, 0, 0))");
    let reference = described(&text, "integrator: Path", (16, 12), 2048);
    let reference = render_description(&reference, 0);
    for method in METHODS {
        let pictures = seeds(&described(&text, method, (16, 12), 64), 4);
        let mean = mean_over(&pictures, |_, _| true);
        let expected = reference.mean();
        let difference = mean.mean - expected.mean;
        let allowed = 4.0 * mean.error.hypot(expected.error) + 0.01 * expected.mean;
        println!("{method}: {mean:?} {expected:?} {}", error(&pictures, &reference.green()));
        assert!(difference.abs() < allowed, "{method}: {mean:?} instead of {expected:?}");
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let text = BALLS.replace("MOTION", ", velocity: (linear: (-3, 0, 0))");
    for method in METHODS {
        let description = described(&text, method, (40, 36), 4);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| render_description(&description, 0))
        };
        let (one, two) = (with(1), with(2));
        assert!(one.same_bits(&two), "{method}");
        assert_eq!(one.report.rays, two.report.rays);
        let mut other = description.clone();
        other.render.seed += 1;
        assert!(!one.same_bits(&render_description(&other, 0)), "another seed, another noise");
    }
}

/// Scenes without light, without anything diffuse, without anything at all: black or mirrored, and told.
#[test]
fn empty_cases_are_ordinary() {
    let eye = r#""camera": (transform: (translation: (0, 0, 3)), camera: ())"#;
    let cases = [
        (String::new(), 0.0),
        (r#""ball": (shape: Sphere()),"#.to_owned(), 0.0),
        (r#""ball": (shape: Sphere(), material: "mirror"), "sky": (light: Sky(radiance: (2, 2, 2))),"#.to_owned(), 2.0),
        (r#""sky": (light: Sky(radiance: (2, 2, 2))),"#.to_owned(), 2.0),
        (r#""floor": (transform: (translation: (0, -1, 0)), shape: Plane()), "lamp": (light: Point(intensity: Some((0, 0, 0)))),"#.to_owned(), 0.0),
    ];
    for method in METHODS {
        for (things, expected) in &cases {
            let text = format!(
                r#"(render: (filter: Box(), SETTINGS), materials: {{"mirror": Mirror()}}, entities: {{ {things} {eye} }})"#
            );
            let picture = render_description(&described(&text, method, (4, 4), 4), 0);
            let mean = picture.mean().mean;
            assert!((mean - expected).abs() < 1e-5, "{method}, {things}: {mean}");
        }
    }
}

/// Mean squared difference of neighbouring frames over the variance which their films state, over the pixels chosen.
fn flicker(frames: &[Picture], chosen: impl Fn(usize) -> bool) -> f64 {
    let (mut squares, mut stated) = (0.0, 0.0);
    for pair in frames.windows(2) {
        let (a, b) = (pair[0].green(), pair[1].green());
        let (va, vb) = (pair[0].variance(), pair[1].variance());
        for k in (0..a.len()).filter(|&k| chosen(k)) {
            squares += (a[k] - b[k]).powi(2);
            stated += va[k] + vb[k];
        }
    }
    squares / stated
}

/// One second of a still camera, 24 frames: where nothing changes, frames differ by their noise and no more, whose
/// variance the film states; a ball which moves on the other side does not make the light flicker here. With
/// `PhotonMap` that says something: all samples of a frame read the same photons, whose noise the film
/// cannot see, so that it must be the same noise in all frames.
#[test]
fn a_second_of_frames_differs_by_the_stated_noise_where_nothing_changes() {
    let methods = [
        "integrator: Sppm, photons: (per_pass: Some(512))",
        "integrator: Path, caustics: Photons, photons: (per_pass: Some(256))",
        "integrator: PhotonMap, final_gather: 4, photons: (per_pass: Some(1536), nearest: 30)",
        "integrator: PhotonMap, photons: (per_pass: Some(1024), nearest: 30)",
    ];
    // The left third, away from the balls' path and shadow, upper half.
    let left = |k: usize| k % 10 < 3 && k / 10 < 4;
    let moving = BALLS.replace("MOTION", ", velocity: (linear: (-0.5, 0, 0))");
    for text in [BALLS.replace("MOTION", ""), moving] {
        for method in methods {
            let description = described(&text, method, (10, 8), 16);
            let frames: Vec<Picture> =
                (0..24).map(|k| render_description(&description, k)).collect();
            assert!(!frames[0].same_bits(&frames[1]), "another frame, another noise");
            let ratio = flicker(&frames, left);
            // Low-discrepancy points make less noise than their spread tells.
            println!("{method}: {ratio}");
            assert!((0.02..1.5).contains(&ratio), "{method}: {ratio} of the stated variance");
        }
    }
    // What it would be if each frame had photons of its own, as with another seed; with a final gathering the noise of its
    // rays hides it.
    let still = described(&BALLS.replace("MOTION", ""), methods[3], (10, 8), 16);
    let others = flicker(&seeds(&still, 8), left);
    println!("{others} with other photons");
    assert!(others > 1.5, "{others}");
}

/// Oracle: in a closed cavity of albedo ½ and emission ½ the radiance is 1 in every direction, and a glass ball
/// in it cannot be seen, whichever light comes from photons.
#[test]
fn a_furnace_with_a_glass_ball_reads_one() {
    let text = r#"(
        render: (filter: Box(), SETTINGS),
        materials: {"wall": Diffuse(albedo: 0.5), "glass": Dielectric(ior: 1.5)},
        entities: {
            "camera": (transform: (translation: (0.3, -0.2, 1.4), look_at: (0, 0, 0)), camera: (fov: 70)),
            "cavity": (shape: Sphere(radius: 2), material: "wall", two_sided: true, emission: Radiance((0.5, 0.5, 0.5))),
            "ball": (transform: (translation: (0, -0.1, 0)), shape: Sphere(radius: 0.5), material: "glass"),
        })"#;
    // The path tracer alone; 20 million paths read 0.99996 ± 0.00005.
    let mut paths = described(text, "integrator: Path", (64, 64), 64);
    paths.render.seed = 1;
    render_description(&paths, 0).mean().assert_agrees("Path", 1.0, 5e-4);
    for settings in [
        METHODS[0],
        METHODS[1],
        "integrator: Sppm, photons: (direct: Photons, per_pass: Some(16384))",
        "integrator: PhotonMap, final_gather: 4, photons: (per_pass: Some(65536))",
    ] {
        let pictures = seeds(&described(text, settings, (12, 12), 16), 4);
        for (what, centre) in [("all", false), ("the ball", true)] {
            let chosen = |x: u32, y: u32| !centre || ((4..8).contains(&x) && (4..8).contains(&y));
            let mean = mean_over(&pictures, chosen);
            println!("{settings}, {what}: {mean:?}");
            assert!(
                (mean.mean - 1.0).abs() < 4.0 * mean.error + 2e-3,
                "{settings}, {what}: {mean:?}"
            );
            assert!(mean.error < 0.03, "{settings}, {what}: {mean:?}");
        }
    }
}

/// A coarse ball with the normals of a sphere over a floor: photons arrive by its facets and are scattered by
/// its shading normals. Reference: path tracing. Without the corrections of Veach's chapter 5 the ball shows
/// its facets, and what it sends to the floor is off.
#[test]
fn shading_normals_look_the_same_to_photons() {
    let ball = common::mesh_text("ball", &common::icosphere(0, true));
    let text = format!(
        r#"(
        render: (filter: Box(), SETTINGS),
        materials: {{"white": Diffuse(albedo: 0.8)}}, meshes: {{ {ball} }},
        entities: {{
            "camera": (transform: (translation: (0, 1.2, 4), look_at: (0, 0, 0)), camera: (fov: 50)),
            "ball": (shape: Mesh("ball"), material: "white"),
            "floor": (transform: (translation: (0, -1, 0), rotation: (-90, 0, 0)), shape: Rectangle(size: (6, 6)), material: "white"),
            "lamp": (transform: (translation: (2, 3, 1)), light: Point(intensity: Some((10, 10, 10)))),
        }})"#
    );
    let reference = render_description(&described(&text, "integrator: Path", (16, 12), 1024), 0);
    let photons =
        "integrator: Sppm, photons: (direct: Photons, per_pass: Some(65536), radius: 0.2)";
    let pictures = seeds(&described(&text, photons, (16, 12), 8), 4);
    let relative = error(&pictures, &reference.green());
    let (mean, expected) = (mean_over(&pictures, |_, _| true), reference.mean());
    println!("{mean:?} {expected:?} {relative}");
    let difference = (mean.mean - expected.mean).abs();
    assert!(
        difference < 4.0 * mean.error.hypot(expected.error) + 0.015 * expected.mean,
        "{mean:?} {expected:?}"
    );
    // The rims of shadow are blurred; facets would be everywhere.
    assert!(relative < 0.02, "{relative}");
}
