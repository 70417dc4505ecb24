//! Materials and textures as tables.

use super::spawn_order;
use crate::color::spectrum::WavelengthSet;
use crate::description::{GridData, ImageData, Rgb, Value};
use crate::math::{GraphFault, MAX_PARTS_DEPTH, parts_first};
use crate::shade::{MaterialTable, TextureNeeds, Textures, material_order};
use crate::world::{FrameClock, Material, Settings, Texture};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// What surfaces are made of, by index.
#[derive(Resource)]
pub struct Surfaces {
    /// Materials and textures.
    pub materials: MaterialTable,
    /// Index of the grey of objects which have no material and emit nothing.
    pub default_material: u32,
    /// What the textures of a material need to know, by index; `None` where there are none.
    needs: Vec<Option<TextureNeeds>>,
    /// What refers to an entity which is not what it should be, in words.
    pub dangling: Vec<String>,
}

impl Default for Surfaces {
    fn default() -> Self {
        Self::new(Vec::new(), Textures::default())
    }
}

impl Surfaces {
    fn new(mut materials: Vec<crate::description::Material<u32>>, textures: Textures) -> Self {
        let default_material = materials.len() as u32;
        let grey = Value::Constant(Rgb::splat(0.5));
        materials.push(crate::description::Material::Diffuse { albedo: grey });
        let needs = needs_of(&materials, &textures);
        let materials = MaterialTable::new(&materials, textures);
        Self { materials, default_material, needs, dangling: Vec::new() }
    }

    /// The same seen at the wavelengths of a set.
    #[must_use]
    pub fn seen_at(&self, set: &'static WavelengthSet) -> Self {
        let materials = self.materials.seen_at(set);
        Self {
            materials,
            default_material: self.default_material,
            needs: self.needs.clone(),
            dangling: self.dangling.clone(),
        }
    }

    /// What the textures of a material, by index or [`super::NOTHING`], need to know of a point beside
    /// uv; `None` where it looks at no texture.
    pub fn needs(&self, material: u32) -> Option<TextureNeeds> {
        self.needs.get(material as usize).copied().flatten()
    }
}

/// Stands in for a material which cannot be; the frame is not rendered then.
const BLACK: crate::description::Material<u32> =
    crate::description::Material::Mirror { reflectance: Value::Constant(Rgb::ZERO) };

/// What the textures of each material need, those of the materials that it is made of included.
fn needs_of(
    materials: &[crate::description::Material<u32>],
    textures: &Textures,
) -> Vec<Option<TextureNeeds>> {
    let mut needs: Vec<Option<TextureNeeds>> = vec![None; materials.len()];
    for (index, need) in needs.iter_mut().enumerate() {
        let mut open = vec![index as u32];
        let mut seen = HashSet::new();
        while let Some(part) = open.pop() {
            if !seen.insert(part) {
                continue;
            }
            let mut texture = |texture: u32| {
                *need = Some(need.unwrap_or_default().and(textures.needs(texture)));
                Ok::<_, std::convert::Infallible>(())
            };
            let mut material = |material: u32| {
                open.push(material);
                Ok(())
            };
            let part = &materials[part as usize];
            let Ok(_) = part.clone().map_refs(&mut texture, &mut material);
            if let (Some(need), crate::description::Material::NormalMap { .. }) = (&mut *need, part)
            {
                need.tangents = true;
            }
        }
    }
    needs
}

/// A texture whose references are indices.
type IndexedTexture = crate::description::Texture<Arc<ImageData>, Arc<GridData>, u32>;

/// Stands in for a texture which cannot be.
const BLACK_TEXTURE: IndexedTexture = crate::description::Texture::Gradient {
    a: Value::Constant(Rgb::ZERO),
    b: Value::Constant(Rgb::ZERO),
};

/// An order in which each texture comes after those that it refers to.
fn texture_order(textures: &[IndexedTexture]) -> Result<Vec<u32>, GraphFault> {
    let parts = |index: u32| textures[index as usize].refs().map(|(_, part)| *part).collect();
    parts_first(textures.len() as u32, parts)
}

