//! Choosing one of many lights by where it is and where it shines.
//!
//! Lights are kept in a binary tree. Each node knows the box around its lights, their flux, and a cone
//! around the directions they shine to; from these follows its *importance* for a receiving point: flux,
//! times the cosine of the smallest angle under which the node can shine there, over the square of the
//! distance, times the cosine under which it can arrive. A light is chosen by going down the tree, at
//! each node to a child with the probability of its share of the importance of both.
//!
//! Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting",
//! Proc. ACM Comput. Graph. Interact. Tech. 1(2), sections 4.1 to 4.4, without the splitting; in the form
//! of Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., section 12.6.3. Distances
//! below the radius of a node's bounding sphere count as that radius, so that nothing depends on the
//! scale of the scene.

use crate::math::Aabb;
use glam::{DQuat, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Buckets along the axis of a split.
const BUCKETS: usize = 12;

/// Directions within `theta_o` of an axis, in which a light's surfaces face, and how far to the side
/// of these it still shines, `theta_e`. Radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit axis.
    pub axis: DVec3,
    /// Half angle of the cone of normals, in `[0, π]`.
    pub theta_o: f64,
    /// Angle beyond it, in `[0, π/2]`.
    pub theta_e: f64,
}

impl Cone {
    /// A flat surface which faces along `axis`.
    pub fn facing(axis: DVec3) -> Self {
        Self { axis, theta_o: 0.0, theta_e: FRAC_PI_2 }
    }

    /// Light in all directions.
    pub fn everywhere() -> Self {
        Self { axis: DVec3::Z, theta_o: PI, theta_e: FRAC_PI_2 }
    }

    /// A cone around both.
    fn union(self, other: Self) -> Self {
        let theta_e = self.theta_e.max(other.theta_e);
        let (wide, narrow) =
            if self.theta_o >= other.theta_o { (self, other) } else { (other, self) };
        let between = wide.axis.angle_between(narrow.axis);
        if (between + narrow.theta_o).min(PI) <= wide.theta_o {
            return Self { theta_e, ..wide };
        }
        let theta_o = 0.5 * (wide.theta_o + between + narrow.theta_o);
        let across = wide.axis.cross(narrow.axis).try_normalize();
        match across {
            Some(across) if theta_o < PI => {
                let turn = DQuat::from_axis_angle(across, theta_o - wide.theta_o);
                Self { axis: (turn * wide.axis).normalize(), theta_o, theta_e }
            }
            _ => Self { axis: wide.axis, theta_o: PI, theta_e },
        }
    }

    /// The measure `M_Ω` of the source: the solid angle of the directions, weighted by the cosine
    /// beyond the normals.
    fn measure(self) -> f64 {
        let (o, w) = (self.theta_o, (self.theta_o + self.theta_e).min(PI));
        let rim = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        TAU * (1.0 - o.cos()) + FRAC_PI_2 * rim
    }
}

/// One light, or several together, as a node sees them.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Around the light during the whole shutter.
    pub bounds: Aabb,
    /// Watts, of any channel or mean of channels.
    pub flux: f64,
    /// Where it shines.
    pub cone: Cone,
    /// Whether it shines backwards as well.
    pub two_sided: bool,
}

impl LightBounds {
    fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            flux: self.flux + other.flux,
            cone: self.cone.union(other.cone),
            two_sided: self.two_sided || other.two_sided,
        }
    }
}

/// A node in the form in which its importance is computed.
#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    radius_squared: f32,
    axis: Vec3,
    flux: f32,
    sin_o: f32,
    cos_o: f32,
    cos_e: f32,
    two_sided: bool,
    is_leaf: bool,
    /// The second child (the first comes right after its parent), or the light of a leaf.
    link: u32,
}

impl Node {
    fn new(light: &LightBounds, is_leaf: bool, link: u32) -> Self {
        let Aabb { min, max } = light.bounds;
        // Rounded so that the node shines rather too far than too short.
        let cos_o = (light.cone.theta_o.cos() as f32).next_down().max(-1.0);
        let half = (max - min) * 0.5;
        Self {
            center: light.bounds.center(),
            radius_squared: half.length_squared(),
            axis: light.cone.axis.as_vec3(),
            flux: light.flux as f32,
            sin_o: (1.0 - cos_o * cos_o).max(0.0).sqrt(),
            cos_o,
            cos_e: (light.cone.theta_e.cos() as f32).next_down(),
            two_sided: light.two_sided,
            is_leaf,
            link,
        }
    }

