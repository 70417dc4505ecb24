//! The stack of a traversal, which costs nothing until it is used.

#![expect(
    unsafe_code,
    reason = "setting hundreds of bytes to 0 for every ray took 3 % of its time"
)]

use std::mem::MaybeUninit;

/// A stack of at most `N` entries.
pub(super) struct Stack<T, const N: usize> {
    /// Those below `depth` were written.
    places: [MaybeUninit<T>; N],
    depth: usize,
}

impl<T: Copy + PartialOrd, const N: usize> Stack<T, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        // A constant: the same value `N` times over would be copied, place by place.
        Self { places: [const { MaybeUninit::uninit() }; N], depth: 0 }
    }

    /// Number of entries.
    #[inline(always)]
    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    /// # Panics
    /// When the stack is full.
    #[inline(always)]
    pub(super) fn push(&mut self, entry: T) {
        self.places[self.depth].write(entry);
        self.depth += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<T> {
        self.depth = self.depth.checked_sub(1)?;
        Some(self.at(self.depth))
    }

    /// Pushes an entry below all smaller ones which stand above `bottom`.
    ///
    /// # Panics
    /// When the stack is full.
    #[inline(always)]
    pub(super) fn insert(&mut self, bottom: usize, entry: T) {
        self.push(entry);
        let mut place = self.depth - 1;
        while place > bottom && self.at(place - 1) < entry {
            self.places[place] = self.places[place - 1];
            place -= 1;
        }
        self.places[place].write(entry);
    }

    /// An entry which was written.
    #[inline(always)]
    fn at(&self, place: usize) -> T {
        debug_assert!(place <= self.depth);
        // SAFETY: callers ask for places below the depth, or for the one that `pop` has just left; all of
        // these were written by `push`.
        unsafe { self.places[place].assume_init() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_come_back_in_order() {
        let mut stack = Stack::<u64, 8>::new();
        assert_eq!(stack.pop(), None);
        stack.push(1);
        stack.push(9);
        for entry in [5, 7, 2] {
            stack.insert(2, entry);
        }
        assert_eq!(stack.depth(), 5);
        let order: Vec<u64> = std::iter::from_fn(|| stack.pop()).collect();
        assert_eq!(order, [2, 5, 7, 9, 1], "sorted above the bottom only");
    }
}
