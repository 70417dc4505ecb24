//! Paths that neighbouring pixels share: the same mean for every pixel, with less noise.

mod common;

use common::{render_as_described, scene};

/// Side of a picture and of the blocks in which it is compared, pixels.
const SIDE: u32 = 20;
const BLOCK: u32 = 5;
const BLOCKS: usize = (SIDE / BLOCK * (SIDE / BLOCK)) as usize;
/// Renders with different seeds.
const SEEDS: u64 = 24;
/// Renders of the larger picture, in which thousands of pixels are averaged.
const FEW_SEEDS: u64 = 6;

/// A room with a lamp, open to the front, and what stands in it.
fn room(inside: &str) -> String {
    format!(
        r#"(
        render: (filter: Box(radius: 0.5), samples: 16, size: ({SIDE}, {SIDE})),
        materials: {{
            "white": Diffuse(albedo: (0.8, 0.8, 0.8)), "red": Diffuse(albedo: (0.7, 0.1, 0.1)),
            "mirror": Mirror(), "glass": Dielectric(ior: 1.5),
            "varnish": Plastic(albedo: (0.5, 0.5, 0.5), ior: 1.5, roughness: 0.3),
            "steel": Conductor(metal: Iron, roughness: 0.4),
        }},
        entities: {{
            "camera": (transform: (translation: (0, 1, 3.4), look_at: (0, 1, 0)), camera: (fov: 40)),
            "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (2, 2)), material: "varnish"),
            "ceiling": (transform: (translation: (0, 2, 0), rotation: (90, 0, 0)), shape: Rectangle(size: (2, 2)), material: "white"),
            "back": (transform: (translation: (0, 1, -1)), shape: Rectangle(size: (2, 2)), material: "white"),
            "left": (transform: (translation: (-1, 1, 0), rotation: (0, 90, 0)), shape: Rectangle(size: (2, 2)), material: "red"),
            "right": (transform: (translation: (1, 1, 0), rotation: (0, -90, 0)), shape: Rectangle(size: (2, 2)), material: "white"),
            "lamp": (transform: (translation: (0.2, 1.95, 0.1), rotation: (90, 0, 0)), shape: Rectangle(size: (0.5, 0.4)), emission: Radiance((9, 9, 9))),
            {inside}
        }})"#
    )
}

/// Means of blocks, one list for each seed.
fn blocks(text: &str, share: u32) -> Vec<[f64; BLOCKS]> {
    let mut description = scene(text);
    description.render.share = share;
    (0..SEEDS)
        .map(|seed| {
            description.render.seed = 1000 * u64::from(share) + seed;
            let green = render_as_described(&description, 0).green();
            let mut sums = [0.0; BLOCKS];
            for (k, value) in green.iter().enumerate() {
                let (x, y) = (k as u32 % SIDE / BLOCK, k as u32 / SIDE / BLOCK);
                sums[(y * (SIDE / BLOCK) + x) as usize] += value / f64::from(BLOCK * BLOCK);
            }
            sums
        })
        .collect()
}

/// Mean over the seeds and its variance.
fn mean_and_variance(all: &[[f64; BLOCKS]], block: usize) -> (f64, f64) {
    let n = all.len() as f64;
    let mean = all.iter().map(|one| one[block]).sum::<f64>() / n;
    let spread = all.iter().map(|one| (one[block] - mean).powi(2)).sum::<f64>();
    (mean, spread / (n - 1.0) / n)
}

/// Oracle: the path tracer without sharing, block by block. Welch's statistic stays below 5 in all 64
/// comparisons (a normal variable exceeds it with probability 6e-7; with 24 seeds its tails are a little
/// heavier), and over all blocks the mean square is near 1.
#[test]
fn sharing_keeps_the_mean_of_every_part_of_a_picture() {
    let ball = |name: &str, x: f64, material: &str| {
        format!(
            r#""{name}": (transform: (translation: ({x}, 0.4, 0.1)), shape: Sphere(radius: 0.4), material: "{material}"),"#
        )
    };
    let wall = r#""wall": (transform: (translation: (0.1, 0.6, 0.2), rotation: (0, 70, 0)), shape: Box(size: (1, 1.2, 0.001)), material: "red"),"#;
    for (what, inside) in [
        ("an empty room", String::new()),
        ("a thin wall", wall.to_owned()),
        ("mirror and glass", ball("a", -0.45, "mirror") + &ball("b", 0.45, "glass")),
        ("varnish and steel", ball("a", -0.45, "varnish") + &ball("b", 0.45, "steel")),
    ] {
        let text = room(&inside);
        let (alone, shared) = (blocks(&text, 1), blocks(&text, 4));
        let mut square = 0.0;
        for block in 0..BLOCKS {
            let (a, va) = mean_and_variance(&alone, block);
            let (b, vb) = mean_and_variance(&shared, block);
            let z = (a - b) / (va + vb).sqrt();
            assert!(z.abs() < 5.0, "{what}, block {block}: {a} alone, {b} shared, {z:.2} errors");
            square += z * z / BLOCKS as f64;
        }
        assert!(square < 3.0, "{what}: mean square {square:.2}");
    }
}

/// Oracle: the variance between seeds. Where the lamp shines at the ceiling and all else is lit by
/// bounces, the noise of single pixels falls to a third at least, for groups of 4 pixels which are a small part of the picture.
#[test]
fn sharing_takes_noise_away() {
    let lamp = "translation: (0.2, 1.95, 0.1), rotation: (90, 0, 0)";
    let text = room("");
    assert!(text.contains(lamp));
    let turned_up = text.replace(lamp, "translation: (0.2, 1.2, 0.1), rotation: (-90, 0, 0)");
    let mut description = scene(&turned_up);
    description.render.size = (64, 64);
    let mut noise = |share: u32| {
        description.render.share = share;
        let pictures: Vec<Vec<f64>> = (0..FEW_SEEDS)
            .map(|seed| {
                description.render.seed = seed;
                render_as_described(&description, 0).green()
            })
            .collect();
        let n = FEW_SEEDS as f64;
        (0..pictures[0].len())
            .map(|k| {
                let mean = pictures.iter().map(|p| p[k]).sum::<f64>() / n;
                pictures.iter().map(|p| (p[k] - mean).powi(2)).sum::<f64>() / (mean * mean + 0.01)
            })
            .sum::<f64>()
    };
    let (alone, shared) = (noise(1), noise(4));
    assert!(shared * 3.0 < alone, "{alone} alone, {shared} shared");
}

/// Oracle: one thread. The room has meshes at rest in one tree, and paths which are shared.
#[test]
fn shared_paths_and_meshes_at_rest_are_the_same_on_any_number_of_threads() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.ron");
    let mut description =
        kinora::description::load_scene(&path, &kinora::description::LoadOptions::default())
            .unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    (description.render.size, description.render.samples) = ((70, 50), 4);
    assert_eq!(description.render.share, 4, "the default shares");
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| render_as_described(&description, 0))
    };
    let one = with(1);
    for threads in [2, 5] {
        assert!(one.same_bits(&with(threads)), "{threads} threads");
    }
}
