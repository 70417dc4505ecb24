//! A balanced k-d tree over points, in flat arrays.
//!
//! Points are halved along the longest side of their cell until [`LEAF`] or fewer are left. All leaves
//! have the same depth, so that the tree is an array of splitting planes in pre-order (a subtree of
//! `k` levels has `2ᵏ − 1` of them) and the points of each leaf are neighbours in memory: there are no
//! pointers, and a leaf's place follows from the number of points alone. However the points are spread, also all in one
//! place, the depth is the logarithm of their number. The decision note `photon-map.md` has the
//! measurement against a hash grid.
//!
//! Equal coordinates are told apart by the order of the points, so that the tree, and with it the order in
//! which they are found, is the same for any number of threads.
//!
//! Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, chapter 6; there the tree is
//! left-balanced with a photon in each node. Leaves of several photons halve its depth.

use glam::Vec3;
use rayon::prelude::*;

/// Most points in a leaf: about four cache lines are read for a plane that was looked at.
const LEAF: usize = 8;
/// From this many points on both halves are built in parallel.
const PARALLEL: usize = 4096;
/// Levels that 2³² points need.
const DEPTH: usize = 32;

/// Something which is at a place.
pub(super) trait Placed: Copy + Send + Sync {
    /// Where, in render space.
    fn position(&self) -> Vec3;
}

/// A plane which halves a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Plane {
    /// Its coordinate on the axis.
    at: f32,
    axis: u32,
}

/// A point's place, and its place in the order of points.
#[derive(Clone, Copy, Debug)]
struct Key {
    position: Vec3,
    index: u32,
}

/// Points which can be found by place. The memory is kept from build to build.
#[derive(Clone, Debug)]
pub(super) struct PointTree<T> {
    pub(super) planes: Vec<Plane>,
    pub(super) levels: u32,
    /// In the order of the leaves.
    points: Vec<T>,
    keys: Vec<Key>,
}

impl<T> Default for PointTree<T> {
    fn default() -> Self {
        Self { planes: Vec::new(), levels: 0, points: Vec::new(), keys: Vec::new() }
    }
}

impl<T: Placed> PointTree<T> {
    /// Builds the tree anew over these points.
    pub(super) fn rebuild(&mut self, unsorted: &[T]) {
        unsorted
            .par_iter()
            .enumerate()
            .map(|(k, point)| Key { position: point.position(), index: k as u32 })
            .collect_into_vec(&mut self.keys);
        self.levels = levels(unsorted.len());
        self.planes.clear();
        self.planes.resize((1 << self.levels) - 1, Plane::default());
        let cell = unsorted.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| {
            (min.min(p.position()), max.max(p.position()))
        });
        halve(&mut self.keys, &mut self.planes, cell);
        self.keys
            .par_iter()
            .map(|key| unsorted[key.index as usize])
            .collect_into_vec(&mut self.points);
    }

    /// The points in the order of the leaves.
    pub(super) fn points(&self) -> &[T] {
        &self.points
    }

    /// Bytes held, those needed only while it is built included.
    pub(super) fn memory(&self) -> usize {
        self.planes.capacity() * size_of::<Plane>()
            + self.points.capacity() * size_of::<T>()
            + self.keys.capacity() * size_of::<Key>()
    }

    /// Calls `visit` for every point within the squared distance `radius2` of `p`, with its squared
    /// distance; `visit` returns the squared distance within which it is still interested.
    #[inline]
    pub(super) fn search<'t>(
        &'t self,
        p: Vec3,
        mut radius2: f32,
        mut visit: impl FnMut(&'t T, f32) -> f32,
    ) {
        if self.points.is_empty() {
            return;
        }
        // A subtree: its first plane, its points, its levels, and how far away it is at least.
        let mut stack = [(0_u32, 0_u32, 0_u32, 0_u32, 0.0_f32); DEPTH];
        let mut waiting = 0;
        let mut here = (0_u32, 0_u32, self.points.len() as u32, self.levels, 0.0_f32);
        loop {
            let (plane, first, count, levels, distance2) = here;
            if distance2 <= radius2 {
                if levels > 0 {
                    let Plane { at, axis } = self.planes[plane as usize];
                    let offset = p[axis as usize] - at;
                    let half = count / 2;
                    let left = (plane + 1, first, half, levels - 1, 0.0);
                    let right =
                        (plane + (1 << (levels - 1)), first + half, count - half, levels - 1, 0.0);
                    let (near, mut far) = if offset < 0.0 { (left, right) } else { (right, left) };
                    far.4 = offset * offset;
                    if far.4 <= radius2 {
                        stack[waiting] = far;
                        waiting += 1;
                    }
                    here = near;
                    continue;
                }
                for point in &self.points[first as usize..(first + count) as usize] {
                    let distance2 = point.position().distance_squared(p);
                    if distance2 <= radius2 {
                        radius2 = visit(point, distance2);
                    }
                }
            }
            if waiting == 0 {
                return;
            }
            waiting -= 1;
            here = stack[waiting];
        }
    }
}

/// Levels of planes over this many points.
fn levels(points: usize) -> u32 {
    let leaves = points.div_ceil(LEAF).max(1);
    leaves.next_power_of_two().trailing_zeros()
}

/// Sorts keys into the leaves below `planes`.
fn halve(keys: &mut [Key], planes: &mut [Plane], cell: (Vec3, Vec3)) {
    let Some((plane, below)) = planes.split_first_mut() else { return };
    let size = cell.1 - cell.0;
    let axis = usize::from(size.y > size.x);
    let axis = if size.z > size[axis] { 2 } else { axis };
    let half = keys.len() / 2;
    let order = |a: &Key, b: &Key| {
        a.position[axis].total_cmp(&b.position[axis]).then(a.index.cmp(&b.index))
    };
    let (_, middle, _) = keys.select_nth_unstable_by(half, order);
    let at = middle.position[axis];
    *plane = Plane { at, axis: axis as u32 };
    let (mut left, mut right) = (cell, cell);
    left.1[axis] = at;
    right.0[axis] = at;
    let parallel = keys.len() >= PARALLEL;
    let (left_keys, right_keys) = keys.split_at_mut(half);
    let (left_planes, right_planes) = below.split_at_mut(below.len() / 2);
    let mut go_left = || halve(left_keys, left_planes, left);
    let mut go_right = || halve(right_keys, right_planes, right);
    if parallel {
        rayon::join(go_left, go_right);
    } else {
        go_left();
        go_right();
    }
}
