//! Noise masking by bilateral filtering guided by the variance (paper §4.2).

use std::sync::Arc;

use crate::client::layout::BilateralPush;
use crate::client::pass::images::StreamImages;
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::client::reference::bilateral::STAGES;
use crate::gpu::{Access, Attachment, Cmd, Gpu, GpuError, Image, ImageDesc, TexelFormat, Texture};

/// Averages the sums of a stream over neighbours whose difference the variance explains, in three stages.
///
/// Reads: all levels of `color` and `variance` of the stream. Writes: images of its own, of level 0's extent.
pub struct BilateralPass {
    gpu: Arc<Gpu>,
    /// Constants: whether the stream is summed.
    errors: ShaderVariants,
    /// Constants: whether the stream is summed, and the stage.
    stages: ShaderVariants,
    /// Images of camera and light stream, created on first use.
    images: [Option<BilateralImages>; 2],
}

/// Sums and squared errors, double-buffered: each stage reads one pair and writes the other.
struct BilateralImages {
    sums: [Image; 2],
    errors: [Image; 2],
}

impl BilateralImages {
    /// Images of the extent and the layers of these sums.
    fn like(gpu: &Arc<Gpu>, sums: &Image) -> Result<Self, GpuError> {
        let image = |name, format| {
            Image::of(gpu, name, ImageDesc::new(format, sums.extent(0)).layered(sums.layers()))
        };
        let sums = |name| image(name, TexelFormat::Rgba32F);
        let errors = |name| image(name, TexelFormat::R32F);
        Ok(Self {
            sums: [sums("bilateral sums 0")?, sums("bilateral sums 1")?],
            errors: [errors("bilateral errors 0")?, errors("bilateral errors 1")?],
        })
    }
}

/// Index of the pair that the last stage writes.
const RESULT: usize = STAGES as usize % 2;

impl BilateralPass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let push_bytes = size_of::<BilateralPush>();
        Self {
            gpu: gpu.clone(),
            errors: ShaderVariants::new(gpu, "bilateral_error.frag", push_bytes, 2).compiled(policy),
            stages: ShaderVariants::new(gpu, "bilateral.frag", push_bytes, 4).compiled(policy),
            images: [None, None],
        }
    }

    /// Filters a stream; `summed` for the light stream. [`filtered`](Self::filtered) is the result.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        stream: &StreamImages,
        summed: bool,
        push: &BilateralPush,
    ) -> Result<(), GpuError> {
        let images = match &mut self.images[usize::from(summed)] {
            Some(images) => images,
            empty => empty.insert(BilateralImages::like(&self.gpu, stream.color.sums())?),
        };
        let cmd = &mut cmd.scope("bilateral");
        let color = stream.color.sums();
        let all = [color, stream.variance_sums()].map(Texture::all_levels);
        let push = bytemuck::bytes_of(push);
        let BilateralImages { sums, errors } = images;
        let pipeline = self.errors.get(&[u32::from(summed)], &[TexelFormat::R32F])?;
        cmd.access(&mut errors[0], Access::ColorWrite);
        cmd.draw_fullscreen(pipeline, push, &all, &[Attachment::whole(&errors[0])]);
        for stage in 0..STAGES {
            let (old, new) = (stage as usize % 2, 1 - stage as usize % 2);
            let formats = [TexelFormat::Rgba32F, TexelFormat::R32F];
            let pipeline = self.stages.get(&[u32::from(summed), stage], &formats)?;
            cmd.access(&mut errors[old], Access::Sampled);
            cmd.access(&mut errors[new], Access::ColorWrite);
            if stage > 0 {
                cmd.access(&mut sums[old], Access::Sampled);
            }
            cmd.access(&mut sums[new], Access::ColorWrite);
            let read = if stage == 0 { color } else { &sums[old] };
            let textures = [Texture::texels(read), Texture::texels(&errors[old]), all[0], all[1]];
            let attachments = [Attachment::whole(&sums[new]), Attachment::whole(&errors[new])];
            cmd.draw_fullscreen(pipeline, push, &textures, &attachments);
        }
        cmd.access(&mut sums[RESULT], Access::Sampled);
        Ok(())
    }

    /// Filtered sums of a stream, ready to be sampled.
    pub fn filtered(&self, summed: bool) -> Option<&Image> {
        self.images[usize::from(summed)].as_ref().map(|images| &images.sums[RESULT])
    }
}
