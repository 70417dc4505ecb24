//! Following photons from the lights until they are absorbed or lost.
//!
//! At each surface the power changes by
//!
//! ```text
//! Φ' = Φ·f*(ω_i → ω_o)·|cos θ_o| / (p·q),
//! ```
//!
//! where it goes on with the probability `q = min(1, max Φ'q/max Φ)`, which keeps the powers even. Two
//! things are different from a path which starts at the camera:
//!
//! - refraction does not scale power by `η²` ([`TransportMode::Importance`]);
//! - where shading and geometric normal differ the BSDF is not symmetric. The adjoint is
//!   `f* = f·(|ω_i·n_s| |ω_o·n_g|) / (|ω_i·n_g| |ω_o·n_s|)` (`scattering.rs`), and a photon left at a surface counts
//!   `|ω_i·n_s|/|ω_i·n_g|`, since photons arrive by the geometric cosine and light is scattered by the
//!   shading one (Veach 1997, *Robust Monte Carlo Methods for Light Transport Simulation*, sections 5.2
//!   and 5.3). The shading normal is here the one of the shape: a bump or normal map turns it further, as finely as
//!   who gathers sees it, and he accounts for that.
//!
//! Photons are left **before** it is decided whether a surface with holes stops them: what is kept is
//! the light which arrives, and who looks at the surface decides about the hole himself. For the same
//! reason they are left wherever the material may be storable, also where another side of a mixture is
//! drawn.

use super::Photon;
use super::scattering::Scattering;
use crate::build::bvh::SurfacePoint;
use crate::build::light::{Aim, EmittedPhoton, Lights, PhotonNumbers, PhotonSource};
use crate::build::nesting::{Meeting, NestedGeometry};
use crate::description::Rgb;
use crate::extract::{NOTHING, ViewCamera};
use crate::math::{Cone, Ray, offset_ray_origin};
use crate::sampling::{Sampler, dimension};
use crate::shade::Bsdf;
use crate::shade::InnerReflections;
use crate::shade::medium::Fate;
use crate::shade::nesting::{Inside, NestingFaults, SolidStack};
use glam::DVec3;
use rayon::prelude::*;
use std::marker::PhantomData;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// Photons which a worker traces in one go.
pub(super) const CHUNK: u32 = 1024;
/// Stands in the place of the pixel for the random numbers of photons; no picture is that wide.
const STREAM: u32 = 1 << 31;

/// Which photons are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// All, from the first surface on.
    All,
    /// All but those which come straight from a light.
    Indirect,
    /// Those which have met specular surfaces only, at least one. They end where they are left.
    Caustics,
}

/// The photons of a pass: everything that decides them but the scene.
#[derive(Clone, Copy, Debug)]
pub struct PhotonPass {
    /// Seed of the render.
    pub seed: u64,
    /// The frame.
    pub frame: u32,
    /// Which pass.
    pub pass: u32,
    /// Photons emitted in each pass. For a power of two each pass is a whole set of the sequence.
    pub emitted: u32,
    /// Time in the shutter, the same for all photons.
    pub time: f32,
}

/// What happened to the photons of a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PhotonCounters {
    /// Photons emitted, those without power included.
    pub emitted: u64,
    /// Photons left at surfaces and in media.
    pub stored: u64,
    /// Rays traced.
    pub rays: u64,
    /// Photons given up at the greatest depth although they still carried something.
    pub truncated: u64,
    /// Where solids were nested in a way that cannot be.
    pub nesting: NestingFaults,
}

impl PhotonCounters {
    /// The sum of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            emitted: self.emitted + other.emitted,
            stored: self.stored + other.stored,
            rays: self.rays + other.rays,
            truncated: self.truncated + other.truncated,
            nesting: self.nesting.plus(other.nesting),
        }
    }
}

/// Photons of one worker's share.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    /// At surfaces.
    pub(super) surfaces: Vec<Photon>,
    /// In media; they have no normal.
    media: Vec<Photon>,
}

#[cfg(test)]
impl Chunk {
    /// Photons at surfaces alone.
    pub(super) fn of_surfaces(photons: &[Photon]) -> Self {
        Self { surfaces: photons.to_vec(), media: Vec::new() }
    }
}

