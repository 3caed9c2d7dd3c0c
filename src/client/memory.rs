//! Estimate of a film's device memory before anything is allocated.
//!
//! One line for each image and buffer, under the name that it has on the device. Left out are tables of less than a megabyte, transient
//! resources of a frame, the coarse sums of a window whose picture moves (a sixteenth of the others), the downsampled copies of a picture
//! larger than its window (a third of the encoded one), and rounding by the driver. [`images`](crate::client::pass::images) gives the
//! reasons.

use crate::client::compiled_effects::Effects;
use crate::client::glare::FourierAxis;
use crate::client::glare::point_spread::GlareProfile;
use crate::client::pass::images::atlas_extent;
use crate::client::pass::stereo::composed_extent;
use crate::client::settings::{CHUNK_SAMPLES, FilmSpec, Glare, Masking, Settings, Summation};
use crate::client::upload::STRIDE;
use crate::gpu::TexelFormat;

/// What a film holds.
#[derive(Clone, Copy, Debug)]
pub struct FilmContents {
    /// Whether camera and light stream have samples.
    pub streams: [bool; 2],
    /// Number of samples of each eye.
    pub samples: usize,
    /// Number of eyes: 2 for a film with a [right eye](crate::client::film::VulkanFilm::with_right_eye), whose images have two layers.
    pub eyes: u32,
}

/// Names and bytes of the images and buffers of a film with these settings and contents. `atlas` is true for devices that cannot
/// [fetch any level](crate::gpu::Gpu::fetches_any_level).
pub fn film_memory(
    spec: &FilmSpec,
    settings: &Settings,
    contents: FilmContents,
    atlas: bool,
) -> Vec<(String, u64)> {
    let FilmContents { streams, samples, eyes } = contents;
    let effects = Effects::new(settings, 1);
    let (padded, extent) = (spec.padded_extent(), [spec.width, spec.height]);
    let mut list = Vec::new();
    for (name, light) in [("camera", false), ("light", true)] {
        if !streams[usize::from(light)] {
            continue;
        }
        list.extend(sums(&format!("{name} color"), TexelFormat::Rgba32F, spec.sums, padded));
        if spec.variance.is_some() {
            list.extend(sums(&format!("{name} variance"), TexelFormat::R32F, Summation::TwoFloat, padded));
        }
        if effects.adapts(spec, light) {
            let half = extent.map(|n| (n / 2).max(1));
            list.extend([
                with_mips("adaptive statistics", TexelFormat::Rg32F, extent),
                with_mips("adaptive edges", TexelFormat::R32F, half),
                with_mips("adaptive kept", TexelFormat::Rgba32F, extent),
                with_mips("adaptive passed", TexelFormat::Rgba32F, half),
            ]);
            continue;
        }
        match effects.masking {
            None => {}
            Some(Masking::LowPass) if !atlas => {}
            Some(Masking::LowPass) => {
                let levels = padded[0].max(padded[1]).ilog2() + 1;
                list.push(image("atlas", TexelFormat::Rgba32F, atlas_extent(padded, levels)));
            }
            Some(Masking::Bilateral) => {
                for half in 0..2 {
                    list.push(image(&format!("bilateral sums {half}"), TexelFormat::Rgba32F, padded));
                    list.push(image(&format!("bilateral errors {half}"), TexelFormat::R32F, padded));
                }
            }
        }
    }
    let slots = [padded[0], padded[1] * spec.batch_slots()];
    let mut of_batch = vec![image("batch color", TexelFormat::Rgba32F, slots)];
    if spec.variance.is_some() {
        of_batch.push(image("batch variance", TexelFormat::R32F, slots));
        of_batch.push(image("batch means", TexelFormat::Rgba32F, padded));
    }
    let coarse = extent.map(|n| n.div_ceil(effects.detail));
    list.push(image("picture XYZ", TexelFormat::Rgba32F, coarse));
    if effects.post(settings).is_some_and(|post| post.is_any_on()) {
        list.push(image("picture spare", TexelFormat::Rgba32F, coarse));
    }
    list.push(image("picture encoded", effects.encoded_format(), extent));
    // The chunks of a batch, and the one being filled while the device reads them.
    let capacity = spec.batch_capacity();
    let chunks = samples.min(capacity).div_ceil(CHUNK_SAMPLES) + usize::from(samples > capacity);
    of_batch.extend((0..chunks).map(|chunk| (format!("samples {chunk}"), (CHUNK_SAMPLES * STRIDE) as u64)));
    let glare = settings.glare.filter(|_| effects.glare);
    if glare.is_some() {
        list.extend(glare_work(extent));
    }
    // Images and the work of glare have a layer for each eye. Each eye has a batch of its own.
    list.iter_mut().for_each(|(_, bytes)| *bytes *= u64::from(eyes));
    (0..eyes).for_each(|_| list.extend(of_batch.iter().cloned()));
    list.extend(glare.iter().flat_map(|glare| glare_tables(extent, glare)));
    if eyes > 1
        && let Ok(composed) = composed_extent(settings.stereo, extent)
    {
        list.push(image("picture of both eyes", effects.encoded_format(), composed));
    }
    list.sort();
    list
}

/// Sums of two floats per value or of one, with mip levels of the rounded sums.
fn sums(name: &str, format: TexelFormat, sums: Summation, extent: [u32; 2]) -> Vec<(String, u64)> {
    let rests = matches!(sums, Summation::TwoFloat).then(|| (format!("{name} rests"), bytes(format, extent)));
    [with_mips(&format!("{name} sums"), format, extent)].into_iter().chain(rests).collect()
}

/// An image with all of its mip levels.
fn with_mips(name: &str, format: TexelFormat, extent: [u32; 2]) -> (String, u64) {
    let levels = extent[0].max(extent[1]).ilog2() + 1;
    let mips = (0..levels).map(|level| extent.map(|n| (n >> level).max(1))).map(|level| bytes(format, level));
    (name.to_owned(), mips.sum())
}

/// Tables of glare.
fn glare_tables(extent: [u32; 2], glare: &Glare) -> impl Iterator<Item = (String, u64)> + use<> {
    let [across, down] = extent.map(|n| FourierAxis::new(n as usize));
    let quarter = extent.map(|n| n.div_ceil(2) as usize);
    let kernel = ((across.half + 1) * (down.half + 1) * size_of::<f32>()) as u64;
    let kernels = if GlareProfile::new(glare.adaptation).is_chromatic() { 3 } else { 1 };
    let gain = (quarter[0] * quarter[1] * size_of::<[f32; 3]>()) as u64;
    let kernels = (0..kernels).map(move |_| ("glare kernel".to_owned(), kernel));
    kernels.chain([("glare gain".to_owned(), gain)])
}

/// Frequency buffers of glare, for one eye.
fn glare_work(extent: [u32; 2]) -> [(String, u64); 3] {
    let [across, down] = extent.map(|n| FourierAxis::new(n as usize));
    let work = ((across.half + 1) * down.pixels.next_multiple_of(2) * size_of::<[f32; 2]>()) as u64;
    ["glare X", "glare Y", "glare Z"].map(|name| (name.to_owned(), work))
}

fn image(name: &str, format: TexelFormat, extent: [u32; 2]) -> (String, u64) {
    (name.to_owned(), bytes(format, extent))
}

/// Bytes of one level of this extent.
fn bytes(format: TexelFormat, [width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height) * format.bytes() as u64
}
