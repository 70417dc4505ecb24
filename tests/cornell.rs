//! The Cornell box against another renderer.

mod common;

use kinora::description::{LoadOptions, load_scene};
use std::path::Path;

/// Mean radiance of the 6 × 6 blocks of the picture, row by row from the top, green: by
/// Mitsuba 3.9.1 (its `path` integrator, `scalar_rgb`, box filter, no depth limit, 96 × 96 pixels with
/// 4096 samples each) on the same meshes, reflectances, lamp and camera. Its own standard error is
/// 0.0008 of a block's mean on average and at most 0.0032, from four runs with different seeds.
#[rustfmt::skip]
const REFERENCE: [[f64; 6]; 6] = [
    [0.01414, 0.04003, 1.31406, 1.31547, 0.04712, 0.03021],
    [0.01122, 0.05227, 0.11255, 0.11207, 0.07264, 0.07365],
    [0.01177, 0.06278, 0.12874, 0.17093, 0.11432, 0.08380],
    [0.00816, 0.03111, 0.04648, 0.14090, 0.10713, 0.06642],
    [0.00518, 0.01443, 0.04006, 0.00851, 0.04302, 0.05038],
    [0.03078, 0.06635, 0.08127, 0.01275, 0.02549, 0.04256],
];

/// Each block agrees within four standard errors of both pictures together, at 64 samples per pixel; the
/// whole picture within two parts in a thousand. Pixels at the edge of the lamp dominate the error of
/// the block that shows it.
#[test]
fn the_box_agrees_with_another_renderer() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.ron");
    let options = LoadOptions::default();
    let mut scene = load_scene(&file, &options).unwrap_or_else(|e| panic!("{}", e.render(false)));
    (scene.render.size, scene.render.samples) = ((96, 96), 64);
    let picture = common::render_description(&scene, 0);
    let mut whole = (0.0, 0.0);
    for (row, blocks) in (0..).zip(&REFERENCE) {
        for (column, expected) in (0..).zip(blocks) {
            let inside = |x: u32, y: u32| x / 16 == column && y / 16 == row;
            let green = picture.mean_where(inside);
            let theirs = 0.0032 * expected;
            let error = green.error.hypot(theirs);
            let difference = green.mean - expected;
            assert!(
                difference.abs() <= 4.0 * error,
                "block ({column}, {row}): {:.5} instead of {:.5}, {:.1} standard errors",
                green.mean,
                expected,
                difference / error
            );
            whole = (whole.0 + green.mean, whole.1 + expected);
        }
    }
    let ratio: f64 = whole.0 / whole.1;
    assert!((ratio - 1.0).abs() < 2e-3, "the whole picture: {ratio}");
}