/// The node at fault and what is wrong with it, in words.
fn fault_of(fault: GraphFault) -> (u32, String) {
    match fault {
        GraphFault::Cycle(node) => (node, "is made of itself".to_owned()),
        GraphFault::TooDeep(node) => {
            (node, format!("is made of more than {MAX_PARTS_DEPTH} in a row"))
        }
    }
}

/// Which entity became which index in [`Surfaces`].
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct SurfaceSlots {
    /// Entities with a material, among them those which objects share.
    pub materials: EntityHashMap<u32>,
    /// Entities with a texture.
    pub textures: EntityHashMap<u32>,
}

/// Rebuilds [`Surfaces`] when a texture or a material was added, changed or removed, and writes it when textures drift.
///
/// Slots follow the order of the entities, which is that of spawning.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the tables depend on")]
pub fn extract_surfaces(
    changed: Query<(), Or<(Changed<Material>, Changed<Texture>)>>,
    settings: Res<Settings>,
    clock: Res<FrameClock>,
    mut removed: (RemovedComponents<Material>, RemovedComponents<Texture>),
    materials: Query<(Entity, &Material)>,
    textures: Query<(Entity, &Texture)>,
    mut surfaces: ResMut<Surfaces>,
    mut slots: ResMut<SurfaceSlots>,
) {
    let gone = removed.0.read().count() + removed.1.read().count();
    let filtering = settings.0.texture_filter;
    let textures_now = surfaces.materials.textures();
    let shutter = clock.shutter();
    if changed.is_empty() && gone == 0 && textures_now.filtering() == filtering {
        if textures_now.must_go_to(shutter) {
            surfaces.materials.go_to(shutter);
        }
        return;
    }
    let pyramids = textures_now.pyramids();
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
    while let Err(fault) = material_order(&table) {
        let (slot, what) = fault_of(fault);
        let entity = materials.iter().map(|(e, _)| e).find(|e| material_slots[e] == slot);
        let name = entity.map_or_else(String::new, |e| format!(" of {e}"));
        dangling.push(format!("the material{name} {what}"));
        table[slot as usize] = BLACK;
    }
    let mut list: Vec<(u32, IndexedTexture)> = Vec::with_capacity(textures.iter().len());
    for (entity, texture) in &textures {
        let (image, grid) = (|image, _| Ok(image), Ok);
        let indexed =
            texture.clone().map_refs(image, grid, &mut { texture_of }).unwrap_or_else(|what| {
                dangling.push(format!("the texture of {entity} refers to {what}"));
                BLACK_TEXTURE
            });
        list.push((texture_slots[&entity], indexed));
    }
    list.sort_unstable_by_key(|(slot, _)| *slot);
    let mut list: Vec<IndexedTexture> = list.into_iter().map(|(_, texture)| texture).collect();
    while let Err(fault) = texture_order(&list) {
        let (slot, what) = fault_of(fault);
        let entity = textures.iter().map(|(e, _)| e).find(|e| texture_slots[e] == slot);
        let name = entity.map_or_else(String::new, |e| format!(" of {e}"));
        dangling.push(format!("the texture{name} {what}"));
        list[slot as usize] = BLACK_TEXTURE;
    }
    let textures = Textures::new(list, filtering, &pyramids).at_time(shutter);
    *surfaces = Surfaces { dangling, ..Surfaces::new(table, textures) };
    slots.set_if_neq(SurfaceSlots { materials: material_slots, textures: texture_slots });
}

/// Numbers entities in the order in which they were spawned.
pub(super) fn in_spawn_order(entities: impl Iterator<Item = Entity>) -> EntityHashMap<u32> {
    let mut entities: Vec<Entity> = entities.collect();
    entities.sort_unstable_by_key(|entity| spawn_order(*entity));
    entities.into_iter().zip(0..).collect()
}
