//! The splat filter: how far a sample reaches and with which weights (paper §4.2).
//!
//! Every constant of filters that the Vulkan passes and their references share stands here or in
//! [`lod`](crate::client::lod). Weights are computed with arithmetic, never with hardware bilinear
//! filtering, whose fractions have 8 bits on common devices.

use crate::client::settings::{CHUNK_SAMPLES, FilmSpec, ScaledFilter, SplatFilter};
use crate::stream::{Sample, UvWindow};

/// The paper's 5-texel filter row at distances 0, 1, 2 and the zero border at 3, in texels.
///
/// `g_i ∝ exp(−i²)·(1 − smoothstep(0, 3, |i|)^8)`, normalised so that `g₀ + 2g₁ + 2g₂ = 1`.
/// Between these distances the weight is linear: exactly the bilinear fetch of the paper's texture.
pub const GAUSSIAN_TAPS: [f32; 4] = [0.565_273_6, 0.207_948_3, 0.009_414_898, 0.0];

/// The Gaussian with σ = 1 truncated at 4σ: the constant subtracted so that it ends at 0, the remaining area, and the integral of the
/// square over the square of the area.
const GAUSSIAN_END: f32 = 3.354_626_3e-4;
const GAUSSIAN_AREA: f32 = 2.503_785_8;
const GAUSSIAN_SQUARES: f32 = 0.282_467_4;

/// Most texels that one sample reaches along one axis: the 5-tap row read bilinearly spans 6.
pub const MAX_TAPS: usize = 6;

/// Truncation radius `R` of the reconstruction Gaussian, in texels of the mip level (paper §4.3).
pub const RECONSTRUCTION_RADIUS: f32 = 2.5;

/// Threshold `t` of the reconstruction: the smallest `σ` summed on a level before the next is used (paper §4.3).
pub const RECONSTRUCTION_THRESHOLD: f32 = 1.0;

/// Largest film extent along one axis, in texels with padding: what every Vulkan 1.3 desktop driver offers.
pub const MAX_EXTENT: u32 = 16_384;

/// Additions to one `f32` before it is folded into the two-float sums, on average over the film.
///
/// Every addition rounds, and equal samples round alike: 64 additions of 0.1 are off by up to 6e-7 of the sum, 256 by
/// 2.4e-6, 1024 by 1e-5, 65,536 by 6e-4 (samples that differ round at random, and the error grows as the root). Where a batch
/// falls into few texels of a large film its samples are [merged](crate::client::dense_cells).
pub const ADDS_PER_SUM: u64 = 64;

/// True for samples that keep the rules of the stream: all numbers finite, none above
/// [`MAX_VALUE`](crate::stream::MAX_VALUE), and a weight that names a stream.
///
/// A guard only: the stream's sink keeps others out and counts them by cause; what reaches a film in another way
/// is dropped as it is copied to the batch, before it is counted.
pub fn accepts(sample: &Sample) -> bool {
    sample.uv[0].is_finite() && sample.uv[1].is_finite() && sample.is_sound() && sample.w != 0.0
}

/// The texels of one axis that a sample reaches, and the weight in each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taps {
    /// First texel; may be negative or reach past the last texel, the caller clips.
    pub first: i32,
    /// Weights of texels `first ..`; unused places are 0.
    pub weights: [f32; MAX_TAPS],
}

impl SplatFilter {
    /// Texels of padding on every side that keep every texel of the picture fully fed.
    pub const fn pad(self) -> u32 {
        match self {
            SplatFilter::Gaussian | SplatFilter::Scaled(_) => 3,
            SplatFilter::Tent => 1,
            SplatFilter::Box => 0,
        }
    }

    /// Texels that a sample reaches along one axis.
    pub const fn taps_per_axis(self) -> usize {
        match self {
            SplatFilter::Gaussian | SplatFilter::Scaled(_) => 6,
            SplatFilter::Tent => 2,
            SplatFilter::Box => 1,
        }
    }

    /// One-dimensional weight at signed distance `d` (texel centre minus sample) in texels.
    ///
    /// The weight of texel `t` is the product of both axes. For `Box` the half-open interval
    /// `−0.5 < d ≤ 0.5` belongs to the texel, which is `floor` of the position.
    pub fn weight(self, d: f32) -> f32 {
        let a = d.abs();
        match self {
            SplatFilter::Gaussian if a < 3.0 => {
                let i = a as usize;
                let t = a - i as f32;
                GAUSSIAN_TAPS[i] + t * (GAUSSIAN_TAPS[i + 1] - GAUSSIAN_TAPS[i])
            }
            SplatFilter::Gaussian => 0.0,
            SplatFilter::Tent => (1.0 - a).max(0.0),
            SplatFilter::Box => f32::from(d > -0.5 && d <= 0.5),
            SplatFilter::Scaled(filter) => {
                let size = filter.size();
                let s = a / size;
                let weight = match filter {
                    ScaledFilter::Gaussian { .. } => ((-0.5 * s * s).exp() - GAUSSIAN_END) / GAUSSIAN_AREA,
                    ScaledFilter::Tent { .. } => 1.0 - s,
                };
                weight.max(0.0) / size
            }
        }
    }

