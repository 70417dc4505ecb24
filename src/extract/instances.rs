//! Objects as a flat table of instances.

use super::displace::Displaced;
use super::instance::{Instance, NOTHING, Place, Placed, placed};
use super::{Emissions, FrameOrigin, SurfaceSlots, Surfaces, object_ids, spawn_order};
use crate::description::TriangleMesh;
use crate::math::Aabb;
use crate::shade::TextureNeeds;
use crate::world::{
    Deformation, Displacement, Emission, HiddenFromCamera, MadeOf, Material, Mesh, Name, Shape,
    ShutterMotion, VertexMotion, Vertices,
};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Objects that one thread places before it is worth asking another.
const PLACED_AT_ONCE: usize = 256;

/// All meshes, in the order of spawning.
#[derive(Resource, Clone, Debug, Default)]
pub struct Meshes {
    /// Their triangles, as the shutter opens.
    pub list: Vec<Arc<TriangleMesh>>,
    /// For each its other keys over the shutter, evenly spaced up to the closing; empty for a mesh
    /// which keeps its form. `list` holds the first key.
    pub later_keys: Vec<Arc<Vec<Vertices>>>,
    slots: EntityHashMap<(u32, Aabb)>,
    /// For each the box around it during the whole shutter.
    pub(crate) bounds: Vec<Aabb>,
}

impl Meshes {
    /// The index of the mesh of an entity, and the box around it.
    pub(super) fn slot(&self, entity: Entity) -> Option<(u32, Aabb)> {
        self.slots.get(&entity).copied()
    }
}

/// Writes [`Meshes`] when one was added, replaced, removed or deformed.
pub fn extract_meshes(
    changed: Query<
        (),
        (With<Mesh>, Or<(Changed<Mesh>, Changed<VertexMotion>, Changed<Displaced>)>),
    >,
    mut removed: RemovedComponents<Mesh>,
    mut rigid: (RemovedComponents<Deformation>, RemovedComponents<Displacement>),
    meshes: Query<(
        Entity,
        &Mesh,
        Option<&VertexMotion>,
        Has<Deformation>,
        Option<&Displaced>,
        Has<Displacement>,
    )>,
    mut table: ResMut<Meshes>,
) {
    let gone = removed.read().count() + rigid.0.read().count() + rigid.1.read().count();
    if changed.is_empty() && gone == 0 {
        return;
    }
    let mut found: Vec<_> = meshes.iter().collect();
    found.sort_unstable_by_key(|(entity, ..)| spawn_order(*entity));
    let table = &mut *table;
    table.list.clear();
    table.later_keys.clear();
    table.bounds.clear();
    table.slots.clear();
    for ((entity, mesh, motion, deforms, displaced, moved), slot) in found.into_iter().zip(0..) {
        let (data, later, bounds) = match (motion.filter(|_| deforms), displaced.filter(|_| moved))
        {
            (Some(motion), _) => (&motion.opening, motion.later.clone(), motion.bounds),
            (None, Some(displaced)) => (&displaced.mesh, Arc::default(), displaced.bounds),
            (None, None) => (mesh.data(), Arc::default(), mesh.bounds()),
        };
        table.list.push(data.clone());
        table.later_keys.push(later);
        table.bounds.push(bounds);
        table.slots.insert(entity, (slot, bounds));
    }
}

/// All objects, in the order of spawning.
#[derive(Resource, Clone, Debug, Default)]
pub struct Instances {
    /// The objects.
    pub list: Vec<Instance>,
    /// Slot of each entity in `list`, and the entity of each slot.
    slots: EntityHashMap<u32>,
    entities: Vec<Entity>,
    /// For each slot what the origin of the frame is taken from.
    places: Vec<Place>,
    /// The slots which were written in this frame, ascending.
    pub rewritten_slots: Vec<u32>,
    /// Whether slots have other numbers or other geometry than in the frame before: then all of them
    /// were written. Otherwise those in `rewritten_slots` are elsewhere and the others as they were.
    pub restructured: bool,
    /// Whether anything that was written emits, or slots have other numbers.
    pub emitters_rewritten: bool,
    /// How many move within the shutter.
    pub moving: usize,
    /// What refers to an entity which is not what it should be, in words.
    pub dangling: Vec<String>,
    /// Whether the stages after this one have not seen the last change.
    unseen: bool,
}

