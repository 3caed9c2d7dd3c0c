//! One repaint: mips, reconstruction, regions, glare, post-processes, tone mapping, and readback. Where there are two eyes, each pass draws
//! both as layers of one image; at the end they become one picture.

use std::sync::Arc;

use glam::Vec3;

use crate::client::background::BackgroundPolicy;
use crate::client::compiled_effects::Effects;
use crate::client::error::ClientError;
use crate::client::layout::{BilateralPush, ReconstructPush};
use crate::client::lod::StreamLod;
use crate::client::pass::CompilePolicy;
use crate::client::pass::adaptive_filter::{AdaptiveFilterPass, AdaptiveInput};
use crate::client::pass::bilateral::BilateralPass;
use crate::client::pass::compose::{ComposePass, PictureLayer};
use crate::client::pass::error_view::ErrorViewPass;
use crate::client::pass::glare::{GlarePass, glare_detail};
use crate::client::pass::images::{PictureImages, StreamImages};
use crate::client::pass::mips::MipsPass;
use crate::client::pass::reconstruct::{FilteredSums, ReconstructPass, StreamInput, levels_needed};
use crate::client::pass::stereo::{StereoPass, composed_extent};
use crate::client::pass::tonemap::TonemapPass;
use crate::client::post_process::{PictureGrid, PostPasses};
use crate::client::readback::Readback;
use crate::client::settings::{ColorOutput, DisplayImage, DisplayView, FilmSpec, Settings};
use crate::color::pq;
use crate::gpu::{Access, Attachment, Buffer, BufferUse, Cmd, Gpu, Image, Region, TexelFormat, read_image};
use crate::image::Grid;
use crate::image::stereo::Eye;

/// Camera and light, each with its level of detail; `None` without samples.
type Streams<'a> = [Option<(&'a mut StreamImages, StreamLod)>; 2];

/// Sums displayed by a repaint.
pub struct FilmSums<'a> {
    /// Their extent, which may be smaller than the picture's, and their filter.
    pub spec: FilmSpec,
    /// Camera and light.
    pub streams: Streams<'a>,
    /// Texels within the picture / light paths; 0 while there are none.
    pub light_scale: f32,
    /// 1 / luminance scale, a power of two.
    pub inverse_scale: f32,
}

/// The passes from sums to picture and their images, created with the first repaint.
pub struct Repaint {
    gpu: Arc<Gpu>,
    spec: FilmSpec,
    mips: MipsPass,
    adaptive_filter: AdaptiveFilterPass,
    bilateral: BilateralPass,
    reconstruct: ReconstructPass,
    error_view: ErrorViewPass,
    compose: ComposePass,
    glare: GlarePass,
    post: PostPasses,
    tonemap: TonemapPass,
    /// Where there are two eyes.
    stereo: Option<StereoPass>,
    picture: PictureImages,
    /// Whether a repaint blocks on tables that take long to compute.
    pub policy: BackgroundPolicy,
    /// Whether glare was on in the last repaint.
    shows_glare: bool,
    compiling: CompilePolicy,
    /// Whether there was a repaint, and whether the last one was skipped for a pipeline being compiled.
    drawn: bool,
    gave_up: bool,
}

impl Repaint {
    /// Creates the passes for this film of so many eyes; images are allocated on first use.
    pub fn new(gpu: &Arc<Gpu>, spec: FilmSpec, eyes: u32) -> Self {
        let compiling = CompilePolicy::for_layers(eyes);
        Self {
            gpu: gpu.clone(),
            spec,
            mips: MipsPass::new(gpu, &compiling),
            adaptive_filter: AdaptiveFilterPass::new(gpu, &compiling),
            bilateral: BilateralPass::new(gpu, &compiling),
            reconstruct: ReconstructPass::new(gpu, &compiling),
            error_view: ErrorViewPass::new(gpu, &compiling),
            compose: ComposePass::new(gpu, &compiling),
            glare: GlarePass::new(gpu),
            post: PostPasses::new(gpu, &compiling),
            tonemap: TonemapPass::new(gpu, &compiling),
            stereo: (eyes > 1).then(|| StereoPass::new(gpu, &compiling)),
            picture: PictureImages::new([spec.width, spec.height], eyes),
            policy: BackgroundPolicy::Block,
            shows_glare: false,
            compiling,
            drawn: false,
            gave_up: false,
        }
    }

