//! From sums to radiance: blur by sample count and variance, normalise, add the streams (paper §4.2, §4.3).

use std::sync::Arc;

use crate::client::layout::ReconstructPush;
use crate::client::lod::{MIN_LOD, StreamLod};
use crate::client::pass::images::StreamImages;
use crate::client::pass::{Variants, fullscreen};
use crate::client::settings::{Reconstruction, ReconstructionKernel};
use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Image, Load, Pipeline, Sampler, Target, Texture};

/// How much of the kernel one stream needs; see `reconstruct.frag`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Extent {
    Absent = 0,
    Texel = 1,
    OneLevel = 2,
    TwoLevels = 3,
}

/// The specialization constants of the shader, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Key {
    kind: u32,
    masking: bool,
    camera: Extent,
    light: Extent,
    kernel: ReconstructionKernel,
}

impl Key {
    fn constants(self) -> [u32; 6] {
        let ReconstructionKernel { taps, exponent } = self.kernel;
        [self.kind, u32::from(self.masking), self.camera as u32, self.light as u32, taps, exponent]
    }
}

/// One stream as the pass reads it.
pub struct StreamInput<'a> {
    /// Its sums, with the levels that [`levels_needed`] names.
    pub images: &'a StreamImages,
    /// Its level of detail.
    pub lod: StreamLod,
    /// Its noise was filtered: these sums are shown, texel by texel.
    pub filtered: Option<&'a Image>,
}

/// Blurs both streams and writes scene-linear XYZ.
///
/// Reads: all levels of `color` (and `variance` where noise is masked) of the streams that have samples.
/// Writes: `picture.xyz`.
#[derive(Default)]
pub struct ReconstructPass {
    pipelines: Variants<Key>,
}

impl ReconstructPass {
    /// Draws the picture; at least one stream must be there.
    ///
    /// `push.lod` and `push.variance_lod` are filled in here.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        streams: [Option<StreamInput<'_>>; 2],
        ((kind, kernel), mut push): ((Reconstruction, ReconstructionKernel), ReconstructPush),
        target: &mut Image,
    ) -> Result<(), GpuError> {
        let masking = push.noise_masking > 0.0 && streams.iter().flatten().any(|s| s.filtered.is_none());
        let [camera, light] = [0, 1].map(|i| extent(kind, masking, streams[i].as_ref()));
        let key = Key { kind: kind as u32, masking, camera, light, kernel };
        let pipeline = self.pipelines.get(key, || make(gpu, key))?;
        for (i, stream) in streams.iter().enumerate() {
            if let Some(stream) = stream {
                push.lod[i] = stream.lod.base;
                push.variance_lod[i] = stream.lod.variance;
            }
        }
        // A binding that is not read holds an image that is: every binding must hold one.
        let Some(any) = streams.iter().flatten().next() else {
            return Ok(());
        };
        let read = [0, 1].map(|i| textures(streams[i].as_ref().unwrap_or(any), masking));
        let read: Vec<_> = read.into_iter().flatten().collect();

        let cmd = &mut cmd.scope("reconstruct");
        cmd.access(target, Access::ColorWrite);
        cmd.rendering(&[Target { image: target, level: 0, load: Load::Discard }], |cmd| {
            cmd.bind(pipeline, bytemuck::bytes_of(&push), &read);
            cmd.draw_fullscreen();
        });
        Ok(())
    }
}

/// What the shader binds for one stream: all levels of colour and variance, and the two levels around its level of detail
/// (twice the atlas where noise is masked).
fn textures<'a>(stream: &StreamInput<'a>, masking: bool) -> [Texture<'a>; 4] {
    let color = stream.images.color.sums();
    let all = |image| Texture { image, level: None, sampler: Sampler::Trilinear };
    let one = |image, level| Texture { image, level: Some(level), sampler: Sampler::Nearest };
    if let Some(filtered) = stream.filtered {
        return [0; 4].map(|level| one(filtered, level));
    }
    if let Some(atlas) = stream.images.atlas().filter(|_| masking) {
        let variance = stream.images.variance_sums();
        return [all(color), all(variance), one(atlas, 0), one(atlas, 0)];
    }
    let near = stream.lod.base.max(0.0) as u32;
    let far = (near + 1).min(color.levels() - 1);
    // The variance is not read: its binding repeats the colour.
    [all(color), all(color), one(color, near), one(color, far)]
}

/// Mip levels, level 0 included, that will be read of a stream.
pub fn levels_needed(kind: Reconstruction, masking: bool, lod: &StreamLod) -> u32 {
    let all = lod.max_level as u32 + 1;
    match kind {
        _ if masking => all,
        Reconstruction::None => 1,
        _ if lod.base < 0.0 => 1,
        _ => (lod.base as u32 + 2).min(all),
    }
}

/// How much of the kernel to compile in for one stream.
fn extent(kind: Reconstruction, masking: bool, stream: Option<&StreamInput<'_>>) -> Extent {
    match stream.map(|s| &s.lod) {
        None => Extent::Absent,
        Some(_) if stream.is_some_and(|s| s.filtered.is_some()) => Extent::Texel,
        Some(_) if kind != Reconstruction::Gaussian || masking => Extent::TwoLevels,
        Some(lod) if lod.base <= MIN_LOD => Extent::Texel,
        Some(lod) if lod.base < 0.0 => Extent::OneLevel,
        Some(_) => Extent::TwoLevels,
    }
}

fn make(gpu: &Arc<Gpu>, key: Key) -> Result<Pipeline, GpuError> {
    let frag = ("reconstruct.frag", &key.constants()[..]);
    fullscreen(gpu, frag, size_of::<ReconstructPush>(), 8, &[Format::Rgba32F])
}
