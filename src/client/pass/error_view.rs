//! The variance images made visible (the paper's Figure 5, right).

use std::sync::Arc;

use crate::client::layout::ReconstructPush;
use crate::client::lod::StreamLod;
use crate::client::pass::images::StreamImages;
use crate::client::pass::{Variants, fullscreen};
use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Image, Load, Sampler, Target, Texture};

/// Relative standard error of one stream, as grey in place of the picture.
///
/// Reads: all levels of `color` and `variance`. Writes: the picture before the tone curve.
#[derive(Default)]
pub struct ErrorViewPass {
    pipelines: Variants<bool>,
}

impl ErrorViewPass {
    /// Draws stream `i`, 0 the camera's and 1 the light's.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        (i, stream, lod): (usize, &StreamImages, StreamLod),
        mut push: ReconstructPush,
        target: &mut Image,
    ) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(i == 1, || {
            let frag = ("error_view.frag", &[u32::from(i == 1)][..]);
            fullscreen(gpu, frag, size_of::<ReconstructPush>(), 2, &[Format::Rgba32F])
        })?;
        (push.lod[i], push.variance_lod[i]) = (lod.base, lod.variance);
        let all = |image| Texture { image, level: None, sampler: Sampler::Trilinear };
        let read = [all(stream.color.sums()), all(stream.variance_sums())];
        let cmd = &mut cmd.scope("error view");
        cmd.access(target, Access::ColorWrite);
        cmd.rendering(&[Target { image: target, level: 0, load: Load::Discard }], |cmd| {
            cmd.bind(pipeline, bytemuck::bytes_of(&push), &read);
            cmd.draw_fullscreen();
        });
        Ok(())
    }
}
