//! From sums to radiance: blur by sample count and variance, normalise, add the streams (paper §4.2, §4.3).

use std::sync::Arc;

use crate::client::layout::ReconstructPush;
use crate::client::lod::{MIN_LOD, StreamLod};
use crate::client::pass::images::StreamImages;
use crate::client::pass::{CompilePolicy, ShaderVariants, Variants};
use crate::client::settings::{Reconstruction, ReconstructionKernel};
use crate::gpu::{
    Access, Attachment, Cmd, ComputeDesc, ComputePipeline, Gpu, GpuError, Image, StorageBinding, TexelFormat,
    Texture,
};

/// Textures of the shaders.
const TEXTURES: u32 = 8;

/// Pixels of a workgroup of `reconstruct.comp` along each axis.
const GROUP: u32 = 16;

/// Part of the kernel compiled in for one stream; see `reconstruct.frag`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum KernelExtent {
    Absent = 0,
    Texel = 1,
    OneLevel = 2,
    TwoLevels = 3,
    Filtered = 4,
}

/// Sums that need no further blur.
#[derive(Clone, Copy)]
pub enum FilteredSums<'a> {
    /// Bilaterally filtered, displayed texel by texel.
    Bilateral(&'a Image),
    /// Adaptively filtered, without overscan.
    Adaptive(&'a Image),
}

/// Inputs of one stream.
pub struct StreamInput<'a> {
    /// Sums, with the mip levels named by [`levels_needed`].
    pub images: &'a StreamImages,
    /// Level of detail of the stream.
    pub lod: StreamLod,
    /// Filtered sums; `None` if not filtered.
    pub filtered: Option<FilteredSums<'a>>,
}

/// Blurs both streams and writes scene-linear XYZ. Uses a fragment shader or, if the device [prefers](Gpu::prefers_compute) it and the
/// levels are uniform over the picture, a compute shader whose workgroups load each texel once into shared memory.
///
/// Reads: all levels of `color` (and of `variance` if noise is masked) of the streams with samples.
/// Writes: `picture.xyz`.
pub struct ReconstructPass {
    gpu: Arc<Gpu>,
    /// Constants: reconstruction, masking, extents of the camera's and the light's kernel, taps and exponent, atlas.
    pipelines: ShaderVariants,
    /// The compute shader, with the same constants.
    tiled: Variants<ComputePipeline>,
}

impl ReconstructPass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let pipelines = ShaderVariants::new(gpu, "reconstruct.frag", size_of::<ReconstructPush>(), TEXTURES);
        let tiled = Variants::new(gpu, "reconstruct.comp", policy);
        Self { gpu: gpu.clone(), pipelines: pipelines.compiled(policy), tiled }
    }

    /// Draws the picture from camera and light stream, at least one of which must be present.
    ///
    /// Fills in `push.lod` and `push.variance_lod`.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        streams: [Option<StreamInput<'_>>; 2],
        kind: Reconstruction,
        kernel: ReconstructionKernel,
        mut push: ReconstructPush,
        target: &mut Image,
    ) -> Result<(), GpuError> {
        let ReconstructionKernel { taps, exponent } = kernel;
        let masking = push.noise_masking > 0.0 && streams.iter().flatten().any(|s| s.filtered.is_none());
        let [camera, light] =
            streams.each_ref().map(|stream| kernel_extent(kind, masking, stream.as_ref()) as u32);
        let atlas = masking && !self.gpu.fetches_any_level();
        let constants = [kind as u32, u32::from(masking), camera, light, taps, exponent, u32::from(atlas)];
        for (i, stream) in streams.iter().enumerate() {
            if let Some(stream) = stream {
                (push.lod[i], push.variance_lod[i]) = (stream.lod.base, stream.lod.variance);
            }
        }
        // Every binding must be bound to an image, so bindings that the shader does not read repeat one that it does.
        let Some(any) = streams.iter().flatten().next() else {
            return Ok(());
        };
        let read = streams.each_ref().map(|stream| textures(stream.as_ref().unwrap_or(any), masking));
        let (read, push_bytes) = (read.as_flattened(), bytemuck::bytes_of(&push));
        let extent = target.extent(0);
        let tiled = self.gpu.prefers_compute() && kind == Reconstruction::Gaussian && !masking;
        if tiled && streams.iter().flatten().all(|stream| fits_tiles(stream, push.texels, extent)) {
            let (gpu, layers) = (self.gpu.clone(), target.layers());
            let pipeline = self.tiled.get(&constants, move || {
                let (shader, push_bytes) =
                    (("reconstruct.comp", &constants[..]), size_of::<ReconstructPush>());
                let desc = ComputeDesc { shader, push_bytes, textures: TEXTURES, images: &[true], layers };
                ComputePipeline::new(&gpu, &desc)
            })?;
            let cmd = &mut cmd.scope("reconstruct");
            cmd.access(target, Access::Storage);
            let mut bindings: Vec<_> = read.iter().copied().map(StorageBinding::Texture).collect();
            bindings.push(StorageBinding::Image(target));
            cmd.dispatch(pipeline, push_bytes, &bindings, extent.map(|n| n.div_ceil(GROUP)));
        } else {
            let pipeline = self.pipelines.get(&constants, &[TexelFormat::Rgba32F])?;
            let cmd = &mut cmd.scope("reconstruct");
            cmd.access(target, Access::ColorWrite);
            cmd.draw_fullscreen(pipeline, push_bytes, read, &[Attachment::whole(target)]);
        }
        Ok(())
    }
}

