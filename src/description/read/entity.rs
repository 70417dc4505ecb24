//! Entities: each field read alone, then what the fields mean together.

use super::decode::{Report, decode};
use super::light;
use super::limits;
use super::motion::{self, Pose};
use super::source::Cursor;
use super::surface::{self, reference};
use super::{Names, words};
use crate::description::{
    Camera, EmissionStrength, EntityDescription, Focus, Keyframes, Shape, Transform,
};
use glam::DVec3;

const FIELDS: [&str; 12] = [
    "parent",
    "transform",
    "velocity",
    "acceleration",
    "keyframes",
    "shape",
    "material",
    "emission",
    "two_sided",
    "light",
    "camera",
    "hidden_from_camera",
];

/// Reads an entity. What is wrong goes to the report, and is left out of the result.
pub(super) fn read_entity(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<EntityDescription> {
    let has_fields = cursor.node.entries.iter().all(|entry| !entry.key.is_empty());
    if cursor.node.kind != super::outline::Kind::Tuple || !has_fields || !cursor.name().is_empty() {
        let message = "an entity is written as `(field: value, …)`";
        report.at("scene::wrong-type", cursor, message);
        return None;
    }
    let mut entity = EntityDescription::default();
    let mut pose = Pose::default();
    let mut two_sided = None;
    for field in cursor.entries() {
        match field.key().as_str() {
            "parent" => entity.parent = decode(&field, report),
            "transform" => pose = motion::read_transform(&field, report).unwrap_or_default(),
            "velocity" => entity.velocity = motion::read_velocity(&field, report),
            "acceleration" => entity.acceleration = motion::read_acceleration(&field, report),
            "keyframes" => entity.keyframes = motion::read_keyframes(&field, report),
            "shape" => entity.shape = surface::read_shape(&field, names, report),
            "material" => entity.material = decode(&field, report),
            "emission" => entity.emission = light::read_emission(&field, names, report),
            "two_sided" => two_sided = decode(&field, report),
            "light" => entity.light = light::read_light(&field, names, report),
            "camera" => entity.camera = read_camera(&field, names, report),
            "hidden_from_camera" => {
                entity.hidden_from_camera = decode(&field, report).unwrap_or_default();
            }
            other => {
                let message = format!("an entity has no field `{other}`");
                let help = words::hint(other, &FIELDS)
                    .or_else(|| report.hints.suggestion(other, FIELDS, "fields"));
                report
                    .error("scene::unknown-field", field.key_place(), &field.path, message)
                    .help = help;
            }
        }
    }
    if let (Some(emission), Some(two_sided)) = (&mut entity.emission, two_sided) {
        emission.two_sided = two_sided;
    }
    check_references(cursor, &entity, names, report);
    check_partners(cursor, report);
    check_scale(cursor, &entity, &pose.transform, report);
    let moves = entity.acceleration.is_some()
        || entity.velocity.is_some_and(|velocity| velocity.linear != DVec3::ZERO)
        || entity.keyframes.as_ref().is_some_and(|keys| keys.translation.is_some());
    check_turning(cursor, &entity, &pose, moves, report);
    let backwards = entity.camera.is_some() || entity.light.is_some();
    if let Some(transform) = cursor.field("transform") {
        let (transform, look_at) = motion::aim(&transform, pose, moves, backwards, report)?;
        entity.transform = Some(transform);
        entity.look_at = look_at;
    }
    Some(entity)
}

fn read_camera(cursor: &Cursor, names: &Names, report: &mut Report) -> Option<Camera<String>> {
    let camera: Camera<String> = decode(cursor, report)?;
    let mut check = |field: &str, value: f64, limits: &limits::Limits| {
        limits::number(report, &cursor.at(field), value, limits);
    };
    check("fov", camera.fov, &limits::FOV);
    if let Some(fov_x) = camera.fov_x {
        check("fov_x", fov_x, &limits::FOV);
    }
    check("aperture", camera.aperture, &limits::LENGTH_OR_ZERO);
    check("blade_rotation", camera.blade_rotation, &limits::ANGLE);
    if let Some(height) = camera.orthographic {
        check("orthographic", height, &limits::LENGTH);
    }
    if let Some(f_number) = camera.f_number {
        check("f_number", f_number, &limits::F_NUMBER);
    }
    if let Some(Focus::Distance(distance)) = camera.focus {
        check("focus", distance, &limits::LENGTH);
    }
    if camera.blades != 0 {
        check("blades", f64::from(camera.blades), &limits::BLADES);
    }
    let excluded = [
        ("aperture", "f_number"),
        ("f_number", "orthographic"),
        ("fov", "fov_x"),
        ("orthographic", "fov_x"),
    ];
    for (a, b) in excluded {
        if let (Some(_), Some(second)) = (cursor.field(a), cursor.field(b)) {
            let message = format!("`{a}` and `{b}` exclude each other");
            report.at("scene::conflict", &second, message);
        }
    }
    if let (Some(Focus::Entity(name)), true) = (&camera.focus, names.complete) {
        let place = cursor.at("focus");
        reference(report, &place, name, &names.entities, "entity", "entities");
    }
    Some(camera)
}

fn check_references(
    cursor: &Cursor,
    entity: &EntityDescription,
    names: &Names,
    report: &mut Report,
) {
    if !names.complete {
        return;
    }
    if let Some(parent) = &entity.parent {
        let place = cursor.at("parent");
        reference(report, &place, parent, &names.entities, "entity", "entities");
    }
    if let Some(material) = &entity.material {
        let place = cursor.at("material");
        reference(report, &place, material, &names.materials, "material", "materials");
    }
}

/// Reports fields which have no meaning without another one.
fn check_partners(cursor: &Cursor, report: &mut Report) {
    let keyframes = cursor.field("keyframes");
    let key = |name: &str| keyframes.as_ref().and_then(|keyframes| keyframes.field(name));
    let needs: [(&str, Option<Cursor>, &[&str]); 6] = [
        ("material", cursor.field("material"), &["shape"]),
        ("emission", cursor.field("emission"), &["shape"]),
        ("two_sided", cursor.field("two_sided"), &["emission"]),
        ("keyframes.fov", key("fov"), &["camera"]),
        ("keyframes.focus", key("focus"), &["camera"]),
        ("keyframes.emission", key("emission"), &["emission", "light"]),
    ];
    for (name, field, partners) in needs {
        let Some(field) = field else { continue };
        if partners.iter().all(|partner| cursor.field(partner).is_none()) {
            let partners = partners.join("` or a `");
            let message = format!("`{name}` needs a `{partners}` in the same entity");
            report.error("scene::lonely", field.key_place(), &field.path, message);
        }
    }
}

/// Reports a shape which is scaled to nothing, and a power that is spread over an endless plane.
fn check_scale(
    cursor: &Cursor,
    entity: &EntityDescription,
    transform: &Transform,
    report: &mut Report,
) {
    let Some(shape) = &entity.shape else { return };
    let flat = |scale: DVec3| scale.to_array().contains(&0.0);
    if flat(transform.scale) {
        let place = cursor.at("transform").at("scale");
        report.at("scene::out-of-range", &place, "the scale of a shape must not be zero");
    }
    let track = entity.keyframes.as_ref().and_then(|keyframes| keyframes.scale.as_ref());
    for (index, key) in track.iter().flat_map(|track| &track.keys).enumerate() {
        if flat(key.value) {
            let place = cursor.at("keyframes").at("scale").at("keys").nth(index).nth(1);
            report.at("scene::out-of-range", &place, "the scale of a shape must not be zero");
        }
    }
    let power =
        matches!(&entity.emission, Some(e) if matches!(e.strength, EmissionStrength::Power(_)));
    if power && matches!(shape, Shape::Plane {}) {
        let message = "a `Plane` is infinite: `Power` would be spread to nothing";
        report.at("scene::conflict", &cursor.at("emission"), message).help =
            Some("give its `Radiance`".to_owned());
    }
}

/// Reports what would turn an entity against its `look_at`.
fn check_turning(
    cursor: &Cursor,
    entity: &EntityDescription,
    pose: &Pose,
    moves: bool,
    report: &mut Report,
) {
    if pose.look_at.is_none() {
        return;
    }
    let keyed = |keys: &Keyframes| keys.rotation.is_some();
    if entity.keyframes.as_ref().is_some_and(keyed) {
        let place = cursor.at("keyframes").at("rotation");
        let message = "`look_at` and keys of `rotation` both turn the entity";
        report.at("scene::conflict", &place, message);
    }
    // A body at rest may look somewhere first and spin from there.
    if moves && entity.velocity.is_some_and(|velocity| velocity.angular != DVec3::ZERO) {
        let place = cursor.at("velocity").at("angular");
        let message = "`look_at` and `angular` both turn the moving entity";
        report.at("scene::conflict", &place, message);
    }
}
