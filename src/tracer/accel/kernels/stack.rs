//! What a walk has yet to visit.

use std::mem::MaybeUninit;

use crate::tracer::accel::layout::{Child, Row};

use super::lanes::{Lanes, Slots};

/// Entries: a walk leaves at most seven behind on every level and writes eight at a time.
const CAPACITY: usize = 1024;

/// Children that a level can leave behind while one is visited.
const LEFT: usize = 7;

/// Entries that end a walk; when the upper is taken the lower is still there to be looked at.
const BOTTOM: usize = 2;

/// The deepest tree that can be walked, in levels of nodes.
pub(in crate::tracer::accel) const MAX_DEPTH: usize = (CAPACITY - BOTTOM - 8) / LEFT;

const _: () = assert!(BOTTOM + LEFT * MAX_DEPTH + 8 <= CAPACITY);

/// Children with the keys (lower bounds of their distance, as bits) under which they were left. At the bottom lies
/// [`Child::END`] with the smallest key. It is never cleared: what is not below the top may not have been written.
pub(super) struct Stack {
    keys: [MaybeUninit<i32>; CAPACITY],
    children: [MaybeUninit<u32>; CAPACITY],
}

/// How many entries there are: beside the stack, for a number within would not be kept in a register.
pub(super) type Top = usize;

impl Stack {
    #[inline(always)]
    pub(super) fn new() -> (Self, Top) {
        let (mut keys, mut children) =
            ([const { MaybeUninit::uninit() }; CAPACITY], [const { MaybeUninit::uninit() }; CAPACITY]);
        for bottom in 0..BOTTOM {
            keys[bottom].write(-1);
            children[bottom].write(Child::END.0);
        }
        (Self { keys, children }, BOTTOM)
    }

    /// The entry on top.
    #[inline(always)]
    pub(super) fn last(&self, top: Top) -> (i32, Child) {
        debug_assert!((1..=CAPACITY).contains(&top));
        // SAFETY: `top` is at least 1: END lies there twice and is taken once, then the walk ends. What is below was written.
        unsafe {
            let (key, child) = (self.keys.get_unchecked(top - 1), self.children.get_unchecked(top - 1));
            (key.assume_init(), Child(child.assume_init()))
        }
    }

    /// Takes the entry on top.
    #[inline(always)]
    pub(super) fn pop(&self, top: &mut Top) -> (i32, Child) {
        let last = self.last(*top);
        *top -= 1;
        last
    }

    /// The child on top.
    #[inline(always)]
    pub(super) fn next_child(&self, top: Top) -> Child {
        debug_assert!((1..=CAPACITY).contains(&top));
        // SAFETY: as in `last`.
        Child(unsafe { self.children.get_unchecked(top - 1).assume_init() })
    }

    /// Takes the child on top where keys are not kept.
    #[inline(always)]
    pub(super) fn pop_child(&self, top: &mut Top) -> Child {
        *top -= 1;
        debug_assert!(*top < CAPACITY);
        // SAFETY: as in `last`.
        Child(unsafe { self.children.get_unchecked(*top).assume_init() })
    }

    /// Puts the children of `row` in the order of `keys`, of which the first `count` are hits, the farthest first; the
    /// nearest, which is visited at once, is left above the top. With none the top is taken.
    #[inline(always)]
    pub(super) fn put<S: Lanes>(&mut self, s: S, row: &Row, (keys, count): (S::Ints, usize), top: &mut Top) {
        s.put(keys, slots(&mut self.keys, *top));
        s.put_named(row, keys, slots(&mut self.children, *top));
        *top = *top + count - 1;
    }

    /// Puts the children of `row` that `mask` has, in their order, but leaves the last, which is visited at once, above the
    /// top. With none the top is taken.
    #[inline(always)]
    pub(super) fn put_packed<S: Lanes>(&mut self, s: S, row: &Row, mask: u32, top: &mut Top) {
        s.put_packed(row, mask, slots(&mut self.children, *top));
        *top = *top + mask.count_ones() as usize - 1;
    }
}

#[inline(always)]
fn slots<T>(all: &mut [MaybeUninit<T>; CAPACITY], from: Top) -> &mut Slots<T> {
    debug_assert!(from + 8 <= CAPACITY);
    // SAFETY: a tree has at most MAX_DEPTH levels (`plan` sees to it), each of which leaves at most seven entries behind.
    unsafe { &mut *all.as_mut_ptr().add(from).cast::<Slots<T>>() }
}
