//! Sorting lights into groups which are good nodes.
//!
//! What a choice among the lights of a group can miss grows with their flux, with the solid angle of the
//! directions that they shine to, and with how far apart they are. Conty Estevez and Kulla 2018,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting", section 4.4, sort by such a cost;
//! ours is the flux, times `π·(4 − 3·R)`, times the squared diagonal of the box. `R` is the length of
//! the mean of the axes: 1 for lights which face the same way, whose weighted solid angle is π, and 0
//! for those that shine everywhere, 4π. The source takes the angle of a cone around the axes, which
//! costs several trigonometric functions for every light and cut, and the area of the box, which is 0
//! for lights in a row.

use super::bounds::LightBounds;
use crate::math::Aabb;
use glam::DVec3;
use std::f64::consts::PI;

/// Buckets along the axis of a split.
const BUCKETS: usize = 12;

/// A light while the tree is built.
#[derive(Clone, Copy)]
pub(super) struct Item {
    /// Its place in the list that the tree is built from.
    pub light: u32,
    /// What the cost of a group adds up from.
    pub group: Group,
}

/// A slicing of space along one axis.
#[derive(Clone, Copy)]
struct Slices {
    axis: usize,
    start: f32,
    per_metre: f32,
}

impl Slices {
    fn of(&self, item: &Item) -> usize {
        let place = (item.group.bounds.center()[self.axis] - self.start) * self.per_metre;
        (place as usize).min(BUCKETS - 1)
    }
}

/// Sorts the lights of a node into two groups and returns the size of the first: at least 1, and
/// less than all. There are at least two.
///
/// The cut between buckets is that of the least cost of both groups. Lights on one spot are halved.
pub(super) fn divide(items: &mut [Item]) -> usize {
    let centers = Aabb::from_points(items.iter().map(|item| item.group.bounds.center()));
    let extent = centers.max - centers.min;
    let mut best: Option<(f64, Slices, usize)> = None;
    for axis in 0..3 {
        let per_metre = BUCKETS as f32 / extent[axis];
        if !per_metre.is_normal() {
            continue;
        }
        let slices = Slices { axis, start: centers.min[axis], per_metre };
        let (cost, cut) = best_cut(items, slices);
        if best.is_none_or(|(least, ..)| cost < least) {
            best = Some((cost, slices, cut));
        }
    }
    let Some((_, slices, first_right)) = best else { return items.len() / 2 };
    let mut middle = 0;
    for k in 0..items.len() {
        if slices.of(&items[k]) < first_right {
            items.swap(middle, k);
            middle += 1;
        }
    }
    if middle == 0 || middle == items.len() { items.len() / 2 } else { middle }
}

/// Sums over a group of lights.
#[derive(Clone, Copy)]
pub(super) struct Group {
    /// Around them.
    pub bounds: Aabb,
    /// Their flux.
    pub flux: f64,
    axis: DVec3,
}

impl Group {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, flux: 0.0, axis: DVec3::ZERO };

    /// One light, its flux as a share of some whole.
    pub fn one(light: &LightBounds, whole: f64) -> Self {
        let flux = light.flux / whole;
        // An axis counts the less, the wider the cone around it.
        let narrow = 0.5 + 0.5 * light.cone.theta_o.cos();
        Self { bounds: light.bounds, flux, axis: light.cone.axis * (flux * narrow) }
    }

    /// The group of these lights.
    pub fn of(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |group, item| group.join(item.group))
    }

    fn join(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            flux: self.flux + other.flux,
            axis: self.axis + other.axis,
        }
    }

    /// How much a choice among these lights can miss; 0 for none.
    pub fn cost(&self) -> f64 {
        if self.bounds.is_empty() {
            return 0.0;
        }
        let diagonal = (self.bounds.max - self.bounds.min).as_dvec3();
        PI * (4.0 * self.flux - 3.0 * self.axis.length()) * diagonal.length_squared()
    }
}

/// The cut of least cost, as the cost and the first bucket of the second group.
fn best_cut(items: &[Item], slices: Slices) -> (f64, usize) {
    let mut buckets = [Group::EMPTY; BUCKETS];
    for item in items {
        let bucket = &mut buckets[slices.of(item)];
        *bucket = bucket.join(item.group);
    }
    let mut right = buckets;
    for k in (0..BUCKETS - 1).rev() {
        right[k] = right[k].join(right[k + 1]);
    }
    let mut left = Group::EMPTY;
    let mut best = (f64::INFINITY, BUCKETS / 2);
    for k in 1..BUCKETS {
        // A cut without a light since the last one is the same cut.
        if buckets[k - 1].bounds.is_empty() {
            continue;
        }
        left = left.join(buckets[k - 1]);
        let total = left.cost() + right[k].cost();
        if total < best.0 && !right[k].bounds.is_empty() {
            best = (total, k);
        }
    }
    best
}