impl Instances {
    /// The index of the instance of an entity.
    pub(super) fn slot(&self, entity: Entity) -> Option<u32> {
        self.slots.get(&entity).copied()
    }

    /// The entity of an instance.
    pub(crate) fn entity(&self, slot: u32) -> Option<Entity> {
        self.entities.get(slot as usize).copied()
    }

    /// Has all of the table written anew in the next frame: its changes were not built upon.
    pub(crate) fn mark_unseen(&mut self) {
        self.unseen = true;
    }

    /// Nothing is written yet in this frame.
    fn begin(&mut self) {
        self.rewritten_slots.clear();
        self.restructured = false;
        self.emitters_rewritten = false;
    }

    /// Puts an object elsewhere.
    fn replace(&mut self, slot: u32, placed: Placed) {
        let instance = &mut self.list[slot as usize];
        self.moving -= usize::from(!instance.motion.is_static());
        self.moving += usize::from(!placed.motion.is_static());
        (instance.motion, instance.bounds) = (placed.motion, placed.bounds);
        self.places[slot as usize] = placed.place;
        self.emitters_rewritten |= instance.emission != NOTHING;
        self.rewritten_slots.push(slot);
    }

    /// Sees everything at rest from another origin.
    fn follow(&mut self, origin: DVec3) {
        self.list
            .par_iter_mut()
            .zip(&self.places)
            .with_min_len(PLACED_AT_ONCE)
            .for_each(|(instance, place)| instance.follow(place, origin));
        self.rewritten_slots.clear();
        self.rewritten_slots.extend(0..self.list.len() as u32);
        self.emitters_rewritten = self.list.iter().any(|instance| instance.emission != NOTHING);
    }
}

type ObjectQuery<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        &'static Shape,
        &'static ShutterMotion,
        Option<&'static Name>,
        Option<&'static MadeOf>,
        Has<Material>,
        Has<Emission>,
        Has<HiddenFromCamera>,
    ),
>;

/// What of an object is more than its place.
type Restructured = Or<(
    Changed<Shape>,
    Changed<MadeOf>,
    Changed<Name>,
    Added<Emission>,
    Added<Material>,
    Added<HiddenFromCamera>,
)>;

/// Writes [`Instances`]: all of it when objects came or went or materials were renumbered, the places of
/// all when the origin moved, otherwise those which moved.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the table depends on")]
pub fn extract_instances(
    origin: Res<FrameOrigin>,
    slots: Res<SurfaceSlots>,
    surfaces: Res<Surfaces>,
    emissions: Res<Emissions>,
    objects: ObjectQuery,
    meshes: Res<Meshes>,
    moved: Query<Entity, (With<Shape>, Changed<ShutterMotion>)>,
    restructured: Query<(), (With<Shape>, Restructured)>,
    mut removed: (
        RemovedComponents<Shape>,
        RemovedComponents<MadeOf>,
        RemovedComponents<HiddenFromCamera>,
    ),
    mut table: ResMut<Instances>,
) {
    let gone = removed.0.read().count() + removed.1.read().count() + removed.2.read().count();
    let all = table.unseen
        || surfaces.is_changed()
        || emissions.restructured
        || meshes.is_changed()
        || gone > 0
        || !restructured.is_empty();
    if !all && !origin.is_changed() && moved.is_empty() {
        if !table.rewritten_slots.is_empty() || table.restructured {
            table.bypass_change_detection().begin();
        }
        return;
    }
    let scene =
        Scene { origin: origin.0, slots: &slots, surfaces: &surfaces, emissions: &emissions };
    let table = &mut *table;
    table.begin();
    let in_place =
        !all && replace_moved(table, &objects, &moved, &meshes, origin.is_changed(), origin.0);
    if !in_place {
        write_all(table, &objects, &meshes, &scene);
    }
}

