//! One tree over all meshes which stand still.
//!
//! A room of twenty meshes in twenty trees makes every ray change its space twenty times. What stands
//! still and is used once is therefore carried to one space, whose axes are those of the world, and
//! shares one tree there. A ray gets there by a shift alone.
//!
//! In the shared space corners are rounded to `f32` anew. A mesh joins only where this is too little to
//! be seen: see [`WORST_ROUNDING`].

use super::{MeshTree, WideTree};
use crate::description::{BvhQuality, TriangleMesh};
use crate::extract::{FrameOrigin, Meshes, RestingMesh, RestingMeshes};
use crate::world::Settings;
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// The most by which joining may move a corner, as a share of the mean length of the edges of its
/// mesh: directions of edges and normals then change by less than 0.03°.
const WORST_ROUNDING: f64 = 1.0 / 4096.0;

/// Some of the resting meshes in one tree.
#[derive(Resource, Clone, Debug, Default)]
pub struct RestingTree {
    tree: Option<Arc<MeshTree>>,
    /// World position of the origin of the shared space, metres.
    origin: DVec3,
    /// First triangle and instance of each member, in the order of both.
    members: Vec<(u32, u32)>,
    quality: BvhQuality,
    /// Whether it was built anew in this frame.
    pub built: bool,
}

impl RestingTree {
    /// Joins those of `resting` which may be joined, if there are two at least.
    pub fn build(
        resting: &[RestingMesh],
        meshes: &[Arc<TriangleMesh>],
        quality: BvhQuality,
    ) -> Self {
        let origin = middle(resting, meshes);
        let members: Vec<&RestingMesh> = resting
            .iter()
            .filter(|member| may_join(member, &meshes[member.mesh as usize], origin))
            .collect();
        if members.len() < 2 {
            return Self::default();
        }
        let total = |of: fn(&TriangleMesh) -> usize| {
            members.iter().map(|member| of(&meshes[member.mesh as usize])).sum()
        };
        let mut shared = TriangleMesh {
            positions: Vec::with_capacity(total(|mesh| mesh.positions.len())),
            triangles: Vec::with_capacity(total(|mesh| mesh.triangles.len())),
            ..Default::default()
        };
        let mut starts = Vec::with_capacity(members.len());
        for member in members {
            let mesh = &meshes[member.mesh as usize];
            let base = shared.positions.len() as u32;
            starts.push((shared.triangles.len() as u32, member.instance));
            shared.positions.extend(corners(member, mesh, origin).map(DVec3::as_vec3));
            shared.triangles.extend(mesh.triangles.iter().map(|t| t.map(|k| k + base)));
        }
        let tree = Some(Arc::new(MeshTree::build(Arc::new(shared), quality)));
        Self { tree, origin, members: starts, quality, built: true }
    }

    /// The first triangle, in the shared tree, of an instance; `None` if it is not part of it.
    pub fn first_triangle(&self, instance: u32) -> Option<u32> {
        let k = self.members.binary_search_by_key(&instance, |member| member.1).ok()?;
        Some(self.members[k].0)
    }

    /// Bytes held: the tree, and the corners and triangles in the shared space.
    pub fn memory(&self) -> usize {
        let copy = |mesh: &TriangleMesh| {
            mesh.positions.capacity() * size_of::<Vec3>()
                + mesh.triangles.capacity() * size_of::<[u32; 3]>()
        };
        let tree = self.tree.as_ref().map_or(0, |tree| tree.memory() + copy(&tree.mesh));
        tree + self.members.capacity() * size_of::<(u32, u32)>()
    }

    /// Bytes that the tree over these meshes will hold, before it is built; 0 where it will not be.
    ///
    /// It counts as if all of them could be joined: those which cannot take as much in trees of their own,
    /// but for the copy.
    pub fn forecast(
        resting: &[RestingMesh],
        meshes: &[Arc<TriangleMesh>],
        quality: BvhQuality,
    ) -> usize {
        if resting.len() < 2 {
            return 0;
        }
        let own = resting.iter().map(|member| &meshes[member.mesh as usize]);
        let (vertices, triangles) = own.fold((0, 0), |(vertices, triangles), mesh| {
            (vertices + mesh.positions.len(), triangles + mesh.triangles.len())
        });
        WideTree::forecast(triangles, quality)
            + vertices * size_of::<Vec3>()
            + triangles * size_of::<[u32; 3]>()
    }

