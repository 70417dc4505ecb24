//! Complex indices of refraction of metals, as RGB.
//!
//! Measured tables are read, with linear interpolation, at the dominant wavelengths of the Rec. 709
//! primaries against D65: 611, 549 and 464 nm. Sources:
//!
//! * gold, silver, copper: Johnson and Christy 1972, "Optical Constants of the Noble Metals",
//!   Physical Review B 6, 4370;
//! * chromium, iron, nickel, titanium: Johnson and Christy 1974, "Optical constants of transition
//!   metals", Physical Review B 9, 5056;
//! * aluminium: Rakić 1995, "Algorithm for the determination of intrinsic optical constants of metal
//!   films: application to aluminum", Applied Optics 34, 4755;
//! * platinum: Rakić et al. 1998, "Optical properties of metallic films for vertical-cavity
//!   optoelectronic devices", Applied Optics 37, 5271 (Brendel–Bormann model);
//! * tungsten: Weaver, Olson, Lynch 1975, "Optical properties of crystalline tungsten", Physical
//!   Review B 12, 1293.

use crate::description::{Metal, Rgb};

/// Real and imaginary part, `η` and `k`, of a metal's index.
pub(crate) fn index_of_refraction(metal: Metal) -> (Rgb, Rgb) {
    let (eta, k) = match metal {
        Metal::Aluminium => ([1.320, 1.011, 0.683], [7.307, 6.616, 5.623]),
        Metal::Chromium => ([3.179, 3.180, 2.447], [3.300, 3.330, 3.205]),
        Metal::Copper => ([0.367, 1.016, 1.246], [3.121, 2.579, 2.452]),
        Metal::Gold => ([0.223, 0.428, 1.335], [3.204, 2.460, 1.872]),
        Metal::Iron => ([2.890, 2.950, 2.642], [3.040, 2.930, 2.803]),
        Metal::Nickel => ([1.985, 1.920, 1.763], [3.982, 3.610, 3.041]),
        Metal::Platinum => ([2.256, 2.082, 1.877], [4.058, 3.710, 3.217]),
        Metal::Silver => ([0.058, 0.060, 0.046], [4.103, 3.589, 2.792]),
        Metal::Titanium => ([2.658, 2.540, 2.303], [3.696, 3.430, 3.079]),
        Metal::Tungsten => ([3.578, 3.522, 3.324], [2.881, 2.739, 2.570]),
    };
    (Rgb::from_array(eta), Rgb::from_array(k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::bsdf::ConductorFresnel;

    /// Oracle: reflectances at normal incidence of clean films near 600, 550 and 450 nm from the
    /// handbook tables of Weaver (CRC Handbook of Chemistry and Physics, "Optical properties of selected
    /// elements"), to the spread between published samples.
    #[test]
    fn metals_have_the_colour_of_their_handbook_reflectance() {
        for (metal, expected) in [
            (Metal::Aluminium, [0.91, 0.92, 0.92]),
            (Metal::Copper, [0.88, 0.61, 0.54]),
            (Metal::Gold, [0.92, 0.80, 0.39]),
            (Metal::Silver, [0.98, 0.98, 0.97]),
            (Metal::Platinum, [0.67, 0.64, 0.58]),
            (Metal::Tungsten, [0.51, 0.50, 0.47]),
        ] {
            let (eta, k) = index_of_refraction(metal);
            let f0 = ConductorFresnel::Complex { eta, k }.reflectance(1.0);
            assert!(
                (f0 - Rgb::from_array(expected)).abs().max_element() < 0.025,
                "{metal:?}: {f0}"
            );
        }
    }
}
