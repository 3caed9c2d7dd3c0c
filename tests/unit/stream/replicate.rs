//! Tests of `stream::replicate`.

use pointillist::stream::replicate::*;

#[test]
fn chunks_alternate_and_every_replicate_sees_its_sequence_from_the_start() {
    assert_eq!([0, 1023, 1024, 2047, 2048].map(replicate), [(0, 0), (0, 1023), (1, 0), (1, 1023), (0, 1024)]);
    let mut next = [0; REPLICATES];
    for index in 0..10 * CHUNK {
        let (r, own) = replicate(index);
        assert_eq!(own, next[r]);
        next[r] += 1;
    }
    assert_eq!(replicate_seed(7, 0), 7);
    assert_ne!(replicate_seed(7, 1), 7);
    assert_eq!(replicate(u64::MAX), (1, u64::MAX / 2 / CHUNK * CHUNK + 1023));
}
