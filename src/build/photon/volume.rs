//! Photons in media, found again by rays.
//!
//! Each photon is spread over a disk across the ray, as large as its neighbours are far: the beam radiance estimate (Jarosz,
//! Zwicker and Jensen 2008, "The Beam Radiance Estimate for Volumetric Photon Mapping", Computer Graphics Forum 27(2)), of
//! which the integral along the ray needs no samples. A kernel has a unit integral whatever its radius, so that none of the
//! light is lost. The photons lie in the leaves of a k-d tree, which have boxes; a ray visits those which it meets.

use super::tree::PointTree;
use super::{Photon, PhotonStore, least_radius};
use crate::math::Ray;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Side of a cube over its diagonal.
const FRAC_1_SQRT_3: f32 = 0.577_350_26;
/// Levels that 2³² photons need.
const DEPTH: usize = 33;

/// Photons in a ball whose radius is that of their disks, as a share of what a disk on a surface holds: a ray through a cloud
/// of them meets that many again for each radius of its way.
const SHARE_IN_BALL: f32 = 0.25;

/// How large the disks of photons are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeRadius {
    /// Photons which are enough on a disk.
    pub enough: u32,
    /// Multiplies what follows from that.
    pub scale: f32,
    /// The greatest radius, metres.
    pub largest: f32,
}

impl VolumeRadius {
    /// That of photons which are alone in a box of this diagonal.
    fn of(&self, count: usize, diagonal: f32) -> f32 {
        let in_ball = SHARE_IN_BALL * self.enough.max(1) as f32;
        let ball = (in_ball / count as f32 * 0.75 * FRAC_1_PI).cbrt();
        (ball * diagonal * FRAC_1_SQRT_3 * self.scale).min(self.largest * self.scale)
    }
}

/// What a node of the tree holds.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The box around the disks.
    min: Vec3,
    max: Vec3,
    /// Radius of the disks in a leaf.
    radius: f32,
}

impl Node {
    const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY, radius: 0.0 };
}

/// Photons in media which can be found by rays. The memory is kept from build to build.
#[derive(Clone, Debug, Default)]
pub struct VolumeMap {
    tree: PointTree<Photon>,
    /// In pre-order: a subtree of `k` levels has `2ᵏ⁺¹ − 1` of them.
    nodes: Vec<Node>,
    unsorted: Vec<Photon>,
}

impl VolumeMap {
    /// Builds the map anew over the photons of `store` in media.
    pub fn rebuild(&mut self, store: &PhotonStore, radius: &VolumeRadius) {
        self.unsorted.clear();
        self.unsorted.extend(store.in_media());
        self.tree.rebuild(&self.unsorted);
        self.nodes.clear();
        self.nodes.resize((2 << self.tree.levels) - 1, Node::EMPTY);
        bound(&mut self.nodes, self.tree.points(), self.tree.levels, radius);
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.tree.points().len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.tree.points().is_empty()
    }

    /// Bytes held, those needed only while it is built included.
    pub fn memory(&self) -> usize {
        self.tree.memory()
            + self.nodes.capacity() * size_of::<Node>()
            + self.unsorted.capacity() * size_of::<Photon>()
    }

    /// Calls `visit` for every photon whose disk the first `end` metres of a ray with a unit direction meet, with its distance
    /// along the ray, its squared distance from it, and the squared radius of its disk.
    #[inline]
    pub fn along(&self, ray: &Ray, end: f32, mut visit: impl FnMut(&Photon, f32, f32, f32)) {
        if self.is_empty() {
            return;
        }
        let inverse = ray.d.recip();
        let is_near = |node: &Node| {
            let (a, b) = ((node.min - ray.o) * inverse, (node.max - ray.o) * inverse);
            // A ray in the plane of a side is 0 · ∞ away from it: `min` and `max` take the other number.
            let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
            !(near > end || far < 0.0 || near > far)
        };
        let mut stack = [(0_u32, 0_u32, 0_u32, 0_u32); DEPTH];
        stack[0] = (0, 0, self.len() as u32, self.tree.levels);
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (node, first, count, levels) = stack[waiting];
            let here = &self.nodes[node as usize];
            if !is_near(here) {
                continue;
            }
            if levels > 0 {
                let half = count / 2;
                stack[waiting] = (node + (1 << levels), first + half, count - half, levels - 1);
                stack[waiting + 1] = (node + 1, first, half, levels - 1);
                waiting += 2;
                continue;
            }
            let radius2 = here.radius * here.radius;
            for photon in &self.tree.points()[first as usize..(first + count) as usize] {
                let to = photon.position - ray.o;
                let t = to.dot(ray.d);
                let distance2 = (to - ray.d * t).length_squared();
                if distance2 <= radius2 && t >= 0.0 && t < end {
                    visit(photon, t, distance2, radius2);
                }
            }
        }
    }
}

