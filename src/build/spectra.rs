//! The surfaces of a spectral scene, as they are at each set of wavelengths.

use crate::color::spectrum;
use crate::extract::{Feature, Requirements, Surfaces};
use bevy_ecs::prelude::*;

/// The surfaces at each of the [`spectrum::sets`]; none where a frame is rendered in red, green and blue.
#[derive(Resource, Default)]
pub struct Spectra {
    /// In the order of the sets.
    pub surfaces: Vec<Surfaces>,
}

/// Sees the surfaces at all sets of wavelengths, when they changed or it was not required before.
pub fn see_spectra(
    surfaces: Res<Surfaces>,
    requirements: Res<Requirements>,
    mut spectra: ResMut<Spectra>,
) {
    let wanted = requirements.has(Feature::Spectra);
    if wanted && (surfaces.is_changed() || spectra.surfaces.is_empty()) {
        spectra.surfaces = spectrum::sets().iter().map(|set| surfaces.seen_at(set)).collect();
    } else if !wanted && !spectra.surfaces.is_empty() {
        spectra.surfaces.clear();
    }
}
