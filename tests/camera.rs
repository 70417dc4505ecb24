//! The camera: where things land on the film, how the lens blurs, and which way is up.

mod common;

use common::{Picture, render, scene};
use glam::{DVec2, Vec3};
use kinora::description::Layer;
use kinora::film::PlaneSamples;
use std::f64::consts::PI;

/// An emitter alone in the dark, before a camera at the origin which looks along −z.
fn before_camera(camera: &str, filter: &str, things: &str) -> String {
    format!(
        r#"(
        render: (filter: {filter}, max_depth: 1),
        textures: {{"checks": Checker()}},
        entities: {{"camera": (camera: ({camera})), {things}}})"#
    )
}

/// Oracle: the box filter of a straight edge through the centre of a column is one half there, 1 on
/// one side and 0 on the other, and the mirrored scene gives the mirrored picture.
#[test]
fn an_edge_through_a_pixel_centre_covers_half_of_it() {
    // 9 × 9 pixels of 1 m: column 4 has its centre at x = 0.
    let edge = |side: f64| {
        let text = before_camera(
            "orthographic: Some(9)",
            "Box()",
            &format!(
                r#""wall": (transform: (translation: ({}, 0, -1)), shape: Rectangle(size: (20, 20)), emission: Radiance((1, 1, 1)))"#,
                10.0 * side
            ),
        );
        render(&text, (9, 9), 1024)
    };
    let (right, left) = (edge(1.0), edge(-1.0));
    for y in 0..9 {
        for x in 0..9 {
            let expected = [0.0, 0.5, 1.0][(x > 4) as usize + (x >= 4) as usize];
            let value = right.at(x, y).y;
            assert!((value - expected).abs() <= 0.005, "({x}, {y}): {value}");
            let mirrored = left.at(8 - x, y).y;
            assert!((value - mirrored).abs() <= 0.005, "({x}, {y}): {value}, mirrored {mirrored}");
        }
    }
}

