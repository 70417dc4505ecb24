//! The relief of a wall of bricks, as heights and as normals.

use crate::noise::{fbm, hash, smooth};

/// Side of the panel, metres.
const SIDE: f64 = 0.6;
/// Metres of a height of 1.
const DEPTH: f64 = 0.02;

/// Height in `[0, 1]` at `x`, `y` in metres: bricks of 150 × 75 mm with joints of 12 mm.
fn height(x: f64, y: f64) -> f64 {
    let (width, tall, joint, bevel, seed) = (0.15, 0.075, 0.012, 0.014, 3);
    let row = (y / tall).floor();
    let along = x / width + 0.5 * row.rem_euclid(2.0);
    let column = along.floor();
    let (fx, fy) = ((along - column) * width, y - row * tall);
    let to_joint = fx.min(width - fx).min(fy).min(tall - fy) - joint / 2.0;
    let id = hash(column as i64, row as i64, seed);
    smooth(0.0, bevel, to_joint) * (0.8 + 0.2 * id) * (1.0 - 0.22 * fbm(40.0 * x, 40.0 * y, 4, 11))
}

/// The place of the centre of a texel, row 0 at the top.
fn place(column: u32, row: u32, size: u32) -> (f64, f64) {
    let share = |k: u32| (f64::from(k) + 0.5) / f64::from(size) * SIDE;
    (share(column), SIDE - share(row))
}

/// The height of a texel as a 16-bit code.
pub fn height_code(column: u32, row: u32, size: u32) -> u16 {
    let (x, y) = place(column, row, size);
    (height(x, y) * 65535.0).round() as u16
}

/// The normal of a texel as 8-bit codes, green upwards: from differences over a texel to either side.
pub fn normal_codes(column: u32, row: u32, size: u32) -> [u8; 3] {
    let (x, y) = place(column, row, size);
    let step = SIDE / f64::from(size);
    let slope =
        |dx: f64, dy: f64| (height(x + dx, y + dy) - height(x - dx, y - dy)) * DEPTH / (2.0 * step);
    let n = [-slope(step, 0.0), -slope(0.0, step), 1.0];
    let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
    n.map(|v| ((0.5 + 0.5 * v / length) * 255.0).round() as u8)
}
