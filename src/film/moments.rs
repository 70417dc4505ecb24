//! Mean and spread of a stream of colours, without losing digits.
//!
//! A plain f32 sum stops growing (2²⁴ + 1 = 2²⁴), and `E[x²] − E[x]²` cancels. Welford's update
//! keeps the mean and the sum of squared deviations `M₂` instead; two such records are joined by
//! the formula of Chan, Golub and LeVeque. Everything is f64.
//!
//! Welford 1962, "Note on a Method for Calculating Corrected Sums of Squares and Products",
//! Technometrics 4(3). Chan, Golub and LeVeque 1983, "Algorithms for Computing the Sample
//! Variance", The American Statistician 37(3), eq. 2.1.

use glam::DVec3;

/// Adds the value `x` to a mean of `n − 1` values and returns what it adds to `M₂`.
pub(super) fn push(mean: &mut DVec3, n: u32, x: DVec3) -> DVec3 {
    let before = x - *mean;
    *mean += before / f64::from(n);
    before * (x - *mean)
}

/// Joins the mean of `n_b` values to a mean of `n_a` values and returns what that adds to `M₂`
/// beside the `M₂` of the second.
pub(super) fn join(mean_a: &mut DVec3, n_a: u32, mean_b: DVec3, n_b: u32) -> DVec3 {
    if n_b == 0 {
        return DVec3::ZERO;
    }
    if n_a == 0 {
        *mean_a = mean_b; // to the bit: a tile merged into an empty film is the tile
        return DVec3::ZERO;
    }
    let (a, b) = (f64::from(n_a), f64::from(n_b));
    let delta = mean_b - *mean_a;
    *mean_a += delta * (b / (a + b));
    delta * delta * (a * b / (a + b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(values: &[f64]) -> (u32, DVec3, DVec3) {
        let (mut n, mut mean, mut m2) = (0, DVec3::ZERO, DVec3::ZERO);
        for &x in values {
            n += 1;
            m2 += push(&mut mean, n, DVec3::splat(x));
        }
        (n, mean, m2)
    }

    /// Oracle: integers, whose sums are exact. The offset 10⁹ would leave nothing of a variance
    /// computed as E[x²] − E[x]².
    #[test]
    fn a_large_offset_does_not_disturb_the_variance() {
        let values: Vec<f64> = (0..1000).map(|i| 1e9 + f64::from(i % 10)).collect();
        let (n, mean, m2) = record(&values);
        assert_eq!(n, 1000);
        assert!((mean.x - (1e9 + 4.5)).abs() < 1e-6);
        assert!((m2.y / 1000.0 - 8.25).abs() < 1e-6, "{}", m2.y / 1000.0);
    }

    #[test]
    fn joining_two_records_equals_one_record_of_all() {
        let values: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.37).sin()).collect();
        let (n, mean, m2) = record(&values);
        for cut in [0, 1, 137, 999, 1000] {
            let (n_a, mut mean_a, m2_a) = record(&values[..cut]);
            let (n_b, mean_b, m2_b) = record(&values[cut..]);
            let joined = m2_a + m2_b + join(&mut mean_a, n_a, mean_b, n_b);
            assert_eq!(n_a + n_b, n);
            assert!((mean_a - mean).length() < 1e-14);
            assert!((joined - m2).length() < 1e-11);
        }
    }
}
