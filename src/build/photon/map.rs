//! A balanced k-d tree over photons, in flat arrays.
//!
//! Photons are halved along the longest side of their cell until [`LEAF`] or fewer are left. All leaves
//! have the same depth, so that the tree is an array of splitting planes in pre-order (a subtree of
//! `k` levels has `2ᵏ − 1` of them) and the photons of each leaf are neighbours in memory: there are no
//! pointers, and a leaf's place follows from the number of photons alone. However the photons are spread, also all in one
//! place, the depth is the logarithm of their number. The decision note `photon-map.md` has the
//! measurement against a hash grid.
//!
//! Equal coordinates are told apart by the order of emission, so that the tree, and with it the order in
//! which photons are summed, is the same for any number of threads.
//!
//! Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, chapter 6; there the tree is
//! left-balanced with a photon in each node. Leaves of several photons halve its depth.

use super::{Photon, PhotonStore};
use glam::Vec3;
use rayon::prelude::*;

/// Most photons in a leaf: about four cache lines are read for a plane that was looked at.
const LEAF: usize = 8;
/// From this many photons on both halves are built in parallel.
const PARALLEL: usize = 4096;
/// Levels that 2³² photons need.
const DEPTH: usize = 32;
/// Half the thickness of the disk in which photons count, as a share of its radius: photons off
/// the surface lie on other surfaces. A sphere leaves its tangent plane by `d²/2r` at distance `d`,
/// so that nothing is lost on surfaces with a radius of curvature of five gather radii or more.
const DISK_HALF_THICKNESS: f32 = 0.1;
/// Least cosine between the normals at the photon and at the point.
const NORMALS_AGREE: f32 = 0.9;

/// A plane which halves a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Plane {
    /// Its coordinate on the axis.
    at: f32,
    axis: u32,
}

/// A photon's place, and its place in the order of emission.
#[derive(Clone, Copy, Debug)]
struct Key {
    position: Vec3,
    index: u32,
}

/// Photons which can be found by place. The memory is kept from build to build.
#[derive(Clone, Debug, Default)]
pub struct PhotonMap {
    planes: Vec<Plane>,
    levels: u32,
    /// In the order of the leaves.
    photons: Vec<Photon>,
    keys: Vec<Key>,
    unsorted: Vec<Photon>,
}

/// Where photons are looked for: a flat disk on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryPoint {
    /// The centre, in render space.
    pub position: Vec3,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Radius, metres.
    pub radius: f32,
}

impl QueryPoint {
    /// Whether a photon at this squared distance lies on the disk.
    #[inline]
    fn holds(&self, photon: &Photon) -> bool {
        let height = (photon.position - self.position).dot(self.normal);
        height.abs() <= DISK_HALF_THICKNESS * self.radius
            && photon.normal().dot(self.normal) > NORMALS_AGREE
    }
}

impl PhotonMap {
    /// Builds the map anew over those photons of `store` which `keep` chooses.
    pub fn rebuild(&mut self, store: &PhotonStore, keep: impl Fn(&Photon) -> bool) {
        self.unsorted.clear();
        for chunk in &store.chunks {
            self.unsorted.extend(chunk.iter().filter(|photon| keep(photon)));
        }
        let unsorted = &self.unsorted;
        unsorted
            .par_iter()
            .enumerate()
            .map(|(k, photon)| Key { position: photon.position, index: k as u32 })
            .collect_into_vec(&mut self.keys);
        self.levels = levels(unsorted.len());
        self.planes.clear();
        self.planes.resize((1 << self.levels) - 1, Plane::default());
        let cell = unsorted.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| {
            (min.min(p.position), max.max(p.position))
        });
        halve(&mut self.keys, &mut self.planes, cell);
        self.keys
            .par_iter()
            .map(|key| unsorted[key.index as usize])
            .collect_into_vec(&mut self.photons);
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Bytes held, those needed only while it is built included.
    pub fn memory(&self) -> usize {
        self.planes.capacity() * size_of::<Plane>()
            + (self.photons.capacity() + self.unsorted.capacity()) * size_of::<Photon>()
            + self.keys.capacity() * size_of::<Key>()
    }

