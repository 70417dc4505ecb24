//! Piecewise-constant distributions over tables.

use glam::Vec2;

/// A distribution over `n` cells, proportional to given weights.
///
/// Sampling is by inversion of the cumulative sum, which keeps strata of `u` together. Sums are
/// made in `f64`: an `f32` sum over a large table loses its small cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Piecewise1D {
    /// `cumulative[k]` is the probability of the cells before `k`; `n + 1` entries from 0 to 1.
    cumulative: Vec<f64>,
    /// The sum of the weights.
    total: f64,
}

impl Piecewise1D {
    /// The distribution proportional to `weights`, which are finite and not negative.
    ///
    /// When all weights are 0 the cells are equally likely, so that a black table can be sampled.
    ///
    /// # Panics
    /// If there are no weights.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut cumulative = vec![0.0];
        let mut total = 0.0;
        for weight in weights {
            debug_assert!(weight >= 0.0 && weight.is_finite(), "weight {weight}");
            total += weight;
            cumulative.push(total);
        }
        let cells = cumulative.len() - 1;
        assert!(cells > 0, "a distribution needs at least one cell");
        if total > 0.0 {
            for c in &mut cumulative {
                *c /= total;
            }
        } else {
            for (k, c) in cumulative.iter_mut().enumerate() {
                *c = k as f64 / cells as f64;
            }
        }
        Self { cumulative, total }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cumulative.len() - 1
    }

    /// Whether there are no cells; never true.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The probability of cell `k`.
    pub fn probability(&self, k: usize) -> f64 {
        self.cumulative[k + 1] - self.cumulative[k]
    }

    /// The cell which `u` in `[0, 1)` falls into, and where in the cell, in `[0, 1)`.
    ///
    /// A cell of probability 0 is never returned.
    pub fn sample(&self, u: f64) -> (usize, f32) {
        // The last k with cumulative[k] <= u; cells of width 0 are skipped by taking the last.
        let mut k = self.cumulative.partition_point(|&c| c <= u) - 1;
        if k >= self.len() {
            // Rounding of the last sums: fall back to the last cell which has any width.
            k = (0..self.len()).rev().find(|&k| self.probability(k) > 0.0).unwrap_or(0);
        }
        let width = self.probability(k);
        let within = if width > 0.0 { (u - self.cumulative[k]) / width } else { 0.0 };
        (k, (within as f32).clamp(0.0, 1.0_f32.next_down()))
    }
}

/// A distribution over the unit square, constant on each cell of a grid of weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Piecewise2D {
    rows: Piecewise1D,
    columns: Vec<Piecewise1D>,
}

impl Piecewise2D {
    /// The distribution proportional to `weights(column, row)`, which are finite and not negative.
    pub fn new(width: usize, height: usize, weights: impl Fn(usize, usize) -> f64) -> Self {
        let columns: Vec<Piecewise1D> = (0..height)
            .map(|row| Piecewise1D::new((0..width).map(|column| weights(column, row))))
            .collect();
        Self { rows: Piecewise1D::new(columns.iter().map(Piecewise1D::total)), columns }
    }

    /// The mean of the weights.
    pub fn mean(&self) -> f64 {
        self.rows.total() / (self.rows.len() * self.columns[0].len()) as f64
    }

    /// A point of the unit square and its density per unit area of the square.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, v) = self.rows.sample(f64::from(u.y));
        let (column, w) = self.columns[row].sample(f64::from(u.x));
        let (width, height) = (self.columns[0].len() as f32, self.rows.len() as f32);
        let p = Vec2::new((column as f32 + w) / width, (row as f32 + v) / height);
        (p.min(Vec2::splat(1.0_f32.next_down())), self.cell_pdf(column, row))
    }

    /// The density at `p` per unit area of the square.
    pub fn pdf(&self, p: Vec2) -> f32 {
        let (width, height) = (self.columns[0].len(), self.rows.len());
        let column = ((p.x * width as f32) as usize).min(width - 1);
        let row = ((p.y * height as f32) as usize).min(height - 1);
        self.cell_pdf(column, row)
    }

    fn cell_pdf(&self, column: usize, row: usize) -> f32 {
        let cells = (self.columns[0].len() * self.rows.len()) as f64;
        (self.rows.probability(row) * self.columns[row].probability(column) * cells) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: the weights themselves; a zero cell is never drawn, u = 0 included.
    #[test]
    fn cells_are_drawn_in_proportion() {
        let d = Piecewise1D::new([0.0, 3.0, 0.0, 1.0, 0.0]);
        let mut counts = [0; 5];
        for k in 0..4000 {
            let (cell, within) = d.sample(f64::from(k) / 4000.0);
            assert!((0.0..1.0).contains(&within));
            counts[cell] += 1;
        }
        assert_eq!(counts, [0, 3000, 0, 1000, 0]);
        assert_eq!(d.sample(1.0_f64.next_down()).0, 3);
        assert_eq!(d.probability(1), 0.75);
    }

    /// A black table is sampled evenly instead of dividing by zero.
    #[test]
    fn all_zero_weights_are_uniform() {
        let d = Piecewise1D::new([0.0; 4]);
        assert_eq!(d.sample(0.6).0, 2);
        let d = Piecewise2D::new(2, 2, |_, _| 0.0);
        assert_eq!(d.sample(Vec2::new(0.9, 0.1)).1, 1.0);
    }

    /// One bright texel in a large dim map is found and has the density its weight demands.
    #[test]
    fn a_single_bright_texel_is_found() {
        let (width, height) = (1024, 512);
        let d =
            Piecewise2D::new(width, height, |x, y| if (x, y) == (700, 99) { 1e6 } else { 1e-3 });
        let share = 1e6 / (1e6 + 1e-3 * (width * height - 1) as f64);
        let hits = (0..1000)
            .filter(|k| {
                let u = Vec2::new(((k % 40) as f32 + 0.5) / 40.0, ((k / 40) as f32 + 0.5) / 25.0);
                let (p, pdf) = d.sample(u);
                assert!((d.pdf(p) / pdf - 1.0).abs() < 1e-5);
                (p.x * width as f32) as usize == 700
            })
            .count();
        assert!((hits as f64 / 1000.0 - share).abs() < 2e-3, "{hits} of 1000");
        let pdf = d.pdf(Vec2::new(700.5 / width as f32, 99.5 / height as f32));
        assert!((f64::from(pdf) / (share * (width * height) as f64) - 1.0).abs() < 1e-5);
    }
}
