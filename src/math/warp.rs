//! Warps: maps from the unit square, each with its density. All are continuous or nearly so, which preserves the low
//! discrepancy of the samples.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

/// Sine and cosine of an angle in [−π/4, π/4] by their series; error below 4e-8.
#[inline]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin =
        x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0)))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    (sin, cos)
}

/// Unit square to unit disk, uniform by area: the concentric map (Shirley and Chiu, *A Low Distortion Map Between Disk and Square*, JGT 2(3), 1997).
#[inline]
pub fn disk(u: [f32; 2]) -> Vec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    let wide = a.abs() > b.abs();
    let (r, other) = if wide { (a, b) } else { (b, a) };
    if r == 0.0 {
        return Vec2::ZERO;
    }
    let (sin, cos) = sin_cos_octant(FRAC_PI_4 * (other / r));
    if wide { Vec2::new(r * cos, r * sin) } else { Vec2::new(r * sin, r * cos) }
}

/// Unit square to the upper unit hemisphere, with density cos θ / π.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = disk(u);
    // Keeps directions of points on the rim above the horizon.
    let z = (1.0 - d.length_squared()).max(1e-12).sqrt();
    Vec3::new(d.x, d.y, z)
}

/// Density of [`cosine_hemisphere`] per steradian, zero below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Unit square to the cone around +z with `1 − cos θ ≤ one_minus_cos_max`, uniform by solid angle. The parameter is 1 − cos
/// instead of cos to represent cones of 1e-8 rad.
#[inline]
pub fn cone(u: [f32; 2], one_minus_cos_max: f32) -> Vec3 {
    let d = disk(u);
    // The squared radius in the disk is uniform, as is 1 − cos θ.
    let r2 = d.length_squared();
    if r2 == 0.0 {
        return Vec3::Z;
    }
    let h = r2 * one_minus_cos_max; // 1 − cos θ
    let sin_over_r = (one_minus_cos_max * (2.0 - h)).max(0.0).sqrt();
    Vec3::new(d.x * sin_over_r, d.y * sin_over_r, 1.0 - h)
}

/// Density of [`cone`] per steradian.
#[inline]
pub fn cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (TAU * one_minus_cos_max)
}

/// Unit square to the unit sphere, with density 1 / 4π.
#[inline]
pub fn sphere(u: [f32; 2]) -> Vec3 {
    cone(u, 2.0)
}

/// Density of [`sphere`] per steradian.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Unit square to barycentric weights of two vertices of a triangle, uniform by area (Heitz, *A Low-Distortion Map Between Triangle and Square*, 2019).
#[inline]
pub fn triangle(u: [f32; 2]) -> (f32, f32) {
    if u[0] < u[1] {
        let half = 0.5 * u[0];
        (half, u[1] - half)
    } else {
        let half = 0.5 * u[1];
        (u[0] - half, half)
    }
}

/// [0, 1) to [0, 1], with a density proportional to the linear function from `a` at 0 to `b` at 1. Neither may be negative or
/// above 1e18, and one at least 1e-18: they are squared.
#[inline]
pub fn linear(u: f32, a: f32, b: f32) -> f32 {
    // The solution of the quadratic equation in the form without cancellation for a = b.
    let root = (a * a + u * (b * b - a * a)).max(0.0).sqrt();
    (u * (a + b) / (a + root).max(f32::MIN_POSITIVE)).min(1.0)
}

/// Unit square to itself, with the density [`bilinear_pdf`] of the same corner values, in the range of [`linear`].
#[inline]
pub fn bilinear(u: [f32; 2], corners: [[f32; 2]; 2]) -> [f32; 2] {
    let [[a, b], [c, d]] = corners;
    let y = linear(u[1], a + b, c + d);
    [linear(u[0], a + (c - a) * y, b + (d - b) * y), y]
}

