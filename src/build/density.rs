//! Solids of uneven density.

use crate::extract::{Geometry, Instance, Instances, Meshes, NOTHING, Surfaces};
use crate::math::{Aabb, Ray};
use crate::shade::medium::{Density, Passage};
use crate::shade::texture::Textures;
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The densities of the solids of a frame, where they are uneven.
#[derive(Resource, Debug, Default)]
pub struct Densities {
    list: Vec<Density>,
    /// For each instance its place in the list, or [`NOTHING`].
    places: Vec<u32>,
    /// The first instance of uneven density which has no end.
    pub(crate) endless: Option<u32>,
    /// How often a density was found above its bound.
    exceeded: AtomicU64,
}

impl Densities {
    /// The way of a ray through an instance; `None` where the density is even.
    #[inline]
    pub fn passage<'a>(
        &'a self,
        (index, instance): (u32, &Instance),
        textures: &'a Textures,
        ray: &Ray,
    ) -> Option<Passage<'a>> {
        let place = *self.places.get(index as usize)?;
        let density = self.list.get(place as usize)?;
        let scaled = DAffine3::from_scale(instance.size) * instance.motion.inverse_at(ray.time);
        Some(Passage::new(density, textures, ray, &scaled, &self.exceeded))
    }

    /// How often a density was found above its bound since this was asked last.
    pub fn take_exceeded(&self) -> u64 {
        self.exceeded.swap(0, Relaxed)
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.list.iter().map(Density::memory).sum()
    }
}

/// Finds bounds of the densities of all solids, when something that they depend on changed. Equal boxes share them.
pub fn find_densities(
    instances: Res<Instances>,
    surfaces: Res<Surfaces>,
    meshes: Res<Meshes>,
    mut table: ResMut<Densities>,
) {
    if !(instances.is_changed() || surfaces.is_changed() || meshes.is_changed()) {
        return;
    }
    let materials = &surfaces.materials;
    let mut found =
        Densities { places: vec![NOTHING; instances.list.len()], ..Densities::default() };
    let mut known = HashMap::new();
    for (index, instance) in (0..).zip(&instances.list) {
        if instance.material == NOTHING {
            continue;
        }
        let interior = materials.interior(instance.material);
        let Some(texture) = interior.and_then(|interior| interior.density) else { continue };
        let Aabb { min, max } = match &instance.geometry {
            Geometry::Primitive(primitive) => primitive.bounds(),
            Geometry::Mesh(mesh) => meshes.bounds[*mesh as usize],
        };
        if !(min.is_finite() && max.is_finite()) {
            found.endless = found.endless.or(Some(index));
            continue;
        }
        let corners = [min, max].map(|corner| corner.as_dvec3() * instance.size);
        let key = (texture, corners.map(|corner: DVec3| corner.to_array().map(f64::to_bits)));
        let place = *known.entry(key).or_insert_with(|| {
            let [min, max] = corners;
            found.list.push(Density::new(materials.textures(), texture, min, max));
            (found.list.len() - 1) as u32
        });
        found.places[index as usize] = place;
    }
    *table = found;
}