    /// Texels and weights along one axis for a sample at `p ≥ 0` (padded texels).
    ///
    /// The weights are linear in the sub-texel position and sum to 1 for every `p` within rounding; those of a scaled filter do so on
    /// average over `p`.
    #[inline]
    pub fn taps(self, p: f32) -> Taps {
        let texel = p as i32;
        let inside = p - texel as f32; // exact
        if self == SplatFilter::Box {
            return Taps { first: texel, weights: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0] };
        }
        // `base` is the last texel whose centre is not right of the sample, `t` the distance to its centre.
        let (base, t) = if inside >= 0.5 { (texel, inside - 0.5) } else { (texel - 1, inside + 0.5) };
        if self == SplatFilter::Tent {
            return Taps { first: base, weights: [1.0 - t, t, 0.0, 0.0, 0.0, 0.0] };
        }
        if let SplatFilter::Scaled(_) = self {
            return self.scaled_taps(base - 2, t);
        }
        let [g0, g1, g2, _] = GAUSSIAN_TAPS;
        let weights = [
            g2 - t * g2,
            g1 + t * (g2 - g1),
            g0 + t * (g1 - g0),
            g1 + t * (g0 - g1),
            g2 + t * (g1 - g2),
            t * g2,
        ];
        Taps { first: base - 2, weights }
    }

    /// Not inlined: few pictures need it, and [`taps`](Self::taps) stays small.
    #[inline(never)]
    fn scaled_taps(self, first: i32, t: f32) -> Taps {
        Taps { first, weights: std::array::from_fn(|k| self.weight(k as f32 - 2.0 - t)) }
    }

    /// `c`: mean over sub-texel positions of `Σ f²` over texels in two dimensions; `W/c` is the effective
    /// number of samples in a texel. 1 for `Box`.
    pub fn energy(self) -> f32 {
        let per_axis = match self {
            SplatFilter::Gaussian => {
                // The mean square of a line from u to v is (u² + uv + v²)/3; both flanks are alike.
                let line = |u: f32, v: f32| (u * u + u * v + v * v) / 3.0;
                2.0 * GAUSSIAN_TAPS.windows(2).map(|g| line(g[0], g[1])).sum::<f32>()
            }
            SplatFilter::Tent => 2.0 / 3.0,
            SplatFilter::Box => 1.0,
            SplatFilter::Scaled(filter) => {
                let squares = match filter {
                    ScaledFilter::Gaussian { .. } => GAUSSIAN_SQUARES,
                    ScaledFilter::Tent { .. } => 2.0 / 3.0,
                };
                squares / filter.size()
            }
        };
        per_axis * per_axis
    }

    /// Encoding for the shaders: the kind, and in the bits from 8 on the size of a scaled filter.
    pub fn constant(self) -> u32 {
        match self {
            SplatFilter::Gaussian => 0,
            SplatFilter::Tent => 1,
            SplatFilter::Box => 2,
            SplatFilter::Scaled(ScaledFilter::Gaussian { stddev }) => 3 | u32::from(stddev) << 8,
            SplatFilter::Scaled(ScaledFilter::Tent { radius }) => 4 | u32::from(radius) << 8,
        }
    }
}

impl ScaledFilter {
    /// Standard deviation or radius, texels.
    pub fn size(self) -> f32 {
        let (ScaledFilter::Gaussian { stddev: size } | ScaledFilter::Tent { radius: size }) = self;
        f32::from(size) * 1e-3
    }
}

impl FilmSpec {
    /// Texels of padding on every side of the picture.
    pub const fn pad(&self) -> u32 {
        self.filter.pad()
    }

    /// Width and height of the padded targets in texels.
    pub const fn padded_extent(&self) -> [u32; 2] {
        [self.width + 2 * self.pad(), self.height + 2 * self.pad()]
    }

    /// Number of samples of a full batch: half a sample per texel, in whole chunks, from 1 to 64 of them. A fold reads and writes all
    /// texels however many samples it adds. At that density no texel gets more additions in `f32` than one of a film of 360².
    pub const fn batch_capacity(&self) -> usize {
        const MOST_CHUNKS: usize = 64;
        let [width, height] = self.padded_extent();
        let chunks = width as usize * height as usize / (2 * CHUNK_SAMPLES);
        CHUNK_SAMPLES
            * match chunks {
                0 => 1,
                1..MOST_CHUNKS => chunks,
                _ => MOST_CHUNKS,
            }
    }

    /// Copies of the padded target among which the samples of a batch are dealt, so that the plain `f32` sum of one
    /// texel takes no more than about [`ADDS_PER_SUM`] of them when they cover the film evenly; 1 from about 190² on.
    pub const fn batch_slots(&self) -> u32 {
        let [width, height] = self.padded_extent();
        let taps = self.filter.taps_per_axis();
        let adds = self.batch_capacity() as u64 * (taps * taps) as u64;
        adds.div_ceil(ADDS_PER_SUM * width as u64 * height as u64) as u32
    }

    /// Position in padded texels of a screen position; texel (i, j) has its centre at (i + 0.5, j + 0.5).
    #[inline]
    pub fn texel_position(&self, uv: [f32; 2]) -> [f32; 2] {
        let pad = self.pad() as f32;
        [uv[0] * self.width as f32 + pad, uv[1] * self.height as f32 + pad]
    }

    /// Whether a position in padded texels lies on the padded target; false for NaN.
    #[inline]
    pub fn holds(&self, p: [f32; 2]) -> bool {
        let [width, height] = self.padded_extent().map(|n| n as f32);
        p[0] >= 0.0 && p[1] >= 0.0 && p[0] < width && p[1] < height
    }

    /// The part of the screen that samples must cover so that no padded texel lacks any (paper §3.1).
    pub fn window(&self) -> UvWindow {
        let (u, v) = (self.pad() as f32 / self.width as f32, self.pad() as f32 / self.height as f32);
        UvWindow { min: [-u, -v], max: [1.0 + u, 1.0 + v] }
    }

    /// Fraction of the samples over the widest filter's window that lies within the picture.
    pub fn coverage(&self) -> f64 {
        let UvWindow { min, max } = Self { filter: SplatFilter::Gaussian, ..*self }.window();
        1.0 / (0..2).map(|i| f64::from(max[i] - min[i])).product::<f64>()
    }
}
