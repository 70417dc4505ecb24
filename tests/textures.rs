//! Textures in pictures: filtering, places, bump and normal maps.

mod common;

use common::{Picture, render, render_description, scene};
use glam::{DVec3, Vec3};
use kinora::description::{
    Channel, Encoding, ImageData, ImagePixels, LoadOptions, SceneTexture, Texture, TextureFilter,
    TextureFiltering, Wrap,
};

/// A floor of checkers to the horizon under an even sky: its radiance is its albedo.
const HORIZON: &str = r#"(
    render: (filter: Box(radius: 0.5), max_depth: 1),
    textures: { "checks": Checker(size: 0.5, a: 1, b: 0) },
    materials: { "floor": Diffuse(albedo: "checks") },
    entities: {
        "camera": (transform: (translation: (0, 1, 0), rotation: (-10, 20, 0)), camera: (fov: 40)),
        "floor": (shape: Plane(), material: "floor"),
        "sky": (light: Sky(radiance: 1)),
    },
)"#;

fn filtered(text: &str, filter: TextureFiltering, samples: u32) -> Picture {
    let mut description = scene(text);
    (description.render.size, description.render.samples) = ((96, 54), samples);
    description.render.texture_filter = filter;
    render_description(&description, 0)
}

/// Root of the mean square of the difference over rows.
fn rms(a: &Picture, b: &Picture, rows: std::ops::Range<u32>) -> f64 {
    let difference = |(x, y)| f64::from(a.at(x, y).y - b.at(x, y).y).powi(2);
    let count = f64::from(96 * rows.len() as u32);
    (rows.flat_map(|y| (0..96).map(move |x| (x, y))).map(difference).sum::<f64>() / count).sqrt()
}

/// Oracle: the same floor by very many samples at points. Near the horizon, where many fields lie in a pixel, 4
/// filtered samples are off by less than 0.08, and 4 at points are many times worse; where fields are larger than
/// pixels filtering takes nothing away.
///
/// The square of that error follows from the signal: a quarter of the variance of a filtered sample, and the square of what the
/// filter itself is off by, both by very many samples. That of 576 pixels strays from it by √(2/576) of itself, were they
/// normally distributed; 5 times that is granted.
#[test]
fn checks_to_the_horizon_become_grey() {
    let reference = filtered(HORIZON, TextureFiltering::Point, 1024);
    let point = filtered(HORIZON, TextureFiltering::Point, 4);
    let converged = filtered(HORIZON, TextureFiltering::Anisotropic, 1024);
    let filtered = filtered(HORIZON, TextureFiltering::Anisotropic, 4);
    // The horizon is in row 13.
    let far = 14..20;
    let [point_far, filtered_far] =
        [&point, &filtered].map(|picture| rms(picture, &reference, far.clone()));
    let bias = rms(&converged, &reference, far.clone());
    let variances = &converged.variance()[96 * 14..96 * 20];
    let variance = 1024.0 * variances.iter().sum::<f64>() / variances.len() as f64;
    let predicted = (0.25 * variance + bias * bias) * (1.0 + 5.0 * (2.0_f64 / 576.0).sqrt());
    assert!(filtered_far < 0.08 && filtered_far.powi(2) < predicted, "{filtered_far} {predicted}");
    assert!(point_far > 3.0 * filtered_far, "{point_far} {filtered_far}");
    let near = 30..54;
    let [point_near, filtered_near] =
        [&point, &filtered].map(|picture| rms(picture, &reference, near.clone()));
    assert!(filtered_near < 1.1 * point_near, "{filtered_near} {point_near}");
}

/// An image of checkers of 8 × 8 texels.
fn checks(size: u32) -> SceneTexture {
    let pixels = (0..size * size)
        .map(|k| {
            let v = f32::from(u8::from((k % size / 8 + k / size / 8).is_multiple_of(2)));
            [v, v, v, 1.0]
        })
        .collect();
    let file = ImageData { width: size, height: size, pixels: ImagePixels::Rgba32F(pixels) };
    image(file)
}

fn image(file: ImageData) -> SceneTexture {
    Texture::Image {
        file: file.into(),
        encoding: Encoding::Linear,
        wrap: Wrap::Repeat,
        filter: TextureFilter::Bilinear,
        channel: Channel::Luminance,
        repeat: glam::Vec2::splat(0.25),
        offset: glam::Vec2::ZERO,
    }
}

