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
use super::pages::filled_on_large_pages;
use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;

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
#[derive(Clone, Copy, Debug, Default, Zeroable)]
#[repr(transparent)]
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

/// How many nodes and blocks a wide subtree takes, and where that of its children is worth knowing.
#[derive(Clone, Debug, Default)]
struct Size {
    nodes: usize,
    blocks: usize,
    /// Room on the stack that a traversal takes.
    stack: usize,
    /// The sizes of the children that are nodes, in order; empty in a small subtree.
    children: Vec<Size>,
}

/// The slots of the wide node with this root, the largest box last: what blocks a shadow ray most
/// likely is taken from the stack first (Nah and Manocha 2014, "SATO: Surface Area Traversal Order for
/// Shadow Ray Tracing", Computer Graphics Forum 33(6), with boxes for surfaces).
fn slots_of<'a>(nodes: &'a [BinaryNode], plans: &'a [Plan]) -> Slots<'a> {
    let mut slots = Slots::default();
    slots.divide(nodes, plans, WIDTH);
    let area = |slot: &Option<(&[BinaryNode], &[Plan])>| {
        slot.map_or(f32::INFINITY, |(nodes, _)| nodes[0].bounds.area())
    };
    slots.list[..slots.count].sort_by(|a, b| area(a).total_cmp(&area(b)));
    slots
}

/// Measures the wide subtree with this root.
fn size_of_subtree(nodes: &[BinaryNode], plans: &[Plan]) -> Size {
    let slots = slots_of(nodes, plans);
    let count = nodes[0].count as usize;
    let mut size = Size { nodes: 1, ..Size::default() };
    let mut inner = Vec::new();
    for &(nodes, plans) in slots.list.iter().flatten() {
        if plans[0].get(1) == 1 {
            size.blocks += (nodes[0].count as usize).div_ceil(BLOCK);
        } else {
            inner.push((nodes, plans));
        }
    }
    let below: Vec<Size> = if count >= PARALLEL {
        inner.par_iter().map(|(nodes, plans)| size_of_subtree(nodes, plans)).collect()
    } else {
        inner.iter().map(|(nodes, plans)| size_of_subtree(nodes, plans)).collect()
    };
    for child in &below {
        size.nodes += child.nodes;
        size.blocks += child.blocks;
        size.stack = size.stack.max(child.stack);
    }
    // All children are put on the stack before one is taken from it.
    size.stack = slots.count.max(slots.count - 1 + size.stack);
    if count >= PARALLEL {
        size.children = below;
    }
    size
}

/// Writes a part of the tree: its own nodes and blocks, which start at these indices of the whole.
struct Emitter<'a, C> {
    /// The corners of a triangle.
    corners: &'a C,
    /// Triangles of all references, in the order of the binary tree.
    order: &'a [u32],
    nodes: &'a mut [Node],
    blocks: &'a mut [Block],
    first_node: usize,
    first_block: usize,
}

impl<'a, C: Fn(u32) -> [Vec3; 3] + Sync> Emitter<'a, C> {
    /// Takes so many nodes and blocks from the front for another emitter.
    fn take(&mut self, nodes: usize, blocks: usize) -> Emitter<'a, C> {
        let taken = Emitter {
            nodes: self.nodes.split_off_mut(..nodes).expect("the size was measured"),
            blocks: self.blocks.split_off_mut(..blocks).expect("the size was measured"),
            ..*self
        };
        self.first_node += nodes;
        self.first_block += blocks;
        taken
    }

    /// Writes the blocks of a leaf.
    fn leaf(&mut self, node: &BinaryNode) -> Child {
        let order = &self.order[node.first as usize..(node.first + node.count) as usize];
        let count = order.len().div_ceil(BLOCK);
        let taken = self.take(0, count);
        for (block, four) in taken.blocks.iter_mut().zip(order.chunks(BLOCK)) {
            for (lane, &triangle) in four.iter().enumerate() {
                block.set(lane, triangle, (self.corners)(triangle));
            }
        }
        Child::leaf(taken.first_block, count)
    }

    /// Writes a node and all below it. `sizes` are those of its children, where they are known.
    fn node(&mut self, nodes: &[BinaryNode], plans: &[Plan], sizes: &[Size]) {
        let own = &mut self.take(1, 0).nodes[0];
        let slots = slots_of(nodes, plans);
        // First all leaves, so that those of a node are neighbours; then what is below.
        for (slot, (nodes, plans)) in slots.list.iter().flatten().enumerate() {
            own.set_box(slot, &nodes[0].bounds);
            if plans[0].get(1) == 1 {
                own.children[slot] = self.leaf(&nodes[0]);
            }
        }
        let mut later = Vec::with_capacity(sizes.len());
        for (slot, &(nodes, plans)) in slots.list.iter().flatten().enumerate() {
            if plans[0].get(1) == 0 {
                own.children[slot] = Child::node(self.first_node);
                if let Some(size) = sizes.get(later.len()) {
                    later.push((self.take(size.nodes, size.blocks), nodes, plans, size));
                } else {
                    self.node(nodes, plans, &[]);
                }
            }
        }
        later.par_iter_mut().for_each(|(part, nodes, plans, size)| {
            part.node(nodes, plans, &size.children);
        });
    }
}

/// Makes the wide tree of a binary one; `corners` gives those of a triangle.
pub(super) fn collapse<C: Fn(u32) -> [Vec3; 3] + Sync>(
    corners: &C,
    references: Vec<Reference>,
    nodes: &[BinaryNode],
) -> WideTree {
    let Some(root) = nodes.first() else { return WideTree::default() };
    // The boxes of the references are not needed any more: the memory goes to the tree.
    let order: Vec<u32> = references.par_iter().map(Reference::triangle).collect();
    drop(references);
    let mut plans: Vec<Plan> = bytemuck::zeroed_vec(nodes.len());
    plan(nodes, &mut plans);
    let is_leaf = root.count as usize <= WIDE_LEAF;
    let size = if is_leaf {
        Size { blocks: (root.count as usize).div_ceil(BLOCK), ..Size::default() }
    } else {
        size_of_subtree(nodes, &plans)
    };
    let mut tree = WideTree {
        nodes: filled_on_large_pages(size.nodes, Node::EMPTY),
        blocks: filled_on_large_pages(size.blocks, Block::EMPTY),
        root: Child::node(0),
        stack: size.stack,
        reach: 0.0,
    };
    let (nodes_out, blocks_out) = (&mut tree.nodes[..], &mut tree.blocks[..]);
    let mut all = Emitter {
        corners,
        order: &order,
        nodes: nodes_out,
        blocks: blocks_out,
        first_node: 0,
        first_block: 0,
    };
    if is_leaf {
        tree.root = all.leaf(root);
    } else {
        all.node(nodes, &plans, &size.children);
    }
    tree.reach = tree.bounds().reach();
    tree
}