/// Density of [`bilinear`] at `p`: bilinear between the values `corners[y][x]`, which must not be negative nor all 0.
#[inline]
pub fn bilinear_pdf(p: [f32; 2], corners: [[f32; 2]; 2]) -> f32 {
    let [[a, b], [c, d]] = corners;
    let (top, bottom) = (a + (b - a) * p[0], c + (d - c) * p[0]);
    4.0 * (top + (bottom - top) * p[1]) / (a + b + c + d)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular grid of 256² points of the unit square.
    fn grid() -> impl Iterator<Item = [f32; 2]> {
        (0..65_536).map(|i| [((i % 256) as f32 + 0.5) / 256.0, ((i / 256) as f32 + 0.5) / 256.0])
    }

    #[test]
    fn disk_and_hemisphere_have_their_moments() {
        let n = 65_536.0;
        let r2: f64 = grid().map(|u| f64::from(disk(u).length_squared())).sum::<f64>() / n;
        assert!((r2 - 0.5).abs() < 1e-4, "mean of r² on a uniform disk is 1/2, not {r2}");
        let cos: f64 = grid().map(|u| f64::from(cosine_hemisphere(u).z)).sum::<f64>() / n;
        assert!((cos - 2.0 / 3.0).abs() < 1e-3, "mean cosine is 2/3, not {cos}");
        for u in [[0.0, 0.0], [0.5, 0.5], [0.0, 0.999_999_94], [0.999_999_94, 0.999_999_94]] {
            let w = cosine_hemisphere(u);
            assert!(w.z > 0.0 && (w.length() - 1.0).abs() < 1e-6, "{u:?} → {w}");
        }
    }

    #[test]
    fn the_octant_series_is_exact_enough() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (s, c) = sin_cos_octant(x);
            assert!((f64::from(s) - f64::from(x).sin()).abs() < 1e-7);
            assert!((f64::from(c) - f64::from(x).cos()).abs() < 1e-7);
        }
    }

    /// Half of a uniform cone lies within half of its 1 − cos; the naive map by cos θ collapses to the axis.
    #[test]
    fn narrow_cones_stay_cones() {
        for h in [1e-16f32, 1e-10, 1e-3, 1.0, 2.0] {
            let inner = grid().filter(|&u| {
                let w = cone(u, h);
                let sin2 = w.x * w.x + w.y * w.y;
                // sin² = h(2 − h) at 1 − cos = h; here at half of it.
                if h <= 1.0 { sin2 <= 0.5 * h * (2.0 - 0.5 * h) } else { w.z >= 1.0 - 0.5 * h }
            });
            let share = inner.count() as f32 / 65_536.0;
            assert!((share - 0.5).abs() < 0.01, "1 − cos = {h}: {share}");
        }
        let naive_cos = 1.0f32 - 0.5 * 1e-16;
        assert_eq!(1.0 - naive_cos * naive_cos, 0.0, "the case is too easy");
    }

    /// In each of 8² boxes lie as many points as the density says.
    #[test]
    fn bilinear_points_have_their_density() {
        for corners in [[[1.0, 1.0], [1.0, 1.0]], [[0.0, 1.0], [3.0, 0.5]], [[0.0, 0.0], [0.0, 2.0]]] {
            let mut counts = [[0f32; 8]; 8];
            for u in grid() {
                let p = bilinear(u, corners);
                assert!(p.iter().all(|v| (0.0..=1.0).contains(v)), "{p:?}");
                counts[((p[1] * 8.0) as usize).min(7)][((p[0] * 8.0) as usize).min(7)] += 1.0;
            }
            for (y, row) in counts.iter().enumerate() {
                for (x, count) in row.iter().enumerate() {
                    let middle = [(x as f32 + 0.5) / 8.0, (y as f32 + 0.5) / 8.0];
                    let expected = bilinear_pdf(middle, corners) * 1024.0;
                    assert!((count - expected).abs() < 48.0, "{corners:?} {x} {y}: {count}, {expected}");
                }
            }
        }
    }

    #[test]
    fn triangle_weights_are_uniform() {
        let (mut a, mut b, mut ab) = (0f64, 0f64, 0f64);
        for u in grid() {
            let (x, y) = triangle(u);
            assert!(x >= 0.0 && y >= 0.0 && x + y <= 1.0 + 1e-6);
            a += f64::from(x) / 65_536.0;
            b += f64::from(y) / 65_536.0;
            ab += f64::from(x * y) / 65_536.0;
        }
        assert!(
            (a - 1.0 / 3.0).abs() < 1e-3 && (b - 1.0 / 3.0).abs() < 1e-3 && (ab - 1.0 / 12.0).abs() < 1e-3
        );
    }
}
