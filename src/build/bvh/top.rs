//! The tree over the objects of a frame.

use super::resting::RestingTree;
use super::wide::BoxTree;
use super::{Bvh, MeshTree};
use crate::extract::{FrameOrigin, Instance, Instances};
use crate::math::Aabb;
use bevy_ecs::prelude::*;
use glam::DVec3;
use std::sync::Arc;

/// With so few objects each is asked in turn, which costs less than a tree over them.
const FEW: usize = 3;
/// Stands among the objects for all meshes of the [`RestingTree`].
pub(super) const RESTING: u32 = u32::MAX;

/// The resting meshes as the top level holds them.
#[derive(Clone, Debug)]
pub(super) struct Joined {
    pub(super) tree: Arc<MeshTree>,
    /// Render space from the space of the tree.
    pub(super) shift: DVec3,
    pub(super) members: RestingTree,
}

/// The tree over the objects of a frame. Planes have no bounds and are kept beside it.
#[derive(Resource, Clone, Debug, Default)]
pub struct TopLevel {
    pub(super) tree: BoxTree,
    /// What is asked without a tree.
    pub(super) always: Vec<u32>,
    pub(super) joined: Option<Joined>,
    bounds: Aabb,
    /// Whether it was built anew in this frame.
    pub built: bool,
}

impl TopLevel {
    /// Builds the tree over `instances`.
    pub fn build(instances: &[Instance]) -> Self {
        Self::with_resting(instances, &RestingTree::default(), &FrameOrigin::default())
    }

    /// Builds the tree over `instances` and the tree of resting meshes.
    pub fn with_resting(
        instances: &[Instance],
        resting: &RestingTree,
        origin: &FrameOrigin,
    ) -> Self {
        let joined = resting.placed(origin).map(|(tree, shift)| Joined {
            tree,
            shift,
            members: resting.clone(),
        });
        let mut objects: Vec<(u32, Aabb)> = Vec::with_capacity(instances.len() + 1);
        let mut always = Vec::new();
        for (index, instance) in (0..).zip(instances) {
            if resting.first_triangle(index).is_some() {
                continue;
            }
            if instance.bounds.min.is_finite() {
                objects.push((index, instance.bounds));
            } else {
                always.push(index);
            }
        }
        if let Some(joined) = &joined {
            let shift = glam::DAffine3::from_translation(joined.shift);
            objects.push((RESTING, joined.tree.tree().bounds().transformed(&shift)));
        }
        let bounds = objects.iter().fold(Aabb::EMPTY, |sum, (_, b)| sum.union(*b));
        let tree = if objects.len() <= FEW {
            // The resting meshes first: most of what is hit is there, and a near hit saves work.
            always.extend(objects.iter().rev().map(|(index, _)| *index));
            BoxTree::default()
        } else {
            let (names, boxes): (Vec<u32>, Vec<Aabb>) = objects.into_iter().unzip();
            BoxTree::collapse(&Bvh::build(&boxes, 1), &boxes, &names)
        };
        Self { tree, always, joined, bounds, built: true }
    }

    /// The box around all instances which have bounds.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// Builds the top level anew when an instance changed.
pub fn rebuild_top_level(
    instances: Res<Instances>,
    resting: Res<RestingTree>,
    origin: Res<FrameOrigin>,
    mut top: ResMut<TopLevel>,
) {
    if instances.is_changed() || resting.is_changed() || origin.is_changed() {
        *top = TopLevel::with_resting(&instances.list, &resting, &origin);
    } else if top.built {
        top.bypass_change_detection().built = false;
    }
}
