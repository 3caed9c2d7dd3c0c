//! Tests of `stream::rejections`.

use pointillist::color::Xyz;
use pointillist::stream::rejections::*;

fn rejected(index: u64, cause: Cause) -> Rejected {
    let fault = Fault { cause, part: FaultyValue::Color, surface: None, light: None };
    Rejected { index, fault, light_path: None, generations: None }
}

#[test]
fn merging_in_any_order_keeps_the_same_examples() {
    let parts: Vec<Rejections> = (0..50u64)
        .map(|part| {
            let mut r = Rejections::default();
            (0..4).for_each(|i| r.add(rejected(i * 70 + part, Cause::ALL[((i + part) % 5) as usize])));
            r
        })
        .collect();
    let (mut forward, mut backward) = (Rejections::default(), Rejections::default());
    parts.iter().for_each(|p| forward.merge(p));
    parts.iter().rev().for_each(|p| backward.merge(p));
    assert_eq!(forward, backward);
    assert_eq!((forward.total(), forward.samples()), (200, 200));
    assert_eq!(Cause::ALL.map(|cause| forward.count(cause)), [40; 5]);
    let indices: Vec<u64> = forward.examples().iter().map(|e| e.index).collect();
    assert_eq!(indices, (0..50).chain(70..120).collect::<Vec<_>>());
}

#[test]
fn contributions_are_no_samples() {
    let mut r = Rejections::default();
    r.add(rejected(1, Cause::Infinite));
    let fault =
        Fault { part: FaultyValue::LightSample, light: Some(3), ..rejected(2, Cause::Infinite).fault };
    r.add(Rejected { fault, ..rejected(2, Cause::Infinite) });
    assert_eq!((r.samples(), r.total(), r.count(Cause::Infinite)), (1, 2, 2));
    assert_eq!(
        r.faults().map(|(fault, count)| (fault.light, count)).collect::<Vec<_>>(),
        [(None, 1), (Some(3), 1)]
    );
}

#[test]
fn the_worst_is_named_first() {
    let grey = |v: f32| Xyz::new(v, v, v);
    let of = |uv: [f32; 2], color, weight| fault_of_sample(uv, color, weight);
    assert_eq!(of([0.5; 2], grey(0.0), 1.0), None);
    assert_eq!(of([f32::NAN; 2], grey(f32::NAN), 1.0), Some((FaultyValue::Position, Cause::NotANumber)));
    assert_eq!(of([0.5; 2], grey(f32::NAN), -0.0), Some((FaultyValue::Weight, Cause::NotPositive)));
    assert_eq!(
        of([0.5; 2], Xyz::new(-1.0, f32::NAN, 0.0), 1.0),
        Some((FaultyValue::Color, Cause::NotANumber))
    );
    assert_eq!(of([0.5; 2], Xyz::new(-1e-45, 0.0, 0.0), 1.0), Some((FaultyValue::Color, Cause::NotPositive)));
    assert_eq!(of([0.5; 2], grey(1e31), 1.0), Some((FaultyValue::Color, Cause::TooLarge)));
}
