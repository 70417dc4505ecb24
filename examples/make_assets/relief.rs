//! The relief of a wall of bricks, as heights and as normals.

use crate::textures::Wall;

/// Side of the panel, metres.
const SIDE: f64 = 0.6;
/// Metres of a height of 1.
const DEPTH: f64 = 0.02;

/// Bricks of 150 × 75 mm with joints of 12 mm.
const WALL: Wall = Wall { width: 0.15, height: 0.075, joint: 0.012, bevel: 0.014 };

/// Height in `[0, 1]` at `x`, `y` in metres.
fn height(x: f64, y: f64) -> f64 {
    WALL.at(x, y).0
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
