//! Draws the samples a second time and adds up squared deviations of luminance (paper §4.2, step 5). The mean square minus
//! the squared mean would cancel.

use std::sync::Arc;

use crate::client::pass::images::{AccumulatorImages, Deviations};
use crate::client::pass::splat::{Sprites, sprite_constants, sprite_pipeline};
use crate::client::settings::{FilmSpec, VarianceForm};
use crate::gpu::{Access, Cmd, ComputeDesc, ComputePipeline, Gpu, GpuError, Pipeline, TexelFormat, Texture};

/// Adds one batch to a stream's sum of squared deviations.
///
/// Reads: the batch's vertices, `batch.means`. Writes: `batch.variance`. Changes: the stream's sums and rests.
pub struct VariancePass {
    splat: Pipeline,
    fold: ComputePipeline,
}

impl VariancePass {
    /// Compiles the pass for the film's filter and one form.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec, form: VarianceForm) -> Result<Self, GpuError> {
        let [filter, slots] = sprite_constants(spec);
        let frag = ("splat_variance.frag", &[filter, slots, form as u32][..]);
        let splat = sprite_pipeline(gpu, frag, true, 1, TexelFormat::R32F)?;
        let fold = ComputeDesc {
            shader: ("fold_variance.comp", &[slots]),
            push_bytes: 0,
            textures: 0,
            images: &[true; 3],
            layers: 1,
        };
        let fold = ComputePipeline::new(gpu, &fold)?;
        Ok(Self { splat, fold })
    }

    /// Adds the deviations of `sprites` from `batch.means` to a layer of `sums`.
    pub fn record(
        &self,
        cmd: &mut Cmd<'_>,
        layer: u32,
        sprites: &Sprites<'_>,
        batch: &mut Deviations,
        sums: &mut AccumulatorImages,
    ) {
        let cmd = &mut cmd.scope("variance");
        cmd.access(&mut batch.means, Access::Sampled);
        sprites.draw(cmd, &self.splat, &[Texture::texels(&batch.means)], &mut batch.variance);
        sums.fold(&mut cmd.scope("variance fold"), layer, &self.fold, &[], &mut batch.variance, None);
    }
}
