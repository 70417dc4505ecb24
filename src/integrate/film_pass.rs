//! All samples of all pixels: tiles in parallel, each pixel's samples in order.

use super::layers::fill_centres;
use super::photon_passes::PhotonReport;
use super::radius::PixelRadius;
use super::scene_view::{SceneTables, SceneView};
use super::{PathCounters, PathTracer};
use crate::description::{RenderSettings, TextureFiltering};
use crate::extract::{CameraRay, Feature, FrameOrigin, Method, Requirements};
use crate::film::{Film, FilmError, FilterSampler, Tile, TileBuffer};
use crate::frame::RenderControl;
use crate::math::Cone;
use crate::memory::ask;
use crate::sampling::{Sampler, dimension};
use crate::shade::nesting::{Clear, Inside, OneSolid, SolidStack, Whole};
use crate::world::{FrameClock, Settings};
use bevy_ecs::prelude::*;
use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Mutex, PoisonError};

/// How the integration of a frame ended.
#[derive(Resource, Debug, Default)]
pub struct IntegrateStatus {
    /// The film; `None` when the render was cancelled or could not begin.
    pub film: Option<Film>,
    /// Why there is no film, unless it was cancelled.
    pub error: Option<FilmError>,
    /// What happened on the paths.
    pub counters: PathCounters,
    /// What the photons came to.
    pub photons: Option<PhotonReport>,
    /// What the user should know of this frame.
    pub warnings: Vec<String>,
}

impl IntegrateStatus {
    /// Forgets the frame before and makes an empty film; `None` when the frame is not to be rendered.
    pub(super) fn begin(
        &mut self,
        settings: &RenderSettings,
        control: &RenderControl,
        method: Method,
    ) -> Option<Film> {
        *self = Self::default();
        if control.cancel.load(Relaxed) {
            return None;
        }
        let (width, height) = Tile::rendered(settings).size();
        let film = ask(film_memory(settings, method))
            .map_err(|source| FilmError::Memory { width, height, source })
            .and_then(|()| Film::for_settings(settings));
        film.map_err(|error| self.error = Some(error)).ok()
    }
}

/// Bytes of the film of a frame. A method with photons goes over it pass by pass, so that all tiles have their sums and
/// radii at once beside it.
pub fn film_memory(settings: &RenderSettings, method: Method) -> u64 {
    let film = Film::forecast(settings);
    if !method.has_photons() {
        return film;
    }
    let pixels = Tile::rendered(settings).area() as u64;
    2 * film + pixels * size_of::<PixelRadius>() as u64
}

/// Everything but the scene that decides the samples of a tile.
pub(super) struct Job<'a> {
    pub(super) settings: &'a RenderSettings,
    pub(super) filter: FilterSampler,
    /// The frame, as the key of its random numbers.
    pub(super) frame: u32,
    /// Whether anything depends on the time in the shutter.
    pub(super) has_time: bool,
    pub(super) has_lens: bool,
    /// Side of the groups of pixels which share their paths; 1 for none.
    share: u32,
    /// What of the picture is rendered.
    window: Tile,
    pub(super) control: &'a RenderControl,
}

impl<'a> Job<'a> {
    pub(super) fn new(
        settings: &'a RenderSettings,
        scene: &SceneView,
        frame: u32,
        control: &'a RenderControl,
    ) -> Self {
        Self {
            settings,
            filter: FilterSampler::new(&settings.filter),
            frame,
            has_time: scene.requirements.need_time(),
            has_lens: scene.requirements.has(Feature::Lens),
            share: shared_side(settings, scene.requirements),
            window: Tile::rendered(settings),
            control,
        }
    }
}

