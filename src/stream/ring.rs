//! A bounded single-producer single-consumer ring, filled and emptied by grant and commit.
//!
//! One release store publishes a whole slot. Nothing is allocated after construction, and no call waits. The caller decides
//! what to do with a full or an empty ring (`lanes`).

use std::ops::{Deref, DerefMut};

use super::sync::{Arc, AtomicUsize, Ordering, UnsafeCell};

/// Keeps each index on cache lines of its own (two, because of adjacent-line prefetch), against false sharing between the two
/// threads.
#[repr(align(128))]
#[derive(Debug)]
struct Padded(AtomicUsize);

#[derive(Debug)]
struct Ring<T> {
    /// Number of slots that the consumer has released. Only the consumer writes it.
    head: Padded,
    /// Number of slots that the producer has committed. Only the producer writes it. `head <= tail <= head + capacity`.
    tail: Padded,
    /// Their number is a power of two, so that wrapping counters still refer to the right slot.
    slots: Box<[UnsafeCell<T>]>,
}

// SAFETY: slots are accessed only through `Producer` and `Consumer`. There is one of each, and they never access the same slot
// at the same time: the producer owns [tail, head + capacity), the consumer [head, tail).
unsafe impl<T: Send> Sync for Ring<T> {}
// SAFETY: whoever owns a ring owns its values.
unsafe impl<T: Send> Send for Ring<T> {}

impl<T> Ring<T> {
    fn slot(&self, position: usize) -> &UnsafeCell<T> {
        &self.slots[position & (self.slots.len() - 1)]
    }
}

/// Makes a ring of at least `capacity` slots (rounded up to a power of two), whose initial values `fill` makes.
pub fn ring<T>(capacity: usize, fill: impl FnMut() -> T) -> (Producer<T>, Consumer<T>) {
    let slots = std::iter::repeat_with(fill).take(capacity.max(1).next_power_of_two()).map(UnsafeCell::new);
    let ring = Arc::new(Ring {
        head: Padded(AtomicUsize::new(0)),
        tail: Padded(AtomicUsize::new(0)),
        slots: slots.collect(),
    });
    (Producer { ring: ring.clone(), tail: 0 }, Consumer { ring, head: 0 })
}

/// The writing end.
#[derive(Debug)]
pub struct Producer<T> {
    ring: Arc<Ring<T>>,
    /// A copy of `ring.tail`, which nobody else writes.
    tail: usize,
}

impl<T> Producer<T> {
    /// Lends the next free slot, or `None` while the ring is full. Never blocks.
    ///
    /// The slot holds an old value. Only [`WriteGrant::commit`] publishes it.
    pub fn grant(&mut self) -> Option<WriteGrant<'_, T>> {
        (!self.is_full()).then_some(WriteGrant { ring: &self.ring, tail: &mut self.tail })
    }

    /// True while the ring is full.
    pub fn is_full(&self) -> bool {
        let head = self.ring.head.0.load(Ordering::Acquire); // pairs with ReadGrant::release
        self.tail.wrapping_sub(head) == self.ring.slots.len()
    }
}

/// A free slot on loan to the producer. Dropping it publishes nothing and leaves the slot free.
#[must_use = "the slot is sent only by commit()"]
#[derive(Debug)]
pub struct WriteGrant<'a, T> {
    ring: &'a Ring<T>,
    tail: &'a mut usize,
}

impl<T> WriteGrant<'_, T> {
    /// Publishes the slot.
    pub fn commit(self) {
        *self.tail = self.tail.wrapping_add(1);
        self.ring.tail.0.store(*self.tail, Ordering::Release);
    }
}

impl<T> Deref for WriteGrant<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: the slot is at `tail` and unpublished, so the consumer does not access it, and the grant borrows the only
        // producer.
        self.ring.slot(*self.tail).with(|slot| unsafe { &*slot })
    }
}

impl<T> DerefMut for WriteGrant<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        // SAFETY: as in `deref`, and `&mut self` makes this the only reference.
        self.ring.slot(*self.tail).with_mut(|slot| unsafe { &mut *slot })
    }
}

/// The reading end.
#[derive(Debug)]
pub struct Consumer<T> {
    ring: Arc<Ring<T>>,
    /// A copy of `ring.head`, which nobody else writes.
    head: usize,
}

impl<T> Consumer<T> {
    /// Lends the oldest published slot, or `None` if the ring is empty. Never blocks.
    pub fn read(&mut self) -> Option<ReadGrant<'_, T>> {
        (!self.is_empty()).then_some(ReadGrant { ring: &self.ring, head: &mut self.head })
    }

    /// Number of published slots that have not been released. It may grow at any moment.
    pub fn len(&self) -> usize {
        let tail = self.ring.tail.0.load(Ordering::Acquire); // pairs with WriteGrant::commit
        tail.wrapping_sub(self.head)
    }

    /// True if the ring is empty at this moment.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of slots.
    pub fn capacity(&self) -> usize {
        self.ring.slots.len()
    }
}

/// A published slot on loan to the consumer. Dropping it leaves the slot in place, to be read again.
#[must_use = "the slot is given back only by release()"]
#[derive(Debug)]
pub struct ReadGrant<'a, T> {
    ring: &'a Ring<T>,
    head: &'a mut usize,
}

impl<T> ReadGrant<'_, T> {
    /// Returns the slot to the producer.
    pub fn release(self) {
        *self.head = self.head.wrapping_add(1);
        self.ring.head.0.store(*self.head, Ordering::Release);
    }
}

impl<T> Deref for ReadGrant<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: head < tail, so the producer has published this slot and does not access it before `head` has moved past it.
        // That takes `release`, which consumes this grant.
        self.ring.slot(*self.head).with(|slot| unsafe { &*slot })
    }
}
