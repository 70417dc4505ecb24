//! Frames with photons: passes of photons first, then of camera paths.
//!
//! ```text
//! for each pass: trace photons ── build the maps ── one camera path per pixel, tiles in parallel
//! ```
//!
//! All of a pass, photons, lights and camera paths, happens at one time of the shutter, stratified over
//! the passes: a photon always belongs to the surface where it is gathered. `PhotonMap` needs its photons once,
//! for a scene in motion once for each of a few times.
//!
//! Every pass is a sample of each pixel (see `radius.rs` for why that is right), so that the film, its
//! variance and the record of the frame are the same as of any other integrator.

use super::eye::{EyeTracer, FirstDisk, Gathered, Maps, SampleKey};
use super::film_pass::{Around, Begin, IntegrateStatus, Job};
use super::layers::fill_centres;
use super::radius::{PixelRadius, shrunk_by_passes};
use super::scene_view::{SceneTables, SceneView};
use super::{PathCounters, PathTracer};
use crate::build::light::{Aim, PhotonSource};
use crate::build::photon::{
    IrradianceMap, Keep, Photon, PhotonCounters, PhotonMap, PhotonPass, PhotonStore, PhotonTracer,
    PlaceSettings, TextureView, VolumeMap, VolumeRadius,
};
use crate::color::spectrum::SETS;
use crate::description::DirectLight;
use crate::extract::{ChosenIntegrator, Feature, FrameOrigin, Method, NOTHING};
use crate::film::{Film, FilmError, Tile, TileBuffer};
use crate::frame::RenderControl;
use crate::math::Cone;
use crate::memory::{Shortage, ask};
use crate::sampling::{Sampler, dimension};
use crate::shade::nesting::{Clear, Inside, NestingFaults, OneSolid, SolidStack, Whole};
use crate::world::{FrameClock, Settings};
use bevy_ecs::prelude::*;
use glam::{DVec2, Vec2};
use rayon::prelude::*;
use serde::Serialize;
use std::marker::PhantomData;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;

/// Times of the shutter for which `PhotonMap` traces photons when something moves: as many as a
/// stroboscope needs to look like a blur.
const MAP_TIMES: u32 = 16;
/// Photons which are traced to see how many will be kept.
const PILOT: u32 = 2048;
/// Stands in the place of the pixel for the time of a pass; no picture is that wide.
const PASS_TIMES: (u32, u32) = (1 << 31, u32::MAX);

/// Photons and maps, kept from frame to frame for their memory alone.
#[derive(Resource, Debug, Default)]
pub struct PhotonScratch {
    store: PhotonStore,
    global: PhotonMap,
    caustics: PhotonMap,
    irradiance: IrradianceMap,
    volume: VolumeMap,
    volume_caustics: VolumeMap,
    faults: NestingFaults,
}

impl PhotonScratch {
    /// Bytes of photons and maps.
    fn memory(&self) -> u64 {
        let maps = self.global.memory() + self.caustics.memory() + self.irradiance.memory();
        let volumes = self.volume.memory() + self.volume_caustics.memory();
        (self.store.memory() + maps + volumes) as u64
    }
}

/// What the photons of a frame came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PhotonReport {
    /// Photons emitted in each pass.
    pub per_pass: u32,
    /// Photons emitted in all.
    pub emitted: u64,
    /// Photons left at surfaces and in media in all.
    pub stored: u64,
    /// Most photons at once in the map of everything.
    pub global: u64,
    /// Most photons at once in the map of caustics.
    pub caustics: u64,
    /// Smallest and greatest radius over which photons were gathered, metres.
    pub radii: (f32, f32),
    /// Disks which could not shrink further, since positions have no more digits.
    pub unresolved: u64,
    /// Most memory of photons and maps, bytes.
    pub memory_bytes: u64,
    /// Memory that was expected before the first pass, bytes.
    pub forecast_bytes: u64,
    /// Seconds of tracing photons.
    pub trace_seconds: f64,
    /// Seconds of building maps.
    pub build_seconds: f64,
    /// Seconds of camera paths.
    pub gather_seconds: f64,
}