/// Writes what moved; false when an object became flat or ceased to be so, which changes the numbers of
/// those after it.
fn replace_moved(
    table: &mut Instances,
    objects: &ObjectQuery,
    moved: &Query<Entity, (With<Shape>, Changed<ShutterMotion>)>,
    meshes: &Meshes,
    origin_moved: bool,
    origin: DVec3,
) -> bool {
    let blurred = |slot: &usize| origin_moved && !table.list[*slot].motion.is_static();
    let blurred = (0..table.list.len()).filter(blurred).map(|slot| table.entities[slot]);
    let mut elsewhere: Vec<Entity> = moved.iter().collect();
    if origin_moved && table.moving > 0 {
        elsewhere.extend(blurred);
        elsewhere.sort_unstable();
        elsewhere.dedup();
    }
    let object = |entity: Entity| objects.get(entity).ok().map(|object| (object.1, object.2));
    let jobs: Vec<(Option<u32>, &Shape, &ShutterMotion)> = elsewhere
        .into_iter()
        .filter_map(|entity| {
            object(entity).map(|(shape, motion)| (table.slots.get(&entity).copied(), shape, motion))
        })
        .collect();
    let mut placed: Vec<(Option<u32>, Option<Placed>)> = jobs
        .into_par_iter()
        .with_min_len(PLACED_AT_ONCE)
        .map(|(slot, shape, motion)| (slot, placed(shape, motion, origin, meshes)))
        .collect();
    if placed.iter().any(|(slot, placed)| slot.is_some() != placed.is_some()) {
        return false;
    }
    placed.sort_unstable_by_key(|(slot, _)| *slot);
    for (slot, placed) in placed {
        if let (Some(slot), Some(placed)) = (slot, placed) {
            table.replace(slot, placed);
        }
    }
    if origin_moved {
        table.follow(origin);
    }
    true
}

/// What an object refers to.
struct Scene<'a> {
    origin: DVec3,
    slots: &'a SurfaceSlots,
    surfaces: &'a Surfaces,
    emissions: &'a Emissions,
}

/// Writes the whole table.
fn write_all(table: &mut Instances, objects: &ObjectQuery, meshes: &Meshes, scene: &Scene) {
    let mut entities: Vec<Entity> = objects.iter().map(|object| object.0).collect();
    entities.sort_unstable_by_key(|entity| spawn_order(*entity));
    let ids = numbered(objects);
    let places: Vec<Option<Placed>> = {
        let object = |entity: &Entity| objects.get(*entity).ok();
        let jobs: Vec<_> = entities.iter().map(object).map(|o| o.map(|o| (o.1, o.2))).collect();
        let place = |(shape, motion)| placed(shape, motion, scene.origin, meshes);
        jobs.into_par_iter().with_min_len(PLACED_AT_ONCE).map(|job| job.and_then(place)).collect()
    };
    table.list.clear();
    table.slots.clear();
    table.entities.clear();
    table.places.clear();
    table.dangling.clear();
    table.moving = 0;
    for (entity, placed) in entities.into_iter().zip(places) {
        let Ok((_, shape, _, _, made_of, own_material, emits, hidden)) = objects.get(entity) else {
            continue;
        };
        if let Shape::Mesh(mesh) = shape
            && meshes.slot(*mesh).is_none()
        {
            table.dangling.push(format!("the shape of {entity} refers to {mesh} as a mesh"));
        }
        if let Some(MadeOf(shared)) = made_of
            && !scene.slots.materials.contains_key(shared)
        {
            table.dangling.push(format!("{entity} is made of {shared}, which has no material"));
        }
        let Some(Placed { geometry, size, motion, bounds, place }) = placed else { continue };
        let material = match made_of {
            Some(MadeOf(shared)) => Some(*shared),
            None => own_material.then_some(entity),
        };
        let material = match material.and_then(|m| scene.slots.materials.get(&m)) {
            Some(slot) => *slot,
            None if emits => NOTHING,
            None => scene.surfaces.default_material,
        };
        let emission = if emits { scene.emissions.slots[&entity] } else { NOTHING };
        let textures = scene.surfaces.materials.textures();
        let emitted = scene.emissions.texture(emission).map(|texture| textures.needs(texture));
        let needs = [scene.surfaces.needs(material), emitted].into_iter().flatten();
        let needs = needs.reduce(TextureNeeds::and);
        let object_id = ids[&entity];
        table.moving += usize::from(!motion.is_static());
        table.slots.insert(entity, table.list.len() as u32);
        table.entities.push(entity);
        table.places.push(place);
        table.list.push(Instance {
            geometry,
            motion,
            bounds,
            material,
            emission,
            object_id,
            needs_uv: needs.is_some(),
            needs: needs.unwrap_or_default(),
            size,
            hidden_from_camera: hidden,
        });
    }
    table.rewritten_slots.clear();
    table.rewritten_slots.extend(0..table.list.len() as u32);
    table.restructured = true;
    table.emitters_rewritten = true;
    table.unseen = false;
}

