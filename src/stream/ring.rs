//! One lane: a bounded ring with one producer and one consumer, filled and emptied by grant and commit.
//!
//! One release store publishes a whole slot; nothing is allocated after construction, nobody ever waits in here. What
//! to do with a full or an empty ring is the caller's business (`lanes.rs`).

use std::ops::{Deref, DerefMut};

use super::sync::{Arc, AtomicUsize, Ordering, UnsafeCell};

/// Keeps each index on cache lines of its own (two lines: adjacent-line prefetch), or the two threads would take the
/// line from each other at every look.
#[repr(align(128))]
#[derive(Debug)]
struct Padded(AtomicUsize);

#[derive(Debug)]
struct Ring<T> {
    /// Slots the consumer has released; written by the consumer only.
    head: Padded,
    /// Slots the producer has committed; written by the producer only. `head <= tail <= head + capacity`.
    tail: Padded,
    /// A power of two of them, so that wrapping counters keep naming the right slot.
    slots: Box<[UnsafeCell<T>]>,
}

// SAFETY: slots are reached only through `Producer` and `Consumer`, of which there is one each and which never name
// the same slot at the same time: the producer owns [tail, head + capacity), the consumer [head, tail).
unsafe impl<T: Send> Sync for Ring<T> {}
// SAFETY: owning a ring is owning its values.
unsafe impl<T: Send> Send for Ring<T> {}

impl<T> Ring<T> {
    fn slot(&self, position: usize) -> &UnsafeCell<T> {
        &self.slots[position & (self.slots.len() - 1)]
    }
}

/// Makes a ring of at least `capacity` slots (rounded up to a power of two), each filled by `fill` once.
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
    /// Its own copy of `ring.tail`, which nobody else writes.
    tail: usize,
}

impl<T> Producer<T> {
    /// Lends the next free slot, or `None` while the consumer still has them all. Never blocks.
    ///
    /// The slot holds whatever was left there; only [`WriteGrant::commit`] sends.
    pub fn grant(&mut self) -> Option<WriteGrant<'_, T>> {
        (!self.is_full()).then_some(WriteGrant { ring: &self.ring, tail: &mut self.tail })
    }

    /// True when [`Producer::grant`] would lend nothing.
    pub fn is_full(&self) -> bool {
        let head = self.ring.head.0.load(Ordering::Acquire); // pairs with ReadGrant::release
        self.tail.wrapping_sub(head) == self.ring.slots.len()
    }
}

/// An unpublished slot. Dropping it sends nothing and leaves the slot free.
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
        // SAFETY: the slot is at `tail`, unpublished: the consumer does not look at it, and the grant borrows the
        // only producer.
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
    /// Its own copy of `ring.head`, which nobody else writes.
    head: usize,
}

impl<T> Consumer<T> {
    /// Borrows the oldest published slot, or `None` when there is nothing new. Never blocks.
    pub fn read(&mut self) -> Option<ReadGrant<'_, T>> {
        (!self.is_empty()).then_some(ReadGrant { ring: &self.ring, head: &mut self.head })
    }

    /// Published slots not yet released; may grow at any moment.
    pub fn len(&self) -> usize {
        let tail = self.ring.tail.0.load(Ordering::Acquire); // pairs with WriteGrant::commit
        tail.wrapping_sub(self.head)
    }

    /// True when there is nothing to read at this moment.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Slots in the ring.
    pub fn capacity(&self) -> usize {
        self.ring.slots.len()
    }
}

/// A published slot on loan to the consumer. Dropping it leaves the slot where it is, to be read again.
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
        // SAFETY: head < tail: the producer published this slot and does not touch it before `head` has moved past
        // it, which takes `release` and with it this borrow.
        self.ring.slot(*self.head).with(|slot| unsafe { &*slot })
    }
}

#[cfg(all(test, not(feature = "loom")))]
mod tests {
    use super::*;

    #[test]
    fn everything_arrives_once_and_in_order() {
        const COUNT: u64 = 50_000;
        let (mut producer, mut consumer) = ring(8, || 0u64);
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for i in 0..COUNT {
                    let mut grant = loop {
                        if let Some(grant) = producer.grant() {
                            break grant;
                        }
                        std::thread::yield_now();
                    };
                    *grant = i;
                    grant.commit();
                }
            });
            let mut next = 0;
            while next < COUNT {
                match consumer.read() {
                    Some(slot) => {
                        assert_eq!(*slot, next);
                        next += 1;
                        slot.release();
                    }
                    None => std::thread::yield_now(),
                }
            }
            assert!(consumer.is_empty());
        });
    }

    #[test]
    fn a_full_ring_refuses_and_a_dropped_grant_sends_nothing() {
        let (mut producer, mut consumer) = ring(2, || 0);
        for value in [1, 2] {
            *producer.grant().expect("free") = 99; // dropped
            let mut grant = producer.grant().expect("free");
            *grant = value;
            grant.commit();
        }
        assert!(producer.grant().is_none() && producer.is_full());
        assert_eq!(*consumer.read().expect("first"), 1); // a look, not released
        for value in [1, 2] {
            let slot = consumer.read().expect("published");
            assert_eq!(*slot, value);
            slot.release();
        }
        assert!(consumer.read().is_none() && !producer.is_full());
    }
}
