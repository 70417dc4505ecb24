//! The second step of a build: eight children for each node.
//!
//! Which nodes of the binary tree become nodes of the wide one, and which of its subtrees become
//! leaves, is chosen so that the expected cost of a ray is least, by dynamic programming from the
//! leaves up: for every node, the cost of its subtree as at most 1, 2, … 7 children of a wide node
//! (Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
//! BVHs", section 3.1).

use super::WideTree;
use super::binary::{BinaryNode, LEAF, PARALLEL, Reference, children};
use super::node::{BLOCK, Block, Child, Node, WIDTH};
use crate::description::TriangleMesh;

/// Cost of the box test of a node; the unit of costs.
const NODE_COST: f32 = 1.0;
/// Cost of testing a block of triangles.
const BLOCK_COST: f32 = 0.6;
/// Most references in a leaf.
const WIDE_LEAF: usize = 2 * BLOCK;

/// How a subtree is divided among a number of children, packed in three bits each.
///
/// For `j` in `2..=7`: how many of `j` children the left subtree gets, or 0 if `j − 1` are as good.
/// For 8: the same for a wide node with this root. For 1: whether that child is a leaf.
#[derive(Clone, Copy, Debug, Default)]
struct Plan(u32);

impl Plan {
    fn set(&mut self, j: usize, value: usize) {
        self.0 |= (value as u32) << (3 * (j - 1));
    }

    fn get(self, j: usize) -> usize {
        (self.0 >> (3 * (j - 1)) & 7) as usize
    }
}

/// Plans the collapse of a subtree; returns its cost as at most 1, 2, … 7 children.
fn plan(nodes: &[BinaryNode], plans: &mut [Plan]) -> [f32; WIDTH - 1] {
    let node = &nodes[0];
    let count = node.count as usize;
    let area = node.bounds.area();
    let leaf = area * BLOCK_COST * count.div_ceil(BLOCK) as f32;
    if count <= LEAF {
        plans[0].set(1, 1);
        return [leaf; WIDTH - 1];
    }
    let (left, right) = children(nodes);
    let (left_plans, right_plans) = plans[1..].split_at_mut(left.len());
    let (left, right) = if count >= PARALLEL {
        rayon::join(|| plan(left, left_plans), || plan(right, right_plans))
    } else {
        (plan(left, left_plans), plan(right, right_plans))
    };
    let mut best = Plan::default();
    let mut costs = [0.0; WIDTH - 1];
    let shared = |j: usize| {
        let mut least = (f32::INFINITY, 1);
        for k in 1..j {
            let cost = left[k - 1] + right[j - k - 1];
            if cost < least.0 {
                least = (cost, k);
            }
        }
        least
    };
    let (below, k) = shared(WIDTH);
    best.set(WIDTH, k);
    let inner = below + area * NODE_COST;
    let as_leaf = count <= WIDE_LEAF && leaf <= inner;
    best.set(1, usize::from(as_leaf));
    costs[0] = if as_leaf { leaf } else { inner };
    for j in 2..WIDTH {
        let (cost, k) = shared(j);
        costs[j - 1] = costs[j - 2];
        if cost < costs[j - 1] {
            costs[j - 1] = cost;
            best.set(j, k);
        }
    }
    plans[0] = best;
    costs
}

/// The nodes of the binary tree which become the children of a wide node.
#[derive(Clone, Copy, Default)]
struct Slots<'a> {
    list: [Option<(&'a [BinaryNode], &'a [Plan])>; WIDTH],
    count: usize,
}

impl<'a> Slots<'a> {
    /// Adds a subtree as at most `j` children.
    fn add(&mut self, nodes: &'a [BinaryNode], plans: &'a [Plan], j: usize) {
        let mut j = j;
        // A leaf of the binary tree has no plan but that for one child.
        while j > 1 && plans[0].get(j) == 0 {
            j -= 1;
        }
        if j == 1 {
            self.list[self.count] = Some((nodes, plans));
            self.count += 1;
        } else {
            self.divide(nodes, plans, j);
        }
    }

    /// Adds both children of a subtree, as at most `j` in all.
    fn divide(&mut self, nodes: &'a [BinaryNode], plans: &'a [Plan], j: usize) {
        let k = plans[0].get(j);
        let (left, right) = children(nodes);
        let (left_plans, right_plans) = plans[1..].split_at(left.len());
        self.add(left, left_plans, k);
        self.add(right, right_plans, j - k);
    }
}

struct Emitter<'a> {
    mesh: &'a TriangleMesh,
    references: &'a [Reference],
    tree: WideTree,
}

impl Emitter<'_> {
    /// Writes the blocks of a leaf.
    fn leaf(&mut self, node: &BinaryNode) -> Child {
        let first = self.tree.blocks.len();
        let range = node.first as usize..(node.first + node.count) as usize;
        for four in self.references[range].chunks(BLOCK) {
            let mut block = Block::EMPTY;
            for (lane, reference) in four.iter().enumerate() {
                let triangle = reference.triangle();
                block.set(lane, triangle, super::corners(self.mesh, triangle));
            }
            self.tree.blocks.push(block);
        }
        Child::leaf(first, self.tree.blocks.len() - first)
    }

    /// Writes a node and all below it; returns the room on the stack that its traversal takes.
    fn node(&mut self, nodes: &[BinaryNode], plans: &[Plan]) -> usize {
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node::EMPTY);
        let mut slots = Slots::default();
        slots.divide(nodes, plans, WIDTH);
        let area = |slot: &Option<(&[BinaryNode], &[Plan])>| {
            slot.map_or(f32::INFINITY, |(nodes, _)| nodes[0].bounds.area())
        };
        slots.list[..slots.count].sort_by(|a, b| area(a).total_cmp(&area(b)));
        // First all leaves, so that those of a node are neighbours; then what is below.
        for (slot, (nodes, plans)) in slots.list.iter().flatten().enumerate() {
            self.tree.nodes[index].set_box(slot, &nodes[0].bounds);
            if plans[0].get(1) == 1 {
                self.tree.nodes[index].children[slot] = self.leaf(&nodes[0]);
            }
        }
        let mut deepest = 0;
        for (slot, (nodes, plans)) in slots.list.iter().flatten().enumerate() {
            if plans[0].get(1) == 0 {
                self.tree.nodes[index].children[slot] = Child::node(self.tree.nodes.len());
                deepest = deepest.max(self.node(nodes, plans));
            }
        }
        // All children are put on the stack before one is taken from it.
        slots.count.max(slots.count - 1 + deepest)
    }
}

/// Makes the wide tree of a binary one.
pub(super) fn collapse(
    mesh: &TriangleMesh,
    references: &[Reference],
    nodes: &[BinaryNode],
) -> WideTree {
    let mut emitter = Emitter { mesh, references, tree: WideTree::default() };
    let Some(root) = nodes.first() else { return emitter.tree };
    let mut plans = vec![Plan::default(); nodes.len()];
    plan(nodes, &mut plans);
    emitter.tree.blocks = super::pages::vec_on_large_pages(references.len() / 2);
    emitter.tree.nodes = super::pages::vec_on_large_pages(references.len() / 8);
    if root.count as usize <= WIDE_LEAF {
        emitter.tree.root = emitter.leaf(root);
    } else {
        emitter.tree.root = Child::node(0);
        emitter.tree.stack = emitter.node(nodes, &plans);
    }
    emitter.tree
}
