//! A binary bounding volume hierarchy over boxes.
//!
//! Built top-down by the surface area heuristic over 16 bins of the boxes' centres (Wald 2007, "On
//! fast Construction of SAH-based Bounding Volume Hierarchies"). Where the heuristic finds no split
//! (equal centres) or the tree gets deep, boxes are divided in halves by count, so that the depth is
//! bounded for any input.

use crate::math::Aabb;

/// Number of bins along the axis of a split.
const BINS: usize = 16;
/// Nodes at this depth are halved by count, which ends 32 levels further down at the latest.
const DEEPEST_SAH: usize = 40;
/// Most levels of a tree.
pub(super) const DEEPEST: usize = DEEPEST_SAH + 32;
/// Cost of visiting a node relative to testing a primitive, of the surface area heuristic.
const NODE_COST: f32 = 1.0;

/// A node: an inner one with two neighbouring children, or a leaf.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// First child, or first primitive of a leaf.
    first: u32,
    /// Number of primitives; 0 for an inner node.
    count: u32,
}

/// The tree. Primitives are the boxes it was built from, by their index.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Bvh {
    /// Builds the tree over `boxes`; empty ones are left out. At most `max_leaf` boxes share a leaf.
    pub fn build(boxes: &[Aabb], max_leaf: usize) -> Self {
        let mut items: Vec<Item> = (0..)
            .zip(boxes)
            .filter(|(_, bounds)| !bounds.is_empty())
            .map(|(index, bounds)| Item { bounds: *bounds, center: bounds.center(), index })
            .collect();
        let mut tree = Self { nodes: Vec::new(), order: Vec::with_capacity(items.len()) };
        if items.is_empty() {
            return tree;
        }
        tree.nodes.reserve(items.len());
        tree.nodes.push(Node { bounds: Aabb::EMPTY, first: 0, count: 0 });
        tree.subdivide(0, &mut items, 0, max_leaf);
        tree.nodes.shrink_to_fit();
        tree
    }

    fn subdivide(&mut self, node: usize, items: &mut [Item], depth: usize, max_leaf: usize) {
        let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.bounds));
        self.nodes[node].bounds = bounds;
        let split = if depth < DEEPEST_SAH { best_split(items, &bounds) } else { None };
        let worth_it = split.as_ref().is_some_and(|s| s.cost < items.len() as f32);
        if items.len() <= max_leaf && !worth_it {
            self.nodes[node].first = self.order.len() as u32;
            self.nodes[node].count = items.len() as u32;
            self.order.extend(items.iter().map(|item| item.index));
            return;
        }
        let middle = match split {
            Some(split) => partition(items, |item| split.is_left(item)),
            None => items.len() / 2,
        };
        let first = self.nodes.len();
        let blank = Node { bounds: Aabb::EMPTY, first: 0, count: 0 };
        self.nodes.extend([blank, blank]);
        self.nodes[node].first = first as u32;
        let (left, right) = items.split_at_mut(middle);
        self.subdivide(first, left, depth + 1, max_leaf);
        self.subdivide(first + 1, right, depth + 1, max_leaf);
    }

    /// The index of the root; `None` for an empty tree.
    pub(super) fn root(&self) -> Option<usize> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The children of an inner node.
    pub(super) fn children(&self, node: usize) -> Option<[usize; 2]> {
        let Node { first, count, .. } = self.nodes[node];
        (count == 0).then_some([first as usize, first as usize + 1])
    }

    /// The boxes of a leaf; none for an inner node.
    pub(super) fn items(&self, node: usize) -> &[u32] {
        let Node { first, count, .. } = self.nodes[node];
        if count == 0 { &[] } else { &self.order[first as usize..(first + count) as usize] }
    }

    /// The boxes of all leaves, leaf by leaf.
    pub(super) fn leaves(&self) -> impl Iterator<Item = &[u32]> {
        // Leaves were written in the order of their boxes, but parents before their children.
        let mut open: Vec<usize> = self.root().into_iter().collect();
        std::iter::from_fn(move || {
            loop {
                let node = open.pop()?;
                let Some([a, b]) = self.children(node) else { return Some(self.items(node)) };
                open.extend([b, a]);
            }
        })
    }

    /// Makes one leaf of subtrees of at most `most` boxes all of which `may_share` one, where that is
    /// expected to save time. The nodes below stay in memory and are not reached any more.
    ///
    /// By the surface area heuristic, with the test of a leaf as the unit: a leaf costs its area whatever
    /// it holds, its parts theirs and besides the area times `inner`, the cost of what divides them.
    pub(super) fn share_leaves(&mut self, most: u32, inner: f32, may_share: impl Fn(u32) -> bool) {
        // Children come after their parent: from the last node up all is known about them.
        let mut costs = vec![f32::NAN; self.nodes.len()];
        for node in (0..self.nodes.len()).rev() {
            let Node { first, count, bounds } = self.nodes[node];
            let area = bounds.area();
            if count > 0 {
                let all = self.items(node).iter().all(|&item| may_share(item));
                costs[node] = if all { area } else { f32::NAN };
                continue;
            }
            let (a, b) = (first as usize, first as usize + 1);
            let (left, right) = (self.nodes[a], self.nodes[b]);
            let apart = costs[a] + costs[b] + area * inner;
            // False where a part may not share, whose cost is no number.
            if left.count.min(right.count) > 0 && left.count + right.count <= most && area <= apart
            {
                // The boxes of neighbours follow one another.
                self.nodes[node].first = left.first;
                self.nodes[node].count = left.count + right.count;
                costs[node] = area;
            }
        }
    }

    /// The box of a node.
    pub(super) fn bounds_of(&self, node: usize) -> Aabb {
        self.nodes[node].bounds
    }

    /// Surface area of the box of a node.
    pub(super) fn area(&self, node: usize) -> f32 {
        self.nodes[node].bounds.area()
    }
}

