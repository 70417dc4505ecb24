//! Owen-scrambled Sobol' points, as a pure function of seed, frame, pixel, sample and dimension.
//!
//! Every decision of a path has dimensions of its own, taken in sets of one or two. Each set is
//! the first two dimensions of the Sobol' sequence with its own shuffled order and its own nested
//! uniform scramble (Owen 1995), so that within a pixel each set is a (0, 2)-sequence while
//! different sets and pixels are independent: padding as in Pharr, Jakob and Humphreys 2023,
//! *Physically Based Rendering*, 4th ed., section 8.7.1.
//!
//! The scramble is a hash (Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4)): on the
//! bit-reversed integer an operation in which bits affect only higher bits is a random permutation
//! of every elementary interval. The constants are those of Vegdahl 2021, "Building a Better LK
//! Hash". The second Sobol' dimension has the generator matrix of Pascal's triangle modulo 2: bit
//! `k` of the index stands for the polynomial `(1 + x)ᵏ` over GF(2), and replacing `x` by `1 + x` in
//! the index takes five steps, since `(1 + x)^(2ʲ) = 1 + x^(2ʲ)`.

use glam::Vec2;

/// The decisions of a path and the dimensions which they use.
pub mod dimension {
    /// Position on the film (2).
    pub const FILM: u32 = 0;
    /// Position on the lens (2).
    pub const LENS: u32 = 2;
    /// Time in the shutter (1).
    pub const TIME: u32 = 4;
    /// Wavelength of a camera path (1).
    pub const WAVELENGTH: u32 = 5;
    /// First dimension of the first vertex.
    const FIRST_VERTEX: u32 = 6;
    /// Dimensions of one vertex.
    const PER_VERTEX: u32 = 8;

    /// First dimension of vertex `k`, counted from 0 at the first surface.
    pub const fn vertex(k: u32) -> u32 {
        FIRST_VERTEX + PER_VERTEX * k
    }
    /// Lobe of the BSDF (1), from the first dimension of the vertex.
    pub const LOBE: u32 = 0;
    /// Direction (2) and point on a light (2), stratified together.
    pub const DIRECTION_AND_LIGHT_POINT: u32 = 1;
    /// Which light (1).
    pub const LIGHT: u32 = 5;
    /// Point on a distant light (2) where one is drawn beside another; beyond all vertices.
    pub const DISTANT_LIGHT_POINT: u32 = 1 << 31;
    /// Wavelength of a photon (1).
    pub const PHOTON_WAVELENGTH: u32 = (1 << 31) + 2;
    /// Russian roulette, or passing through a hole (1).
    pub const ROULETTE: u32 = 6;
    /// Distance flown in a medium to the vertex (1).
    pub const DISTANCE: u32 = 7;
    /// Dimensions of one flight.
    const PER_FLIGHT: u32 = 32;
    /// First dimension of the flight that ends at vertex `k`, beyond all vertices: where on it light is looked for.
    pub const fn flight(k: u32) -> u32 {
        (1 << 30) + PER_FLIGHT * k
    }
    /// Place on the flight for which a light is chosen (1), from the first dimension of the flight.
    pub const PIVOT_PLACE: u32 = 0;
    /// Which light that is (1).
    pub const PIVOT: u32 = 1;
    /// Distance drawn towards it (1).
    pub const PIVOT_DISTANCE: u32 = 2;
    /// What is seen from there: point on a light (2), and which one (1).
    pub const PIVOT_LIGHT: u32 = 3;
    /// Distances drawn by what is scattered before the end (1).
    pub const BEFORE_DISTANCE: u32 = 6;
    /// What is seen from the first of them: point on a light (2), and which one (1); those of the others follow.
    pub const BEFORE_LIGHT: u32 = 7;
}

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler {
    pixel_key: u64,
    reversed_index: u32,
}

