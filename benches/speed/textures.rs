//! What filtering a texture is worth: checkers to the horizon by 4 samples a pixel.

use crate::Options;
use crate::clock::{median, process_seconds};
use crate::report::{Report, section};
use kinora::description::{
    Channel, Encoding, ImageData, ImagePixels, LoadOptions, SceneDescription, SceneTexture,
    Texture, TextureFilter, TextureFiltering, Wrap, parse_scene_str,
};
use kinora::film::Film;
use kinora::frame::{RenderControl, Simulation};
use std::ops::Range;

/// A floor of checkers under an even sky: its radiance is its albedo.
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

/// Samples of the reference, which are not filtered.
const REFERENCE: u32 = 1024;

/// The picture, in which 6 of 54 rows show many fields in each pixel.
const SIZE: (u32, u32) = (96, 54);

/// Rows near the horizon and rows nearby.
const FAR: Range<u32> = 14..20;
const NEAR: Range<u32> = 30..54;

/// The same checkers as an image, of 8 × 8 texels each.
fn checks() -> SceneTexture {
    let size = 64_u32;
    let white = |k: u32| (k % size / 8 + k / size / 8).is_multiple_of(2);
    let codes = (0..size * size).map(|k| if white(k) { [255; 4] } else { [0, 0, 0, 255] });
    let pixels = ImagePixels::Rgba8(codes.collect(), Encoding::Linear);
    Texture::Image {
        file: ImageData { width: size, height: size, pixels }.into(),
        encoding: Encoding::Linear,
        wrap: Wrap::Repeat,
        filter: TextureFilter::Bilinear,
        channel: Channel::Luminance,
        repeat: glam::Vec2::splat(0.25),
        offset: glam::Vec2::ZERO,
    }
}

fn scene(image: bool, filter: TextureFiltering, samples: u32) -> SceneDescription {
    let scene = parse_scene_str("horizon.ron", HORIZON, None, &LoadOptions::default());
    let mut scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    if image {
        scene.textures.insert("checks".to_owned(), checks());
    }
    (scene.render.size, scene.render.samples) = (SIZE, samples);
    scene.render.texture_filter = filter;
    scene
}

fn rendered(scene: &SceneDescription) -> (f64, Film) {
    let mut simulation = Simulation::from_description(scene);
    simulation.prepare_frame(0).expect("the scene is valid");
    let control = RenderControl::default();
    let (seconds, frame) = process_seconds(|| simulation.render_frame(0, &control));
    (seconds, frame.expect("as before").film)
}

/// The relative and the plain mean square error of the pixels of these rows.
fn errors(film: &Film, reference: &Film, rows: Range<u32>) -> [f64; 2] {
    let mut sums = [0.0; 2];
    let count = f64::from(SIZE.0 * rows.len() as u32);
    for (x, y) in rows.flat_map(|y| (0..SIZE.0).map(move |x| (x, y))) {
        let [found, expected] = [film, reference].map(|f| f64::from(f.radiance(x, y).y));
        let square = (found - expected).powi(2);
        sums[0] += square / (expected.powi(2) + 0.01);
        sums[1] += square;
    }
    sums.map(|sum| sum / count)
}

/// For each setting of `texture_filter` the error near the horizon and nearby, and the time.
pub fn run(options: &Options, report: &mut Report) {
    section(
        "textures: checkers to the horizon, 4 samples a pixel against 1024 which are not filtered",
    );
    horizon("textures.horizon", false, options, report);
    horizon("textures.image_horizon", true, options, report);
}

fn horizon(prefix: &str, image: bool, options: &Options, report: &mut Report) {
    let repetitions = if options.quick { 5 } else { 31 };
    let (_, reference) = rendered(&scene(image, TextureFiltering::Point, REFERENCE));
    let filters = [
        ("point", TextureFiltering::Point),
        ("isotropic", TextureFiltering::Isotropic),
        ("anisotropic", TextureFiltering::Anisotropic),
    ];
    let scenes = filters.map(|(_, filter)| scene(image, filter, 4));
    let mut seconds = [const { Vec::new() }; 3];
    for _ in 0..repetitions {
        for (times, scene) in seconds.iter_mut().zip(&scenes) {
            times.push(rendered(scene).0);
        }
    }
    let seconds = seconds.map(median);
    for (k, (name, _)) in filters.into_iter().enumerate() {
        let (_, film) = rendered(&scenes[k]);
        let [relative, square] = errors(&film, &reference, FAR);
        let [_, square_near] = errors(&film, &reference, NEAR);
        report.row(
            &format!("{prefix}.{name}"),
            &[
                ("relmse", relative, ""),
                ("rms", square.sqrt(), ""),
                ("rms_near", square_near.sqrt(), ""),
                ("time_ratio", seconds[k] / seconds[0], ""),
            ],
        );
    }
}
