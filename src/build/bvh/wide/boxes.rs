//! A tree of eight-fold nodes over boxes: the top level, whose leaves are objects.

use super::Instructions;
use super::node::{Child, Node, WIDTH};
use super::ray::BoxRay;
use super::traverse::{Distances, Lanes, Portable, child_of, distance_of, key, take_lane};
use crate::build::bvh::Bvh;
use crate::math::Aabb;
use crate::shape::LocalRay;

/// Levels of the binary tree that this one is made of, at the most.
const DEEPEST: usize = 72;
/// Room for any tree: every level leaves all children but one on the stack.
const STACK: usize = DEEPEST * (WIDTH - 1) + 1;
/// Room that is enough for all but odd trees.
const SHORT_STACK: usize = 96;

/// The tree. Boxes are named by numbers of the caller's.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    /// Children come after their parent.
    nodes: Vec<Node>,
    /// Names of the boxes, by the index in a leaf.
    names: Vec<u32>,
    /// Room on the stack that a traversal takes at most.
    stack: usize,
}

impl BoxTree {
    /// Gathers the nodes of a binary tree with one box in a leaf, the largest first, until each node
    /// has eight children.
    pub fn collapse(binary: &Bvh, boxes: &[Aabb], names: &[u32]) -> Self {
        let mut tree = Self { nodes: Vec::new(), names: names.to_vec(), stack: 0 };
        if binary.root().is_some() {
            tree.stack = tree.emit(binary, 0, boxes);
        }
        tree
    }

    fn emit(&mut self, binary: &Bvh, root: usize, boxes: &[Aabb]) -> usize {
        let mut open = vec![root];
        loop {
            let widest = (0..open.len())
                .filter(|&k| binary.children(open[k]).is_some())
                .max_by(|&a, &b| binary.area(open[a]).total_cmp(&binary.area(open[b])));
            let Some(widest) = widest.filter(|_| open.len() < WIDTH) else { break };
            let [a, b] = binary.children(open[widest]).expect("only inner nodes are opened");
            open[widest] = a;
            open.push(b);
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut deepest = 0;
        for (slot, &below) in open.iter().enumerate() {
            let child = if let Some(item) = binary.item(below) {
                self.nodes[index].set_box(slot, &boxes[item as usize]);
                Child::leaf(item as usize, 1)
            } else {
                self.nodes[index].set_box(slot, &binary.bounds_of(below));
                let child = Child::node(self.nodes.len());
                deepest = deepest.max(self.emit(binary, below, boxes));
                child
            };
            self.nodes[index].children[slot] = child;
        }
        open.len().max(open.len() - 1 + deepest)
    }

    /// Visits the boxes which the ray may meet before `t_max`, nearer ones first.
    ///
    /// `visit` gets a name and the current `t_max` and returns the new one; a `t_max` of 0 or less
    /// ends the traversal.
    #[inline]
    pub fn traverse(&self, ray: &LocalRay, t_max: f64, visit: impl FnMut(u32, f64) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let Some(prepared) = BoxRay::new(ray) else { return };
        match (Instructions::detect(), self.stack <= SHORT_STACK) {
            #[cfg(target_arch = "x86_64")]
            (Instructions::Avx2(avx2), true) => {
                avx2.visit_boxes::<SHORT_STACK>(self, &prepared, t_max, visit);
            }
            #[cfg(target_arch = "x86_64")]
            (Instructions::Avx2(avx2), false) => {
                avx2.visit_boxes::<STACK>(self, &prepared, t_max, visit);
            }
            (Instructions::Portable, _) => {
                visit_boxes::<Portable, STACK>(self, &prepared, t_max, visit)
            }
        }
    }
}

/// [`BoxTree::traverse`] with a set of instructions.
#[inline(always)]
pub(super) fn visit_boxes<L: Lanes, const STACK: usize>(
    tree: &BoxTree,
    prepared: &BoxRay,
    mut t_max: f64,
    mut visit: impl FnMut(u32, f64) -> f64,
) {
    let boxes = L::prepare_boxes(prepared);
    let mut end = prepared.distance(t_max);
    let mut stack = [0_u64; STACK];
    let mut depth = 0;
    let mut distances = Distances::default();
    let mut current = Child::node(0);
    loop {
        if current.is_leaf() {
            for k in current.blocks() {
                t_max = visit(tree.names[k], t_max);
            }
            if t_max <= 0.0 {
                return;
            }
            end = prepared.distance(t_max);
        } else {
            let node = &tree.nodes[current.index()];
            let mut mask = L::enter(&boxes, node, end, &mut distances);
            let bottom = depth;
            while mask != 0 {
                let lane = take_lane(&mut mask);
                let entry = key(distances.0[lane], node.children[lane]);
                let mut place = depth;
                while place > bottom && stack[place - 1] < entry {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = entry;
                depth += 1;
            }
        }
        loop {
            if depth == 0 {
                return;
            }
            depth -= 1;
            if distance_of(stack[depth]) <= end {
                current = child_of(stack[depth]);
                break;
            }
        }
    }
}