    /// The importance for a point; `normal` is where an opaque receiver faces.
    fn importance(&self, p: Vec3, normal: Option<Vec3>) -> f32 {
        let to_point = p - self.center;
        let distance_squared = to_point.length_squared();
        let wi = to_point.try_normalize().unwrap_or(Vec3::Z);
        // The cone under which the node's bounding sphere is seen; everything from inside.
        let (sin_b, cos_b) = if distance_squared <= self.radius_squared {
            (0.0, -1.0)
        } else {
            let sin2 = self.radius_squared / distance_squared;
            (sin2.sqrt(), (1.0 - sin2).sqrt())
        };
        let along = self.axis.dot(wi);
        let cos_w = if self.two_sided { along.abs() } else { along };
        let sin_w = (1.0 - cos_w * cos_w).max(0.0).sqrt();
        let (sin_x, cos_x) = minus((sin_w, cos_w), (self.sin_o, self.cos_o));
        let (_, cos_emitted) = minus((sin_x, cos_x), (sin_b, cos_b));
        if cos_emitted < self.cos_e {
            return 0.0;
        }
        let arriving = normal.map_or(1.0, |normal| {
            let cos_i = -wi.dot(normal);
            let sin_i = (1.0 - cos_i * cos_i).max(0.0).sqrt();
            minus((sin_i, cos_i), (sin_b, cos_b)).1
        });
        let nearest = distance_squared.max(self.radius_squared);
        let importance = self.flux * cos_emitted * arriving / nearest;
        // At the light itself the quotient is 0/0 or infinite: as important as can be.
        if importance.is_finite() { importance.max(0.0) } else { f32::MAX * 0.25 }
    }
}

/// Sine and cosine of `max(0, a − b)` for angles in `[0, π]` given as sine and cosine.
fn minus((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    if cos_a > cos_b {
        (0.0, 1.0)
    } else {
        (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b)
    }
}

/// The tree. Lights are named by their place in the list that it was built from.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    nodes: Vec<Node>,
    parent: Vec<u32>,
    /// Leaf of each light; `u32::MAX` for one without flux, which is never chosen.
    leaf: Vec<u32>,
}

impl LightTree {
    /// Builds the tree.
    pub fn new(lights: &[LightBounds]) -> Self {
        let mut tree = Self { leaf: vec![u32::MAX; lights.len()], ..Self::default() };
        let mut items: Vec<(u32, LightBounds)> =
            (0..).zip(lights.iter().copied()).filter(|(_, light)| light.flux > 0.0).collect();
        if !items.is_empty() {
            tree.nodes.reserve(2 * items.len() - 1);
            tree.parent.reserve(2 * items.len() - 1);
            tree.build(&mut items, u32::MAX);
        }
        tree
    }

    fn build(&mut self, items: &mut [(u32, LightBounds)], parent: u32) -> LightBounds {
        let node = self.nodes.len();
        self.parent.push(parent);
        if let [(light, bounds)] = items {
            self.leaf[*light as usize] = node as u32;
            self.nodes.push(Node::new(bounds, true, *light));
            return *bounds;
        }
        self.nodes.push(Node::new(&items[0].1, false, 0));
        let middle = divide(items);
        let (left, right) = items.split_at_mut(middle);
        let first = self.build(left, node as u32);
        let second = self.nodes.len() as u32;
        let bounds = first.union(self.build(right, node as u32));
        self.nodes[node] = Node::new(&bounds, false, second);
        bounds
    }

    /// Draws a light for the point `p`; `normal` is where an opaque receiver faces. Returns the light and
    /// its probability; `None` where no light can matter.
    pub fn sample(&self, p: Vec3, normal: Option<Vec3>, mut u: f64) -> Option<(u32, f32)> {
        let mut node = 0;
        let mut probability = 1.0_f64;
        // The root itself is not asked: a light without a choice is drawn wherever it shines.
        self.nodes.first()?;
        loop {
            let Node { is_leaf, link, .. } = self.nodes[node];
            if is_leaf {
                return Some((link, probability as f32));
            }
            let share = self.share_of_first(node, p, normal)?;
            // The number is stretched back to [0, 1) for the next choice.
            if u < share {
                u /= share;
                probability *= share;
                node += 1;
            } else {
                u = ((u - share) / (1.0 - share)).min(1.0_f64.next_down());
                probability *= 1.0 - share;
                node = link as usize;
            }
        }
    }