    /// Records everything up to the encoded picture; `detail` as in
    /// [`VulkanFilm::paint`](crate::client::film::VulkanFilm::paint).
    pub fn paint(
        &mut self,
        cmd: &mut Cmd<'_>,
        sums: FilmSums<'_>,
        settings: &Settings,
        detail: u32,
        regions: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let effects = self.effects(settings, detail);
        self.attempt(&effects, |this| {
            this.record(cmd, sums, settings, &effects)?;
            this.finish(cmd, settings, &effects, regions)
        })
    }

    /// Records regions, glare, post-processes and encoding of the picture of each eye (scene-linear XYZ, the film's size) instead of the
    /// reconstructed sums.
    pub fn paint_filtered(
        &mut self,
        cmd: &mut Cmd<'_>,
        pictures: &[&Grid<Vec3>],
        settings: &Settings,
        regions: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let effects = self.effects(settings, 1);
        self.attempt(&effects, |this| {
            this.upload(cmd, pictures, &effects)?;
            this.finish(cmd, settings, &effects, regions)
        })
    }

    /// Records glare, post-processes and encoding of the sum of these layers, all at the same internal resolution.
    pub fn paint_sum(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        detail: u32,
        layers: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let effects = self.effects(settings, detail);
        self.attempt(&effects, |this| {
            let (xyz, _) = this.picture.get(&this.gpu, &effects)?;
            match layers.is_empty() {
                true => clear(cmd, xyz),
                false => this.compose.sum(cmd, layers, effects.detail, xyz)?,
            }
            this.finish(cmd, settings, &effects, &mut [])
        })
    }

    /// The encoded picture after `draw` has recorded it; the previous one while a pipeline is compiled on another thread.
    fn attempt(
        &mut self,
        effects: &Effects,
        draw: impl FnOnce(&mut Self) -> Result<(), ClientError>,
    ) -> Result<&mut Image, ClientError> {
        let waits = self.gave_up && self.compiling.is_aside() && self.gpu.is_compiling();
        if !waits {
            let outcome = draw(self);
            self.gave_up = matches!(&outcome, Err(ClientError::Gpu(error)) if error.is_compiling());
            if !self.gave_up {
                outcome?;
                self.drawn = true;
            }
        }
        match self.stereo.as_mut().and_then(StereoPass::composed) {
            Some(composed) => Ok(composed),
            None => Ok(self.picture.get(&self.gpu, effects)?.1),
        }
    }

    /// Whether the last repaint left the previous picture in place because a pipeline is being compiled.
    pub fn has_given_up(&self) -> bool {
        self.gave_up
    }

    /// Records everything up to the scene-linear picture (XYZ) before glare and tone curve.
    pub fn linear(
        &mut self,
        cmd: &mut Cmd<'_>,
        sums: FilmSums<'_>,
        settings: &Settings,
        detail: u32,
    ) -> Result<&mut Image, ClientError> {
        let effects = self.effects(settings, detail);
        self.compiling.set_aside(false);
        self.record(cmd, sums, settings, &effects)?;
        Ok(self.picture.get(&self.gpu, &effects)?.0)
    }

    /// As [`linear`](Self::linear), with this picture instead of the reconstructed sums.
    pub fn linear_filtered(
        &mut self,
        cmd: &mut Cmd<'_>,
        picture: &Grid<Vec3>,
        settings: &Settings,
        detail: u32,
    ) -> Result<&mut Image, ClientError> {
        let effects = self.effects(settings, detail);
        self.upload(cmd, &[picture], &effects)?;
        Ok(self.picture.get(&self.gpu, &effects)?.0)
    }

    /// Records the upload of a denoised picture for each eye.
    fn upload(
        &mut self,
        cmd: &mut Cmd<'_>,
        pictures: &[&Grid<Vec3>],
        effects: &Effects,
    ) -> Result<(), ClientError> {
        let upload = |picture: &&Grid<Vec3>| {
            let texels = coarse_texels(picture, effects.detail as usize);
            Buffer::filled(&self.gpu, "filtered", BufferUse::Upload, bytemuck::cast_slice(&texels))
        };
        let buffers = pictures.iter().map(upload).collect::<Result<Vec<_>, _>>()?;
        let (xyz, _) = self.picture.get(&self.gpu, effects)?;
        cmd.scope("copy").copy_from_buffers(&buffers.iter().collect::<Vec<_>>(), xyz);
        Ok(())
    }