impl PhotonReport {
    /// That of two frames together: sums, and the greatest of what is held at once.
    #[must_use]
    pub fn plus(self, other: &Self) -> Self {
        Self {
            per_pass: self.per_pass.max(other.per_pass),
            emitted: self.emitted + other.emitted,
            stored: self.stored + other.stored,
            global: self.global.max(other.global),
            caustics: self.caustics.max(other.caustics),
            radii: (self.radii.0.min(other.radii.0), self.radii.1.max(other.radii.1)),
            unresolved: self.unresolved + other.unresolved,
            memory_bytes: self.memory_bytes.max(other.memory_bytes),
            forecast_bytes: self.forecast_bytes.max(other.forecast_bytes),
            trace_seconds: self.trace_seconds + other.trace_seconds,
            build_seconds: self.build_seconds + other.build_seconds,
            gather_seconds: self.gather_seconds + other.gather_seconds,
        }
    }
}

/// A tile over all passes.
struct TileState {
    /// What of it is rendered.
    pixels: Tile,
    buffer: TileBuffer,
    radii: Vec<PixelRadius>,
    counters: PathCounters,
    gathered: Gathered,
}

/// Fills the film of this frame by a method with photons.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the picture depends on")]
pub fn render_film_with_photons(
    tables: SceneTables,
    settings: Res<Settings>,
    clock: Res<FrameClock>,
    origin: Res<FrameOrigin>,
    control: Res<RenderControl>,
    chosen: Res<ChosenIntegrator>,
    source: Res<PhotonSource>,
    mut scratch: ResMut<PhotonScratch>,
    mut status: ResMut<IntegrateStatus>,
) {
    let settings = &settings.0;
    let Some(mut film) = status.begin(settings, &control, chosen.method) else { return };
    let scene = tables.view();
    let job = Job::new(settings, &scene, clock.frame.cast_unsigned(), &control);
    let begin = Begin { scene, settings, origin: &origin, seen: film.wants_seen() };
    let setting = Setting::new(&scene, &job, chosen.method, &source, begin.pixel());
    let scratch = &mut *scratch;
    let opaque = !scene.requirements.has(Feature::Opacity);
    let film_mut = &mut film;
    let done = match (opaque, Around::new(scene.requirements)) {
        (true, Around::Clear) => setting.fill(film_mut, begin.tracer::<false, Clear>(), scratch),
        (true, Around::One) => setting.fill(film_mut, begin.tracer::<false, OneSolid>(), scratch),
        (true, Around::Nested) => {
            setting.fill(film_mut, begin.tracer::<false, SolidStack>(), scratch)
        }
        (true, Around::Whole) => setting.fill(film_mut, begin.tracer::<false, Whole>(), scratch),
        (false, Around::Clear) => setting.fill(film_mut, begin.tracer::<true, Clear>(), scratch),
        (false, Around::One) => setting.fill(film_mut, begin.tracer::<true, OneSolid>(), scratch),
        (false, Around::Nested) => {
            setting.fill(film_mut, begin.tracer::<true, SolidStack>(), scratch)
        }
        (false, Around::Whole) => setting.fill(film_mut, begin.tracer::<true, Whole>(), scratch),
    };
    let done = match done {
        Ok(done) => done,
        Err(shortage) => {
            status.error = Some(FilmError::Photons(shortage));
            None
        }
    };
    if let Some((counters, report)) = done {
        status.film = Some(film);
        status.counters = counters;
        status.warnings = warnings(&report, &setting);
        status.photons = Some(report);
    }
}

