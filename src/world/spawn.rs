//! From a description to a world: names become entities.

use super::{
    ActiveCamera, Camera, ChildOf, Deformation, Emission, FrameClock, HiddenFromCamera, Light,
    MadeOf, Material, Mesh, Name, Settings, Shape, Texture,
};
use crate::description::{Displacement, EntityDescription, ImageData, SceneDescription};
use bevy_ecs::prelude::*;
use indexmap::IndexMap;
use std::convert::Infallible;
use std::sync::Arc;

/// The entities of a scene by their names, in the order of the file.
#[derive(Clone, Debug)]
pub struct SceneEntities {
    /// The camera to look through; it carries [`ActiveCamera`].
    pub camera: Entity,
    /// Textures.
    pub textures: IndexMap<String, Entity>,
    /// Materials; a [`Material`] component on each.
    pub materials: IndexMap<String, Entity>,
    /// Meshes.
    pub meshes: IndexMap<String, Entity>,
    /// Everything that stands in the scene.
    pub entities: IndexMap<String, Entity>,
}

/// Fills a world with a scene: one entity each, with its [`Name`], for every texture, material,
/// mesh and thing of the scene, and the resources [`FrameClock`] (at the first frame) and
/// [`Settings`].
///
/// # Panics
/// If a reference names nothing, which does not happen for what
/// [`load_scene`](crate::description::load_scene) returns.
pub fn spawn_scene(world: &mut World, scene: &SceneDescription) -> SceneEntities {
    let clock = scene.clock;
    world.insert_resource(FrameClock { clock, frame: clock.frames.0 });
    world.insert_resource(Settings(scene.render.clone()));
    // References may point forwards: names get their entities before the components come.
    let textures = reserve(world, scene.textures.keys());
    let materials = reserve(world, scene.materials.keys());
    let meshes = reserve(world, scene.meshes.keys());
    let entities = reserve(world, scene.entities.keys());
    let camera = entity(&entities, &scene.camera);
    let spawned = SceneEntities { camera, textures, materials, meshes, entities };
    for (name, texture) in &scene.textures {
        let image = |image: Arc<ImageData>, _| Ok(image);
        let mut part = |name: String| Ok(entity(&spawned.textures, &name));
        let texture: Texture = sure(texture.clone().map_refs(image, Ok, &mut part));
        world.entity_mut(spawned.textures[name]).insert(texture);
    }
    for (name, mesh) in &scene.meshes {
        world.entity_mut(spawned.meshes[name]).insert(Mesh::new(mesh.clone()));
    }
    for (name, displacement) in &scene.displacements {
        let Displacement { ref texture, says, strength, middle, adaptive } = *displacement;
        let texture = entity(&spawned.textures, texture);
        let displacement = super::Displacement { texture, says, strength, middle, adaptive };
        world.entity_mut(spawned.meshes[name]).insert(displacement);
    }
    for (name, waves) in &scene.waves {
        world.entity_mut(spawned.meshes[name]).insert(Deformation::Waves(waves.clone()));
    }
    for (name, material) in &scene.materials {
        let mut texture = |name: String| Ok(entity(&spawned.textures, &name));
        let mut part = |name: String| Ok(entity(&spawned.materials, &name));
        let material: Material = sure(material.clone().map_refs(&mut texture, &mut part));
        world.entity_mut(spawned.materials[name]).insert(material);
    }
    for (name, description) in &scene.entities {
        dress(world, &spawned, spawned.entities[name], description);
    }
    world.entity_mut(spawned.camera).insert(ActiveCamera);
    spawned
}

/// Gives an entity the components of its description.
fn dress(
    world: &mut World,
    spawned: &SceneEntities,
    target: Entity,
    description: &EntityDescription,
) {
    let mut texture = |name: String| Ok(entity(&spawned.textures, &name));
    let mut target = world.entity_mut(target);
    if let Some(parent) = &description.parent {
        target.insert(ChildOf(entity(&spawned.entities, parent)));
    }
    if let Some(transform) = description.transform {
        target.insert(transform);
    }
    if let Some(look_at) = description.look_at {
        target.insert(look_at);
    }
    if let Some(velocity) = description.velocity {
        target.insert(velocity);
    }
    if let Some(acceleration) = description.acceleration {
        target.insert(acceleration);
    }
    if let Some(keyframes) = &description.keyframes {
        target.insert(keyframes.clone());
    }
    if let Some(light) = &description.light {
        let light: Light = sure(light.clone().map_ref(&mut texture));
        target.insert(light);
    }
    if let Some(camera) = &description.camera {
        let focus = |name: String| Ok(entity(&spawned.entities, &name));
        let camera: Camera = sure(camera.clone().map_ref(focus));
        target.insert(camera);
    }
    if description.hidden_from_camera {
        target.insert(HiddenFromCamera);
    }
    if let Some(shape) = &description.shape {
        let shape: Shape = sure(shape.clone().map_ref(|name| Ok(entity(&spawned.meshes, &name))));
        target.insert(shape);
        if let Some(material) = &description.material {
            target.insert(MadeOf(entity(&spawned.materials, material)));
        }
        if let Some(emission) = description.emission.clone() {
            let emission: Emission = sure(emission.map_ref(&mut texture));
            target.insert(emission);
        }
    }
}