/// The same with an image: its pyramid against very many samples at points. Head on and far away it keeps the mean.
#[test]
fn images_are_filtered_by_their_pyramid() {
    let mut description = scene(HORIZON);
    description.textures.insert("checks".to_owned(), checks(64));
    (description.render.size, description.render.samples) = ((96, 54), 1024);
    description.render.texture_filter = TextureFiltering::Point;
    let reference = render_description(&description, 0);
    let mut by = |filter| {
        description.render.texture_filter = filter;
        description.render.samples = 4;
        rms(&render_description(&description, 0), &reference, 14..20)
    };
    let point = by(TextureFiltering::Point);
    let isotropic = by(TextureFiltering::Isotropic);
    let anisotropic = by(TextureFiltering::Anisotropic);
    assert!(anisotropic < 0.05, "{anisotropic}");
    assert!(point > 3.0 * anisotropic && isotropic < point, "{point} {isotropic} {anisotropic}");
}

/// A ball and a box with solid textures, at rest and moved, turned and mirrored with their camera: the texture goes with
/// the object.
#[test]
fn solid_textures_go_with_their_object() {
    let at = |transform: &str, eye: &str| {
        let text = format!(
            r#"(
    render: (max_depth: 1),
    textures: {{ "clouds": Noise(size: 0.5), "rings": Wood(size: 0.1), "all": Multiply(a: "clouds", b: "rings") }},
    materials: {{ "m": Diffuse(albedo: "all") }},
    entities: {{
        "camera": (parent: "group", transform: (translation: {eye}, look_at: (0, 0, 0)), camera: (fov: 40)),
        "group": (transform: ({transform})),
        "ball": (parent: "group", shape: Sphere(radius: 0.7), material: "m"),
        "sky": (light: Sky(radiance: 1)),
    }},
)"#
        );
        render(&text, (32, 32), 64)
    };
    let still = at("", "(0, 0, 3)");
    let moved = at("translation: (5, -7, 11), rotation: (30, 40, 50)", "(0, 0, 3)");
    let mean = still.mean();
    assert!(mean.mean > 0.02);
    // 5 standard errors: of 1024 pixels none is farther off by chance.
    let variances = still.variance().into_iter().zip(moved.variance());
    let pixels = still.green().into_iter().zip(moved.green()).zip(variances);
    for (k, ((a, b), (va, vb))) in pixels.enumerate() {
        assert!((a - b).abs() <= 5.0 * (va + vb).sqrt() + 4e-6, "pixel {k}: {a} {b}");
    }
    let difference = (still.mean().mean - moved.mean().mean).abs();
    assert!(difference < 3.0 * still.mean().error.hypot(moved.mean().error), "{difference}");
}

/// The mean normal that the camera sees on a square in front of it with this material.
fn normal_on_square(textures: &str, material: &str) -> Vec3 {
    let text = format!(
        r#"(
    render: (max_depth: 1, layers: [Beauty, Normal], filter: Box(radius: 0.5)),
    textures: {{ {textures} }},
    materials: {{ "flat": Diffuse(), "relief": {material} }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 5)), camera: (orthographic: 0.004)),
        "square": (shape: Rectangle(size: (1, 1)), material: "relief"),
        "sky": (light: Sky(radiance: 1)),
    }},
)"#
    );
    let picture = render(&text, (4, 4), 16);
    let planes = picture.film.image(kinora::description::Layer::Normal).expect("asked for");
    let mean = |k: usize| match &planes[k].samples {
        kinora::film::PlaneSamples::F32(values) => values.iter().sum::<f32>() / values.len() as f32,
        kinora::film::PlaneSamples::U32(_) => panic!("normals are numbers"),
    };
    Vec3::new(mean(0), mean(1), mean(2))
}

