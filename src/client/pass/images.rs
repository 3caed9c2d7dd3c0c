//! The images of a film: accumulators of each stream, images of a batch, images of the picture.
//!
//! # Bytes per pixel
//!
//! The paper has 40 bytes per pixel in two streams. Here every stream that has samples holds a sum of two floats, with mip levels of
//! the rounded sums:
//!
//! | images | bytes per texel | made |
//! |---|---|---|
//! | colour of a stream: 16 · 4/3 + 16 | 37 | with its first sample |
//! | variance of a stream: a quarter of that | 9 | if the film keeps it: noise masking, error view, EXR files |
//! | batch: colour, and variance with means | 16 + 20 | with the first batch, for both streams |
//! | picture: XYZ and encoded | 16 + 4, or 8 for scRGB | with the first repaint |
//! | another picture XYZ | 16 | with the first repaint that post-processes |
//! | adaptive filter: 8, 1, 16 and 4, with mip levels | 39 | with the first repaint that filters the light stream |
//! | atlas of mip levels, bilateral filter | 24, 40 | with the first repaint that masks noise so; the atlas on lavapipe only |
//!
//! A film of two eyes has two layers of each, but for the batch.
//!
//! If the CPU computes the sums, the device has neither the second floats nor a batch. A film below 190² texels has several copies of the
//! batch ([`FilmSpec::batch_slots`]). The window always accumulates the variance: it could not be computed later, because the samples are
//! gone by then. Glare has tables of its own and one complex number per channel and frequency.

use std::sync::Arc;

use crate::client::compiled_effects::{DETAILS, Effects};
use crate::client::post_process::PicturePair;
use crate::client::settings::{FilmSpec, Summation};
use crate::gpu::{
    Access, Attachment, Cmd, ComputePipeline, Gpu, GpuError, Image, ImageDesc, StorageBinding, TexelFormat,
};

/// Sums of one or two floats per value, which [fold](crate::client::pass::fold) updates in place.
pub struct AccumulatorImages {
    /// Rounded sums, with mip levels.
    sums: Image,
    /// Rounding remainders (second floats); `None` for sums of one float, and if the sums are only copied to the device.
    rests: Option<Image>,
}

impl AccumulatorImages {
    /// Creates images of this format and a layer for each eye; with `rests` for sums of two floats.
    fn new(
        gpu: &Arc<Gpu>,
        name: &str,
        format: TexelFormat,
        rests: bool,
        extent: [u32; 2],
        layers: u32,
    ) -> Result<Self, GpuError> {
        let desc = ImageDesc::new(format, extent).layered(layers).storage();
        let rest = || Image::of(gpu, &format!("{name} rests"), desc);
        Ok(Self {
            sums: Image::of(gpu, &format!("{name} sums"), desc.with_mips())?,
            rests: rests.then(rest).transpose()?,
        })
    }

    /// Runs a compute shader for every texel of a layer that adds `batch` to the sums and, if present, writes the `means`. Bindings: sums,
    /// rests, batch, means; a binding that the shader does not read holds the sums.
    pub fn fold(
        &mut self,
        cmd: &mut Cmd<'_>,
        layer: u32,
        pipeline: &ComputePipeline,
        push: &[u8],
        batch: &mut Image,
        means: Option<&mut Image>,
    ) {
        /// Workgroup size in texels: `local_size` of the shaders.
        const GROUP: [u32; 2] = [16, 8];
        let Self { sums, rests } = self;
        cmd.access_levels(sums, 0..1, Access::Storage);
        for image in rests.iter_mut().chain([&mut *batch]) {
            cmd.access(image, Access::Storage);
        }
        let of_layer = |image| StorageBinding::Layer(image, layer);
        let rests = rests.as_ref().unwrap_or(sums);
        let mut bindings = vec![of_layer(sums), of_layer(rests), StorageBinding::Image(batch)];
        if pipeline.bindings() > bindings.len() {
            bindings.push(match means {
                Some(means) => {
                    cmd.access(means, Access::Storage);
                    StorageBinding::Image(means)
                }
                None => of_layer(sums),
            });
        }
        let [width, height] = sums.extent(0);
        cmd.dispatch(pipeline, push, &bindings, [width.div_ceil(GROUP[0]), height.div_ceil(GROUP[1])]);
    }

    /// Rounded sums, and their mip levels.
    pub fn sums(&self) -> &Image {
        &self.sums
    }

    /// Mutable [`sums`](Self::sums).
    pub fn sums_mut(&mut self) -> &mut Image {
        &mut self.sums
    }
}

