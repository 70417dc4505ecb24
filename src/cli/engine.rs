//! The calls into the library which load and render, with their errors as [`Failure`]s.

use super::arguments::SceneArguments;
use super::failure::Failure;
use kinora::description::{
    ExrLayout, IntegratorChoice, LoadOptions, SceneDescription, load_scene, read_scene,
};
use kinora::frame::{RenderControl, RenderError, RenderedFrame, Simulation};
use std::path::Path;

/// Loads and checks the scene together with what the command line changes in it.
pub fn load(arguments: &SceneArguments) -> Result<SceneDescription, Failure> {
    let options = LoadOptions {
        asset_dirs: arguments.assets.clone(),
        allow_outside: arguments.allow_outside,
        overrides: overrides(arguments),
        camera: arguments.camera.clone(),
    };
    if is_stdin(&arguments.path) {
        let here = Some(Path::new("."));
        return Ok(read_scene("<stdin>", std::io::stdin().lock(), here, &options)?);
    }
    Ok(load_scene(&arguments.path, &options)?)
}

/// Whether a scene is to come from the standard input.
pub fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

/// The options which stand for a setting, and then those of `--set`, as paths and values: all go
/// through the same checks as the scene itself.
fn overrides(arguments: &SceneArguments) -> Vec<(String, String)> {
    let named = [
        ("render.size", arguments.size.map(|(width, height)| format!("({width}, {height})"))),
        (
            "render.region",
            arguments
                .region
                .map(|[x, y, width, height]| format!("Some(({x}, {y}, {width}, {height}))")),
        ),
        ("render.exr_layout", arguments.exr_layout.map(|n| format!("{:?}", ExrLayout::from(n)))),
        ("render.samples", arguments.samples.map(|samples| samples.to_string())),
        ("render.seed", arguments.seed.map(|seed| seed.to_string())),
        (
            "render.integrator",
            arguments.integrator.map(|name| format!("{:?}", IntegratorChoice::from(name))),
        ),
    ];
    let named = named.into_iter().filter_map(|(path, value)| Some((path.to_owned(), value?)));
    named.chain(split_overrides(&arguments.overrides)).collect()
}

/// The values of `--set` as paths and values.
pub fn split_overrides(overrides: &[String]) -> Vec<(String, String)> {
    let set = overrides.iter().filter_map(|set| set.split_once('='));
    set.map(|(path, value)| (path.trim().to_owned(), value.trim().to_owned())).collect()
}

/// A scene ready to render.
pub struct Engine(Simulation);

impl Engine {
    pub fn new(scene: &SceneDescription) -> Self {
        Self(Simulation::from_description(scene))
    }

    /// Renders a frame; `None` when the control has cancelled it.
    pub fn render_frame(
        &mut self,
        frame: i32,
        control: &RenderControl,
    ) -> Result<Option<RenderedFrame>, Failure> {
        match self.0.render_frame(frame, control) {
            Ok(rendered) => Ok(Some(rendered)),
            Err(RenderError::Cancelled) => Ok(None),
            Err(error) => Err(Failure::Scene(error.into())),
        }
    }
}
