//! Choosing one of many lights by where it is and where it shines.
//!
//! Lights are kept in a tree of nodes with up to eight children. A light is chosen by going down, at
//! each node to a child with the probability of its share of the importance of all of them; see
//! [`super::node`] for what that is. Eight children rather than the source's two: each choice is made
//! by boxes three levels further down, which say more about their lights, and a third of the nodes is
//! visited.
//!
//! The tree is built from the top: the lights of a node are divided in two, then the costlier of the
//! groups again, until there are eight.

use super::bounds::LightBounds;
use super::node::{LEAF, Node, Seen, WIDTH};
use super::split::{Group, Item, divide};
use crate::math::Aabb;
use glam::Vec3;
use std::ops::Range;

/// Lights of a group from which on its children are built in parallel.
const PARALLEL_FROM: usize = 4096;

/// The tree. Lights are named by their place in the list that it was built from.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// For each node its parent and, in the lowest bits, the lane there.
    parents: Vec<u32>,
    /// The same for each light; [`NOWHERE`] for one without flux, which is never chosen.
    lights: Vec<u32>,
}

/// The root's parent, and where a light is which is in no node.
const NOWHERE: u32 = u32::MAX;

impl LightTree {
    /// Builds the tree.
    pub fn new(lights: &[LightBounds]) -> Self {
        // Shares of the whole, which are within the range of f32 whatever the unit of the flux.
        let whole: f64 = lights.iter().map(|light| light.flux).sum();
        let item = |(light, bounds)| Item { light, group: Group::one(bounds, whole) };
        let mut items: Vec<Item> =
            (0..).zip(lights).map(item).filter(|item| item.group.flux > 0.0).collect();
        let nodes = if items.is_empty() { Vec::new() } else { build(&mut items, lights) };
        let mut parents = vec![NOWHERE; nodes.len()];
        let mut places = vec![NOWHERE; lights.len()];
        for (place, (node, lane)) in
            (0..).zip((0..nodes.len()).flat_map(|node| (0..WIDTH).map(move |lane| (node, lane))))
        {
            let link = nodes[node].links[lane];
            if !nodes[node].has(lane) {
            } else if link & LEAF != 0 {
                places[(link & !LEAF) as usize] = place;
            } else {
                parents[link as usize] = place;
            }
        }
        Self { nodes, parents, lights: places }
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + (self.parents.capacity() + self.lights.capacity()) * size_of::<u32>()
    }

    /// Draws a light for the point `p`; `normal` is where an opaque receiver faces. Returns the light and
    /// its probability; `None` where no light can matter.
    pub fn sample(&self, p: Vec3, normal: Option<Vec3>, mut u: f64) -> Option<(u32, f32)> {
        let seen = Seen { p, normal };
        let mut node = self.nodes.first()?;
        let mut probability = 1.0_f64;
        loop {
            let importance = node.importance(&seen).map(f64::from);
            let total: f64 = importance.iter().sum();
            if total <= 0.0 {
                return None;
            }
            let mut before = 0.0;
            let mut chosen = None;
            for (lane, &share) in importance.iter().enumerate() {
                if share > 0.0 {
                    chosen = Some((lane, before, share));
                    before += share;
                    if u * total < before {
                        break;
                    }
                }
            }
            let (lane, before, share) = chosen?;
            probability *= share / total;
            // The number is stretched back to [0, 1) for the next choice.
            u = ((u * total - before) / share).clamp(0.0, 1.0_f64.next_down());
            let link = node.links[lane];
            if link & LEAF != 0 {
                return Some((link & !LEAF, probability as f32));
            }
            node = &self.nodes[link as usize];
        }
    }

