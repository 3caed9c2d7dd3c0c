//! The wavelet noise filter of [`wavelet`](crate::client::wavelet) on the device.

use std::sync::Arc;

use glam::Vec3;

use crate::client::error::ClientError;
use crate::client::layout::WaveletPush;
use crate::client::pass::ShaderVariants;
use crate::client::wavelet::{
    FeatureTexels, Filtered, HalfPicture, LEVELS, PixelFeatures, feature_texels, out_of_memory,
};
use crate::gpu::{
    Access, Attachment, Buffer, BufferUse, Cmd, Gpu, GpuError, Image, Pipeline, Region, TexelFormat, Texture,
};
use crate::image::Grid;

/// Wavelet noise filter for pictures of one size with the same features.
///
/// A picture takes 20 draws with about 1300 bytes of device memory traffic per pixel; the images take 220 bytes per pixel. The halves are
/// uploaded, and the denoised picture is read back.
pub struct WaveletPass {
    gpu: Arc<Gpu>,
    extent: [u32; 2],
    shaders: WaveletShaders,
    /// Weights of every level.
    weights: Vec<Image>,
    images: WaveletImages,
    upload: [Buffer; 2],
    readback: Buffer,
}

/// Pipelines; the constant of all but `separate` and `finish` is whether there are features.
struct WaveletShaders {
    weights: ShaderVariants,
    separate: ShaderVariants,
    smooth: ShaderVariants,
    average: ShaderVariants,
    /// The second constant selects the first level.
    shrink: ShaderVariants,
    finish: ShaderVariants,
}

/// Images read and written by the passes.
struct WaveletImages {
    halves: [Image; 2],
    /// Sums of both halves: at the present level, and at the next.
    sums: [[Image; 2]; 2],
    /// Band, and finally the denoised picture.
    band: Image,
    power: Image,
    means: Image,
    /// The result so far, and the next (double-buffered).
    results: [Image; 2],
    aside: Image,
    finest: Image,
}

/// Parameters of one level.
#[derive(Clone, Copy)]
struct WaveletLevel {
    level: usize,
    /// Whether weights separate pixels of different features.
    features: bool,
}

impl WaveletPass {
    /// A filter for pictures with these features of both halves, reusing the memory of the `last` view's filter if it fits; waits for the
    /// device.
    ///
    /// # Errors
    ///
    /// [`ClientError::Memory`] if host memory runs out, and [`ClientError::Gpu`].
    pub fn after(
        last: Option<Self>,
        gpu: &Arc<Gpu>,
        features: [&Grid<PixelFeatures>; 2],
    ) -> Result<Self, ClientError> {
        let size = [features[0].width(), features[0].height()];
        let extent = size.map(|n| n as u32);
        let texels = feature_texels(features).ok_or_else(|| out_of_memory(size))?;
        let mut pass = match last.filter(|last| Arc::ptr_eq(&last.gpu, gpu) && last.extent == extent) {
            Some(last) => last,
            None => Self::empty(gpu, extent)?,
        };
        pass.set_features(&texels)?;
        Ok(pass)
    }

    fn empty(gpu: &Arc<Gpu>, extent: [u32; 2]) -> Result<Self, GpuError> {
        let bytes = extent[0] as usize * extent[1] as usize * size_of::<[f32; 4]>();
        let upload = || Buffer::new(gpu, "halves for the noise filter", BufferUse::Upload, bytes);
        let weights = || Image::new(gpu, "noise filter: weights", TexelFormat::Rgba16F, extent);
        Ok(Self {
            gpu: gpu.clone(),
            extent,
            shaders: WaveletShaders::new(gpu),
            weights: (0..LEVELS).map(|_| weights()).collect::<Result<_, _>>()?,
            images: WaveletImages::new(gpu, extent)?,
            upload: [upload()?, upload()?],
            readback: Buffer::new(gpu, "filtered picture", BufferUse::Readback, bytes)?,
        })
    }

