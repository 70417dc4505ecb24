//! Where things are and how they move: plain data, evaluated by the step stage.

use glam::{DMat3, DQuat, DVec3};

/// A pose relative to the parent: first stretch, then scale, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Metres.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Factor along each local axis; negative mirrors, 0 is not allowed for shapes.
    pub scale: DVec3,
    /// A symmetric map, the identity unless the pose was given as a matrix: what that is beside a rotation.
    pub stretch: DMat3,
}

impl Default for Transform {
    fn default() -> Self {
        Self {
            translation: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            scale: DVec3::ONE,
            stretch: DMat3::IDENTITY,
        }
    }
}

/// Uniform motion in the parent's frame, starting from the [`Transform`] at time 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Metres per second.
    pub linear: DVec3,
    /// Rotation vector: its direction is the axis, its length **radians** per second.
    pub angular: DVec3,
}

/// Constant acceleration in the parent's frame, metres per second squared: `½·a·t²` is added to
/// the translation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Acceleration(pub DVec3);

/// Tracks of keys over time. A track that is present replaces what [`Transform`] (or the camera,
/// or the emission) says; [`Velocity`] and [`Acceleration`] add to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Keyframes {
    /// Metres in the parent's frame.
    pub translation: Option<Track<DVec3>>,
    /// Orientation; linear keys are joined by the shortest great arc (slerp).
    pub rotation: Option<Track<DQuat>>,
    /// An angle about a fixed local axis, applied before the rotation; keeps count of whole turns.
    pub turn: Option<Turn>,
    /// Factors along the local axes.
    pub scale: Option<Track<DVec3>>,
    /// Vertical field of view in degrees, of a camera.
    pub fov: Option<Track<f64>>,
    /// Focus distance in metres, of a camera.
    pub focus: Option<Track<f64>>,
    /// Factor on the emission or on the strength of a light, at least 0.
    pub emission: Option<Track<f64>>,
}

/// An angle about a fixed axis over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// Unit axis in the local frame.
    pub axis: DVec3,
    /// **Radians**; not reduced, so that 4π is two turns.
    pub angle: Track<f64>,
}

/// Values at given times, and the rule between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<T> {
    /// At least one key, at strictly increasing times.
    pub keys: Vec<Key<T>>,
    /// The rule between two keys.
    pub interpolation: Interpolation,
    /// What holds before the first and after the last key.
    pub extend: Extend,
}

/// A value at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key<T> {
    /// Seconds.
    pub time: f64,
    /// The value at that time.
    pub value: T,
    /// Derivatives per second on arriving at and leaving the key, for cubic interpolation;
    /// `None` takes the slope of the chord between the neighbours (Catmull–Rom).
    pub tangents: Option<(T, T)>,
}

/// The rule between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
pub enum Interpolation {
    /// The value of the earlier key.
    Step,
    /// A straight line; for rotations the shortest great arc.
    #[default]
    Linear,
    /// The cubic Hermite curve through values and tangents.
    Cubic,
}

/// What holds outside the keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
pub enum Extend {
    /// The first and the last value.
    #[default]
    Hold,
    /// The track repeats with the time from its first to its last key as its period.
    Loop,
}

/// Keeps an axis of the entity on a point of the parent's frame while the entity moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// The point, metres in the parent's frame.
    pub target: DVec3,
    /// The direction which appears upright.
    pub up: DVec3,
}
