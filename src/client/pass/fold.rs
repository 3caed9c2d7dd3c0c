//! Adds a batch image to the accumulator, as two floats (stability.md P6): fp32 blending alone stands still at 2^24.

use std::sync::Arc;

use crate::client::layout::FoldPush;
use crate::client::pass::images::{Accumulator, BatchImages, Deviations};
use crate::client::pass::{fullscreen, texels};
use crate::client::settings::{FilmSpec, Summation};
use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Load, Pipeline, Target};

/// Folds the colour of a batch.
///
/// Reads: old hi and lo, `batch.color`. Writes: new hi and lo, and the means if there is a variance to be made of them.
pub struct FoldPass {
    pipeline: Pipeline,
}

impl FoldPass {
    /// Compiles the pass.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, GpuError> {
        let means = spec.variance.is_some();
        let (shader, floats) = match spec.sums {
            Summation::TwoFloat => ("fold.frag", 2),
            Summation::Plain => ("fold_plain.frag", 1),
        };
        let targets = &[Format::Rgba32F; 3][..floats + usize::from(means)];
        let constants = [spec.batch_slots(), u32::from(means)];
        let pipeline =
            fullscreen(gpu, (shader, &constants), size_of::<FoldPush>(), floats as u32 + 1, targets)?;
        Ok(Self { pipeline })
    }

    /// Adds `batch.color` to `sums`; both the old and the new sums are there afterwards.
    pub fn record(
        &self,
        cmd: &mut Cmd<'_>,
        sums: &mut Accumulator,
        batch: &mut BatchImages,
        push: &FoldPush,
    ) {
        let cmd = &mut cmd.scope("fold");
        let mut images = sums.flip();
        for image in &mut images.old {
            cmd.access_levels(image, 0..1, Access::Sampled);
        }
        for image in &mut images.new {
            cmd.access_levels(image, 0..1, Access::ColorWrite);
        }
        cmd.access(&mut batch.color, Access::Sampled);
        if let Some(Deviations { means, .. }) = &mut batch.deviations {
            cmd.access(means, Access::ColorWrite);
        }
        let target = |image| Target { image, level: 0, load: Load::Discard };
        let mut targets: Vec<_> = images.new.iter().map(|image| target(&**image)).collect();
        targets.extend(batch.deviations.as_ref().map(|d| target(&d.means)));
        cmd.rendering(&targets, |cmd| {
            let mut read: Vec<_> = images.old.iter().map(|image| texels(image)).collect();
            read.push(texels(&batch.color));
            cmd.bind(&self.pipeline, bytemuck::bytes_of(push), &read);
            cmd.draw_fullscreen();
        });
    }
}
