//! Meshes in whole pictures: they do not shadow themselves, and light ends smoothly on them.

mod common;

use common::{Picture, icosphere, mean_of_seeds, mesh_text, render_description, scene};
use glam::{DVec3, Vec3};
use kinora::description::{Layer, Terminator, TriangleMesh};
use kinora::film::PlaneSamples;
use std::f64::consts::PI;

/// The unit square at z = 0 of two triangles, facing +z.
fn square() -> TriangleMesh {
    let corner = |x, y| Vec3::new(x, y, 0.0);
    TriangleMesh {
        positions: vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }
}

/// Oracle: the cosine law. A wall in the sun whose plane goes through the camera, seen in a mirror: `½·E·cos θ/π` in
/// every pixel. With a second mesh both are in one tree.
#[test]
fn a_mesh_whose_plane_goes_through_the_camera_is_lit_as_the_cosine_law_says() {
    let expected = 0.5 / 5.0_f64.sqrt();
    for (place, second) in [
        (0.0, ""),
        (1e-20, ""),
        (
            0.0,
            r#""other": (shape: Mesh("other"), transform: (translation: (0, 0, -3)), material: "wall"),"#,
        ),
    ] {
        let text = format!(
            r#"(
            render: (max_depth: 2, integrator: Path, filter: Box()),
            materials: {{"wall": Diffuse(albedo: (0.5, 0.5, 0.5)), "mirror": Mirror()}},
            meshes: {{ {}, {} }},
            entities: {{
                "camera": (transform: (translation: (0, 2, {place:?}), look_at: (0, 1, 1)), camera: (fov: 8)),
                "mirror": (transform: (translation: (0, 1, 1), rotation: (180, 0, 0)), shape: Rectangle(size: (0.6, 0.6)), material: "mirror"),
                "wall": (shape: Mesh("square"), material: "wall"),
                {second}
                "sun": (transform: (translation: (2, 0, 1), look_at: (0, 0, 0)), light: Directional(irradiance: ({PI}, {PI}, {PI}))),
            }})"#,
            mesh_text("square", &square()),
            mesh_text("other", &square()),
        );
        let mut description = scene(&text);
        (description.render.size, description.render.samples) = ((16, 16), 4);
        let picture = render_description(&description, 0);
        for (k, value) in picture.green().into_iter().enumerate() {
            let error = (value / expected - 1.0).abs();
            assert!(error < 1e-5, "camera at z = {place:e}, pixel {k}: {value} for {expected}");
        }
    }
}

/// Oracle: the rectangle at the same place. A lamp whose plane goes through the camera lights a floor by photons, most of which
/// leave it at a slant.
#[test]
fn photons_leave_a_mesh_as_they_leave_a_rectangle() {
    let lit = |shape: &str| {
        let text = format!(
            r#"(
            render: (max_depth: 1, integrator: Sppm, filter: Box(), photons: (per_pass: Some(20000), direct: Photons)),
            materials: {{"floor": Diffuse(albedo: (0.5, 0.5, 0.5))}},
            meshes: {{ {} }},
            entities: {{
                "camera": (transform: (translation: (0.9, 1, 0), look_at: (0.3, -0.6, 0.5)), camera: (fov: 40)),
                "floor": (transform: (translation: (0, -0.6, 0), rotation: (-90, 0, 0)), shape: Rectangle(size: (4, 4)), material: "floor"),
                "lamp": (shape: {shape}, emission: Radiance((1, 1, 1))),
            }})"#,
            mesh_text("square", &square()),
        );
        mean_of_seeds(&text, (8, 8), 4)
    };
    let (mesh, rectangle) = (lit("Mesh(\"square\")"), lit("Rectangle()"));
    let difference = (mesh.mean / rectangle.mean - 1.0).abs();
    let error = (mesh.error + rectangle.error) / rectangle.mean;
    assert!(difference <= 3.0 * error && error < 0.02, "{mesh:?} for {rectangle:?}");
}

/// A coarse ball with the normals of the sphere, in one sun.
fn ball(levels: u32, terminator: Terminator) -> Picture {
    let text = format!(
        r#"(
        render: (max_depth: 1, integrator: Path, filter: Box(), layers: [Beauty, Normal, Position], layer_filter: Mean),
        materials: {{"white": Diffuse(albedo: (1, 1, 1))}},
        meshes: {{ {} }},
        entities: {{
            "camera": (transform: (translation: (0, 0, 4)), camera: (fov: 30)),
            "ball": (transform: (rotation: (20, 30, 0)), shape: Mesh("ball"), material: "white"),
            "sun": (transform: (translation: (3, 1, 0.5), look_at: (0, 0, 0)), light: Directional(irradiance: ({PI}, {PI}, {PI}))),
        }})"#,
        mesh_text("ball", &icosphere(levels, true)),
    );
    let mut description = scene(&text);
    (description.render.size, description.render.samples) = ((128, 128), 1);
    description.render.terminator = terminator;
    render_description(&description, 0)
}

fn vectors(picture: &Picture, layer: Layer) -> Vec<DVec3> {
    let planes = picture.film.image(layer).expect("asked for");
    let channel = |k: usize| match &planes[k].samples {
        PlaneSamples::F32(values) => values.as_slice(),
        PlaneSamples::U32(_) => panic!("vectors are numbers"),
    };
    let [x, y, z] = [0, 1, 2].map(channel);
    x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x, y, z).as_dvec3()).collect()
}

/// Of the pixels which show the ball: the share of those darker than half of what their smooth normal says, among those
/// that it lights, and the brightest of those that it does not. Near the rim normals of a coarse ball turn away from the
/// camera, and the triangle's is taken: the rim is left out.
fn edge_of_light(picture: &Picture) -> (f64, f64) {
    let sun = DVec3::new(3.0, 1.0, 0.5).normalize();
    let (mut lit, mut dark, mut brightest) = (0.0, 0.0, 0.0_f64);
    let (normals, places) = (vectors(picture, Layer::Normal), vectors(picture, Layer::Position));
    for ((value, n), p) in picture.green().into_iter().zip(normals).zip(places) {
        if n.dot((DVec3::Z * 4.0 - p).normalize()) < 0.4 {
            continue;
        }
        let expected = n.dot(sun);
        if expected > 0.0 {
            lit += 1.0;
            dark += f64::from(u8::from(value < 0.5 * expected));
        } else {
            brightest = brightest.max(value);
        }
    }
    (dark / lit, brightest)
}

/// Oracle: the cosine of the smooth normal. By the triangles, one in thirty of the pixels that it lights, and
/// of a finer ball one in a hundred, is less than half as bright.
#[test]
fn light_ends_on_a_coarse_mesh_where_its_smooth_normals_turn_away() {
    for (levels, faceted_at_least) in [(1, 0.03), (2, 0.01)] {
        let (dark, brightest) = edge_of_light(&ball(levels, Terminator::Smooth));
        let (faceted, _) = edge_of_light(&ball(levels, Terminator::Faceted));
        assert!(dark <= 0.002, "{levels}: {dark} of the pixels are below half");
        assert!(brightest <= 1e-6, "{levels}: {brightest} on the dark side");
        assert!(faceted >= faceted_at_least, "{levels}: {faceted} by the triangles");
    }
}
