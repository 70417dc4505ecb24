//! Which solids a ray is inside of.
//!
//! Solids may overlap: wine reaches into the glass that holds it. Where they do, the one of the highest
//! *priority* is there, and the surface of another is no event for a ray. A ray therefore carries the
//! solids that it is inside of; what is around it is the first of them in rank.
//!
//! ```text
//! at a surface:   W = first of the solids before,   W' = first of those beyond
//! W = W'          nothing happens: the ray goes straight on
//! W ≠ W'          an interface with the indices of refraction of W and W', of which the higher in rank
//!                 has its surface here
//! ```
//!
//! Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools
//! 7(2); Hillaire et al. in Haines and Akenine-Möller (eds.) 2019, *Ray Tracing Gems*, chapter 11.
//! There priorities must differ; here the order of objects decides among equal ones, so that what is
//! found does not depend on the direction of the ray.
//!
//! How much of this a path carries is a type: nothing ([`Clear`]), the solid that it entered last
//! ([`OneSolid`]), or all ([`SolidStack`]); where solids scatter light or
//! their indices depend on the wavelength, that as well ([`Whole`]).

use crate::extract::NOTHING;
use std::cmp::Reverse;
use std::fmt::Debug;

/// Solids that a ray can be inside of at once: more than a straw in a drink with ice in a glass needs.
const ROOM: usize = 8;

/// A solid that a ray is inside of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Solid {
    /// Index of the instance.
    pub instance: u32,
    /// Index of its material.
    pub material: u32,
    /// The priority of the material.
    pub priority: i32,
}

impl Solid {
    const NONE: Self = Self { instance: NOTHING, material: NOTHING, priority: 0 };

    /// Of two solids at one place the lower is there.
    #[inline]
    fn rank(&self) -> (Reverse<i32>, u32) {
        (Reverse(self.priority), self.instance)
    }

    /// Whether this solid is there where both are.
    #[inline]
    pub fn outranks(&self, other: &Self) -> bool {
        self.rank() < other.rank()
    }
}

/// What a path knows of the solids around it.
pub trait Inside: Copy + Debug + Send + Sync {
    /// Whether what is around a ray may absorb light.
    const ABSORBS: bool;
    /// Whether solids may overlap.
    const NESTS: bool;
    /// Whether the index of a solid may depend on the wavelength.
    const DISPERSES: bool = false;
    /// Whether what is around a ray may scatter light.
    const SCATTERS: bool = false;

    /// Inside the solids of a stack.
    fn new(stack: &SolidStack) -> Self;

    /// The material of the solid around the ray; [`NOTHING`] in air.
    fn medium(&self) -> u32;

    /// Beyond a surface that a solid of this material has here.
    #[must_use]
    fn beyond(&self, material: u32, entering: bool) -> Self;

    /// All solids that the ray is inside of, where they are known.
    fn stack(&self) -> Option<&SolidStack>;

    /// The same path inside other solids.
    #[inline]
    #[must_use]
    fn within(&self, stack: &SolidStack) -> Self {
        Self::new(stack)
    }

    /// The wavelength that a path follows, nm; `None` as long as it stands for all.
    #[inline]
    fn wavelength(&self) -> Option<f32> {
        None
    }

    /// The same path at one wavelength, nm.
    #[inline]
    #[must_use]
    fn tuned(&self, _nm: f32) -> Self {
        *self
    }
}

/// Nothing absorbs: a path need not know where it is.
#[derive(Clone, Copy, Debug)]
pub struct Clear;

impl Inside for Clear {
    const ABSORBS: bool = false;
    const NESTS: bool = false;

    #[inline]
    fn new(_: &SolidStack) -> Self {
        Self
    }

    #[inline]
    fn medium(&self) -> u32 {
        NOTHING
    }

    #[inline]
    fn beyond(&self, _: u32, _: bool) -> Self {
        Self
    }

    #[inline]
    fn stack(&self) -> Option<&SolidStack> {
        None
    }
}

/// Solids stand apart: a path is in one of them, of this material, or in air ([`NOTHING`]).
#[derive(Clone, Copy, Debug)]
pub struct OneSolid(u32);

impl Inside for OneSolid {
    const ABSORBS: bool = true;
    const NESTS: bool = false;

    #[inline]
    fn new(stack: &SolidStack) -> Self {
        Self(stack.medium())
    }

    #[inline]
    fn medium(&self) -> u32 {
        self.0
    }

    #[inline]
    fn beyond(&self, material: u32, entering: bool) -> Self {
        Self(if entering { material } else { NOTHING })
    }

    #[inline]
    fn stack(&self) -> Option<&SolidStack> {
        None
    }
}

/// The solids that a ray is inside of, the one that is there first.
///
/// A solid entered twice, a mesh of shells which overlap, is in it twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolidStack {
    solids: [Solid; ROOM],
    count: usize,
}

impl Default for SolidStack {
    fn default() -> Self {
        Self { solids: [Solid::NONE; ROOM], count: 0 }
    }
}

impl SolidStack {
    /// The solids in their order of rank.
    #[inline]
    pub fn solids(&self) -> &[Solid] {
        &self.solids[..self.count]
    }

    /// The solid which is there; `None` in air.
    #[inline]
    pub fn first(&self) -> Option<&Solid> {
        self.solids().first()
    }

    /// The ray enters a solid. `false` when there is no room: the lowest in rank is forgotten.
    pub fn enter(&mut self, solid: Solid) -> bool {
        let place = self.solids().partition_point(|other| other.rank() <= solid.rank());
        if place < ROOM {
            let end = (self.count + 1).min(ROOM);
            self.solids.copy_within(place..end - 1, place + 1);
            self.solids[place] = solid;
        }
        let room = self.count < ROOM;
        self.count += usize::from(room);
        room
    }

