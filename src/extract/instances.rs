//! Objects as a flat table of instances.

use super::{FrameOrigin, SurfaceSlots, Surfaces, spawn_order};
use crate::description::TriangleMesh;
use crate::math::{Aabb, MotionTransform};
use crate::shape::Primitive;
use crate::world::{
    Deformation, Emission, HiddenFromCamera, MadeOf, Material, Mesh, Name, Shape, ShutterMotion,
    VertexMotion, Vertices,
};
use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::prelude::*;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// The index which stands for "none": no material, no emission.
pub const NOTHING: u32 = u32::MAX;

/// The form of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// An analytic shape in its canonical space.
    Primitive(Primitive),
    /// Index into the [`Meshes`].
    Mesh(u32),
}

/// An object as the renderer sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Its form.
    pub geometry: Geometry,
    /// Render space from the space of the geometry.
    pub motion: MotionTransform,
    /// Around the geometry during the whole shutter, in render space; infinite for a plane.
    pub bounds: Aabb,
    /// Index into the materials; [`NOTHING`] absorbs everything.
    pub material: u32,
    /// Index into the emissions, or [`NOTHING`].
    pub emission: u32,
    /// From 1, in the order of names.
    pub object_id: u32,
    /// Whether its material or emission looks at uv.
    pub needs_uv: bool,
    /// Whether camera rays pass through it.
    pub hidden_from_camera: bool,
}

/// All meshes, in the order of spawning.
#[derive(Resource, Clone, Debug, Default)]
pub struct Meshes {
    /// Their triangles, as the shutter opens.
    pub list: Vec<Arc<TriangleMesh>>,
    /// For each its other keys over the shutter, evenly spaced up to the closing; empty for a mesh
    /// which keeps its form. `list` holds the first key.
    pub later_keys: Vec<Arc<Vec<Vertices>>>,
    slots: EntityHashMap<(u32, Aabb)>,
}

/// Writes [`Meshes`] when one was added, replaced, removed or deformed.
pub fn extract_meshes(
    changed: Query<(), (With<Mesh>, Or<(Changed<Mesh>, Changed<VertexMotion>)>)>,
    mut removed: RemovedComponents<Mesh>,
    mut rigid: RemovedComponents<Deformation>,
    meshes: Query<(Entity, &Mesh, Option<&VertexMotion>, Has<Deformation>)>,
    mut table: ResMut<Meshes>,
) {
    if changed.is_empty() && removed.read().count() + rigid.read().count() == 0 {
        return;
    }
    let mut found: Vec<_> = meshes.iter().collect();
    found.sort_unstable_by_key(|(entity, ..)| spawn_order(*entity));
    let table = &mut *table;
    table.list.clear();
    table.later_keys.clear();
    table.slots.clear();
    for ((entity, mesh, motion, deforms), slot) in found.into_iter().zip(0..) {
        let (data, later, bounds) = match motion.filter(|_| deforms) {
            Some(motion) => (&motion.opening, motion.later.clone(), motion.bounds),
            None => (mesh.data(), Arc::default(), mesh.bounds()),
        };
        table.list.push(data.clone());
        table.later_keys.push(later);
        table.slots.insert(entity, (slot, bounds));
    }
}