/// Oracle (closed form): the height rises by `strength` over the width of 1 m; the normal of the raised surface leans
/// back by the arc tangent of that, and by half a right angle at most, beyond which a mirror would reflect the
/// camera's rays into the square.
#[test]
fn a_bump_map_has_the_normal_of_the_raised_surface() {
    let ramp = r#""ramp": Gradient(a: 0, b: 1)"#;
    for strength in [0.1_f32, -0.7, 2.0] {
        let material = format!(r#"Bump(material: "flat", height: "ramp", strength: {strength:?})"#);
        let normal = normal_on_square(ramp, &material);
        let expected = Vec3::new(-strength.clamp(-1.0, 1.0), 0.0, 1.0).normalize();
        assert!((normal - expected).length() < 1e-3, "{strength}: {normal} {expected}");
    }
}

/// Oracle: a normal map that holds one normal; green up and down, and its strength.
#[test]
fn a_normal_map_holds_the_normal() {
    let n = Vec3::new(0.36, -0.48, 0.8);
    let coded = n * 0.5 + 0.5;
    let map = format!(
        r#""n": Gradient(a: ({0}, {1}, {2}), b: ({0}, {1}, {2}))"#,
        coded.x, coded.y, coded.z
    );
    for (options, expected) in [
        ("", n),
        (", green: Down", Vec3::new(n.x, -n.y, n.z)),
        (", strength: 0.5", Vec3::new(0.5 * n.x, 0.5 * n.y, n.z).normalize()),
        (", strength: 0", Vec3::Z),
    ] {
        let material = format!(r#"NormalMap(material: "flat", map: "n"{options})"#);
        let normal = normal_on_square(&map, &material);
        assert!((normal - expected).length() < 1e-3, "{options}: {normal} {expected}");
    }
}

/// Closed form: a normal map on a mesh of two halves on which u grows outwards holds normals that are mirrored; so does the
/// mesh when its object is turned over, and the map is stretched as the mesh is.
#[test]
fn a_normal_map_on_a_mesh_follows_its_uv() {
    let n = Vec3::new(0.36, -0.48, 0.8);
    for (transform, stretched) in [
        ("", n),
        ("scale: 2", n),
        ("scale: (-1, 1, 1)", n),
        ("scale: (1, 1, 0.25)", Vec3::new(n.x, n.y, n.z / 0.25).normalize()),
    ] {
        let text = format!(
            r#"(
    render: (max_depth: 1, layers: [Beauty, Normal], filter: Box(radius: 0.5)),
    textures: {{ "n": Gradient(a: (0.68, 0.26, 0.9), b: (0.68, 0.26, 0.9)) }},
    materials: {{ "flat": Diffuse(), "relief": NormalMap(material: "flat", map: "n") }},
    meshes: {{ "halves": Triangles(
        positions: [(-1, -1, 0), (0, -1, 0), (1, -1, 0), (-1, 1, 0), (0, 1, 0), (1, 1, 0)],
        uvs: [(1, 0), (0, 0), (1, 0), (1, 1), (0, 1), (1, 1)],
        triangles: [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)]) }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 5)), camera: (orthographic: 2)),
        "halves": (transform: ({transform}), shape: Mesh("halves"), material: "relief"),
        "sky": (light: Sky(radiance: 1)),
    }},
)"#
        );
        let picture = render(&text, (8, 8), 4);
        let planes = picture.film.image(kinora::description::Layer::Normal).expect("asked for");
        for pixel in 0..64 {
            let component = |k: usize| match &planes[k].samples {
                kinora::film::PlaneSamples::F32(values) => values[pixel],
                kinora::film::PlaneSamples::U32(_) => panic!("normals are numbers"),
            };
            let found = Vec3::new(component(0), component(1), component(2));
            let outwards = if pixel % 8 < 4 { -1.0 } else { 1.0 };
            let expected = stretched * Vec3::new(outwards, 1.0, 1.0);
            assert!((found - expected).length() < 1e-5, "{transform} {pixel}: {found} {expected}");
        }
    }
}

