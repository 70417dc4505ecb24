//! Materials, textures and emissions as tables.

use crate::description::{EmissionStrength, Rgb, Value};
use crate::shade::MaterialTable;
use crate::world::{Emission, EmissionFactor, Material, Texture};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;
use std::convert::Infallible;

/// What surfaces are made of and what they emit, by index.
#[derive(Resource, Default)]
pub struct Surfaces {
    /// Materials and textures.
    pub materials: MaterialTable,
    /// Emissions of shapes.
    pub emissions: Vec<SurfaceEmission>,
}

/// The emission of a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceEmission {
    /// Radiance, or for a total power watts per channel: then the instance divides by its area.
    pub strength: EmissionStrength<u32>,
    /// The mean over the shutter of the keyed factor.
    pub factor: f32,
    /// Whether the back emits as well.
    pub two_sided: bool,
}

/// Which entity became which index in [`Surfaces`].
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct SurfaceSlots {
    /// Entities with a material, among them those which objects share.
    pub materials: EntityHashMap<u32>,
    /// Entities with a texture.
    pub textures: EntityHashMap<u32>,
    /// Objects with an emission.
    pub emissions: EntityHashMap<u32>,
}

/// Rebuilds [`Surfaces`] when a texture, a material or an emission was added, changed or removed.
///
/// Slots follow the order of the entities, which is that of spawning.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the table depends on")]
pub fn extract_surfaces(
    changed: Query<
        (),
        Or<(Changed<Material>, Changed<Texture>, Changed<Emission>, Changed<EmissionFactor>)>,
    >,
    mut removed: (
        RemovedComponents<Material>,
        RemovedComponents<Texture>,
        RemovedComponents<Emission>,
    ),
    materials: Query<(Entity, &Material)>,
    textures: Query<(Entity, &Texture)>,
    emissions: Query<(Entity, &Emission, Option<&EmissionFactor>)>,
    mut surfaces: ResMut<Surfaces>,
    mut slots: ResMut<SurfaceSlots>,
) {
    let gone = removed.0.read().count() + removed.1.read().count() + removed.2.read().count();
    if changed.is_empty() && gone == 0 {
        return;
    }
    let texture_slots = in_spawn_order(textures.iter().map(|(entity, _)| entity));
    // References to entities without the right component lead to a slot past the end, which shades
    // as black; a description never contains one.
    let mut texture_of =
        |entity: Entity| Ok::<u32, Infallible>(slot(&texture_slots, entity));
    let material_slots = in_spawn_order(materials.iter().map(|(entity, _)| entity));
    let mut material_of =
        |entity: Entity| Ok::<u32, Infallible>(slot(&material_slots, entity));
    let mut table: Vec<(u32, crate::description::Material<u32>)> = materials
        .iter()
        .map(|(entity, material)| {
            let Ok(indexed) = material.clone().map_refs(&mut texture_of, &mut material_of);
            (material_slots[&entity], indexed)
        })
        .collect();
    table.sort_unstable_by_key(|(slot, _)| *slot);
    let table: Vec<_> = table.into_iter().map(|(_, material)| material).collect();
    let mut images: Vec<(u32, Texture)> =
        textures.iter().map(|(entity, texture)| (texture_slots[&entity], texture.clone())).collect();
    images.sort_unstable_by_key(|(slot, _)| *slot);
    let images: Vec<Texture> = images.into_iter().map(|(_, texture)| texture).collect();

    let emission_slots = in_spawn_order(emissions.iter().map(|(entity, ..)| entity));
    let mut emitted: Vec<(u32, SurfaceEmission)> = emissions
        .iter()
        .map(|(entity, emission, factor)| {
            let Ok(indexed) = emission.clone().map_ref(&mut texture_of);
            let emission = SurfaceEmission {
                strength: indexed.strength,
                factor: factor.map_or(1.0, |f| f.0 as f32),
                two_sided: indexed.two_sided,
            };
            (emission_slots[&entity], emission)
        })
        .collect();
    emitted.sort_unstable_by_key(|(slot, _)| *slot);

    surfaces.materials = MaterialTable::new(&table, images);
    surfaces.emissions = emitted.into_iter().map(|(_, emission)| emission).collect();
    slots.set_if_neq(SurfaceSlots {
        materials: material_slots,
        textures: texture_slots,
        emissions: emission_slots,
    });
}

/// Numbers entities in the order in which they were spawned.
fn in_spawn_order(entities: impl Iterator<Item = Entity>) -> EntityHashMap<u32> {
    let mut entities: Vec<Entity> = entities.collect();
    entities.sort_unstable_by_key(|entity| (entity.index_u32(), entity.generation()));
    entities.into_iter().zip(0..).collect()
}

fn slot(slots: &EntityHashMap<u32>, entity: Entity) -> u32 {
    slots.get(&entity).copied().unwrap_or(super::NOTHING)
}