/// Fills the film of this frame.
pub fn render_film(
    tables: SceneTables,
    settings: Res<Settings>,
    clock: Res<FrameClock>,
    origin: Res<FrameOrigin>,
    control: Res<RenderControl>,
    mut status: ResMut<IntegrateStatus>,
) {
    let settings = &settings.0;
    let Some(mut film) = status.begin(settings, &control, Method::Path) else { return };
    let scene = tables.view();
    let requires = |feature| scene.requirements.has(feature);
    let job = Job::new(settings, &scene, clock.frame.cast_unsigned(), &control);
    let begin = Begin { scene, settings, origin: &origin, seen: film.wants_seen() };
    let counters = match (requires(Feature::Opacity), Around::new(scene.requirements)) {
        (false, Around::Clear) => fill(&mut film, &begin.tracer::<false, Clear>(), &job),
        (false, Around::One) => fill(&mut film, &begin.tracer::<false, OneSolid>(), &job),
        (false, Around::Nested) => fill(&mut film, &begin.tracer::<false, SolidStack>(), &job),
        (false, Around::Whole) => fill(&mut film, &begin.tracer::<false, Whole>(), &job),
        (true, Around::Clear) => fill(&mut film, &begin.tracer::<true, Clear>(), &job),
        (true, Around::One) => fill(&mut film, &begin.tracer::<true, OneSolid>(), &job),
        (true, Around::Nested) => fill(&mut film, &begin.tracer::<true, SolidStack>(), &job),
        (true, Around::Whole) => fill(&mut film, &begin.tracer::<true, Whole>(), &job),
    };
    if let Some(counters) = counters {
        status.film = Some(film);
        status.counters = counters;
    }
}

/// What paths must know of the solids around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Around {
    Clear,
    One,
    Nested,
    Whole,
}

impl Around {
    pub(super) fn new(requirements: &Requirements) -> Self {
        if requirements.need_whole() {
            Self::Whole
        } else if requirements.has(Feature::NestedDielectrics) {
            Self::Nested
        } else if requirements.has(Feature::Absorption) {
            Self::One
        } else {
            Self::Clear
        }
    }
}

/// The side of the groups which share their paths.
///
/// Paths of different times or wavelengths see different scenes; surfaces with holes and solids which absorb or
/// overlap would have to be followed along every connection; and a limit on radiance is one of single paths.
fn shared_side(settings: &RenderSettings, requirements: &Requirements) -> u32 {
    let hindrances = [
        Feature::Motion,
        Feature::Deformation,
        Feature::TextureMotion,
        Feature::Opacity,
        Feature::Absorption,
        Feature::NestedDielectrics,
    ];
    let hindered = requirements.need_whole()
        || hindrances.into_iter().any(|feature| requirements.has(feature));
    if hindered || settings.clamp_indirect.is_some() { 1 } else { settings.share.clamp(1, 4) }
}

/// What an integrator begins with, whatever its generic parameters.
pub(super) struct Begin<'a> {
    pub(super) scene: SceneView<'a>,
    pub(super) settings: &'a RenderSettings,
    pub(super) origin: &'a FrameOrigin,
    /// Whether the film wants to know of each sample what it saw first.
    pub(super) seen: bool,
}

impl<'a> Begin<'a> {
    /// What all camera rays begin in, where that is one thing.
    fn start<I: Inside>(&self) -> Option<I> {
        if !I::NESTS {
            return Some(I::new(&SolidStack::default()));
        }
        let eye = self.scene.camera.reach();
        let rests = eye.max - eye.min == Vec3::ZERO;
        let around = rests.then(|| self.scene.nested().all_around(eye.min, 0.0)).flatten();
        around.map(|stack| I::new(&stack))
    }

    /// What a sample stands for at the camera, half way through the shutter: the more samples, the less, down to
    /// an eighth of a pixel across (Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed.,
    /// section 10.1.3).
    pub(super) fn pixel(&self) -> Cone {
        let textures = self.scene.surfaces.materials.textures();
        if textures.filtering() == TextureFiltering::Point || textures.is_empty() {
            return Cone::default();
        }
        let (side, growth) = self.scene.camera.pixel_size(0.5);
        let share = (self.settings.samples as f32).sqrt().recip().max(0.125);
        Cone { width: side as f32 * share, spread: growth as f32 * share }
    }

