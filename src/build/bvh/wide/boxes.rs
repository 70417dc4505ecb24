//! A tree of eight-fold nodes over boxes: the top level, whose leaves are objects.

use super::Instructions;
use super::node::{Child, Node, WIDTH};
use super::pages::on_large_pages;
use super::stack::Stack;
use super::traverse::{Distances, Lanes, Portable, child_of, distance_of, key, take_lane};
use crate::build::bvh::Bvh;
use crate::build::bvh::tree::DEEPEST;
use crate::math::Aabb;
use crate::shape::LocalRay;

/// Room for any tree: every level leaves all children but one on the stack.
const STACK: usize = DEEPEST * (WIDTH - 1) + 1;
/// Room that is enough for all but odd trees.
const SHORT_STACK: usize = 96;

/// The tree. Boxes are named by numbers of the caller's.
///
/// Boxes may share a leaf. It bears the name of the first of them.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    /// Children come after their parent.
    nodes: Vec<Node>,
    /// Names of the leaves, in the order of their nodes.
    names: Vec<u32>,
    /// Room on the stack that a traversal takes at most.
    stack: usize,
    /// For each node the place of its box in its parent; the root has none.
    parents: Vec<Place>,
    /// For each box its place.
    places: Vec<Place>,
    /// Sum of the areas of all boxes of nodes, to which the time of a ray is about proportional.
    area: f64,
    /// The same when the tree was built.
    area_built: f64,
    /// No coordinate of a box is farther from 0.
    reach: f32,
}

/// A slot of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Place {
    node: u32,
    slot: u32,
}

/// A tree which was refitted is built anew when the boxes of its nodes have grown to this many times the
/// area that they were built with. Measured on 10,000 boxes which scatter, one thread: at 1.35 times the
/// area a ray takes 1.16 times as long as in a new tree, at 1.8 times 1.4; a new tree takes 8 ms, what some
/// 200,000 rays lose at 1.5 times, far fewer than those of a picture.
const WORN: f64 = 1.5;

impl BoxTree {
    /// Gathers the nodes of a binary tree, the largest first, until each node has eight children.
    pub fn collapse(binary: &Bvh, boxes: &[Aabb], names: &[u32]) -> Self {
        let mut tree = Self { places: vec![Place::default(); boxes.len()], ..Self::default() };
        if binary.root().is_some() {
            tree.parents.push(Place::default());
            tree.stack = tree.emit(binary, names, 0);
            tree.nodes = on_large_pages(&tree.nodes);
        }
        tree.area_built = tree.area;
        tree.reach = tree.bounds().reach();
        tree
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + (self.parents.capacity() + self.places.capacity()) * size_of::<Place>()
            + self.names.capacity() * size_of::<u32>()
    }

    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether two boxes share a leaf. Indices are those of the build.
    pub fn share(&self, a: usize, b: usize) -> bool {
        self.places[a] == self.places[b]
    }

    /// Whether there is no tree.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Gives the leaf of a box another size or place, and all boxes around it with it. `index` is that of
    /// the build.
    pub fn refit(&mut self, index: usize, bounds: &Aabb) {
        let Place { mut node, mut slot } = self.places[index];
        let mut bounds = *bounds;
        self.reach = self.reach.max(bounds.reach());
        loop {
            let this = &mut self.nodes[node as usize];
            let before = this.get_box(slot as usize);
            if before == bounds {
                return;
            }
            this.set_box(slot as usize, &bounds);
            self.area += f64::from(bounds.area()) - f64::from(before.area());
            if node == 0 {
                return;
            }
            bounds = this.bounds();
            Place { node, slot } = self.parents[node as usize];
        }
    }

    /// Whether refitting has left the tree so much worse that it is to be built anew.
    pub fn is_worn(&self) -> bool {
        // False also where areas are beyond the range of numbers: nothing is known then.
        self.area > WORN * self.area_built
    }

    /// The box around everything.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, Node::bounds)
    }

    fn emit(&mut self, binary: &Bvh, names: &[u32], root: usize) -> usize {
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
            let place = Place { node: index as u32, slot: slot as u32 };
            let bounds = binary.bounds_of(below);
            self.nodes[index].set_box(slot, &bounds);
            self.area += f64::from(bounds.area());
            let items = binary.items(below);
            let child = if let Some(&first) = items.first() {
                for &item in items {
                    self.places[item as usize] = place;
                }
                self.names.push(names[first as usize]);
                Child::leaf(self.names.len() - 1, 1)
            } else {
                let child = Child::node(self.nodes.len());
                self.parents.push(place);
                deepest = deepest.max(self.emit(binary, names, below));
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
        let instructions = Instructions::detect().fit_for(ray, self.reach);
        match (instructions, self.stack <= SHORT_STACK) {
            #[cfg(target_arch = "x86_64")]
            (Instructions::Avx2(avx2), true) => {
                avx2.visit_boxes::<SHORT_STACK>(self, ray, t_max, visit);
            }
            #[cfg(target_arch = "x86_64")]
            (Instructions::Avx2(avx2), false) => {
                avx2.visit_boxes::<STACK>(self, ray, t_max, visit);
            }
            (Instructions::Portable, _) => {
                visit_boxes::<Portable, STACK>(self, ray, t_max, visit);
            }
        }
    }
}

