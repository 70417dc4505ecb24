//! Independent random numbers, for as many decisions as it takes.

/// A sequence of independent numbers that follows from its seed (Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom
/// Number Generators", OOPSLA, `SplitMix64`).
#[derive(Clone, Copy, Debug)]
pub struct Stream(u64);

impl Stream {
    /// The numbers that follow from those which were drawn for one decision. Equal numbers give equal sequences.
    pub fn new(drawn: &[f64]) -> Self {
        Self(drawn.iter().fold(0, |seed, number| super::sobol::mix(seed ^ number.to_bits())))
    }

    /// The next number in `[0, 1)`.
    #[inline]
    pub fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (super::sobol::mix(self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A length that decays exponentially, of mean 1.
    #[inline]
    pub fn exponential(&mut self) -> f64 {
        -(-self.draw()).ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms: mean and variance of even and of exponential numbers, and no correlation of neighbours.
    #[test]
    fn numbers_are_even_and_independent() {
        let mut stream = Stream::new(&[0.25, 7.0]);
        let n = 1 << 20;
        let (mut sum, mut squares, mut products, mut lengths) = (0.0, 0.0, 0.0, 0.0);
        let mut last = 0.0;
        for _ in 0..n {
            let x = stream.draw() - 0.5;
            sum += x;
            squares += x * x;
            products += x * last;
            lengths += stream.exponential();
            last = x;
        }
        let mean = |sum: f64| sum / f64::from(n);
        // Five standard errors each: √(1/12), √(1/180), 1/12 and 1 over √n.
        let error = 5.0 / f64::from(n).sqrt();
        assert!(mean(sum).abs() < error * (1.0_f64 / 12.0).sqrt());
        assert!((mean(squares) - 1.0 / 12.0).abs() < error * (1.0_f64 / 180.0).sqrt());
        assert!(mean(products).abs() < error / 12.0);
        assert!((mean(lengths) - 1.0).abs() < error);
    }
}
