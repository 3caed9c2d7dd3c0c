//! Noise masking by bilateral filtering guided by the variance (paper §4.2).

use std::sync::Arc;

use crate::client::layout::BilateralPush;
use crate::client::pass::images::StreamImages;
use crate::client::pass::{Variants, fullscreen, texels};
use crate::client::reference::bilateral::STAGES;
use crate::gpu::{
    Access, Cmd, Format, Gpu, GpuError, Image, ImageDesc, Load, Pipeline, Sampler, Target, Texture,
};

/// Averages the sums of a stream over neighbours whose difference the variance explains, in three stages.
///
/// Reads: all levels of `color` and `variance` of the stream. Writes: images of its own, of level 0's extent.
#[derive(Default)]
pub struct BilateralPass {
    errors: Variants<bool>,
    stages: Variants<(bool, u32)>,
    /// Camera and light, made when they are filtered first.
    images: [Option<Scratch>; 2],
}

/// Sums and squared errors, each twice: a stage reads the one and writes the other.
struct Scratch {
    sums: [Image; 2],
    errors: [Image; 2],
}

impl Scratch {
    fn new(gpu: &Arc<Gpu>, extent: [u32; 2]) -> Result<Self, GpuError> {
        let make = |name, format| Image::new(gpu, ImageDesc { name, format, extent, mips: false });
        let sums = |name| make(name, Format::Rgba32F);
        let errors = |name| make(name, Format::R32F);
        Ok(Self {
            sums: [sums("bilateral sums 0")?, sums("bilateral sums 1")?],
            errors: [errors("bilateral errors 0")?, errors("bilateral errors 1")?],
        })
    }
}

impl BilateralPass {
    /// Filters stream `i`, 0 the camera's and 1 the light's; [`filtered`](Self::filtered) is the result.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline, [`GpuError::Memory`] for the images.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        (i, stream): (usize, &mut StreamImages),
        push: &BilateralPush,
    ) -> Result<(), GpuError> {
        let summed = i == 1;
        let scratch = match &mut self.images[i] {
            Some(images) => images,
            empty => empty.insert(Scratch::new(gpu, stream.color.sums().extent(0))?),
        };
        let cmd = &mut cmd.scope("bilateral");
        let (color, variance) = (stream.color.sums(), stream.variance_sums());
        let all = |image| Texture { image, level: None, sampler: Sampler::Trilinear };
        let pipeline = self.errors.get(summed, || make_errors(gpu, summed))?;
        let push = bytemuck::bytes_of(push);
        cmd.access(&mut scratch.errors[0], Access::ColorWrite);
        cmd.rendering(&[target(&scratch.errors[0])], |cmd| {
            cmd.bind(pipeline, push, &[all(color), all(variance)]);
            cmd.draw_fullscreen();
        });
        for stage in 0..STAGES {
            let (old, new) = (stage as usize % 2, 1 - stage as usize % 2);
            let pipeline = self.stages.get((summed, stage), || make_stage(gpu, summed, stage))?;
            cmd.access(&mut scratch.errors[old], Access::Sampled);
            cmd.access(&mut scratch.errors[new], Access::ColorWrite);
            if stage > 0 {
                cmd.access(&mut scratch.sums[old], Access::Sampled);
            }
            cmd.access(&mut scratch.sums[new], Access::ColorWrite);
            let sums = if stage == 0 { color } else { &scratch.sums[old] };
            cmd.rendering(&[target(&scratch.sums[new]), target(&scratch.errors[new])], |cmd| {
                let read = [texels(sums), texels(&scratch.errors[old]), all(color), all(variance)];
                cmd.bind(pipeline, push, &read);
                cmd.draw_fullscreen();
            });
        }
        cmd.access(&mut scratch.sums[RESULT], Access::Sampled);
        Ok(())
    }

    /// The filtered sums of stream `i`, ready to be sampled.
    pub fn filtered(&self, i: usize) -> Option<&Image> {
        self.images[i].as_ref().map(|images| &images.sums[RESULT])
    }
}

/// Which image the last stage writes.
const RESULT: usize = STAGES as usize % 2;

fn target(image: &Image) -> Target<'_> {
    Target { image, level: 0, load: Load::Discard }
}

fn make_errors(gpu: &Arc<Gpu>, summed: bool) -> Result<Pipeline, GpuError> {
    let frag = ("bilateral_error.frag", &[u32::from(summed)][..]);
    fullscreen(gpu, frag, size_of::<BilateralPush>(), 2, &[Format::R32F])
}

fn make_stage(gpu: &Arc<Gpu>, summed: bool, stage: u32) -> Result<Pipeline, GpuError> {
    let frag = ("bilateral.frag", &[u32::from(summed), stage][..]);
    fullscreen(gpu, frag, size_of::<BilateralPush>(), 4, &[Format::Rgba32F, Format::R32F])
}
