//! Indices of refraction which depend on the wavelength.

use serde::Deserialize;

/// The wavelength, in nm, at which an index of refraction is meant where none is stated: the yellow line d of helium.
pub const D_LINE: f64 = 587.5618;

/// How the index of refraction of a clear solid depends on the wavelength.
///
/// Coefficients of named substances are for wavelengths in µm in air, at 20 °C.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Dispersion {
    /// By the Abbe number `V_d = (n_d − 1)/(n_F − n_C)`, with the material's `ior` as `n_d`. The curve is that of glTF's
    /// `KHR_materials_dispersion`.
    Abbe(f32),
    /// Cauchy's formula `n = a + b/λ²`.
    Cauchy {
        /// The index at infinite wavelength.
        a: f64,
        /// µm².
        b: f64,
    },
    /// Sellmeier's formula `n² = 1 + Σ bₖλ²/(λ² − cₖ)` of up to four terms.
    Sellmeier {
        /// Without unit.
        b: Vec<f64>,
        /// µm².
        c: Vec<f64>,
    },
    /// Crown glass Schott N-BK7 (Schott, *Optical Glass Data Sheets*).
    Bk7,
    /// Dense flint glass Schott SF11 (Schott, *Optical Glass Data Sheets*).
    Sf11,
    /// The same without lead, Schott N-SF11 (Schott, *Optical Glass Data Sheets*).
    NSf11,
    /// Fused silica (Malitson 1965, "Interspecimen Comparison of the Refractive Index of Fused Silica", *JOSA* 55).
    FusedSilica,
    /// Diamond (Peter 1923, "Über Brechungsindizes und Absorptionskonstanten des Diamanten", *Z. Physik* 15).
    Diamond,
    /// Water (Daimon and Masumura 2007, "Measurement of the refractive index of distilled water", *Appl. Opt.* 46).
    Water,
}

/// Why coefficients are of no use.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DispersionError {
    /// Sellmeier's terms do not pair.
    #[error("`b` and `c` must be 1 to 4 numbers each, as many of one as of the other")]
    Terms,
    /// No index of a clear solid comes of it.
    #[error("the index at {wavelength_nm} nm would be {index}, outside of 1 to 10")]
    Index {
        /// Where, nm.
        wavelength_nm: f64,
        /// What it would be.
        index: f64,
    },
}

/// An index of refraction as a function of the wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IndexCurve {
    /// `n = a + b/λ²`; µm².
    Cauchy {
        /// At infinite wavelength.
        a: f64,
        /// µm².
        b: f64,
    },
    /// `n² = 1 + Σ bₖλ²/(λ² − cₖ)`; µm².
    Sellmeier {
        /// Without unit.
        b: [f64; 4],
        /// µm².
        c: [f64; 4],
    },
}

impl IndexCurve {
    /// The index of refraction at a wavelength in nm.
    #[inline]
    pub fn index(&self, wavelength_nm: f64) -> f64 {
        let squared = (wavelength_nm * 1e-3).powi(2);
        match self {
            Self::Cauchy { a, b } => a + b / squared,
            Self::Sellmeier { b, c } => {
                let terms = b.iter().zip(c).map(|(b, c)| b * squared / (squared - c));
                (1.0 + terms.sum::<f64>()).sqrt()
            }
        }
    }
}

impl Dispersion {
    /// The curve, of a material with this index at the d line where the curve does not say it itself.
    pub fn curve(&self, ior: f32) -> IndexCurve {
        let sellmeier = |b: &[f64], c: &[f64]| {
            let padded =
                |list: &[f64]| std::array::from_fn(|k| list.get(k).copied().unwrap_or(0.0));
            IndexCurve::Sellmeier { b: padded(b), c: padded(c) }
        };
        match self {
            Self::Abbe(number) => {
                // n = n_d + (n_d − 1)/V·(0.523655/λ² − 1.5168), λ in µm.
                let (n, v) = (f64::from(ior), f64::from(*number));
                let strength = (n - 1.0) / v;
                IndexCurve::Cauchy { a: n - 1.5168 * strength, b: 0.523_655 * strength }
            }
            Self::Cauchy { a, b } => IndexCurve::Cauchy { a: *a, b: *b },
            Self::Sellmeier { b, c } => sellmeier(b, c),
            Self::Bk7 => sellmeier(
                &[1.039_612_12, 0.231_792_344, 1.010_469_45],
                &[0.006_000_698_67, 0.020_017_914_4, 103.560_653],
            ),
            Self::Sf11 => sellmeier(
                &[1.738_484_03, 0.311_168_974, 1.174_908_71],
                &[0.013_606_860_4, 0.061_596_046_3, 121.922_711],
            ),
            Self::NSf11 => sellmeier(
                &[1.737_596_95, 0.313_747_346, 1.898_781_01],
                &[0.013_188_707, 0.062_306_814_2, 155.236_29],
            ),
            Self::FusedSilica => sellmeier(
                &[0.696_166_3, 0.407_942_6, 0.897_479_4],
                &[0.068_404_3_f64.powi(2), 0.116_241_4_f64.powi(2), 9.896_161_f64.powi(2)],
            ),
            Self::Diamond => {
                sellmeier(&[0.3306, 4.3356], &[0.1750_f64.powi(2), 0.1060_f64.powi(2)])
            }
            Self::Water => sellmeier(
                &[0.568_402_756_5, 0.172_617_739_1, 0.020_861_895_78, 0.113_074_868_8],
                &[0.005_101_829_712, 0.018_211_539_36, 0.026_207_222_93, 10.697_927_21],
            ),
        }
    }