    /// Computes the weights.
    fn set_features(&mut self, features: &FeatureTexels) -> Result<(), GpuError> {
        let pipeline = self.shaders.weights.get(&[1], &[TexelFormat::Rgba16F])?;
        let image = || Image::new(&self.gpu, "features", TexelFormat::Rgba32F, self.extent);
        let mut images = [image()?, image()?, image()?];
        let upload = |texels: &Vec<_>| {
            Buffer::filled(&self.gpu, "features", BufferUse::Upload, bytemuck::cast_slice(texels))
        };
        let buffers = features.iter().map(upload).collect::<Result<Vec<_>, _>>()?;
        let mut frame = self.gpu.begin()?;
        let mut cmd = frame.cmd();
        let mut cmd = cmd.scope("features");
        for (image, buffer) in images.iter_mut().zip(&buffers) {
            cmd.copy_from_buffers(&[buffer], image);
            cmd.access(image, Access::Sampled);
        }
        let textures = images.each_ref().map(Texture::texels);
        for (level, weights) in self.weights.iter_mut().enumerate() {
            draw(&mut cmd, pipeline, push(self.extent, level), &textures, &mut [weights]);
        }
        drop(cmd);
        self.gpu.wait(frame.submit()?)
    }

    /// Filters a picture of this extent; waits for the device.
    ///
    /// # Errors
    ///
    /// [`ClientError::Memory`] if host memory runs out, and [`ClientError::Gpu`].
    pub fn filtered(&mut self, halves: [&HalfPicture; 2]) -> Result<Filtered, ClientError> {
        for (buffer, half) in self.upload.iter_mut().zip(halves) {
            buffer.mapped_mut().copy_from_slice(bytemuck::cast_slice(half.pixels()));
        }
        let gpu = self.gpu.clone();
        let mut frame = gpu.begin()?;
        let mut cmd = frame.cmd();
        self.record(&mut cmd.scope("noise filter"))?;
        gpu.wait(frame.submit()?)?;
        let texels: &[[f32; 4]] = bytemuck::cast_slice(self.readback.mapped());
        let size @ [width, height] = self.extent.map(|n| n as usize);
        let no_memory = || out_of_memory(size);
        let mut picture = Grid::try_filled(width, height, Vec3::ZERO).ok_or_else(no_memory)?;
        let mut finest = Grid::try_filled(width, height, 0.0).ok_or_else(no_memory)?;
        let out = picture.pixels_mut().iter_mut().zip(finest.pixels_mut());
        for ((xyz, gain), [x, y, z, w]) in out.zip(texels) {
            (*xyz, *gain) = (Vec3::new(*x, *y, *z), *w);
        }
        Ok(Filtered { picture, finest })
    }

    fn record(&mut self, cmd: &mut Cmd<'_>) -> Result<(), GpuError> {
        let Self { extent, shaders, weights, images, upload, readback, .. } = self;
        for (buffer, half) in upload.iter().zip(&mut images.halves) {
            cmd.copy_from_buffers(&[buffer], half);
            cmd.access(half, Access::Sampled);
        }
        images.separate(cmd, *extent, &mut shaders.separate)?;
        // Without feature weights, since across feature edges the bands of the filter are empty. Only the gain is used.
        let alike = WaveletLevel { level: 0, features: false };
        images.record_level(cmd, *extent, shaders, &weights[0], alike)?;
        std::mem::swap(&mut images.results[0], &mut images.finest);
        for (level, weights) in weights.iter().enumerate() {
            let level = WaveletLevel { level, features: true };
            images.record_level(cmd, *extent, shaders, weights, level)?;
            images.sums.swap(0, 1);
        }
        images.finish(cmd, *extent, &mut shaders.finish)?;
        cmd.copy_to_buffer(&mut images.band, 0, Region { origin: [0, 0], extent: *extent }, readback);
        Ok(())
    }
}

impl WaveletShaders {
    fn new(gpu: &Arc<Gpu>) -> Self {
        let make = |name, textures| ShaderVariants::new(gpu, name, size_of::<WaveletPush>(), textures);
        Self {
            weights: make("wavelet_weights.frag", 3),
            separate: make("wavelet_separate.frag", 2),
            smooth: make("wavelet_smooth.frag", 3),
            average: make("wavelet_average.frag", 2),
            shrink: make("wavelet_shrink.frag", 8),
            finish: make("wavelet_finish.frag", 7),
        }
    }
}

