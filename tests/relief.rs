//! The scene `relief`: a wall flat, as a bump map, as a normal map and displaced, from left to right.

mod common;

use common::{Picture, render_description};
use glam::{DVec3, Vec3};
use kinora::description::{
    ImagePixels, Layer, LayerFilter, Light, LoadOptions, SceneDescription, Texture, load_scene,
};
use kinora::film::PlaneSamples;
use std::path::Path;

const PANELS: [&str; 4] = ["flat", "bump map", "normal map", "displaced"];

/// Of one panel: half its side, metres, and its centre.
const HALF: f64 = 0.30;
const CENTRES: [DVec3; 4] = [
    DVec3::new(-1.02, 0.42, 0.0),
    DVec3::new(-0.36, 0.42, 0.0),
    DVec3::new(0.30, 0.42, 0.0),
    DVec3::new(0.96, 0.42, 0.0),
];

/// The scene under its lamp alone.
fn relief(size: (u32, u32), samples: u32, overrides: &[(&str, &str)]) -> SceneDescription {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/relief.ron");
    let overrides = overrides.iter().map(|&(path, value)| (path.into(), value.into())).collect();
    let scene = load_scene(&path, &LoadOptions { overrides, ..LoadOptions::default() });
    let mut scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    (scene.render.size, scene.render.samples) = (size, samples);
    scene.render.max_depth = 1;
    scene.render.layers = vec![Layer::Beauty, Layer::Normal, Layer::Position];
    scene.render.layer_filter = LayerFilter::Mean;
    scene.entities.shift_remove("sky");
    scene
}

/// Numbers of a layer with three channels, for every pixel.
fn vectors(picture: &Picture, layer: Layer) -> Vec<Vec3> {
    let planes = picture.film.image(layer).expect("asked for");
    let channel = |k: usize| match &planes[k].samples {
        PlaneSamples::F32(values) => values.as_slice(),
        PlaneSamples::U32(_) => panic!("vectors are numbers"),
    };
    let [x, y, z] = [0, 1, 2].map(channel);
    x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect()
}

/// Pixels which show nothing but a panel: their mean place and that of all neighbours is within it, and in front of the
/// wall behind it.
fn pixels_of(picture: &Picture, panel: usize) -> Vec<usize> {
    let width = picture.film.size().0 as usize;
    let places = vectors(picture, Layer::Position);
    let within = |place: Vec3| {
        let from = (place.as_dvec3() - CENTRES[panel]).abs();
        from.x < HALF && from.y < HALF && place.z > -0.001
    };
    let around = |k: usize| [k, k - 1, k + 1, k - width, k + width];
    let inner = width + 1..places.len() - width - 1;
    inner.filter(|&k| around(k).into_iter().all(|k| within(places[k]))).collect()
}

fn mean(picture: &Picture, pixels: &[usize]) -> f64 {
    let green = picture.green();
    pixels.iter().map(|&k| green[k]).sum::<f64>() / pixels.len() as f64
}

