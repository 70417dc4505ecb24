//! The tree over the objects of a frame.

use super::movers::{Mover, Movers, mover};
use super::resting::RestingTree;
use super::spheres::{LANES, SphereBlock, joinable};
use super::wide::BoxTree;
use super::{Bvh, MeshTree};
use crate::extract::{FrameOrigin, Instance, Instances, Meshes, NOTHING};
use crate::math::Aabb;
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// Cost of the share of a node which divides two leaves, in tests of a block of spheres.
const DIVIDING: f32 = 0.35;
/// With so few objects each is asked in turn, which costs less than a tree over them.
const FEW: usize = 3;
/// Stands among the objects for all meshes of the [`RestingTree`].
pub(super) const RESTING: u32 = u32::MAX;
/// Stands among the objects for all which move far.
const MOVING: u32 = u32::MAX - 1;

/// What a leaf of the tree holds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Leaf {
    /// An instance.
    One(u32),
    /// The meshes of the [`RestingTree`].
    Resting,
    /// All objects which move far.
    Moving,
    /// A block of spheres.
    Spheres(usize),
}

impl Leaf {
    /// Set in the names of blocks.
    const SPHERES: u32 = 1 << 31;

    /// What a name stands for.
    #[inline]
    pub(super) fn of(name: u32) -> Self {
        if name & Self::SPHERES == 0 {
            Self::One(name)
        } else if name == RESTING {
            Self::Resting
        } else if name == MOVING {
            Self::Moving
        } else {
            Self::Spheres((name & !Self::SPHERES) as usize)
        }
    }
}

/// The resting meshes as the top level holds them.
#[derive(Clone, Debug)]
pub(super) struct Joined {
    pub(super) tree: Arc<MeshTree>,
    /// Render space from the space of the tree.
    pub(super) shift: DVec3,
    pub(super) members: RestingTree,
}

impl Joined {
    fn new(resting: &RestingTree, origin: &FrameOrigin) -> Option<Self> {
        let (tree, shift) = resting.placed(origin)?;
        Some(Self { tree, shift, members: resting.clone() })
    }

    /// Sees the tree from another origin.
    fn place(&mut self, origin: &FrameOrigin) {
        if let Some((_, shift)) = self.members.placed(origin) {
            self.shift = shift;
        }
    }

    fn bounds(&self) -> Aabb {
        self.tree.bounds().transformed(&DAffine3::from_translation(self.shift))
    }
}

/// The objects which move far, ascending.
fn far_movers(instances: &[Instance], mesh_bounds: &[Aabb]) -> Vec<Mover> {
    let numbered = (0..).zip(instances);
    numbered.filter_map(|(index, instance)| mover(index, instance, mesh_bounds)).collect()
}

/// Spheres on their way into blocks.
struct Spheres {
    blocks: Vec<SphereBlock>,
    /// For each instance its lane, or [`NOTHING`].
    lanes: Vec<u32>,
}

impl Spheres {
    /// Puts the spheres of small subtrees into blocks, and names their leaves.
    fn gather(&mut self, binary: &mut Bvh, names: &mut [u32], instances: &[Instance]) {
        let sphere = |name: u32| instances.get(name as usize).and_then(joinable);
        binary.share_leaves(LANES as u32, DIVIDING, |item| sphere(names[item as usize]).is_some());
        let mut free = 0;
        for items in binary.leaves() {
            if sphere(names[items[0] as usize]).is_none() {
                continue;
            }
            if free < items.len() {
                self.blocks.push(SphereBlock::EMPTY);
                free = LANES;
            }
            let block = self.blocks.len() - 1;
            for &item in items {
                let index = names[item as usize];
                if let Some(numbers) = sphere(index) {
                    let lane = LANES - free;
                    free -= 1;
                    self.blocks[block].set(lane, index, numbers);
                    self.lanes[index as usize] = (block * LANES + lane) as u32;
                }
            }
            names[items[0] as usize] = Leaf::SPHERES | block as u32;
        }
    }
}