/// A box on its way into the tree.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    center: glam::Vec3,
    index: u32,
}

/// A plane between two bins.
struct Split {
    axis: usize,
    origin: f32,
    bins_per_metre: f32,
    first_right: usize,
    /// Expected cost in primitive tests.
    cost: f32,
}

impl Split {
    fn bin(&self, item: &Item) -> usize {
        // A float below 0 or NaN becomes 0.
        (((item.center[self.axis] - self.origin) * self.bins_per_metre) as usize).min(BINS - 1)
    }

    fn is_left(&self, item: &Item) -> bool {
        self.bin(item) < self.first_right
    }
}

/// The best split of the items by the surface area heuristic; `None` when all centres coincide.
fn best_split(items: &[Item], bounds: &Aabb) -> Option<Split> {
    let centers = Aabb::from_points(items.iter().map(|item| item.center));
    let extent = centers.max - centers.min;
    let mut best: Option<Split> = None;
    for axis in 0..3 {
        let bins_per_metre = BINS as f32 / extent[axis];
        // Coinciding centres, or a width whose reciprocal is not a number to bin by.
        if !bins_per_metre.is_normal() {
            continue;
        }
        let mut split =
            Split { axis, origin: centers.min[axis], bins_per_metre, first_right: 0, cost: 0.0 };
        let mut bins = [(Aabb::EMPTY, 0_usize); BINS];
        for item in items {
            let bin = &mut bins[split.bin(item)];
            *bin = (bin.0.union(item.bounds), bin.1 + 1);
        }
        // Area times count of everything to the right of each plane, then the same from the left.
        let mut right_cost = [0.0_f32; BINS];
        let (mut sum, mut count) = (Aabb::EMPTY, 0);
        for k in (1..BINS).rev() {
            (sum, count) = (sum.union(bins[k].0), count + bins[k].1);
            right_cost[k] = sum.area() * count as f32;
        }
        let (mut sum, mut count) = (Aabb::EMPTY, 0);
        for k in 1..BINS {
            (sum, count) = (sum.union(bins[k - 1].0), count + bins[k - 1].1);
            if count == 0 || count == items.len() {
                continue;
            }
            let relative = (sum.area() * count as f32 + right_cost[k]) / bounds.area();
            // A flat or point-like node has no area to compare; halves of it are as good as any.
            let cost = NODE_COST + if relative.is_finite() { relative } else { 0.0 };
            if best.as_ref().is_none_or(|b| cost < b.cost) {
                split.first_right = k;
                split.cost = cost;
                best = Some(Split { ..split });
            }
        }
    }
    best
}

/// Moves the items for which `left` holds to the front and returns how many they are.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for k in 0..items.len() {
        if left(&items[k]) {
            items.swap(middle, k);
            middle += 1;
        }
    }
    middle
}

/// The way of a ray through the binary tree, in `f64`: the tests compare others with it.
#[cfg(test)]
mod traversal {
    use super::{Bvh, DEEPEST, Node};
    use crate::math::{Aabb, gamma_f64};
    use crate::shape::LocalRay;
    use glam::DVec3;

