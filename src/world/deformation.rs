//! Meshes whose vertices move.

use super::Mesh;
use crate::description::{TriangleMesh, Waves};
use crate::math::Aabb;
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::sync::Arc;

/// How the vertices of the [`Mesh`] on the same entity move, in closed form.
///
/// The step stage makes the [`VertexMotion`] of each frame of it. A mesh without this component
/// keeps its form and costs nothing.
#[derive(Component, Clone, Debug, PartialEq)]
#[require(VertexMotion)]
pub enum Deformation {
    /// Waves on water; the mesh is the surface at rest, in the plane y = 0.
    Waves(Waves),
}

/// The vertices of a mesh at one time, in its own space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Of unit length.
    pub normals: Vec<Vec3>,
}

/// A deforming mesh over the shutter of the frame; written by the step stage.
///
/// Keys stand at evenly spaced times from opening to closing, both included, and are joined by
/// straight lines; one key for a surface at rest or a shutter which is closed.
#[derive(Component, Clone, Debug)]
pub struct VertexMotion {
    /// The mesh when the shutter opens: the first key.
    pub opening: Arc<TriangleMesh>,
    /// The other keys.
    pub later: Arc<Vec<Vertices>>,
    /// Around all keys, and so around what lies between them.
    pub bounds: Aabb,
    /// What the keys were made for; nothing is computed while it stays the same.
    pub(crate) made_for: Option<ShutterSpan>,
}

impl Default for VertexMotion {
    /// No vertices.
    fn default() -> Self {
        let (opening, later) = Default::default();
        Self { opening, later, bounds: Aabb::EMPTY, made_for: None }
    }
}

impl VertexMotion {
    /// The positions of every key.
    pub fn positions(&self) -> impl Iterator<Item = &[Vec3]> {
        std::iter::once(&self.opening.positions)
            .chain(self.later.iter().map(|key| &key.positions))
            .map(Vec::as_slice)
    }

    /// The mesh `rest` with other vertices, key by key.
    ///
    /// # Panics
    /// If there is no key.
    pub(crate) fn new(rest: &Mesh, keys: Vec<Vertices>, made_for: ShutterSpan) -> Self {
        let points = keys.iter().flat_map(|key| key.positions.iter().copied());
        let bounds = Aabb::from_points(points);
        let mut keys = keys.into_iter();
        let Vertices { positions, normals } = keys.next().expect("a motion has a first key");
        let TriangleMesh { uvs, chart, colors, triangles, .. } = (**rest.data()).clone();
        // Tangents of the mesh at rest are not those of another form.
        let tangents = Vec::new();
        let opening =
            Arc::new(TriangleMesh { positions, normals, uvs, chart, tangents, colors, triangles });
        Self { opening, later: Arc::new(keys.collect()), bounds, made_for: Some(made_for) }
    }

    /// Whether both describe the same motion.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.opening == other.opening && self.later == other.later
    }
}

/// When the shutter opens and closes, in seconds, and how closely motion is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShutterSpan {
    pub(crate) open: f64,
    pub(crate) close: f64,
    /// Share of the distance moved.
    pub(crate) tolerance: f64,
}
