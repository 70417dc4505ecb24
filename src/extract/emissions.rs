//! What surfaces emit, as a table.

use super::SurfaceSlots;
use super::surfaces::in_spawn_order;
use crate::description::{EmissionStrength, Rgb, Value};
use crate::world::{Emission, EmissionFactor};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;

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

/// The emissions of shapes, by index.
#[derive(Resource, Clone, Debug, Default)]
pub struct Emissions {
    /// The emissions, in the order of spawning.
    pub list: Vec<SurfaceEmission>,
    /// Index of each object that emits.
    pub slots: EntityHashMap<u32>,
    /// Whether more than factors changed in this frame.
    pub restructured: bool,
    /// What refers to an entity which is not what it should be, in words.
    pub dangling: Vec<String>,
}

impl Emissions {
    /// The texture that an emission, by index or [`super::NOTHING`], looks at.
    pub fn texture(&self, emission: u32) -> Option<u32> {
        match self.list.get(emission as usize)?.strength {
            EmissionStrength::Radiance(Value::Texture(texture)) => Some(texture),
            _ => None,
        }
    }
}

/// Writes [`Emissions`]: all of it when an emission was added, changed or removed, or textures have other
/// numbers; otherwise the factors that changed.
pub fn extract_emissions(
    slots: Res<SurfaceSlots>,
    changed: Query<(), Changed<Emission>>,
    mut removed: (RemovedComponents<Emission>, RemovedComponents<EmissionFactor>),
    dimmed: Query<(Entity, &EmissionFactor), (Changed<EmissionFactor>, With<Emission>)>,
    emissions: Query<(Entity, &Emission, Option<&EmissionFactor>)>,
    mut table: ResMut<Emissions>,
) {
    let gone = removed.0.read().count() + removed.1.read().count();
    if slots.is_changed() || gone > 0 || !changed.is_empty() {
        *table = restructured(&slots, emissions);
        return;
    }
    if table.restructured {
        table.bypass_change_detection().restructured = false;
    }
    for (entity, factor) in &dimmed {
        let Some(&slot) = table.slots.get(&entity) else { continue };
        table.list[slot as usize].factor = factor.0 as f32;
    }
}

fn restructured(
    slots: &SurfaceSlots,
    emissions: Query<(Entity, &Emission, Option<&EmissionFactor>)>,
) -> Emissions {
    let mut dangling = Vec::new();
    let emission_slots = in_spawn_order(emissions.iter().map(|(entity, ..)| entity));
    let texture_of = |entity: Entity| {
        slots.textures.get(&entity).copied().ok_or_else(|| format!("{entity} as a texture"))
    };
    let mut emitted: Vec<(u32, SurfaceEmission)> = emissions
        .iter()
        .map(|(entity, emission, factor)| {
            let strength = match emission.clone().map_ref(&mut { texture_of }) {
                Ok(indexed) => indexed.strength,
                Err(what) => {
                    dangling.push(format!("the emission of {entity} refers to {what}"));
                    EmissionStrength::Power(Rgb::ZERO)
                }
            };
            let factor = factor.map_or(1.0, |f| f.0 as f32);
            let emission = SurfaceEmission { strength, factor, two_sided: emission.two_sided };
            (emission_slots[&entity], emission)
        })
        .collect();
    emitted.sort_unstable_by_key(|(slot, _)| *slot);
    let list = emitted.into_iter().map(|(_, emission)| emission).collect();
    Emissions { list, slots: emission_slots, restructured: true, dangling }
}

#[cfg(test)]
mod tests {
    use super::super::{Instances, Surfaces};
    use super::*;
    use crate::build::light::LightTable;
    use crate::frame::Simulation;
    use crate::world::{Camera, Material, Shape};

    /// A lamp whose factor changes writes that and the table of lights; materials and instances stay as
    /// they are. Another strength is written as well, and what is written is what a new world gets.
    #[test]
    fn a_dimmed_lamp_leaves_the_materials_alone() {
        let spawn = |simulation: &mut Simulation| {
            let world = simulation.world_mut();
            world.spawn(Camera::default());
            world.spawn((
                Shape::Sphere { radius: 1.0 },
                Material::Plastic { albedo: Rgb::ONE.into(), ior: 1.5, roughness: 0.3.into() },
            ));
            let strength = EmissionStrength::Radiance(Rgb::ONE.into());
            let lamp = Emission { strength, two_sided: false };
            world.spawn((Shape::Sphere { radius: 0.5 }, lamp)).id()
        };
        let mut simulation = Simulation::new();
        let lamp = spawn(&mut simulation);
        simulation.prepare_frame(0).expect("a camera");
        let written = |simulation: &Simulation| {
            let world = simulation.world();
            let surfaces = world.resource_ref::<Surfaces>().last_changed();
            (surfaces, world.resource_ref::<Instances>().last_changed())
        };
        let before = written(&simulation);
        simulation.world_mut().entity_mut(lamp).insert(EmissionFactor(0.25));
        simulation.prepare_frame(1).expect("a camera");
        assert_eq!(written(&simulation), before);
        let world = simulation.world();
        assert_eq!(world.resource::<Emissions>().list[0].factor, 0.25);
        assert!(world.resource::<LightTable>().built);
        simulation.prepare_frame(2).expect("a camera");
        assert!(!simulation.world().resource::<LightTable>().built, "nothing changed");

        simulation.world_mut().get_mut::<Emission>(lamp).expect("spawned").two_sided = true;
        simulation.prepare_frame(3).expect("a camera");
        let mut new = Simulation::new();
        let lamp = spawn(&mut new);
        new.world_mut().entity_mut(lamp).insert(EmissionFactor(0.25));
        new.world_mut().get_mut::<Emission>(lamp).expect("spawned").two_sided = true;
        new.prepare_frame(3).expect("a camera");
        let list =
            |simulation: &Simulation| simulation.world().resource::<Emissions>().list.clone();
        assert_eq!(list(&simulation), list(&new));
        assert!(list(&new)[0].two_sided);
    }
}
