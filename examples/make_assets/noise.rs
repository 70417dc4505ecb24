//! Value noise from integer hashes: the same on every machine, since only exact operations and
//! square roots are used.

/// The output function of PCG-RXS-M-XS over one step of a 32-bit linear congruential generator
/// (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3), section 4.2.2).
fn pcg(v: u32) -> u32 {
    let v = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let w = ((v >> ((v >> 28) + 4)) ^ v).wrapping_mul(277_803_737);
    (w >> 22) ^ w
}

/// A number in `[0, 1)` for every point of the integer lattice and every seed.
pub fn hash(i: i64, j: i64, seed: u32) -> f64 {
    // Two's complement carries negative coordinates over into the upper half of 32 bits.
    let inner = pcg((j as u32).wrapping_add(pcg(seed)));
    f64::from(pcg((i as u32).wrapping_add(inner))) / 4_294_967_296.0
}

/// Value noise: hashes at the lattice points, joined by a quintic fade with two continuous
/// derivatives (Perlin 2002, "Improving Noise", section 3). In `[0, 1)`.
fn value_noise(x: f64, y: f64, seed: u32) -> f64 {
    let fade = |q: f64| q * q * q * (q * (q * 6.0 - 15.0) + 10.0);
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let (a, b) = (fade(x - x.floor()), fade(y - y.floor()));
    let row = |j| mix(hash(i, j, seed), hash(i + 1, j, seed), a);
    mix(row(j), row(j + 1), b)
}

/// A sum of octaves, each of twice the frequency and half the weight; weights add up to 1.
pub fn fbm(x: f64, y: f64, octaves: u32, seed: u32) -> f64 {
    let sum: f64 = (0..octaves)
        .map(|k| {
            let scale = f64::from(1_u32 << k);
            0.5 / scale * value_noise(scale * x, scale * y, seed + k)
        })
        .sum();
    sum / (1.0 - 1.0 / f64::from(1_u32 << octaves))
}

/// From `a` at 0 to `b` at 1.
pub fn mix(a: f64, b: f64, amount: f64) -> f64 {
    a + (b - a) * amount
}

/// 0 below `a`, 1 above `b`, a cubic between.
pub fn smooth(a: f64, b: f64, x: f64) -> f64 {
    let q = ((x - a) / (b - a)).clamp(0.0, 1.0);
    q * q * (3.0 - 2.0 * q)
}