    /// The probability with which [`LightTree::sample`] draws a light.
    pub fn probability(&self, light: u32, p: Vec3, normal: Option<Vec3>) -> f32 {
        let seen = Seen { p, normal };
        let mut place = self.lights[light as usize];
        if place == NOWHERE {
            return 0.0;
        }
        let mut probability = 1.0_f64;
        while place != NOWHERE {
            let (node, lane) = (place as usize / WIDTH, place as usize % WIDTH);
            let importance = self.nodes[node].importance(&seen).map(f64::from);
            if importance[lane] <= 0.0 {
                return 0.0;
            }
            probability *= importance[lane] / importance.iter().sum::<f64>();
            place = self.parents[node];
        }
        probability as f32
    }
}

/// The nodes over these lights, the root first; there is at least one light.
fn build(items: &mut [Item], lights: &[LightBounds]) -> Vec<Node> {
    let groups = groups(items);
    let whole = items.len();
    let mut parts = Vec::with_capacity(WIDTH);
    let mut rest = items;
    for range in groups {
        let (part, after) = rest.split_at_mut(range.len());
        rest = after;
        parts.push(part);
    }
    let below = |part: &mut [Item]| {
        let around = LightBounds::around(part.iter().map(|item| &lights[item.light as usize]));
        let bounds = LightBounds { flux: Group::of(part).flux, ..around };
        let spread = spread_squared(part, &bounds);
        match part {
            [item] => (bounds, spread, Err(item.light)),
            _ => (bounds, spread, Ok(build(part, lights))),
        }
    };
    let children: Vec<_> = if whole >= PARALLEL_FROM {
        use rayon::prelude::*;
        parts.into_par_iter().map(below).collect()
    } else {
        parts.into_iter().map(below).collect()
    };
    assemble(children)
}

/// A node above its children, each with its bounds, its spread, and a light or the nodes below.
fn assemble(children: Vec<(LightBounds, f64, Result<Vec<Node>, u32>)>) -> Vec<Node> {
    let below = |(.., child): &(_, _, Result<Vec<Node>, u32>)| child.as_ref().map_or(0, Vec::len);
    let mut nodes = Vec::with_capacity(1 + children.iter().map(below).sum::<usize>());
    nodes.push(Node::EMPTY);
    for (lane, (bounds, spread, child)) in children.into_iter().enumerate() {
        let link = match child {
            Err(light) => light | LEAF,
            Ok(mut below) => {
                let first = nodes.len() as u32;
                for node in &mut below {
                    node.shift(first);
                }
                nodes.append(&mut below);
                first
            }
        };
        nodes[0].set(lane, &bounds, spread, link);
    }
    nodes
}

/// Sorts lights into up to eight groups, in their order.
fn groups(items: &mut [Item]) -> Vec<Range<usize>> {
    let mut groups = vec![(0..items.len(), f64::INFINITY)];
    while groups.len() < WIDTH {
        let costliest = groups
            .iter()
            .enumerate()
            .filter(|(_, (range, _))| range.len() > 1)
            .max_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b));
        let Some((index, (range, _))) = costliest else { break };
        let range = range.clone();
        let middle = range.start + divide(&mut items[range.clone()]);
        let halves = [range.start..middle, middle..range.end];
        let halves = halves.map(|range| (range.clone(), Group::of(&items[range]).cost()));
        groups.splice(index..=index, halves);
    }
    groups.into_iter().map(|(range, _)| range).collect()
}

/// The mean square of the distances of the lights from the middle of the box around them, weighted by
/// their flux. A light which fills its own box evenly has a third of its half diagonal, squared.
fn spread_squared(items: &[Item], whole: &LightBounds) -> f64 {
    let middle = whole.bounds.center().as_dvec3();
    let moment = |item: &Item| {
        let Aabb { min, max } = item.group.bounds;
        let half = (max - min).as_dvec3() * 0.5;
        let from_middle = item.group.bounds.center().as_dvec3().distance_squared(middle);
        item.group.flux * (from_middle + half.length_squared() / 3.0)
    };
    let sum: f64 = items.iter().map(moment).sum();
    sum / whole.flux
}

