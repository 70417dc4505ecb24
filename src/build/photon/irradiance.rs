//! Irradiance which is known beforehand at places among the photons.
//!
//! Every ray of a final gathering asks for the light where it ends: the nearest photons of a number, some
//! sixty of them, and there are hundreds of millions of such rays. The irradiance changes slowly
//! there, and the ray's end is blurred anyway. So it is computed once at *places*, and a ray takes that of the nearest
//! place on the surface it has met (Christensen 1999, "Faster Photon Map Global Illumination", Journal
//! of Graphics Tools 4(3), section 3). On a diffuse surface of albedo `ρ`
//!
//! ```text
//! L = ρ/π·E(nearest place),      E = Σ_p Φ_p·K(|x − x_p|)
//! ```
//!
//! As there, the places are where a share of the photons came to rest: close together where it is
//! bright. Two things are different:
//!
//! - **Photons which make places make no light.** At its own place a photon counts with the full weight of the
//!   kernel, which for sixty photons is some 3 % too much; and where by chance photons are few, places are few, and each
//!   speaks for a large area, which makes the mean over the area too small by about as much. Neither is so if the
//!   photons of the light have nothing to do with the places: the first share of those that were emitted
//!   makes the places, all others make the light, their power divided by their share.
//! - **A place speaks for its own disk alone.** Where none of the places is nearer than the radius of the disk over
//!   which it was computed, who asks has to gather himself: the blur is at most twice as wide as without places.

use super::map::{NORMALS_AGREE, least_radius};
use super::record::{packed_normal, unpacked_normal};
use super::trace::CHUNK;
use super::tree::{Placed, PointTree};
use super::{Photon, PhotonMap, PhotonStore, QueryPoint};
use crate::description::{Kernel, Rgb};
use glam::Vec3;
use rayon::prelude::*;

/// How irradiance is computed at places.
#[derive(Clone, Copy, Debug)]
pub struct PlaceSettings {
    /// One in so many photons makes a place; 0 for none.
    pub one_in: u32,
    /// Photons of an estimate.
    pub nearest: usize,
    /// Greatest radius of an estimate, metres.
    pub largest_radius: f32,
    /// Weight over the disk.
    pub kernel: Kernel,
}

/// The irradiance at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownIrradiance {
    /// Where, in render space.
    position: Vec3,
    /// W·m⁻² per channel, from the side of the normal.
    pub irradiance: Rgb,
    /// Radius of the disk over which it was computed, metres.
    pub radius: f32,
    normal: [i8; 2],
    /// Most surface interactions before the last one of its photons, 255 for more.
    pub deepest: u8,
}

impl Placed for KnownIrradiance {
    #[inline]
    fn position(&self) -> Vec3 {
        self.position
    }
}

/// Places where irradiance is known. The memory is kept from build to build.
#[derive(Clone, Debug, Default)]
pub struct IrradianceMap {
    tree: PointTree<KnownIrradiance>,
    places: Vec<Photon>,
    known: Vec<KnownIrradiance>,
    largest_radius: f32,
}

impl IrradianceMap {
    /// Splits photons into places and light: `photons` becomes the map of the light.
    ///
    /// * `emitted` — how many photons were emitted into `store`.
    pub fn rebuild(
        &mut self,
        store: &PhotonStore,
        emitted: u32,
        photons: &mut PhotonMap,
        settings: &PlaceSettings,
    ) {
        let lists = store.chunks.len();
        let first = match settings.one_in {
            0 => 0,
            // One list at least is left for the light.
            n => lists.div_ceil(n as usize).min(lists.saturating_sub(1)),
        };
        let (places, light) = store.chunks.split_at(first);
        let share = 1.0 - f64::from(CHUNK) * first as f64 / f64::from(emitted.max(1));
        let light = light.iter().flat_map(|chunk| &chunk.surfaces);
        photons.rebuild_weighted(light, (1.0 / share) as f32, |_| true);
        self.places.clear();
        self.places.extend(places.iter().flat_map(|chunk| &chunk.surfaces));
        self.places
            .par_iter()
            .map_init(Vec::new, |distances, place| computed(place, photons, settings, distances))
            .collect_into_vec(&mut self.known);
        self.tree.rebuild(&self.known);
        self.largest_radius = self.known.iter().map(|place| place.radius).fold(0.0, f32::max);
    }

    /// How many places there are.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// Bytes held, those needed only while it is built included.
    pub fn memory(&self) -> usize {
        self.tree.memory()
            + self.places.capacity() * size_of::<Photon>()
            + self.known.capacity() * size_of::<KnownIrradiance>()
    }

    /// The nearest place whose disk reaches the point of `query`, on the same surface and lit from the side to
    /// which the normal of `query` points; of what is farther than its radius nothing is found.
    pub fn nearest(&self, query: &QueryPoint) -> Option<&KnownIrradiance> {
        let radius = query.radius.min(self.largest_radius);
        let mut found = None;
        let mut radius2 = radius * radius;
        self.tree.search(query.position, radius2, |place, distance2| {
            if distance2 <= place.radius * place.radius
                && query.is_level(place.position, place.radius)
                && unpacked_normal(place.normal).dot(query.normal) > NORMALS_AGREE
            {
                found = Some(place);
                radius2 = distance2;
            }
            radius2
        });
        found
    }
}

