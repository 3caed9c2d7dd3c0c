//! The traversal stack.

use std::mem::MaybeUninit;

use crate::tracer::accel::layout::{F32x8, NodeRef};

use super::simd::{Simd8, Slots};

/// Number of entries: the traversal leaves at most seven on every level and writes eight at a time.
const CAPACITY: usize = 1024;

/// Most children of a level that stay on the stack while one is visited.
const LEFT: usize = 7;

/// Entries at the bottom that end the traversal: after the upper one is popped, the lower one can still be read.
const BOTTOM: usize = 2;

/// The largest depth of a BVH that can be traversed, in levels of nodes.
pub(in crate::tracer::accel) const MAX_DEPTH: usize = (CAPACITY - BOTTOM - 8) / LEFT;

const _: () = assert!(BOTTOM + LEFT * MAX_DEPTH + 8 <= CAPACITY);

/// Node references with their keys: lower bounds of their distances, as bits. The bottom entries are [`NodeRef::END`] with the
/// smallest key. The memory is not initialised: only the entries below the top have been written.
pub(super) struct TraversalStack {
    keys: [MaybeUninit<i32>; CAPACITY],
    children: [MaybeUninit<u32>; CAPACITY],
}

/// The number of entries. It is not part of the stack, because then it would not be kept in a register.
pub(super) type Top = usize;

impl TraversalStack {
    #[inline(always)]
    pub fn new() -> (Self, Top) {
        let (mut keys, mut children) =
            ([const { MaybeUninit::uninit() }; CAPACITY], [const { MaybeUninit::uninit() }; CAPACITY]);
        for bottom in 0..BOTTOM {
            keys[bottom].write(-1);
            children[bottom].write(NodeRef::END.0);
        }
        (Self { keys, children }, BOTTOM)
    }

    /// Pops the topmost entry.
    #[inline(always)]
    pub fn pop(&self, top: &mut Top) -> (i32, NodeRef) {
        debug_assert!((1..=CAPACITY).contains(top));
        *top -= 1;
        // SAFETY: `top` was at least 1, because END lies at the bottom twice and the traversal ends when it has been popped
        // once. All entries below it were written.
        unsafe {
            let (key, child) = (self.keys.get_unchecked(*top), self.children.get_unchecked(*top));
            (key.assume_init(), NodeRef(child.assume_init()))
        }
    }

    /// The topmost node reference.
    #[inline(always)]
    pub fn next_child(&self, top: Top) -> NodeRef {
        debug_assert!((1..=CAPACITY).contains(&top));
        // SAFETY: as in `pop`.
        NodeRef(unsafe { self.children.get_unchecked(top - 1).assume_init() })
    }

    /// Pops the topmost node reference of a traversal that stores no keys.
    #[inline(always)]
    pub fn pop_child(&self, top: &mut Top) -> NodeRef {
        let child = self.next_child(*top);
        *top -= 1;
        child
    }

    /// Pushes the child references of `row` in the order of `keys`, farthest first, of which the first `count` are hits. The
    /// closest, which is visited at once, stays above the top. Without a hit the topmost entry is popped.
    #[inline(always)]
    pub fn push_sorted<S: Simd8>(&mut self, s: S, row: &F32x8, keys: S::Ints, count: usize, top: &mut Top) {
        s.store(keys, slots(&mut self.keys, *top));
        s.store_permuted(row, keys, slots(&mut self.children, *top));
        *top = *top + count - 1;
    }

    /// Pushes the child references of `row` in the lanes of `mask`, in order. The last, which is visited at once, stays above
    /// the top. Without one the topmost entry is popped.
    #[inline(always)]
    pub fn push_masked<S: Simd8>(&mut self, s: S, row: &F32x8, mask: u32, top: &mut Top) {
        s.store_compressed(row, mask, slots(&mut self.children, *top));
        *top = *top + mask.count_ones() as usize - 1;
    }
}

#[inline(always)]
fn slots<T>(all: &mut [MaybeUninit<T>; CAPACITY], from: Top) -> &mut Slots<T> {
    debug_assert!(from + 8 <= CAPACITY);
    // SAFETY: a BVH has at most MAX_DEPTH levels (`collapse` ensures it), each of which leaves at most seven entries.
    unsafe { &mut *all.as_mut_ptr().add(from).cast::<Slots<T>>() }
}
