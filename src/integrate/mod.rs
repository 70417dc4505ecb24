//! Integrators: the radiance of one pixel sample. One integrator per file.

mod film_pass;
mod path;
mod scene_view;
mod share;
mod vertex;

pub use film_pass::{IntegrateStatus, render_film};
pub use path::{PathCounters, PathTracer};
pub use scene_view::SceneView;

use crate::frame::FrameSystems;
use bevy_ecs::prelude::*;

/// Adds the resources and the system of this stage.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(IntegrateStatus::default());
    frame.add_systems(render_film.in_set(FrameSystems::Integrate));
}