    impl Bvh {
        /// Visits the primitives whose boxes the ray may meet before `t_max`, nearer boxes first.
        ///
        /// `visit` gets a primitive and the current `t_max` and returns the new one; a `t_max` of 0 or
        /// less ends the traversal.
        #[inline]
        pub fn traverse(
            &self,
            ray: &LocalRay,
            mut t_max: f64,
            mut visit: impl FnMut(u32, f64) -> f64,
        ) {
            let Some(root) = self.nodes.first() else { return };
            let slabs = Slabs::new(ray);
            if slabs.enter(&root.bounds, t_max).is_none() {
                return;
            }
            if root.count > 0 {
                // A tree of one leaf needs no stack.
                for &index in &self.order {
                    t_max = visit(index, t_max);
                    if t_max <= 0.0 {
                        return;
                    }
                }
                return;
            }
            let mut stack = [(0_u32, 0.0_f32); DEEPEST];
            let mut depth = 0;
            let mut current = 0_usize;
            loop {
                let node = &self.nodes[current];
                if node.count == 0 {
                    let (a, b) = (node.first as usize, node.first as usize + 1);
                    let enter_a = slabs.enter(&self.nodes[a].bounds, t_max);
                    let enter_b = slabs.enter(&self.nodes[b].bounds, t_max);
                    match (enter_a, enter_b) {
                        (Some(ta), Some(tb)) => {
                            let (near, far, t_far) = if ta <= tb { (a, b, tb) } else { (b, a, ta) };
                            // Rounded to f32 the entry may grow: one step down keeps it a lower bound.
                            stack[depth] = (far as u32, (t_far as f32).next_down());
                            depth += 1;
                            current = near;
                            continue;
                        }
                        (Some(_), None) => {
                            current = a;
                            continue;
                        }
                        (None, Some(_)) => {
                            current = b;
                            continue;
                        }
                        (None, None) => {}
                    }
                } else {
                    let first = node.first as usize;
                    for &index in &self.order[first..first + node.count as usize] {
                        t_max = visit(index, t_max);
                        if t_max <= 0.0 {
                            return;
                        }
                    }
                }
                loop {
                    if depth == 0 {
                        return;
                    }
                    depth -= 1;
                    let (node, enter) = stack[depth];
                    if f64::from(enter) <= t_max {
                        current = node as usize;
                        break;
                    }
                }
            }
        }

        /// Longest path from the root, in nodes.
        pub(super) fn depth(&self) -> usize {
            fn below(tree: &Bvh, node: usize) -> usize {
                let Node { first, count, .. } = tree.nodes[node];
                let first = first as usize;
                if count > 0 { 1 } else { 1 + below(tree, first).max(below(tree, first + 1)) }
            }
            if self.nodes.is_empty() { 0 } else { below(self, 0) }
        }
    }

    /// A ray prepared for the test against boxes.
    pub(super) struct Slabs {
        o: DVec3,
        inverse: DVec3,
    }

    impl Slabs {
        pub(super) fn new(ray: &LocalRay) -> Self {
            // A component of 0 would give 0·∞ = NaN for an origin on a face; the smallest normal number
            // of the same sign sends both faces far enough away instead.
            let safe = |d: f64| {
                if d.abs() < f64::MIN_POSITIVE { f64::MIN_POSITIVE.copysign(d) } else { d }
            };
            Self { o: ray.o, inverse: ray.d.map(safe).recip() }
        }

        /// Where the ray enters the box, at least 0; `None` if it misses it or enters after `t_max`.
        ///
        /// The exit is enlarged by a factor 1 + 2γ₃, so that rounding never loses a box (Ize 2013,
        /// "Robust BVH Ray Traversal", JCGT 2(2)).
        #[inline]
        pub(super) fn enter(&self, bounds: &Aabb, t_max: f64) -> Option<f64> {
            const WIDEN: f64 = 1.0 + 2.0 * gamma_f64(3);
            let a = (bounds.min.as_dvec3() - self.o) * self.inverse;
            let b = (bounds.max.as_dvec3() - self.o) * self.inverse;
            let (near, far) = (lesser(a, b), greater(a, b));
            let enter = pick_greater(pick_greater(near.x, near.y), pick_greater(near.z, 0.0));
            let leave = pick_lesser(pick_lesser(far.x, far.y), far.z) * WIDEN;
            let leave = pick_lesser(leave, t_max);
            (enter <= leave).then_some(enter)
        }
    }

    fn lesser(a: DVec3, b: DVec3) -> DVec3 {
        DVec3::new(pick_lesser(a.x, b.x), pick_lesser(a.y, b.y), pick_lesser(a.z, b.z))
    }

    fn greater(a: DVec3, b: DVec3) -> DVec3 {
        DVec3::new(pick_greater(a.x, b.x), pick_greater(a.y, b.y), pick_greater(a.z, b.z))
    }

    /// Minimum of two numbers neither of which is NaN, in one instruction.
    #[inline]
    fn pick_lesser(a: f64, b: f64) -> f64 {
        if a < b { a } else { b }
    }

    /// Maximum of two numbers neither of which is NaN, in one instruction.
    #[inline]
    fn pick_greater(a: f64, b: f64) -> f64 {
        if a > b { a } else { b }
    }
}

#[cfg(test)]
mod tests {
    use super::traversal::Slabs;
    use super::*;
    use crate::sampling::Sampler;
    use crate::shape::LocalRay;
    use glam::{DVec3, Vec3};

