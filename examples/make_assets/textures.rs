//! Stone wall and wood as images of linear reflectance, encoded as 8-bit sRGB.

use crate::noise::{fbm, hash, mix, smooth};

/// Linear reflectance in Rec. 709.
type Color = [f64; 3];

/// Sub-samples per pixel and axis: both textures have details finer than a pixel.
const SUBSAMPLES: u32 = 4;

/// Masonry at `x`, `y` in metres.
fn stone(x: f64, y: f64) -> Color {
    // Joints are not ruled with a straightedge.
    let warped_x = x + 0.02 * (fbm(6.0 * x, 6.0 * y, 3, 5) - 0.5);
    let warped_y = y + 0.012 * (fbm(6.0 * x, 6.0 * y, 3, 6) - 0.5);
    let (height, id) = brick(warped_x, warped_y);
    let grain = 0.7 + 0.6 * (fbm(9.0 * x, 9.0 * y, 5, 21) - 0.2);
    let block = [0.46 + 0.22 * id, 0.42 + 0.18 * id, 0.38 + 0.15 * id].map(|c| c * grain);
    let mortar = [0.20, 0.18, 0.16];
    let cover = smooth(0.02, 0.5, height);
    std::array::from_fn(|c| mix(mortar[c], block[c], cover))
}

/// Height in `[0, 1]` of a wall of bricks, 0 in the joints, and a number in `[0, 1)` for the brick.
fn brick(x: f64, y: f64) -> (f64, f64) {
    let (width, height, joint, bevel, seed) = (0.30, 0.10, 0.012, 0.018, 3);
    let row = (y / height).floor();
    let along = x / width + 0.5 * row.rem_euclid(2.0);
    let column = along.floor();
    let (fx, fy) = ((along - column) * width, y - row * height);
    let to_joint = fx.min(width - fx).min(fy).min(height - fy) - joint / 2.0;
    let id = hash(column as i64, row as i64, seed);
    let rough = 1.0 - 0.22 * fbm(40.0 * x, 40.0 * y, 4, 11);
    (smooth(0.0, bevel, to_joint) * (0.8 + 0.2 * id) * rough, id)
}

/// Wood over the unit square: rings around a pith outside the board, and fine fibres along u.
fn wood(u: f64, v: f64) -> Color {
    let waver = fbm(2.0 * u, 10.0 * v, 4, 31);
    let rings = 14.0 * (0.25 * (u - 0.3).powi(2) + (v + 0.6).powi(2)).sqrt() + 1.2 * waver;
    let phase = rings - rings.floor();
    // Late wood darkens slowly and ends abruptly.
    let ring = smooth(0.0, 0.75, phase) * (1.0 - smooth(0.80, 1.0, phase));
    let fibre = fbm(4.0 * u, 180.0 * v, 3, 37);
    let (early, late) = ([0.50, 0.28, 0.13], [0.27, 0.13, 0.055]);
    std::array::from_fn(|c| mix(early[c], late[c], 0.65 * ring + 0.35 * fibre))
}

/// The back wall of the room: x from −1.35 to 1.35 m, y from 0 to 1.6 m, at 320 pixels per metre.
pub const STONE_WALL: Painting =
    Painting { size: (864, 512), color: |u, v| stone(2.7 * u - 1.35, 1.6 * v) };

/// One board; taller than wide, for the sake of the fibres.
pub const WOOD_BOARD: Painting = Painting { size: (384, 768), color: wood };

/// A function of uv, `v` upwards, to be averaged over each pixel.
pub struct Painting {
    /// Width and height in pixels.
    pub size: (u32, u32),
    color: fn(f64, f64) -> Color,
}

impl Painting {
    /// The codes of one pixel; row 0 is the top.
    pub fn pixel(&self, px: u32, py: u32) -> [u8; 3] {
        let mut sum = [0.0; 3];
        for sub in 0..SUBSAMPLES * SUBSAMPLES {
            let offset = |s: u32| (f64::from(s) + 0.5) / f64::from(SUBSAMPLES);
            let u = (f64::from(px) + offset(sub % SUBSAMPLES)) / f64::from(self.size.0);
            let v = 1.0 - (f64::from(py) + offset(sub / SUBSAMPLES)) / f64::from(self.size.1);
            let sample = (self.color)(u, v);
            sum = std::array::from_fn(|c| sum[c] + sample[c]);
        }
        sum.map(|c| encode(c / f64::from(SUBSAMPLES * SUBSAMPLES)))
    }
}

/// The sRGB curve (IEC 61966-2-1) to 8 bits.
fn encode(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let code =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (code * 255.0).round() as u8
}