/// Number of valid mip levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MipState {
    /// Valid levels of the colour, including level 0.
    pub color: u32,
    /// Valid levels of the variance.
    pub variance: u32,
}

/// Images of one stream, created when its first sample arrives.
pub struct StreamImages {
    /// Sums of X, Y, Z and W.
    pub color: AccumulatorImages,
    /// Sums of squared deviations of luminance, if accumulated.
    pub variance: Option<AccumulatorImages>,
    /// Valid mip levels.
    pub mips: MipState,
    /// Atlas with all colour levels, created when noise masking first needs it.
    atlas: Option<Image>,
    /// Whether the atlas holds the current sums.
    atlas_done: bool,
    /// Whether the contents of the sums are undefined.
    undefined: bool,
}

impl StreamImages {
    /// Images of the stream `name` for this film, with a layer for each of its `eyes`. `folded` is false if the device only receives copies of the sums, which need no second
    /// floats.
    pub fn new(
        gpu: &Arc<Gpu>,
        name: &str,
        spec: &FilmSpec,
        folded: bool,
        eyes: u32,
    ) -> Result<Self, GpuError> {
        let extent = spec.padded_extent();
        let sums = |what: &str, format, rests| {
            AccumulatorImages::new(gpu, &format!("{name} {what}"), format, rests, extent, eyes)
        };
        let variance = || sums("variance", TexelFormat::R32F, folded);
        Ok(Self {
            color: sums("color", TexelFormat::Rgba32F, folded && spec.sums == Summation::TwoFloat)?,
            variance: spec.variance.map(|_| variance()).transpose()?,
            mips: MipState::default(),
            atlas: None,
            atlas_done: false,
            undefined: true,
        })
    }

    /// Discards the sums; the images stay.
    pub fn forget(&mut self) {
        self.undefined = true;
        self.mips = MipState::default();
        self.atlas_done = false;
    }

    /// Invalidates mip levels and atlas after the sums have changed.
    pub fn changed(&mut self) {
        self.mips = MipState { color: 1, variance: 1 };
        self.atlas_done = false;
    }

    /// Copies all colour levels into the atlas, unless it is up to date.
    pub fn fill_atlas(&mut self, gpu: &Arc<Gpu>, cmd: &mut Cmd<'_>) -> Result<(), GpuError> {
        let sums = self.color.sums_mut();
        let full = sums.extent(0);
        let mut atlas = match self.atlas.take() {
            Some(atlas) => atlas,
            None => {
                let extent = atlas_extent(full, sums.levels());
                let desc = ImageDesc::new(TexelFormat::Rgba32F, extent).layered(sums.layers());
                Image::of(gpu, "atlas", desc)?
            }
        };
        if !std::mem::replace(&mut self.atlas_done, true) {
            let origins: Vec<_> = (0..sums.levels()).map(|level| atlas_origin(full, level)).collect();
            cmd.scope("atlas").copy_levels(sums, &mut atlas, &origins);
        }
        cmd.access(sums, Access::Sampled);
        cmd.access(&mut atlas, Access::Sampled);
        self.atlas = Some(atlas);
        Ok(())
    }

    /// The atlas of the last [`fill_atlas`](Self::fill_atlas).
    pub fn atlas(&self) -> Option<&Image> {
        self.atlas.as_ref()
    }

    /// Rounded sums of the variance; without variance those of the colour, as a placeholder for its binding.
    pub fn variance_sums(&self) -> &Image {
        self.variance.as_ref().unwrap_or(&self.color).sums()
    }

    /// Whether the sums have been written since they were created or [forgotten](Self::forget).
    pub fn is_defined(&self) -> bool {
        !self.undefined
    }

    /// Records that the sums were overwritten completely.
    pub fn written(&mut self) {
        self.undefined = false;
    }

    /// Clears the sums to zero if they are undefined.
    pub fn define(&mut self, cmd: &mut Cmd<'_>) {
        if !std::mem::take(&mut self.undefined) {
            return;
        }
        self.changed();
        let cmd = &mut cmd.scope("clear");
        for sums in std::iter::once(&mut self.color).chain(&mut self.variance) {
            let mut images: Vec<_> = std::iter::once(&mut sums.sums).chain(&mut sums.rests).collect();
            for image in &mut images {
                cmd.access_levels(image, 0..1, Access::ColorWrite);
            }
            let attachments: Vec<_> = images.iter().map(|image| Attachment::cleared(image)).collect();
            cmd.rendering(&attachments, |_| ());
        }
    }
}