/// [`BoxTree::traverse`] with a set of instructions.
#[inline(always)]
pub(super) fn visit_boxes<L: Lanes, const STACK: usize>(
    tree: &BoxTree,
    ray: &LocalRay,
    mut t_max: f64,
    mut visit: impl FnMut(u32, f64) -> f64,
) {
    let Some(prepared) = L::prepare(ray) else { return };
    let boxes = L::prepare_boxes(&prepared, tree.reach);
    let mut end = prepared.distance(t_max);
    let mut stack = Stack::<u64, STACK>::new();
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
            let bottom = stack.depth();
            while mask != 0 {
                let lane = take_lane(&mut mask);
                let child = node.children[lane];
                if !child.is_leaf() {
                    L::prefetch((tree.nodes.as_ptr().wrapping_add(child.index()).cast(), 4));
                }
                stack.insert(bottom, key(distances.0[lane], child));
            }
        }
        loop {
            let Some(entry) = stack.pop() else { return };
            if distance_of(entry) <= end {
                current = child_of(entry);
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use glam::{DVec3, Vec3};

    fn random_boxes(count: u32, seed: u64) -> Vec<Aabb> {
        (0..count)
            .map(|k| {
                let s = Sampler::new(seed, 0, (k, 0), 0);
                let p = s.two(0).extend(s.one(2));
                Aabb { min: p, max: p + s.two(3).extend(s.one(5)) * 0.1 }
            })
            .collect()
    }

    fn ray(k: u32) -> LocalRay {
        let s = Sampler::new(5, 1, (k, 0), 0);
        let o = s.two(0).extend(s.one(2)) * 2.0 - 0.5;
        let d = if k.is_multiple_of(3) { Vec3::Z } else { s.two(3).extend(s.one(5)) - 0.5 };
        LocalRay { o: o.as_dvec3(), d: d.as_dvec3() }
    }

    /// Names visited, and the order in which.
    fn visited(tree: &BoxTree, ray: &LocalRay, t_max: f64) -> Vec<u32> {
        let mut seen = Vec::new();
        tree.traverse(ray, t_max, |name, t| {
            seen.push(name);
            t
        });
        seen
    }

    /// Whether a box is met, in `f64` and without any margin.
    fn meets(ray: &LocalRay, bounds: &Aabb, t_max: f64) -> bool {
        let inverse = ray.d.recip();
        let a = (bounds.min.as_dvec3() - ray.o) * inverse;
        let b = (bounds.max.as_dvec3() - ray.o) * inverse;
        let enter = a.min(b).max_element().max(0.0);
        enter <= a.max(b).min_element().min(t_max)
    }

    /// Oracle: each box by itself in `f64`. All that are met are visited, each once; after a refit
    /// to other boxes as well; and a tree of one box has a node too.
    #[test]
    fn every_box_on_the_way_is_visited_once() {
        for count in [1, 5, 8, 9, 700] {
            let boxes = random_boxes(count, 3);
            let names: Vec<u32> = (0..count).map(|k| 2 * k + 1).collect();
            let mut tree = BoxTree::collapse(&Bvh::build(&boxes, 1), &boxes, &names);
            let moved = random_boxes(count, 4);
            for boxes in [boxes, moved] {
                for (index, bounds) in boxes.iter().enumerate() {
                    tree.refit(index, bounds);
                }
                let around = boxes.iter().fold(Aabb::EMPTY, |sum, b| sum.union(*b));
                assert_eq!(tree.bounds(), around);
                for k in 0..400 {
                    let (ray, t_max) = (ray(k), if k % 2 == 0 { 1.0 } else { f64::INFINITY });
                    let mut seen = visited(&tree, &ray, t_max);
                    seen.sort_unstable();
                    assert!(seen.windows(2).all(|pair| pair[0] < pair[1]), "each once");
                    for (bounds, name) in boxes.iter().zip(&names) {
                        let met = meets(&ray, bounds, t_max);
                        assert!(!met || seen.binary_search(name).is_ok(), "ray {k}, box {name}");
                    }
                }
            }
        }
    }

    /// The traversal ends when the end of the ray is drawn in, and visits near boxes first.
    #[test]
    fn near_boxes_come_first_and_a_shorter_ray_meets_less() {
        let boxes: Vec<Aabb> = (0..100)
            .map(|k| Aabb { min: Vec3::X * k as f32, max: Vec3::new(k as f32 + 0.5, 1.0, 1.0) })
            .collect();
        let names: Vec<u32> = (0..100).collect();
        let tree = BoxTree::collapse(&Bvh::build(&boxes, 1), &boxes, &names);
        let ray = LocalRay { o: DVec3::new(-1.0, 0.5, 0.5), d: DVec3::X };
        assert_eq!(visited(&tree, &ray, f64::INFINITY), names);
        let mut seen = Vec::new();
        tree.traverse(&ray, f64::INFINITY, |name, _| {
            seen.push(name);
            3.5
        });
        assert_eq!(seen, [0, 1, 2], "box 3 begins at 4");
    }

    /// A tree whose boxes grew is worn; one whose boxes only moved together is not.
    #[test]
    fn a_tree_wears_by_growing() {
        let boxes = random_boxes(300, 8);
        let names: Vec<u32> = (0..300).collect();
        let mut tree = BoxTree::collapse(&Bvh::build(&boxes, 1), &boxes, &names);
        let shifted = |b: &Aabb, by: Vec3| Aabb { min: b.min + by, max: b.max + by };
        for (index, bounds) in boxes.iter().enumerate() {
            tree.refit(index, &shifted(bounds, Vec3::splat(4.0)));
        }
        assert!(!tree.is_worn());
        for (index, bounds) in boxes.iter().enumerate() {
            let by = Vec3::X * 9.0 * (index % 2) as f32;
            tree.refit(index, &shifted(bounds, by));
        }
        assert!(tree.is_worn());
    }
}
