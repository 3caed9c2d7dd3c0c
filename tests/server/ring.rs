//! The ring of one lane, with real threads; `loom_ring` checks every interleaving of small histories.

use std::collections::VecDeque;

use pointillist::stream::ring::ring;
use proptest::prelude::*;

/// What can happen to a ring.
#[derive(Clone, Copy, Debug)]
enum Step {
    Commit,
    DropGrant,
    Release,
    Look,
}

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

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Beside a plain queue, in any order of steps and for any capacity.
    #[test]
    fn a_ring_is_a_bounded_queue(
        wanted in 0..20usize,
        steps in proptest::collection::vec(
            prop_oneof![5 => Just(Step::Commit), 1 => Just(Step::DropGrant), 4 => Just(Step::Release), 1 => Just(Step::Look)], 0..400),
    ) {
        let (mut producer, mut consumer) = ring(wanted, || 0usize);
        let capacity = consumer.capacity();
        prop_assert!(capacity >= wanted.max(1) && capacity < 2 * wanted.max(1));
        let mut queue = VecDeque::new();
        for (i, step) in steps.into_iter().enumerate() {
            match step {
                Step::Commit | Step::DropGrant => match producer.grant() {
                    None => prop_assert_eq!(queue.len(), capacity),
                    Some(mut grant) => {
                        *grant = i;
                        prop_assert_eq!(*grant, i);
                        if matches!(step, Step::Commit) {
                            grant.commit();
                            queue.push_back(i);
                        }
                    }
                },
                Step::Release => match consumer.read() {
                    None => prop_assert!(queue.is_empty()),
                    Some(slot) => {
                        prop_assert_eq!(Some(*slot), queue.pop_front());
                        slot.release();
                    }
                },
                Step::Look => prop_assert_eq!(consumer.read().map(|slot| *slot), queue.front().copied()),
            }
            prop_assert_eq!(consumer.len(), queue.len());
            prop_assert_eq!((consumer.is_empty(), producer.is_full()), (queue.is_empty(), queue.len() == capacity));
        }
    }
}
