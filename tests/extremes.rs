//! The ends of the range: scenes of any size, anywhere, lights of any strength and smallness.

mod common;

use common::{Picture, render_description, scene};
use kinora::description::{EmissionStrength, Light, SceneDescription, Shape, Value};

/// A small room: camera with a lens, floor, glass and mirror balls, a turning box, a lamp and a sky.
const ROOM: &str = r#"(
    clock: (fps: 24, shutter: (0, 0.5)),
    render: (filter: Box(), size: (16, 16), samples: 32, layers: [Beauty, Depth, Normal, ObjectId]),
    materials: {
        "white": Diffuse(albedo: (0.8, 0.8, 0.8)), "glass": Dielectric(), "mirror": Mirror(),
        "rough": Conductor(metal: Some(Copper), roughness: 0.4),
    },
    meshes: {"roof": Triangles(positions: [(-0.5, 0, -0.5), (0.5, 0, -0.5), (0, 1, 0)], triangles: [(0, 1, 2)])},
    entities: {
        "camera": (transform: (translation: (0.25, 1, 4), look_at: (0, 0.5, 0)), camera: (fov: 40, aperture: 0.03125, focus: Some(4))),
        "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (8, 8)), material: "white"),
        "glass": (transform: (translation: (-0.75, 0.5, 0)), shape: Sphere(radius: 0.5), material: "glass"),
        "ball": (transform: (translation: (0.75, 0.5, 0)), shape: Sphere(radius: 0.5), material: "mirror"),
        "box": (transform: (translation: (0, 0.25, 0.75)), velocity: (linear: (2, 0, 0), angular: (0, 600, 0)), shape: Box(size: (0.5, 0.5, 0.25)), material: "rough"),
        "can": (transform: (translation: (0, 0.5, -1)), shape: Cylinder(radius: 0.25), material: "white"),
        "roof": (transform: (translation: (0.25, 1, -1.5)), shape: Mesh("roof"), material: "white"),
        "lamp": (transform: (translation: (0.5, 3, 1), rotation: (90, 0, 0)), shape: Disk(radius: 0.25), emission: Radiance((9, 9, 9))),
        "bulb": (transform: (translation: (-2, 1, 1)), shape: Sphere(radius: 0.125), emission: Radiance((9, 5, 1))),
        "sky": (light: Sky(radiance: (0.1, 0.2, 0.3))),
    },
)"#;

/// Multiplies every length of a scene by a factor. Meshes are scaled by the transform.
fn resized(mut scene: SceneDescription, factor: f64) -> SceneDescription {
    for (_, entity) in &mut scene.entities {
        if let Some(transform) = &mut entity.transform {
            transform.translation *= factor;
            if matches!(entity.shape, Some(Shape::Mesh(_))) {
                transform.scale *= factor;
            }
        }
        if let Some(velocity) = &mut entity.velocity {
            velocity.linear *= factor;
        }
        if let Some(look_at) = &mut entity.look_at {
            look_at.target *= factor;
        }
        if let Some(camera) = &mut entity.camera {
            camera.aperture *= factor;
            if let Some(kinora::description::Focus::Distance(distance)) = &mut camera.focus {
                *distance *= factor;
            }
        }
        match &mut entity.shape {
            Some(Shape::Sphere { radius } | Shape::Disk { radius }) => *radius *= factor,
            Some(Shape::Rectangle { size }) => *size *= factor,
            Some(Shape::Box { size }) => *size *= factor,
            Some(Shape::Cylinder { radius, height, .. } | Shape::Cone { radius, height, .. }) => {
                (*radius, *height) = (*radius * factor, *height * factor);
            }
            _ => {}
        }
    }
    scene
}

fn same_colors(a: &Picture, b: &Picture) -> bool {
    let (width, height) = a.film.size();
    (0..height).all(|y| (0..width).all(|x| a.at(x, y) == b.at(x, y)))
}

fn mean_difference(a: &Picture, b: &Picture) -> f64 {
    let (x, y) = (a.green(), b.green());
    x.iter().zip(&y).map(|(x, y)| (x - y).abs()).sum::<f64>() / x.len() as f64
}