#[cfg(test)]
mod tests {
    use super::super::bounds::Cone;
    use super::*;
    use crate::sampling::Sampler;
    use glam::DVec3;
    use std::f64::consts::PI;

    fn random_lights(count: u32) -> Vec<LightBounds> {
        (0..count)
            .map(|k| {
                let s = Sampler::new(8, 0, (k, 0), 0);
                let p = s.two(0).extend(s.one(2)) * 10.0;
                let size = s.two(3).extend(s.one(5)) * 0.2;
                let axis = crate::sampling::warp::uniform_sphere(s.two(6)).as_dvec3().normalize();
                LightBounds {
                    bounds: Aabb { min: p, max: p + size },
                    flux: f64::from(s.one(8)) * 10.0 + 0.01,
                    cone: match k % 3 {
                        0 => Cone::facing(axis),
                        1 => Cone::everywhere(),
                        _ => Cone { axis, theta_o: 0.3, theta_e: 0.4 },
                    },
                    two_sided: k % 5 == 0,
                }
            })
            .collect()
    }

    /// Probabilities over all lights sum to 1 wherever a light is drawn, and sampling gives what they
    /// claim.
    #[test]
    fn probabilities_sum_to_one_and_are_what_is_drawn() {
        let lights = random_lights(300);
        let tree = LightTree::new(&lights);
        for k in 0..60 {
            let s = Sampler::new(9, 0, (k, 0), 0);
            let p = (s.two(0).extend(s.one(2)) * 14.0) - 2.0;
            let normal = (k % 2 == 0).then(|| crate::sampling::warp::uniform_sphere(s.two(3)));
            let total: f64 = (0..300).map(|l| f64::from(tree.probability(l, p, normal))).sum();
            // A node may matter where none of its lights does: what is lost there draws nothing.
            let lost = (0..20_000)
                .filter(|j| tree.sample(p, normal, (f64::from(*j) + 0.5) / 20_000.0).is_none())
                .count() as f64
                / 20_000.0;
            assert!((total + lost - 1.0).abs() < 2e-3, "point {k}: {total} + {lost}");
            for j in 0..200 {
                if let Some((light, pmf)) = tree.sample(p, normal, (f64::from(j) + 0.5) / 200.0) {
                    let claimed = tree.probability(light, p, normal);
                    assert!((claimed / pmf - 1.0).abs() < 1e-5, "light {light}: {claimed} {pmf}");
                }
            }
        }
    }

    /// Whatever can shine on a point keeps a probability: for a light facing the point from within
    /// its cone and above the receiver's horizon it is never 0.
    #[test]
    fn every_light_that_contributes_can_be_chosen() {
        let lights = random_lights(200);
        let tree = LightTree::new(&lights);
        for k in 0..200 {
            let s = Sampler::new(10, 0, (k, 0), 0);
            let p = (s.two(0).extend(s.one(2)) * 14.0) - 2.0;
            let normal = crate::sampling::warp::uniform_sphere(s.two(3));
            for (index, light) in (0..).zip(&lights) {
                let from = light.bounds.center();
                let wi = (p - from).normalize();
                let angle = light.cone.axis.angle_between(wi.as_dvec3());
                let angle = if light.two_sided { angle.min(PI - angle) } else { angle };
                let shines = angle < light.cone.theta_o + light.cone.theta_e - 1e-3;
                if shines && -wi.dot(normal) > 1e-3 {
                    assert!(tree.probability(index, p, Some(normal)) > 0.0, "light {index}, {p}");
                }
            }
        }
    }

    /// Lamps of equal power which hang under a ceiling in a square of 40 m and face down.
    fn ceiling(columns: u32) -> Vec<LightBounds> {
        let place = |k: u32| ((k as f32 + 0.5) / columns as f32 - 0.5) * 40.0;
        (0..columns * columns)
            .map(|k| {
                let p = Vec3::new(place(k % columns), 3.9, place(k / columns));
                LightBounds {
                    bounds: Aabb { min: p, max: p },
                    flux: 1.0,
                    cone: Cone::facing(DVec3::NEG_Y),
                    two_sided: false,
                }
            })
            .collect()
    }