/// An empty entity for every name.
fn reserve<'a>(
    world: &mut World,
    names: impl Iterator<Item = &'a String>,
) -> IndexMap<String, Entity> {
    names.map(|name| (name.clone(), world.spawn(Name::new(name.clone())).id())).collect()
}

fn entity(entities: &IndexMap<String, Entity>, name: &str) -> Entity {
    *entities.get(name).expect("names in a description refer to what it defines")
}

/// The value of a result without errors.
fn sure<T>(result: Result<T, Infallible>) -> T {
    match result {
        Ok(value) => value,
        Err(never) => match never {},
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Value;
    use crate::description::{Focus, LoadOptions, parse_scene_str};
    use crate::world::{LookAt, Transform, Velocity};

    fn spawned(text: &str) -> (World, SceneEntities) {
        let scene = parse_scene_str("test.ron", text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        let mut world = World::new();
        let entities = spawn_scene(&mut world, &scene);
        (world, entities)
    }

    const SCENE: &str = r#"(
        clock: (frames: (3, 9)), render: (samples: 5),
        textures: {"checks": Checker()},
        // The mixture comes before its parts, the child before its parent.
        materials: {"mix": Mix(a: "floor", b: "gold", amount: "checks"),
                    "floor": Diffuse(albedo: "checks"), "gold": Conductor(metal: Gold)},
        meshes: {"tri": Triangles(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], triangles: [(0, 1, 2)])},
        entities: {
            "child": (parent: "parent", shape: Mesh("tri"), material: "mix"),
            "twin": (shape: Mesh("tri")),
            "parent": (velocity: (linear: (1, 0, 0)), transform: (look_at: (0, 0, 5))),
            "lamp": (shape: Disk(), emission: Radiance("checks"), hidden_from_camera: true),
            "eye": (camera: (focus: "child")),
            "sky": (light: Sky(radiance: "checks")),
        },
    )"#;

    #[test]
    fn names_become_the_entities_which_carry_them() {
        let (world, scene) = spawned(SCENE);
        for (name, entity) in scene.entities.iter().chain(&scene.materials).chain(&scene.meshes) {
            assert_eq!(world.get::<Name>(*entity).map(Name::as_str), Some(name.as_str()));
        }
        let child = scene.entities["child"];
        assert_eq!(
            world.get::<ChildOf>(child).map(ChildOf::parent),
            Some(scene.entities["parent"])
        );
        assert_eq!(world.get::<Shape>(child), Some(&Shape::Mesh(scene.meshes["tri"])));
        assert_eq!(world.get::<MadeOf>(child), Some(&MadeOf(scene.materials["mix"])));
        let checks = scene.textures["checks"];
        assert!(world.get::<Texture>(checks).is_some());
        assert_eq!(
            world.get::<Material>(scene.materials["mix"]),
            Some(&Material::Mix {
                a: scene.materials["floor"],
                b: scene.materials["gold"],
                amount: Value::Texture(checks),
            })
        );
        let camera = world.get::<Camera>(scene.camera).expect("it has one");
        assert_eq!(camera.focus, Some(Focus::Entity(child)));
        let sky = world.get::<Light>(scene.entities["sky"]);
        assert_eq!(sky, Some(&Light::Sky { radiance: Value::Texture(checks), scale: 1.0 }));
    }

    #[test]
    fn every_thing_with_a_place_has_a_transform() {
        let (world, scene) = spawned(SCENE);
        for entity in scene.entities.values() {
            assert!(world.get::<Transform>(*entity).is_some());
        }
        let parent = scene.entities["parent"];
        assert!(world.get::<Velocity>(parent).is_some() && world.get::<LookAt>(parent).is_some());
    }

    #[test]
    fn lamps_emit_and_may_be_hidden() {
        let (world, scene) = spawned(SCENE);
        let lamp = scene.entities["lamp"];
        assert!(world.get::<HiddenFromCamera>(lamp).is_some());
        assert!(world.get::<Emission>(lamp).is_some());
    }

    #[test]
    fn clock_settings_and_camera_are_in_place() {
        let (mut world, scene) = spawned(SCENE);
        assert_eq!(world.resource::<FrameClock>().frame, 3);
        assert_eq!(world.resource::<Settings>().0.samples, 5);
        let active: Vec<_> =
            world.query_filtered::<Entity, With<ActiveCamera>>().iter(&world).collect();
        assert_eq!(active, [scene.camera]);
    }
}
