//! The passes of the Vulkan film, one file and one struct each: a pipeline in, `record` with what it reads and writes.
//!
//! | file | pass | twin in `client/reference` |
//! |---|---|---|
//! | [`splat`] | samples → batch image, filter-shaped sprites, additive | `splat` |
//! | [`fold`] | batch image → two-float sums, means | `fold` |
//! | [`variance`] | samples again → batch of squared deviations → two-float sums | `variance` |
//! | [`mips`] | averages down to 1×1 | `mips` |
//! | [`bilateral`] | averages over neighbours whose difference is noise, if asked for | `bilateral` |
//! | [`reconstruct`] | blur by count and variance, normalise, sum the streams | `reconstruct`, `kernel` |
//! | [`error_view`] | the variance in place of the picture, if asked for | `error_view` |
//! | [`glare`] | scatter of the eye: convolution by FFT in compute | `glare` |
//! | [`tonemap`] | tone curve, matrix, desaturation, transfer, dither | `tonemap`, `curves` |
//!
//! [`repaint`] puts these from mips on in order, the film itself the others; [`images`] holds what they read and write. Pipelines are made on first use and specialised: what a film or a
//! repaint does not need is not in the code that runs.

pub mod bilateral;
pub mod error_view;
pub mod fold;
pub mod glare;
pub mod images;
pub mod mips;
pub mod reconstruct;
pub mod repaint;
pub mod splat;
pub mod tonemap;
pub mod variance;

use std::sync::Arc;

use crate::gpu::{Blend, Format, Gpu, GpuError, GraphicsDesc, Image, Pipeline, Sampler, Texture, Topology};

/// Pipelines of one pass by what they are specialised for, made on first use.
pub(in crate::client) struct Variants<K> {
    made: Vec<(K, Pipeline)>,
}

impl<K> Default for Variants<K> {
    fn default() -> Self {
        Self { made: Vec::new() }
    }
}

impl<K: Copy + PartialEq> Variants<K> {
    /// The pipeline for `key`, made by `make` when it is asked for first.
    fn get(
        &mut self,
        key: K,
        make: impl FnOnce() -> Result<Pipeline, GpuError>,
    ) -> Result<&Pipeline, GpuError> {
        let at = match self.made.iter().position(|(k, _)| *k == key) {
            Some(at) => at,
            None => {
                self.made.push((key, make()?));
                self.made.len() - 1
            }
        };
        Ok(&self.made[at].1)
    }
}

/// A pipeline whose fragment shader runs once for every texel of its targets.
fn fullscreen(
    gpu: &Arc<Gpu>,
    frag: (&str, &[u32]),
    push_bytes: usize,
    textures: u32,
    targets: &[Format],
) -> Result<Pipeline, GpuError> {
    let targets: Vec<_> = targets.iter().map(|format| (*format, Blend::Replace)).collect();
    Pipeline::new(
        gpu,
        &GraphicsDesc {
            name: frag.0,
            vert: ("fullscreen.vert", &[]),
            frag,
            push_bytes,
            textures,
            targets: &targets,
            topology: Topology::Fullscreen,
            vertex: Default::default(),
        },
    )
}

/// Level 0 of an image, read texel by texel.
fn texels(image: &Image) -> Texture<'_> {
    Texture { image, level: Some(0), sampler: Sampler::Nearest }
}
