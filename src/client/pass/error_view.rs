//! Shows the variance images (the paper's Figure 5, right).

use std::sync::Arc;

use crate::client::layout::ReconstructPush;
use crate::client::lod::StreamLod;
use crate::client::pass::images::StreamImages;
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::gpu::{Access, Attachment, Cmd, Gpu, GpuError, Image, TexelFormat, Texture};

/// Relative standard error of one stream, as grey in place of the picture.
///
/// Reads: all levels of `color` and `variance`. Writes: the picture before the tone curve.
pub struct ErrorViewPass {
    pipelines: ShaderVariants,
}

impl ErrorViewPass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        Self {
            pipelines: ShaderVariants::new(gpu, "error_view.frag", size_of::<ReconstructPush>(), 2)
                .compiled(policy),
        }
    }

    /// Draws the error of a stream; `summed` for the light stream. `push` is that of the reconstruction, except for the levels of detail.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        stream: &StreamImages,
        lod: StreamLod,
        summed: bool,
        mut push: ReconstructPush,
        target: &mut Image,
    ) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(&[u32::from(summed)], &[TexelFormat::Rgba32F])?;
        let i = usize::from(summed);
        (push.lod[i], push.variance_lod[i]) = (lod.base, lod.variance);
        let textures = [stream.color.sums(), stream.variance_sums()].map(Texture::all_levels);
        let cmd = &mut cmd.scope("error view");
        cmd.access(target, Access::ColorWrite);
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[Attachment::whole(target)]);
        Ok(())
    }
}