/// Brightness-weighted count, mean and mean squared distance from the mean, in pixels.
fn moments(picture: &Picture) -> (f64, DVec2, f64) {
    let width = picture.film.size().0 as usize;
    let place = |k: usize| DVec2::new((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
    let values = picture.green();
    let total: f64 = values.iter().sum();
    let mean = values.iter().enumerate().map(|(k, v)| place(k) * *v).sum::<DVec2>() / total;
    let spread =
        values.iter().enumerate().map(|(k, v)| (place(k) - mean).length_squared() * v).sum::<f64>();
    (total, mean, spread / total)
}

/// Oracle: at vertical field of view 60° the point (1, 0.5, −5) lies at 320 + 240·√3·(x/5) and
/// 240 − 240·√3·(y/5) pixels of 640 × 480: here at a tenth of that size, the middle of a square whose
/// coverage of each pixel is the product of two overlaps.
#[test]
fn points_land_where_the_projection_says() {
    let lamp = r#""lamp": (transform: (translation: (1, 0.5, -5)), shape: Rectangle(size: (0.4, 0.4)), emission: Radiance((1, 1, 1)))"#;
    let picture = render(&before_camera("fov: 60", "Box()", lamp), (64, 48), 256);
    let scale = 24.0 * 3.0_f64.sqrt();
    let middle = DVec2::new(32.0 + scale * 0.2, 24.0 - scale * 0.1);
    assert!(
        (middle * 10.0 - DVec2::new(403.138_44, 198.430_78)).length() < 1e-4,
        "the oracle itself"
    );
    let overlap = |pixel: u32, middle: f64| {
        let (low, high) = (middle - scale * 0.04, middle + scale * 0.04);
        (high.min(f64::from(pixel) + 1.0) - low.max(f64::from(pixel))).max(0.0)
    };
    for y in 0..48 {
        for x in 0..64 {
            let expected = overlap(x, middle.x) * overlap(y, middle.y);
            let value = f64::from(picture.at(x, y).y);
            assert!((value - expected).abs() < 0.02, "({x}, {y}): {value} instead of {expected}");
        }
    }
}

/// Oracle: a sphere of radius r at distance d on the axis has the silhouette radius
/// `h/(2·tan(fov/2)) · r/√(d² − r²)` pixels: the area of the ellipse of a sphere off the axis is larger by
/// its closed form; on the axis π times the square.
#[test]
fn a_sphere_covers_the_area_of_its_silhouette() {
    let ball = r#""ball": (transform: (translation: (0, 0, -5)), shape: Sphere(), emission: Radiance((1, 1, 1)))"#;
    let picture = render(&before_camera("fov: 60", "Box()", ball), (48, 48), 64);
    let radius = 24.0 * 3.0_f64.sqrt() / 24.0_f64.sqrt();
    let area: f64 = picture.green().iter().sum();
    let expected = PI * radius * radius;
    assert!((area / expected - 1.0).abs() < 2e-3, "{area} instead of {expected}");
}

/// The picture of a lamp out of focus: its image in focus is a square of 1.2 pixels. Aperture radius 0.05, in
/// focus at 4, the field chosen so that a pixel of the plane in focus is 0.01 m.
fn blur(z: f64, camera: &str, samples: u32) -> Picture {
    // blur on the plane in focus has the diameter A·|z − f|/z, A = 0.1
    let fov = (2.0 * (0.12_f64 / 4.0).atan()).to_degrees();
    let size = 0.012 * z / 4.0;
    let lamp = format!(
        r#""lamp": (transform: (translation: (0, 0, {})), shape: Rectangle(size: ({size}, {size})), emission: Radiance((1, 1, 1)))"#,
        -z
    );
    let camera = format!("fov: {fov}, aperture: 0.05, {camera}");
    render(&before_camera(&camera, "Box()", &lamp), (24, 24), samples)
}

/// Oracle: a point at depth z is spread evenly over a disk of diameter `A·|z − f|/z` in the plane in focus,
/// whose mean squared radius is half the squared radius (a lens sampled as u·R would give a third).
#[test]
fn a_point_out_of_focus_becomes_an_even_disk() {
    for (z, diameter) in [(8.0, 0.05), (2.0, 0.1), (2.666_666_7, 0.05)] {
        let picture = blur(z, "focus: Some(4)", 8192);
        let (_, mean, spread) = moments(&picture);
        assert!((mean - 12.0).length() < 0.15, "z = {z}: centre {mean}");
        let radius = 0.5 * diameter / 0.01;
        // Pixels and the lamp itself add their own second moments, a²/6 each.
        let expected = 0.5 * radius * radius + 1.0 / 6.0 + 1.44 / 6.0;
        assert!((spread / expected - 1.0).abs() < 0.05, "z = {z}: {spread} instead of {expected}");
    }
}

/// Oracle: the area of a lit aperture: what a polygon of n blades covers of its circle is
/// `(n/2)·sin(2π/n)/π`; its second moment is `R²/6·(2 + cos(2π/n))`.
#[test]
fn blades_shape_the_blur() {
    for blades in [3_u32, 4, 6] {
        let camera = format!("focus: Some(4), blades: {blades}, blade_rotation: 20");
        let (_, _, spread) = moments(&blur(2.0, &camera, 8192));
        let angle = std::f64::consts::TAU / f64::from(blades);
        let expected = 25.0 / 6.0 * (2.0 + angle.cos()) + 1.0 / 6.0 + 1.44 / 6.0;
        assert!(
            (spread / expected - 1.0).abs() < 0.05,
            "{blades} blades: {spread} instead of {expected}"
        );
    }
}

/// Oracle: what lies in the plane in focus is as sharp as through a pinhole, by distance, by the name of
/// an entity, and to the corners; a focus at infinity is that of a very far distance.
#[test]
fn what_is_in_focus_is_as_sharp_as_through_a_pinhole() {
    let checks = |lens: &str| {
        let things = r#"
            "wall": (transform: (translation: (0, 0, -4)), shape: Rectangle(size: (8, 8)), emission: Radiance("checks")),
            "aim": (transform: (translation: (1.5, 0.2, -4)))"#;
        let text = before_camera(&format!("fov: 50, {lens}"), "Box()", things);
        render(
            &text.replacen("Checker()", "Checker(size: 0.0625, a: (1, 1, 1), b: (0, 0, 0))", 1),
            (24, 24),
            1024,
        )
    };
    let sharp = checks("");
    for lens in ["aperture: 0.3, focus: Some(4)", "aperture: 0.3, focus: Some(\"aim\")"] {
        let picture = checks(lens);
        for (k, (a, b)) in sharp.green().iter().zip(picture.green()).enumerate() {
            assert!((a - b).abs() < 0.04, "{lens}, pixel {k}: {a} through a pinhole, {b}");
        }
    }
    let blurred = checks("aperture: 0.3, focus: Some(2)");
    let contrast = |p: &Picture| p.green().iter().map(|v| (v - 0.5).abs()).sum::<f64>();
    assert!(contrast(&blurred) < 0.5 * contrast(&sharp), "out of focus is not sharp");
    let far = checks("aperture: 0.3, focus: Some(1e15)");
    let none = checks("aperture: 0.3");
    for (a, b) in far.green().iter().zip(none.green()) {
        assert!((a - b).abs() < 0.02, "{a} and {b}");
    }
}

/// Oracle: an f-number N on a sensor of height h = 24 mm is the radius h/(4·N·tan(fov/2)).
#[test]
fn f_numbers_are_apertures() {
    let lamp = r#""lamp": (transform: (translation: (0, 0, -2)), shape: Disk(radius: 0.02), emission: Radiance((1, 1, 1)))"#;
    let picture = |lens: &str| {
        render(
            &before_camera(&format!("fov: 40, focus: Some(1), {lens}"), "Box()", lamp),
            (16, 16),
            64,
        )
    };
    let radius = 0.024 / (4.0 * 1.4 * 20_f64.to_radians().tan());
    let (a, b) = (picture("f_number: Some(1.4)"), picture(&format!("aperture: {radius}")));
    for (a, b) in a.green().iter().zip(b.green()) {
        assert!((a - b).abs() < 1e-6, "{a} and {b}");
    }
}

/// An image of 2 × 2 colours: red above left, green above right, blue below left, white below right.
fn four_colors(text: &str, size: (u32, u32)) -> Picture {
    use kinora::description::{
        Channel, Encoding, ImageData, ImagePixels, Texture, TextureFilter, Wrap,
    };
    let pixels = vec![[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], [1.0; 4]];
    let file = ImageData { width: 2, height: 2, pixels: ImagePixels::Rgba32F(pixels) };
    let mut description = scene(text);
    (description.render.size, description.render.samples) = (size, 16);
    let image = Texture::Image {
        file: file.into(),
        encoding: Encoding::Linear,
        wrap: Wrap::Repeat,
        filter: TextureFilter::Nearest,
        channel: Channel::Luminance,
        repeat: glam::Vec2::ONE,
        offset: glam::Vec2::ZERO,
    };
    description.textures.insert("checks".to_owned(), image);
    common::render_description(&description, 0)
}

/// Oracle: what a person would see: an image on a wall is upright and not mirrored, the upper left pixel is
/// (0, 0); seen from a camera on its head it stands on its head; from behind it is mirrored; in
/// a mirror as well.
#[test]
fn pictures_are_the_right_way_round() {
    const COLORS: [Vec3; 4] = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let quad = r"(0.5, 0.5, 0), (-0.5, 0.5, 0), (-0.5, -0.5, 0), (0.5, -0.5, 0)";
    let mesh = format!(
        r#"meshes: {{"quad": Triangles(positions: [{quad}], uvs: [(1, 1), (0, 1), (0, 0), (1, 0)], triangles: [(0, 1, 2), (0, 2, 3)])}}, entities"#
    );
    let wall = r#""wall": (transform: (translation: (0, 0, -2)), shape: Rectangle(), two_sided: true, emission: Radiance("checks"))"#;
    let cases = [
        ("rectangle", "", wall.to_owned(), [0, 1, 2, 3]),
        ("mesh", "", wall.replace("Rectangle()", "Mesh(\"quad\")"), [0, 1, 2, 3]),
        ("box", "", wall.replace("Rectangle()", "Box(size: (1, 1, 0.1))"), [0, 1, 2, 3]),
        ("camera on its head", "transform: (rotation: (0, 0, 180)), ", wall.to_owned(), [3, 2, 1, 0]),
        ("from behind", "transform: (translation: (0, 0, -4), rotation: (0, 180, 0)), ", wall.to_owned(), [1, 0, 3, 2]),
        ("scaled by −1 across", "", wall.replace("-2))", "-2), scale: (-1, 1, 1))"), [1, 0, 3, 2]),
        (
            "in a mirror",
            "",
            r#""mirror": (transform: (translation: (0, 0, -1)), shape: Rectangle(size: (9, 9)), material: "mirror"),
               "wall": (transform: (translation: (0, 0, 1), rotation: (0, 180, 0)), shape: Rectangle(), two_sided: true, emission: Radiance("checks"))"#.to_owned(),
            [1, 0, 3, 2],
        ),
        ("sky", "", r#""sky": (light: Sky(radiance: "checks"))"#.to_owned(), [0, 1, 2, 3]),
    ];
    for (name, camera, things, expected) in cases {
        let text = before_camera("fov: 25", "Box()", &things)
            .replacen(r#""camera": ("#, &format!(r#""camera": ({camera}"#), 1)
            .replacen("entities", "materials: {\"mirror\": Mirror()}, entities", 1)
            .replacen("entities", &mesh, 1);
        let picture = four_colors(&text, (2, 2));
        for (k, color) in expected.into_iter().enumerate() {
            let pixel = picture.at(k as u32 % 2, k as u32 / 2);
            let expected = COLORS[color] * pixel.max_element();
            assert!(
                (pixel - expected).length() < 1e-5 && pixel != Vec3::ZERO,
                "{name}, pixel {k}: {pixel}"
            );
        }
    }
}

/// Oracle: an orthographic camera shows a rectangle of the same size at every distance.
#[test]
fn an_orthographic_camera_knows_no_distance() {
    for z in [-1.0, -10.0, -1000.0] {
        let wall = format!(
            r#""wall": (transform: (translation: (1, 1, {z})), shape: Rectangle(size: (2, 2)), emission: Radiance((1, 1, 1)))"#
        );
        let picture = render(&before_camera("orthographic: Some(8)", "Box()", &wall), (8, 8), 4);
        for y in 0..8 {
            for x in 0..8 {
                let inside = (4..6).contains(&x) && (2..4).contains(&y);
                assert_eq!(
                    picture.at(x, y).y,
                    if inside { 1.0 } else { 0.0 },
                    "z = {z}, ({x}, {y})"
                );
            }
        }
    }
}

/// What is hidden from the camera is seen by mirrors, and lights the scene.
#[test]
fn hidden_lamps_are_seen_by_mirrors_alone() {
    let lamp = r#""lamp": (transform: (translation: (0, 0, -2)), shape: Disk(radius: 9), two_sided: true, hidden_from_camera: true, emission: Radiance((1, 1, 1)))"#;
    assert_eq!(render(&before_camera("fov: 40", "Box()", lamp), (2, 2), 4).mean().mean, 0.0);
    let mirror = format!(
        r#"{lamp}, "mirror": (transform: (translation: (0, 0, -3)), shape: Disk(radius: 9), material: "mirror")"#
    );
    let text = before_camera("fov: 40", "Box()", &mirror).replacen(
        "entities",
        "materials: {\"mirror\": Mirror()}, entities",
        1,
    );
    assert_eq!(render(&text, (2, 2), 4).mean().mean, 1.0);
}

/// What a scene under an even white sky looks like with this background, by a method.
fn under_a_sky(method: &str, background: &str) -> Picture {
    let text = format!(
        r#"(
        render: (size: (24, 18), samples: 16, background: {background}, {method}),
        clock: (shutter: (0, 1)),
        materials: {{
            "gray": Diffuse(), "glass": Dielectric(), "net": Masked(material: "gray", opacity: 0.5),
            "haze": Dielectric(ior: 1, attenuation: Some((color: (0.3, 0.3, 0.3), distance: 1))),
            "fog": Dielectric(ior: 1, scattering: Some((coefficient: (1, 1, 1)))),
        }},
        entities: {{
            "camera": (transform: (translation: (0, 0, 6)), camera: (fov: 40)),
            "ball": (transform: (translation: (-1.5, 1, 0)), shape: Sphere(radius: 0.6), material: "gray", velocity: (linear: (20, 0, 0))),
            "glass": (transform: (translation: (1.3, 1, 0)), shape: Sphere(radius: 0.7), material: "glass"),
            "net": (transform: (translation: (0, -0.2, 0.5)), shape: Rectangle(size: (1, 0.8)), material: "net"),
            "haze": (transform: (translation: (-1.2, -0.8, 0)), shape: Sphere(radius: 0.8), material: "haze"),
            "fog": (transform: (translation: (1.2, -0.9, 0)), shape: Sphere(radius: 0.7), material: "fog"),
            "sky": (light: Sky(radiance: 2)),
        }})"#
    );
    render(&text, (24, 18), 16)
}

/// Oracle: A over B = A + (1 − α)·B (Porter and Duff 1984), which for an even sky is that sky seen. It
/// holds path by path, so that nothing but rounding is left: with motion blur, glass, holes, and media which
/// absorb or scatter, for all integrators.
#[test]
fn a_transparent_background_over_the_sky_is_the_picture_with_the_sky() {
    for method in [
        "integrator: Path",
        "integrator: Path, caustics: Photons",
        "integrator: Sppm",
        "integrator: PhotonMap",
    ] {
        let (sky, clear) = (under_a_sky(method, "Sky"), under_a_sky(method, "Transparent"));
        let planes = clear.film.image(Layer::Beauty).expect("always there");
        assert_eq!(planes.len(), 4, "{method}");
        let PlaneSamples::F32(alpha) = &planes[3].samples else { panic!("alpha is a number") };
        for (k, &alpha) in alpha.iter().enumerate() {
            let (x, y) = (k as u32 % 24, k as u32 / 24);
            let over = clear.at(x, y) + (1.0 - alpha) * Vec3::splat(2.0);
            let off = (over - sky.at(x, y)).abs().max_element();
            assert!(off <= 1e-5, "{method}, ({x}, {y}): {over} instead of {}", sky.at(x, y));
        }
        // Corner, glass, net, the middle of the haze: 0.3^1.6.
        let seen = [(0, 0), (17, 4), (12, 9), (6, 12)].map(|(x, y)| alpha[y * 24 + x]);
        assert_eq!(seen[..2], [0.0, 1.0], "{method}");
        assert!((seen[2] - 0.5).abs() < 0.2, "{method}: {seen:?}");
        assert!((seen[3] - 0.85).abs() < 0.05, "{method}: {seen:?}");
        assert!(alpha.iter().any(|alpha| (0.1..0.4).contains(alpha)), "{method}: what moves");
    }
    assert_eq!(
        under_a_sky("integrator: Path", "Sky").film.image(Layer::Beauty).map(|p| p.len()),
        Some(3)
    );
}
