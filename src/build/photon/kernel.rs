//! How the photons around a point are weighted by their distance.
//!
//! The radiance estimate is `L = Σ_p f(x, ω_o, ω_p)·Φ_p·K(|x − x_p|)` with a kernel of unit integral over
//! the disk of radius `R`. With `u = d/R`, and `∇²E` the curvature of the irradiance over the disk:
//!
//! ```text
//!                K                       bias            variance (even light, n photons in the disk)
//! constant       1/(πR²)                 R²/8·∇²E        1/n
//! cone           3(1 − u)/(πR²)          3R²/40·∇²E      3/2/n
//! Epanechnikov   2(1 − u²)/(πR²)         R²/12·∇²E       4/3/n
//! ```
//!
//! At an equal bias the Epanechnikov kernel has the least error of all (Silverman 1986, *Density
//! Estimation for Statistics and Data Analysis*, section 4.2.1).

use crate::description::Kernel;
use std::f32::consts::PI;

impl Kernel {
    /// The weight at a squared distance, per unit area, for a disk of this squared radius; to be asked
    /// for `distance2 <= radius2` alone.
    #[inline]
    pub fn weight(self, distance2: f32, radius2: f32) -> f32 {
        let area = PI * radius2;
        let u2 = distance2 / radius2;
        match self {
            Self::Constant => 1.0 / area,
            Self::Cone => 3.0 * (1.0 - u2.sqrt()) / area,
            Self::Epanechnikov => 2.0 * (1.0 - u2) / area,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Kernel; 3] = [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov];

    /// The mean of `f` over the disk times its area, by the midpoint rule in the squared radius.
    fn integral(radius: f64, f: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let mean: f64 = (0..n).map(|k| f((k as f64 + 0.5) / n as f64 * radius * radius)).sum();
        mean / n as f64 * std::f64::consts::PI * radius * radius
    }

    #[test]
    fn kernels_have_unit_integral() {
        for kernel in ALL {
            let sum = integral(0.3, |d2| f64::from(kernel.weight(d2 as f32, 0.09)));
            assert!((sum - 1.0).abs() < 1e-5, "{kernel:?}: {sum}");
        }
    }

    /// Oracle: the irradiance of a point light (intensity 1, height 1) blurred by the kernel at its
    /// nadir, in closed form: for the constant kernel `2/R²·(1 − 1/√(1 + R²))`.
    #[test]
    fn the_bias_of_each_kernel_is_the_published_one() {
        let expected = [0.844_582_5, 0.901_832_4, 0.891_649_4];
        for (kernel, expected) in ALL.into_iter().zip(expected) {
            let blurred = integral(0.5, |d2| {
                f64::from(kernel.weight(d2 as f32, 0.25)) / (1.0 + d2).powf(1.5)
            });
            assert!((blurred - expected).abs() < 1e-5, "{kernel:?}: {blurred}");
        }
    }
}
