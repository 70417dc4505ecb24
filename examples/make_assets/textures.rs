//! Stone wall, wood, marble, tiles and balls as images of linear reflectance, encoded as 8-bit sRGB.

use crate::noise::{fbm, hash, mix, smooth};
use std::f64::consts::{PI, TAU};

/// Linear reflectance in Rec. 709.
type Color = [f64; 3];

/// Sub-samples per pixel and axis: both textures have details finer than a pixel.
const SUBSAMPLES: u32 = 4;

/// Masonry at `x`, `y` in metres.
fn stone(x: f64, y: f64) -> Color {
    // Joints are not ruled with a straightedge.
    let warped_x = x + 0.02 * (fbm(6.0 * x, 6.0 * y, 3, 5) - 0.5);
    let warped_y = y + 0.012 * (fbm(6.0 * x, 6.0 * y, 3, 6) - 0.5);
    let wall = Wall { width: 0.30, height: 0.10, joint: 0.012, bevel: 0.018 };
    let (height, id) = wall.at(warped_x, warped_y);
    let grain = 0.7 + 0.6 * (fbm(9.0 * x, 9.0 * y, 5, 21) - 0.2);
    let block = [0.46 + 0.22 * id, 0.42 + 0.18 * id, 0.38 + 0.15 * id].map(|c| c * grain);
    let mortar = [0.20, 0.18, 0.16];
    let cover = smooth(0.02, 0.5, height);
    std::array::from_fn(|c| mix(mortar[c], block[c], cover))
}

/// A wall of bricks; all in metres.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    pub width: f64,
    pub height: f64,
    pub joint: f64,
    pub bevel: f64,
}

impl Wall {
    /// Height in `[0, 1]`, 0 in the joints, and a number in `[0, 1)` for the brick.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let Self { width, height, joint, bevel } = *self;
        let row = (y / height).floor();
        let along = x / width + 0.5 * row.rem_euclid(2.0);
        let column = along.floor();
        let (fx, fy) = ((along - column) * width, y - row * height);
        let to_joint = fx.min(width - fx).min(fy).min(height - fy) - joint / 2.0;
        let id = hash(column as i64, row as i64, 3);
        let rough = 1.0 - 0.22 * fbm(40.0 * x, 40.0 * y, 4, 11);
        (smooth(0.0, bevel, to_joint) * (0.8 + 0.2 * id) * rough, id)
    }
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

/// Marble: veins along a sine that noise bends.
fn marble(u: f64, v: f64) -> Color {
    let bend = fbm(4.0 * u, 4.0 * v, 6, 41);
    let wave = 0.5 + 0.5 * (TAU * (2.0 * u + 1.2 * v + 2.2 * bend)).sin();
    let (vein, stone) = ([0.16, 0.18, 0.20], [0.86, 0.85, 0.82]);
    std::array::from_fn(|c| mix(vein[c], stone[c], wave.powf(0.35)))
}

/// Glazed tiles, eight by eight to the unit square, each of its own shade, with light joints.
fn tiles(u: f64, v: f64) -> Color {
    let (u, v) = (8.0 * u, 8.0 * v);
    let to_middle = (u - u.floor() - 0.5).abs().max((v - v.floor() - 0.5).abs());
    let shade = 0.85 + 0.25 * hash(u.floor() as i64, v.floor() as i64, 51);
    let tile = [0.42, 0.68, 0.74].map(|c| c * shade);
    let joint = smooth(0.455, 0.475, to_middle);
    let grout = [0.80, 0.82, 0.80];
    std::array::from_fn(|c| mix(tile[c], grout[c], joint))
}

/// A beach ball: six gores, every second one white, and white caps. `u` is the longitude, `v` the
/// latitude from pole to pole.
fn beach_ball(u: f64, v: f64) -> Color {
    let white = [0.92, 0.92, 0.90];
    if (PI * (v - 0.5)).sin().abs() > 0.93 {
        return white;
    }
    match (6.0 * u) as u32 {
        0 => [0.85, 0.08, 0.06],
        2 => [0.05, 0.20, 0.75],
        4 => [0.95, 0.70, 0.05],
        _ => white,
    }
}

/// A ball with a blue band around it, on which eight stars stand, each with a tip to the pole.
fn star_ball(u: f64, v: f64) -> Color {
    let (latitude, longitude) = (PI * (v - 0.5), TAU * u);
    if latitude.sin().abs() >= 0.30 {
        return [0.90, 0.88, 0.82];
    }
    let eighth = TAU / 8.0;
    let from_star = longitude - eighth * (longitude / eighth).round();
    // Angle from the middle of the star, and the bearing there from the pole.
    let (east, north) = (latitude.cos() * from_star.sin(), latitude.sin());
    let radius = east.hypot(north).min(1.0).asin();
    let star = is_in_star(radius, east.atan2(north), 0.21, 0.382 * 0.21);
    if star { [0.93, 0.93, 0.90] } else { [0.10, 0.16, 0.55] }
}

/// Whether a point in polar coordinates lies in a five-pointed star with a tip at angle 0.
fn is_in_star(radius: f64, angle: f64, outer: f64, inner: f64) -> bool {
    // Folded into half a point of the star: its edge runs from the tip to the notch.
    let fifth = TAU / 5.0;
    let folded = (angle - fifth * (angle / fifth).round()).abs();
    let (x, y) = (radius * folded.cos(), radius * folded.sin());
    let (notch_x, notch_y) = (inner * (PI / 5.0).cos(), inner * (PI / 5.0).sin());
    (notch_x - outer) * y - notch_y * (x - outer) >= 0.0
}

/// The back wall of the room: x from −1.35 to 1.35 m, y from 0 to 1.6 m, at 320 pixels per metre.
pub const STONE_WALL: Painting =
    Painting { size: (864, 512), color: |u, v| stone(2.7 * u - 1.35, 1.6 * v) };

/// One board; taller than wide, for the sake of the fibres.
pub const WOOD_BOARD: Painting = Painting { size: (384, 768), color: wood };

/// The deck around the pool as far as it is seen: x from −2.75 to 2.75 m, z from −2 m at the top to 2 m,
/// at 186 pixels per metre. The unit of the marble is 2 m.
pub const MARBLE_DECK: Painting =
    Painting { size: (1024, 744), color: |u, v| marble(2.75 * u - 1.375, 1.0 - 2.0 * v) };

/// The unit of the tiles.
pub const POOL_TILES: Painting = Painting { size: (512, 512), color: tiles };

/// The beach ball, unrolled.
pub const BEACH_BALL: Painting = Painting { size: (768, 384), color: beach_ball };

/// The ball with stars, unrolled.
pub const STAR_BALL: Painting = Painting { size: (1024, 512), color: star_ball };

/// Every painting with the name of its file.
pub const ALL: [(&str, Painting); 6] = [
    ("stone-wall.png", STONE_WALL),
    ("wood.png", WOOD_BOARD),
    ("marble-deck.png", MARBLE_DECK),
    ("pool-tiles.png", POOL_TILES),
    ("beach-ball.png", BEACH_BALL),
    ("star-ball.png", STAR_BALL),
];

/// A function of uv, `v` upwards, to be averaged over each pixel.
#[derive(Clone, Copy)]
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
