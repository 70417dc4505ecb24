//! Weights which combine two ways of making the same path.

/// The power heuristic with exponent 2 for one sample of each of two techniques: the weight of a
/// sample whose density is `pdf` where the other technique has `other`, in the same measure.
///
/// `p²/(p² + q²)`, written as `1/(1 + (q/p)²)` so that a large density does not overflow when it is
/// squared. Returns 0 for `pdf = 0`. Veach 1997, *Robust Monte Carlo Methods for Light Transport
/// Simulation*, section 9.2.4.
pub fn power_heuristic(pdf: f32, other: f32) -> f32 {
    if pdf <= 0.0 {
        return 0.0;
    }
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_weights_of_a_sample_sum_to_one() {
        for (p, q) in [(1.0, 1.0), (1e30, 1e28), (1e-30, 1e-20), (3.0, 0.0), (0.0, 2.0)] {
            let sum = power_heuristic(p, q) + power_heuristic(q, p);
            assert!((sum - 1.0).abs() < 1e-6, "p = {p:e}, q = {q:e}: {sum}");
        }
        assert_eq!(power_heuristic(1e38, 1.0), 1.0);
    }
}
