//! The files in `assets/` are what the example `make_assets` writes, and are sound.

#[path = "../examples/make_assets/figure.rs"]
mod figure;
#[path = "../examples/make_assets/glb.rs"]
mod glb;
#[path = "../examples/make_assets/keys.rs"]
mod keys;
#[path = "../examples/make_assets/knife.rs"]
mod knife;
#[path = "../examples/make_assets/noise.rs"]
mod noise;
#[path = "../examples/make_assets/relief.rs"]
mod relief;
#[path = "../examples/make_assets/surface_net.rs"]
mod surface_net;
#[path = "../examples/make_assets/textures.rs"]
mod textures;
#[path = "../examples/make_assets/water.rs"]
mod water;

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

fn mesh(name: &str) -> TriangleMesh {
    load_mesh(&in_repository(name), &mut Vec::new()).unwrap()
}

/// Pixels are compared, not bytes: another version of the encoder may compress better. Every
/// seventh row is painted anew.
#[test]
fn the_textures_are_those_that_the_example_paints() {
    for (name, painting) in textures::ALL {
        let (image, codes) = texture(&format!("assets/{name}"));
        assert_eq!((image.width, image.height), painting.size);
        for (y, row) in codes.chunks(image.width as usize).enumerate().step_by(7) {
            for (x, found) in row.iter().enumerate() {
                let [r, g, b] = painting.pixel(x as u32, y as u32);
                assert_eq!(*found, [r, g, b, 255], "{name} at ({x}, {y}): run `make_assets`");
            }
        }
    }
}

/// As many codes as there are, within the rounding of the last bit; and the normals are those of the heights.
#[test]
fn the_relief_is_that_of_its_wall() {
    let size = 512;
    let image = load_image(&in_repository("assets/relief-height.png"), Encoding::Linear).unwrap();
    let ImagePixels::Rgba32F(heights) = &image.pixels else { panic!("16 bits become floats") };
    assert_eq!((image.width, image.height), (size, size));
    for (k, height) in heights.iter().enumerate().step_by(13) {
        let code = relief::height_code(k as u32 % size, k as u32 / size, size);
        assert!((height[0] - f32::from(code) / 65535.0).abs() < 1e-6, "texel {k}");
    }
    let image = load_image(&in_repository("assets/relief-normals.png"), Encoding::Linear).unwrap();
    let ImagePixels::Rgba8(normals, _) = &image.pixels else { panic!("8 bits stay codes") };
    let size = image.width;
    for (k, &[r, g, b, _]) in normals.iter().enumerate().step_by(29) {
        let codes = relief::normal_codes(k as u32 % size, k as u32 / size, size);
        assert_eq!([r, g, b], codes, "texel {k}: run `make_assets`");
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

/// The volume of a closed surface, cubic metres, positive when its front is outside.
fn volume(points: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
    let under = |t: &[usize; 3]| {
        let [a, b, c] = t.map(|i| points[i]);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(under).sum()
}

/// In a closed surface every edge is used once in each direction; then the signed volume is that of
/// the solid. That it is one ball, without handles and without bits inside, shows in Euler's number.
#[test]
fn all_solids_are_closed_with_their_front_outside_and_of_their_volume() {
    // A chef's knife is tens of cubic centimetres.
    for (name, least, most) in [
        ("knife-blade.obj", 5e-6, 1e-4),
        ("knife-handle.obj", 5e-6, 1e-4),
        ("rabbit.glb", 0.1, 0.3),
        ("rabbit-coarse.glb", 0.1, 0.3),
        ("fish.glb", 1e-3, 1e-2),
    ] {
        let (points, triangles) = welded(&mesh(&format!("assets/{name}")));
        let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
        for [a, b, c] in &triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*from, *to)).or_default() += 1;
            }
        }
        for (&(from, to), &count) in &edges {
            assert_eq!(edges.get(&(to, from)), Some(&count), "{name}: {from} to {to}");
            // The ears of the coarse rabbit are thinner than its cells: it touches itself there.
            assert!(count == 1 || name == "rabbit-coarse.glb", "{name}: {from} to {to}");
        }
        let found = volume(&points, &triangles);
        assert!((least..most).contains(&found), "{name}: {found} m³");
        // Euler: a ball has V − E + F = 2, whatever its mesh.
        let euler = points.len() as i64 - edges.len() as i64 / 2 + triangles.len() as i64;
        assert!(euler == 2 || name == "rabbit-coarse.glb", "{name}: {euler}");
    }
}