    /// Whether the material's `ior` belongs to the curve.
    pub fn needs_ior(&self) -> bool {
        matches!(self, Self::Abbe(_))
    }

    /// Whether the index is one of a clear solid all over the visible range, of a material with this `ior`.
    ///
    /// # Errors
    /// Where it is not, and where terms do not pair.
    pub fn check(&self, ior: f32) -> Result<(), DispersionError> {
        if let Self::Sellmeier { b, c } = self
            && (b.is_empty() || b.len() > 4 || b.len() != c.len())
        {
            return Err(DispersionError::Terms);
        }
        let curve = self.curve(ior);
        for wavelength_nm in (380..=730).map(f64::from) {
            let index = curve.index(wavelength_nm);
            if !(1.0..=10.0).contains(&index) {
                return Err(DispersionError::Index { wavelength_nm, index });
            }
        }
        Ok(())
    }
}

/// The index at the d line of a material with this `ior`, which counts where its dispersion does not say it.
pub fn index_at_d(ior: f32, dispersion: Option<&Dispersion>) -> f32 {
    match dispersion.filter(|dispersion| !dispersion.needs_ior()) {
        Some(dispersion) => dispersion.curve(ior).index(D_LINE) as f32,
        None => ior,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_index(dispersion: &Dispersion, ior: f32, expected: &[(f64, f64)], within: f64) {
        let curve = dispersion.curve(ior);
        for &(wavelength, n) in expected {
            let index = curve.index(wavelength);
            assert!((index - n).abs() < within, "{dispersion:?} at {wavelength} nm: {index}");
        }
    }

    /// Oracle: published indices at spectral lines, and the Abbe numbers which follow from them.
    #[test]
    fn named_glasses_have_their_published_indices() {
        use Dispersion::*;
        let lines = [486.1327, D_LINE, 656.2725];
        let bk7 = [1.522_376_3, 1.516_800_0, 1.514_322_3];
        let bk7: Vec<_> = lines.into_iter().zip(bk7).collect();
        assert_index(&Bk7, 1.0, &bk7, 5e-8);
        let sf11 = [(400.0, 1.84512), (500.0, 1.80251), (600.0, 1.78289), (700.0, 1.77181)];
        assert_index(&Sf11, 1.0, &sf11, 6e-6);
        let diamond = [(400.0, 2.46413), (500.0, 2.43236), (600.0, 2.41591), (700.0, 2.40624)];
        assert_index(&Diamond, 1.0, &diamond, 6e-6);
        let water = [(400.0, 1.34356), (500.0, 1.33680), (600.0, 1.33302), (700.0, 1.33052)];
        assert_index(&Water, 1.0, &water, 6e-6);
        for (glass, n_d, abbe) in [
            (Bk7, 1.51680, 64.167),
            (Sf11, 1.78472, 25.76),
            (NSf11, 1.78472, 25.68),
            (FusedSilica, 1.45846, 67.82),
            (Diamond, 2.41749, 55.30),
            (Water, 1.33340, 55.76),
        ] {
            let [f, d, c] = lines.map(|line| glass.curve(1.0).index(line));
            // Half a unit of the last published digit, and the rounding to f32.
            assert!((d - n_d).abs() <= 5e-6, "{glass:?}: {d}");
            assert!((f64::from(index_at_d(9.0, Some(&glass))) / d - 1.0).abs() < 6e-8);
            let number = (d - 1.0) / (f - c);
            assert!((number - abbe).abs() <= 5e-3, "{glass:?}: {number}");
            assert_eq!(glass.check(1.0), Ok(()));
        }
    }

    /// Oracle: indices of glTF's formula, dispersion 0.36 and 1 being Abbe numbers of 20/0.36 and 20.
    #[test]
    fn abbe_numbers_follow_the_formula_of_gltf() {
        let lines = [(486.1, 1.506_293_9), (656.3, 1.497_290_5)];
        assert_index(&Dispersion::Abbe(20.0 / 0.36), 1.5, &lines, 1e-6);
        let strong = [(450.0, 1.526_728_8), (550.0, 1.505_357_3), (650.0, 1.493_065_5)];
        assert_index(&Dispersion::Abbe(20.0), 1.5, &strong, 1e-6);
        assert_eq!(index_at_d(1.5, Some(&Dispersion::Abbe(20.0))), 1.5);
    }

    #[test]
    fn useless_coefficients_are_told() {
        let sellmeier = |b: &[f64], c: &[f64]| {
            Dispersion::Sellmeier { b: b.to_vec(), c: c.to_vec() }.check(1.5)
        };
        assert_eq!(sellmeier(&[1.0], &[]), Err(DispersionError::Terms));
        assert_eq!(sellmeier(&[], &[]), Err(DispersionError::Terms));
        assert_eq!(sellmeier(&[1.0; 5], &[0.01; 5]), Err(DispersionError::Terms));
        // A resonance in the middle of the visible, and none at all.
        for (b, c) in [(1.0, 0.25), (-3.0, 0.01), (f64::NAN, 0.01), (1.0, f64::INFINITY)] {
            let told = sellmeier(&[b], &[c]);
            let is_fine = b == 1.0 && c == f64::INFINITY; // a term which vanishes
            assert_eq!(told.is_ok(), is_fine, "{b} {c}: {told:?}");
        }
        assert!(Dispersion::Abbe(0.0).check(1.5).is_err());
        assert!(Dispersion::Cauchy { a: 20.0, b: 0.0 }.check(1.5).is_err());
    }
}