    /// Composes the regions into the picture, adds glare and post-processes if enabled, and encodes it.
    fn finish(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        effects: &Effects,
        regions: &mut [PictureLayer<'_>],
    ) -> Result<(), ClientError> {
        let (xyz, _) = self.picture.get(&self.gpu, effects)?;
        for region in regions {
            self.compose.mean(cmd, region, effects.detail, xyz)?;
        }
        self.glare_and_post_processes(cmd, settings, effects)?;
        let (xyz, encoded) = self.picture.get(&self.gpu, effects)?;
        self.tonemap.record(cmd, effects, settings, xyz, encoded)?;
        if let Some(stereo) = &mut self.stereo {
            stereo.record(cmd, settings, encoded)?;
        }
        Ok(())
    }

    /// Records glare and post-processes of the picture, if enabled.
    fn glare_and_post_processes(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        effects: &Effects,
    ) -> Result<(), ClientError> {
        self.shows_glare = effects.glare;
        if let Some(glare) = settings.glare.filter(|_| effects.glare) {
            let (xyz, _) = self.picture.get(&self.gpu, effects)?;
            self.glare.record(cmd, xyz, &glare, self.policy)?;
        }
        if let Some((post, picture)) = effects.post(settings).zip(self.picture.pair()) {
            let extent = [self.spec.width, self.spec.height];
            self.post.record(cmd, post, PictureGrid { extent, detail: effects.detail }, picture)?;
        }
        Ok(())
    }

    /// Whether anything computed in the background is ready.
    pub fn is_background_ready(&self) -> bool {
        self.shows_glare && self.glare.is_ready()
    }

    /// Effects of a repaint at this internal resolution. Pipelines are compiled on another thread if the caller does not block and there is
    /// a picture to show meanwhile.
    fn effects(&self, settings: &Settings, detail: u32) -> Effects {
        let in_time = if self.policy == BackgroundPolicy::BackgroundCoarse { 2 } else { 1 };
        let possible =
            settings.glare.map_or(1, |_| glare_detail(&self.gpu, [self.spec.width, self.spec.height]));
        let effects = Effects::with_glare_at(settings, detail, in_time.max(possible));
        let aside = self.policy != BackgroundPolicy::Block && self.drawn && self.picture.holds(&effects);
        self.compiling.set_aside(aside);
        effects
    }

    /// The encoded picture of the last repaint; `None` before the first.
    pub fn painted(&mut self) -> Option<&mut Image> {
        match self.stereo.as_mut().and_then(StereoPass::composed) {
            Some(composed) => Some(composed),
            None => self.picture.painted(),
        }
    }

    /// Displayed texels of one eye in the last repaint within a rectangle; `None` before the first. Waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn shown(&mut self, eye: Eye, region: Region) -> Result<Option<ShownTexels>, ClientError> {
        let gpu = self.gpu.clone();
        let Some((xyz, detail, encoded)) = self.picture.shown() else { return Ok(None) };
        let layer = (eye as u32).min(encoded.layers() - 1);
        let Region { origin: [x, y], extent: [width, height] } = region;
        let first = [x / detail, y / detail];
        let last = [(x + width - 1) / detail, (y + height - 1) / detail];
        let coarse = [last[0] - first[0] + 1, last[1] - first[1] + 1];
        let texels = floats(&read_image(&gpu, xyz, layer, Region { origin: first, extent: coarse })?);
        let texel = |x: u32, y: u32| {
            let at = 4 * ((y / detail - first[1]) * coarse[0] + x / detail - first[0]) as usize;
            [texels[at], texels[at + 1], texels[at + 2]]
        };
        let rows = y..y + height;
        let xyz = rows.flat_map(|y| (x..x + width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        let format = encoded.format();
        let displayed = decoded(format, &read_image(&gpu, encoded, layer, region)?);
        Ok(Some(ShownTexels { xyz, displayed }))
    }

    /// The encoded picture in 8 bits, whatever the format of the window; that of two eyes is composed [in one
    /// picture](crate::image::stereo::StereoLayout::in_one_picture).
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] if memory runs out or the device is lost, [`ClientError::NoVariance`] if the settings need a variance that the
    /// film does not accumulate.
    pub fn display(
        &mut self,
        sums: FilmSums<'_>,
        settings: &Settings,
    ) -> Result<Readback<DisplayImage>, ClientError> {
        let gpu = self.gpu.clone();
        self.policy = BackgroundPolicy::Block;
        let stereo = settings.stereo.in_one_picture();
        let settings = Settings { output: ColorOutput::Sdr, stereo, ..settings.clone() };
        let [width, height] = match &self.stereo {
            Some(_) => composed_extent(settings.stereo, [self.spec.width, self.spec.height])?,
            None => [self.spec.width, self.spec.height],
        };
        let bytes = width as usize * height as usize * TexelFormat::Rgba8.bytes();
        let buffer = Buffer::new(&gpu, "picture readback", BufferUse::Readback, bytes)?;
        let mut frame = gpu.begin()?;
        let cmd = &mut frame.cmd();
        let encoded = self.paint(cmd, sums, &settings, 1, &mut [])?;
        let whole = Region { origin: [0, 0], extent: [width, height] };
        cmd.scope("readback").copy_to_buffer(encoded, 0, whole, &buffer);
        let number = frame.submit()?;
        Ok(Readback::new(move || {
            gpu.wait(number)?;
            let rgb = buffer.mapped().chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect();
            Ok(DisplayImage { width, height, rgb })
        }))
    }

    /// One eye's picture before the tone curve, scene-linear `[X, Y, Z]`, of `⌈size / detail⌉` pixels; waits for the GPU.
    pub fn reconstruct(
        &mut self,
        sums: FilmSums<'_>,
        settings: &Settings,
        detail: u32,
        eye: Eye,
    ) -> Result<Vec<[f32; 3]>, ClientError> {
        let gpu = self.gpu.clone();
        let effects = self.effects(settings, detail);
        self.policy = BackgroundPolicy::Block;
        self.compiling.set_aside(false);
        let mut frame = gpu.begin()?;
        self.record(&mut frame.cmd(), sums, settings, &effects)?;
        self.glare_and_post_processes(&mut frame.cmd(), settings, &effects)?;
        frame.submit()?;
        let (xyz, _) = self.picture.get(&gpu, &effects)?;
        let layer = (eye as u32).min(xyz.layers() - 1);
        let bytes = read_image(&gpu, xyz, layer, region(&self.spec, effects.detail))?;
        Ok(floats(&bytes).chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect())
    }

    /// Records mips, noise masking and reconstruction, or the error view; black without samples.
    fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        mut sums: FilmSums<'_>,
        settings: &Settings,
        effects: &Effects,
    ) -> Result<(), ClientError> {
        let (kind, variance) = (effects.reconstruction(settings), effects.reads_variance());
        if variance && self.spec.variance.is_none() {
            return Err(ClientError::NoVariance);
        }
        // Texels of the sums per drawn pixel.
        let texels = |picture: u32, sums: u32| effects.detail as f32 * (sums as f32 / picture as f32);
        let texels = [texels(self.spec.width, sums.spec.width), texels(self.spec.height, sums.spec.height)];
        let pixel = texels[0].min(texels[1]).round() as u32;
        for (light, stream) in [false, true].into_iter().zip(&mut sums.streams) {
            let Some((images, lod)) = stream else { continue };
            *lod = lod.coarsened(pixel);
            // The sums may be undefined, if the batch that created the images could not be drawn.
            images.define(cmd);
            if effects.adapts(&sums.spec, light) {
                self.mips.record(cmd, images, 1, false)?;
                continue;
            }
            let levels = levels_needed(kind, variance, lod);
            self.mips.record(cmd, images, levels, variance)?;
            if effects.masking.is_some() && !effects.bilateral(lod) && !self.gpu.fetches_any_level() {
                images.fill_atlas(&self.gpu, cmd)?;
            }
        }
        let (target, _) = self.picture.get(&self.gpu, effects)?;
        let shown = match effects.view {
            DisplayView::Picture | DisplayView::FalseColor | DisplayView::Clipping => {
                sums.streams.iter().flatten().next()
            }
            DisplayView::CameraVariance => sums.streams[0].as_ref(),
            DisplayView::LightVariance => sums.streams[1].as_ref(),
        };
        let Some(max_level) = shown.map(|(_, lod)| lod.max_level) else {
            // Without samples the picture is black.
            clear(cmd, target);
            return Ok(());
        };
        let push = ReconstructPush {
            pad: sums.spec.pad() as f32,
            light_scale: sums.light_scale,
            noise_masking: settings.vm,
            max_level,
            energy: sums.spec.filter.energy(),
            inverse_scale: sums.inverse_scale,
            texels,
            ..ReconstructPush::default()
        };
        if effects.view.is_error() {
            let light = effects.view == DisplayView::LightVariance;
            if let Some((images, lod)) = &sums.streams[usize::from(light)] {
                self.error_view.record(cmd, images, *lod, light, push, target)?;
            }
            return Ok(());
        }
        for (light, stream) in [false, true].into_iter().zip(&sums.streams) {
            let Some((images, lod)) = stream else { continue };
            if effects.adapts(&sums.spec, light) {
                let input = AdaptiveInput {
                    sums: images.color.sums(),
                    pad: sums.spec.pad(),
                    extent: [sums.spec.width, sums.spec.height],
                    inverse_scale: sums.inverse_scale,
                    finest: pixel.max(1).ilog2(),
                };
                self.adaptive_filter.record(cmd, input)?;
                continue;
            }
            if !effects.bilateral(lod) {
                continue;
            }
            let push = BilateralPush {
                variance_lod: lod.variance,
                noise_masking: push.noise_masking,
                max_level: lod.max_level,
                energy: push.energy,
                inverse_scale: push.inverse_scale,
            };
            self.bilateral.record(cmd, images, light, &push)?;
        }
        let input = |light: bool| {
            let (images, lod) = sums.streams[usize::from(light)].as_ref()?;
            let filtered = match effects.adapts(&sums.spec, light) {
                true => self.adaptive_filter.filtered().map(FilteredSums::Adaptive),
                false if effects.bilateral(lod) => {
                    self.bilateral.filtered(light).map(FilteredSums::Bilateral)
                }
                false => None,
            };
            Some(StreamInput { images, lod: *lod, filtered })
        };
        let streams = [input(false), input(true)];
        Ok(self.reconstruct.record(cmd, streams, kind, settings.kernel, push, target)?)
    }
}

