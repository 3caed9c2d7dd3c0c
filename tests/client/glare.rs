//! Glare on the CPU: the kernel against the published functions, the reference against the convolution written out.

use crate::support::glare::{ADAPTATIONS, difference, direct, glare, noise, point, rounding_bound, total};
use glam::{DVec3, Vec3};
use pointillist::client::glare::GlareKernel;
use pointillist::client::glare::point_spread::{mixture, point_spread};
use pointillist::client::reference::glare::ReferenceGlare;
use pointillist::client::{Adaptation, Glare};
use pointillist::image::Grid;

/// Side lengths that meet every radix, odd ones among them, and the smallest pictures.
const EXTENTS: [[usize; 2]; 9] =
    [[1, 1], [1, 7], [2, 2], [3, 5], [17, 33], [24, 9], [40, 31], [64, 64], [75, 20]];

fn apply(picture: &Grid<Vec3>, glare: &Glare) -> Grid<Vec3> {
    ReferenceGlare::default().apply(picture, glare).expect("memory")
}

#[test]
fn reference_equals_direct_convolution() {
    for adaptation in ADAPTATIONS {
        for extent in EXTENTS {
            let (picture, glare) = (noise(extent, 7), glare(adaptation));
            let wanted = direct(&picture, &glare);
            let error = difference(apply(&picture, &glare).pixels(), &wanted);
            assert!(error < rounding_bound(&wanted), "{extent:?} {adaptation:?}: {error:e}");
        }
    }
}

/// The case that the padding is for: the same transform without it puts light of the right border at the left.
#[test]
fn light_does_not_wrap_around() {
    let (extent, glare) = ([32, 24], glare(Adaptation::Photopic));
    let picture = point(extent, [31, 12], Vec3::ONE);
    let got = apply(&picture, &glare);
    let (near, far) = (got.at(1, 12).y, got.at(0, 12).y);
    assert!(far < near && far > 0.0, "{far} at the far border, {near} beside it");
    let kernel = GlareKernel::new(extent, &glare).expect("memory");
    let wrapped = kernel.quadrant.at(1, 0)[1] / kernel.quadrant.at(31, 0)[1];
    assert!(wrapped > 100.0, "case too easy: wrap-around is only {wrapped} times too bright");
}

/// Energy within 10⁻⁴ whatever stands at the border: noise all over, a point in the middle and in a corner.
#[test]
fn energy_is_preserved() {
    for adaptation in ADAPTATIONS {
        for extent in [[1, 1], [3, 5], [64, 48], [200, 117], [512, 512]] {
            let glare = glare(adaptation);
            let [w, h] = extent;
            let pictures = [
                noise(extent, 3),
                point(extent, [w / 2, h / 2], Vec3::new(0.0, 1.0, 3e4)),
                point(extent, [w - 1, 0], Vec3::new(1.0, 2e-3, 0.3)),
            ];
            for (i, picture) in pictures.iter().enumerate() {
                let (before, after) = (total(picture.pixels()), total(apply(picture, &glare).pixels()));
                let error = (after / before.max(DVec3::splat(1e-30)) - 1.0).abs();
                let black = before.cmpeq(DVec3::ZERO);
                let error = DVec3::select(black, DVec3::ZERO, error).max_element();
                assert!(error < 1e-5, "{extent:?} {adaptation:?}, picture {i}: {error:e}");
            }
        }
    }
}

/// A white wall stays a white wall: no border darkens (with plain zero padding a corner would lose an eighth), none glows.
#[test]
fn a_uniform_picture_stays_nearly_uniform() {
    let extent = [128, 96];
    for adaptation in ADAPTATIONS {
        let picture = Grid::from_rows(128, 96, vec![Vec3::ONE; 128 * 96]).expect("a picture");
        let got = apply(&picture, &glare(adaptation));
        for (i, v) in got.pixels().iter().enumerate() {
            assert!((*v - 1.0).abs().max_element() < 0.06, "{adaptation:?}: {v} at {}, {}", i % 128, i / 128);
        }
        let kernel = GlareKernel::new(extent, &glare(adaptation)).expect("memory");
        let lost = 1.0 - 1.0 / kernel.gain_at(0, 0)[1];
        assert!(lost > 0.1, "case too easy: a corner would lose {lost}");
    }
}

