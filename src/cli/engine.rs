//! The calls into the library which load and render, with their errors as [`Failure`]s.

use super::arguments::SceneArguments;
use super::failure::Failure;
use kinora::description::SceneDescription;
use kinora::frame::{RenderControl, RenderedFrame};
use stand_in::{LoadOptions, RenderError, Simulation, load_scene};

/// Loads and checks the scene, and applies what the command line changes in it.
pub fn load(arguments: &SceneArguments) -> Result<SceneDescription, Failure> {
    let options = LoadOptions {
        asset_dirs: arguments.assets.clone(),
        allow_outside: arguments.allow_outside,
        overrides: arguments.overrides.clone(),
        camera: arguments.camera.clone(),
    };
    let mut scene = load_scene(&arguments.path, &options).map_err(|diagnostics| {
        Failure::Diagnostics { plain: diagnostics.render(false), styled: diagnostics.render(true) }
    })?;
    let render = &mut scene.render;
    render.size = arguments.size.unwrap_or(render.size);
    render.samples = arguments.samples.unwrap_or(render.samples);
    render.seed = arguments.seed.unwrap_or(render.seed);
    render.integrator = arguments.integrator.map_or(render.integrator, Into::into);
    Ok(scene)
}

/// A scene ready to render.
pub struct Engine(Simulation);

impl Engine {
    pub fn new(scene: &SceneDescription) -> Result<Self, Failure> {
        Simulation::from_description(scene).map(Self).map_err(|error| Failure::Scene(error.into()))
    }

    /// Renders a frame; `None` when the control has cancelled it.
    pub fn render_frame(
        &mut self,
        frame: u32,
        control: &RenderControl,
    ) -> Result<Option<RenderedFrame>, Failure> {
        match self.0.render_frame(frame, control) {
            Ok(rendered) => Ok(Some(rendered)),
            Err(RenderError::Cancelled) => Ok(None),
            Err(error) => Err(Failure::Scene(error.into())),
        }
    }
}

/// The library's calls as they are going to be, rendering a gradient, so that the program runs from end to
/// end before they exist.
mod stand_in {
    use kinora::description::{Rgb, SceneDescription};
    use kinora::film::{Film, FilmError, FilterSampler, PixelSample};
    use kinora::frame::{FrameReport, RenderControl, RenderedFrame};
    use rayon::prelude::*;
    use std::path::{Path, PathBuf};
    use std::sync::atomic::Ordering::Relaxed;
    use std::time::Instant;

    #[expect(dead_code, reason = "the stand-in reads no scene")]
    pub struct LoadOptions {
        pub asset_dirs: Vec<PathBuf>,
        pub allow_outside: bool,
        pub overrides: Vec<String>,
        pub camera: Option<String>,
    }

    pub struct Diagnostics(String);
    impl Diagnostics {
        pub fn render(&self, _styled: bool) -> String {
            self.0.clone()
        }
    }

    pub fn load_scene(path: &Path, _: &LoadOptions) -> Result<SceneDescription, Diagnostics> {
        let bytes = std::fs::read(path)
            .map_err(|e| Diagnostics(format!("error: cannot read {}: {e}", path.display())))?;
        let mut scene = SceneDescription {
            files: vec![path.to_owned()],
            content_hash: bytes.len() as u128,
            camera: "camera".into(),
            ..Default::default()
        };
        scene.clock.frames = (0, 3);
        Ok(scene)
    }

    #[derive(Debug, thiserror::Error)]
    pub enum RenderError {
        #[error("cancelled")]
        Cancelled,
        #[error(transparent)]
        Film(#[from] FilmError),
    }

    pub struct Simulation(SceneDescription);
    impl Simulation {
        #[expect(clippy::unnecessary_wraps, reason = "as the library will")]
        pub fn from_description(scene: &SceneDescription) -> Result<Self, FilmError> {
            Ok(Self(scene.clone()))
        }
        pub fn render_frame(
            &mut self,
            frame: u32,
            control: &RenderControl,
        ) -> Result<RenderedFrame, RenderError> {
            let render = &self.0.render;
            let mut film = Film::new(render.size, &render.layers)?;
            let sampler = FilterSampler::new(&render.filter);
            let (width, height) = render.size;
            let samples = u64::from(width) * u64::from(height) * u64::from(render.samples);
            control.samples_done.store(0, Relaxed);
            control.rays.store(0, Relaxed);
            control.samples_total.store(samples, Relaxed);
            let start = Instant::now();
            let buffers: Vec<_> = film
                .tiles()
                .into_par_iter()
                .map(|tile| {
                    let mut buffer = film.tile_buffer(tile);
                    for y in tile.y0..tile.y1 {
                        for x in tile.x0..tile.x1 {
                            if control.cancel.load(Relaxed) {
                                return Err(RenderError::Cancelled);
                            }
                            for s in 0..render.samples {
                                let u = glam::Vec2::splat((s as f32 + 0.5) / render.samples as f32);
                                let p = sampler.sample(u) + glam::Vec2::new(x as f32, y as f32);
                                let radiance = Rgb::new(
                                    p.x / width as f32,
                                    p.y / height as f32,
                                    frame as f32 * 0.1,
                                )
                                .max(Rgb::ZERO);
                                buffer.add(x, y, &PixelSample { radiance, first_hit: None });
                            }
                            control.samples_done.fetch_add(u64::from(render.samples), Relaxed);
                            control.rays.fetch_add(u64::from(render.samples), Relaxed);
                        }
                    }
                    Ok(buffer)
                })
                .collect::<Result<_, _>>()?;
            for buffer in buffers {
                film.merge(buffer);
            }
            let report = FrameReport {
                frame,
                stage_seconds: vec![("step", 0.0), ("integrate", start.elapsed().as_secs_f64())],
                samples,
                rays: samples,
                non_finite: film.non_finite(),
                integrator: "Gradient".into(),
                warnings: vec!["this is a gradient".into()],
                ..Default::default()
            };
            Ok(RenderedFrame { film, report, world_to_camera: glam::DMat4::IDENTITY })
        }
    }
}
