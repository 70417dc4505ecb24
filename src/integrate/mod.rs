//! Integrators: the radiance of one pixel sample. One integrator per file.

mod eye;
mod eye_medium;
mod film_pass;
mod layers;
mod medium;
mod path;
mod photon_passes;
mod radius;
mod scene_view;
mod share;
mod uneven;
mod vertex;

pub use film_pass::film_memory;
pub use film_pass::{IntegrateStatus, render_film};
pub use path::{PathCounters, PathTracer};
pub use photon_passes::{PhotonReport, PhotonScratch, render_film_with_photons};
pub(crate) use radius::radius_limit;
pub use radius::{PixelRadius, shrunk_by_passes};
pub use scene_view::SceneView;

use crate::extract::ChosenIntegrator;
use crate::frame::FrameSystems;
use bevy_ecs::prelude::*;
use bevy_ecs::schedule::common_conditions::not;

/// Adds the resources and the system of this stage.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(IntegrateStatus::default());
    world.insert_resource(PhotonScratch::default());
    let with_photons = |chosen: Res<ChosenIntegrator>| chosen.method.has_photons();
    frame.add_systems(
        (render_film.run_if(not(with_photons)), render_film_with_photons.run_if(with_photons))
            .chain()
            .in_set(FrameSystems::Integrate),
    );
}