/// Positive, falling with distance in daylight, one in sum over offsets of both signs.
#[test]
fn kernels_are_positive_and_sum_to_one() {
    for adaptation in ADAPTATIONS {
        for (extent, view_angle) in
            [([1, 1], 40.0), ([9, 4], 40.0), ([300, 200], 40.0), ([300, 200], 2.0), ([65, 200], 170.0)]
        {
            let kernel = GlareKernel::new(extent, &Glare { adaptation, view_angle }).expect("memory");
            let mut sum = [0.0f64; 3];
            for y in 0..extent[1] {
                for (x, value) in kernel.quadrant.row(y).iter().enumerate() {
                    let copies = if x == 0 { 1.0 } else { 2.0 } * if y == 0 { 1.0 } else { 2.0 };
                    for c in 0..3 {
                        assert!(value[c] > 0.0 && value[c] <= 1.0 + 1e-6);
                        sum[c] += copies * f64::from(value[c]);
                    }
                }
                if adaptation == Adaptation::Photopic {
                    assert!(
                        kernel.quadrant.row(y).windows(2).all(|w| w[1][1] <= w[0][1]),
                        "{extent:?} row {y}"
                    );
                }
            }
            assert!(
                sum.iter().all(|s| (s - 1.0).abs() < 1e-5),
                "{extent:?} {adaptation:?} {view_angle}°: {sum:?}"
            );
        }
    }
}

/// Pixels hold the integral of the published function over their solid angle, also where the spike is far narrower than
/// a pixel: compared with 10⁶ points per pixel about the centre, and with the middle of pixels far away.
#[test]
fn pixels_hold_integrals_of_the_published_function() {
    let glare = Glare { adaptation: Adaptation::Photopic, view_angle: 40.0 };
    let extent = [200, 200];
    let kernel = GlareKernel::new(extent, &glare).expect("memory");
    let tangent = 2.0 * 20f64.to_radians().tan() / 200.0;
    let brute = |x: f64, y: f64, n: usize| {
        let step = 1.0 / n as f64;
        let at = |i: usize| (i as f64 + 0.5) * step - 0.5;
        let mut sum = 0.0;
        for v in 0..n {
            for u in 0..n {
                let tan = (x + at(u)).hypot(y + at(v)) * tangent;
                let solid = (tangent * step).powi(2) * (1.0 + tan * tan).powf(-1.5);
                sum += solid * point_spread(glare.adaptation, tan.atan().to_degrees(), 550.0);
            }
        }
        sum
    };
    let center = brute(0.0, 0.0, 1000);
    let own = f64::from(kernel.quadrant.at(0, 0)[1]);
    for (x, y, n, bound) in
        [(1, 0, 400, 1e-3), (1, 1, 400, 1e-3), (3, 2, 100, 1e-3), (20, 5, 20, 1e-3), (90, 70, 1, 1e-3)]
    {
        let (got, wanted) =
            (f64::from(kernel.quadrant.at(x, y)[1]) / own, brute(x as f64, y as f64, n) / center);
        assert!((got / wanted - 1.0).abs() < bound, "({x}, {y}): {got:e} instead of {wanted:e}");
    }
    // The part that stays in the pixel: all of f₀ and the inner bloom. A point sample would say 20 times as much.
    let [w0, w1, ..] = mixture(glare.adaptation);
    assert!(own > w0 && own < w0 + w1, "{own} stays");
    assert!(point_spread(glare.adaptation, 0.0, 550.0) * tangent * tangent > 5.0 * own, "case too easy");
}

/// At night a white point gets a ring of 3°, blue inside and red outside.
#[test]
fn the_halo_is_blue_inside_and_red_outside() {
    let kernel = GlareKernel::new([512, 8], &glare(Adaptation::Scotopic)).expect("memory");
    let pixel = (2.0 * 20f64.to_radians().tan() / 512.0).to_degrees();
    let at = |degrees: f64| kernel.quadrant.at((degrees / pixel) as usize, 0);
    let [x, y, z] = at(2.35);
    assert!(z > 1.3 * y && z > 1.3 * x, "inside: {x:e} {y:e} {z:e}");
    let [x, y, z] = at(3.3);
    assert!(x > 1.2 * y && y > 1.3 * z, "outside: {x:e} {y:e} {z:e}");
    assert!(at(2.95)[1] > 2.0 * at(2.0)[1] && at(2.95)[1] > 2.0 * at(4.2)[1], "no ring");
}

/// No value is too large or too strange: the rest of the picture survives it.
#[test]
fn extreme_values_stay_finite() {
    let extent = [33, 17];
    let mut pixels = vec![Vec3::ONE; 33 * 17];
    pixels[100] = Vec3::splat(1e30);
    pixels[101] = Vec3::NAN;
    pixels[300] = Vec3::splat(f32::INFINITY);
    let picture = Grid::from_rows(33, 17, pixels).expect("a picture");
    let got = apply(&picture, &glare(Adaptation::Scotopic));
    assert!(got.pixels().iter().all(|v| v.is_finite()));
    let black = Grid::from_rows(33, 17, vec![Vec3::ZERO; 33 * 17]).expect("a picture");
    assert!(apply(&black, &glare(Adaptation::Scotopic)).pixels().iter().all(|v| *v == Vec3::ZERO));
    let bright = apply(&point(extent, [16, 8], Vec3::splat(1e30)), &glare(Adaptation::Photopic));
    assert!((total(bright.pixels()).y / 1e30 - 1.0).abs() < 1e-5);
}
