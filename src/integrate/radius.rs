//! How the gather radius of a pixel shrinks from pass to pass.
//!
//! Gathering photons over a disk of radius `R` blurs the light. A fixed `R` leaves a bias which no
//! number of photons removes; an `R` which shrinks too fast lets the noise win. With `N` photons kept so
//! far, `M` found in this pass and `Φ_i` their light,
//!
//! ```text
//! N' = N + αM,     R'² = R² (N + αM)/(N + M),     τ' = (τ + Φ_i) R'²/R²,     0 < α < 1
//! ```
//!
//! (Hachisuka and Jensen 2009, "Stochastic Progressive Photon Mapping", ACM Trans. Graph. 28(5),
//! section 4), and after `i` passes of as many photons each the pixel shows `τ/(i π R²)`.
//!
//! Since `τ'/R'² = τ/R² + Φ_i/R²`, that is nothing else than the **mean over the passes** of
//! `Φ_i/(π R_i²)`, each with the radius that it was gathered with. The film therefore takes every pass as one
//! sample, and has their spread for the noise; a kernel other than the constant one takes the place
//! of `1/(π R_i²)`. The radius is kept as a factor on that of the first pass, since a pixel sees
//! points at several distances.
//!
//! Where photons crowd, in the focus of a caustic, the radius of the first pass need not be that of the
//! pixel: there the first pass that finds photons begins with the disk which holds just *enough* of them
//! (Hachisuka and Jensen 2009, section 4, leave the first radius open). What it finds there is not biased by that
//! choice: given the distance of the nearest photon number `k`, the `k − 1` nearer ones are spread evenly over the disk, and
//! the kernel is 0 at its rim.
//!
//! Where a path gathers at several points the radius shrinks by the number of passes alone,
//! `R_{i+1}² = R_i² (i + α)/(i + 1)` (Knaus and Zwicker 2011, "Progressive Photon Mapping: A
//! Probabilistic Approach", ACM Trans. Graph. 30(3), eq. 20). Both laws go to zero as `i^((α−1)/2)`.

use crate::build::light::PhotonSource;
use crate::description::PhotonSettings;
use crate::extract::{Method, ViewCamera};
use crate::math::Aabb;
use glam::Vec3;

/// What a pixel remembers of the passes so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelRadius {
    /// `N`: photons kept.
    kept: f32,
    /// `R²` over that of the first pass.
    scale2: f32,
}

impl Default for PixelRadius {
    fn default() -> Self {
        Self { kept: 0.0, scale2: 1.0 }
    }
}

impl PixelRadius {
    /// The factor on the radius of the first pass.
    pub fn scale(&self) -> f32 {
        self.scale2.sqrt()
    }

    /// Whether no pass has found a photon yet.
    pub fn is_fresh(&self) -> bool {
        self.kept == 0.0
    }

    /// Begins with a part of the radius.
    pub fn begin_with(&mut self, part: f32) {
        self.scale2 *= part * part;
    }

    /// Takes in a pass which found this many photons. One which found none changes nothing.
    pub fn absorb(&mut self, found: u32, alpha: f32) {
        if found == 0 {
            return;
        }
        let found = found as f32;
        let kept = self.kept + alpha * found;
        self.scale2 *= kept / (self.kept + found);
        self.kept = kept;
    }
}

/// `R_i/R_1` by the number of passes alone, for pass `i` counted from 0.
pub fn shrunk_by_passes(pass: u32, alpha: f32) -> f32 {
    let alpha = f64::from(alpha);
    let scale2: f64 = (1..=pass).map(|i| (f64::from(i) + alpha) / (f64::from(i) + 1.0)).product();
    scale2.sqrt() as f32
}

/// The middle of the shutter.
const MIDDLE: f32 = 0.5;

