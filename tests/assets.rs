//! The files in `assets/` are what the example `make_assets` writes, and are sound.

#[path = "../examples/make_assets/keys.rs"]
mod keys;
#[path = "../examples/make_assets/knife.rs"]
mod knife;
#[path = "../examples/make_assets/noise.rs"]
mod noise;
#[path = "../examples/make_assets/textures.rs"]
mod textures;

use glam::DVec3;
use kinora::description::assets::{load_image, load_mesh};
use kinora::description::{Encoding, ImageData, ImagePixels, TriangleMesh};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

fn in_repository(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn texture(name: &str) -> (ImageData, Vec<[u8; 4]>) {
    let image = load_image(&in_repository(name), Encoding::Srgb).unwrap();
    let ImagePixels::Rgba8(codes, Encoding::Srgb) = &image.pixels else { panic!("8-bit sRGB") };
    let codes = codes.clone();
    (image, codes)
}

fn knife_part(name: &str) -> TriangleMesh {
    load_mesh(&in_repository(name)).unwrap()
}

/// Pixels are compared, not bytes: another version of the encoder may compress better. Every
/// seventh row is painted anew.
#[test]
fn the_textures_are_those_that_the_example_paints() {
    for (name, painting) in
        [("assets/stone-wall.png", textures::STONE_WALL), ("assets/wood.png", textures::WOOD_BOARD)]
    {
        let (image, codes) = texture(name);
        assert_eq!((image.width, image.height), painting.size);
        for (y, row) in codes.chunks(image.width as usize).enumerate().step_by(7) {
            for (x, found) in row.iter().enumerate() {
                let [r, g, b] = painting.pixel(x as u32, y as u32);
                assert_eq!(*found, [r, g, b, 255], "{name} at ({x}, {y}): run `make_assets`");
            }
        }
    }
}

#[test]
fn the_meshes_are_those_that_the_example_writes() {
    for (name, text) in
        [("assets/knife-blade.obj", knife::blade()), ("assets/knife-handle.obj", knife::handle())]
    {
        assert_eq!(fs::read_to_string(in_repository(name)).unwrap(), text, "{name}");
    }
}

/// Oracle: the mean reflectance that the stone was designed for, (0.41, 0.37, 0.33).
#[test]
fn the_stone_reflects_as_much_as_it_should() {
    let (_, codes) = texture("assets/stone-wall.png");
    for (channel, expected) in [(0, 0.41), (1, 0.37), (2, 0.33)] {
        let decode = |code: u8| {
            let code = f64::from(code) / 255.0;
            if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
        };
        let mean = codes.iter().map(|c| decode(c[channel])).sum::<f64>() / codes.len() as f64;
        assert!((mean - expected).abs() < 0.015, "channel {channel}: {mean}");
    }
}

/// Points of the mesh, welded by position, and its triangles over them.
fn welded(mesh: &TriangleMesh) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let (mut points, mut index) = (Vec::new(), HashMap::new());
    let welded: Vec<usize> = mesh
        .positions
        .iter()
        .map(|p| {
            *index.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                points.push(p.as_dvec3());
                points.len() - 1
            })
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|i| welded[i as usize])).collect();
    (points, triangles)
}

/// In a closed surface every edge is used once in each direction; then the signed volume is that of
/// the solid, positive when its front is outside.
#[test]
fn both_parts_of_the_knife_are_closed_with_their_front_outside() {
    for name in ["assets/knife-blade.obj", "assets/knife-handle.obj"] {
        let (points, triangles) = welded(&knife_part(name));
        let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
        for [a, b, c] in &triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*from, *to)).or_default() += 1;
            }
        }
        for (&(from, to), &count) in &edges {
            assert_eq!((count, edges.get(&(to, from))), (1, Some(&1)), "{name}: {from} to {to}");
        }
        let volume: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| points[i]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        // A chef's knife: blade and handle are tens of cubic centimetres.
        assert!((5e-6..1e-4).contains(&volume), "{name}: {volume} m³");
    }
}

#[test]
fn the_knife_ends_where_its_drawing_says_and_its_handle_is_smooth() {
    let blade = knife_part("assets/knife-blade.obj");
    assert!(blade.normals.is_empty(), "flat faces");
    let tip = blade.positions.iter().max_by(|a, b| a.x.total_cmp(&b.x)).unwrap();
    assert!(tip.distance(glam::Vec3::new(0.26, -0.004, 0.0)) < 1e-6);
    let handle = knife_part("assets/knife-handle.obj");
    for (t, [a, b, c]) in
        handle.triangles.iter().map(|t| (t, t.map(|i| handle.positions[i as usize])))
    {
        let face = (b - a).cross(c - a).normalize();
        assert!(t.iter().all(|&i| handle.normals[i as usize].dot(face) > 0.5), "{a} {b} {c}");
    }
}

type Motion = fn(f64) -> f64;

/// Oracle: the formulas, between the keys, where the Hermite curve is free to differ.
#[test]
fn the_key_lists_follow_their_formulas_between_the_keys() {
    use std::f64::consts::{PI, TAU};
    let swing = |t: f64| 4.0 * (PI * t).sin();
    let ringing = |t: f64| {
        let tau = 24.0 * (t - 1.0);
        5.0 * (-tau / 5.0).exp() * (TAU * tau / 3.0).sin()
    };
    for (text, formula, tolerance) in
        [(keys::swing(), swing as Motion, 2.6e-4), (keys::ringing(), ringing as Motion, 5.1e-3)]
    {
        // (time, value, leaving slope, arriving slope): the same but at the first key of a motion.
        let keys: Vec<Vec<f64>> = text
            .split('(')
            .skip(1)
            .map(|key| {
                key.split(')').next().unwrap().split(", ").map(|x| x.parse().unwrap()).collect()
            })
            .collect();
        for pair in keys.windows(2) {
            let (left, right) = (&pair[0], &pair[1]);
            let h = right[0] - left[0];
            let (m0, m1) = (left.last().unwrap() * h, right[2] * h);
            for s in [0.1, 0.25, 0.5, 0.75, 0.9] {
                let (s2, s3) = (s * s, s * s * s);
                let value = (2.0 * s3 - 3.0 * s2 + 1.0) * left[1]
                    + (s3 - 2.0 * s2 + s) * m0
                    + (3.0 * s2 - 2.0 * s3) * right[1]
                    + (s3 - s2) * m1;
                let error = value - formula(left[0] + s * h);
                assert!(error.abs() < tolerance, "at {}: {error}", left[0] + s * h);
            }
        }
    }
}

/// The scenes hold the lists as they are printed; white space does not count.
#[test]
fn the_scenes_hold_the_key_lists_of_the_example() {
    let packed = |text: &str| text.split_whitespace().collect::<String>();
    for (scene, keys) in
        [("scenes/ball.ron", keys::swing()), ("scenes/moving.ron", keys::ringing())]
    {
        let text = packed(&fs::read_to_string(in_repository(scene)).unwrap());
        assert!(text.contains(&packed(&keys)), "{scene}: run the example with `--keys`");
    }
}