    /// The ray leaves a solid. `false` when it was not inside.
    pub fn leave(&mut self, instance: u32) -> bool {
        let Some(place) = self.solids().iter().position(|solid| solid.instance == instance) else {
            return false;
        };
        self.solids.copy_within(place + 1..self.count, place);
        self.count -= 1;
        // Equal stacks have equal bits.
        self.solids[self.count] = Solid::NONE;
        true
    }
}

impl Inside for SolidStack {
    const ABSORBS: bool = true;
    const NESTS: bool = true;

    #[inline]
    fn new(stack: &SolidStack) -> Self {
        *stack
    }

    #[inline]
    fn medium(&self) -> u32 {
        self.first().map_or(NOTHING, |solid| solid.material)
    }

    #[inline]
    fn beyond(&self, _: u32, _: bool) -> Self {
        *self
    }

    #[inline]
    fn stack(&self) -> Option<&SolidStack> {
        Some(self)
    }
}

/// The solids that a ray is inside of, which may scatter light, and the wavelength that it follows.
#[derive(Clone, Copy, Debug)]
pub struct Whole {
    stack: SolidStack,
    wavelength: Option<f32>,
}

impl Inside for Whole {
    const ABSORBS: bool = true;
    const NESTS: bool = true;
    const DISPERSES: bool = true;
    const SCATTERS: bool = true;

    #[inline]
    fn new(stack: &SolidStack) -> Self {
        Self { stack: *stack, wavelength: None }
    }

    #[inline]
    fn medium(&self) -> u32 {
        self.stack.medium()
    }

    #[inline]
    fn beyond(&self, _: u32, _: bool) -> Self {
        *self
    }

    #[inline]
    fn stack(&self) -> Option<&SolidStack> {
        Some(&self.stack)
    }

    #[inline]
    fn within(&self, stack: &SolidStack) -> Self {
        Self { stack: *stack, ..*self }
    }

    #[inline]
    fn wavelength(&self) -> Option<f32> {
        self.wavelength
    }

    #[inline]
    fn tuned(&self, nm: f32) -> Self {
        Self { wavelength: Some(nm), ..*self }
    }
}

/// How often solids were found to be nested in a way that cannot be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NestingFaults {
    /// Rays which left a solid that they had not entered, or went off to infinity inside one.
    pub count: u64,
    /// Instances of the first such two solids in the order of the scene: one left or never left, and
    /// what the ray was in; twice the same where that was air.
    pub pair: Option<(u32, u32)>,
    /// Solids which were forgotten since a ray was inside too many.
    pub forgotten: u64,
}

impl NestingFaults {
    /// The sum of both; in any order the same.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let pair = match (self.pair, other.pair) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self { count: self.count + other.count, pair, forgotten: self.forgotten + other.forgotten }
    }

    /// A ray found that it was not, or was still, inside `solid`, when it took itself to be in `within`.
    pub fn add(&mut self, solid: u32, within: Option<u32>) {
        let pair = Some((solid, within.unwrap_or(solid)));
        *self = self.plus(Self { count: 1, pair, forgotten: 0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    fn solid(instance: u32, priority: i32) -> Solid {
        Solid { instance, material: instance + 100, priority }
    }

    /// Oracle: a plain list, searched for its best.
    #[test]
    fn the_first_is_the_highest_in_rank() {
        for run in 0..200 {
            let sampler = Sampler::new(3, 0, (run, 0), 0);
            let mut stack = SolidStack::default();
            let mut list: Vec<Solid> = Vec::new();
            for step in 0..64 {
                let [a, b] = sampler.two(2 * step).to_array();
                let instance = (a * 6.0) as u32;
                let solid = solid(instance, (instance % 3) as i32);
                if b < 0.5 && list.len() < ROOM {
                    assert!(stack.enter(solid));
                    list.push(solid);
                } else {
                    let place = list.iter().position(|s| s.instance == instance);
                    assert_eq!(stack.leave(instance), place.is_some());
                    place.map(|place| list.remove(place));
                }
                let best = list.iter().min_by_key(|s| (-s.priority, s.instance));
                assert_eq!(stack.first(), best);
                assert_eq!(stack.solids().len(), list.len());
            }
        }
    }

    /// Without room the lowest in rank goes, and the first stays right.
    #[test]
    fn a_full_stack_keeps_what_matters() {
        let mut stack = SolidStack::default();
        for k in 0..ROOM as u32 {
            assert!(stack.enter(solid(k, 1)));
        }
        assert!(!stack.enter(solid(90, 0)), "there is no room");
        assert_eq!(stack.solids().len(), ROOM);
        assert!(!stack.leave(90), "it was forgotten");
        assert!(!stack.enter(solid(91, 7)));
        assert_eq!(stack.first(), Some(&solid(91, 7)));
        assert!(!stack.leave(ROOM as u32 - 1), "the lowest made room for it");
        assert!(stack.leave(91) && stack.leave(0));
    }

    #[test]
    fn faults_add_up_in_any_order() {
        let mut a = NestingFaults::default();
        a.add(7, None);
        let mut b = NestingFaults::default();
        b.add(3, Some(9));
        assert_eq!(a.plus(b), b.plus(a));
        assert_eq!(a.plus(b), NestingFaults { count: 2, pair: Some((3, 9)), forgotten: 0 });
    }
}
