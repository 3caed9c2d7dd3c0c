//! Draws the samples a second time: squared deviations of luminance (paper §4.2, step 5; stability.md P2).

use std::sync::Arc;

use crate::client::layout::SplatPush;
use crate::client::pass::images::{Accumulator, Deviations};
use crate::client::pass::splat::{Sprites, sprite_constants, sprite_pipeline};
use crate::client::pass::{fullscreen, texels};
use crate::client::settings::{FilmSpec, VarianceForm};
use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Load, Pipeline, Target};

/// Adds one batch to a stream's sum of squared deviations.
///
/// Reads: the batch's vertices, `batch.means`, old hi and lo. Writes: `batch.variance`, new hi and lo.
pub struct VariancePass {
    splat: Pipeline,
    fold: Pipeline,
}

impl VariancePass {
    /// Compiles the pass for the film's filter and one form.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec, form: VarianceForm) -> Result<Self, GpuError> {
        let [filter, slots] = sprite_constants(spec);
        let paper = u32::from(form == VarianceForm::Paper);
        let frag = ("splat_variance.frag", &[filter, slots, paper][..]);
        let splat = sprite_pipeline(gpu, frag, true, 1, Format::R32F)?;
        let fold = fullscreen(gpu, ("fold_variance.frag", &[slots]), 0, 3, &[Format::R32F; 2])?;
        Ok(Self { splat, fold })
    }

    /// Adds the deviations of `sprites` from `batch.means` to `sums`.
    pub fn record(
        &self,
        cmd: &mut Cmd<'_>,
        sprites: &Sprites<'_>,
        push: &SplatPush,
        batch: &mut Deviations,
        sums: &mut Accumulator,
    ) {
        let cmd = &mut cmd.scope("variance");
        cmd.access(&mut batch.means, Access::Sampled);
        cmd.access(&mut batch.variance, Access::ColorWrite);
        cmd.rendering(&[Target { image: &batch.variance, level: 0, load: Load::Clear }], |cmd| {
            cmd.bind(&self.splat, bytemuck::bytes_of(push), &[texels(&batch.means)]);
            sprites.draw(cmd);
        });
        self.record_fold(cmd, batch, sums);
    }

    fn record_fold(&self, cmd: &mut Cmd<'_>, batch: &mut Deviations, sums: &mut Accumulator) {
        let cmd = &mut cmd.scope("variance fold");
        let mut images = sums.flip();
        for image in &mut images.old {
            cmd.access_levels(image, 0..1, Access::Sampled);
        }
        for image in &mut images.new {
            cmd.access_levels(image, 0..1, Access::ColorWrite);
        }
        cmd.access(&mut batch.variance, Access::Sampled);
        let target = |image| Target { image, level: 0, load: Load::Discard };
        cmd.rendering(&[target(&*images.new[0]), target(&*images.new[1])], |cmd| {
            let read = [texels(images.old[0]), texels(images.old[1]), texels(&batch.variance)];
            cmd.bind(&self.fold, &[], &read);
            cmd.draw_fullscreen();
        });
    }
}