/// Computes the nodes of a subtree; returns the first.
fn bound(nodes: &mut [Node], photons: &[Photon], levels: u32, radius: &VolumeRadius) -> Node {
    let (own, below) = nodes.split_first_mut().expect("each subtree has a node");
    if levels == 0 {
        let box_of = |(min, max): (Vec3, Vec3), photon: &Photon| {
            (min.min(photon.position), max.max(photon.position))
        };
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = photons.iter().fold(none, box_of);
        if !photons.is_empty() {
            let least = least_radius(min.abs().max(max.abs()));
            let radius = radius.of(photons.len(), (max - min).length()).max(least);
            *own = Node { min: min - radius, max: max + radius, radius };
        }
    } else {
        let (left, right) = photons.split_at(photons.len() / 2);
        let (left_nodes, right_nodes) = below.split_at_mut(below.len() / 2);
        let (left, right) = rayon::join(
            || bound(left_nodes, left, levels - 1, radius),
            || bound(right_nodes, right, levels - 1, radius),
        );
        *own = Node { min: left.min.min(right.min), max: left.max.max(right.max), radius: 0.0 };
    }
    *own
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Rgb;
    use crate::sampling::{Sampler, warp::uniform_sphere};

    const RADIUS: VolumeRadius = VolumeRadius { enough: 16, scale: 1.0, largest: 0.2 };

    /// Oracle: all photons, one after the other, in f64; among them many in one place, rays along the axes and through
    /// the planes of boxes, with and without an end.
    #[test]
    fn rays_find_what_brute_force_finds() {
        for n in [0_u32, 1, 8, 9, 100, 5000] {
            let mut store = PhotonStore::default();
            for k in 0..n {
                let s = Sampler::new(6, 0, (0, 0), k);
                let p = if k % 10 == 0 { Vec3::splat(0.25) } else { s.two(0).extend(s.one(2)) };
                let photon = Photon::new(p, Rgb::splat(k as f32), Vec3::Z, Vec3::Z, 1, false);
                store.push_in_medium(photon);
            }
            let mut map = VolumeMap::default();
            map.rebuild(&store, &RADIUS);
            assert_eq!(map.len(), n as usize);
            let radii = radii(&map);
            let mut seen = 0;
            for k in 0..200 {
                let s = Sampler::new(9, 0, (1, 0), k);
                let o = if k % 3 == 0 { Vec3::splat(0.25) } else { s.two(0).extend(s.one(2)) };
                let axes = [Vec3::X, Vec3::NEG_Y, Vec3::Z];
                let d = if k % 2 == 0 { axes[k as usize % 3] } else { uniform_sphere(s.two(3)) };
                let end = if k % 5 == 0 { f32::INFINITY } else { s.one(5) };
                let ray = Ray { o, d, time: 0.0 };
                let (mut found, mut brute) = (Vec::new(), Vec::new());
                map.along(&ray, end, |photon, _, _, _| found.push(photon.power.x as u32));
                for (photon, radius) in map.tree.points().iter().zip(&radii) {
                    let id = photon.power.x as u32;
                    let to = (photon.position - o).as_dvec3();
                    let t = to.dot(d.as_dvec3());
                    let distance = (to - d.as_dvec3() * t).length();
                    // What rounding decides may be found or not.
                    let [inside, ends] = [f64::from(*radius) - distance, f64::from(end) - t];
                    if inside.abs() < 1e-6 || ends.abs() < 1e-6 || t.abs() < 1e-6 {
                        found.retain(|other| *other != id);
                    } else if inside > 0.0 && ends > 0.0 && t > 0.0 {
                        brute.push(id);
                    }
                }
                found.sort_unstable();
                brute.sort_unstable();
                seen += brute.len();
                assert_eq!(found, brute, "{n} photons, ray {k}");
            }
            assert!(n < 100 || seen > 100);
        }
    }

    /// The radius of each photon in the order of the leaves.
    fn radii(map: &VolumeMap) -> Vec<f32> {
        fn add(nodes: &[Node], count: usize, levels: u32, radii: &mut Vec<f32>) {
            if levels == 0 {
                radii.extend(std::iter::repeat_n(nodes[0].radius, count));
                return;
            }
            let (left, right) = nodes[1..].split_at((nodes.len() - 1) / 2);
            add(left, count / 2, levels - 1, radii);
            add(right, count - count / 2, levels - 1, radii);
        }
        let mut radii = Vec::new();
        add(&map.nodes, map.len(), map.tree.levels, &mut radii);
        radii
    }

    /// Photons spread evenly have about the radius of the ball that holds so many of them, a tenth of it where they are a
    /// thousand times as dense, and none a radius of 0.
    #[test]
    fn disks_are_as_large_as_neighbours_are_far() {
        let radius_in = |side: f32| {
            let mut store = PhotonStore::default();
            for k in 0..8192 {
                let s = Sampler::new(6, 0, (0, 0), k);
                let p = s.two(0).extend(s.one(2)) * side;
                store.push_in_medium(Photon::new(p, Rgb::ONE, Vec3::Z, Vec3::Z, 1, false));
            }
            let mut map = VolumeMap::default();
            map.rebuild(&store, &RADIUS);
            let radii = radii(&map);
            radii.iter().sum::<f32>() / radii.len() as f32
        };
        let ball = (4.0 / 8192.0 * 0.75 * FRAC_1_PI).cbrt();
        let (wide, dense) = (radius_in(1.0), radius_in(0.1));
        assert!((0.5 * ball..ball).contains(&wide), "{wide} instead of {ball}");
        assert!((wide / dense - 10.0).abs() < 0.01, "{wide} {dense}");
        let mut store = PhotonStore::default();
        store.push_in_medium(Photon::new(Vec3::ONE, Rgb::ONE, Vec3::Z, Vec3::Z, 1, false));
        let mut map = VolumeMap::default();
        map.rebuild(&store, &RADIUS);
        assert!(radii(&map)[0] > 0.0);
    }
}