/// All objects, in the order of spawning.
#[derive(Resource, Clone, Debug, Default)]
pub struct Instances {
    /// The objects.
    pub list: Vec<Instance>,
    /// Slot of each entity in `list`.
    slots: EntityHashMap<u32>,
    /// How many were written in this frame.
    pub rewritten: usize,
    /// What refers to an entity which is not what it should be, in words.
    pub dangling: Vec<String>,
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

/// Writes [`Instances`]: all of it when objects came or went, when the origin moved or materials
/// were renumbered, otherwise those which moved.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the table depends on")]
pub fn extract_instances(
    origin: Res<FrameOrigin>,
    slots: Res<SurfaceSlots>,
    surfaces: Res<Surfaces>,
    objects: ObjectQuery,
    meshes: Res<Meshes>,
    moved: Query<Entity, (With<Shape>, Changed<ShutterMotion>)>,
    restructured: Query<
        (),
        (
            With<Shape>,
            Or<(
                Changed<Shape>,
                Changed<MadeOf>,
                Changed<Name>,
                Added<Emission>,
                Added<Material>,
                Added<HiddenFromCamera>,
            )>,
        ),
    >,
    mut removed: (
        RemovedComponents<Shape>,
        RemovedComponents<MadeOf>,
        RemovedComponents<HiddenFromCamera>,
    ),
    mut table: ResMut<Instances>,
) {
    let gone = removed.0.read().count() + removed.1.read().count() + removed.2.read().count();
    let all = origin.is_changed()
        || surfaces.is_changed()
        || !restructured.is_empty()
        || meshes.is_changed()
        || gone > 0;
    if !all && moved.is_empty() {
        if table.rewritten != 0 {
            table.bypass_change_detection().rewritten = 0;
        }
        return;
    }
    let table = &mut *table;
    if all {
        let mut entities: Vec<Entity> = objects.iter().map(|object| object.0).collect();
        entities.sort_unstable_by_key(|entity| spawn_order(*entity));
        let mut by_name: Vec<(&str, Entity)> = objects
            .iter()
            .map(|(entity, _, _, name, ..)| (name.map_or("", |name| name.as_str()), entity))
            .collect();
        by_name.sort_unstable_by_key(|(name, entity)| (*name, spawn_order(*entity)));
        let ids: EntityHashMap<u32> =
            by_name.into_iter().zip(1..).map(|((_, entity), id)| (entity, id)).collect();
        table.list.clear();
        table.slots.clear();
        table.dangling.clear();
        for entity in entities {
            let Ok((_, shape, motion, _, made_of, own_material, emits, hidden)) =
                objects.get(entity)
            else {
                continue;
            };
            if let Shape::Mesh(mesh) = shape
                && !meshes.slots.contains_key(mesh)
            {
                table.dangling.push(format!("the shape of {entity} refers to {mesh} as a mesh"));
            }
            if let Some(MadeOf(shared)) = made_of
                && !slots.materials.contains_key(shared)
            {
                table.dangling.push(format!("{entity} is made of {shared}, which has no material"));
            }
            let Some(instance) =
                instance(shape, motion, origin.0, &meshes).map(|(geometry, motion, bounds)| {
                    let material = match made_of {
                        Some(MadeOf(shared)) => Some(*shared),
                        None => own_material.then_some(entity),
                    };
                    let material = match material.and_then(|m| slots.materials.get(&m)) {
                        Some(slot) => *slot,
                        None if emits => NOTHING,
                        None => surfaces.default_material,
                    };
                    let emission = if emits { slots.emissions[&entity] } else { NOTHING };
                    Instance {
                        geometry,
                        motion,
                        bounds,
                        material,
                        emission,
                        needs_uv: surfaces.needs_uv(material, emission),
                        object_id: ids[&entity],
                        hidden_from_camera: hidden,
                    }
                })
            else {
                continue;
            };
            table.slots.insert(entity, table.list.len() as u32);
            table.list.push(instance);
        }
        table.rewritten = table.list.len();
        return;
    }
    table.rewritten = 0;
    for entity in &moved {
        let (Ok((_, shape, motion, ..)), Some(&slot)) =
            (objects.get(entity), table.slots.get(&entity))
        else {
            continue;
        };
        if let Some((_, motion, bounds)) = instance(shape, motion, origin.0, &meshes) {
            let slot = &mut table.list[slot as usize];
            (slot.motion, slot.bounds) = (motion, bounds);
            table.rewritten += 1;
        }
    }
}

/// Geometry, motion and bounds of an object; `None` for a shape without extent or a mesh which does
/// not exist.
fn instance(
    shape: &Shape,
    motion: &ShutterMotion,
    origin: DVec3,
    meshes: &Meshes,
) -> Option<(Geometry, MotionTransform, Aabb)> {
    let (geometry, scale, bounds) = match *shape {
        Shape::Sphere { radius } => canonical(Primitive::Sphere, DVec3::splat(radius)),
        Shape::Rectangle { size } => canonical(Primitive::Rectangle, size.extend(1.0)),
        Shape::Disk { radius } => canonical(Primitive::Disk, DVec3::new(radius, radius, 1.0)),
        Shape::Plane {} => canonical(Primitive::Plane, DVec3::ONE),
        Shape::Box { size } => canonical(Primitive::Cuboid, size),
        Shape::Cylinder { radius, height, capped } => {
            canonical(Primitive::Cylinder { capped }, DVec3::new(radius, height, radius))
        }
        Shape::Cone { radius, height, capped } => {
            canonical(Primitive::Cone { capped }, DVec3::new(radius, height, radius))
        }
        Shape::Mesh(mesh) => {
            let (slot, bounds) = *meshes.slots.get(&mesh)?;
            (Geometry::Mesh(slot), DVec3::ONE, bounds)
        }
    };
    let keys: Vec<DAffine3> = motion
        .keys
        .iter()
        .map(|key| DAffine3 {
            matrix3: key.matrix3 * DMat3::from_diagonal(scale),
            translation: key.translation - origin,
        })
        .collect();
    // A map which flattens space has no inverse, and its surface no area to hit.
    if keys.iter().any(|key| key.matrix3.determinant() == 0.0 || !key.is_finite()) {
        return None;
    }
    let motion = MotionTransform::new(&keys);
    let bounds = match geometry {
        Geometry::Primitive(Primitive::Plane) => bounds,
        _ => shutter_bounds(&bounds, &keys, &motion),
    };
    Some((geometry, motion, bounds))
}

fn canonical(primitive: Primitive, scale: DVec3) -> (Geometry, DVec3, Aabb) {
    (Geometry::Primitive(primitive), scale, primitive.bounds())
}

/// A box around `bounds` carried along the motion.
///
/// Between two keys a point `q(s) = lerp(S₀p, S₁p, s)` is turned by `R(s)`, an angle `θ` in all. It
/// strays from the chord between its two ends by at most `r(1 − cos ½θ) + ½·sin ½θ·|S₁p − S₀p|`, with
/// `r` the greatest `|q|`: the sagitta of its arc, and what the change of its radius adds on the way.
/// Boxes around the keys, padded by that, hold the segment.
fn shutter_bounds(bounds: &Aabb, keys: &[DAffine3], motion: &MotionTransform) -> Aabb {
    let around_keys = keys.iter().fold(Aabb::EMPTY, |all, key| all.union(bounds.transformed(key)));
    let MotionTransform::Moving { keys: split } = motion else { return around_keys };
    let corners = bounds.corners().map(glam::Vec3::as_dvec3);
    let mut pad = 0.0_f64;
    for pair in split.windows(2) {
        let half = 0.5 * pair[0].rotation.angle_between(pair[1].rotation);
        let half = half.min(std::f64::consts::PI - half);
        let (mut reach, mut stretch) = (0.0_f64, 0.0_f64);
        for corner in corners {
            let (a, b) = (pair[0].stretch * corner, pair[1].stretch * corner);
            reach = reach.max(a.length()).max(b.length());
            stretch = stretch.max(a.distance(b));
        }
        // 1 − cos x = 2 sin²(x/2), without cancellation
        let sagitta = reach * 2.0 * (0.5 * half).sin().powi(2);
        pad = pad.max(sagitta + 0.5 * half.sin() * stretch);
    }
    around_keys.inflated((pad as f32).next_up())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, Vec3};