    pub(super) fn tracer<const OPACITY: bool, I: Inside>(&self) -> PathTracer<'a, OPACITY, I> {
        PathTracer {
            scene: self.scene,
            max_depth: self.settings.max_depth,
            roulette_depth: self.settings.roulette_depth,
            roulette_gain: self.settings.roulette_gain,
            inner_reflections: self.settings.inner_reflections,
            clamp_indirect: self.settings.clamp_indirect,
            wants_seen: self.seen,
            origin: self.origin.0,
            pixel: self.pixel(),
            samples: self.settings.samples,
            start: self.start(),
            background: self.settings.background,
        }
    }
}

/// Renders all tiles; `None` when the control cancelled it.
///
/// Tiles share no pixel, so that the order in which they are merged does not show.
fn fill<const OPACITY: bool, I: Inside>(
    film: &mut Film,
    tracer: &PathTracer<OPACITY, I>,
    job: &Job,
) -> Option<PathCounters> {
    let rays = fill_centres(film, tracer);
    job.control.rays.fetch_add(rays, Relaxed);
    let tiles = film.tiles();
    let film = Mutex::new(film);
    let lock = || film.lock().unwrap_or_else(PoisonError::into_inner);
    tiles
        .into_par_iter()
        .map(|tile| {
            let buffer = lock().tile_buffer(tile);
            let (buffer, counters) = render_tile(buffer, tile, tracer, job)?;
            lock().merge(buffer);
            Some(counters)
        })
        .try_reduce(PathCounters::default, |a, b| Some(a.plus(b)))
        .map(|counters| PathCounters { rays: counters.rays + rays, ..counters })
}

fn render_tile<const OPACITY: bool, I: Inside>(
    buffer: TileBuffer,
    tile: Tile,
    tracer: &PathTracer<OPACITY, I>,
    job: &Job,
) -> Option<(TileBuffer, PathCounters)> {
    if job.share > 1 {
        render_groups(buffer, tile, tracer, job)
    } else {
        render_pixels(buffer, tile, tracer, job)
    }
}

/// Pixel by pixel, each with all its samples.
fn render_pixels<const OPACITY: bool, I: Inside>(
    mut buffer: TileBuffer,
    tile: Tile,
    tracer: &PathTracer<OPACITY, I>,
    job: &Job,
) -> Option<(TileBuffer, PathCounters)> {
    let mut counters = PathCounters::default();
    let mut reported = 0;
    let rendered = tile.common(job.window);
    for y in rendered.y0..rendered.y1 {
        for x in rendered.x0..rendered.x1 {
            for index in 0..job.settings.samples {
                let scene = tracer.scene.of_sample(index);
                let tracer = PathTracer { scene, ..*tracer };
                let (sampler, camera_ray) = job.begin(&scene, (x, y), index);
                let sample = tracer.sample(&camera_ray, &sampler, &mut counters);
                buffer.add_seen(x, y, &sample, scene.surfaces.materials.wavelengths());
            }
        }
        let samples = u64::from(rendered.size().0) * u64::from(job.settings.samples);
        if !job.go_on(samples, counters.rays - reported) {
            return None;
        }
        reported = counters.rays;
    }
    Some((buffer, counters))
}