/// What a first radius that was asked for comes to, in words, where it is not what is used: at the far end of
/// `bounds`, around all that has an end.
pub fn radius_limit(
    photons: &PhotonSettings,
    method: Method,
    source: &PhotonSource,
    camera: &ViewCamera,
    bounds: Aabb,
) -> Option<String> {
    if photons.radius == PhotonSettings::default().radius || bounds.is_empty() {
        return None;
    }
    if method == Method::PhotonMap {
        return Some(format!(
            "`photons.radius` {} is not used: `PhotonMap` gathers the `photons.nearest` {}, `Sppm` and `Path` over a radius",
            photons.radius, photons.nearest
        ));
    }
    let largest = f64::from(source.largest_radius(photons));
    let (side, growth) = camera.pixel_size(MIDDLE);
    let pixels = f64::from(photons.radius);
    let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| {
        let end = |bit: u32| if k >> bit & 1 == 0 { bounds.min } else { bounds.max };
        Vec3::new(end(0).x, end(1).y, end(2).z).as_dvec3()
    });
    let distances = corners.map(|corner| camera.ray_to(corner, MIDDLE).1);
    let farthest = distances.into_iter().fold(0.0, f64::max);
    let asked = pixels * (side + growth * farthest);
    if asked <= largest {
        return None;
    }
    let from = ((largest / pixels - side) / growth).max(0.0);
    let from = if from.is_finite() { from } else { 0.0 };
    Some(format!(
        "`photons.radius` {} would be {asked:.2} m at the far end of the scene: from {from:.2} m on before the camera {largest:.2} m is \
         used, since `photons.largest_radius` {} is a share of the radius of the scene; raise it for more blur",
        photons.radius, photons.largest_radius
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(passes: u32, alpha: f32, found: u32) -> f32 {
        let mut radius = PixelRadius::default();
        (0..passes).for_each(|_| radius.absorb(found, alpha));
        radius.scale().powi(2)
    }

    /// Oracle: `Π α(i + 1)/(αi + 1)` for the same number of photons in every pass.
    #[test]
    fn equal_passes_shrink_the_disk_by_the_published_product() {
        for (passes, alpha, expected) in [
            (1, 0.7, 0.7),
            (10, 0.7, 0.320_629_4),
            (100, 0.7, 0.122_744_8),
            (1000, 0.7, 0.045_880_1),
            (10, 2.0 / 3.0, 0.270_260_2),
            (100, 2.0 / 3.0, 0.088_292_1),
        ] {
            for found in [1, 12, 1000] {
                let scale2 = after(passes, alpha, found);
                let what = format!("{passes} passes of {found}, α = {alpha}");
                assert!((scale2 / expected - 1.0).abs() < 2e-4, "{what}: {scale2}");
            }
        }
    }

    /// A pass without photons is not 0/0, and does not count.
    #[test]
    fn passes_without_photons_change_nothing() {
        let mut radius = PixelRadius::default();
        (0..5).for_each(|_| radius.absorb(0, 0.7));
        assert_eq!(radius, PixelRadius::default());
        radius.absorb(3, 0.7);
        let once = radius;
        radius.absorb(0, 0.7);
        assert_eq!(radius, once);
    }

    /// A pixel which begins with a third of the radius keeps a third of it in every pass.
    #[test]
    fn a_smaller_beginning_scales_all_passes() {
        let (mut whole, mut third) = (PixelRadius::default(), PixelRadius::default());
        assert!(third.is_fresh());
        third.begin_with(1.0 / 3.0);
        for found in [4, 0, 9, 1] {
            whole.absorb(found, 0.7);
            third.absorb(found, 0.7);
            assert!((3.0 * third.scale() / whole.scale() - 1.0).abs() < 1e-6);
        }
        assert!(!third.is_fresh());
    }

    /// Oracle: `Γ(N + α)/(Γ(1 + α) Γ(N + 1))`.
    #[test]
    fn the_number_of_passes_alone_shrinks_by_its_closed_form() {
        for (n, alpha, expected) in [
            (10, 2.0 / 3.0, 0.508_515_8),
            (100, 2.0 / 3.0, 0.238_388_8),
            (1000, 2.0 / 3.0, 0.110_760_9),
            (100, 0.7, 0.276_155_1),
        ] {
            let scale2 = shrunk_by_passes(n - 1, alpha).powi(2) * 1.0;
            let expected: f32 = expected;
            assert!((scale2 / expected - 1.0).abs() < 1e-5, "{n}, {alpha}: {scale2}");
        }
    }
}
