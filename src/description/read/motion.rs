//! Poses and motion as a scene file says them: degrees, Euler angles, points to look at.

use super::decode::{Report, decode};
use super::limits::{self, Limits};
use super::source::Cursor;
use crate::description::{
    Acceleration, Extend, Interpolation, Key, Keyframes, LookAt, Track, Transform, Turn, Velocity,
};
use crate::math::Decomposed;
use glam::{DAffine3, DMat3, DQuat, DVec3, DVec4, EulerRot};
use serde::Deserialize;
use serde::de::{self, Deserializer, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

#[derive(Debug, Deserialize)]
#[serde(rename = "transform", deny_unknown_fields)]
struct TransformFile {
    #[serde(default)]
    translation: DVec3,
    #[serde(default)]
    rotation: Option<DVec3>,
    #[serde(default)]
    scale: ScaleFile,
    #[serde(default)]
    look_at: Option<DVec3>,
    #[serde(default)]
    up: Option<DVec3>,
    /// x, y, z, w.
    #[serde(default)]
    quaternion: Option<DVec4>,
    /// Its rows, which are multiplied with a column.
    #[serde(default)]
    matrix: Option<Vec<DVec4>>,
}

/// One factor for all axes, or one for each.
#[derive(Clone, Copy, Debug)]
struct ScaleFile(DVec3);

impl Default for ScaleFile {
    fn default() -> Self {
        Self(DVec3::ONE)
    }
}

impl<'de> Deserialize<'de> for ScaleFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ScaleVisitor;
        impl<'de> Visitor<'de> for ScaleVisitor {
            type Value = ScaleFile;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or three of them (x, y, z)")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<ScaleFile, E> {
                Ok(ScaleFile(DVec3::splat(v)))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<ScaleFile, E> {
                self.visit_f64(v as f64)
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<ScaleFile, E> {
                self.visit_f64(v as f64)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<ScaleFile, A::Error> {
                let mut axes = [0.0; 3];
                for (index, slot) in axes.iter_mut().enumerate() {
                    let next = seq.next_element()?;
                    *slot = next.ok_or_else(|| de::Error::invalid_length(index, &self))?;
                }
                if seq.next_element::<de::IgnoredAny>()?.is_some() {
                    return Err(de::Error::invalid_length(4, &self));
                }
                Ok(ScaleFile(DVec3::from_array(axes)))
            }
        }
        deserializer.deserialize_any(ScaleVisitor)
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename = "velocity", deny_unknown_fields, default)]
struct VelocityFile {
    linear: DVec3,
    angular: DVec3,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename = "keyframes", deny_unknown_fields, default)]
struct KeyframesFile {
    translation: Option<TrackFile<DVec3>>,
    rotation: Option<TrackFile<DVec3>>,
    turn: Option<TurnFile>,
    scale: Option<TrackFile<ScaleFile>>,
    fov: Option<TrackFile<f64>>,
    focus: Option<TrackFile<f64>>,
    emission: Option<TrackFile<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(rename = "track", deny_unknown_fields)]
struct TrackFile<T> {
    #[serde(bound(deserialize = "T: Deserialize<'de> + Copy"))]
    keys: Vec<KeyFile<T>>,
    #[serde(default)]
    interpolation: Interpolation,
    #[serde(default)]
    extend: Extend,
}

#[derive(Debug, Deserialize)]
#[serde(rename = "turn", deny_unknown_fields)]
struct TurnFile {
    axis: DVec3,
    keys: Vec<KeyFile<f64>>,
    #[serde(default)]
    interpolation: Interpolation,
    #[serde(default)]
    extend: Extend,
}

/// `(time, value)`, `(time, value, tangent)` or `(time, value, tangent in, tangent out)`.
#[derive(Clone, Copy, Debug)]
struct KeyFile<T> {
    time: f64,
    value: T,
    tangents: Option<(T, T)>,
}

impl<'de, T: Deserialize<'de> + Copy> Deserialize<'de> for KeyFile<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeyVisitor<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de> + Copy> Visitor<'de> for KeyVisitor<T> {
            type Value = KeyFile<T>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a key (time, value), with one or two tangents after it if wanted")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<KeyFile<T>, A::Error> {
                let time =
                    seq.next_element()?.ok_or_else(|| de::Error::invalid_length(0, &self))?;
                let value =
                    seq.next_element()?.ok_or_else(|| de::Error::invalid_length(1, &self))?;
                let arriving: Option<T> = seq.next_element()?;
                let leaving = if arriving.is_some() { seq.next_element()? } else { None };
                if leaving.is_some() && seq.next_element::<de::IgnoredAny>()?.is_some() {
                    return Err(de::Error::invalid_length(5, &self));
                }
                let tangents = arriving.map(|arriving| (arriving, leaving.unwrap_or(arriving)));
                Ok(KeyFile { time, value, tangents })
            }
        }
        deserializer.deserialize_any(KeyVisitor(PhantomData))
    }
}

