//! The ring and the doorbell under a model checker: every interleaving of a few small histories.
//!
//! It compiles the two files as they are against loom's primitives, and nothing else of the crate. It takes seconds: loom bounds each
//! history by itself.

#![allow(dead_code, reason = "the histories use a part of each interface")]

/// Takes the place of `src/stream/sync.rs`.
mod sync {
    pub use loom::cell::UnsafeCell;
    pub use loom::sync::atomic::{AtomicUsize, Ordering, fence};
    pub use loom::sync::{Arc, Condvar, Mutex};
}

#[path = "../src/stream/ring.rs"]
mod ring;
#[path = "../src/stream/signal.rs"]
mod signal;

use loom::thread;
use ring::ring as new_ring;
use sync::{Arc, AtomicUsize, Ordering};

/// Two committed values arrive once, in order, whole; the third look finds nothing.
#[test]
fn commit_then_read() {
    loom::model(|| {
        let (mut producer, mut consumer) = new_ring(2, || [0u32; 2]);
        let worker = thread::spawn(move || {
            for value in 1..=2 {
                let mut grant = producer.grant().expect("two slots are free");
                *grant = [value, value];
                grant.commit();
            }
        });
        let mut seen = 0;
        for _ in 0..3 {
            if let Some(slot) = consumer.read() {
                seen += 1;
                assert_eq!(*slot, [seen, seen]);
                slot.release();
            }
        }
        worker.join().expect("worker");
        while let Some(slot) = consumer.read() {
            seen += 1;
            assert_eq!(*slot, [seen, seen]);
            slot.release();
        }
        assert_eq!(seen, 2);
    });
}

/// A full ring refuses; the slot is lent again only after its release, and no value is overwritten unread.
#[test]
fn full_ring_reuses_a_slot_only_after_release() {
    loom::model(|| {
        let (mut producer, mut consumer) = new_ring(1, || 0u32);
        let mut grant = producer.grant().expect("free");
        *grant = 1;
        grant.commit();
        let worker = thread::spawn(move || match producer.grant() {
            Some(mut grant) => {
                *grant = 2;
                grant.commit();
                true
            }
            None => false,
        });
        let slot = consumer.read().expect("published before the thread began");
        assert_eq!(*slot, 1);
        slot.release();
        let sent = worker.join().expect("worker");
        assert_eq!(consumer.read().map(|slot| *slot), sent.then_some(2));
    });
}

/// A dropped grant and a dropped read change nothing for the other side.
#[test]
fn dropped_grants_send_and_free_nothing() {
    loom::model(|| {
        let (mut producer, mut consumer) = new_ring(1, || 0u32);
        let worker = thread::spawn(move || {
            *producer.grant().expect("free") = 7; // dropped
            let mut grant = producer.grant().expect("still free");
            *grant = 8;
            grant.commit();
            producer.is_full()
        });
        if let Some(slot) = consumer.read() {
            assert_eq!(*slot, 8); // looked at, not released
        }
        assert!(worker.join().expect("worker"), "a look must not free the slot");
        assert_eq!(*consumer.read().expect("committed"), 8);
    });
}

/// The client's loop over epochs: a stale value is dropped, the fresh one behind it arrives.
#[test]
fn stale_epoch_is_dropped() {
    loom::model(|| {
        let (mut producer, mut consumer) = new_ring(2, || 0u32);
        let epoch = Arc::new(AtomicUsize::new(0));
        let worker = {
            let epoch = epoch.clone();
            thread::spawn(move || {
                let mut grant = producer.grant().expect("free");
                *grant = epoch.load(Ordering::Relaxed) as u32;
                grant.commit();
                let mut grant = producer.grant().expect("free");
                *grant = 1;
                grant.commit();
            })
        };
        epoch.store(1, Ordering::Relaxed);
        worker.join().expect("worker");
        let mut fresh = 0;
        while let Some(slot) = consumer.read() {
            fresh += usize::from(*slot == 1);
            slot.release();
        }
        assert!((1..=2).contains(&fresh));
    });
}

/// A worker that parks on a full lane is woken by the release, in every interleaving (loom reports a sleep without
/// end as a deadlock).
#[test]
fn no_wake_up_is_lost() {
    loom::model(|| {
        let (mut producer, mut consumer) = new_ring(1, || 0u32);
        producer.grant().expect("free").commit();
        let space = Arc::new(signal::Signal::default());
        let worker = {
            let space = space.clone();
            thread::spawn(move || {
                space.wait(None, || !producer.is_full());
                producer.grant().expect("the wait is over because a slot is free").commit();
            })
        };
        consumer.read().expect("published").release();
        space.ring();
        worker.join().expect("worker");
        assert_eq!(consumer.len(), 1);
    });
}