/// Oracle: radiance has no length in it: a scene a million times smaller or larger gives the same bits
/// as long as the factor is a power of two. No hidden epsilon survives that.
#[test]
fn scaling_the_world_by_a_power_of_two_changes_no_bit() {
    let original = render_description(&scene(ROOM), 0);
    assert!(original.mean().mean > 0.1);
    for exponent in [-20, 20] {
        let picture = render_description(&resized(scene(ROOM), 2_f64.powi(exponent)), 0);
        assert!(
            same_colors(&original, &picture),
            "2^{exponent}: mean difference {}",
            mean_difference(&original, &picture)
        );
    }
}

/// The same by factors which round: equal but for rays which pass an edge within rounding.
#[test]
fn scenes_of_a_micrometre_and_of_a_million_kilometres_look_the_same() {
    let original = render_description(&scene(ROOM), 0);
    let level = original.mean().mean;
    for factor in [1e-6, 1e9] {
        let picture = render_description(&resized(scene(ROOM), factor), 0);
        let difference = mean_difference(&original, &picture);
        assert!(difference < 2e-3 * level, "× {factor:e}: {difference} of {level}");
    }
}

/// Oracle: the world is f64 and every frame has its camera at the origin: a scene 2²⁴ m away has
/// the coordinates of this one to the bit, for all of them are multiples of 2⁻⁴ m.
#[test]
fn a_scene_far_from_the_origin_is_rendered_the_same() {
    let still = |mut scene: SceneDescription| {
        // A point that moves by 2/24 m/s has no exact sum with 2²⁴: the others have.
        scene.clock.shutter = (0.0, 0.0);
        scene
    };
    let original = render_description(&still(scene(ROOM)), 0);
    let mut far = still(scene(ROOM));
    let shift = glam::DVec3::new(16_777_216.0, -16_777_216.0, 33_554_432.0);
    for (_, entity) in &mut far.entities {
        entity.transform = Some(entity.transform.unwrap_or_default());
        if let Some(transform) = &mut entity.transform {
            transform.translation += shift;
        }
        if let Some(look_at) = &mut entity.look_at {
            look_at.target += shift;
        }
    }
    let far = render_description(&far, 0);
    assert!(same_colors(&original, &far), "mean difference {}", mean_difference(&original, &far));
}

/// Oracle: light is linear: emissions times a power of two give radiances times it, to the bit; times
/// 10⁻⁶ to rounding. Neither roulette nor any threshold looks at absolute strengths.
#[test]
fn light_is_linear() {
    let scaled = |factor: f32| {
        let mut scene = scene(ROOM);
        for (_, entity) in &mut scene.entities {
            if let Some(emission) = &mut entity.emission
                && let EmissionStrength::Radiance(Value::Constant(radiance)) =
                    &mut emission.strength
            {
                *radiance *= factor;
            }
            if let Some(Light::Sky { scale, .. }) = &mut entity.light {
                *scale *= factor;
            }
        }
        render_description(&scene, 0)
    };
    let original = scaled(1.0);
    for (factor, tolerance) in [(2_f32.powi(-20), 0.0), (2_f32.powi(40), 0.0), (1e-6, 1e-5)] {
        let picture = scaled(factor);
        for (a, b) in original.green().iter().zip(picture.green()) {
            let expected = a * f64::from(factor);
            assert!(
                (b - expected).abs() <= tolerance * expected,
                "× {factor:e}: {b:e}, {expected:e}"
            );
        }
    }
}

/// Oracle: at a fixed power a small sphere gives the irradiance `Φ/(4π·d²)·cos θ` however small it is, from
/// radius 1 to 10⁻⁷ (its radiance grows to 10¹³), and so does a small disk with `Φ·cos²θ/(π·d²)`.
#[test]
fn a_light_of_fixed_power_may_shrink_to_a_point() {
    use std::f64::consts::PI;
    for exponent in 0..=7 {
        let radius = 10_f64.powi(-exponent);
        for (shape, rotation, expected) in [
            ("Sphere", "(0, 0, 0)", 1.0 / (4.0 * PI * 16.0)),
            ("Disk", "(180, 0, 0)", 1.0 / (PI * (16.0 + radius * radius))),
        ] {
            let text = format!(
                r#"(
                render: (filter: Box(), max_depth: 1, size: (8, 8), samples: 64),
                materials: {{"floor": Diffuse(albedo: (1, 1, 1))}},
                entities: {{
                    "camera": (transform: (translation: (0, 0, 0.3)), camera: (fov: 0.01)),
                    "floor": (shape: Rectangle(size: (100, 100)), material: "floor"),
                    "lamp": (transform: (translation: (0, 0, 4), rotation: {rotation}), shape: {shape}(radius: {radius}), emission: Power((1, 1, 1))),
                }})"#
            );
            let mean = render_description(&scene(&text), 0).mean();
            let (mean, error) = (mean.mean * PI, mean.error * PI);
            let off = (mean / expected - 1.0).abs();
            assert!(
                off <= 3.0 * error / expected + 1e-5,
                "{shape} {radius:e}: {mean} instead of {expected}"
            );
            assert!(error < 2e-3 * expected, "{shape} {radius:e}: standard error {error}");
        }
    }
}