/// The tree over the objects of a frame. Planes have no bounds and are kept beside it.
#[derive(Resource, Clone, Debug, Default)]
pub struct TopLevel {
    pub(super) tree: BoxTree,
    /// What is asked without a tree.
    pub(super) always: Vec<u32>,
    pub(super) joined: Option<Joined>,
    pub(super) movers: Option<Movers>,
    /// Whether anything moves within the shutter other than by changing its form.
    pub(super) moves: bool,
    /// For each instance its box in the tree, or [`NOTHING`].
    boxes: Vec<u32>,
    /// Spheres at rest, in the order of the leaves which hold them.
    pub(super) spheres: Vec<SphereBlock>,
    /// For each instance its lane, counted over all blocks, or [`NOTHING`].
    lanes: Vec<u32>,
    bounds: Aabb,
    /// Whether it was built anew in this frame.
    pub built: bool,
    /// How many objects were put elsewhere in this frame without building it anew.
    pub refitted: usize,
}

impl TopLevel {
    /// Builds the tree over `instances`.
    pub fn build(instances: &[Instance]) -> Self {
        Self::with_resting(instances, &[], &RestingTree::default(), &FrameOrigin::default())
    }

    /// Builds the tree over `instances` with boxes around their ways during the whole shutter, as the
    /// bench does to see what segments are worth.
    pub fn without_segments(instances: &[Instance]) -> Self {
        Self::assemble(instances, &[], &RestingTree::default(), &FrameOrigin::default())
    }

    /// Builds the tree over `instances` and the tree of resting meshes; `mesh_bounds` are the boxes of the
    /// meshes during the whole shutter.
    pub fn with_resting(
        instances: &[Instance],
        mesh_bounds: &[Aabb],
        resting: &RestingTree,
        origin: &FrameOrigin,
    ) -> Self {
        Self::assemble(instances, &far_movers(instances, mesh_bounds), resting, origin)
    }

    /// The same with these objects in trees by segments.
    fn assemble(
        instances: &[Instance],
        far: &[Mover],
        resting: &RestingTree,
        origin: &FrameOrigin,
    ) -> Self {
        let joined = Joined::new(resting, origin);
        let movers = Movers::build(far, instances);
        let mut far = far.iter().map(|(index, _)| *index).peekable();
        let mut objects: Vec<(u32, Aabb)> = Vec::with_capacity(instances.len() + 1);
        let mut always = Vec::new();
        let mut boxes = vec![NOTHING; instances.len()];
        for (index, instance) in (0..).zip(instances) {
            if far.next_if_eq(&index).is_some() || resting.first_triangle(index).is_some() {
                continue;
            }
            if instance.bounds.min.is_finite() {
                boxes[index as usize] = objects.len() as u32;
                objects.push((index, instance.bounds));
            } else {
                always.push(index);
            }
        }
        if let Some(movers) = &movers {
            objects.push((MOVING, movers.bounds));
        }
        if let Some(joined) = &joined {
            objects.push((RESTING, joined.bounds()));
        }
        let bounds = objects.iter().fold(Aabb::EMPTY, |sum, (_, b)| sum.union(*b));
        let mut spheres = Spheres { blocks: Vec::new(), lanes: vec![NOTHING; instances.len()] };
        let tree = if objects.len() <= FEW {
            // The resting meshes first: most of what is hit is there, and a near hit saves work.
            always.extend(objects.iter().rev().map(|(index, _)| *index));
            BoxTree::default()
        } else {
            let (mut names, boxes): (Vec<u32>, Vec<Aabb>) = objects.into_iter().unzip();
            let mut binary = Bvh::build(&boxes, 1);
            spheres.gather(&mut binary, &mut names, instances);
            BoxTree::collapse(&binary, &boxes, &names)
        };
        let Spheres { blocks: spheres, lanes } = spheres;
        let moves = instances.iter().any(|instance| !instance.motion.is_static());
        Self {
            tree,
            always,
            joined,
            movers,
            moves,
            boxes,
            spheres,
            lanes,
            bounds,
            built: true,
            refitted: 0,
        }
    }