fn warnings(report: &PhotonReport, setting: &Setting) -> Vec<String> {
    let mut warnings = Vec::new();
    if report.stored == 0 && setting.has_light() && setting.wants_photons() {
        warnings.push(format!(
            "none of {} photons came to rest: less than {:.1e} of the flux (at 95 %) does, or nothing \
             diffuse is there",
            report.emitted,
            3.0 / report.emitted.max(1) as f64
        ));
    }
    let asked = setting.asked();
    if report.per_pass < asked {
        warnings.push(format!(
            "each pass has {} photons and not {asked}: more would not fit into `photons.max_memory`, {} MiB",
            report.per_pass, setting.job.settings.photons.max_memory
        ));
    }
    if report.unresolved > 0 {
        warnings.push(format!(
            "{} gather disks stopped shrinking: 32-bit positions have no more digits there",
            report.unresolved
        ));
    }
    warnings
}

/// What stays the same over the passes.
struct Setting<'a> {
    scene: SceneView<'a>,
    job: &'a Job<'a>,
    method: Method,
    source: &'a PhotonSource,
    storable: Vec<bool>,
    /// Around what casts caustics; `None` where photons cannot be aimed.
    aim: Option<Aim>,
    casts: bool,
    /// What a camera sample stands for; a ray where no texture is filtered.
    pixel: Cone,
}

impl<'a> Setting<'a> {
    fn new(
        scene: &SceneView<'a>,
        job: &'a Job<'a>,
        method: Method,
        source: &'a PhotonSource,
        pixel: Cone,
    ) -> Self {
        let materials = &scene.surfaces.materials;
        let min_alpha = job.settings.photons.min_alpha();
        let storable =
            (0..materials.len() as u32).map(|m| materials.may_be_storable(m, min_alpha)).collect();
        let casters: Vec<_> = scene
            .geometry
            .instances
            .iter()
            .filter(|i| i.material != NOTHING && !materials.is_invisible(i.material, None))
            .filter(|i| materials.may_cast_caustics(i.material, min_alpha))
            .map(|i| i.bounds)
            .collect();
        let aim = Aim::new(&casters);
        let casts = !casters.is_empty();
        Self { scene: *scene, job, method, source, storable, aim, casts, pixel }
    }

    fn has_light(&self) -> bool {
        self.source.flux > 0.0
    }

    /// Whether any photon could be gathered.
    fn wants_photons(&self) -> bool {
        let scatters = self.scene.requirements.has(Feature::Scattering);
        (self.method != Method::PathWithPhotons || self.casts)
            && (scatters || self.storable.contains(&true))
    }

