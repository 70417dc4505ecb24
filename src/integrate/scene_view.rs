//! The tables of a frame, together, as an integrator sees them.

use crate::build::bvh::{Hit, MeshTrees, RayOrigin, SceneGeometry, SurfacePoint, TopLevel};
use crate::build::density::Densities;
use crate::build::light::{LightTable, Lights, ShapeLights};
use crate::build::nesting::{NestedGeometry, Solids};
use crate::build::spectra::Spectra;
use crate::color::spectrum;
use crate::description::Terminator;
use crate::extract::{Instances, PunctualLights, Requirements, Surfaces, ViewCamera};
use crate::math::Ray;
use crate::shade::Bsdf;
use crate::world::Settings;
use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemParam;

/// The tables of a frame.
#[derive(SystemParam)]
pub struct SceneTables<'w> {
    instances: Res<'w, Instances>,
    meshes: Res<'w, MeshTrees>,
    top: Res<'w, TopLevel>,
    surfaces: Res<'w, Surfaces>,
    lights: Res<'w, LightTable>,
    shapes: Res<'w, ShapeLights>,
    punctual: Res<'w, PunctualLights>,
    camera: Res<'w, ViewCamera>,
    requirements: Res<'w, Requirements>,
    solids: Res<'w, Solids>,
    densities: Res<'w, Densities>,
    spectra: Res<'w, Spectra>,
    settings: Res<'w, Settings>,
}

/// The scene of a frame: arrays and indices, read-only.
#[derive(Clone, Copy)]
pub struct SceneView<'a> {
    /// What rays meet.
    pub geometry: SceneGeometry<'a>,
    /// Materials, textures and emissions.
    pub surfaces: &'a Surfaces,
    /// What shines.
    pub lights: Lights<'a>,
    /// What looks.
    pub camera: &'a ViewCamera,
    /// What the scene needs.
    pub requirements: &'a Requirements,
    /// Which solids may overlap.
    pub solids: &'a Solids,
    /// Solids of uneven density.
    pub densities: &'a Densities,
    /// The surfaces at each set of wavelengths, in a spectral scene.
    pub spectra: &'a [Surfaces],
    /// Where light ends on meshes with smooth normals.
    pub terminator: Terminator,
}

impl<'a> SceneView<'a> {
    /// The scene as a sample of any pixel sees it: in a spectral scene at the next set of wavelengths.
    #[inline]
    #[must_use]
    pub fn of_sample(self, sample: u32) -> Self {
        if self.spectra.is_empty() {
            return self;
        }
        let surfaces = &self.spectra[spectrum::set_of(sample)];
        let lights = Lights { materials: &surfaces.materials, ..self.lights };
        Self { surfaces, lights, ..self }
    }

    /// Where rays leave what scatters where a ray hit.
    ///
    /// What is let through leaves on the far side of the triangle, and both sides have one point there.
    #[inline]
    pub fn ray_origin(
        &self,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
        bsdf: &Bsdf,
    ) -> RayOrigin {
        let smooth = self.terminator == Terminator::Smooth && !bsdf.transmits();
        smooth
            .then(|| self.geometry.smooth_ray_origin(ray, hit, surface))
            .flatten()
            .unwrap_or_else(|| surface.into())
    }

    /// What rays meet which know what they are inside of.
    #[inline]
    pub fn nested(&self) -> NestedGeometry<'a> {
        NestedGeometry {
            geometry: self.geometry,
            materials: &self.surfaces.materials,
            solids: self.solids,
            densities: self.densities,
        }
    }
}

impl SceneTables<'_> {
    /// The tables as one view.
    pub fn view(&self) -> SceneView<'_> {
        let geometry = SceneGeometry {
            instances: &self.instances.list,
            meshes: &self.meshes.list,
            top: &self.top,
        };
        SceneView {
            geometry,
            surfaces: &self.surfaces,
            lights: Lights {
                table: &self.lights,
                shapes: &self.shapes,
                punctual: &self.punctual.0,
                geometry,
                materials: &self.surfaces.materials,
            },
            camera: &self.camera,
            requirements: &self.requirements,
            solids: &self.solids,
            densities: &self.densities,
            spectra: &self.spectra.surfaces,
            terminator: self.settings.0.terminator,
        }
    }
}
