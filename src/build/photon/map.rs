//! Photons which are found again by place: on a disk, or the nearest of a number.

use super::tree::{Placed, PointTree};
use super::{Photon, PhotonStore};
use glam::Vec3;

/// Half the thickness of the disk in which photons count, as a share of its radius: photons off
/// the surface lie on other surfaces. A sphere leaves its tangent plane by `d²/2r` at distance `d`,
/// so that nothing is lost on surfaces with a radius of curvature of five gather radii or more.
const DISK_HALF_THICKNESS: f32 = 0.1;
/// Least cosine between the normals at the photon and at the point.
pub(super) const NORMALS_AGREE: f32 = 0.9;

/// Units in the last place of a position below which a disk cannot be resolved.
const LEAST_RADIUS_ULPS: f32 = 32.0;

/// The radius, metres, below which a disk at this point cannot be resolved.
#[inline]
pub fn least_radius(position: Vec3) -> f32 {
    LEAST_RADIUS_ULPS * position.abs().max_element() * f32::EPSILON
}

/// Photons which can be found by place. The memory is kept from build to build.
#[derive(Clone, Debug, Default)]
pub struct PhotonMap {
    tree: PointTree<Photon>,
    unsorted: Vec<Photon>,
}

impl Placed for Photon {
    #[inline]
    fn position(&self) -> Vec3 {
        self.position
    }
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
        self.is_level(photon.position, self.radius)
            && photon.normal().dot(self.normal) > NORMALS_AGREE
    }

    /// Whether a point lies within the thickness of a disk of this radius.
    #[inline]
    pub(super) fn is_level(&self, p: Vec3, radius: f32) -> bool {
        (p - self.position).dot(self.normal).abs() <= DISK_HALF_THICKNESS * radius
    }
}

impl PhotonMap {
    /// Builds the map anew over those photons of `store` which `keep` chooses.
    pub fn rebuild(&mut self, store: &PhotonStore, keep: impl Fn(&Photon) -> bool) {
        self.rebuild_weighted(store.iter(), 1.0, keep);
    }

    /// Builds the map anew over those photons which `keep` chooses, their power multiplied by `weight`.
    pub(super) fn rebuild_weighted<'p>(
        &mut self,
        photons: impl Iterator<Item = &'p Photon>,
        weight: f32,
        keep: impl Fn(&Photon) -> bool,
    ) {
        self.unsorted.clear();
        for photon in photons.filter(|photon| keep(photon)) {
            let mut photon = *photon;
            photon.power *= weight;
            self.unsorted.push(photon);
        }
        self.tree.rebuild(&self.unsorted);
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.tree.points().len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.tree.points().is_empty()
    }

    /// Bytes held, those needed only while it is built included.
    pub fn memory(&self) -> usize {
        self.tree.memory() + self.unsorted.capacity() * size_of::<Photon>()
    }

    /// Calls `visit` for every photon on the disk, with its squared distance from the centre.
    #[inline]
    pub fn gather(&self, query: &QueryPoint, mut visit: impl FnMut(&Photon, f32)) {
        let radius2 = query.radius * query.radius;
        self.tree.search(query.position, radius2, |photon, distance2| {
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
        self.tree.search(query.position, radius2, |photon, distance2| {
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

#[cfg(test)]
mod tests {
    use super::super::trace::Chunk;
    use super::*;
    use crate::description::Rgb;
    use crate::sampling::Sampler;

    fn store(positions: impl Iterator<Item = Vec3>) -> PhotonStore {
        let photons: Vec<Photon> = positions
            .enumerate()
            .map(|(k, p)| Photon::new(p, Rgb::splat(k as f32), Vec3::Z, Vec3::Z, 1, k % 3 == 0))
            .collect();
        // in lists of uneven length, as the workers leave them
        PhotonStore { chunks: photons.chunks(700).map(Chunk::of_surfaces).collect() }
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
        map.tree.search(p, r * r, |photon, _| {
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
        assert_eq!(alone.tree.planes, map.tree.planes);
        assert_eq!(alone.tree.points(), map.tree.points());
    }
}