    /// Puts some objects elsewhere; false when the tree should rather be built anew.
    pub(super) fn refit(
        &mut self,
        instances: &[Instance],
        mesh_bounds: &[Aabb],
        moved: &[u32],
        origin: &FrameOrigin,
    ) -> bool {
        if self.tree.is_empty() {
            // There is next to nothing to build.
            return false;
        }
        let moving = |index: &u32| !instances[*index as usize].motion.is_static();
        // What moved in the last frame may do so again without having been written.
        let moves = self.moves || moved.iter().any(moving);
        let far = if moves { far_movers(instances, mesh_bounds) } else { Vec::new() };
        if !self.movers.as_ref().map_or(far.is_empty(), |movers| movers.are(&far)) {
            return false;
        }
        let mut last = self.tree.len();
        if self.joined.is_some() {
            last -= 1;
        }
        if let Some(movers) = Movers::build(&far, instances) {
            self.tree.refit(last - 1, &movers.bounds);
            self.movers = Some(movers);
        }
        self.moves = moves && instances.iter().any(|instance| !instance.motion.is_static());
        let mut far = far.iter().map(|(index, _)| *index).peekable();
        for &index in moved {
            while far.next_if(|far| *far < index).is_some() {}
            if far.next_if_eq(&index).is_some() {
                continue;
            }
            let instance = &instances[index as usize];
            let place = self.boxes[index as usize];
            if instance.bounds.min.is_finite() != (place != NOTHING) {
                return false;
            }
            if place != NOTHING {
                let Some(bounds) = self.follow(index, instances) else { return false };
                self.tree.refit(place as usize, &bounds);
            }
        }
        if let Some(joined) = &mut self.joined {
            joined.place(origin);
            // Its box is the last.
            self.tree.refit(self.tree.len() - 1, &joined.bounds());
        }
        self.bounds = self.tree.bounds();
        self.refitted = moved.len();
        !self.tree.is_worn()
    }

    /// The box of the leaf of an instance which was put elsewhere; `None` when it cannot stay in its
    /// block.
    fn follow(&mut self, index: u32, instances: &[Instance]) -> Option<Aabb> {
        let instance = &instances[index as usize];
        let lane = self.lanes[index as usize];
        if lane == NOTHING {
            return Some(instance.bounds);
        }
        let (block, lane) = (lane as usize / LANES, lane as usize % LANES);
        self.spheres[block].set(lane, index, joinable(instance)?);
        let place = self.boxes[index as usize];
        // The others of its leaf are others of its block.
        let members = self.spheres[block].instances.into_iter().filter(|index| *index != NOTHING);
        let members =
            members.filter(|&k| self.tree.share(self.boxes[k as usize] as usize, place as usize));
        Some(members.map(|k| instances[k as usize].bounds).fold(Aabb::EMPTY, Aabb::union))
    }

    /// Bytes held, without the tree of resting meshes.
    pub fn memory(&self) -> usize {
        let tables = self.always.capacity() + self.boxes.capacity() + self.lanes.capacity();
        self.tree.memory()
            + self.movers.as_ref().map_or(0, Movers::memory)
            + self.spheres.capacity() * size_of::<SphereBlock>()
            + tables * size_of::<u32>()
    }

    /// In how many segments of the shutter what moves far is bounded; 1 when nothing is.
    pub fn segments(&self) -> usize {
        self.movers.as_ref().map_or(1, Movers::segments)
    }

    /// Has rays take the code for a scene in which something moves, as the bench does to see what it
    /// costs where nothing does.
    pub fn assume_motion(&mut self) {
        self.moves = true;
    }

    /// The box around all instances which have bounds.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// Follows the instances: those which moved are put elsewhere in the tree, and it is built anew when
/// objects came or went, or when it was refitted so often that rays suffer.
///
/// What a ray hits does not depend on the shape of the tree, so that a frame is the same in either case.
pub fn rebuild_top_level(
    instances: Res<Instances>,
    meshes: Res<Meshes>,
    resting: Res<RestingTree>,
    origin: Res<FrameOrigin>,
    mut top: ResMut<TopLevel>,
) {
    let changed = instances.is_changed() || resting.is_changed() || origin.is_changed();
    if !changed {
        if top.built || top.refitted > 0 {
            let top = top.bypass_change_detection();
            (top.built, top.refitted) = (false, 0);
        }
        return;
    }
    let top = &mut *top;
    let same = !(instances.is_added() || instances.restructured || resting.is_changed());
    top.built = false;
    if !(same && top.refit(&instances.list, &meshes.bounds, &instances.rewritten_slots, &origin)) {
        *top = TopLevel::with_resting(&instances.list, &meshes.bounds, &resting, &origin);
    }
}