/// Where the processor rounds a sine otherwise, a corner may be another `f32`, no more.
#[test]
fn the_figures_are_those_that_the_example_makes() {
    let (rabbit, fish) = (figure::rabbit(), figure::fish());
    for (name, made) in [
        ("rabbit.glb", surface_net::surface_net(&rabbit, 0.0122)),
        ("rabbit-coarse.glb", surface_net::surface_net(&rabbit, 0.045)),
        ("fish.glb", surface_net::surface_net(&fish, 0.004)),
    ] {
        let kept = fs::read(in_repository("assets").join(name)).unwrap();
        assert_eq!(kept.len(), made.to_glb().len(), "{name}: run `make_assets`");
        let read = mesh(&format!("assets/{name}"));
        assert_eq!(read.triangles, made.triangles, "{name}: run `make_assets`");
        let vectors = [(&read.positions, &made.positions), (&read.normals, &made.normals)];
        for (found, expected) in vectors.into_iter().flat_map(|(a, b)| a.iter().zip(b)) {
            assert!(found.as_dvec3().distance(*expected) < 1e-6, "{name}: {found} {expected}");
        }
    }
}

/// Oracle: the box that the rabbit was designed for, and the field on a grid of its own: the share of
/// points inside, and the field at the mesh, which is 0.
#[test]
fn the_rabbit_is_where_its_field_is_zero() {
    let rabbit = figure::rabbit();
    let mesh = mesh("assets/rabbit.glb");
    let (min, max) = mesh
        .positions
        .iter()
        .fold((glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY), |(min, max), p| {
            (min.min(*p), max.max(*p))
        });
    let expected = [DVec3::new(-0.585, 0.0, -0.275), DVec3::new(0.548, 1.229, 0.275)];
    for (found, expected) in [min, max].into_iter().zip(expected) {
        assert!((found.as_dvec3() - expected).abs().max_element() < 3e-3, "{found}");
    }
    for p in &mesh.positions {
        assert!(rabbit.distance(p.as_dvec3()).abs() < 1e-6, "{p}");
    }
    let (cell, mut inside) = (0.017, 0_u32);
    for k in 0..40 * 80 * 80 {
        let [x, y, z] = [k % 80, k / 80 % 80, k / 6400].map(|i| cell * (f64::from(i) + 0.5));
        inside += u32::from(rabbit.distance(DVec3::new(x - 0.68, y, z - 0.34)) < 0.0);
    }
    let counted = f64::from(inside) * cell.powi(3);
    let (points, triangles) = welded(&mesh);
    let enclosed = volume(&points, &triangles);
    assert!((enclosed / counted - 1.0).abs() < 0.01, "{enclosed} m³, counted {counted}");
}

#[test]
fn the_knife_ends_where_its_drawing_says_and_its_handle_is_smooth() {
    let blade = mesh("assets/knife-blade.obj");
    assert!(blade.normals.is_empty(), "flat faces");
    let tip = blade.positions.iter().max_by(|a, b| a.x.total_cmp(&b.x)).unwrap();
    assert!(tip.distance(glam::Vec3::new(0.26, -0.004, 0.0)) < 1e-6);
    let handle = mesh("assets/knife-handle.obj");
    for (t, [a, b, c]) in
        handle.triangles.iter().map(|t| (t, t.map(|i| handle.positions[i as usize])))
    {
        let face = (b - a).cross(c - a).normalize();
        assert!(t.iter().all(|&i| handle.normals[i as usize].dot(face) > 0.5), "{a} {b} {c}");
    }
}

/// The numbers of each key of a list, in their order, whatever is nested in it.
fn keys_of(text: &str) -> Vec<Vec<f64>> {
    let (mut keys, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, c) in text.char_indices() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        match c {
            '(' if depth == 1 => start = at,
            ')' if depth == 0 => {
                let words = text[start..at].split(|c: char| "(), ".contains(c));
                keys.push(words.filter_map(|word| word.parse().ok()).collect());
            }
            _ => {}
        }
    }
    keys
}

