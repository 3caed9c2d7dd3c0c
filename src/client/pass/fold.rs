//! Adds a batch image to the accumulator, as two floats: a sum of one `f32` stands still at 2^24 unit weights.

use std::sync::Arc;

use crate::client::layout::FoldPush;
use crate::client::pass::images::{AccumulatorImages, BatchImages};
use crate::client::settings::{FilmSpec, Summation};
use crate::gpu::{Cmd, ComputeDesc, ComputePipeline, Gpu, GpuError};

/// Folds the colour of a batch.
///
/// Reads: `batch.color`. Changes: the stream's sums and rests. Writes: the means, if there is a variance to be made of them.
pub struct FoldPass {
    pipeline: ComputePipeline,
}

impl FoldPass {
    /// Compiles the pass.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, GpuError> {
        let two_float = spec.sums == Summation::TwoFloat;
        let constants = [spec.batch_slots(), spec.variance.is_some().into(), two_float.into()];
        let desc = ComputeDesc {
            shader: ("fold.comp", &constants),
            push_bytes: size_of::<FoldPush>(),
            textures: 0,
            images: &[true; 4],
            layers: 1,
        };
        Ok(Self { pipeline: ComputePipeline::new(gpu, &desc)? })
    }

    /// Adds `batch.color` to a layer of `sums`.
    pub fn record(
        &self,
        cmd: &mut Cmd<'_>,
        layer: u32,
        sums: &mut AccumulatorImages,
        batch: &mut BatchImages,
        push: &FoldPush,
    ) {
        let means = batch.deviations.as_mut().map(|deviations| &mut deviations.means);
        let cmd = &mut cmd.scope("fold");
        sums.fold(cmd, layer, &self.pipeline, bytemuck::bytes_of(push), &mut batch.color, means);
    }
}