/// Clears a picture to black.
fn clear(cmd: &mut Cmd<'_>, target: &mut Image) {
    cmd.access(target, Access::ColorWrite);
    cmd.rendering(&[Attachment::cleared(target)], |_| ());
}

/// The whole picture, in texels of this internal resolution.
fn region(spec: &FilmSpec, detail: u32) -> Region {
    Region { origin: [0, 0], extent: [spec.width, spec.height].map(|n| n.div_ceil(detail)) }
}

/// Averages over squares of `detail` pixels, as texels of an image.
fn coarse_texels(picture: &Grid<Vec3>, detail: usize) -> Vec<[f32; 4]> {
    let (width, height) = (picture.width(), picture.height());
    let texel = |x: usize, y: usize| {
        let (columns, rows) = (x..(x + detail).min(width), y..(y + detail).min(height));
        let count = columns.len() * rows.len();
        let sum: Vec3 = rows.flat_map(|y| columns.clone().map(move |x| picture.at(x, y))).sum();
        (sum / count as f32).extend(1.0).to_array()
    };
    let row = |y| (0..width).step_by(detail).map(move |x| texel(x, y));
    (0..height).step_by(detail).flat_map(row).collect()
}

/// A rectangle of the displayed picture, row-major from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShownTexels {
    /// Scene-linear X, Y, Z before the tone curve.
    pub xyz: Vec<[f32; 3]>,
    /// Displayed R, G, B, encoded as in 8 bits; 1 is diffuse white, which HDR displays exceed.
    pub displayed: Vec<[f32; 3]>,
}

/// Decodes the texels of an encoded picture.
fn decoded(format: TexelFormat, bytes: &[u8]) -> Vec<[f32; 3]> {
    let encoded = |nits: f32| (nits.max(0.0) / pq::DIFFUSE_WHITE).powf(1.0 / 2.2);
    let texel = |bytes: &[u8]| match format {
        TexelFormat::Rgb10A2 => {
            let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            let signal = |shift: u32| (word >> shift & 1023) as f32 / 1023.0;
            [0, 10, 20].map(|shift| encoded(pq::decode(signal(shift)) * pq::PQ_PEAK))
        }
        TexelFormat::Rgba16F => {
            let linear = |i: usize| half::f16::from_le_bytes([bytes[i], bytes[i + 1]]).to_f32();
            [0, 2, 4].map(|i| encoded(linear(i) * pq::SCRGB_WHITE))
        }
        _ => [0, 1, 2].map(|i| f32::from(bytes[i]) / 255.0),
    };
    bytes.chunks_exact(format.bytes()).map(texel).collect()
}

/// Reinterprets bytes written by the GPU as floats.
pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect()
}