type Motion = fn(f64) -> f64;

/// Oracle: the formulas, between the keys, where the Hermite curve is free to differ.
#[test]
fn the_key_lists_follow_their_formulas_between_the_keys() {
    use std::f64::consts::{PI, TAU};
    let swing: Motion = |t| 4.0 * (PI * t).sin();
    let ringing: Motion = |t| {
        let tau = 24.0 * (t - 1.0);
        5.0 * (-tau / 5.0).exp() * (TAU * tau / 3.0).sin()
    };
    let fish: [Motion; 3] = [|t| 0.55 * (PI * t).cos(), |_| -0.45, |t| 0.38 * (PI * t).sin()];
    // Each with the number of values in a key, and which of them is meant.
    let mut cases = vec![
        (keys::swing(), 1, 0, swing, 2.6e-4),
        (keys::ringing(), 1, 0, ringing, 5.1e-3),
        (keys::float_tilt(1), 1, 0, (|t| water::float(keys::FLOAT, t)[1]) as Motion, 0.05),
        (keys::float_tilt(2), 1, 0, |t| water::float(keys::FLOAT, t)[2], 0.05),
        (keys::float_place(), 3, 1, |t| 0.06 + water::float(keys::FLOAT, t)[0], 4e-5),
    ];
    cases.extend((0..3).map(|c| (keys::fish_place(), 3, c, fish[c], 4e-5)));
    for (text, values, which, formula, tolerance) in cases {
        let keys = keys_of(&text);
        assert!(keys.len() >= 17, "{text}");
        for pair in keys.windows(2) {
            let (left, right) = (&pair[0], &pair[1]);
            let h = right[0] - left[0];
            let (p0, p1) = (left[1 + which], right[1 + which]);
            // The slope on leaving is the last, that on arriving the first.
            let (m0, m1) = (left[left.len() - values + which] * h, right[1 + values + which] * h);
            for s in [0.1, 0.25, 0.5, 0.75, 0.9] {
                let (s2, s3) = (s * s, s * s * s);
                let value = (2.0 * s3 - 3.0 * s2 + 1.0) * p0
                    + (s3 - 2.0 * s2 + s) * m0
                    + (3.0 * s2 - 2.0 * s3) * p1
                    + (s3 - s2) * m1;
                let error = value - formula(left[0] + s * h);
                assert!(error.abs() < tolerance, "at {}: {error}", left[0] + s * h);
            }
        }
    }
}

/// Oracle: the direction of the ellipse, from which the nose may not turn by more than 0.005°; its
/// slope, which a wrong derivative would bend between the keys.
#[test]
fn the_fish_swims_ahead() {
    use std::f64::consts::PI;
    let keys = keys_of(&keys::fish_heading());
    assert_eq!((keys[0][1], keys.last().unwrap()[1]), (-90.0, -450.0));
    for pair in keys.windows(2) {
        let (left, right) = (&pair[0], &pair[1]);
        let h = right[0] - left[0];
        let (t, slopes) = (left[0] + 0.5 * h, left[2] - right[2]);
        let middle = (f64::midpoint(left[1], right[1]) + slopes * h / 8.0).to_radians();
        let along = glam::DVec2::new(-0.55 * (PI * t).sin(), 0.38 * (PI * t).cos()).normalize();
        let nose = glam::DVec2::new(middle.cos(), -middle.sin());
        assert!(nose.dot(along) > 0.0);
        assert!(nose.perp_dot(along).abs() < 0.005_f64.to_radians(), "at {t}: {nose} {along}");
    }
}

/// The scenes hold the lists as they are printed; white space does not count.
#[test]
fn the_scenes_hold_the_key_lists_of_the_example() {
    let packed = |text: &str| text.split_whitespace().collect::<String>();
    for (scene, lists) in [("ball", 0..1), ("moving", 1..2), ("water", 2..8), ("glass", 8..9)] {
        let text = fs::read_to_string(in_repository(&format!("scenes/{scene}.ron"))).unwrap();
        for (name, keys) in &keys::ALL[lists] {
            let held = packed(&text).contains(&packed(&keys()));
            assert!(held, "{scene}, {name}: run the example with `--keys`");
        }
    }
}