    fn tracer<const O: bool, I: Inside>(&self, keep: Keep, pass: u32) -> PhotonTracer<'_, O, I> {
        let scene = self.seen_in(pass);
        PhotonTracer {
            scene: scene.nested(),
            lights: scene.lights,
            source: self.source,
            aim: self.aim.as_ref().filter(|_| keep == Keep::Caustics),
            storable: &self.storable,
            min_alpha: self.job.settings.photons.min_alpha(),
            view: (!self.pixel.is_ray())
                .then_some(TextureView { camera: scene.camera, pixel: self.pixel }),
            max_depth: self.job.settings.max_depth,
            inner_reflections: self.job.settings.inner_reflections,
            keep,
            inside: PhantomData,
        }
    }

    /// The scene as photons and paths of a pass see it: in a spectral scene at the same wavelengths.
    fn seen_in(&self, pass: u32) -> SceneView<'a> {
        self.scene.of_sample(pass)
    }

    /// What is kept in the map of everything.
    fn global_keep(&self) -> Option<Keep> {
        match self.method {
            Method::Sppm if self.job.settings.photons.direct == DirectLight::Photons => {
                Some(Keep::All)
            }
            Method::PhotonMap if self.job.settings.final_gather > 0 => Some(Keep::All),
            Method::Sppm | Method::PhotonMap => Some(Keep::Indirect),
            Method::Path | Method::PathWithPhotons => None,
        }
    }

    fn has_caustic_map(&self) -> bool {
        self.casts && self.method != Method::Sppm
    }

    /// How many photons a pass is to emit.
    fn asked(&self) -> u32 {
        let settings = self.job.settings;
        let aimed = self.method == Method::PathWithPhotons && self.aim.is_some();
        settings.photons.emitted(settings.size, aimed)
    }

    /// How many photons a pass emits: as many as asked for, unless the memory does not suffice.
    fn plan<const O: bool, I: Inside>(&self, scratch: &mut PhotonScratch) -> PhotonReport {
        let settings = self.job.settings;
        let asked = self.asked();
        let pilot =
            PhotonPass { emitted: PILOT.min(asked), ..self.photon_pass(u32::MAX, asked, 0.5) };
        let keeps = [self.global_keep(), self.has_caustic_map().then_some(Keep::Caustics)];
        let mut kept: u64 = 0;
        for keep in keeps.into_iter().flatten() {
            let tracer = self.tracer::<O, I>(keep, 0);
            let counters = tracer.trace_pass(&pilot, &mut scratch.store, &self.job.control.cancel);
            kept += counters.map_or(0, |counters| counters.stored);
        }
        // In the list, in the order of the map before and after, and as a key of 16 bytes.
        let bytes_each = 3 * size_of::<Photon>() as u64 + 16;
        let forecast =
            |emitted: u32| kept * u64::from(emitted) / u64::from(pilot.emitted) * bytes_each;
        let limit = u64::from(settings.photons.max_memory) << 20;
        let mut emitted = asked;
        while forecast(emitted) > limit && emitted > PILOT {
            // A power of two keeps each pass a whole set of the sequence.
            emitted = (emitted / 2 + 1).next_power_of_two().min(emitted - 1);
        }
        PhotonReport {
            per_pass: emitted,
            radii: (f32::INFINITY, 0.0),
            forecast_bytes: forecast(emitted),
            ..PhotonReport::default()
        }
    }

    fn photon_pass(&self, pass: u32, emitted: u32, time: f32) -> PhotonPass {
        let Job { settings, frame, .. } = self.job;
        // What is read from the same photons over a whole frame has their noise in it, as blotches which no
        // average over the frame's samples takes out. They stay where they are from frame to frame, and
        // change only where something does.
        let frame = if self.method == Method::PhotonMap { 0 } else { *frame };
        PhotonPass { seed: settings.seed, frame, pass, emitted, time }
    }

    /// The time of a pass.
    fn time(&self, pass: u32) -> f32 {
        if !self.job.has_time {
            return 0.0;
        }
        let seed = self.job.settings.seed;
        Sampler::new(seed, self.job.frame, PASS_TIMES, pass).one(dimension::TIME)
    }

    /// Traces the photons of a pass and builds its maps.
    fn prepare<const O: bool, I: Inside>(
        &self,
        pass: &PhotonPass,
        scratch: &mut PhotonScratch,
        report: &mut PhotonReport,
    ) -> Option<()> {
        let cancel = &self.job.control.cancel;
        let PhotonScratch { store, global, caustics, irradiance, volume, volume_caustics, faults } =
            scratch;
        let scatters = self.scene.requirements.has(Feature::Scattering);
        let disks = self.volume_radius(pass.pass);
        let mut take = |keep: Keep, build: &mut dyn FnMut(&PhotonStore)| {
            let start = Instant::now();
            let counters: PhotonCounters =
                self.tracer::<O, I>(keep, pass.pass).trace_pass(pass, store, cancel)?;
            let traced = Instant::now();
            build(store);
            report.trace_seconds += (traced - start).as_secs_f64();
            report.build_seconds += traced.elapsed().as_secs_f64();
            report.emitted += counters.emitted;
            *faults = faults.plus(counters.nesting);
            report.stored += counters.stored;
            self.job.control.rays.fetch_add(counters.rays, Relaxed);
            Some(())
        };
        if let Some(keep) = self.global_keep() {
            // Without a final gathering the caustics are read from their own map.
            let apart = self.method == Method::PhotonMap && keep == Keep::Indirect;
            take(keep, &mut |store| {
                match self.places() {
                    Some(places) => irradiance.rebuild(store, pass.emitted, global, &places),
                    None => global.rebuild(store, |photon| !(apart && photon.caustic)),
                }
                if scatters {
                    volume.rebuild(store, &disks);
                }
            })?;
            report.global = report.global.max(global.len() as u64);
        }
        if self.has_caustic_map() {
            take(Keep::Caustics, &mut |store| {
                caustics.rebuild(store, |_| true);
                if scatters {
                    volume_caustics.rebuild(store, &disks);
                }
            })?;
            report.caustics = report.caustics.max(caustics.len() as u64);
        }
        report.memory_bytes = report.memory_bytes.max(scratch.memory());
        Some(())
    }

    /// How irradiance is computed beforehand, if it is.
    fn places(&self) -> Option<PlaceSettings> {
        let settings = self.job.settings;
        let gathers = self.method == Method::PhotonMap && settings.final_gather > 0;
        gathers.then(|| PlaceSettings {
            one_in: settings.photons.places,
            nearest: settings.photons.nearest as usize,
            largest_radius: self.largest_radius(),
            kernel: settings.photons.kernel,
        })
    }

    /// Renders all passes; `None` when the control cancelled it.
    fn fill<const O: bool, I: Inside>(
        &self,
        film: &mut Film,
        path: PathTracer<'a, O, I>,
        scratch: &mut PhotonScratch,
    ) -> Result<Option<(PathCounters, PhotonReport)>, Shortage> {
        scratch.faults = NestingFaults::default();
        let centres = fill_centres(film, &path);
        self.job.control.rays.fetch_add(centres, Relaxed);
        let report = self.plan::<O, I>(scratch);
        // What is held from the frame before is used again.
        ask(report.forecast_bytes.saturating_sub(scratch.memory()))?;
        Ok(self.passes(film, path, scratch, report))
    }

    /// The passes of a frame; `None` when the control cancelled them.
    fn passes<const O: bool, I: Inside>(
        &self,
        film: &mut Film,
        path: PathTracer<'a, O, I>,
        scratch: &mut PhotonScratch,
        mut report: PhotonReport,
    ) -> Option<(PathCounters, PhotonReport)> {
        let mut tiles: Vec<TileState> =
            film.tiles().into_iter().map(|tile| TileState::new(film, tile)).collect();
        let samples = self.job.settings.samples;
        // `PhotonMap` takes its photons once for each time, and for each set of wavelengths.
        let spectral = !self.scene.spectra.is_empty();
        let (groups, each) = match self.method {
            Method::PhotonMap if self.job.has_time || spectral => {
                let groups = samples.min(if spectral { SETS } else { MAP_TIMES });
                (groups, samples.div_ceil(groups))
            }
            Method::PhotonMap => (1, samples),
            _ => (samples, 1),
        };
        for group in 0..groups {
            let time = self.time(group);
            let pass = self.photon_pass(group, report.per_pass, time);
            self.prepare::<O, I>(&pass, scratch, &mut report)?;
            let start = Instant::now();
            let path = PathTracer { scene: self.seen_in(group), ..path };
            let tracer = self.eye(path, scratch, time);
            let passes = group * each..(group * each + each).min(samples);
            tiles.par_iter_mut().try_for_each(|tile| {
                passes.clone().try_for_each(|pass| tile.add_pass(&tracer, self, pass, time))
            })?;
            report.gather_seconds += start.elapsed().as_secs_f64();
        }
        let mut counters = PathCounters { nesting: scratch.faults, ..PathCounters::default() };
        for tile in tiles {
            counters = counters.plus(tile.counters);
            let Gathered { radii, unresolved, .. } = tile.gathered;
            report.radii = (report.radii.0.min(radii.0), report.radii.1.max(radii.1));
            report.unresolved += u64::from(unresolved);
            film.merge(tile.buffer);
        }
        if report.radii.1 == 0.0 {
            report.radii.0 = 0.0;
        }
        counters.rays = self.job.control.rays.load(Relaxed);
        Some((counters, report))
    }

    fn eye<'b, const O: bool, I: Inside>(
        &'b self,
        path: PathTracer<'b, O, I>,
        scratch: &'b PhotonScratch,
        time: f32,
    ) -> EyeTracer<'b, O, I> {
        let settings = self.job.settings;
        let (side, growth) = self.scene.camera.pixel_size(time);
        EyeTracer {
            path,
            method: self.method,
            settings: &settings.photons,
            final_gather: settings.final_gather,
            maps: Maps {
                global: &scratch.global,
                caustics: &scratch.caustics,
                irradiance: &scratch.irradiance,
                volume: &scratch.volume,
                volume_caustics: &scratch.volume_caustics,
            },
            pixel_size: (side as f32, growth as f32),
            largest_radius: self.largest_radius(),
            source: self.source,
            has_leftovers: self.source.has_beyond || self.scene.lights.has_met_by_chance(),
        }
    }

    /// How large the disks of photons in media are in a pass.
    fn volume_radius(&self, pass: u32) -> VolumeRadius {
        let photons = &self.job.settings.photons;
        let scale = match self.method {
            Method::PhotonMap => 1.0,
            _ => shrunk_by_passes(pass, photons.alpha),
        };
        VolumeRadius { enough: photons.enough, scale, largest: self.largest_radius() }
    }

    /// Greatest radius over which photons are gathered, metres.
    fn largest_radius(&self) -> f32 {
        self.source.largest_radius(&self.job.settings.photons)
    }
}