/// Oracle: the bump map, whose normals come from the height itself. The same panel with the normal map, at the same place
/// under the same lamp, is as bright on average within 2 %. Held upside down it is farther from it pixel by pixel, and so is
/// a panel without relief: a map whose red were mirrored would be farther still, for its shades are opposite.
#[test]
fn the_normal_map_is_lit_as_the_bump_map_is() {
    // The lamp is to the left, above, above to the right, and to the right.
    for frame in [0, 12, 18, 24] {
        let lit = |material: &str, green: &str| {
            let overrides = [
                ("entities.bump map.material", material),
                ("materials.mapped clay.NormalMap.green", green),
            ];
            render_description(&relief((320, 180), 16, &overrides), frame)
        };
        let bump = lit("\"bumpy clay\"", "Up");
        let pixels = pixels_of(&bump, 1);
        assert!(pixels.len() > 2500, "{}", pixels.len());
        let distance = |picture: &Picture| {
            let (a, b) = (bump.green(), picture.green());
            pixels.iter().map(|&k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
        };
        let mapped = lit("\"mapped clay\"", "Up");
        let ratio = mean(&mapped, &pixels) / mean(&bump, &pixels);
        assert!((ratio - 1.0).abs() < 0.02, "frame {frame}: {ratio}");
        let right = distance(&mapped);
        for (material, green) in [("\"mapped clay\"", "Down"), ("\"clay\"", "Up")] {
            let wrong = distance(&lit(material, green));
            assert!(right < wrong, "frame {frame}, {material}, {green}: {right} {wrong}");
        }
    }
}

/// A pixel whose mean normal faces all of the lamp from everywhere on the panel holds a sample which does, for a mean of
/// normals that turn away turns away: it is black only where something is in the way. On the first three panels nothing
/// is, whatever their normals say; the bricks of the fourth are in each other's light.
#[test]
fn only_the_displaced_panel_shadows_itself() {
    let picture = render_description(&relief((640, 360), 16, &[]), 0);
    // Where the lamp begins, its radius, and the height of the bricks.
    let (lamp, slack) = (DVec3::new(-2.2, 0.5, 0.55), 0.06 + 0.02);
    let (normals, green) = (vectors(&picture, Layer::Normal), picture.green());
    let shadowed = |panel: usize| {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
            .map(|(x, y)| CENTRES[panel] + DVec3::new(x, y, 0.0) * HALF);
        let faces = |normal: Vec3| corners.iter().all(|p| normal.as_dvec3().dot(lamp - p) > slack);
        let pixels = pixels_of(&picture, panel);
        assert!(pixels.len() > 8000, "{}: {}", PANELS[panel], pixels.len());
        let facing = pixels.iter().filter(|&&k| faces(normals[k]));
        let (mut dark, mut all) = (0, 0);
        for &k in facing {
            all += 1;
            dark += usize::from(green[k] == 0.0);
        }
        assert!(all > 2000, "{}: {all} face the lamp", PANELS[panel]);
        dark
    };
    assert_eq!([0, 1, 2].map(shadowed), [0; 3]);
    assert!(shadowed(3) > 50, "{}", shadowed(3));
}

/// Closed form: where the camera sees the edge of a flat panel. One sample in a pixel finds the pixel that holds the edge or
/// its neighbour: the middle of the last one on the panel is within 1.5 pixels. What rises 16 mm from an edge 1.26 m to the
/// side is seen from 3.1 m as if it were 6.5 mm farther out, 4.6 pixels of 1.43 mm, of which the sample may lose 1.5; the joints
/// between the bricks are not.
#[test]
fn only_the_displaced_panel_has_a_broken_outline() {
    let filter = ("render.filter", "Box(radius: 0.5)");
    let picture = render_description(&relief((1920, 1080), 1, &[filter]), 0);
    let places = vectors(&picture, Layer::Position);
    let eye = DVec3::new(0.0, 0.55, 3.1);
    let ahead = (DVec3::new(-0.03, 0.42, 0.0) - eye).normalize();
    let right = ahead.cross(DVec3::Y).normalize();
    let pixel = |p: DVec3| {
        let along =
            |axis: DVec3| axis.dot(p - eye) / ahead.dot(p - eye) / 14_f64.to_radians().tan();
        (960.0 + 540.0 * along(right), 540.0 - 540.0 * along(right.cross(ahead)))
    };
    // How far the outline is outside of where a flat panel ends, by row, pixels.
    let strays = |panel: usize| -> Vec<f64> {
        let centre = CENTRES[panel];
        // The edge away from the middle of the picture.
        let side = centre.x.signum();
        let [low, high] = [-0.28, 0.28].map(|y| pixel(centre + DVec3::new(side * HALF, y, 0.0)));
        let shown = |place: Vec3| {
            let from = place.as_dvec3() - centre;
            from.x.abs() < HALF + 0.001 && from.y.abs() < HALF && place.z > -0.001
        };
        let rows = (high.1.ceil() as usize..low.1 as usize).filter_map(|row| {
            let seen = &places[row * 1920..(row + 1) * 1920];
            let mut columns = (0..1920).filter(|&k| shown(seen[k]));
            let last = if side < 0.0 { columns.next() } else { columns.next_back() }?;
            let share = (row as f64 + 0.5 - low.1) / (high.1 - low.1);
            Some(side * (last as f64 + 0.5 - low.0 - share * (high.0 - low.0)))
        });
        rows.collect()
    };
    // The edges lean by less than a pixel in 50 rows: half a row is a hundredth of a pixel.
    for (panel, name) in PANELS.iter().enumerate().take(3) {
        let strays = strays(panel);
        assert!(strays.len() > 350, "{name}: {}", strays.len());
        for stray in strays {
            assert!(stray.abs() <= 1.51, "{name}: {stray} pixels");
        }
    }
    let strays = strays(3);
    let most = strays.iter().copied().fold(f64::MIN, f64::max);
    let within = strays.iter().filter(|stray| **stray <= 1.51).count();
    assert!(most > 4.6 - 1.5, "{most} pixels");
    assert!(within > 10, "there are joints: {within}");
}

/// The mean of `f(cos θ)` over a panel, with the angle θ between the normal of the height field and that of the panel; by
/// differences of texels in f64.
fn mean_over_height(scene: &SceneDescription, f: impl Fn(f64) -> f64) -> f64 {
    let Some(Texture::Image { file, .. }) = scene.textures.get("height") else {
        panic!("the height is an image")
    };
    let (width, height) = (file.width as usize, file.height as usize);
    let at = |x: usize, y: usize| match &file.pixels {
        ImagePixels::Rgba8(codes, _) => f64::from(codes[y * width + x][0]) / 255.0,
        ImagePixels::Rgba32F(values) => f64::from(values[y * width + x][0]),
    };
    // Metres by which a difference over two texels rises, per metre.
    let slope = |rise: f64, texels: usize| 0.020 * rise / (2.0 * (2.0 * HALF) / texels as f64);
    let mut sum = 0.0;
    for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
        let across = slope(at(x + 1, y) - at(x - 1, y), width);
        let up = slope(at(x, y + 1) - at(x, y - 1), height);
        sum += f((1.0 + across * across + up * up).sqrt().recip());
    }
    sum / ((width - 2) * (height - 2)) as f64
}

