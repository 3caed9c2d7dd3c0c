//! The Gaussian of the reconstruction with any radius and window (paper §4.3): what the usual one is compared with.

use glam::Vec4;

use crate::client::settings::ReconstructionKernel;
use crate::image::Grid;

/// `Σ g w T / Σ g w` of one level at `p`, in texels of that level, over the `2R × 2R` texels around it; texels outside do not
/// count. The same as [`gaussian`](super::kernel::gaussian) for R = 2.5 and E = 8.
pub fn truncated(kernel: ReconstructionKernel, level: &Grid<Vec4>, p: [f32; 2], sigma: f32) -> Vec4 {
    let radius = kernel.radius();
    let first = p.map(|p| (p - radius - 0.5).ceil() as i32);
    let (mut sum, mut total) = (Vec4::ZERO, 0.0);
    let taps = |first: i32, size: usize| {
        let inside = first.max(0)..(first + kernel.taps as i32).min(size as i32);
        inside.map(|i| i as usize)
    };
    for y in taps(first[1], level.height()) {
        let dy = y as f32 + 0.5 - p[1];
        for x in taps(first[0], level.width()) {
            let dx = x as f32 + 0.5 - p[0];
            let weight = weight(kernel, dx * dx + dy * dy, sigma);
            sum += level.at(x, y) * weight;
            total += weight;
        }
    }
    sum / total
}

/// `exp(−σd²)` times the window at the squared distance `d2`.
fn weight(kernel: ReconstructionKernel, d2: f32, sigma: f32) -> f32 {
    let gaussian = (-sigma * d2).exp();
    if kernel.exponent == 0 {
        return gaussian;
    }
    let t = (d2.sqrt() / kernel.radius()).min(1.0);
    let step = t * t * (3.0 - 2.0 * t);
    gaussian * (1.0 - step.powi(kernel.exponent as i32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::reference::kernel::gaussian;

    fn noise() -> Grid<Vec4> {
        let texel = |i: u32| Vec4::splat((i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0);
        Grid::from_rows(12, 9, (0..108).map(texel).collect()).expect("12×9 texels")
    }

    /// Also at the corners, where taps are left out.
    #[test]
    fn the_paper_s_kernel_is_one_of_them() {
        let level = noise();
        for i in 0..300 {
            let p = [(i % 20) as f32 * 0.63, (i / 20) as f32 * 0.64];
            for sigma in [1.0, 2.5, 3.9] {
                let (a, b) = (
                    truncated(ReconstructionKernel::default(), &level, p, sigma),
                    gaussian(&level, p, sigma),
                );
                assert!((a - b).abs().max_element() < 1e-6, "{p:?} σ {sigma}: {a} {b}");
            }
        }
    }

    #[test]
    fn small_ones_see_less() {
        let level = noise();
        let p = [6.5, 4.5];
        let at = |taps, exponent| truncated(ReconstructionKernel { taps, exponent }, &level, p, 1.0).x;
        let middle = level.at(6, 4).x;
        assert!((at(3, 0) - middle).abs() > 1e-3 && (at(3, 0) - at(5, 0)).abs() > 1e-4);
        // A window that closes early: hardly more than the texel itself.
        assert!((at(3, 1) - middle).abs() < (at(3, 0) - middle).abs());
        // Beyond 2.5 texels a Gaussian of σ = 1 has nothing left.
        assert!((at(8, 0) - at(7, 0)).abs() < 1e-4);
    }
}
