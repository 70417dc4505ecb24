//! Media whose density is uneven: bounds on a coarse grid, and the way of a ray through it.

use crate::math::Ray;
use crate::shade::texture::{Ranges, Region, TexturePoint, Textures};
use glam::{DAffine3, DVec3};
use std::sync::atomic::AtomicU64;

/// Cells along the longest side of the grid of bounds.
const CELLS: f64 = 48.0;
/// Sums and products of the interpolation between values, rounded: more than the bounds that hold for its terms.
const ROUNDING: f32 = 1.0 + 16.0 * f32::EPSILON;

/// The density inside an object over a shutter: a texture, and bounds of it.
#[derive(Clone, Debug)]
pub struct Density {
    texture: u32,
    /// Least corner of the box around the object, metres in its space.
    min: DVec3,
    /// Sides of a cell, metres.
    cell: DVec3,
    /// Cells along each side.
    count: [usize; 3],
    /// The greatest density in each cell.
    most: Vec<f32>,
    /// About the mean density of each cell.
    typical: Vec<f32>,
}

impl Density {
    /// Looks for bounds of a texture in a box, metres in the space of the object.
    pub fn new(textures: &Textures, texture: u32, min: DVec3, max: DVec3) -> Self {
        let side = (max - min).max(DVec3::splat(f64::MIN_POSITIVE));
        let target = side.max_element() / CELLS;
        let count = (side / target).ceil().clamp(DVec3::ONE, DVec3::splat(CELLS));
        let cell = side / count;
        let count = count.to_array().map(|count| count as usize);
        let ranges = Ranges::new(textures, texture);
        let cells = count.iter().product();
        let (mut most, mut typical) = (Vec::with_capacity(cells), Vec::with_capacity(cells));
        for index in 0..cells {
            let place = DVec3::new(
                (index % count[0]) as f64,
                (index / count[0] % count[1]) as f64,
                (index / (count[0] * count[1])) as f64,
            );
            let low = min + cell * place;
            let [_, high] = ranges.over(&Region::new(low, low + cell));
            most.push((high * ROUNDING).max(0.0));
            // In the middle of each half, at the middle of the shutter.
            let sum: f32 = (0..8)
                .map(|k| {
                    let half = DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
                    let p = low + cell * (0.25 + 0.5 * half);
                    textures.scalar(texture, &TexturePoint::inside(p, 0.5)).max(0.0)
                })
                .sum();
            typical.push(sum / 8.0);
        }
        Self { texture, min, cell, count, most, typical }
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        size_of_val(self.most.as_slice()) + size_of_val(self.typical.as_slice())
    }

    /// The same with another bound everywhere.
    #[cfg(test)]
    pub(super) fn bounded(mut self, most: f32) -> Self {
        self.most.fill(most);
        self
    }

    fn max(&self) -> DVec3 {
        self.min + self.cell * DVec3::from_array(self.count.map(|count| count as f64))
    }
}

/// The way of a ray through an object of uneven density. Distances are metres in render space, from where the ray begins.
#[derive(Clone, Copy, Debug)]
pub struct Passage<'a> {
    density: &'a Density,
    textures: &'a Textures,
    /// The ray in the space of the object.
    o: DVec3,
    d: DVec3,
    time: f32,
    /// How often more was found than the bounds allow.
    pub(super) exceeded: &'a AtomicU64,
}

impl<'a> Passage<'a> {
    /// A ray in render space; `object_from_render` leads to metres in the space of the object.
    pub fn new(
        density: &'a Density,
        textures: &'a Textures,
        ray: &Ray,
        object_from_render: &DAffine3,
        exceeded: &'a AtomicU64,
    ) -> Self {
        let o = object_from_render.transform_point3(ray.o.as_dvec3());
        let d = object_from_render.transform_vector3(ray.d.as_dvec3().normalize());
        Self { density, textures, o, d, time: ray.time, exceeded }
    }

    /// The density at a distance; nothing is outside of the box.
    #[inline]
    pub fn at(&self, t: f64) -> f32 {
        let at = TexturePoint::inside(self.o + self.d * t, self.time);
        self.textures.scalar(self.density.texture, &at).max(0.0)
    }

    /// The part of the way before `end` which lies in the box.
    pub fn within(&self, end: f64) -> Option<(f64, f64)> {
        let (mut near, mut far) = (0.0_f64, end);
        let (min, max) = (self.density.min, self.density.max());
        for axis in 0..3 {
            let (o, d) = (self.o[axis], self.d[axis]);
            if d == 0.0 {
                if o < min[axis] || o > max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near < far).then_some((near, far))
    }

    /// The cells on the way before `end`, in order.
    pub(super) fn cells(&self, end: f64) -> Cells<'a> {
        let density = self.density;
        let Some((t, end)) = self.within(end) else {
            return Cells {
                density,
                cell: [0; 3],
                step: [0; 3],
                next: [0.0; 3],
                stride: [0.0; 3],
                t: 0.0,
                end: 0.0,
            };
        };
        let start = (self.o + self.d * t - density.min) / density.cell;
        let (mut cell, mut step) = ([0; 3], [0; 3]);
        let (mut next, mut stride) = ([f64::INFINITY; 3], [f64::INFINITY; 3]);
        for axis in 0..3 {
            cell[axis] = (start[axis].max(0.0) as usize).min(density.count[axis] - 1);
            let d = self.d[axis];
            if d != 0.0 {
                step[axis] = if d > 0.0 { 1 } else { -1 };
                let plane = cell[axis] as f64 + f64::from(u8::from(d > 0.0));
                let plane = density.min[axis] + density.cell[axis] * plane;
                next[axis] = (plane - self.o[axis]) / d;
                stride[axis] = density.cell[axis] / d.abs();
            }
        }
        Cells { density, cell, step, next, stride, t, end }
    }

    /// About the density at a distance, and about its integral up to there.
    pub fn expected(&self, t: f64) -> (f64, f64) {
        let (mut here, mut depth) = (0.0, 0.0);
        for part in self.cells(t) {
            here = f64::from(part.typical);
            depth += here * (part.end - part.begin);
        }
        (here, depth)
    }
}

/// A part of a way in one cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) begin: f64,
    pub(super) end: f64,
    /// The greatest density.
    pub(super) most: f32,
    /// About the mean density.
    pub(super) typical: f32,
}

/// The cells on a way (Amanatides and Woo 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics).
pub(super) struct Cells<'a> {
    density: &'a Density,
    cell: [usize; 3],
    step: [isize; 3],
    /// Where the way leaves the cell along each axis, and how far apart such places are.
    next: [f64; 3],
    stride: [f64; 3],
    t: f64,
    end: f64,
}

impl Iterator for Cells<'_> {
    type Item = Part;

    #[inline]
    fn next(&mut self) -> Option<Part> {
        if self.t >= self.end {
            return None;
        }
        let axis = if self.next[0] <= self.next[1] && self.next[0] <= self.next[2] {
            0
        } else if self.next[1] <= self.next[2] {
            1
        } else {
            2
        };
        let [x, y, z] = self.cell;
        let count = self.density.count;
        let index = (z * count[1] + y) * count[0] + x;
        let begin = self.t;
        let end = self.next[axis].clamp(begin, self.end);
        self.t = end;
        self.next[axis] += self.stride[axis];
        match self.cell[axis].checked_add_signed(self.step[axis]) {
            Some(cell) if cell < count[axis] => self.cell[axis] = cell,
            _ => self.t = self.end,
        }
        let (most, typical) = (self.density.most[index], self.density.typical[index]);
        Some(Part { begin, end, most, typical })
    }
}