/// Textures of one stream: all levels of colour and variance, and the two levels around its level of detail (with noise masking, twice the
/// atlas or all levels instead).
fn textures<'a>(stream: &StreamInput<'a>, masking: bool) -> [Texture<'a>; 4] {
    let color = stream.images.color.sums();
    let all = Texture::all_levels(color);
    if let Some(FilteredSums::Bilateral(filtered) | FilteredSums::Adaptive(filtered)) = stream.filtered {
        return [Texture::texels(filtered); 4];
    }
    if masking {
        let variance = Texture::all_levels(stream.images.variance_sums());
        let levels = stream.images.atlas().map_or(all, Texture::texels);
        return [all, variance, levels, levels];
    }
    let [near, far] = levels_around(stream);
    // The shader does not read the variance; its binding repeats the colour.
    [all, all, Texture::level(color, near), Texture::level(color, far)]
}

/// The two levels around the level of detail of a stream.
fn levels_around(stream: &StreamInput<'_>) -> [u32; 2] {
    let near = stream.lod.base.max(0.0) as u32;
    [near, (near + 1).min(stream.images.color.sums().levels() - 1)]
}

/// Whether the shared-memory tiles of `reconstruct.comp` hold all texels that the pixels of a workgroup read of this stream, in a picture
/// of this extent with `texels` of level 0 per pixel: they span less than `GROUP` texels of the first level, and half of that of the
/// second. This holds if pixels are not larger than texels of the first level; a quarter of a texel is reserved for rounding.
fn fits_tiles(stream: &StreamInput<'_>, texels: [f32; 2], extent: [u32; 2]) -> bool {
    let color = stream.images.color.sums();
    levels_around(stream).into_iter().zip([GROUP, GROUP / 2]).all(|(level, most)| {
        let sizes = color.extent(level).into_iter().zip(color.extent(0));
        sizes.zip(extent).zip(texels).all(|(((size, full), pixels), texels)| {
            let steps = (pixels.min(GROUP) - 1) as f32;
            steps * texels * (size as f32 / full as f32) <= most as f32 - 0.25
        })
    })
}

/// Number of mip levels of a stream that will be read, including level 0.
pub fn levels_needed(kind: Reconstruction, masking: bool, lod: &StreamLod) -> u32 {
    let all = lod.max_level as u32 + 1;
    match kind {
        _ if masking => all,
        Reconstruction::None => 1,
        _ if lod.base < 0.0 => 1,
        _ => (lod.base as u32 + 2).min(all),
    }
}

/// Part of the kernel to compile in for one stream.
fn kernel_extent(kind: Reconstruction, masking: bool, stream: Option<&StreamInput<'_>>) -> KernelExtent {
    match stream {
        None => KernelExtent::Absent,
        Some(StreamInput { filtered: Some(FilteredSums::Bilateral(_)), .. }) => KernelExtent::Texel,
        Some(StreamInput { filtered: Some(FilteredSums::Adaptive(_)), .. }) => KernelExtent::Filtered,
        Some(_) if kind != Reconstruction::Gaussian || masking => KernelExtent::TwoLevels,
        Some(stream) if stream.lod.base <= MIN_LOD => KernelExtent::Texel,
        Some(stream) if stream.lod.base < 0.0 => KernelExtent::OneLevel,
        Some(_) => KernelExtent::TwoLevels,
    }
}
