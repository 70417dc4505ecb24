//! Meshes which are surfaces of water: their numbers.

use super::decode::Report;
use super::limits;
use super::source::Cursor;
use crate::description::Waves;

/// Greatest number of cells: the surface is made anew for every frame, and several times over the
/// shutter.
const MAX_CELLS: f64 = 4_194_304.0;
/// Greatest number of waves: each adds to the work at every vertex.
const MAX_WAVES: usize = 1024;

/// Checks a surface of water; `None` when something in it is wrong.
pub(super) fn check_waves(cursor: &Cursor, waves: Waves, report: &mut Report) -> Option<Waves> {
    let mut fine =
        limits::vector(report, &cursor.at("size"), &waves.size.to_array(), &limits::LENGTH);
    let (nx, nz) = waves.cells;
    let (nx, nz) = (f64::from(nx), f64::from(nz));
    let place = cursor.at("cells");
    fine &= limits::vector(report, &place, &[nx, nz], &limits::CELLS);
    if fine && nx * nz > MAX_CELLS {
        let message = format!("a surface has at most {MAX_CELLS} cells, but this has {}", nx * nz);
        report.at("scene::out-of-range", &place, message);
        fine = false;
    }
    fine &= limits::number(report, &cursor.at("steepness"), waves.steepness, &limits::SHARE);
    fine &= limits::number(report, &cursor.at("gravity"), waves.gravity, &limits::GRAVITY);
    let list = cursor.at("waves");
    if waves.waves.is_empty() || waves.waves.len() > MAX_WAVES {
        let message =
            format!("`waves` needs 1 to {MAX_WAVES} waves, but has {}", waves.waves.len());
        report.at("scene::mesh", &list, message);
        fine = false;
    }
    for (index, wave) in waves.waves.iter().enumerate() {
        let place = list.nth(index);
        for (field, value, limits) in [
            ("amplitude", wave.amplitude, &limits::LENGTH_OR_ZERO),
            ("frequency", wave.frequency, &limits::FREQUENCY),
            ("direction", wave.direction, &limits::ANGLE),
            ("phase", wave.phase, &limits::ANGLE),
        ] {
            fine &= limits::number(report, &place.at(field), value, limits);
        }
    }
    let compression = waves.greatest_compression();
    if fine && compression > 1.0 {
        let message = format!(
            "the surface may fold over itself: `steepness` times the sum of amplitude times wave \
             number is {compression:.3}, and must be at most 1"
        );
        report.at("scene::out-of-range", &list, message).help =
            Some("make the waves lower, slower, or less steep".to_owned());
        fine = false;
    }
    fine.then_some(waves)
}
