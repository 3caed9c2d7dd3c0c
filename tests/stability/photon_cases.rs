//! Point sets that are hard for a tree which splits space, and the answer by a loop over all.

use glam::Vec3;
use pointillist::math::random::Random;

/// Squared distances below `radius`², sorted, of at most `wanted` points.
pub fn by_loop(points: &[Vec3], at: Vec3, wanted: usize, radius: f32) -> Vec<f32> {
    let mut all: Vec<f32> =
        points.iter().map(|&p| (p - at).length_squared()).filter(|&d| d < radius * radius).collect();
    all.sort_by(f32::total_cmp);
    all.truncate(wanted);
    all
}

/// A box and points, most of them in it.
pub struct Case {
    pub name: &'static str,
    pub min: Vec3,
    pub max: Vec3,
    pub points: Vec<Vec3>,
}

/// Point sets that are hard for a tree which splits space.
pub fn cases() -> Vec<Case> {
    let mut r = Random(1);
    let n = 3000;
    let tiny = f32::from_bits(1);
    let mut make = |name, min: Vec3, max: Vec3, f: &mut dyn FnMut(&mut Random, usize) -> Vec3| Case {
        name,
        min,
        max,
        points: (0..n).map(|i| f(&mut r, i)).collect(),
    };
    let (zero, one) = (Vec3::ZERO, Vec3::ONE);
    let mut all = vec![
        make("random", zero, one, &mut |r, _| r.point()),
        make("coincident in hundreds", zero, one, &mut |_, i| Random(i as u64 / 100).point()),
        make("collinear, axis", zero, one, &mut |r, _| Vec3::new(0.3, r.f32(), 0.7)),
        make("collinear, diagonal", zero, one, &mut |r, _| Vec3::splat(r.f32())),
        make("collinear, slanted", zero, one, &mut |r, _| {
            Vec3::new(0.1, 0.2, 0.3) + r.f32() * Vec3::new(0.7, 0.1, 0.5)
        }),
        make("on one face", zero, one, &mut |r, _| Vec3::new(r.f32(), 1.0, r.f32())),
        make("on splitting planes", zero, one, &mut |r, _| (r.point() * 8.0).floor() / 8.0),
        make("one cell deep down", zero, one, &mut |r, _| Vec3::splat(0.3) + r.point() * 1e-6),
        make("geometric towards a corner", zero, one, &mut |r, _| 2f32.powf(-140.0 * r.f32()) * r.point()),
        make("outside the box", zero, one, &mut |r, _| r.point() * 40.0 - 20.0),
        make("denormal extent", zero, Vec3::splat(tiny * 1000.0), &mut |r, _| {
            (r.point() * 1000.0).floor() * tiny
        }),
        make("flat box", zero, Vec3::new(1.0, 0.0, 1.0), &mut |r, _| Vec3::new(r.f32(), 0.0, r.f32())),
        make("point box", one, one, &mut |_, _| one),
        make("far away", Vec3::splat(1e6), Vec3::splat(1e6 + 4.0), &mut |r, _| {
            Vec3::splat(1e6) + 4.0 * r.point()
        }),
        make("whole range of f32", Vec3::splat(f32::MIN), Vec3::splat(f32::MAX), &mut |r, _| {
            (r.point() - 0.5) * 2.0 * f32::MAX
        }),
        make("few", zero, one, &mut |r, _| r.point()),
        make("empty", zero, one, &mut |r, _| r.point()),
    ];
    for case in &mut all {
        match case.name {
            "few" => case.points.truncate(5),
            "empty" => case.points.clear(),
            _ => {}
        }
    }
    all
}
