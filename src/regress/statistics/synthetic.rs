//! Renderings whose expectation and noise are known, for tests.

use crate::image::Grid;
use crate::math::random::Random;
use crate::regress::evidence::Evidence;

/// What can be changed in the synthetic scene; the default is unchanged.
#[derive(Clone, Copy, Debug)]
pub struct SyntheticScene {
    /// Side of the picture in pixels.
    pub side: usize,
    /// Shift of the camera to the right in pixels.
    pub shift: f64,
    /// Shift of the texture in texels.
    pub texel: f64,
    /// Factor of all light.
    pub light: f64,
    /// Factor of the albedo of the disc.
    pub albedo: f64,
}

impl SyntheticScene {
    /// Unchanged, with this side in pixels.
    pub fn new(side: usize) -> Self {
        Self { side, shift: 0.0, texel: 0.0, light: 1.0, albedo: 1.0 }
    }

    /// The picture without noise: a gradient with a texture of texels of 1.7 pixels, a red disc, and a black stripe at the left.
    pub fn expected(&self) -> Grid<[f32; 3]> {
        const TEXEL: f64 = 1.7;
        const STRATA: usize = 4;
        let side = self.side as f64;
        let value = |x: f64, y: f64| -> [f64; 3] {
            let x = x + self.shift;
            let disc = (x - 0.6 * side).hypot(y - 0.5 * side) < 0.25 * side;
            if x < 0.1 * side {
                [0.0; 3]
            } else if disc {
                [0.7 * self.albedo, 0.2, 0.1]
            } else {
                let texel = |v: f64| (v / TEXEL).floor() as i64;
                let hashed = Random((texel(x + TEXEL * self.texel) * 131 + texel(y)) as u64).f64();
                [0.5, 0.45, 0.4].map(|c| c * (0.5 + hashed) * (0.4 + y / side))
            }
        };
        let pixels = (0..self.side * self.side).map(|i| {
            let corner = [i % self.side, i / self.side].map(|v| v as f64);
            let mut sum = [0.0; 3];
            for stratum in 0..STRATA * STRATA {
                let at = [stratum % STRATA, stratum / STRATA].map(|s| (s as f64 + 0.5) / STRATA as f64);
                let add = value(corner[0] + at[0], corner[1] + at[1]);
                sum = std::array::from_fn(|c| sum[c] + add[c]);
            }
            sum.map(|v| (v * self.light / (STRATA * STRATA) as f64) as f32)
        });
        Grid::from_rows(self.side, self.side, pixels.collect()).expect("as many pixels")
    }
}

/// A positive random factor of mean 1.
pub type NoiseFactor = fn(&mut Random) -> f64;

/// Gamma distribution of shape 2: relative error .71.
pub fn gamma(random: &mut Random) -> f64 {
    -0.5 * ((1.0 - random.f64()) * (1.0 - random.f64())).ln()
}

/// Gamma distribution of shape 2, a fiftieth as wide: relative error .014.
pub fn small_gamma(random: &mut Random) -> f64 {
    1.0 + 0.02 * (gamma(random) - 1.0)
}

/// Gamma distribution of shape 2, two thirds as wide. Pixels of [`rendering`] have a relMSE of .031 by it, as those of `scenes/cornell.xml` by
/// path tracing with 16 samples per pixel (`tools/README.md`).
pub fn sixteen_samples(random: &mut Random) -> f64 {
    1.0 + 0.644 * (gamma(random) - 1.0)
}

/// Log-normal distribution whose logarithm has a spread of 1.5: relative error 2.9.
pub fn log_normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    let normal = radius * (std::f64::consts::TAU * random.f64()).cos();
    (1.5 * normal - 0.5 * 1.5 * 1.5).exp()
}

/// Fireflies: one sample in 2000 is a thousand times as bright as the others.
pub fn fireflies(random: &mut Random) -> f64 {
    let factor = if random.below(2000) == 0 { 1000.0 } else { 1.0 };
    factor * gamma(random) / 1.4995
}

/// Few samples on an edge: 0 or 2.
pub fn coin(random: &mut Random) -> f64 {
    if random.below(2) == 0 { 0.0 } else { 2.0 }
}

/// A rendering with this noise, nearly alike in all channels and correlated over 3×3 pixels, as by a splat filter.
pub fn rendering(expected: &Grid<[f32; 3]>, noise: NoiseFactor, random: &mut Random) -> Grid<[f32; 3]> {
    let (width, height) = (expected.width(), expected.height());
    let raw: Vec<[f64; 3]> = expected
        .pixels()
        .iter()
        .map(|rgb| {
            let common = noise(random);
            let own = noise(random);
            let factors = [0.8 * common + 0.2 * own, common, common];
            std::array::from_fn(|c| (factors[c] - 1.0) * f64::from(rgb[c]))
        })
        .collect();
    let mut pixels = expected.clone();
    for y in 0..height {
        for x in 0..width {
            for (dy, row) in [0.25, 0.5, 0.25].into_iter().enumerate() {
                for (dx, column) in [0.25, 0.5, 0.25].into_iter().enumerate() {
                    // Round the border, so that no noise is lost.
                    let from = (y + dy + height - 1) % height * width + (x + dx + width - 1) % width;
                    for (value, add) in pixels.row_mut(y)[x].iter_mut().zip(raw[from]) {
                        *value += (row * column * add) as f32;
                    }
                }
            }
        }
    }
    pixels
}

/// The evidence of `n` renderings.
pub fn evidence(expected: &Grid<[f32; 3]>, n: usize, noise: NoiseFactor, random: &mut Random) -> Evidence {
    let renderings: Vec<_> = (0..n).map(|_| rendering(expected, noise, random)).collect();
    Evidence::of_grids(&renderings.iter().collect::<Vec<_>>()).expect("one size")
}
