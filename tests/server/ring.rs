//! The ring of one lane, with real threads; `loom_ring` checks every interleaving of small histories.

use pointillist::stream::ring::ring;

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
