//! An optional step of a build: parts of the binary tree move to better places.
//!
//! A split is chosen before what is below it is known. Afterwards a subtree may be cheaper to reach
//! elsewhere. For each of the nodes with the largest boxes the place is searched where taking the node
//! out and putting it in again lowers the sum of all surface areas most, branch and bound from its own
//! place up (Meister and Bittner 2018, "Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization", Computer Graphics Forum 37(2), section 4; here one node after the other, so that the
//! result does not depend on threads).

use super::binary::{BinaryNode, DEEPEST, Reference, children};
use crate::math::Aabb;

/// Share of all nodes that is tried in a round, and rounds: for half as much again of the time of a build,
/// as `cargo bench --bench speed` shows.
const SHARE: f64 = 0.2;
const ROUNDS: usize = 2;
/// No node.
const NONE: u32 = u32::MAX;

/// A node with links both ways.
#[derive(Clone, Copy, Debug)]
struct Link {
    bounds: Aabb,
    parent: u32,
    /// [`NONE`] in a leaf.
    children: [u32; 2],
    /// References of a leaf.
    first: u32,
    count: u32,
}

struct Links(Vec<Link>);

/// Improves a tree and the order of its references. A tree that became too deep is given back as it
/// was.
pub(super) fn optimize(references: &mut Vec<Reference>, nodes: &mut Vec<BinaryNode>) {
    if nodes.is_empty() {
        return;
    }
    let mut links = Links(Vec::new());
    links.add(nodes, NONE);
    for _ in 0..ROUNDS {
        let mut order: Vec<(f32, u32)> =
            links.0.iter().zip(0..).map(|(link, index)| (link.bounds.area(), index)).collect();
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        order.truncate((links.0.len() as f64 * SHARE) as usize);
        for (_, node) in order {
            if let Some(place) = links.best_place(node) {
                links.move_to(node, place);
            }
        }
    }
    if links.depth() <= DEEPEST {
        let old = std::mem::take(references);
        nodes.clear();
        links.flatten(0, &old, references, nodes);
    }
}

impl Links {
    /// Adds a subtree; returns where its root is.
    fn add(&mut self, nodes: &[BinaryNode], parent: u32) -> u32 {
        let index = self.0.len() as u32;
        let BinaryNode { bounds, first, count, .. } = nodes[0];
        self.0.push(Link { bounds, parent, children: [NONE; 2], first, count });
        if nodes[0].is_inner() {
            let (left, right) = children(nodes);
            let pair = [self.add(left, index), self.add(right, index)];
            self.0[index as usize].children = pair;
        }
        index
    }

    fn at(&self, node: u32) -> &Link {
        &self.0[node as usize]
    }

    fn sibling(&self, node: u32) -> u32 {
        let [a, b] = self.at(self.at(node).parent).children;
        if a == node { b } else { a }
    }

    /// The node beside which `node` should hang, if anywhere else than now.
    fn best_place(&self, node: u32) -> Option<u32> {
        let own = self.at(node).bounds;
        let parent = self.at(node).parent;
        // The root stays, and so do its children: taking one out would make the other the root.
        if parent == NONE || self.at(parent).parent == NONE {
            return None;
        }
        let mut best = (0.0, None);
        // Area saved so far: that of the parent, which goes, and of the shrunken nodes above.
        let mut saved = self.at(parent).bounds.area();
        let (mut pivot, mut sibling) = (parent, self.sibling(node));
        let mut shrunken = self.at(sibling).bounds;
        let mut stack = Vec::new();
        loop {
            stack.push((saved, sibling));
            while let Some((saved, place)) = stack.pop() {
                if saved - own.area() <= best.0 {
                    continue;
                }
                let Link { bounds, children, .. } = *self.at(place);
                let gain = saved - bounds.union(own).area();
                if gain > best.0 {
                    best = (gain, Some(place));
                }
                if children[0] != NONE {
                    stack.extend(children.map(|child| (gain + bounds.area(), child)));
                }
            }
            if pivot != parent {
                shrunken = shrunken.union(self.at(sibling).bounds);
                saved += self.at(pivot).bounds.area() - shrunken.area();
            }
            if self.at(pivot).parent == NONE {
                return best.1;
            }
            sibling = self.sibling(pivot);
            pivot = self.at(pivot).parent;
        }
    }

    /// Takes `node` out and hangs it beside `place`. Its old parent becomes the new one.
    fn move_to(&mut self, node: u32, place: u32) {
        let parent = self.at(node).parent;
        let (sibling, above) = (self.sibling(node), self.at(parent).parent);
        self.replace(above, parent, sibling);
        let new_above = self.at(place).parent;
        self.replace(new_above, place, parent);
        self.0[parent as usize].children = [node, place];
        self.0[place as usize].parent = parent;
        self.refit(above);
        self.refit(parent);
    }

    fn replace(&mut self, above: u32, old: u32, new: u32) {
        for child in &mut self.0[above as usize].children {
            if *child == old {
                *child = new;
            }
        }
        self.0[new as usize].parent = above;
    }

    /// Boxes from a node up.
    fn refit(&mut self, mut node: u32) {
        while node != NONE {
            let [a, b] = self.at(node).children;
            self.0[node as usize].bounds = self.at(a).bounds.union(self.at(b).bounds);
            node = self.at(node).parent;
        }
    }

    /// Levels of the tree.
    fn depth(&self) -> usize {
        let (mut deepest, mut stack) = (0, vec![(0_u32, 1)]);
        while let Some((node, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            let children = self.at(node).children;
            if children[0] != NONE {
                stack.extend(children.map(|child| (child, depth + 1)));
            }
        }
        deepest
    }

    /// Appends a subtree and its references in the order of the build.
    fn flatten(
        &self,
        node: u32,
        old: &[Reference],
        references: &mut Vec<Reference>,
        nodes: &mut Vec<BinaryNode>,
    ) {
        let Link { bounds, children, first, count, .. } = *self.at(node);
        let (index, begin) = (nodes.len(), references.len());
        nodes.push(BinaryNode::leaf(bounds, begin as u32, count));
        if children[0] == NONE {
            references.extend_from_slice(&old[first as usize..(first + count) as usize]);
            return;
        }
        self.flatten(children[0], old, references, nodes);
        let right = nodes.len() - index;
        self.flatten(children[1], old, references, nodes);
        nodes[index].make_inner((references.len() - begin) as u32, right as u32);
    }
}
