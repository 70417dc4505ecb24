//! Structures over the flat arrays: bounding volume hierarchies, the table of lights, photon maps.

pub mod bvh;
pub mod density;
pub mod light;
mod memory;
pub mod nesting;
pub mod photon;
pub mod spectra;

pub(crate) use memory::trees_fit;
pub use memory::{TreeMemory, forecast_tree_memory};

use crate::frame::{FrameSystems, stamp};
use bevy_ecs::prelude::*;

/// Adds the resources and the systems of this stage.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(bvh::RestingTree::default());
    world.insert_resource(bvh::MeshTrees::default());
    world.insert_resource(bvh::TopLevel::default());
    world.insert_resource(light::LightTable::default());
    world.insert_resource(light::PhotonSource::default());
    world.insert_resource(light::ShapeLights::default());
    world.insert_resource(TreeMemory::default());
    world.insert_resource(nesting::Solids::default());
    world.insert_resource(density::Densities::default());
    world.insert_resource(spectra::Spectra::default());
    let trees = (
        bvh::join_resting_meshes,
        stamp("tree of resting meshes"),
        bvh::rebuild_mesh_trees,
        stamp("mesh trees"),
        bvh::rebuild_top_level,
        stamp("top level"),
        (nesting::find_solids, stamp("solids")).chain().run_if(solids_nest),
        (density::find_densities, stamp("densities")).chain().run_if(densities_vary),
        (spectra::see_spectra, stamp("spectra")).chain().run_if(wavelengths_matter),
        light::rebuild_light_table,
        light::prepare_shape_lights,
        stamp("light table"),
        light::rebuild_photon_source.run_if(photons_are_traced),
        stamp("photon source"),
    );
    let trees = trees.chain().run_if(trees_fit);
    frame.add_systems((forecast_tree_memory, trees).chain().in_set(FrameSystems::Build));
}

/// Whether solids may overlap in this frame.
fn solids_nest(requirements: Res<crate::extract::Requirements>) -> bool {
    use crate::extract::Feature;
    requirements.has(Feature::NestedDielectrics) || requirements.need_whole()
}

/// Whether there are solids of uneven density in this frame, or were in the one before.
fn densities_vary(
    requirements: Res<crate::extract::Requirements>,
    densities: Res<density::Densities>,
) -> bool {
    requirements.has(crate::extract::Feature::UnevenDensity) || densities.memory() > 0
}

/// Whether this frame is seen at wavelengths, or the one before was.
fn wavelengths_matter(
    requirements: Res<crate::extract::Requirements>,
    spectra: Res<spectra::Spectra>,
) -> bool {
    requirements.has(crate::extract::Feature::Spectra) || !spectra.surfaces.is_empty()
}

/// Whether the integrator of this frame works with photons.
fn photons_are_traced(integrator: Res<crate::extract::ChosenIntegrator>) -> bool {
    integrator.method.has_photons()
}