/// Oracle: the sphere itself, seen from afar under a lamp as far away, by the same samples. A square with its normals
/// is as bright at every pixel; up to half a right angle from the camera, beyond which normals are bent.
///
/// The map's normal is a mean over a kernel no wider than two pixels of side h to either side, whose variance per axis
/// is at most that of a box, (4h)²/12; the mean of a function f is off by its half times ∇²f. For
/// √(1 − r²), r² < ½, ∇² is at most 3·√2, and n·l has `z` with a factor below 1.
#[test]
fn the_normal_map_of_a_sphere_lights_a_square_as_the_sphere_is_lit() {
    let size = 1024_u32;
    let pixels = (0..size * size).map(|k| {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(size) * 2.0 - 1.0;
        // The first row of an image is on top.
        let (x, y) = (at(k % size), -at(k / size));
        let n = DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()).normalize();
        (n * 0.5 + 0.5).as_vec3().extend(1.0).to_array()
    });
    let file =
        ImageData { width: size, height: size, pixels: ImagePixels::Rgba32F(pixels.collect()) };
    let mut normals = image(file);
    if let Texture::Image { repeat, .. } = &mut normals {
        *repeat = glam::Vec2::ONE;
    }
    let side = 48;
    let lit = |shape: &str| {
        let text = format!(
            r#"(
    render: (max_depth: 1, filter: Box(radius: 0.5)),
    textures: {{ "normals": Checker() }},
    materials: {{ "plain": Diffuse(albedo: 1), "mapped": NormalMap(material: "plain", map: "normals") }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 5)), camera: (orthographic: 2)),
        "thing": ({shape}),
        "sun": (transform: (rotation: (-20, 35, 0)), light: Directional(irradiance: (3.1415927, 3.1415927, 3.1415927))),
    }},
)"#
        );
        let mut description = scene(&text);
        description.textures.insert("normals".to_owned(), normals.clone());
        (description.render.size, description.render.samples) = ((side, side), 16);
        render_description(&description, 0)
    };
    let sphere = lit(r#"shape: Sphere(), material: "plain""#);
    let square = lit(r#"shape: Rectangle(size: (2, 2)), material: "mapped""#);
    let h = 2.0 / f64::from(side);
    let bound = 0.5 * (4.0 * h).powi(2) / 12.0 * 3.0 * std::f64::consts::SQRT_2;
    let mut seen = 0;
    for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
        let at = |k: u32| (f64::from(k) + 0.5) * h - 1.0;
        // With the half of its diagonal all of the pixel lies within the limit.
        if at(x).hypot(at(y)) + h < std::f64::consts::FRAC_1_SQRT_2 {
            let (a, b) = (f64::from(sphere.at(x, y).y), f64::from(square.at(x, y).y));
            assert!((a - b).abs() < bound, "{x} {y}: {a} {b}, bound {bound}");
            seen += 1;
        }
    }
    assert!(seen > 600, "{seen}");
}

/// Oracle: the height's own derivative: a bump map and the normal map made from the same sine light a wall alike, and
/// both as the cosine of the normal says.
#[test]
fn a_bump_map_and_the_normal_map_of_its_height_are_lit_alike() {
    let size = 512_u32;
    let (turns, depth) = (4.0_f64, 0.004_f64);
    let phase =
        |k: u32| std::f64::consts::TAU * turns * (f64::from(k % size) + 0.5) / f64::from(size);
    let texture = |value: &dyn Fn(u32) -> [f32; 4]| {
        let pixels = (0..size * size).map(value).collect();
        let file = ImageData { width: size, height: size, pixels: ImagePixels::Rgba32F(pixels) };
        let mut texture = image(file);
        if let Texture::Image { repeat, .. } = &mut texture {
            *repeat = glam::Vec2::ONE;
        }
        texture
    };
    let height = texture(&|k| {
        let v = (0.5 + 0.5 * phase(k).sin()) as f32;
        [v, v, v, 1.0]
    });
    let normals = texture(&|k| {
        let slope = 0.5 * depth * phase(k).cos() * std::f64::consts::TAU * turns;
        let n = (DVec3::new(-slope, 0.0, 1.0).normalize() * 0.5 + 0.5).as_vec3();
        [n.x, n.y, n.z, 1.0]
    });
    let lit = |material: &str| {
        let text = format!(
            r#"(
    render: (max_depth: 1, filter: Box(radius: 0.5)),
    textures: {{ "height": Checker(), "normals": Checker() }},
    materials: {{ "flat": Diffuse(albedo: 1), "relief": {material} }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 5)), camera: (orthographic: 0.0625)),
        "square": (shape: Rectangle(size: (1, 1)), material: "relief"),
        "sun": (transform: (rotation: (0, 45, 0)), light: Directional(irradiance: (3.1415927, 3.1415927, 3.1415927))),
    }},
)"#
        );
        let mut description = scene(&text);
        description.textures.insert("height".to_owned(), height.clone());
        description.textures.insert("normals".to_owned(), normals.clone());
        (description.render.size, description.render.samples) = ((64, 4), 64);
        render_description(&description, 0)
    };
    let bump = lit(&format!(r#"Bump(material: "flat", height: "height", strength: {depth:?})"#));
    let mapped = lit(r#"NormalMap(material: "flat", map: "normals")"#);
    for x in 0..64 {
        let u = (f64::from(x) + 0.5) / 64.0;
        let slope =
            0.5 * depth * (std::f64::consts::TAU * turns * u).cos() * std::f64::consts::TAU * turns;
        let n = DVec3::new(-slope, 0.0, 1.0).normalize();
        let light = DVec3::new(1.0, 0.0, 1.0).normalize();
        let expected = n.dot(light) as f32;
        let (a, b) = (bump.at(x, 1).y, mapped.at(x, 1).y);
        assert!((a - expected).abs() < 4e-3, "bump {x}: {a} {expected}");
        assert!((b - expected).abs() < 4e-3, "normals {x}: {b} {expected}");
    }
}

/// Steep bumps never make light: a white ball in an even sky is at most as bright as the sky, and has no black rim.
#[test]
fn steep_bumps_neither_make_nor_swallow_light() {
    for material in ["Diffuse(albedo: 1)", "Mirror()", "Conductor(f0: 1, roughness: 0.3)"] {
        let text = format!(
            r#"(
    textures: {{ "clouds": Noise(size: 0.1, octaves: 2) }},
    materials: {{ "m": {material}, "bumpy": Bump(material: "m", height: "clouds", strength: 0.2) }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 4)), camera: (orthographic: 1.9)),
        "ball": (shape: Sphere(radius: 1), material: "bumpy"),
        "sky": (light: Sky(radiance: 1)),
    }},
)"#
        );
        let picture = render(&text, (24, 24), 256);
        let mean = picture.mean();
        assert!(mean.mean <= 1.0 + 3.0 * mean.error + 4e-6, "{material}: {mean:?}");
        assert!(mean.mean > 0.8, "{material}: {mean:?}");
        let darkest = picture.green().into_iter().fold(f64::INFINITY, f64::min);
        assert!(darkest > 0.3, "{material}: {darkest}");
    }
}

