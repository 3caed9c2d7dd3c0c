//! Adds a batch image to the accumulator, as two floats: a sum of one `f32` stands still at 2^24 unit weights.

use std::sync::Arc;

use crate::client::layout::FoldPush;
use crate::client::pass::fullscreen;
use crate::client::pass::images::{AccumulatorImages, BatchImages};
use crate::client::settings::{FilmSpec, Summation};
use crate::gpu::{Cmd, Gpu, GpuError, Pipeline, TexelFormat};

/// Folds the colour of a batch.
///
/// Reads: old hi and lo, `batch.color`. Writes: new hi and lo, and the means if there is a variance to be made of them.
pub struct FoldPass {
    pipeline: Pipeline,
}

impl FoldPass {
    /// Compiles the pass.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, GpuError> {
        let means = spec.variance.is_some();
        let (shader, floats) = match spec.sums {
            Summation::TwoFloat => ("fold.frag", 2),
            Summation::Plain => ("fold_plain.frag", 1),
        };
        let formats = &[TexelFormat::Rgba32F; 3][..floats + usize::from(means)];
        let frag = (shader, &[spec.batch_slots(), u32::from(means)][..]);
        Ok(Self { pipeline: fullscreen(gpu, frag, size_of::<FoldPush>(), floats as u32 + 1, formats)? })
    }

    /// Adds `batch.color` to `sums`; both the old and the new sums are there afterwards.
    pub fn record(
        &self,
        cmd: &mut Cmd<'_>,
        sums: &mut AccumulatorImages,
        batch: &mut BatchImages,
        push: &FoldPush,
    ) {
        let means = batch.deviations.as_mut().map(|deviations| &mut deviations.means);
        let cmd = &mut cmd.scope("fold");
        sums.fold(cmd, &self.pipeline, bytemuck::bytes_of(push), &mut batch.color, means);
    }
}
