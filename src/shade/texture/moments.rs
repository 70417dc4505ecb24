//! Mean and mean square of what a texture shows, at any sharpness.
//!
//! A lobe as wide as a share `s` of all directions sees a lamp blurred: what counts for the noise that it brings is the mean
//! square of the means over parts of that size, `m₂(s)`. It falls from the mean square of all texels, where a sun of
//! a few texels weighs most, to the square of the mean.

use rayon::prelude::*;

/// Texels along each side of a part of the next level.
const SIDE: usize = 4;

/// The moments of a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    mean: f64,
    /// Share of all that a part is, and the mean square of the means over the parts; from texels to all of it.
    levels: Vec<(f64, f64)>,
}

/// Weights and weighted values of a row of parts, and the sum of squares of what they were made from.
type Row = (Vec<(f64, f64)>, f64);

impl Moments {
    /// Of a grid of values at least 0; `weight` is that of the texels of a row.
    pub fn new(
        (width, height): (usize, usize),
        value: impl Fn(usize, usize) -> f64 + Sync,
        weight: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        let texel = |x: usize, y: usize| (weight(y), weight(y) * value(x, y));
        let mut levels = Vec::new();
        let mut size = (width, height);
        let mut parts = level(size, &texel, &mut levels);
        while size != (1, 1) {
            size = (size.0.div_ceil(SIDE), size.1.div_ceil(SIDE));
            let here = std::mem::take(&mut parts);
            parts = level(size, &|x, y| here[y * size.0 + x], &mut levels);
        }
        let (weight, sum) = parts[0];
        Self { mean: sum / weight, levels }
    }

    /// The mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// `m₂(s)` over the square of the mean: 1 where all is even.
    pub fn variation(&self, share: f64) -> f64 {
        if self.mean == 0.0 {
            return 1.0;
        }
        let after = self.levels.partition_point(|(size, _)| *size <= share);
        let square = match (after.checked_sub(1), self.levels.get(after)) {
            (None, _) => self.levels[0].1,
            (Some(k), None) => self.levels[k].1,
            (Some(k), Some(&(larger, blurred))) => {
                let (smaller, sharp) = self.levels[k];
                let t = (share / smaller).ln() / (larger / smaller).ln();
                sharp + (blurred - sharp) * t
            }
        };
        square / (self.mean * self.mean)
    }
}

/// Notes the mean square over a grid and makes the next one of it.
fn level(
    (width, height): (usize, usize),
    at: &(impl Fn(usize, usize) -> (f64, f64) + Sync),
    levels: &mut Vec<(f64, f64)>,
) -> Vec<(f64, f64)> {
    let row = |top: usize| -> Row {
        let mut squares = 0.0;
        let mut parts = vec![(0.0, 0.0); width.div_ceil(SIDE)];
        for y in top * SIDE..height.min((top + 1) * SIDE) {
            for x in 0..width {
                let (weight, weighted) = at(x, y);
                let part = &mut parts[x / SIDE];
                *part = (part.0 + weight, part.1 + weighted);
                if weight > 0.0 {
                    squares += weighted * weighted / weight;
                }
            }
        }
        (parts, squares)
    };
    // Summed in the order of rows, so that the number of threads does not show.
    let rows: Vec<Row> = (0..height.div_ceil(SIDE)).into_par_iter().map(row).collect();
    let squares: f64 = rows.iter().map(|row| row.1).sum();
    let parts: Vec<(f64, f64)> = rows.into_iter().flat_map(|row| row.0).collect();
    let weight: f64 = parts.iter().map(|part| part.0).sum();
    levels.push((1.0 / (width * height) as f64, squares / weight));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms: an even texture varies nowhere; one texel of 64 × 32 with all the light has 2048 times the square of the
    /// mean, one of 16 × 8 parts 128 times, and all together 1.
    #[test]
    fn a_sun_of_one_texel_weighs_by_its_size() {
        let even = Moments::new((64, 32), |_, _| 3.0, |_| 1.0);
        for share in [0.0, 1e-3, 0.3, 1.0] {
            assert!((even.variation(share) - 1.0).abs() < 1e-12);
        }
        let sun = |x, y| if (x, y) == (17, 9) { 5.0 } else { 0.0 };
        let sun = Moments::new((64, 32), sun, |_| 1.0);
        assert!((sun.mean() - 5.0 / 2048.0).abs() < 1e-15);
        let found = [0.0, 1.0 / 2048.0, 1.0 / 128.0, 1.0 / 8.0, 1.0].map(|s| sun.variation(s));
        for (found, expected) in found.into_iter().zip([2048.0, 2048.0, 128.0, 8.0, 1.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        let between = sun.variation(1.0 / 512.0);
        assert!(between < 2048.0 && between > 128.0, "falls without a jump: {between}");
    }

    /// Odd sides, and rows of the sphere: the mean and the mean square of a sum over all texels.
    #[test]
    fn rows_count_by_their_weight() {
        let weight = |y: usize| (std::f64::consts::PI * (y as f64 + 0.5) / 5.0).sin();
        let value = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f64;
        let moments = Moments::new((7, 5), value, weight);
        let (mut all, mut first, mut second) = (0.0, 0.0, 0.0);
        for (x, y) in (0..35).map(|k| (k % 7, k / 7)) {
            all += weight(y);
            first += weight(y) * value(x, y);
            second += weight(y) * value(x, y).powi(2);
        }
        let mean = first / all;
        assert!((moments.mean() - mean).abs() < 1e-12);
        assert!((moments.variation(0.0) - second / all / (mean * mean)).abs() < 1e-12);
        assert!((moments.variation(1.0) - 1.0).abs() < 1e-12);
    }
}