/// The photons of a pass in the order in which they were emitted, a list for each worker's share. The
/// memory is kept from pass to pass.
#[derive(Clone, Debug, Default)]
pub struct PhotonStore {
    pub(super) chunks: Vec<Chunk>,
}

impl PhotonStore {
    /// The photons at surfaces in order.
    pub fn iter(&self) -> impl Iterator<Item = &Photon> {
        self.chunks.iter().flat_map(|chunk| &chunk.surfaces)
    }

    /// The photons in media in order.
    pub fn in_media(&self) -> impl Iterator<Item = &Photon> {
        self.chunks.iter().flat_map(|chunk| &chunk.media)
    }

    /// Adds a photon at a surface at the end.
    pub fn push(&mut self, photon: Photon) {
        self.last().surfaces.push(photon);
    }

    /// Adds a photon in a medium at the end.
    pub fn push_in_medium(&mut self, photon: Photon) {
        self.last().media.push(photon);
    }

    fn last(&mut self) -> &mut Chunk {
        if self.chunks.is_empty() {
            self.chunks.push(Chunk::default());
        }
        self.chunks.last_mut().expect("there is one")
    }

    /// How many are at surfaces.
    pub fn len(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.surfaces.len()).sum()
    }

    /// Whether there are none at surfaces.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        let capacity = |chunk: &Chunk| chunk.surfaces.capacity() + chunk.media.capacity();
        self.chunks.iter().map(capacity).sum::<usize>() * size_of::<Photon>()
    }
}

/// How finely photons see textures: as finely as the camera does at that place.
///
/// The cone of a path which scatters is the wider the fewer its samples are; what it tends to is the cone of its pixel. Photons have
/// that one from the start, over the straight distance to the camera.
#[derive(Clone, Copy, Debug)]
pub struct TextureView<'a> {
    /// What looks.
    pub camera: &'a ViewCamera,
    /// What one of its samples stands for.
    pub pixel: Cone,
}

impl TextureView<'_> {
    /// The ray along which the camera looks at a point, and the cone around it there.
    fn towards(&self, p: DVec3, time: f32) -> (Ray, Cone) {
        let (ray, distance) = self.camera.ray_to(p, time);
        let mut cone = self.pixel;
        cone.advance(distance);
        (ray, cone)
    }
}

/// Traces photons. The generic parameters are those of the path tracer.
#[derive(Clone, Copy)]
pub struct PhotonTracer<'a, const OPACITY: bool, I> {
    /// What photons meet.
    pub scene: NestedGeometry<'a>,
    /// What shines.
    pub lights: Lights<'a>,
    /// From where photons start.
    pub source: &'a PhotonSource,
    /// What they are aimed at.
    pub aim: Option<&'a Aim>,
    /// By material, whether photons are left there.
    pub storable: &'a [bool],
    /// Width α from which a rough surface is storable.
    pub min_alpha: f32,
    /// How finely textures are seen; `None` where they are not filtered.
    pub view: Option<TextureView<'a>>,
    /// Greatest number of surface interactions.
    pub max_depth: u32,
    /// Reflections in a row inside of a solid with bent normals after which a photon is let out.
    pub inner_reflections: u32,
    /// Which photons are kept.
    pub keep: Keep,
    /// What a path must know of the solids around it.
    pub inside: PhantomData<I>,
}

