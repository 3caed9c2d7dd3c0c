//! Averages of the sums down to 1×1 (paper §4.2, steps 3 and 6).

use std::sync::Arc;

use crate::client::layout::DownsamplePush;
use crate::client::pass::images::{Accumulator, StreamImages};
use crate::client::pass::{Variants, fullscreen};
use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Image, Load, Pipeline, Sampler, Target, Texture};

/// Builds mip levels of a stream's sums, with the variance where noise is masked.
///
/// Reads and writes: the levels of `stream.color`, and of `stream.variance` if asked for.
#[derive(Default)]
pub struct MipsPass {
    /// By: inputs of an output along both axes; with variance.
    pipelines: Variants<([u32; 2], bool)>,
}

impl MipsPass {
    /// Makes levels `0 .. levels` of the colour readable, and of the variance too if `variance`, which must then be kept.
    ///
    /// Levels that are up to date are not built again; level 0 must hold the sums.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        stream: &mut StreamImages,
        levels: u32,
        variance: bool,
    ) -> Result<(), GpuError> {
        let cmd = &mut cmd.scope("mips");
        debug_assert!(stream.mips.color.min(stream.mips.variance) > 0, "sums that were never written");
        let first = if variance { stream.mips.color.min(stream.mips.variance) } else { stream.mips.color };
        for level in first.max(1)..levels {
            let source = stream.color.sums().extent(level - 1);
            let taps = source.map(taps);
            let pipeline = self.pipelines.get((taps, variance), || make(gpu, taps, variance))?;
            let push = DownsamplePush { source: source.map(|n| n as i32) };
            let mut images = vec![stream.color.sums_mut()];
            images.extend(stream.variance.as_mut().filter(|_| variance).map(Accumulator::sums_mut));
            record_level(cmd, pipeline, &mut images, level, push);
        }
        let done = levels.max(first);
        stream.mips.color = stream.mips.color.max(done);
        cmd.access(stream.color.sums_mut(), Access::Sampled);
        if let Some(sums) = stream.variance.as_mut().filter(|_| variance) {
            stream.mips.variance = stream.mips.variance.max(done);
            cmd.access(sums.sums_mut(), Access::Sampled);
        }
        Ok(())
    }
}

/// Draws one level of every image from the level before.
fn record_level(
    cmd: &mut Cmd<'_>,
    pipeline: &Pipeline,
    images: &mut [&mut Image],
    level: u32,
    push: DownsamplePush,
) {
    for image in images.iter_mut() {
        cmd.access_levels(image, level - 1..level, Access::Sampled);
        cmd.access_levels(image, level..level + 1, Access::ColorWrite);
    }
    let targets: Vec<_> = images.iter().map(|image| Target { image, level, load: Load::Discard }).collect();
    // Without variance its binding repeats the colour: every binding must hold an image.
    let source = |i: usize| Texture {
        image: &*images[i.min(images.len() - 1)],
        level: Some(level - 1),
        sampler: Sampler::Nearest,
    };
    cmd.rendering(&targets, |cmd| {
        cmd.bind(pipeline, bytemuck::bytes_of(&push), &[source(0), source(1)]);
        cmd.draw_fullscreen();
    });
}

/// Inputs of one output along an axis of `n` texels.
fn taps(n: u32) -> u32 {
    match n {
        1 => 1,
        n => 2 + n % 2,
    }
}

fn make(gpu: &Arc<Gpu>, taps: [u32; 2], variance: bool) -> Result<Pipeline, GpuError> {
    let constants = [taps[0], taps[1], u32::from(variance)];
    let targets = [Format::Rgba32F, Format::R32F];
    let targets = if variance { &targets[..] } else { &targets[..1] };
    fullscreen(gpu, ("downsample.frag", &constants), size_of::<DownsamplePush>(), 2, targets)
}