/// Closed form: an image that two textures name in two ways and many balls are painted with is in memory once, with
/// smaller copies down to one texel.
#[test]
fn an_image_is_in_memory_once() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let image = image::RgbaImage::from_fn(64, 32, |x, y| image::Rgba([x as u8, y as u8, 7, 255]));
    image.save(folder.path().join("a.png")).expect("writable");
    let balls: Vec<String> = (0..100)
        .map(|k| format!(r#""{k}": (shape: Sphere(), material: "{}"),"#, ["m", "n"][k % 2]))
        .collect();
    let balls = balls.concat();
    let text = format!(
        r#"(
    textures: {{ "a": Image(file: "a.png"), "b": Image(file: "./a.png", wrap: Mirror) }},
    materials: {{ "m": Diffuse(albedo: "a"), "n": Mirror(reflectance: "b") }},
    entities: {{ "camera": (camera: ()), {balls} "sky": (light: Sky(radiance: "a")) }},
)"#
    );
    let path = folder.path().join("a.ron");
    std::fs::write(&path, text).expect("writable");
    let scene = kinora::description::load_scene(&path, &LoadOptions::default());
    let mut scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    (scene.render.size, scene.render.samples) = ((4, 4), 1);
    let report = render_description(&scene, 0).report;
    let textures = report.table_bytes.iter().find(|(name, _)| *name == "textures");
    // 64 × 32 texels of 4 bytes, then 32 × 16, …, 2 × 1, 1 × 1.
    let texels = 2048 + 512 + 128 + 32 + 8 + 2 + 1;
    assert_eq!(textures, Some(&("textures", 4 * texels)));
}

/// Photons see bumps and textures as paths do.
#[test]
fn photons_and_paths_see_the_same_textures() {
    let by = |integrator: &str| {
        let text = format!(
            r#"(
    render: (integrator: {integrator}),
    textures: {{ "clouds": Noise(size: 0.4, a: 0.1, b: 0.9), "height": Noise(size: 0.2, octaves: 1) }},
    materials: {{ "m": Diffuse(albedo: "clouds"), "bumpy": Bump(material: "m", height: "height", strength: 0.05) }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 2.4)), camera: (fov: 40)),
        "room": (shape: Box(size: (2, 2, 5)), material: "bumpy"),
        "lamp": (transform: (translation: (0, 0.99, 0), rotation: (90, 0, 0)), shape: Rectangle(size: (0.5, 0.5)),
                 emission: Radiance(5)),
    }},
)"#
        );
        render(&text, (16, 16), 1024).mean()
    };
    let (path, sppm) = (by("Path"), by("Sppm"));
    let error = path.error.hypot(sppm.error);
    assert!((path.mean - sppm.mean).abs() < 3.0 * error, "{path:?} {sppm:?}");
    assert!(error < 0.02 * path.mean, "{path:?} {sppm:?}");
}