/// Sample by sample, in groups of neighbouring pixels which share their paths. A group of which only a part is to be
/// rendered is followed as a whole.
fn render_groups<const OPACITY: bool, I: Inside>(
    mut buffer: TileBuffer,
    tile: Tile,
    tracer: &PathTracer<OPACITY, I>,
    job: &Job,
) -> Option<(TileBuffer, PathCounters)> {
    let mut counters = PathCounters::default();
    let mut reported = 0;
    let mut pixels = Vec::with_capacity(LARGEST_GROUP);
    let mut paths = Vec::with_capacity(LARGEST_GROUP);
    let corner = Sampler::new(job.settings.seed, job.frame, (tile.x0, tile.y0), u32::MAX);
    let all = tracer;
    for index in 0..job.settings.samples {
        // Paths which share see the scene at the same wavelengths.
        let tracer = &PathTracer { scene: all.scene.of_sample(index), ..*all };
        let seen_at = tracer.scene.surfaces.materials.wavelengths();
        let shift = corner.two(index);
        let columns = groups(tile.x0, tile.x1, job.share, shift.x);
        let rows = groups(tile.y0, tile.y1, job.share, shift.y);
        for row in rows.filter(|row| job.window.has_rows(row)) {
            for column in columns.clone().filter(|column| job.window.has_columns(column)) {
                for y in row.clone() {
                    for x in column.clone() {
                        let (sampler, camera_ray) = job.begin(&tracer.scene, (x, y), index);
                        paths.push(tracer.sample_shared(&camera_ray, &sampler, &mut counters));
                        pixels.push((x, y));
                    }
                }
                tracer.connect::<LARGEST_GROUP>(&mut paths, &mut counters);
                for (path, (x, y)) in paths.drain(..).zip(pixels.drain(..)) {
                    buffer.add_seen(x, y, &path.sample, seen_at);
                }
            }
        }
        let samples = tile.common(job.window).area() as u64;
        if !job.go_on(samples, counters.rays - reported) {
            return None;
        }
        reported = counters.rays;
    }
    Some((buffer, counters))
}

/// Most pixels of a group: those of two sides that [`groups`] may give, with a setting of 4.
const LARGEST_GROUP: usize = 49;

/// Divides `begin..end` into runs of `side`, the first and the last between half as long and less than
/// twice as long; `shift` in `[0, 1)` moves the borders.
fn groups(
    begin: u32,
    end: u32,
    side: u32,
    shift: f32,
) -> impl Iterator<Item = std::ops::Range<u32>> + Clone {
    let shortest = side.div_ceil(2);
    let first = shortest + (shift * side as f32) as u32;
    let mut next = begin;
    std::iter::from_fn(move || {
        let start = next;
        let length = if start == begin { first } else { side };
        next = if start + length + shortest > end { end } else { start + length };
        (start < end).then_some(start..next)
    })
}

impl Job<'_> {
    /// The random numbers and the camera ray of a sample.
    #[inline]
    fn begin(&self, scene: &SceneView, pixel: (u32, u32), index: u32) -> (Sampler, CameraRay) {
        let sampler = Sampler::new(self.settings.seed, self.frame, pixel, index);
        let offset = self.filter.sample(sampler.two(dimension::FILM));
        let centre = DVec2::new(f64::from(pixel.0) + 0.5, f64::from(pixel.1) + 0.5);
        let lens = if self.has_lens { sampler.two(dimension::LENS) } else { Vec2::splat(0.5) };
        let time = if self.has_time { sampler.one(dimension::TIME) } else { 0.0 };
        (sampler, scene.camera.ray(centre + offset.as_dvec2(), lens, time))
    }

    /// Tells what was done, and whether the render is to go on.
    fn go_on(&self, samples: u64, rays: u64) -> bool {
        self.control.samples_done.fetch_add(samples, Relaxed);
        self.control.rays.fetch_add(rays, Relaxed);
        !self.control.cancel.load(Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pixel is in one group, and no group is larger than there is room for.
    #[test]
    fn groups_cover_a_row_once() {
        for length in 1..70 {
            for side in 2..=4 {
                for shift in [0.0, 0.3, 0.7, 1.0_f32.next_down()] {
                    let runs: Vec<_> = groups(5, 5 + length, side, shift).collect();
                    let pixels: Vec<u32> = runs.iter().cloned().flatten().collect();
                    assert_eq!(pixels, (5..5 + length).collect::<Vec<u32>>());
                    for run in &runs {
                        assert!(run.len() * run.len() <= LARGEST_GROUP, "{side} {shift}: {run:?}");
                        let least = side.div_ceil(2).min(length) as usize;
                        assert!(run.len() >= least, "{length} {side} {shift}: {run:?}");
                    }
                }
            }
        }
    }
}
