//! Averages of the sums down to 1×1 (paper §4.2, steps 3 and 6).

use std::sync::Arc;

use crate::client::layout::DownsamplePush;
use crate::client::pass::images::{AccumulatorImages, StreamImages};
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::gpu::{Access, Attachment, Cmd, Gpu, GpuError, LoadOp, TexelFormat, Texture};

/// Builds mip levels of a stream's sums, and of its variance if noise is masked.
///
/// Reads and writes: the levels of `stream.color`, and of `stream.variance` if asked for.
pub struct MipsPass {
    /// Constants: number of inputs per output along both axes, and whether there is a variance.
    pipelines: ShaderVariants,
}

impl MipsPass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        Self {
            pipelines: ShaderVariants::new(gpu, "downsample.frag", size_of::<DownsamplePush>(), 2)
                .compiled(policy),
        }
    }

    /// Makes levels `0 .. levels` of the colour readable, and of the variance if `variance`, which the film must then accumulate.
    ///
    /// Levels that are up to date are not rebuilt; level 0 must hold the sums.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        stream: &mut StreamImages,
        levels: u32,
        variance: bool,
    ) -> Result<(), GpuError> {
        let cmd = &mut cmd.scope("mips");
        debug_assert!(stream.mips.color.min(stream.mips.variance) > 0, "sums that were never written");
        let first = if variance { stream.mips.color.min(stream.mips.variance) } else { stream.mips.color };
        let mut images = vec![stream.color.sums_mut()];
        images.extend(stream.variance.as_mut().filter(|_| variance).map(AccumulatorImages::sums_mut));
        for level in first.max(1)..levels {
            let source = images[0].extent(level - 1);
            let [across, down] = source.map(taps);
            let formats = &[TexelFormat::Rgba32F, TexelFormat::R32F][..1 + usize::from(variance)];
            let pipeline = self.pipelines.get(&[across, down, u32::from(variance)], formats)?;
            for image in &mut images {
                cmd.access_levels(image, level - 1..level, Access::Sampled);
                cmd.access_levels(image, level..level + 1, Access::ColorWrite);
            }
            let attachment = |image| Attachment { image, level, load: LoadOp::Discard };
            let attachments: Vec<_> = images.iter().map(|image| attachment(&**image)).collect();
            // Without variance its binding repeats the colour, because every binding must be bound to an image.
            let textures = [0, images.len() - 1].map(|i| Texture::level(&*images[i], level - 1));
            let push = DownsamplePush { source: source.map(|n| n as i32) };
            cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &attachments);
        }
        for image in images {
            cmd.access(image, Access::Sampled);
        }
        let done = levels.max(first);
        stream.mips.color = stream.mips.color.max(done);
        if variance && stream.variance.is_some() {
            stream.mips.variance = stream.mips.variance.max(done);
        }
        Ok(())
    }
}

/// Number of inputs of one output along an axis of `n` texels.
pub fn taps(n: u32) -> u32 {
    match n {
        1 => 1,
        n => 2 + n % 2,
    }
}