/// Oracle: a sphere of 10⁶ m below the camera is a flat floor to 10⁻⁶: under an even sky and a lamp the
/// picture is that of a plane, without acne.
#[test]
fn a_planet_looks_like_a_plane_from_a_metre_above() {
    let text = |ground: &str| {
        format!(
            r#"(
            render: (filter: Box(), size: (16, 16), samples: 64),
            materials: {{"ground": Diffuse(albedo: (0.5, 0.5, 0.5))}},
            entities: {{
                "camera": (transform: (translation: (0, 1, 0), look_at: (0, 0, -1.5)), camera: (fov: 40)),
                "ground": ({ground}, material: "ground"),
                "lamp": (transform: (translation: (1, 3, -2)), shape: Sphere(radius: 0.3), emission: Radiance((20, 20, 20))),
                "sky": (light: Sky(radiance: (0.2, 0.2, 0.2))),
            }})"#
        )
    };
    let plane = render_description(&scene(&text("shape: Plane()")), 0);
    let planet = text("transform: (translation: (0, -1e6, 0)), shape: Sphere(radius: 1e6)");
    let planet = render_description(&scene(&planet), 0);
    for (k, (a, b)) in plane.green().iter().zip(planet.green()).enumerate() {
        let error = (plane.variance()[k] + planet.variance()[k]).sqrt();
        assert!(
            (a - b).abs() <= 5.0 * error + 1e-4,
            "pixel {k}: {a} on the plane, {b} on the sphere"
        );
    }
}

/// Two equal squares of two colours in one place: one of them is seen, everywhere the same, from both
/// sides.
#[test]
fn coincident_surfaces_show_no_speckle() {
    for z in [3.0, -3.0] {
        let text = format!(
            r#"(
            render: (filter: Box(), size: (32, 32), samples: 8),
            entities: {{
                "camera": (transform: (translation: (0.3, 0.2, {z}), look_at: (0, 0, 0)), camera: (fov: 20)),
                "a": (transform: (rotation: (7, 11, 13)), shape: Rectangle(size: (4, 4)), two_sided: true, emission: Radiance((1, 1, 1))),
                "b": (transform: (rotation: (7, 11, 13)), shape: Rectangle(size: (4, 4)), two_sided: true, emission: Radiance((2, 2, 2))),
            }})"#
        );
        let picture = render_description(&scene(&text), 0);
        let first = picture.at(0, 0).y;
        assert!(first == 1.0 || first == 2.0, "{first}");
        assert!(picture.green().iter().all(|v| *v == f64::from(first)), "speckle from z = {z}");
    }
}