    /// The probability with which [`LightTree::sample`] draws a light.
    pub fn probability(&self, light: u32, p: Vec3, normal: Option<Vec3>) -> f32 {
        let mut node = self.leaf[light as usize];
        if node == u32::MAX {
            return 0.0;
        }
        let mut probability = 1.0_f64;
        while node != 0 {
            let parent = self.parent[node as usize];
            let Some(share) = self.share_of_first(parent as usize, p, normal) else { return 0.0 };
            probability *= if node == parent + 1 { share } else { 1.0 - share };
            node = parent;
        }
        probability as f32
    }

    /// The share of the first child in the importance of both; `None` when neither can matter.
    fn share_of_first(&self, node: usize, p: Vec3, normal: Option<Vec3>) -> Option<f64> {
        let first = f64::from(self.nodes[node + 1].importance(p, normal));
        let second = f64::from(self.nodes[self.nodes[node].link as usize].importance(p, normal));
        let sum = first + second;
        (sum > 0.0).then(|| first / sum)
    }
}

/// Sorts the lights of a node into two groups and returns the size of the first: at least 1, and
/// less than all.
///
/// The cost of a group is its flux times the measure of its directions times the area of its box;
/// boxes which are long across the split are penalised, as thin slices make poor nodes.
fn divide(items: &mut [(u32, LightBounds)]) -> usize {
    let centers = Aabb::from_points(items.iter().map(|(_, light)| light.bounds.center()));
    let extent = centers.max - centers.min;
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in 0..3 {
        let per_metre = BUCKETS as f32 / extent[axis];
        if !per_metre.is_normal() {
            continue;
        }
        let bucket = |light: &LightBounds| {
            let place = (light.bounds.center()[axis] - centers.min[axis]) * per_metre;
            (place as usize).min(BUCKETS - 1)
        };
        let mut buckets: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for (_, light) in items.iter() {
            let slot = &mut buckets[bucket(light)];
            *slot = Some(slot.map_or(*light, |sum| sum.union(*light)));
        }
        let penalty = f64::from(extent.max_element() / extent[axis]);
        let cost = |group: Option<LightBounds>| {
            group.map_or(0.0, |g| g.flux * g.cone.measure() * f64::from(g.bounds.area()))
        };
        let join = |a: Option<LightBounds>, b: Option<LightBounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(b)),
            (a, b) => a.or(b),
        };
        let mut right = [None; BUCKETS];
        for k in (1..BUCKETS).rev() {
            right[k] = join(buckets[k], right.get(k + 1).copied().flatten());
        }
        let mut left = None;
        for k in 1..BUCKETS {
            left = join(left, buckets[k - 1]);
            if left.is_none() || right[k].is_none() {
                continue;
            }
            let total = penalty * (cost(left) + cost(right[k]));
            if best.is_none_or(|(least, ..)| total < least) {
                best = Some((total, axis, k));
            }
        }
    }
    let Some((_, axis, first_right)) = best else { return items.len() / 2 };
    let per_metre = BUCKETS as f32 / extent[axis];
    let mut middle = 0;
    for k in 0..items.len() {
        let place = (items[k].1.bounds.center()[axis] - centers.min[axis]) * per_metre;
        if (place as usize).min(BUCKETS - 1) < first_right {
            items.swap(middle, k);
            middle += 1;
        }
    }
    if middle == 0 || middle == items.len() { items.len() / 2 } else { middle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

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

    /// The cone of two cones holds both: checked by directions on the rims.
    #[test]
    fn unions_of_cones_hold_both() {
        for k in 0..500 {
            let s = Sampler::new(12, 0, (k, 0), 0);
            let cone = |d: u32| Cone {
                axis: crate::sampling::warp::uniform_sphere(s.two(d)).as_dvec3().normalize(),
                theta_o: f64::from(s.one(d + 2)) * 1.7,
                theta_e: 0.5,
            };
            let (a, b) = (cone(0), cone(4));
            let both = a.union(b);
            for cone in [a, b] {
                for j in 0..32 {
                    let across = cone.axis.any_orthonormal_vector();
                    let turn = DQuat::from_axis_angle(cone.axis, f64::from(j) * TAU / 32.0);
                    let rim = DQuat::from_axis_angle(turn * across, cone.theta_o) * cone.axis;
                    assert!(both.axis.angle_between(rim) <= both.theta_o + 1e-7, "case {k}");
                }
            }
        }
    }

    /// Oracle: `M_Ω` of a hemisphere of normals is `2π + π²/2 − …`; here by the limits: a point
    /// direction with a cosine lobe gives π, the whole sphere 4π.
    #[test]
    fn the_measure_has_its_limits() {
        assert!((Cone::facing(DVec3::Z).measure() - PI).abs() < 1e-12);
        assert!((Cone::everywhere().measure() - 4.0 * PI).abs() < 1e-12);
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
