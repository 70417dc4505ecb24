//! All samples of all pixels: tiles in parallel, each pixel's samples in order.

use super::photon_passes::PhotonReport;
use super::scene_view::{SceneTables, SceneView};
use super::{PathCounters, PathTracer};
use crate::description::RenderSettings;
use crate::extract::{Feature, FrameOrigin};
use crate::film::{Film, FilmError, FilterSampler, Tile, TileBuffer};
use crate::frame::RenderControl;
use crate::sampling::{Sampler, dimension};
use crate::world::{FrameClock, Settings};
use bevy_ecs::prelude::*;
use glam::{DVec2, Vec2};
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

/// Everything but the scene that decides the samples of a tile.
pub(super) struct Job<'a> {
    pub(super) settings: &'a RenderSettings,
    pub(super) filter: FilterSampler,
    pub(super) frame: u32,
    /// Whether anything depends on the time in the shutter.
    pub(super) has_time: bool,
    pub(super) has_lens: bool,
    pub(super) control: &'a RenderControl,
}

impl<'a> Job<'a> {
    pub(super) fn new(
        settings: &'a RenderSettings,
        scene: &SceneView,
        frame: u32,
        control: &'a RenderControl,
    ) -> Self {
        let requires = |feature| scene.requirements.has(feature);
        Self {
            settings,
            filter: FilterSampler::new(&settings.filter),
            frame,
            has_time: requires(Feature::Motion) || requires(Feature::CameraMotion),
            has_lens: requires(Feature::Lens),
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
    *status = IntegrateStatus::default();
    if control.cancel.load(Relaxed) {
        return;
    }
    let mut film = match Film::new(settings.size, &settings.layers) {
        Ok(film) => film,
        Err(error) => {
            status.error = Some(error);
            return;
        }
    };
    let scene = tables.view();
    let requires = |feature| scene.requirements.has(feature);
    let job = Job::new(settings, &scene, clock.frame, &control);
    let begin = Begin { scene, settings, origin: &origin, first_hit: film.wants_first_hit() };
    let counters = match (requires(Feature::Opacity), requires(Feature::Absorption)) {
        (false, false) => fill(&mut film, &begin.tracer::<false, false>(), &job),
        (false, true) => fill(&mut film, &begin.tracer::<false, true>(), &job),
        (true, false) => fill(&mut film, &begin.tracer::<true, false>(), &job),
        (true, true) => fill(&mut film, &begin.tracer::<true, true>(), &job),
    };
    if let Some(counters) = counters {
        status.film = Some(film);
        status.counters = counters;
    }
}

/// What an integrator begins with, whatever its generic parameters.
pub(super) struct Begin<'a> {
    pub(super) scene: SceneView<'a>,
    pub(super) settings: &'a RenderSettings,
    pub(super) origin: &'a FrameOrigin,
    pub(super) first_hit: bool,
}

impl<'a> Begin<'a> {
    pub(super) fn tracer<const OPACITY: bool, const ABSORPTION: bool>(
        &self,
    ) -> PathTracer<'a, OPACITY, ABSORPTION> {
        PathTracer {
            scene: self.scene,
            max_depth: self.settings.max_depth,
            roulette_depth: self.settings.roulette_depth,
            clamp_indirect: self.settings.clamp_indirect,
            wants_first_hit: self.first_hit,
            origin: self.origin.0,
        }
    }
}

/// Renders all tiles; `None` when the control cancelled it.
///
/// Tiles share no pixel, so that the order in which they are merged does not show.
fn fill<const OPACITY: bool, const ABSORPTION: bool>(
    film: &mut Film,
    tracer: &PathTracer<OPACITY, ABSORPTION>,
    job: &Job,
) -> Option<PathCounters> {
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
}

fn render_tile<const OPACITY: bool, const ABSORPTION: bool>(
    mut buffer: TileBuffer,
    tile: Tile,
    tracer: &PathTracer<OPACITY, ABSORPTION>,
    job: &Job,
) -> Option<(TileBuffer, PathCounters)> {
    let mut counters = PathCounters::default();
    let mut reported = 0;
    for y in tile.y0..tile.y1 {
        if job.control.cancel.load(Relaxed) {
            return None;
        }
        for x in tile.x0..tile.x1 {
            for index in 0..job.settings.samples {
                let sampler = Sampler::new(job.settings.seed, job.frame, (x, y), index);
                let offset = job.filter.sample(sampler.two(dimension::FILM));
                let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let lens =
                    if job.has_lens { sampler.two(dimension::LENS) } else { Vec2::splat(0.5) };
                let time = if job.has_time { sampler.one(dimension::TIME) } else { 0.0 };
                let camera_ray = tracer.scene.camera.ray(centre + offset.as_dvec2(), lens, time);
                buffer.add(x, y, &tracer.sample(&camera_ray, &sampler, &mut counters));
            }
        }
        let samples = u64::from(tile.x1 - tile.x0) * u64::from(job.settings.samples);
        job.control.samples_done.fetch_add(samples, Relaxed);
        job.control.rays.fetch_add(counters.rays - reported, Relaxed);
        reported = counters.rays;
    }
    Some((buffer, counters))
}
