//! Spectra: values by wavelength.

use serde::Deserialize;
use serde::de::{self, Deserializer};

/// Values at wavelengths in nm, ascending; straight lines between them, the same beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumData {
    points: Vec<(f32, f32)>,
}

impl SpectrumData {
    /// A spectrum through these points.
    ///
    /// # Panics
    /// If there are none, or wavelengths do not ascend.
    pub fn new(points: Vec<(f32, f32)>) -> Self {
        assert!(is_sound(&points), "{points:?}");
        Self { points }
    }

    /// The points, ascending.
    pub fn points(&self) -> &[(f32, f32)] {
        &self.points
    }

    /// The value at a wavelength in nm.
    pub fn at(&self, nm: f32) -> f32 {
        let after = self.points.partition_point(|point| point.0 <= nm);
        let last = self.points.len() - 1;
        let ((a, from), (b, to)) = (self.points[after.max(1) - 1], self.points[after.min(last)]);
        if b > a { from + (to - from) * ((nm - a) / (b - a)).clamp(0.0, 1.0) } else { from }
    }

    /// The mean between two wavelengths in nm, `from < to`: exact for what lies between points.
    pub fn mean(&self, from: f32, to: f32) -> f32 {
        let (mut sum, mut low) = (0.0_f64, from);
        let inner = self.points.iter().map(|point| point.0).filter(|nm| from < *nm && *nm < to);
        for high in inner.chain([to]) {
            sum += f64::from(0.5 * (self.at(low) + self.at(high))) * f64::from(high - low);
            low = high;
        }
        (sum / f64::from(to - from)) as f32
    }
}

fn is_sound(points: &[(f32, f32)]) -> bool {
    let finite = points.iter().all(|(nm, value)| nm.is_finite() && value.is_finite());
    !points.is_empty() && finite && points.windows(2).all(|pair| pair[0].0 < pair[1].0)
}

impl<'de> Deserialize<'de> for SpectrumData {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let points = Vec::<(f32, f32)>::deserialize(deserializer)?;
        if is_sound(&points) {
            return Ok(Self { points });
        }
        Err(de::Error::custom(
            "a spectrum is a list of (wavelength in nm, value) with finite numbers, wavelengths ascending, at least one",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms of a triangle: at its points, between and beyond, and its mean.
    #[test]
    fn spectra_are_straight_between_their_points() {
        let spectrum = SpectrumData::new(vec![(400.0, 0.0), (500.0, 1.0), (600.0, 0.5)]);
        for (nm, value) in
            [(300.0, 0.0), (400.0, 0.0), (450.0, 0.5), (500.0, 1.0), (550.0, 0.75), (700.0, 0.5)]
        {
            assert!((spectrum.at(nm) - value).abs() < 1e-6, "{nm}");
        }
        assert!((spectrum.mean(400.0, 600.0) - 0.625).abs() < 1e-6);
        assert!((spectrum.mean(450.0, 460.0) - 0.55).abs() < 1e-6);
        assert!((spectrum.mean(650.0, 700.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_spectrum_is_refused() {
        for text in ["[]", "[(500, 1), (400, 1)]", "[(500, 1), (500, 2)]"] {
            let told = ron::from_str::<SpectrumData>(text).unwrap_err().to_string();
            assert!(told.contains("wavelengths ascending"), "{told}");
        }
    }
}