impl WaveletImages {
    fn new(gpu: &Arc<Gpu>, extent: [u32; 2]) -> Result<Self, GpuError> {
        let make = |name, format| Image::new(gpu, &format!("noise filter: {name}"), format, extent);
        let pair = |name| Ok([make(name, TexelFormat::Rgba32F)?, make(name, TexelFormat::Rgba32F)?]);
        Ok(Self {
            halves: pair("halves")?,
            sums: [pair("sums")?, pair("coarser sums")?],
            band: make("band", TexelFormat::Rgba32F)?,
            power: make("power", TexelFormat::Rg32F)?,
            means: make("means of power", TexelFormat::Rg32F)?,
            results: pair("result")?,
            aside: make("set aside", TexelFormat::Rgba32F)?,
            finest: make("finest gain", TexelFormat::Rgba32F)?,
        })
    }

    fn separate(
        &mut self,
        cmd: &mut Cmd<'_>,
        extent: [u32; 2],
        shader: &mut ShaderVariants,
    ) -> Result<(), GpuError> {
        let pipeline = shader.get(&[], &[TexelFormat::Rgba32F; 3])?;
        let [[a, b], _] = &mut self.sums;
        let textures = self.halves.each_ref().map(Texture::texels);
        draw(cmd, pipeline, push(extent, 0), &textures, &mut [a, b, &mut self.aside]);
        Ok(())
    }

    /// One level, from `sums[0]` to `sums[1]`; the accumulated result is in `results[0]` before and after.
    fn record_level(
        &mut self,
        cmd: &mut Cmd<'_>,
        extent: [u32; 2],
        shaders: &mut WaveletShaders,
        weights: &Image,
        WaveletLevel { level, features }: WaveletLevel,
    ) -> Result<(), GpuError> {
        let (push, features) = (push(extent, level), u32::from(features));
        let Self { sums: [here, coarser], band, power, means, results: [before, result], .. } = self;
        let weights = Texture::texels(weights);
        let [a, b] = here.each_ref().map(Texture::texels);

        let formats = [TexelFormat::Rgba32F, TexelFormat::Rgba32F, TexelFormat::Rgba32F, TexelFormat::Rg32F];
        let smooth = shaders.smooth.get(&[features], &formats)?;
        let [coarser_a, coarser_b] = coarser.each_mut();
        draw(cmd, smooth, push, &[a, b, weights], &mut [coarser_a, coarser_b, band, power]);

        let average = shaders.average.get(&[features], &[TexelFormat::Rg32F])?;
        draw(cmd, average, push, &[Texture::texels(power), weights], &mut [means]);

        let shrink = shaders.shrink.get(&[features, u32::from(level == 0)], &[TexelFormat::Rgba32F])?;
        // Not read at the first level, but every binding must be bound to an image that is ready.
        let before_or_band = if level == 0 { &*band } else { &*before };
        let [near_a, near_b] = coarser.each_ref().map(Texture::texels);
        let [means, band, before] = [&*means, &*band, before_or_band].map(Texture::texels);
        draw(cmd, shrink, push, &[means, weights, band, before, a, b, near_a, near_b], &mut [result]);
        self.results.swap(0, 1);
        Ok(())
    }

    /// Writes the denoised picture over the band. The sums are those of the coarsest level.
    fn finish(
        &mut self,
        cmd: &mut Cmd<'_>,
        extent: [u32; 2],
        shader: &mut ShaderVariants,
    ) -> Result<(), GpuError> {
        let pipeline = shader.get(&[], &[TexelFormat::Rgba32F])?;
        let Self { halves, sums: [sums, _], results: [result, _], band, aside, finest, .. } = self;
        let [[half_a, half_b], [a, b]] = [&*halves, &*sums].map(<[Image; 2]>::each_ref);
        let textures = [&*result, aside, finest, a, b, half_a, half_b].map(Texture::texels);
        draw(cmd, pipeline, push(extent, 0), &textures, &mut [band]);
        Ok(())
    }
}

fn push(extent: [u32; 2], level: usize) -> WaveletPush {
    WaveletPush { extent: extent.map(|n| n as i32), step: 1 << level, padding: 0 }
}

/// Draws into images and makes them ready to be sampled.
fn draw(
    cmd: &mut Cmd<'_>,
    pipeline: &Pipeline,
    push: WaveletPush,
    textures: &[Texture<'_>],
    targets: &mut [&mut Image],
) {
    for target in targets.iter_mut() {
        cmd.access(target, Access::ColorWrite);
    }
    let attachments: Vec<_> = targets.iter().map(|target| Attachment::whole(target)).collect();
    cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), textures, &attachments);
    for target in targets {
        cmd.access(target, Access::Sampled);
    }
}