    /// Oracle: the contributions `Φ·cos θ_w·cos θ_i/d²` of all lamps, one by one. The choice of a light is
    /// perfect when its probability is its share `f` of them; the relative variance of one sample is
    /// `Σ f²/p − 1`. By power (`p = 1/n`) it is 16 at the points of a floor below 2500 lamps.
    #[test]
    fn the_choice_is_nearly_that_by_contribution() {
        const POINTS: u32 = 100;
        let lights = ceiling(50);
        let tree = LightTree::new(&lights);
        let (mut by_tree, mut by_power) = (0.0, 0.0);
        for k in 0..POINTS {
            let s = Sampler::new(14, 0, (k, 0), 0);
            let p = Vec3::new(s.one(0) - 0.5, 0.0, s.one(1) - 0.5) * 40.0;
            let contribution = |light: &LightBounds| {
                let to = p - light.bounds.center();
                // Both cosines are the height over the distance.
                f64::from(3.9_f32.powi(2) / to.length_squared().powi(2))
            };
            let sum: f64 = lights.iter().map(contribution).sum();
            for (index, light) in (0..).zip(&lights) {
                let share = contribution(light) / sum;
                let pmf = f64::from(tree.probability(index, p, Some(Vec3::Y)));
                by_tree += share * share / pmf;
                by_power += share * share * lights.len() as f64;
            }
        }
        let variance = |sum: f64| sum / f64::from(POINTS) - 1.0;
        let (by_tree, by_power) = (variance(by_tree), variance(by_power));
        assert!(by_tree < 0.15 && by_power > 10.0, "{by_tree} by the tree, {by_power} by power");
    }

    /// Any number of threads makes the same tree.
    #[test]
    fn threads_do_not_show() {
        let lights = ceiling(100);
        assert!(lights.len() > PARALLEL_FROM);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| format!("{:?}", LightTree::new(&lights)))
        };
        assert!(with(1) == with(5));
    }

    /// Lights in a row, which fill no area, are told apart as well as others.
    #[test]
    fn lights_in_a_row_are_sorted_by_place() {
        let lights: Vec<LightBounds> = (0..1000)
            .map(|k| {
                let p = Vec3::X * k as f32;
                let bounds = Aabb { min: p, max: p };
                LightBounds { bounds, flux: 1.0, cone: Cone::everywhere(), two_sided: false }
            })
            .collect();
        let tree = LightTree::new(&lights);
        let nearest = tree.probability(500, Vec3::new(500.0, 1.0, 0.0), None);
        // Its share of Σ 1/(1 + k²) = π·coth π
        let share = 1.0 / 3.153;
        assert!((0.5 * share..2.0 * share).contains(&nearest), "{nearest} for {share}");
    }

    /// Equal lights on one spot, lights of no flux and no lights at all.
    #[test]
    fn degenerate_sets_of_lights_are_trees_too() {
        let one = LightBounds {
            bounds: Aabb { min: Vec3::ONE, max: Vec3::ONE },
            flux: 1.0,
            cone: Cone::everywhere(),
            two_sided: false,
        };
        let tree = LightTree::new(&vec![one; 1000]);
        for l in [0, 500, 999] {
            assert!((tree.probability(l, Vec3::ZERO, None) - 1e-3).abs() < 1e-6);
        }
        assert!(tree.sample(Vec3::ONE, None, 0.3).is_some(), "at the light itself");
        let dark = LightBounds { flux: 0.0, ..one };
        let tree = LightTree::new(&[dark, one]);
        assert_eq!(tree.sample(Vec3::ZERO, None, 0.9).map(|s| s.0), Some(1));
        assert_eq!(tree.probability(0, Vec3::ZERO, None), 0.0);
        assert!(LightTree::new(&[]).sample(Vec3::ZERO, None, 0.5).is_none());
    }
}
