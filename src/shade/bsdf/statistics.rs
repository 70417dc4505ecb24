//! Statistics for testing samplers: random numbers, quadrature over the sphere, Pearson's test.

use glam::{Vec2, Vec3};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// A small generator with a full period of 2⁶⁴ (Steele, Lea, Flood 2014, "Fast Splittable
/// Pseudorandom Number Generators", OOPSLA, figure 17).
pub(crate) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in `[0, 1)`, 24 bits.
    pub fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1_u32 << 24) as f32
    }

    pub fn square(&mut self) -> Vec2 {
        Vec2::new(self.uniform(), self.uniform())
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> Vec3 {
        direction(2.0 * f64::from(self.uniform()) - 1.0, TAU * f64::from(self.uniform()))
    }
}

/// The unit vector with this z at this azimuth.
pub(crate) fn direction(z: f64, phi: f64) -> Vec3 {
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    glam::DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3()
}

/// The first `n` points of Halton's sequence in `[0, 1)³` (bases 2, 3, 5).
pub(crate) fn even_points(n: u32) -> impl Iterator<Item = (f32, Vec2)> {
    let radical_inverse = |mut i: u32, base: u32| {
        let (mut digit, mut x) = (1.0, 0.0);
        while i > 0 {
            digit /= f64::from(base);
            x += digit * f64::from(i % base);
            i /= base;
        }
        (x as f32).min(1.0_f32.next_down())
    };
    (1..=n).map(move |i| {
        (radical_inverse(i, 2), Vec2::new(radical_inverse(i, 3), radical_inverse(i, 5)))
    })
}

const ROWS: usize = 16;
const COLUMNS: usize = 32;

/// Integrals of a density over the cells of a grid of the sphere, equal in z and azimuth.
pub(crate) fn integrate_cells(pdf: impl Fn(Vec3) -> f32) -> Vec<f64> {
    let f = |z: f64, phi: f64| f64::from(pdf(direction(z, phi)));
    let mut cells = Vec::with_capacity(ROWS * COLUMNS);
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let z = [row, row + 1].map(|row| 2.0 * row as f64 / ROWS as f64 - 1.0);
            let phi = [column, column + 1].map(|column| TAU * column as f64 / COLUMNS as f64);
            cells.push(integrate(&f, z, phi, 0));
        }
    }
    cells
}

/// Adaptive quadrature: 3 × 3 Gauss points against those of the four quarters.
fn integrate(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2], depth: u32) -> f64 {
    let gauss = |x: [f64; 2], y: [f64; 2]| {
        const NODES: [(f64, f64); 3] = [
            (0.112_701_665_379_258_3, 5.0 / 18.0),
            (0.5, 8.0 / 18.0),
            (0.887_298_334_620_741_7, 5.0 / 18.0),
        ];
        let mut sum = 0.0;
        for (s, weight_s) in NODES {
            for (t, weight_t) in NODES {
                sum += weight_s * weight_t * f(x[0] + (x[1] - x[0]) * s, y[0] + (y[1] - y[0]) * t);
            }
        }
        sum * (x[1] - x[0]) * (y[1] - y[0])
    };
    let middle = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])];
    let quarters = [
        ([x[0], middle[0]], [y[0], middle[1]]),
        ([middle[0], x[1]], [y[0], middle[1]]),
        ([x[0], middle[0]], [middle[1], y[1]]),
        ([middle[0], x[1]], [middle[1], y[1]]),
    ];
    let fine: f64 = quarters.iter().map(|&(x, y)| gauss(x, y)).sum();
    let error = (fine - gauss(x, y)).abs();
    // The first division is never skipped: a narrow lobe may hide between nine points. The rest
    // stops where 10⁵ samples cannot tell.
    if depth >= 12 || (depth >= 1 && error < 2e-7) {
        return fine;
    }
    quarters.iter().map(|&(x, y)| integrate(f, x, y, depth + 1)).sum()
}

/// Probability, if `draw` follows `cells`, of a Pearson statistic as large as that of `n` draws.
///
/// `draw` returns `None` for what the density does not cover; its share is one more cell. Cells
/// which expect less than 5 draws are pooled.
pub(crate) fn p_value(cells: &[f64], n: u32, mut draw: impl FnMut() -> Option<Vec3>) -> f64 {
    let mut counts = vec![0_u32; cells.len() + 1];
    for _ in 0..n {
        let cell = draw().map_or(cells.len(), |wi| {
            let row = ((f64::from(wi.z) + 1.0) * 0.5 * ROWS as f64) as usize;
            let phi = f64::from(wi.y).atan2(f64::from(wi.x)).rem_euclid(TAU);
            let column = (phi / TAU * COLUMNS as f64) as usize;
            row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
        });
        counts[cell] += 1;
    }
    let uncovered = (1.0 - cells.iter().sum::<f64>()).max(0.0);
    let n = f64::from(n);
    let (mut chi2, mut cells_used) = (0.0, 0);
    let (mut pooled, mut pooled_count) = (0.0, 0.0);
    for (&p, &count) in cells.iter().chain([&uncovered]).zip(&counts) {
        pooled += p * n;
        pooled_count += f64::from(count);
        if pooled >= 5.0 {
            chi2 += (pooled_count - pooled).powi(2) / pooled;
            cells_used += 1;
            (pooled, pooled_count) = (0.0, 0.0);
        }
    }
    // What is left over at the end expects less than 5: it is judged only if it is far too much.
    if pooled_count > 30.0 {
        return 0.0;
    }
    if cells_used < 2 {
        return 1.0;
    }
    let freedom = f64::from(cells_used - 1);
    // Far out in the tail, beyond 30 standard deviations, the incomplete gamma function takes
    // seconds to say zero.
    if chi2 > freedom + 30.0 * (2.0 * freedom).sqrt() {
        return 0.0;
    }
    ChiSquared::new(freedom).expect("more than one cell").sf(chi2)
}

/// The level of each of `count` tests which together reject the truth with probability 0.01 (Šidák).
pub(crate) fn sidak_level(count: usize) -> f64 {
    -((1.0_f64 - 0.01).ln() / count as f64).exp_m1()
}