impl Sampler {
    /// The numbers of sample `index` of a pixel. Equal arguments give equal numbers.
    pub fn new(seed: u64, frame: u32, pixel: (u32, u32), index: u32) -> Self {
        let place = (u64::from(pixel.0) << 32) | u64::from(pixel.1);
        let pixel_key = mix(mix(seed ^ mix(u64::from(frame))) ^ place);
        Self { pixel_key, reversed_index: index.reverse_bits() }
    }

    /// A number in `[0, 1)` for the given dimension.
    #[inline]
    pub fn one(&self, dimension: u32) -> f32 {
        unit(self.bits(dimension))
    }

    /// A number in `[0, 1)` for the given dimension with all its 32 bits: for a choice among more
    /// things than an `f32` can tell apart.
    #[inline]
    pub fn one_fine(&self, dimension: u32) -> f64 {
        f64::from(self.bits(dimension)) / 4_294_967_296.0
    }

    /// Two numbers in `[0, 1)`, stratified together, for the given dimension and the next.
    #[inline]
    pub fn two(&self, dimension: u32) -> Vec2 {
        let key = self.key(dimension);
        let index = owen_reversed(self.reversed_index, key as u32).reverse_bits();
        let second_key = mix(key);
        let x = owen_reversed(index, (key >> 32) as u32).reverse_bits();
        let y = owen_reversed(pascal(index), second_key as u32).reverse_bits();
        Vec2::new(unit(x), unit(y))
    }

    /// Two points of `[0, 1)²`, stratified together, for the given dimension and the next three. The first
    /// point is as even as one of [`Sampler::two`].
    #[inline]
    pub fn four(&self, dimension: u32) -> (Vec2, Vec2) {
        let key = self.key(dimension);
        let index = owen_reversed(self.reversed_index, key as u32).reverse_bits();
        let more = mix(key);
        let x = owen_reversed(index, (key >> 32) as u32).reverse_bits();
        let y = owen_reversed(pascal(index), more as u32).reverse_bits();
        let z = owen_reversed(by_table(&THIRD, index), (more >> 32) as u32).reverse_bits();
        let w = owen_reversed(by_table(&FOURTH, index), (more >> 16) as u32).reverse_bits();
        (Vec2::new(unit(x), unit(y)), Vec2::new(unit(z), unit(w)))
    }

    #[inline]
    fn bits(&self, dimension: u32) -> u32 {
        let key = self.key(dimension);
        let index = owen_reversed(self.reversed_index, key as u32).reverse_bits();
        owen_reversed(index, (key >> 32) as u32).reverse_bits()
    }