/// The irradiance where a photon came to rest, on the side from which it came.
fn computed(
    place: &Photon,
    photons: &PhotonMap,
    settings: &PlaceSettings,
    distances: &mut Vec<f32>,
) -> KnownIrradiance {
    let (position, normal) = (place.position, place.normal());
    let facing = if place.wi().dot(normal) < 0.0 { -normal } else { normal };
    let mut query = QueryPoint { position, normal, radius: settings.largest_radius };
    let radius = photons.radius_of(&query, settings.nearest, distances);
    query.radius = radius.max(least_radius(position));
    let radius2 = query.radius * query.radius;
    let (mut irradiance, mut deepest) = (Rgb::ZERO, 0);
    photons.gather(&query, |photon, distance2| {
        if photon.wi().dot(facing) > 0.0 {
            irradiance += photon.power * settings.kernel.weight(distance2, radius2);
            deepest = deepest.max(photon.depth);
        }
    });
    let normal = packed_normal(facing);
    KnownIrradiance { position, irradiance, radius: query.radius, normal, deepest }
}

#[cfg(test)]
mod tests {
    use super::super::trace::Chunk;
    use super::*;
    use crate::sampling::Sampler;

    const EMITTED: u32 = 128 * CHUNK;
    const SETTINGS: PlaceSettings =
        PlaceSettings { one_in: 8, nearest: 60, largest_radius: 0.1, kernel: Kernel::Epanechnikov };

    /// Photons at random over a square of side 2 in the plane z = 0, of one watt together, seen from above; three
    /// in four come from above.
    fn store() -> PhotonStore {
        let photons: Vec<Photon> = (0..EMITTED)
            .map(|k| {
                let s = Sampler::new(11, 0, (k, 0), 0);
                let position = (2.0 * s.two(0) - 1.0).extend(0.0);
                let wi = if s.one(2) < 0.75 { Vec3::Z } else { -Vec3::Z };
                let power = Rgb::splat(1.0 / EMITTED as f32);
                Photon::new(position, power, wi, Vec3::Z, u32::from(wi.z < 0.0) * 7, false)
            })
            .collect();
        PhotonStore { chunks: photons.chunks(CHUNK as usize).map(Chunk::of_surfaces).collect() }
    }

    fn query(k: u32, normal: Vec3) -> QueryPoint {
        // Away from the rim, where disks are cut off.
        let position = (1.6 * Sampler::new(12, 0, (k, 1), 0).two(0) - 0.8).extend(0.0);
        QueryPoint { position, normal, radius: 0.1 }
    }

    /// Oracle: ¾ and ¼ of a watt over 4 m². Some 73,000 of the photons count in the inner square, so that its mean is
    /// known to 0.4 %; a photon that counted at its own place would make it 3 % too much.
    #[test]
    fn the_mean_over_an_area_is_the_flux_over_the_area() {
        let (store, mut photons, mut map) =
            (store(), PhotonMap::default(), IrradianceMap::default());
        map.rebuild(&store, EMITTED, &mut photons, &SETTINGS);
        assert_eq!((map.len(), photons.len()), (16 * CHUNK as usize, 112 * CHUNK as usize));
        for (normal, expected, deepest) in [(Vec3::Z, 0.1875, 0), (-Vec3::Z, 0.0625, 7)] {
            let found: Vec<KnownIrradiance> =
                (0..20_000).filter_map(|k| map.nearest(&query(k, normal)).copied()).collect();
            // On average 60/7 places are within a disk; without any in exp(−60/7·¾), exp(−60/7·¼) of all.
            assert!(found.len() > 17_000, "{}", found.len());
            assert!(found.iter().all(|place| place.deepest == deepest));
            let sum: f64 = found.iter().map(|place| f64::from(place.irradiance.y)).sum();
            let mean = sum / found.len() as f64;
            let sigma = expected * (1.0 / (expected * 4.0 * 73_000.0_f64)).sqrt();
            assert!((mean - expected).abs() < 3.0 * sigma, "{normal}: {mean}, ± {sigma}");
        }
        // What the places would be if their photons made light as well.
        let inner =
            |photon: &&Photon| photon.wi().z > 0.0 && photon.position.abs().max_element() < 0.8;
        let lit: Vec<f64> = store.chunks[16..]
            .iter()
            .flat_map(|chunk| &chunk.surfaces)
            .filter(inner)
            .step_by(4)
            .map(|place| computed(place, &photons, &SETTINGS, &mut Vec::new()))
            .map(|place| f64::from(place.irradiance.y))
            .collect();
        let mean = lit.iter().sum::<f64>() / lit.len() as f64;
        assert!(mean > 1.02 * 0.1875, "{mean}");
    }

    /// A place speaks for its own surface and its own disk.
    #[test]
    fn other_surfaces_and_far_points_find_nothing() {
        let (store, mut photons, mut map) =
            (store(), PhotonMap::default(), IrradianceMap::default());
        map.rebuild(&store, EMITTED, &mut photons, &SETTINGS);
        let near = query(0, Vec3::Z);
        assert!(map.nearest(&near).is_some());
        for elsewhere in [
            QueryPoint { position: near.position + 0.05 * Vec3::Z, ..near },
            QueryPoint { normal: Vec3::X, ..near },
            QueryPoint { position: Vec3::new(1.1, 0.0, 0.0), ..near },
        ] {
            assert_eq!(map.nearest(&elsewhere), None, "{elsewhere:?}");
        }
        // No places are asked for, or there is one list of photons alone: all of them make light.
        map.rebuild(&store, EMITTED, &mut photons, &PlaceSettings { one_in: 0, ..SETTINGS });
        assert_eq!((map.len(), photons.len()), (0, EMITTED as usize));
        let single = PhotonStore { chunks: store.chunks[..1].to_vec() };
        map.rebuild(&single, CHUNK, &mut photons, &SETTINGS);
        assert_eq!((map.len(), photons.len()), (0, CHUNK as usize));
    }
}
