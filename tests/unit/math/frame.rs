//! Tests of `math::frame`.

use glam::Vec3;
use pointillist::math::frame::*;
use pointillist::math::random::Random;

/// Frisvad's form (2012), the naive method here, breaks down near n = −z.
#[test]
fn frames_are_orthonormal_everywhere() {
    let frisvad = |n: Vec3| {
        let a = 1.0 / (1.0 + n.z);
        let b = -n.x * n.y * a;
        (Vec3::new(1.0 - n.x * n.x * a, b, -n.x), Vec3::new(b, 1.0 - n.y * n.y * a, -n.y))
    };
    let (mut worst, mut worst_naive) = (0f32, 0f32);
    let mut random = Random(1);
    let mut next = || random.within(-1.0, 1.0);
    for i in 0..1_000_000 {
        // Half of them within 1e-3 of the poles, the difficult case.
        let squeeze = if i % 2 == 0 { 1.0 } else { 1e-3 };
        let z = if i % 4 < 2 { -1.0 } else { 1.0 };
        let v = Vec3::new(next() * squeeze, next() * squeeze, if i % 2 == 0 { next() } else { z });
        let Some(n) = v.try_normalize() else { continue };
        let f = Frame::new(n);
        let det = f.s.cross(f.t).dot(f.n);
        let off = f.s.dot(f.t).abs().max(f.s.dot(n).abs()).max(f.t.dot(n).abs()).max((det - 1.0).abs());
        worst = worst.max(off).max((f.s.length() - 1.0).abs()).max((f.t.length() - 1.0).abs());
        let (s, t) = frisvad(n);
        let naive = s.dot(t).abs().max((s.length() - 1.0).abs());
        worst_naive = worst_naive.max(if naive.is_finite() { naive } else { 1.0 });
    }
    assert!(worst_naive > 1e-3, "the case is too easy: {worst_naive}");
    assert!(worst < 1e-6, "worst deviation {worst}");
}

#[test]
fn frames_along_a_direction() {
    let n = Vec3::new(0.48, -0.6, -0.64);
    for along in [Vec3::X, Vec3::new(1e-20, 3e-20, 0.0), Vec3::new(-1e18, 0.0, 2e18), n + Vec3::X * 1e-3] {
        let f = Frame::along(n, along);
        let off = f.s.dot(n).abs().max(f.t.dot(n).abs()).max((f.s.cross(f.t) - n).length());
        assert!(off < 1e-6, "{along}: {f:?}");
        assert!(f.t.dot(along.normalize()).abs() < 1e-4 && f.s.dot(along) > 0.0, "{along}: {f:?}");
    }
    for none in [Vec3::ZERO, n, -n * 7.0, Vec3::splat(f32::NAN)] {
        assert_eq!(Frame::along(n, none).s, Frame::new(n).s);
    }
}

#[test]
fn local_and_back() {
    let f = Frame::new(Vec3::new(0.48, -0.6, -0.64));
    let v = Vec3::new(0.3, 0.4, -1.2);
    assert!((f.to_world(f.to_local(v)) - v).length() < 1e-6);
    assert!((f.to_local(f.n) - Vec3::Z).length() < 1e-6);
}

/// The back of a surface has the same s axis, and is right-handed.
#[test]
fn a_turned_frame_is_that_of_the_back() {
    let frame = Frame::new(Vec3::new(0.48, -0.6, 0.64));
    let back = frame.turned();
    assert_eq!((back.s, back.t, back.n), (frame.s, -frame.t, -frame.n));
    assert!((back.s.cross(back.t) - back.n).length() < 1e-6);
    let v = Vec3::new(0.1, 0.2, 0.3);
    assert!((back.to_local(frame.to_world(v)) - Vec3::new(0.1, -0.2, -0.3)).length() < 1e-6);
}
