//! Tests of `stream::rejections`.

use pointillist::stream::rejections::*;

#[test]
fn merging_in_any_order_keeps_the_same_examples() {
    let parts: Vec<Rejections> = (0..5u64)
        .map(|part| {
            let mut r = Rejections::default();
            (0..4).for_each(|i| r.add(i * 7 + part, Cause::ALL[((i + part) % 5) as usize]));
            r
        })
        .collect();
    let (mut forward, mut backward) = (Rejections::default(), Rejections::default());
    parts.iter().for_each(|p| forward.merge(p));
    parts.iter().rev().for_each(|p| backward.merge(p));
    assert_eq!(forward, backward);
    assert_eq!(forward.total(), 20);
    let indices: Vec<u64> = forward.examples().iter().map(|e| e.0).collect();
    assert_eq!(indices, [0, 1, 2, 3, 4, 7, 8, 9]);
}
