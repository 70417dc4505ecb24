//! Polynomials in Bernstein form on `[0, 1]`: products, derivatives, and all their roots.
//!
//! A polynomial of degree `n` is `Σ fₖ·C(n,k)·tᵏ·(1−t)ⁿ⁻ᵏ`, given by its coefficients `fₖ`. Between 0 and 1 it
//! has at most as many roots as its coefficients change sign, and as many up to an even number (Descartes' rule
//! in this basis). Halving the interval by de Casteljau's algorithm until one change or none is left isolates
//! every root. Roots are as little sensitive to the rounding of these coefficients as those of any basis of
//! non-negative functions (Farouki and Rajan 1987, "On the numerical condition of polynomials in Bernstein
//! form", *Computer Aided Geometric Design* 4).

/// Halvings after which what is not isolated is taken for one multiple root: a double root is known to about
/// `√ε = 2⁻²⁶` and no better.
const MAX_HALVINGS: u32 = 27;

/// `C(n, k)`.
fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |value, i| value * (n - i) as f64 / (i + 1) as f64)
}

/// The product of two polynomials: `hₖ = Σ C(m,i)·C(n,k−i)/C(m+n,k)·fᵢ·gₖ₋ᵢ`.
pub(super) fn product(f: &[f64], g: &[f64]) -> Vec<f64> {
    let (m, n) = (f.len() - 1, g.len() - 1);
    let mut h = vec![0.0; m + n + 1];
    for (i, a) in f.iter().enumerate() {
        for (j, b) in g.iter().enumerate() {
            h[i + j] += binomial(m, i) * binomial(n, j) * a * b;
        }
    }
    for (k, value) in h.iter_mut().enumerate() {
        *value /= binomial(m + n, k);
    }
    h
}

/// The derivative, of one degree less.
pub(super) fn derivative(f: &[f64]) -> Vec<f64> {
    let n = (f.len() - 1) as f64;
    f.windows(2).map(|pair| n * (pair[1] - pair[0])).collect()
}

/// `f − g` of polynomials of one degree.
pub(super) fn difference(f: &[f64], g: &[f64]) -> Vec<f64> {
    f.iter().zip(g).map(|(a, b)| a - b).collect()
}

/// The roots in `(0, 1)`, ascending; a multiple root may be told once, more often, or not at all if the sign
/// does not change there. Coefficients of at most `noise` count as 0, and a polynomial which is 0 has no roots.
pub(super) fn roots(f: &[f64], noise: f64) -> Vec<f64> {
    let mut coefficients = f.to_vec();
    for value in &mut coefficients {
        if value.abs() <= noise {
            *value = 0.0;
        }
    }
    let mut found = Vec::new();
    isolate(&coefficients, (0.0, 1.0), MAX_HALVINGS, &mut found);
    found
}

/// How often the sign changes along the coefficients, zeros left out.
fn variations(f: &[f64]) -> usize {
    let signs: Vec<bool> = f.iter().filter(|x| **x != 0.0).map(|x| *x > 0.0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

fn isolate(f: &[f64], (a, b): (f64, f64), halvings: u32, found: &mut Vec<f64>) {
    let middle = f64::midpoint(a, b);
    match variations(f) {
        0 => {}
        1 => found.push(a + (b - a) * single_root(f)),
        _ if halvings == 0 => found.push(middle),
        _ => {
            let (left, right) = halves(f);
            isolate(&left, (a, middle), halvings - 1, found);
            if right[0] == 0.0 {
                found.push(middle);
            }
            isolate(&right, (middle, b), halvings - 1, found);
        }
    }
}

/// The two halves by de Casteljau's algorithm at ½.
fn halves(f: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut row = f.to_vec();
    let (mut left, mut right) = (Vec::with_capacity(f.len()), Vec::with_capacity(f.len()));
    while let (Some(&first), Some(&last)) = (row.first(), row.last()) {
        left.push(first);
        right.push(last);
        row = row.windows(2).map(|pair| f64::midpoint(pair[0], pair[1])).collect();
    }
    right.reverse();
    (left, right)
}

/// The value at `t`.
pub(super) fn value(f: &[f64], t: f64) -> f64 {
    let mut row = f.to_vec();
    for n in (1..row.len()).rev() {
        for k in 0..n {
            row[k] += t * (row[k + 1] - row[k]);
        }
    }
    row[0]
}

/// The root of a polynomial whose coefficients change sign once, by bisection to the last bit.
fn single_root(f: &[f64]) -> f64 {
    let starts_positive = f.iter().find(|x| **x != 0.0).is_some_and(|x| *x > 0.0);
    let (mut low, mut high) = (0.0, 1.0);
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            return middle;
        }
        if (value(f, middle) > 0.0) == starts_positive {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// `Π (t − r)` in Bernstein form: the linear factor is `(−r, 1 − r)`.
    fn with_roots(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |f, r| product(&f, &[-r, 1.0 - r]))
    }

    /// Oracle: the roots from which the polynomial was made.
    #[test]
    fn all_roots_are_found_and_no_others() {
        for k in 0..2000 {
            let s = Sampler::new(5, 0, (k, 0), 0);
            let count = 1 + k as usize % 6;
            // Roots outside of the interval are not to be told; roots inside are apart.
            let all: Vec<f64> =
                (0..count).map(|i| (i as f64 + f64::from(s.one(i as u32))) * 0.4 - 0.5).collect();
            let apart = all.windows(2).all(|pair| pair[1] - pair[0] > 0.01);
            let expected: Vec<f64> = all.iter().copied().filter(|r| *r > 0.0 && *r < 1.0).collect();
            let found = roots(&with_roots(&all), 0.0);
            if apart {
                assert_eq!(found.len(), expected.len(), "{all:?}: {found:?}");
                for (a, b) in found.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-9, "{all:?}: {found:?}");
                }
            }
        }
    }

    /// Oracle: the product of the values, and the difference quotient.
    #[test]
    fn products_and_derivatives_are_those_of_the_functions() {
        let (f, g) = ([0.3, -1.0, 2.5, 0.1], [1.0, 0.2, -0.7]);
        let (h, d) = (product(&f, &g), derivative(&f));
        for k in 0..=20_u8 {
            let t = f64::from(k) / 20.0;
            assert!((value(&h, t) - value(&f, t) * value(&g, t)).abs() < 1e-14);
            let quotient = (value(&f, t + 1e-6) - value(&f, t - 1e-6)) / 2e-6;
            assert!((value(&d, t) - quotient).abs() < 1e-8);
        }
    }

    #[test]
    fn what_is_zero_has_no_roots_and_a_double_root_ends() {
        assert!(roots(&[1e-17, -1e-17, 1e-17], 1e-15).is_empty());
        let double = with_roots(&[0.3, 0.3]);
        assert!(roots(&double, 0.0).iter().all(|r| (r - 0.3).abs() < 1e-7));
        assert_eq!(roots(&[0.0, -1.0, 1.0], 0.0).len(), 1);
    }
}