    /// Whether it has to be built anew for another quality.
    pub(crate) fn is_outdated(&self, quality: BvhQuality) -> bool {
        self.tree.is_some() && self.quality != quality
    }

    /// Instance and triangle of its mesh of a triangle of the shared tree.
    #[inline]
    pub(super) fn owner(&self, triangle: u32) -> (u32, u32) {
        let k = self.members.partition_point(|member| member.0 <= triangle) - 1;
        let (first, instance) = self.members[k];
        (instance, triangle - first)
    }

    /// The tree with the place of its space in render space.
    pub(super) fn placed(&self, frame: &FrameOrigin) -> Option<(Arc<MeshTree>, DVec3)> {
        Some((self.tree.clone()?, self.origin - frame.0))
    }
}

/// The middle of everything; a place from which no mesh is farther than need be.
fn middle(resting: &[RestingMesh], meshes: &[Arc<TriangleMesh>]) -> DVec3 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for member in resting {
        for p in corners(member, &meshes[member.mesh as usize], DVec3::ZERO) {
            min = min.min(p);
            max = max.max(p);
        }
    }
    let middle = min * 0.5 + max * 0.5;
    if middle.is_finite() { middle } else { DVec3::ZERO }
}

/// The corners of a member as seen from `origin`.
fn corners<'a>(
    member: &RestingMesh,
    mesh: &'a TriangleMesh,
    origin: DVec3,
) -> impl Iterator<Item = DVec3> + use<'a> {
    let map = member.world_from_mesh;
    mesh.positions.iter().map(move |p| map.transform_point3(p.as_dvec3()) - origin)
}

/// Whether rounding the corners of a mesh to `f32` in the shared space moves them little enough.
fn may_join(member: &RestingMesh, mesh: &TriangleMesh, origin: DVec3) -> bool {
    let placed: Vec<DVec3> = corners(member, mesh, origin).collect();
    let reach = placed.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let edges: f64 = mesh
        .triangles
        .iter()
        .map(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|k| placed[k as usize]);
            (b - a).length() + (c - b).length() + (a - c).length()
        })
        .sum();
    let mean_edge = edges / (3 * mesh.triangles.len()) as f64;
    // False for what is not finite, and for a mesh without triangles.
    reach * f64::from(f32::EPSILON) * 0.5 <= WORST_ROUNDING * mean_edge && reach.is_finite()
}

/// Builds [`RestingTree`] anew when a mesh came to rest, left, or is at another place.
pub fn join_resting_meshes(
    resting: Res<RestingMeshes>,
    meshes: Res<Meshes>,
    settings: Res<Settings>,
    mut tree: ResMut<RestingTree>,
) {
    let quality = settings.0.bvh;
    if resting.is_changed()
        || tree.is_outdated(quality)
        || (meshes.is_changed() && !resting.0.is_empty())
    {
        let built = RestingTree::build(&resting.0, &meshes.list, quality);
        if built.tree.is_some() || tree.tree.is_some() {
            *tree = built;
        }
    } else if tree.built {
        tree.bypass_change_detection().built = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;

    /// A fan of so many triangles.
    fn fan(count: u32) -> Arc<TriangleMesh> {
        let corner = |k: u32| Vec3::new((0.1 * k as f32).cos(), (0.1 * k as f32).sin(), k as f32);
        Arc::new(TriangleMesh {
            positions: (0..count + 2).map(corner).collect(),
            triangles: (0..count).map(|k| [0, k + 1, k + 2]).collect(),
            ..Default::default()
        })
    }

    /// Oracle: the bytes held besides the tree, whose own forecast has a test.
    #[test]
    fn the_copy_takes_what_was_forecast() {
        let meshes = [fan(300), fan(77), fan(1000)];
        let resting: Vec<RestingMesh> = (0..3)
            .map(|k| RestingMesh { instance: k, mesh: k, world_from_mesh: DAffine3::IDENTITY })
            .collect();
        let quality = BvhQuality::default();
        let tree = RestingTree::build(&resting, &meshes, quality);
        let shared = tree.tree.as_ref().expect("three may be joined");
        assert_eq!(shared.mesh.triangles.len(), 1377);
        let members = tree.members.capacity() * size_of::<(u32, u32)>();
        let copy = tree.memory() - shared.memory() - members;
        let forecast = RestingTree::forecast(&resting, &meshes, quality);
        assert_eq!(copy, forecast - WideTree::forecast(1377, quality));
        assert_eq!(RestingTree::forecast(&resting[..1], &meshes, quality), 0, "one is not joined");
    }
}
