//! Sums of two `f64`, for the few decisions which rounding to one of them leaves open.
//!
//! A number is `high + low`, where `high` is the sum rounded: about 107 bits. Sums and products of two `f64`
//! are exact. Joldes, Muller and Popescu 2017, "Tight and Rigorous Error Bounds for Basic Building Blocks of
//! Double-Word Arithmetic", ACM Trans. Math. Softw. 44(2): algorithms 6 and 12, whose relative errors are below
//! 4·2⁻¹⁰⁶ and 5·2⁻¹⁰⁶ unless numbers underflow.

use glam::DVec3;
use std::ops::{Add, Mul, Sub};

/// `high + low`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twofold {
    high: f64,
    low: f64,
}

impl Twofold {
    /// `a + b` exactly (Knuth's two-sum).
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let of_b = high - a;
        Self { high, low: (a - (high - of_b)) + (b - of_b) }
    }

    /// `a + b` exactly where `|a| ≥ |b|` (Dekker's).
    fn ordered_sum(a: f64, b: f64) -> Self {
        let high = a + b;
        Self { high, low: b - (high - a) }
    }

    /// `a − b` exactly.
    pub fn difference(a: f64, b: f64) -> Self {
        Self::sum(a, -b)
    }

    /// The nearest `f64`.
    pub fn value(self) -> f64 {
        self.high
    }
}

impl From<f64> for Twofold {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl Add for Twofold {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (s, t) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let v = Self::ordered_sum(s.high, s.low + t.high);
        Self::ordered_sum(v.high, t.low + v.low)
    }
}

impl Sub for Twofold {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for Twofold {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let rest = self.high.mul_add(other.high, -high);
        let crossed =
            self.low.mul_add(other.high, self.high.mul_add(other.low, self.low * other.low));
        Self::ordered_sum(high, rest + crossed)
    }
}

/// A vector of such numbers.
#[derive(Clone, Copy, Debug)]
pub struct TwofoldVec3([Twofold; 3]);

impl TwofoldVec3 {
    /// `a − b` exactly.
    pub fn difference(a: DVec3, b: DVec3) -> Self {
        Self([0, 1, 2].map(|axis| Twofold::difference(a[axis], b[axis])))
    }

    /// The nearest vector of `f64`.
    pub fn value(self) -> DVec3 {
        DVec3::from_array(self.0.map(Twofold::value))
    }

    /// The scalar product.
    pub fn dot(self, other: Self) -> Twofold {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        a * x + b * y + c * z
    }

    /// The cross product.
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }
}

impl From<DVec3> for TwofoldVec3 {
    fn from(v: DVec3) -> Self {
        Self(v.to_array().map(Twofold::from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: whole numbers of 100 bits in `i128`, which cancel down to a few units.
    #[test]
    fn products_and_sums_keep_what_cancels() {
        let whole = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 14) as i64;
        for k in 0..10_000 {
            let [a, b, c] = [3 * k, 3 * k + 1, 3 * k + 2].map(whole);
            let d = (i128::from(a) * i128::from(b) / i128::from(c.max(1))) as i64 >> 1;
            // Beyond 53 bits an `f64` holds another number.
            if d.unsigned_abs() >= 1 << 53 {
                continue;
            }
            let exact = i128::from(a) * i128::from(b) - i128::from(c) * i128::from(d);
            let of = |x: i64| Twofold::from(x as f64);
            let found = of(a) * of(b) - of(c) * of(d);
            assert_eq!(found.high as i128 + found.low as i128, exact, "{a}·{b} − {c}·{d}");
        }
    }

    #[test]
    fn a_difference_keeps_what_is_too_small_for_one_number() {
        let difference = Twofold::difference(1e20, 1e-20);
        assert_eq!((difference.high, difference.low), (1e20, -1e-20));
        assert_eq!((difference - Twofold::from(1e20)).value(), -1e-20);
    }
}