    fn random_boxes(count: u32, size: f32) -> Vec<Aabb> {
        (0..count)
            .map(|k| {
                let s = Sampler::new(4, 0, (k, 0), 0);
                let p = s.two(0).extend(s.one(2));
                let d = s.two(3).extend(s.one(5)) * size;
                Aabb { min: p, max: p + d }
            })
            .collect()
    }

    fn visited(tree: &Bvh, ray: &LocalRay, t_max: f64) -> Vec<u32> {
        let mut seen = Vec::new();
        tree.traverse(ray, t_max, |index, t| {
            seen.push(index);
            t
        });
        seen.sort_unstable();
        seen
    }

    /// Oracle: every box that the slab test meets by itself is visited, each once; with an axis
    /// parallel ray on faces and edges as well.
    #[test]
    fn every_box_on_the_way_is_visited_once() {
        let boxes = random_boxes(500, 0.1);
        let tree = Bvh::build(&boxes, 4);
        for k in 0..500 {
            let s = Sampler::new(5, 0, (k, 0), 0);
            let o = if k % 2 == 0 { boxes[k as usize].min } else { s.two(0).extend(s.one(2)) };
            let d = match k % 5 {
                0 => Vec3::X,
                1 => Vec3::new(0.0, -1.0, -0.0),
                2 => Vec3::new(1.0, 5e-5, 1e-30),
                _ => s.two(3).extend(s.one(5)) - 0.5,
            };
            let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
            let slabs = Slabs::new(&ray);
            for t_max in [0.2, 1e30] {
                let seen = visited(&tree, &ray, t_max);
                assert!(seen.windows(2).all(|pair| pair[0] < pair[1]));
                for (index, bounds) in boxes.iter().enumerate() {
                    if slabs.enter(bounds, t_max).is_some() {
                        assert!(
                            seen.binary_search(&(index as u32)).is_ok(),
                            "ray {k}, box {index}"
                        );
                    }
                }
            }
        }
    }

    /// A nearly parallel ray enters a far slab: no component is too small to count.
    #[test]
    fn tiny_direction_components_are_not_dropped() {
        let c = Vec3::new(1000.0, 0.0, 0.0);
        let tree = Bvh::build(&[Aabb { min: c - 0.02, max: c + 0.02 }], 4);
        let ray = LocalRay { o: DVec3::new(0.0, -0.04, 0.0), d: DVec3::new(1.0, 5e-5, 0.0) };
        assert_eq!(visited(&tree, &ray, f64::INFINITY), [0]);
        // flat boxes are met too
        let flat = Aabb { min: Vec3::new(5.0, -1.0, -1.0), max: Vec3::new(5.0, 1.0, 1.0) };
        let tree = Bvh::build(&[flat], 4);
        let ray = LocalRay { o: DVec3::ZERO, d: DVec3::X };
        assert_eq!(visited(&tree, &ray, f64::INFINITY), [0]);
        assert!(visited(&tree, &ray, 4.9).is_empty(), "beyond the end of the ray");
    }

    /// Every input ends in a tree of bounded depth which holds each box once.
    #[test]
    fn degenerate_input_makes_bounded_trees() {
        let point = Aabb { min: Vec3::ONE, max: Vec3::ONE };
        let line: Vec<Aabb> = (0..10_000)
            .map(|k| {
                let p = Vec3::X * 2.0_f32.powi(-(k % 120));
                Aabb { min: p, max: p }
            })
            .collect();
        let huge = Aabb { min: Vec3::splat(-1e38), max: Vec3::splat(1e38) };
        for boxes in
            [vec![], vec![point], vec![point; 100_000], line, vec![huge, point, Aabb::EMPTY]]
        {
            let tree = Bvh::build(&boxes, 4);
            assert!(tree.depth() <= DEEPEST, "depth {}", tree.depth());
            let mut order = tree.order.clone();
            order.sort_unstable();
            let full: Vec<u32> =
                (0..).zip(&boxes).filter(|(_, b)| !b.is_empty()).map(|(k, _)| k).collect();
            assert_eq!(order, full);
        }
    }

    /// Every box lies in the boxes of all its ancestors.
    #[test]
    fn nodes_enclose_what_is_below_them() {
        fn check(tree: &Bvh, node: usize, boxes: &[Aabb]) {
            let Node { bounds, first, count } = tree.nodes[node];
            let first = first as usize;
            if count == 0 {
                for child in [first, first + 1] {
                    assert_eq!(bounds.union(tree.nodes[child].bounds), bounds);
                    check(tree, child, boxes);
                }
            } else {
                for &index in &tree.order[first..first + count as usize] {
                    assert_eq!(bounds.union(boxes[index as usize]), bounds);
                }
            }
        }
        let boxes = random_boxes(3000, 0.05);
        check(&Bvh::build(&boxes, 4), 0, &boxes);
    }
}
