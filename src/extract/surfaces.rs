//! Materials and textures as tables.

use super::spawn_order;
use crate::description::{Rgb, Value};
use crate::shade::{MaterialTable, material_cycle};
use crate::world::{Material, Texture};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;

/// What surfaces are made of, by index.
#[derive(Resource)]
pub struct Surfaces {
    /// Materials and textures.
    pub materials: MaterialTable,
    /// Index of the grey of objects which have no material and emit nothing.
    pub default_material: u32,
    /// Materials which look at uv, by index.
    textured: Vec<bool>,
    /// What refers to an entity which is not what it should be, in words.
    pub dangling: Vec<String>,
}

impl Default for Surfaces {
    fn default() -> Self {
        Self::new(Vec::new(), Vec::new())
    }
}

impl Surfaces {
    fn new(mut materials: Vec<crate::description::Material<u32>>, textures: Vec<Texture>) -> Self {
        let default_material = materials.len() as u32;
        let grey = Value::Constant(Rgb::splat(0.5));
        materials.push(crate::description::Material::Diffuse { albedo: grey });
        let textured = materials.iter().map(is_textured).collect();
        let materials = MaterialTable::new(&materials, textures);
        Self { materials, default_material, textured, dangling: Vec::new() }
    }

    /// Whether a material, by index or [`super::NOTHING`], looks at uv.
    pub fn is_textured(&self, material: u32) -> bool {
        self.textured.get(material as usize).is_some_and(|textured| *textured)
    }
}

/// Stands in for a material which cannot be; the frame is not rendered then.
const BLACK: crate::description::Material<u32> =
    crate::description::Material::Mirror { reflectance: Value::Constant(Rgb::ZERO) };

/// Whether a material reads a texture, or refers to another material, which may.
fn is_textured(material: &crate::description::Material<u32>) -> bool {
    material.clone().map_refs::<(), ()>(&mut |_| Err(()), &mut |_| Err(())).is_err()
}

/// Which entity became which index in [`Surfaces`].
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct SurfaceSlots {
    /// Entities with a material, among them those which objects share.
    pub materials: EntityHashMap<u32>,
    /// Entities with a texture.
    pub textures: EntityHashMap<u32>,
}

/// Rebuilds [`Surfaces`] when a texture or a material was added, changed or removed.
///
/// Slots follow the order of the entities, which is that of spawning.
pub fn extract_surfaces(
    changed: Query<(), Or<(Changed<Material>, Changed<Texture>)>>,
    mut removed: (RemovedComponents<Material>, RemovedComponents<Texture>),
    materials: Query<(Entity, &Material)>,
    textures: Query<(Entity, &Texture)>,
    mut surfaces: ResMut<Surfaces>,
    mut slots: ResMut<SurfaceSlots>,
) {
    let gone = removed.0.read().count() + removed.1.read().count();
    if changed.is_empty() && gone == 0 {
        return;
    }
    let texture_slots = in_spawn_order(textures.iter().map(|(entity, _)| entity));
    let mut dangling = Vec::new();
    let texture_of = |entity: Entity| {
        texture_slots.get(&entity).copied().ok_or_else(|| format!("{entity} as a texture"))
    };
    let material_slots = in_spawn_order(materials.iter().map(|(entity, _)| entity));
    let material_of = |entity: Entity| {
        material_slots.get(&entity).copied().ok_or_else(|| format!("{entity} as a material"))
    };
    let mut table: Vec<(u32, crate::description::Material<u32>)> = materials
        .iter()
        .map(|(entity, material)| {
            let indexed = material.clone().map_refs(&mut { texture_of }, &mut { material_of });
            let indexed = indexed.unwrap_or_else(|what| {
                dangling.push(format!("the material of {entity} refers to {what}"));
                BLACK
            });
            (material_slots[&entity], indexed)
        })
        .collect();
    table.sort_unstable_by_key(|(slot, _)| *slot);
    let mut table: Vec<_> = table.into_iter().map(|(_, material)| material).collect();
    while let Some(looped) = material_cycle(&table) {
        let entity = materials.iter().map(|(e, _)| e).find(|e| material_slots[e] == looped);
        let name = entity.map_or_else(String::new, |e| format!(" of {e}"));
        dangling.push(format!("the material{name} is mixed of itself"));
        table[looped as usize] = BLACK;
    }
    let mut images: Vec<(u32, Texture)> = textures
        .iter()
        .map(|(entity, texture)| (texture_slots[&entity], texture.clone()))
        .collect();
    images.sort_unstable_by_key(|(slot, _)| *slot);
    let images: Vec<Texture> = images.into_iter().map(|(_, texture)| texture).collect();
    *surfaces = Surfaces { dangling, ..Surfaces::new(table, images) };
    slots.set_if_neq(SurfaceSlots { materials: material_slots, textures: texture_slots });
}

/// Numbers entities in the order in which they were spawned.
pub(super) fn in_spawn_order(entities: impl Iterator<Item = Entity>) -> EntityHashMap<u32> {
    let mut entities: Vec<Entity> = entities.collect();
    entities.sort_unstable_by_key(|entity| spawn_order(*entity));
    entities.into_iter().zip(0..).collect()
}
