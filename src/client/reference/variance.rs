//! The reference of `splat_variance`: adds squared deviations of luminance to the variance batch.
//!
//! The paper adds `(Y − Ȳ_new)²`, which is biased low: the first sample of a texel gives 0, "perfectly
//! clean" where least is known. The product `(Y − Ȳ_old)(Y − Ȳ_new)` equals the merge of Chan, Golub and
//! LeVeque (1979) for batches of any size. Luminance is divided by a power of two first.
//!
//! Samples of any weight `w` are averaged by their weights. The variance of such a mean is `Σ w² (Y − Ȳ)² / (Σ w)²`, so that squares are added
//! with `w²`: light that a sample of small weight brings counts as little as it does in the picture.

use std::ops::Range;

use glam::Vec4;

use crate::client::reference::splat::{Band, Sprite, draw};
use crate::client::settings::{SplatFilter, Summation, VarianceForm};

/// Mean luminance of every texel of a band before and after a fold, each as two floats.
///
/// The second float keeps deviations exact where the mean is 10^6 times the deviation.
#[derive(Debug, Default)]
pub struct Means {
    old: Vec<f32>,
    old_rest: Vec<f32>,
    new: Vec<f32>,
    new_rest: Vec<f32>,
}

/// `(sum, weight)` as two floats each → the mean as two floats; `None` without weight.
#[inline]
pub fn two_float_mean(hi: Vec4, lo: Vec4) -> Option<(f32, f32)> {
    if hi.w.is_nan() || hi.w <= 0.0 {
        return None;
    }
    let mean = hi.y / hi.w;
    // The remainder of the sum after subtracting `mean · weight`, exact in f64 as a fused multiply-add would be.
    let left = f64::from(hi.y) - f64::from(mean) * f64::from(hi.w);
    Some((mean, (left as f32 + (lo.y - mean * lo.w)) / hi.w))
}

impl Means {
    /// Resizes to this many texels; unset ones are unspecified.
    pub fn resize(&mut self, texels: usize) {
        for means in [&mut self.old, &mut self.old_rest, &mut self.new, &mut self.new_rest] {
            means.resize(texels, 0.0);
        }
    }

    /// Stores the means of these texels before the fold.
    pub fn set_old(&mut self, texels: Range<usize>, hi: &[Vec4], lo: &[Vec4]) {
        fill(
            &mut self.old[texels.clone()],
            &mut self.old_rest[texels.clone()],
            &hi[texels.clone()],
            &lo[texels],
        );
    }

    /// Stores the means after the fold. If a texel had no samples before, its old mean is set to the new one; if it has none yet, both are
    /// 0, because taps of weight 0 reach such texels and must add 0.
    pub fn set_new(&mut self, texels: Range<usize>, hi: &[Vec4], lo: &[Vec4]) {
        fill(
            &mut self.new[texels.clone()],
            &mut self.new_rest[texels.clone()],
            &hi[texels.clone()],
            &lo[texels.clone()],
        );
        for i in texels {
            if self.new[i].is_nan() {
                self.new[i] = 0.0;
            }
            if self.old[i].is_nan() {
                self.old[i] = self.new[i];
                self.old_rest[i] = self.new_rest[i];
            }
        }
    }
}

/// Means of texels; NaN if the weight is zero.
fn fill(mean: &mut [f32], rest: &mut [f32], hi: &[Vec4], lo: &[Vec4]) {
    for ((mean, rest), (&hi, &lo)) in mean.iter_mut().zip(rest).zip(hi.iter().zip(lo)) {
        (*mean, *rest) = two_float_mean(hi, lo).unwrap_or((f32::NAN, 0.0));
    }
}

/// The parameters of the passes of a batch.
#[derive(Clone, Copy, Debug)]
pub struct VarianceParameters {
    /// Splat filter.
    pub filter: SplatFilter,
    /// The summation of the parts.
    pub sums: Summation,
    /// Product or the paper's form.
    pub form: VarianceForm,
    /// `1/s`, a power of two.
    pub inverse_scale: f32,
    /// Samples that are summed in `f32` before they are folded: a batch divided by
    /// [`FilmSpec::batch_slots`](crate::client::FilmSpec::batch_slots).
    pub samples_per_sum: usize,
}

/// Adds `f·w²·((Y − m₀)/s)·((Y − m₁)/s)` of every sprite (or `f·w²·((Y − m₁)/s)²`) to the band's texels.
pub fn splat_variance(
    p: VarianceParameters,
    band: Band,
    sprites: &[Sprite],
    means: &Means,
    texels: &mut [f32],
) {
    let (first, first_rest) = match p.form {
        VarianceForm::Product => (&means.old, &means.old_rest),
        VarianceForm::Paper => (&means.new, &means.new_rest),
    };
    draw(p.filter, band, sprites, |sprite, at, f| {
        let n = f.len();
        let (m0, r0) = (&first[at..][..n], &first_rest[at..][..n]);
        let (m1, r1) = (&means.new[at..][..n], &means.new_rest[at..][..n]);
        let texels = &mut texels[at..][..n];
        let w = sprite.value.w;
        let y = sprite.value.y / w;
        for i in 0..n {
            let d0 = ((y - m0[i]) - r0[i]) * p.inverse_scale;
            let d1 = ((y - m1[i]) - r1[i]) * p.inverse_scale;
            texels[i] += f[i] * (w * d0) * (w * d1);
        }
    });
}