/// First texel of a level in the atlas: level 0 at the left, the others stacked at its right. Same as `atlas_level` in
/// `glsl/include/gather.glsl`.
fn atlas_origin(full: [u32; 2], level: u32) -> [u32; 2] {
    let high = full[1].next_power_of_two();
    if level == 0 { [0, 0] } else { [full[0], high - (high >> (level - 1)) + level] }
}

/// Extent of the atlas that holds all levels.
pub fn atlas_extent(full: [u32; 2], levels: u32) -> [u32; 2] {
    let last = atlas_origin(full, levels - 1)[1];
    [full[0] + (full[0] / 2).max(1), full[1].max(last + 1)]
}

/// Images of one batch, used by both streams in turn.
pub struct BatchImages {
    /// `Σ f [x, y, z, w]`.
    pub color: Image,
    /// Images of the variance, if accumulated.
    pub deviations: Option<Deviations>,
}

/// Images of the variance of a batch.
pub struct Deviations {
    /// `Σ f w² (Y − m₀)(Y − m₁)`.
    pub variance: Image,
    /// Mean luminance before and after the batch, each as two floats.
    pub means: Image,
}

impl BatchImages {
    /// Images of this film's padded extent; render targets have all batch slots stacked vertically.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, GpuError> {
        let [width, height] = spec.padded_extent();
        let make =
            |name, format, height| Image::of(gpu, name, ImageDesc::new(format, [width, height]).storage());
        let high = height * spec.batch_slots();
        let deviations = || {
            let variance = make("batch variance", TexelFormat::R32F, high)?;
            Ok(Deviations { variance, means: make("batch means", TexelFormat::Rgba32F, height)? })
        };
        Ok(Self {
            color: make("batch color", TexelFormat::Rgba32F, high)?,
            deviations: spec.variance.map(|_| deviations()).transpose()?,
        })
    }
}

/// Images written by a repaint.
pub struct PictureImages {
    extent: [u32; 2],
    /// Layers: one for each eye.
    eyes: u32,
    /// Scene-linear XYZ for each of [`DETAILS`], created on first use.
    xyz: [Option<PicturePair>; DETAILS.len()],
    /// Encoded R, G, B at full size, created on first use.
    encoded: Option<Image>,
    /// Index in [`DETAILS`] of the last request.
    last: usize,
}

impl PictureImages {
    /// Images of this extent in picture pixels, without padding, with a layer for each of these `eyes`.
    pub fn new(extent: [u32; 2], eyes: u32) -> Self {
        Self { extent, eyes, xyz: [const { None }; DETAILS.len()], encoded: None, last: 0 }
    }

    /// The encoded picture of the last request.
    pub fn painted(&mut self) -> Option<&mut Image> {
        self.encoded.as_mut()
    }

    /// Images of the last repaint: scene-linear XYZ, picture pixels per texel of it and axis, and the encoded picture.
    pub fn shown(&mut self) -> Option<(&mut Image, u32, &mut Image)> {
        Some((&mut self.xyz[self.last].as_mut()?.xyz, DETAILS[self.last], self.encoded.as_mut()?))
    }

    /// Scene-linear XYZ of the last request, with the image that post-processes write.
    pub fn pair(&mut self) -> Option<&mut PicturePair> {
        self.xyz[self.last].as_mut()
    }

    /// Whether [`get`](Self::get) would create no image for these effects.
    pub fn holds(&self, effects: &Effects) -> bool {
        let format = effects.encoded_format();
        let xyz = DETAILS.into_iter().zip(&self.xyz).any(|(d, xyz)| d == effects.detail && xyz.is_some());
        xyz && self.encoded.as_ref().is_some_and(|image| image.format() == format)
    }

    /// Scene-linear XYZ and encoded picture for these effects. An encoded picture of another format is retired.
    pub fn get(&mut self, gpu: &Arc<Gpu>, effects: &Effects) -> Result<(&mut Image, &mut Image), GpuError> {
        let at = DETAILS.iter().position(|d| *d == effects.detail).unwrap_or(0);
        self.last = at;
        let format = effects.encoded_format();
        let pair = match &mut self.xyz[at] {
            Some(pair) => pair,
            empty => {
                let extent = self.extent.map(|n| n.div_ceil(DETAILS[at]));
                empty.insert(PicturePair::new(gpu, extent, self.eyes)?)
            }
        };
        self.encoded = self.encoded.take().filter(|image| image.format() == format);
        let encoded = match &mut self.encoded {
            Some(image) => image,
            empty => {
                let desc = ImageDesc::new(format, self.extent).layered(self.eyes);
                empty.insert(Image::of(gpu, "picture encoded", desc)?)
            }
        };
        Ok((&mut pair.xyz, encoded))
    }
}
