//! A number over the shutter.

/// Values at times in `[0, 1]` of the shutter, joined by straight lines. Two at one time are a jump, of which the later
/// holds at that time; one alone holds always.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeCurve(Vec<(f64, f64)>);

impl TimeCurve {
    /// The same at every time.
    pub fn constant(value: f64) -> Self {
        Self(vec![(0.0, value)])
    }

    /// Through (time, value), at times which do not fall.
    ///
    /// # Panics
    /// Without any.
    pub fn through(knots: Vec<(f64, f64)>) -> Self {
        let first = knots.first().expect("a curve has a value").1;
        if knots.iter().all(|knot| knot.1 == first) { Self::constant(first) } else { Self(knots) }
    }

    /// Through values at evenly spaced times, both ends included.
    pub fn even(values: &[f64]) -> Self {
        let last = values.len().saturating_sub(1).max(1) as f64;
        Self::through(values.iter().enumerate().map(|(k, v)| (k as f64 / last, *v)).collect())
    }

    /// The values that lines join.
    pub fn values(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|knot| knot.1)
    }

    /// The curve of other values.
    #[must_use]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self::through(self.0.iter().map(|(time, value)| (*time, f(*value))).collect())
    }

    /// The first value at every time where none of the others differs from it by more than `rounding`.
    #[must_use]
    pub fn merged(self, rounding: f64) -> Self {
        let first = self.0[0].1;
        let same = self.values().all(|value| value == first || (value - first).abs() <= rounding);
        if same { Self::constant(first) } else { self }
    }

    /// Whether it is the same at every time.
    pub fn is_constant(&self) -> bool {
        self.0.len() == 1
    }

    /// The value at a time.
    #[inline]
    pub fn at(&self, time: f64) -> f64 {
        let knots = &*self.0;
        let [.., last] = knots else { return f64::NAN };
        if knots.len() == 1 {
            return last.1;
        }
        let after = knots.partition_point(|knot| knot.0 <= time);
        let (Some(from), Some(to)) = (knots.get(after.wrapping_sub(1)), knots.get(after)) else {
            return if after == 0 { knots[0].1 } else { last.1 };
        };
        let s = (time - from.0) / (to.0 - from.0);
        // A knot is met exactly, also when the next one is infinite.
        if s == 0.0 { from.1 } else { from.1 * (1.0 - s) + to.1 * s }
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "values which are passed through unchanged")]
mod tests {
    use super::*;

    #[test]
    fn lines_join_values_and_jumps_are_met() {
        let curve = TimeCurve::through(vec![(0.0, 1.0), (0.25, 3.0), (0.25, 7.0), (1.0, 7.0)]);
        let at = [0.0, 0.125, 0.25_f64.next_down(), 0.25, 0.9, 1.0].map(|time| curve.at(time));
        assert_eq!(at, [1.0, 2.0, at[2], 7.0, 7.0, 7.0]);
        assert!((at[2] - 3.0).abs() < 1e-12);
        assert!(TimeCurve::even(&[2.0, 2.0, 2.0]).is_constant());
        let to_infinity = TimeCurve::even(&[1.0, f64::INFINITY]);
        assert_eq!((to_infinity.at(0.0), to_infinity.at(1.0)), (1.0, f64::INFINITY));
        assert_eq!(TimeCurve::even(&[1.0, 2.0, 4.0]).map(|v| v + 1.0).at(0.75), 4.0);
    }
}
