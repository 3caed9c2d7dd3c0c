//! The level of detail of a stream: from the number of its samples, then from their variance (paper §4.2).
//!
//! The paper's `LoD' = LoD + Vm·log₄(Var)` takes the absolute variance, so its blur would depend on the
//! exposure and would be −∞ where variance is 0. Here the *relative variance of the mean* steers it, with
//! a prior of two pseudo-samples: scaling every light by a power of two leaves the map bit-identical.

use crate::client::settings::FilmSpec;

/// Lowest LoD: the texel is taken as it is.
pub const MIN_LOD: f32 = -1.0;

/// `r₀`: relative variance of the mean (5 % error, squared) above which noise masking sets in.
pub const TARGET_RELATIVE_VARIANCE: f32 = 0.05 * 0.05;

/// Levels added to the raw LoD where variance and mean are read: an average over 8 samples or more.
pub const VARIANCE_LEVEL_BIAS: f32 = 1.5;

/// Floor of the mean luminance in units of the luminance scale: the error is relative to at least this.
pub const LUMINANCE_FLOOR: f32 = 0.02;

/// Sum of the pseudo-samples' relative variances in the prior `v' = (n·v + 2)/(n + 1)`.
pub const PRIOR_VARIANCE: f32 = 2.0;

/// Weight of the prior in the denominator: two pseudo-samples less Bessel's one.
pub const PRIOR_COUNT: f32 = 1.0;

/// `log₄(x)`.
#[inline]
pub fn log4(x: f32) -> f32 {
    0.5 * x.log2()
}

/// The level of detail of one stream, the same for the whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamLod {
    /// `log₄(P/S)`, unclamped.
    pub raw: f32,
    /// The basic level: `raw` clamped to `[−1, max_level]`.
    pub base: f32,
    /// Level where variance and mean are read.
    pub variance: f32,
    /// Last mip level, 1×1 texels.
    pub max_level: f32,
}

impl StreamLod {
    /// The LoD of a stream with `samples` samples on a film of `texels` padded texels; `None` without samples.
    pub fn new(texels: u64, samples: u64, levels: usize) -> Option<Self> {
        if samples == 0 {
            return None;
        }
        // In f64: counts above 2^24 stay exact, and the reference and the GPU get the same number.
        let raw = (0.5 * (texels as f64 / samples as f64).log2()) as f32;
        let max_level = levels.saturating_sub(1) as f32;
        Some(Self {
            raw,
            base: raw.clamp(MIN_LOD, max_level),
            variance: (raw + VARIANCE_LEVEL_BIAS).clamp(0.0, max_level),
            max_level,
        })
    }

    /// The LoD of a picture with one pixel per `detail` texels and axis: at least the level whose texels are that large, so that the coarse
    /// picture does not alias and shimmer.
    pub fn coarsened(self, detail: u32) -> Self {
        if detail <= 1 {
            return self;
        }
        let base = self.base.max((detail as f32).log2()).min(self.max_level);
        Self { base, variance: self.variance.max(base), ..self }
    }

    /// Whether there are enough samples (four per texel) for noise to be weaker than features, so that bilateral filtering works (paper
    /// §4.2).
    pub fn allows_bilateral(&self) -> bool {
        self.base <= MIN_LOD
    }

    /// `LoD'`: the basic level raised by `vm` per factor 4 of excess relative variance `r` of the mean.
    ///
    /// A mean whose error is as large as itself tells nothing: what is above 1 counts as 1, as does a place without samples. Otherwise the
    /// places that one sample has just touched would be blurred far more than those beside them that none has.
    #[inline]
    pub fn masked(&self, r: f32, vm: f32) -> f32 {
        // The comparison is written so that a NaN in `r` or `vm` leaves the basic level.
        let r = if r > 1.0 { 1.0 } else { r };
        let excess = log4(r / TARGET_RELATIVE_VARIANCE);
        let extra = if excess > 0.0 { vm * excess } else { 0.0 };
        if extra > 0.0 { (self.base + extra).min(self.max_level) } else { self.base }
    }

    /// `r`: relative variance of the mean after the basic blur, of one place of one stream.
    ///
    /// `luminance` and `weight` are the sums ΣfY and Σf read at level [`variance`](Self::variance),
    /// `variance` is the sum of squared deviations in units of `scale²` at the same level, `scale` the
    /// film's luminance scale, `energy` the splat filter's. Without samples there the answer is 1.
    ///
    /// Where the sum itself is shown, the number of samples is random too: the relative variance of a sum of N terms, N of
    /// Poisson's distribution, is (v + 1)/N instead of v/N.
    #[inline]
    pub fn relative_variance(&self, place: &LocalStatistics, scale: f32, energy: f32) -> f32 {
        if place.weight.is_nan() || place.weight <= 0.0 {
            return 1.0;
        }
        let mean = place.luminance / place.weight / scale;
        let v = (place.variance / place.weight) / (mean * mean + LUMINANCE_FLOOR * LUMINANCE_FLOOR);
        let n1 = place.weight / energy;
        let n = n1 * (2.0 * self.variance).exp2();
        let v = (n * v + PRIOR_VARIANCE) / (n + PRIOR_COUNT);
        let v = if place.summed { v + 1.0 } else { v };
        let r = v / (n1 * (2.0 * self.base.max(0.0)).exp2());
        if r.is_nan() { 1.0 } else { r.max(0.0) }
    }
}

/// Mip averages around one position in one stream, all at the same level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalStatistics {
    /// `Σ f Y·w`.
    pub luminance: f32,
    /// `Σ f w`.
    pub weight: f32,
    /// `Σ f w² (Y − Ȳ)²` in units of the squared luminance scale.
    pub variance: f32,
    /// Whether the sum is displayed (light stream), or the mean (camera stream).
    pub summed: bool,
}

/// `2^floor(log₂ x)` for `x > 0`, exact, its exponent held in ±126 so that the inverse is a normal number;
/// 1 when `x` is not positive and finite.
pub fn power_of_two_below(x: f64) -> f32 {
    if !(x > 0.0 && x.is_finite()) {
        return 1.0;
    }
    let exponent = ((x.to_bits() >> 52) as i32 - 1023).clamp(-126, 126);
    f32::from_bits(((exponent + 127) as u32) << 23)
}

/// The level of detail that this many samples allow (paper §4.2); `None` without samples.
pub fn level_of_detail(spec: &FilmSpec, samples: u64) -> Option<f32> {
    let [width, height] = spec.padded_extent().map(f64::from);
    (samples > 0).then(|| 0.5 * (width * height / samples as f64).log2() as f32)
}