/// Rows which say how far they are from the top, in images of 64 × 32.
fn rows() -> SceneTexture {
    let (width, height) = (64_u32, 32_u32);
    let value = |k: u32| ((k / width) as f32 + 0.5) / height as f32;
    let pixels = (0..width * height).map(|k| [value(k), value(k), value(k), 1.0]).collect();
    let file = ImageData { width, height, pixels: ImagePixels::Rgba32F(pixels) };
    Texture::Image {
        file: file.into(),
        encoding: Encoding::Linear,
        wrap: Wrap::Repeat,
        filter: TextureFilter::Bilinear,
        channel: Channel::Luminance,
        repeat: glam::Vec2::ONE,
        offset: glam::Vec2::ZERO,
    }
}

/// Oracle: the first and the last row of the image, 1/64 and 63/64, within half a texel of the poles of a sky and of shapes, of
/// tips and of rims, filtered or not: nothing of the other end, where 0.46 came of a mean with it.
#[test]
fn images_end_where_the_coordinates_of_a_shape_end() {
    let (up, down) = ("rotation: (90, 0, 0)", "translation: (0, 3, 0), rotation: (-90, 0, 0)");
    let below = "translation: (0, -3, 0), rotation: (90, 0, 0)";
    let (high, low) = ("translation: (0, 0.495, 3)", "translation: (0, -0.495, 3)");
    let rim = "translation: (0, 0.995, 3)";
    let shape = |shape: &str| format!("shape: {shape}, emission: Radiance(\"rows\")");
    let sky = r#"light: Sky(radiance: "rows")"#.to_owned();
    let lathe = "Revolution(profile: Bezier(points: [(0, -1), (1.3, -1), (1.3, 1), (0, 1)]))";
    let tessellated = "Mesh(\"ball\")";
    let (top, bottom) = (1.0 / 64.0, 63.0 / 64.0);
    for (thing, from, lens, expected) in [
        (sky.clone(), up, "fov: 2", top),
        (sky, "rotation: (-90, 0, 0)", "fov: 2", bottom),
        (shape("Sphere()"), down, "orthographic: Some(0.02)", top),
        (shape("Sphere()"), below, "orthographic: Some(0.02)", bottom),
        (shape(lathe), down, "orthographic: Some(0.02)", top),
        (shape(lathe), below, "orthographic: Some(0.02)", bottom),
        (shape(tessellated), down, "orthographic: Some(0.02)", top),
        (shape(tessellated), below, "orthographic: Some(0.02)", bottom),
        (shape("Cone()"), down, "orthographic: Some(0.02)", top),
        (shape("Cylinder(capped: false)"), high, "orthographic: Some(0.01)", top),
        (shape("Cylinder(capped: false)"), low, "orthographic: Some(0.01)", bottom),
        (shape("Box()"), high, "orthographic: Some(0.01)", top),
        (shape("Box()"), low, "orthographic: Some(0.01)", bottom),
        (shape("Rectangle()"), high, "orthographic: Some(0.01)", top),
        (shape("Disk()"), rim, "orthographic: Some(0.009)", top),
    ] {
        let text = format!(
            r#"(
    render: (filter: Box(radius: 0.5), max_depth: 1),
    textures: {{ "rows": Checker() }},
    meshes: {{ "ball": Tessellated(shape: Sphere(), tolerance: 0.01) }},
    entities: {{
        "camera": (transform: ({from}), camera: ({lens})),
        "thing": ({thing}),
    }},
)"#
        );
        let mut description = scene(&text);
        description.textures.insert("rows".to_owned(), rows());
        (description.render.size, description.render.samples) = ((8, 8), 4);
        for filter in [TextureFiltering::Point, TextureFiltering::Anisotropic] {
            description.render.texture_filter = filter;
            let picture = render_description(&description, 0);
            for value in picture.green() {
                // A row is 1/32; so near its end an ellipse reaches into the next one by little.
                assert!((value - expected).abs() < 2e-3, "{thing} {filter:?}: {value} {expected}");
            }
        }
    }
}