/// A closed room seen at every grazing angle, with glass, rough glass, rough metal, plastic and lights of
/// every kind: not one sample is anything but a number (the common code refuses non-finite ones).
#[test]
fn no_sample_is_ever_not_a_number() {
    let materials = [
        "Dielectric(roughness: 1)",
        "Dielectric(ior: 1)",
        "Dielectric(ior: 10)",
        "Dielectric(roughness: 0.001)",
        "Conductor(metal: Some(Silver), roughness: 0.001)",
        "Conductor(metal: Some(Gold), roughness: 1)",
        "Plastic(roughness: 1)",
        "Plastic(ior: 1)",
        "Principled(metallic: 1, roughness: 0)",
        "Principled(roughness: 1, transmission: 1)",
        "ThinGlass(ior: 1)",
        "ThinGlass(tint: (0, 0, 0))",
        "Mirror(reflectance: (0, 0, 0))",
        "Diffuse(albedo: (0, 0, 0))",
        "Dielectric(attenuation: Some((color: (1e-30, 1, 0.5), distance: 1e-6)))",
    ];
    for material in materials {
        let text = format!(
            r#"(
            render: (filter: Box(), size: (16, 16), samples: 64),
            textures: {{"holes": Checker(size: 0.1, a: (1, 1, 1), b: (0, 0, 0))}},
            materials: {{"it": {material}, "net": Masked(material: "it", opacity: "holes")}},
            entities: {{
                "camera": (transform: (translation: (0, 0.01, 4), look_at: (0, 0, 0)), camera: (fov: 30)),
                "floor": (shape: Plane(), material: "it"),
                "ball": (transform: (translation: (0, 0.5, 0)), shape: Sphere(radius: 0.5), material: "it"),
                "touching": (transform: (translation: (0, 0.5, -1)), shape: Sphere(radius: 0.5), material: "it"),
                "flat": (transform: (translation: (1, 0.5, 0), scale: (1, 1e-9, 1)), shape: Box(), material: "net"),
                "cone": (transform: (translation: (-1, 0.5, 0)), shape: Cone(radius: 0.4), material: "net"),
                "lamp": (transform: (translation: (0, 2, 0), rotation: (90, 0, 0)), shape: Rectangle(), emission: Radiance((9, 9, 9))),
                "edge on": (transform: (translation: (0, 1, 1), rotation: (0, 90, 0)), shape: Disk(radius: 0.2), two_sided: true, emission: Power((1, 1, 1))),
                "in the floor": (shape: Sphere(radius: 0.2), emission: Radiance((1, 1, 1)), material: "it"),
                "point": (transform: (translation: (0, 1, 0)), light: Point(intensity: (1, 1, 1))),
                "on the floor": (transform: (translation: (1, 0, 1)), light: Point(intensity: (1, 1, 1))),
                "spot": (transform: (translation: (0, 2, 2), look_at: (0, 0, 0)), light: Spot(intensity: (1, 1, 1), angle: 1, blend: 1)),
                "sun": (light: Directional(irradiance: (1, 1, 1), angle: 179.9)),
                "sky": (light: Sky(radiance: "holes")),
            }})"#
        );
        let picture = render_description(&scene(&text), 0);
        assert!(picture.green().iter().all(|v| v.is_finite() && *v >= 0.0), "{material}");
    }
}

/// Oracle: a parallel beam of irradiance E on a white metal, head on, is seen at the angle θ beside its mirror image with the radiance
/// `E D(θ/2)/4`, `D` of GGX of the width α = roughness²: to either side of 0.0316, and down to a lobe 2·10⁻⁶ wide. Of the light within 4 α, the
/// share within 2 α, and all of it together.
#[test]
fn a_highlight_is_as_wide_as_the_roughness_says() {
    for roughness in [0.1, 0.0317, 0.031, 0.02, 0.005, 0.0015_f64] {
        let alpha = roughness * roughness;
        // The picture spans 4 α to either side.
        let fov = 2.0 * (4.0 * alpha).atan().to_degrees();
        let text = format!(
            r#"(
            render: (filter: Box(), integrator: Path, share: 1),
            materials: {{"metal": Conductor(f0: Some((1, 1, 1)), roughness: {roughness})}},
            entities: {{
                "camera": (transform: (translation: (0, 0, 1)), camera: (fov: {fov})),
                "sun": (light: Directional(irradiance: (1, 1, 1))),
                "plate": (shape: Rectangle(), material: "metal"),
            }})"#
        );
        let picture = common::render(&text, (32, 32), 64);
        let (mut within, mut all) = ([0.0; 2], [0.0; 2]);
        for (k, value) in picture.green().into_iter().enumerate() {
            let place = |k: usize, j: u32| {
                ((k as f64 + (f64::from(j) + 0.5) / 8.0) / 16.0 - 1.0) * 4.0 // in units of α
            };
            let mut expected = 0.0;
            for j in 0..64 {
                let theta2 = place(k % 32, j % 8).powi(2) + place(k / 32, j / 8).powi(2);
                let d = (1.0 + theta2 / 4.0).powi(-2) / (std::f64::consts::PI * alpha * alpha);
                expected += d / 4.0 / 64.0;
            }
            all = [all[0] + expected, all[1] + value];
            if place(k % 32, 4).powi(2) + place(k / 32, 4).powi(2) < 4.0 {
                within = [within[0] + expected, within[1] + value];
            }
        }
        let (share, total) = (within[1] / all[1], all[1] / all[0]);
        let expected = within[0] / all[0];
        assert!((share / expected - 1.0).abs() < 0.01, "{roughness}: {share}, not {expected}");
        assert!((total - 1.0).abs() < 0.01, "{roughness}: {total} of the light");
    }
}