    /// Calls `visit` for every photon within the squared distance `radius2` of `p`, with its squared
    /// distance; `visit` returns the squared distance within which it is still interested.
    #[inline]
    fn search(&self, p: Vec3, mut radius2: f32, mut visit: impl FnMut(&Photon, f32) -> f32) {
        if self.photons.is_empty() {
            return;
        }
        // A subtree: its first plane, its photons, its levels, and how far away it is at least.
        let mut stack = [(0_u32, 0_u32, 0_u32, 0_u32, 0.0_f32); DEPTH];
        let mut waiting = 0;
        let mut here = (0_u32, 0_u32, self.photons.len() as u32, self.levels, 0.0_f32);
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
                for photon in &self.photons[first as usize..(first + count) as usize] {
                    let distance2 = photon.position.distance_squared(p);
                    if distance2 <= radius2 {
                        radius2 = visit(photon, distance2);
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

    /// Calls `visit` for every photon on the disk, with its squared distance from the centre.
    #[inline]
    pub fn gather(&self, query: &QueryPoint, mut visit: impl FnMut(&Photon, f32)) {
        let radius2 = query.radius * query.radius;
        self.search(query.position, radius2, |photon, distance2| {
            if query.holds(photon) {
                visit(photon, distance2);
            }
            radius2
        });
    }

    /// The radius of the disk around the point of `query` which holds just `count` photons, at most that
    /// of `query`. `distances` is scratch memory.
    pub fn radius_of(&self, query: &QueryPoint, count: usize, distances: &mut Vec<f32>) -> f32 {
        distances.clear();
        let mut radius2 = query.radius * query.radius;
        self.search(query.position, radius2, |photon, distance2| {
            if query.holds(photon) {
                let at = distances.partition_point(|d| *d <= distance2);
                distances.insert(at, distance2);
                distances.truncate(count);
                if distances.len() == count {
                    radius2 = distances[count - 1];
                }
            }
            radius2
        });
        radius2.sqrt()
    }
}

/// Levels of planes over this many photons.
fn levels(photons: usize) -> u32 {
    let leaves = photons.div_ceil(LEAF).max(1);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Rgb;
    use crate::sampling::Sampler;

    fn store(positions: impl Iterator<Item = Vec3>) -> PhotonStore {
        let photons: Vec<Photon> = positions
            .enumerate()
            .map(|(k, p)| Photon::new(p, Rgb::splat(k as f32), Vec3::Z, Vec3::Z, 1, k % 3 == 0))
            .collect();
        // in lists of uneven length, as the workers leave them
        PhotonStore { chunks: photons.chunks(700).map(<[Photon]>::to_vec).collect() }
    }

    fn cloud(n: u32) -> impl Iterator<Item = Vec3> {
        (0..n).map(|k| {
            let s = Sampler::new(6, 0, (0, 0), k);
            let p = s.two(0).extend(s.one(2));
            // every tenth photon in one place, a third in a narrow beam
            match k % 30 {
                0..3 => Vec3::splat(0.25),
                3..13 => Vec3::new(0.5 + 1e-5 * p.x, 0.5, p.z),
                _ => p,
            }
        })
    }

    fn found(map: &PhotonMap, p: Vec3, r: f32) -> Vec<u32> {
        let mut ids = Vec::new();
        map.search(p, r * r, |photon, _| {
            ids.push(photon.power.x as u32);
            r * r
        });
        ids.sort_unstable();
        ids
    }

    /// Oracle: brute force over all photons, duplicates and the rims of cells included.
    #[test]
    fn queries_equal_brute_force() {
        for n in [0, 1, 7, 8, 9, 64, 65, 1000, 100_000] {
            let photons = store(cloud(n));
            let mut map = PhotonMap::default();
            map.rebuild(&photons, |_| true);
            assert_eq!(map.len(), n as usize);
            for k in 0..50 {
                let s = Sampler::new(9, 0, (1, 0), k);
                let p = if k == 0 { Vec3::splat(0.25) } else { s.two(0).extend(s.one(2)) };
                let r = 0.3 * s.one(3).powi(3);
                let brute: Vec<u32> = photons
                    .iter()
                    .filter(|photon| photon.position.distance_squared(p) <= r * r)
                    .map(|photon| photon.power.x as u32)
                    .collect();
                assert_eq!(found(&map, p, r), brute, "{n} photons, query {k}");
            }
        }
    }

    /// Oracle: the sorted distances of all photons.
    #[test]
    fn the_radius_of_the_nearest_equals_brute_force() {
        let photons = store(cloud(20_000));
        let mut map = PhotonMap::default();
        map.rebuild(&photons, |photon| photon.caustic);
        let mut scratch = Vec::new();
        for k in 0..50 {
            let s = Sampler::new(9, 0, (2, 0), k);
            let position = s.two(0).extend(s.one(2));
            // Flat disks hold a slab of the cloud: the radius of the query decides its thickness.
            let query = QueryPoint { position, normal: Vec3::Z, radius: 0.4 };
            let mut brute: Vec<f32> = photons
                .iter()
                .filter(|p| p.caustic && query.holds(p))
                .map(|p| p.position.distance(position))
                .filter(|d| *d <= 0.4)
                .collect();
            brute.sort_by(f32::total_cmp);
            let expected = brute.get(39).copied().unwrap_or(0.4);
            let radius = map.radius_of(&query, 40, &mut scratch);
            assert!((radius - expected).abs() <= 1e-6, "query {k}: {radius}, {expected}");
        }
    }

    /// Ten builds take the memory of the largest, and the same photons make the same tree.
    #[test]
    fn memory_is_kept_and_the_tree_depends_on_the_photons_alone() {
        let (large, small) = (store(cloud(30_000)), store(cloud(500)));
        let mut map = PhotonMap::default();
        map.rebuild(&large, |_| true);
        let memory = map.memory();
        assert!(memory <= 30_000 * (2 * 32 + 16 + 8), "{memory}");
        for _ in 0..10 {
            map.rebuild(&small, |_| true);
            map.rebuild(&large, |_| true);
        }
        assert_eq!(map.memory(), memory);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let mut alone = PhotonMap::default();
        one.install(|| alone.rebuild(&large, |_| true));
        assert_eq!((alone.planes, alone.photons), (map.planes, map.photons));
    }
}