impl TileState {
    fn new(film: &Film, tile: Tile) -> Self {
        let pixels = tile.common(film.window());
        Self {
            pixels,
            buffer: film.tile_buffer(tile),
            radii: vec![PixelRadius::default(); pixels.area()],
            counters: PathCounters::default(),
            gathered: Gathered::default(),
        }
    }

    /// One sample for each pixel; `None` when the control cancelled it.
    fn add_pass<const O: bool, I: Inside>(
        &mut self,
        tracer: &EyeTracer<O, I>,
        setting: &Setting,
        pass: u32,
        time: f32,
    ) -> Option<()> {
        let job = setting.job;
        let settings = job.settings;
        let alpha = settings.photons.alpha;
        let by_passes = shrunk_by_passes(pass, alpha);
        let Tile { x0, y0, x1, y1 } = self.pixels;
        let before = self.counters.rays;
        let seen_at = tracer.path.scene.surfaces.materials.wavelengths();
        let mut pixels = self.radii.iter_mut();
        for (y, x) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (y, x))) {
            if x == x0 && job.control.cancel.load(Relaxed) {
                return None;
            }
            let radius = pixels.next().expect("one for each pixel of the tile");
            let key =
                SampleKey { seed: settings.seed, frame: job.frame, pixel: (x, y), index: pass };
            let sampler = key.sampler();
            let offset = job.filter.sample(sampler.two(dimension::FILM));
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let lens = if job.has_lens { sampler.two(dimension::LENS) } else { Vec2::splat(0.5) };
            let ray = tracer.path.scene.camera.ray(centre + offset.as_dvec2(), lens, time);
            let scale = match setting.method {
                Method::Sppm => radius.scale(),
                Method::PhotonMap => 1.0,
                Method::Path | Method::PathWithPhotons => by_passes,
            };
            let begins = setting.method == Method::Sppm && radius.is_fresh();
            let enough = if begins { settings.photons.enough } else { 0 };
            let first_disk = FirstDisk { scale, enough };
            let (sample, gathered) = tracer.sample(&ray, key, first_disk, &mut self.counters);
            radius.begin_with(gathered.part);
            radius.absorb(gathered.found, alpha);
            self.gathered.include(&gathered);
            self.buffer.add_seen(x, y, &sample, seen_at);
        }
        let samples = self.pixels.area() as u64;
        job.control.samples_done.fetch_add(samples, Relaxed);
        job.control.rays.fetch_add(self.counters.rays - before, Relaxed);
        Some(())
    }
}

impl Gathered {
    fn include(&mut self, other: &Self) {
        self.radii = (self.radii.0.min(other.radii.0), self.radii.1.max(other.radii.1));
        self.unresolved = self.unresolved.saturating_add(other.unresolved);
    }
}
