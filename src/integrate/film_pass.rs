//! All samples of all pixels: tiles in parallel, each pixel's samples in order.

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

/// How the integration of a frame ended.
#[derive(Resource, Debug, Default)]
pub struct IntegrateStatus {
    /// The film; `None` when the render was cancelled or could not begin.
    pub film: Option<Film>,
    /// Why there is no film, unless it was cancelled.
    pub error: Option<FilmError>,
    /// What happened on the paths.
    pub counters: PathCounters,
}

/// Everything but the scene that decides the samples of a tile.
struct Job<'a> {
    settings: &'a RenderSettings,
    filter: FilterSampler,
    frame: u32,
    /// Whether anything depends on the time in the shutter.
    has_time: bool,
    has_lens: bool,
    control: &'a RenderControl,
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
    let job = Job {
        settings,
        filter: FilterSampler::new(&settings.filter),
        frame: clock.frame,
        has_time: requires(Feature::Motion) || requires(Feature::CameraMotion),
        has_lens: requires(Feature::Lens),
        control: &control,
    };
    let counters = match (requires(Feature::Opacity), requires(Feature::Absorption)) {
        (false, false) => fill(&mut film, &tracer::<false, false>(scene, settings, &origin), &job),
        (false, true) => fill(&mut film, &tracer::<false, true>(scene, settings, &origin), &job),
        (true, false) => fill(&mut film, &tracer::<true, false>(scene, settings, &origin), &job),
        (true, true) => fill(&mut film, &tracer::<true, true>(scene, settings, &origin), &job),
    };
    if let Some(counters) = counters {
        status.film = Some(film);
        status.counters = counters;
    }
}

fn tracer<'a, const OPACITY: bool, const ABSORPTION: bool>(
    scene: SceneView<'a>,
    settings: &RenderSettings,
    origin: &FrameOrigin,
) -> PathTracer<'a, OPACITY, ABSORPTION> {
    PathTracer {
        scene,
        max_depth: settings.max_depth,
        roulette_depth: settings.roulette_depth,
        clamp_indirect: settings.clamp_indirect,
        wants_first_hit: Film::new((1, 1), &settings.layers).is_ok_and(|f| f.wants_first_hit()),
        origin: origin.0,
    }
}

/// Renders all tiles; `None` when the control cancelled it.
fn fill<const OPACITY: bool, const ABSORPTION: bool>(
    film: &mut Film,
    tracer: &PathTracer<OPACITY, ABSORPTION>,
    job: &Job,
) -> Option<PathCounters> {
    let tiles = film.tiles();
    let empty = &*film;
    let finished: Vec<(TileBuffer, PathCounters)> = tiles
        .into_par_iter()
        .map(|tile| render_tile(empty.tile_buffer(tile), tile, tracer, job))
        .collect::<Option<_>>()?;
    let mut counters = PathCounters::default();
    for (buffer, tile_counters) in finished {
        film.merge(buffer);
        counters = counters.plus(tile_counters);
    }
    Some(counters)
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
