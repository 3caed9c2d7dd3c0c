//! Adaptive filtering of the light stream; [the reference](crate::client::reference::adaptive_filter) says how it works.

use std::sync::Arc;

use crate::client::layout::{AdaptivePush, DownsamplePush};
use crate::client::pass::mips::taps;
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::gpu::{
    Access, Attachment, Blend, Cmd, Gpu, GpuError, Image, ImageDesc, LoadOp, TexelFormat, Texture,
};

/// Spreads the light of every texel as far as the density of samples around it requires.
///
/// Reads: level 0 of a stream's sums. Writes: images of its own, of the picture's extent.
pub struct AdaptiveFilterPass {
    gpu: Arc<Gpu>,
    statistics: ShaderVariants,
    /// Constants: number of inputs per output along both axes, and no second image.
    downsample: ShaderVariants,
    edges: ShaderVariants,
    keep: ShaderVariants,
    /// Constants: number of inputs per output along both axes.
    pass_on: ShaderVariants,
    add: ShaderVariants,
    images: Option<AdaptiveImages>,
}

/// All have mip levels; `edges` and `passed` have half the picture's extent and begin with level 1.
struct AdaptiveImages {
    statistics: Image,
    edges: Image,
    /// The light that a level keeps, in the end with that of all coarser levels.
    kept: Image,
    /// The light that comes to a level.
    passed: Image,
}

/// Input of the pass.
#[derive(Clone, Copy)]
pub struct AdaptiveInput<'a> {
    /// Sums with overscan, level 0 ready to be sampled.
    pub sums: &'a Image,
    /// Texels of overscan on every side.
    pub pad: u32,
    /// Texels of the picture along each axis, without overscan.
    pub extent: [u32; 2],
    /// 1 / luminance scale.
    pub inverse_scale: f32,
    /// Finest level that may keep light.
    pub finest: u32,
}

impl AdaptiveImages {
    fn new(gpu: &Arc<Gpu>, extent: [u32; 2], layers: u32) -> Result<Self, GpuError> {
        let image = |name, format, extent| {
            Image::of(gpu, name, ImageDesc::new(format, extent).layered(layers).with_mips())
        };
        let half = extent.map(|n| (n / 2).max(1));
        Ok(Self {
            statistics: image("adaptive statistics", TexelFormat::Rg32F, extent)?,
            edges: image("adaptive edges", TexelFormat::R32F, half)?,
            kept: image("adaptive kept", TexelFormat::Rgba32F, extent)?,
            passed: image("adaptive passed", TexelFormat::Rgba32F, half)?,
        })
    }
}