/// A number for every object.
fn numbered(objects: &ObjectQuery) -> EntityHashMap<u32> {
    let mut by_name: Vec<(&str, Entity)> = objects
        .iter()
        .map(|(entity, _, _, name, ..)| (name.map_or("", |name| name.as_str()), entity))
        .collect();
    by_name.sort_unstable_by_key(|(name, entity)| (*name, spawn_order(*entity)));
    let ids = object_ids(by_name.iter().map(|(name, _)| *name));
    by_name.iter().map(|(_, entity)| *entity).zip(ids).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Simulation;
    use crate::world::{Camera, Transform};

    const OBJECTS: usize = 20;

    /// A world with a camera and then spheres at these places.
    fn world_of(places: &[Transform]) -> (Simulation, Vec<Entity>) {
        let mut simulation = Simulation::new();
        let world = simulation.world_mut();
        let mut entities = vec![world.spawn((Camera::default(), places[0])).id()];
        let sphere = |place: &Transform| (Shape::Sphere { radius: 0.3 }, *place);
        entities.extend(places[1..].iter().map(|place| world.spawn(sphere(place)).id()));
        simulation.prepare_frame(0).expect("a camera");
        (simulation, entities)
    }

    /// Oracle: a new world in the same state has the same table. One sphere moves, becomes flat, comes
    /// back, the camera moves, nothing moves: of all that only what must be is written.
    #[test]
    fn what_is_written_in_place_is_what_a_new_world_gets() {
        let at = |x: f64| Transform { translation: DVec3::new(x, 0.1, -5.0), ..Default::default() };
        let mut places: Vec<Transform> = (0..=OBJECTS).map(|k| at(k as f64)).collect();
        let (mut old, entities) = world_of(&places);
        let mut change = |index: usize, place: Transform| {
            if places[index] != place {
                places[index] = place;
                *old.world_mut().get_mut::<Transform>(entities[index]).expect("placed") = place;
            }
            old.prepare_frame(0).expect("a camera");
            let (new, _) = world_of(&places);
            let table = old.world().resource::<Instances>();
            assert_eq!(table.list, new.world().resource::<Instances>().list);
            (table.rewritten_slots.clone(), table.restructured)
        };
        let all: Vec<u32> = (0..OBJECTS as u32).collect();
        assert_eq!(change(4, at(-7.3)), (vec![3], false));
        assert_eq!(change(4, at(-7.3)), (vec![], false), "nothing moved");
        let flat = Transform { scale: DVec3::new(1.0, 0.0, 1.0), ..at(2.0) };
        assert_eq!(change(9, flat), (all[1..].iter().map(|k| k - 1).collect(), true));
        assert_eq!(change(9, at(2.0)), (all.clone(), true));
        assert_eq!(change(0, at(0.37)), (all, false), "the camera moved");
    }
}