/// The rotation by angles in degrees about x first, then y, then z: `R = Rz·Ry·Rx`.
pub(super) fn rotation_from_degrees(degrees: DVec3) -> DQuat {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

/// Where an entity is, before it is known how it moves.
#[derive(Debug, Default)]
pub(super) struct Pose {
    pub(super) transform: Transform,
    pub(super) look_at: Option<LookAt>,
    /// `up` was written in the file and not assumed.
    pub(super) up_given: bool,
}

/// Reads `transform: (…)`.
pub(super) fn read_transform(cursor: &Cursor, report: &mut Report) -> Option<Pose> {
    let file: TransformFile = decode(cursor, report)?;
    let scale = file.scale.0;
    let rotation = file.rotation.unwrap_or(DVec3::ZERO);
    let fields = [
        ("translation", file.translation, &limits::COORDINATE),
        ("rotation", rotation, &limits::ANGLE),
        ("scale", scale, &limits::SCALE),
        ("look_at", file.look_at.unwrap_or_default(), &limits::COORDINATE),
        ("up", file.up.unwrap_or_default(), &limits::DIRECTION),
    ];
    let mut fine = excludes(cursor, "matrix", &MATRIX_EXCLUDES, report)
        & excludes(cursor, "quaternion", &["rotation", "look_at"], report);
    for (name, value, limits) in fields {
        fine &= limits::vector(report, &cursor.at(name), &value.to_array(), limits);
    }
    if file.look_at.is_some() && file.rotation.is_some() {
        let message = "`rotation` and `look_at` both turn the entity";
        report.at("scene::conflict", &cursor.at("rotation"), message).help =
            Some("leave one of them out".to_owned());
        fine = false;
    }
    if file.up.is_some() && file.look_at.is_none() {
        report.at("scene::conflict", &cursor.at("up"), "`up` has no meaning without `look_at`");
        fine = false;
    }
    if file.up == Some(DVec3::ZERO) {
        report.at("scene::out-of-range", &cursor.at("up"), "`up` must not be zero");
        fine = false;
    }
    let look_at = file.look_at.map(|target| LookAt { target, up: file.up.unwrap_or(DVec3::Y) });
    let rotation = match file.quaternion {
        Some(quaternion) => read_quaternion(&cursor.at("quaternion"), quaternion, report)?,
        None => rotation_from_degrees(rotation),
    };
    let transform = match &file.matrix {
        Some(rows) => read_matrix(&cursor.at("matrix"), rows, report)?,
        None => {
            Transform { translation: file.translation, rotation, scale, ..Transform::default() }
        }
    };
    fine.then_some(Pose { transform, look_at, up_given: file.up.is_some() })
}

/// What a matrix says as well.
const MATRIX_EXCLUDES: [&str; 5] = ["translation", "rotation", "scale", "look_at", "quaternion"];

/// Reports fields that say the same as another; `false` if there are any.
fn excludes(cursor: &Cursor, name: &str, others: &[&str], report: &mut Report) -> bool {
    let Some(field) = cursor.field(name) else { return true };
    let second = others.iter().find_map(|other| Some((other, cursor.field(other)?)));
    let Some((other, second)) = second else { return true };
    let message = format!("`{name}` and `{other}` exclude each other");
    report.error("scene::conflict", second.key_place(), &field.path, message).help =
        Some("leave one of them out".to_owned());
    false
}

/// A rotation as x, y, z, w, of any length.
fn read_quaternion(cursor: &Cursor, value: DVec4, report: &mut Report) -> Option<DQuat> {
    if !limits::vector(report, cursor, &value.to_array(), &limits::DIRECTION) {
        return None;
    }
    let unit = value.try_normalize().map(DQuat::from_vec4);
    if unit.is_none() {
        let message = "a quaternion must not be zero; no rotation is (0, 0, 0, 1)";
        report.at("scene::out-of-range", cursor, message);
    }
    unit
}

/// A pose as the rows of a matrix: three, or four of which the last says nothing.
fn read_matrix(cursor: &Cursor, rows: &[DVec4], report: &mut Report) -> Option<Transform> {
    if !(rows.len() == 3 || rows.len() == 4 && rows[3] == DVec4::W) {
        let message = "a matrix is its three rows of four numbers, `[(1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, z)]` for a \
                       translation, perhaps with (0, 0, 0, 1) as a fourth row";
        let last_column = rows.len() == 4 && rows[..3].iter().all(|row| row.w == 0.0);
        report.at("scene::wrong-type", cursor, message).help = last_column.then(|| {
            "these seem to be its columns: write its rows, the translation in the last column"
                .to_owned()
        });
        return None;
    }
    let mut fine = true;
    for (index, row) in rows.iter().take(3).enumerate() {
        let place = cursor.nth(index);
        fine &= limits::vector(report, &place, &row.truncate().to_array(), &limits::SCALE)
            & limits::number(report, &place.nth(3), row.w, &limits::COORDINATE);
    }
    if !fine {
        return None;
    }
    let [x, y, z] = [0, 1, 2].map(|row| rows[row].truncate());
    let linear = DMat3::from_cols(x, y, z).transpose();
    let translation = DVec3::new(rows[0].w, rows[1].w, rows[2].w);
    if linear.determinant() == 0.0 {
        let message = "the matrix flattens space: its determinant must not be zero";
        report.at("scene::out-of-range", cursor, message);
        return None;
    }
    let parts = Decomposed::new(&DAffine3 { matrix3: linear, translation });
    let Decomposed { rotation, stretch, .. } = parts;
    Some(Transform { translation, rotation, stretch, ..Transform::default() })
}

/// Reads `velocity: (…)`.
pub(super) fn read_velocity(cursor: &Cursor, report: &mut Report) -> Option<Velocity> {
    let file: VelocityFile = decode(cursor, report)?;
    let linear = file.linear.to_array();
    let angular = file.angular.to_array();
    let fine = limits::vector(report, &cursor.at("linear"), &linear, &limits::SPEED)
        & limits::vector(report, &cursor.at("angular"), &angular, &limits::ANGLE);
    let angular = file.angular.map(f64::to_radians);
    fine.then_some(Velocity { linear: file.linear, angular })
}

/// Reads `acceleration: (x, y, z)`.
pub(super) fn read_acceleration(cursor: &Cursor, report: &mut Report) -> Option<Acceleration> {
    let value: DVec3 = decode(cursor, report)?;
    limits::vector(report, cursor, &value.to_array(), &limits::ACCELERATION)
        .then_some(Acceleration(value))
}

/// Reads `keyframes: (…)`.
pub(super) fn read_keyframes(cursor: &Cursor, report: &mut Report) -> Option<Keyframes> {
    let file: KeyframesFile = decode(cursor, report)?;
    let mut read = TrackReader { cursor, report };
    let vector = |v: DVec3| v.to_array().to_vec();
    let scalar = |v: f64| vec![v];
    let turn = file.turn.and_then(|turn| read.turn(turn));
    let rotation = file.rotation.and_then(|track| read.rotation(track));
    Some(Keyframes {
        translation: file
            .translation
            .and_then(|t| read.track("translation", t, vector, &limits::COORDINATE)),
        rotation,
        turn,
        scale: file
            .scale
            .and_then(|t| read.track("scale", t.map(|scale| scale.0), vector, &limits::SCALE)),
        fov: file.fov.and_then(|t| read.track("fov", t, scalar, &limits::FOV)),
        focus: file.focus.and_then(|t| read.track("focus", t, scalar, &limits::LENGTH)),
        emission: file.emission.and_then(|t| read.track("emission", t, scalar, &limits::STRENGTH)),
    })
}

impl<T: Copy> TrackFile<T> {
    fn map<S>(self, f: impl Fn(T) -> S) -> TrackFile<S> {
        let key = |key: KeyFile<T>| KeyFile {
            time: key.time,
            value: f(key.value),
            tangents: key.tangents.map(|(arriving, leaving)| (f(arriving), f(leaving))),
        };
        let keys = self.keys.into_iter().map(key).collect();
        TrackFile { keys, interpolation: self.interpolation, extend: self.extend }
    }
}

/// Turns tracks as written into tracks, and reports what is wrong with them.
struct TrackReader<'a, 'r> {
    cursor: &'a Cursor<'a>,
    report: &'r mut Report,
}

impl TrackReader<'_, '_> {
    /// Checks a track whose values have the components `parts`.
    fn track<T: Copy>(
        &mut self,
        name: &str,
        file: TrackFile<T>,
        parts: impl Fn(T) -> Vec<f64>,
        limits: &Limits,
    ) -> Option<Track<T>> {
        let track = self.cursor.at(name);
        let keys = track.at("keys");
        if file.keys.is_empty() {
            self.report.at("scene::empty", &keys, format!("`{name}` needs at least one key"));
            return None;
        }
        let mut fine = true;
        let mut earlier = f64::NEG_INFINITY;
        for (index, key) in file.keys.iter().enumerate() {
            let place = keys.nth(index);
            fine &= limits::number(self.report, &place.nth(0), key.time, &limits::TIME);
            fine &= limits::vector(self.report, &place.nth(1), &parts(key.value), limits);
            if let Some((arriving, leaving)) = key.tangents {
                // A slope may be as steep as it likes as long as it is a number.
                let slope = &limits::SPEED;
                fine &= limits::vector(self.report, &place.nth(2), &parts(arriving), slope);
                fine &= limits::vector(self.report, &place.nth(3), &parts(leaving), slope);
                if file.interpolation != Interpolation::Cubic {
                    let message = "tangents have no meaning without `interpolation: Cubic`";
                    self.report.at("scene::conflict", &place.nth(2), message);
                    fine = false;
                }
            }
            if key.time <= earlier {
                let message = format!(
                    "the times of keys must increase, but {} comes after {earlier}",
                    key.time
                );
                self.report.at("scene::key-order", &place.nth(0), message);
                fine = false;
            }
            earlier = key.time;
        }
        let key =
            |key: KeyFile<T>| Key { time: key.time, value: key.value, tangents: key.tangents };
        let keys = file.keys.into_iter().map(key).collect();
        let track = Track { keys, interpolation: file.interpolation, extend: file.extend };
        fine.then_some(track)
    }

    fn rotation(&mut self, file: TrackFile<DVec3>) -> Option<Track<DQuat>> {
        if let Some(index) = file.keys.iter().position(|key| key.tangents.is_some()) {
            let key = self.cursor.at("rotation").at("keys").nth(index);
            let message = "keys of a rotation have no tangents";
            self.report.at("scene::conflict", &key.nth(2), message).help =
                Some("`turn` turns about one axis and takes tangents".to_owned());
            return None;
        }
        let degrees = |v: DVec3| v.to_array().to_vec();
        let track = self.track("rotation", file, degrees, &limits::ANGLE)?;
        let key = |key: Key<DVec3>| Key {
            time: key.time,
            value: rotation_from_degrees(key.value),
            tangents: None,
        };
        let keys = track.keys.into_iter().map(key).collect();
        Some(Track { keys, interpolation: track.interpolation, extend: track.extend })
    }

    fn turn(&mut self, file: TurnFile) -> Option<Turn> {
        let place = self.cursor.at("turn").at("axis");
        let fine = limits::vector(self.report, &place, &file.axis.to_array(), &limits::DIRECTION);
        let axis = file.axis.try_normalize();
        if fine && axis.is_none() {
            self.report.at("scene::out-of-range", &place, "the axis of a turn must not be zero");
        }
        let track =
            TrackFile { keys: file.keys, interpolation: file.interpolation, extend: file.extend };
        let track = self.track("turn", track, |v| vec![v], &limits::ANGLE)?;
        let key = |key: Key<f64>| Key {
            time: key.time,
            value: key.value.to_radians(),
            tangents: key.tangents.map(|(a, b)| (a.to_radians(), b.to_radians())),
        };
        let keys = track.keys.into_iter().map(key).collect();
        let angle = Track { keys, interpolation: track.interpolation, extend: track.extend };
        Some(Turn { axis: axis.filter(|_| fine)?, angle })
    }
}

/// Aims an entity: at once if it stays where it is, else by leaving the task to the step stage.
///
/// `backwards` says that the local −z looks (cameras and lights) instead of +z.
pub(super) fn aim(
    cursor: &Cursor,
    pose: Pose,
    moves: bool,
    backwards: bool,
    report: &mut Report,
) -> Option<(Transform, Option<LookAt>)> {
    let Some(look_at) = pose.look_at else { return Some((pose.transform, None)) };
    let mut transform = pose.transform;
    let Some(forward) = (look_at.target - transform.translation).try_normalize() else {
        if moves {
            return Some((transform, Some(look_at)));
        }
        let message = "the entity stands at the very point at which it should look";
        report.at("scene::look-at", &cursor.at("look_at"), message);
        return None;
    };
    let z = if backwards { -forward } else { forward };
    let x = look_at.up.cross(z).try_normalize();
    if x.is_none() && pose.up_given && !moves {
        let message = "`up` must not point along the line of sight";
        report.at("scene::look-at", &cursor.at("up"), message);
        return None;
    }
    // Looking straight along the y axis leaves the roll open; any axis across will do.
    let x = x.unwrap_or_else(|| z.any_orthonormal_vector());
    transform.rotation = DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z));
    Some((transform, moves.then_some(look_at)))
}