impl AdaptiveFilterPass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let shader = |name, textures| {
            ShaderVariants::new(gpu, name, size_of::<AdaptivePush>(), textures).compiled(policy)
        };
        let downsample = ShaderVariants::new(gpu, "downsample.frag", size_of::<DownsamplePush>(), 2);
        Self {
            gpu: gpu.clone(),
            statistics: shader("adaptive_statistics.frag", 1),
            downsample: downsample.compiled(policy),
            edges: shader("adaptive_edges.frag", 1),
            keep: shader("adaptive_keep.frag", 3),
            pass_on: shader("adaptive_pass_on.frag", 2),
            add: shader("adaptive_add.frag", 1).blended(Blend::Add),
            images: None,
        }
    }

    /// Filters the sums of a stream. [`filtered`](Self::filtered) is the result.
    pub fn record(&mut self, cmd: &mut Cmd<'_>, input: AdaptiveInput<'_>) -> Result<(), GpuError> {
        // Coarse sums of a moving picture have another extent.
        let mut images = match self.images.take().filter(|images| images.kept.extent(0) == input.extent) {
            Some(images) => images,
            None => AdaptiveImages::new(&self.gpu, input.extent, input.sums.layers())?,
        };
        let cmd = &mut cmd.scope("adaptive filter");
        let last = images.kept.levels() - 1;
        let recorded = self.measure(cmd, &input, &mut images).and_then(|()| {
            (0..last).try_for_each(|level| self.keep(cmd, &input, &mut images, level))?;
            self.collect(cmd, &input, &mut images)
        });
        self.images = Some(images);
        recorded
    }

    /// The filtered sums, without overscan, ready to be sampled.
    pub fn filtered(&self) -> Option<&Image> {
        self.images.as_ref().map(|images| &images.kept)
    }

    /// Writes all levels of the statistics, and of the edges.
    fn measure(
        &mut self,
        cmd: &mut Cmd<'_>,
        input: &AdaptiveInput<'_>,
        AdaptiveImages { statistics, edges, .. }: &mut AdaptiveImages,
    ) -> Result<(), GpuError> {
        let pipeline = self.statistics.get(&[], &[statistics.format()])?;
        cmd.access_levels(statistics, 0..1, Access::ColorWrite);
        let attachment = [Attachment::whole(statistics)];
        let push = push(input, input.extent, 0);
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &[Texture::texels(input.sums)], &attachment);
        for level in 1..statistics.levels() {
            let source = statistics.extent(level - 1);
            let [across, down] = source.map(taps);
            let pipeline = self.downsample.get(&[across, down, 0], &[statistics.format()])?;
            cmd.access_levels(statistics, level - 1..level, Access::Sampled);
            cmd.access_levels(statistics, level..level + 1, Access::ColorWrite);
            let push = DownsamplePush { source: source.map(|n| n as i32) };
            // The shader does not read the second image.
            let textures = [Texture::level(statistics, level - 1); 2];
            cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[whole(statistics, level)]);
        }
        cmd.access(statistics, Access::Sampled);
        cmd.access(edges, Access::ColorWrite);
        for level in 1..statistics.levels() {
            let pipeline = self.edges.get(&[], &[edges.format()])?;
            let push = self::push(input, statistics.extent(level), level);
            let textures = [Texture::level(statistics, level)];
            cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[whole(edges, level - 1)]);
        }
        cmd.access(edges, Access::Sampled);
        Ok(())
    }

    /// Writes what a level keeps, and what it passes on to the next.
    fn keep(
        &mut self,
        cmd: &mut Cmd<'_>,
        input: &AdaptiveInput<'_>,
        AdaptiveImages { statistics, edges, kept, passed }: &mut AdaptiveImages,
        level: u32,
    ) -> Result<(), GpuError> {
        let push = push(input, kept.extent(level), level);
        cmd.access_levels(kept, level..level + 1, Access::ColorWrite);
        let pipeline = self.keep.get(&[], &[kept.format()])?;
        let textures = [
            light(input, passed, level),
            Texture::level(statistics, level + 1),
            Texture::level(edges, level),
        ];
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[whole(kept, level)]);
        cmd.access_levels(kept, level..level + 1, Access::Sampled);
        cmd.access_levels(passed, level..level + 1, Access::ColorWrite);
        let [across, down] = kept.extent(level).map(taps);
        let pipeline = self.pass_on.get(&[across, down], &[passed.format()])?;
        let textures = [light(input, passed, level), Texture::level(kept, level)];
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[whole(passed, level)]);
        cmd.access_levels(passed, level..level + 1, Access::Sampled);
        Ok(())
    }

    /// Adds the levels up, from the coarsest on, which keeps what has come to it.
    fn collect(
        &mut self,
        cmd: &mut Cmd<'_>,
        input: &AdaptiveInput<'_>,
        AdaptiveImages { kept, passed, .. }: &mut AdaptiveImages,
    ) -> Result<(), GpuError> {
        let last = kept.levels() - 1;
        for level in (0..last).rev() {
            let pipeline = self.add.get(&[], &[kept.format()])?;
            cmd.access_levels(kept, level..level + 1, Access::ColorBlend);
            let push = push(input, kept.extent(level), level);
            let coarser = match level + 1 == last {
                true => Texture::level(passed, level),
                false => Texture::level(kept, level + 1),
            };
            let target = Attachment { image: kept, level, load: LoadOp::Keep };
            cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &[coarser], &[target]);
            cmd.access_levels(kept, level..level + 1, Access::Sampled);
        }
        Ok(())
    }
}

/// The light that has come to a level.
fn light<'a>(input: &AdaptiveInput<'a>, passed: &'a Image, level: u32) -> Texture<'a> {
    match level {
        0 => Texture::texels(input.sums),
        _ => Texture::level(passed, level - 1),
    }
}

/// A level of an image, of which every texel will be written.
fn whole(image: &Image, level: u32) -> Attachment<'_> {
    Attachment { image, level, load: LoadOp::Discard }
}

fn push(input: &AdaptiveInput<'_>, extent: [u32; 2], level: u32) -> AdaptivePush {
    AdaptivePush {
        extent: extent.map(|n| n as i32),
        offset: [if level == 0 { input.pad as i32 } else { 0 }; 2],
        level: level as i32,
        finest: input.finest as i32,
        inverse_scale: input.inverse_scale,
    }
}