/// Closed form, for light and sight along the normal: by Lambert's law a panel is as bright as the mean of `cos θ` over it,
/// which for these steep bricks is far from 1. Maps are bent to half a right angle there, which limits their `cos θ`.
/// Within 5 %, for sight is along the normal in the middle of the picture only; so are those with a relief to each other.
#[test]
fn at_normal_light_panels_are_as_bright_as_their_normals_say() {
    let mut scene = relief((320, 180), 16, &[]);
    let lamp = scene.entities.get_mut("lamp").expect("in the scene");
    (lamp.keyframes, lamp.shape, lamp.emission) = (None, None, None);
    lamp.light = Some(Light::Directional { irradiance: Vec3::ONE, angle: 0.0 });
    let picture = render_description(&scene, 0);
    let means = [0, 1, 2, 3].map(|panel| mean(&picture, &pixels_of(&picture, panel)));
    // Lambert: albedo/π.
    assert!((means[0] - 0.40 / std::f64::consts::PI).abs() < 1e-5, "{means:?}");
    let bent = mean_over_height(&scene, |cos| cos.max(std::f64::consts::FRAC_1_SQRT_2));
    let free = mean_over_height(&scene, |cos| cos);
    for (panel, expected) in [(1, bent), (2, bent), (3, free)] {
        let found = means[panel] / means[0];
        assert!((found / expected - 1.0).abs() < 0.05, "{}: {found} {expected}", PANELS[panel]);
        assert!((means[panel] / means[1] - 1.0).abs() < 0.05, "{means:?}");
    }
}