impl<const OPACITY: bool, I: Inside> PhotonTracer<'_, OPACITY, I> {
    /// Traces the photons of a pass into `store`, in parallel; the photons and their order do not
    /// depend on the threads. `None` when `cancel` was set.
    pub fn trace_pass(
        &self,
        pass: &PhotonPass,
        store: &mut PhotonStore,
        cancel: &AtomicBool,
    ) -> Option<PhotonCounters> {
        store.chunks.resize_with(pass.emitted.div_ceil(CHUNK) as usize, Chunk::default);
        let trace_chunk = |(chunk, photons): (u32, &mut Chunk)| {
            photons.surfaces.clear();
            photons.media.clear();
            if cancel.load(Relaxed) {
                return None;
            }
            let mut counters = PhotonCounters::default();
            let first = chunk * CHUNK;
            for index in first..first.saturating_add(CHUNK).min(pass.emitted) {
                self.trace(pass, index, photons, &mut counters);
            }
            counters.stored = (photons.surfaces.len() + photons.media.len()) as u64;
            Some(counters)
        };
        let chunks = store.chunks.par_iter_mut().enumerate().map(|(k, c)| (k as u32, c));
        chunks.map(trace_chunk).try_reduce(PhotonCounters::default, |a, b| Some(a.plus(b)))
    }

    /// Follows one photon.
    fn trace(
        &self,
        pass: &PhotonPass,
        index: u32,
        photons: &mut Chunk,
        counters: &mut PhotonCounters,
    ) {
        counters.emitted += 1;
        let number = u64::from(pass.pass) * u64::from(pass.emitted) + u64::from(index);
        let stream = (STREAM, (number >> 32) as u32);
        let sampler = Sampler::new(pass.seed, pass.frame, stream, number as u32);
        let numbers = PhotonNumbers {
            light: sampler.one_fine(dimension::TIME),
            point: sampler.two(dimension::FILM),
            direction: sampler.two(dimension::LENS),
            aim: sampler.one(dimension::TIME + 1),
        };
        let Some(photon) = self.source.emit(&self.lights, &numbers, pass.time, self.aim) else {
            return;
        };
        let power = photon.power / pass.emitted as f32;
        self.follow(EmittedPhoton { power, ..photon }, &sampler, photons, counters);
    }

    /// Whether a photon is left after so many interactions.
    pub(super) fn keeps(&self, depth: u32, caustic: bool) -> bool {
        match self.keep {
            Keep::All => true,
            Keep::Indirect => depth > 0,
            Keep::Caustics => caustic,
        }
    }

    /// The ray along which the camera would look at a point that a photon has met, and what lies in its cone there.
    fn seen(&self, ray: &Ray, surface: &SurfacePoint) -> (Ray, Cone) {
        match self.view {
            None => (*ray, Cone::default()),
            Some(view) => view.towards(surface.p, ray.time),
        }
    }

    fn follow(
        &self,
        photon: EmittedPhoton,
        sampler: &Sampler,
        photons: &mut Chunk,
        counters: &mut PhotonCounters,
    ) {
        let EmittedPhoton { ray, power } = photon;
        let PhotonTracer { scene: NestedGeometry { geometry, materials, .. }, .. } = *self;
        let inside =
            I::new(&if I::NESTS { self.scene.around(&ray) } else { SolidStack::default() });
        let inner = InnerReflections::new(self.inner_reflections);
        let mut walk = Walk { ray, power, inside, depth: 0, met: 0, only_specular: true, inner };
        loop {
            counters.rays += 1;
            let hit = geometry.closest_hit(&walk.ray, f64::INFINITY, false);
            if I::SCATTERS {
                match self.fly(&mut walk, hit.as_ref(), sampler, &mut photons.media, counters) {
                    Fate::Through => {}
                    Fate::Scattered => continue,
                    Fate::Ended => return,
                }
            }
            let Some(hit) = hit else {
                self.scene.escape(&walk.inside, &mut counters.nesting);
                return;
            };
            if I::ABSORBS && !I::SCATTERS {
                walk.power *= materials.transmittance(walk.inside.medium(), hit.t);
            }
            let meeting = self.scene.meet(&walk.ray, hit, &mut walk.inside, &mut counters.nesting);
            let (hit, mut surface, mut beyond, outside) = match meeting {
                Meeting::Surface { hit, surface, beyond, outside } => {
                    (hit, surface, beyond, outside)
                }
                Meeting::Nothing { surface, beyond } => {
                    walk.ray.o =
                        offset_ray_origin(surface.p, surface.p_error, surface.ng, walk.ray.d);
                    walk.inside = beyond;
                    // The next flight has numbers of its own.
                    walk.met += u32::from(I::SCATTERS);
                    continue;
                }
            };
            let material = geometry.instances[hit.instance as usize].material;
            if material == NOTHING {
                return;
            }
            let dimensions = dimension::vertex(walk.met);
            walk.met += 1;
            let caustic = walk.only_specular && walk.depth > 0;
            if self.keeps(walk.depth, caustic) && self.storable[material as usize] {
                leave(&surface, &walk.ray, walk.power, walk.depth, caustic, &mut photons.surfaces);
            }
            let (seen_along, cone) = self.seen(&walk.ray, &surface);
            let at = geometry.texture_point_in(cone, &seen_along, &hit, &surface);
            let mut roulette = None;
            if OPACITY {
                let u = || sampler.one(dimensions + dimension::ROULETTE);
                let Some(left) = materials.stopped(material, &at, u) else {
                    walk.ray.o =
                        offset_ray_origin(surface.p, surface.p_error, surface.ng, walk.ray.d);
                    continue;
                };
                roulette = left;
            }
            // What is left at a surface has met at most `max_depth` surfaces with that one.
            if walk.depth + 1 >= self.max_depth {
                counters.truncated += 1;
                return;
            }
            let mut lobe = sampler.one(dimensions + dimension::LOBE);
            let chosen = materials.choose(material, &at, &mut lobe);
            let (here, storable) = materials.storable_at(chosen.material, &at, self.min_alpha);
            let (media, sides) = ((material, outside), [&mut walk.inside, &mut beyond]);
            walk.power *= self.scene.disperse(media, sides, sampler, dimension::PHOTON_WAVELENGTH);
            let nm = walk.inside.wavelength();
            let bsdf = materials.chosen_bsdf_tuned(chosen.material, &here, outside, nm);
            if let Some(relief) = chosen.relief {
                let turn = (materials, relief);
                surface.ns = geometry.relief_normal(turn, cone, &seen_along, &hit, &surface, &at);
            }
            if self.keep == Keep::Caustics && matches!(bsdf, Bsdf::Diffuse(_)) {
                return;
            }
            let direction = sampler.two(dimensions + dimension::DIRECTION_AND_LIGHT_POINT);
            let scattering = Scattering::new(surface, chosen.relief.is_some(), -walk.ray.d, bsdf);
            let drawn = scattering.draw(lobe, direction, &mut walk.inner);
            let Some((wi, sample, weight)) = drawn else { return };
            walk.only_specular &= sample.delta || !storable;
            if self.keep == Keep::Caustics && !walk.only_specular {
                return;
            }
            let before = walk.power.max_element();
            walk.power *= weight;
            let survival = (walk.power.max_element() / before).min(1.0);
            let u = roulette.unwrap_or_else(|| sampler.one(dimensions + dimension::ROULETTE));
            if u >= survival || survival.is_nan() {
                return;
            }
            walk.power /= survival;
            walk.depth += 1;
            if scattering.crosses(wi) {
                walk.inside = beyond;
            }
            let surface = &scattering.surface;
            walk.ray.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, wi);
            walk.ray.d = wi;
        }
    }
}

/// A photon on its way.
pub(super) struct Walk<I> {
    pub(super) ray: Ray,
    pub(super) power: Rgb,
    pub(super) inside: I,
    /// Interactions with surfaces and media.
    pub(super) depth: u32,
    /// The same with surfaces which let the photon pass.
    pub(super) met: u32,
    pub(super) only_specular: bool,
    /// Reflections in a row inside of a solid.
    inner: InnerReflections,
}

/// Leaves a photon at a surface.
fn leave(
    surface: &SurfacePoint,
    ray: &Ray,
    power: Rgb,
    depth: u32,
    caustic: bool,
    photons: &mut Vec<Photon>,
) {
    let wi = -ray.d;
    // Where the two normals disagree about the side, camera paths use the geometric one.
    let power = power * (wi.dot(surface.normal_seen_from(wi)) / wi.dot(surface.ng));
    if power.is_finite() && power != Rgb::ZERO {
        let position = surface.p.as_vec3();
        photons.push(Photon::new(position, power, wi, surface.ng, depth, caustic));
    }
}
