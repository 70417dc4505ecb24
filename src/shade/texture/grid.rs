//! Values on a grid in space.

use crate::color::luminance;
use crate::description::{GridData, Rgb};
use glam::{DVec3, UVec3, Vec3};

/// A grid in its box, metres in the space of the object.
pub(super) struct Placed<'a> {
    grid: &'a GridData,
    min: DVec3,
    /// Cells per metre along each axis.
    cells: DVec3,
}

impl<'a> Placed<'a> {
    /// In a box of this size around `centre`, or where the grid itself says.
    pub(super) fn new(grid: &'a GridData, size: Option<Vec3>, centre: Vec3) -> Self {
        let (min, size) = if let Some(size) = size {
            (centre.as_dvec3() - 0.5 * size.as_dvec3(), size.as_dvec3())
        } else {
            let (min, max) = grid.bounds;
            (min.as_dvec3(), max.as_dvec3() - min.as_dvec3())
        };
        let cells = UVec3::from_array(grid.size).as_dvec3() / size;
        Self { grid, min, cells }
    }

    /// The value at a place: linear between the centres of cells, that of the last cell up to the border, 0 outside.
    pub(super) fn at(&self, p: DVec3) -> Rgb {
        let size = UVec3::from_array(self.grid.size).as_dvec3();
        let q = (p - self.min) * self.cells;
        if !(q.cmpge(DVec3::ZERO).all() && q.cmple(size).all()) {
            return Rgb::ZERO;
        }
        let q = (q - 0.5).clamp(DVec3::ZERO, size - 1.0);
        let low = q.floor();
        let share = (q - low).as_vec3();
        let low = low.as_uvec3();
        let high = (low + 1).min(UVec3::from_array(self.grid.size) - 1);
        let mut sum = Rgb::ZERO;
        for corner in 0..8 {
            let (mut cell, mut weight) = (low, 1.0);
            for axis in 0..3 {
                let is_high = corner >> axis & 1 == 1;
                cell[axis] = if is_high { high[axis] } else { low[axis] };
                weight *= if is_high { share[axis] } else { 1.0 - share[axis] };
            }
            if weight > 0.0 {
                sum += weight * self.cell(cell);
            }
        }
        sum
    }

    fn cell(&self, cell: UVec3) -> Rgb {
        let [x, y, _] = self.grid.size.map(|cells| cells as usize);
        let place = (cell.z as usize * y + cell.y as usize) * x + cell.x as usize;
        match self.grid.channels {
            1 => Rgb::splat(self.grid.values[place]),
            _ => Rgb::from_slice(&self.grid.values[3 * place..]),
        }
    }

    /// Bounds of the luminance in a box.
    pub(super) fn range(&self, min: DVec3, max: DVec3) -> [f32; 2] {
        let size = UVec3::from_array(self.grid.size).as_dvec3();
        let (from, to) = ((min - self.min) * self.cells, (max - self.min) * self.cells);
        let within = from.cmpge(DVec3::ZERO).all() && to.cmple(size).all();
        let mut range = if within { [f32::INFINITY, 0.0] } else { [0.0, 0.0] };
        if to.cmplt(DVec3::ZERO).any() || from.cmpgt(size).any() {
            return range;
        }
        // All cells that are looked at from within the box.
        let last = size - 1.0;
        let low = (from - 0.5).floor().clamp(DVec3::ZERO, last).as_uvec3();
        let high = ((to - 0.5).floor() + 1.0).clamp(DVec3::ZERO, last).as_uvec3();
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let value = luminance(self.cell(UVec3::new(x, y, z)));
                    range = [range[0].min(value), range[1].max(value)];
                }
            }
        }
        range
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: a function that is linear along each axis comes out exactly, between the centres of the cells.
    #[test]
    fn values_are_linear_between_cells() {
        let size = [4, 3, 5];
        let of = |p: DVec3| 1.0 + 0.5 * p.x + 0.25 * p.y * p.z;
        let mut values = Vec::new();
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let centre = UVec3::new(x, y, z).as_dvec3() + 0.5;
                    values.push(of(centre) as f32);
                }
            }
        }
        let bounds = (Vec3::ZERO, Vec3::new(4.0, 3.0, 5.0));
        let grid = GridData { size, channels: 1, values, bounds };
        let placed = Placed::new(&grid, None, Vec3::ZERO);
        for p in [DVec3::new(0.5, 0.5, 0.5), DVec3::new(1.7, 2.1, 3.9), DVec3::new(3.5, 2.5, 4.5)] {
            assert!((f64::from(placed.at(p).x) - of(p)).abs() < 1e-6, "{p}: {}", placed.at(p));
        }
        // Up to the border, and nothing beyond.
        assert_eq!(placed.at(DVec3::ZERO), placed.at(DVec3::splat(0.5)));
        assert_eq!(placed.at(DVec3::new(-1e-9, 1.0, 1.0)), Rgb::ZERO);
        let moved = Placed::new(&grid, Some(Vec3::new(8.0, 6.0, 10.0)), Vec3::new(4.0, 3.0, 105.0));
        let p = DVec3::new(1.7, 2.1, 3.9);
        let there = 2.0 * p + DVec3::new(0.0, 0.0, 100.0);
        assert!((moved.at(there) - placed.at(p)).abs().max_element() < 1e-6);
    }
}