    #[inline]
    fn key(&self, dimension: u32) -> u64 {
        mix(self.pixel_key ^ (u64::from(dimension) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }
}

/// A nested uniform scramble of an integer whose bits are reversed (bit 0 the most significant).
#[inline]
fn owen_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// The second Sobol' dimension of `index`, its bits reversed.
#[inline]
fn pascal(mut index: u32) -> u32 {
    index ^= (index & 0xffff_0000) >> 16;
    index ^= (index & 0xff00_ff00) >> 8;
    index ^= (index & 0xf0f0_f0f0) >> 4;
    index ^= (index & 0xcccc_cccc) >> 2;
    index ^= (index & 0xaaaa_aaaa) >> 1;
    index
}

/// For each byte of an index, what its bits contribute to a dimension of the Sobol' sequence, the bits of
/// the result reversed.
type ByteTable = [[u32; 256]; 4];

/// The third and the fourth dimension: primitive polynomials `x² + x + 1` and `x³ + x + 1`, first direction
/// numbers 1, 3 and 1, 3, 1 (Joe and Kuo 2008, "Constructing Sobol Sequences with Better
/// Two-Dimensional Projections", SIAM J. Sci. Comput. 30(5), their dimensions 3 and 4).
static THIRD: ByteTable = byte_table(&direction_numbers(2, 1, [1, 3, 0]));
static FOURTH: ByteTable = byte_table(&direction_numbers(3, 1, [1, 3, 1]));

/// The direction numbers of a dimension, bits reversed, by the recurrence of the source above.
///
/// `degree` of the polynomial, its inner coefficients `a` as bits, and the first odd integers `m`.
const fn direction_numbers(degree: usize, a: u32, m: [u32; 3]) -> [u32; 32] {
    let mut v = [0_u32; 32];
    let mut k = 0;
    while k < 32 {
        v[k] = if k < degree {
            m[k] << (31 - k)
        } else {
            let mut x = v[k - degree] ^ (v[k - degree] >> degree);
            let mut j = 1;
            while j < degree {
                if a >> (degree - 1 - j) & 1 == 1 {
                    x ^= v[k - j];
                }
                j += 1;
            }
            x
        };
        k += 1;
    }
    v
}

const fn byte_table(directions: &[u32; 32]) -> ByteTable {
    let mut table = [[0; 256]; 4];
    let mut byte = 0;
    while byte < 4 {
        let mut value = 0;
        while value < 256 {
            let mut bit = 0;
            while bit < 8 {
                if value >> bit & 1 == 1 {
                    table[byte][value] ^= directions[8 * byte + bit].reverse_bits();
                }
                bit += 1;
            }
            value += 1;
        }
        byte += 1;
    }
    table
}

/// A dimension of the Sobol' sequence at `index`, its bits reversed.
#[inline]
fn by_table(table: &ByteTable, index: u32) -> u32 {
    let [a, b, c, d] = index.to_le_bytes().map(usize::from);
    table[0][a] ^ table[1][b] ^ table[2][c] ^ table[3][d]
}

/// The upper 24 bits as a number in `[0, 1)`; more would round up to 1.
#[inline]
fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// A bijective mixing of 64 bits, the finaliser of `SplitMix64` (Steele, Lea and Flood 2014).
#[inline]
pub(super) fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp::tests::chi2_upper_quantile;

    /// The defining property of a scrambled (0, 2)-sequence: among the first 2ᵐ points exactly one
    /// lies in each elementary interval of area 2⁻ᵐ, for all m + 1 shapes.
    #[test]
    fn every_elementary_interval_holds_one_point() {
        for seed in 0..10 {
            for m in 0..=10_u32 {
                let points: Vec<Vec2> = (0..1_u32 << m)
                    .map(|i| Sampler::new(seed, 3, (17, 5), i).two(dimension::vertex(2)))
                    .collect();
                for a in 0..=m {
                    let (columns, rows) = (1_u32 << a, 1_u32 << (m - a));
                    let mut seen = vec![false; 1 << m];
                    for p in &points {
                        let column = (p.x * columns as f32) as u32;
                        let row = (p.y * rows as f32) as u32;
                        let cell = (row * columns + column) as usize;
                        assert!(!std::mem::replace(&mut seen[cell], true), "m = {m}, a = {a}");
                    }
                }
            }
        }
    }

    /// The projections of four dimensions: each number alone and the first two as a pair are as even as
    /// can be, and 2²⁰ points fill all but few of the 2¹⁶ cells of 1/16 a side with 16 points each.
    #[test]
    fn four_dimensions_are_stratified_together() {
        let s = |i| Sampler::new(3, 1, (9, 2), i).four(dimension::vertex(1) + 1);
        for m in 0..=8_u32 {
            let mut seen = vec![[false; 4]; 1 << m];
            for i in 0..1_u32 << m {
                let (a, b) = s(i);
                for (k, x) in [a.x, a.y, b.x, b.y].into_iter().enumerate() {
                    let cell = (x * (1 << m) as f32) as usize;
                    assert!(!std::mem::replace(&mut seen[cell][k], true), "m = {m}, number {k}");
                }
            }
        }
        let mut cells = vec![0_u32; 1 << 16];
        for i in 0..1 << 20 {
            let (a, b) = s(i);
            let cell = [a.x, a.y, b.x, b.y].iter().fold(0, |c, x| c * 16 + (x * 16.0) as usize);
            cells[cell] += 1;
        }
        // Independent points would give a variance of 16.
        let variance = cells.iter().map(|&c| (f64::from(c) - 16.0).powi(2)).sum::<f64>() / 65536.0;
        assert!(variance < 1.0, "variance {variance}");
    }

    /// Oracle: the definition, bit by bit, with direction numbers computed by hand from the recurrence.
    #[test]
    fn tables_hold_the_third_and_fourth_sobol_dimensions() {
        for (table, first) in [(&THIRD, [1, 3, 3, 9, 29]), (&FOURTH, [1, 3, 1, 5, 31])] {
            for (k, m) in (0..).zip(first) {
                let direction = (m as u32) << (31 - k);
                assert_eq!(by_table(table, 1 << k).reverse_bits(), direction, "number {k}");
            }
            let (a, b) = (0x1234_5678_u32, 0x0f0f_3c3c);
            assert_eq!(by_table(table, a ^ b), by_table(table, a) ^ by_table(table, b));
        }
    }

    /// Oracle: the direction numbers of the second dimension, `v₀ = 2³¹`, `vₖ = vₖ₋₁ ⊕ vₖ₋₁/2`.
    #[test]
    fn pascal_is_the_second_sobol_dimension() {
        let mut directions = [1_u32 << 31; 32];
        for k in 1..32 {
            directions[k] = directions[k - 1] ^ (directions[k - 1] >> 1);
        }
        for index in (0..4000_u32).chain([u32::MAX, 0x8000_0000, 0xdead_beef]) {
            let sobol =
                (0..32).filter(|k| index >> k & 1 == 1).fold(0, |x, k| x ^ directions[k as usize]);
            assert_eq!(pascal(index).reverse_bits(), sobol, "{index}");
        }
    }

    /// Pearson's χ² on 8 × 8 cells for pairs of *different* dimensions of the first 32, over pixels:
    /// dimensions are independent, no seed is special. Level 1e-6 in all for 24 tests.
    #[test]
    fn different_dimensions_are_independent() {
        for seed in [0, 1, u64::MAX] {
            for (a, b) in [(0, 1), (0, 2), (4, 6), (6, 14), (7, 15), (9, 10), (12, 31), (3, 30)] {
                let mut cells = [0_u32; 64];
                for pixel in 0..16_u32 {
                    for index in 0..400 {
                        let s = Sampler::new(seed, 0, (pixel, 7), index);
                        let cell = (s.one(a) * 8.0) as usize * 8 + (s.one(b) * 8.0) as usize;
                        cells[cell] += 1;
                    }
                }
                let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - 100.0).powi(2) / 100.0).sum();
                let limit = chi2_upper_quantile(63, 5.4);
                assert!(chi2 < limit, "dimensions {a}, {b}, seed {seed}: χ² = {chi2:.1}");
            }
        }
    }

    /// Oracles in closed form; slopes of the error over the number of samples: about −1.5 for the
    /// smooth integrand and −0.75 for the edge, −0.5 for independent numbers.
    #[test]
    fn smooth_integrands_converge_faster_than_random() {
        type Integrand = fn(Vec2) -> f64;
        let gauss: Integrand = |p| (-f64::from(p.length_squared())).exp();
        let edge: Integrand = |p| f64::from(u8::from(p.y > p.x));
        let rms = |f: Integrand, truth: f64, n: u32| {
            let sum: f64 = (0..200)
                .map(|k| {
                    let mean: f64 =
                        (0..n).map(|i| f(Sampler::new(5, 0, (k, 1), i).two(0))).sum::<f64>()
                            / f64::from(n);
                    (mean - truth).powi(2)
                })
                .sum();
            (sum / 200.0).sqrt()
        };
        for (f, truth, steepest) in [(gauss, 0.557_746_3, -1.3), (edge, 0.5, -0.65)] {
            let slope = (rms(f, truth, 1024) / rms(f, truth, 16)).log2() / 6.0;
            assert!(slope < steepest, "slope {slope}");
        }
    }
}