    /// Oracle: points of the box carried along the motion at many times lie within the bounds; the
    /// bounds are not much larger than they need to be.
    #[test]
    fn bounds_hold_the_whole_motion() {
        let shape = Aabb { min: Vec3::new(-1.0, -0.2, 0.0), max: Vec3::new(2.0, 0.3, 0.5) };
        for case in 0..40_u8 {
            let a = f64::from(case);
            let key = |t: f64| {
                DAffine3::from_scale_rotation_translation(
                    DVec3::new(1.0 + 0.3 * t * a.sin(), 1.0, 1.0 + 0.5 * t),
                    DQuat::from_scaled_axis(DVec3::new(a.sin(), a.cos(), 0.3) * t * 0.5),
                    DVec3::new(a, 2.0 * t, -t) * 0.3,
                ) * DAffine3::from_scale(DVec3::new(1.0, 1.0 + 0.2 * a.cos(), 1.0))
            };
            let keys: Vec<_> = (0..3).map(|k| key(f64::from(k) / 2.0)).collect();
            let motion = MotionTransform::new(&keys);
            let bounds = shutter_bounds(&shape, &keys, &motion);
            let mut tight = Aabb::EMPTY;
            for k in 0..=200_u16 {
                tight = tight.union(shape.transformed(&motion.at(f32::from(k) / 200.0)));
            }
            assert_eq!(bounds.union(tight).inflated(0.0), bounds.inflated(0.0), "case {case}");
            assert!(bounds.area() < 1.6 * tight.area(), "case {case}");
        }
    }
}
