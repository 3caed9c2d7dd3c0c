//! One repaint: mips, reconstruction, tone map, and the way back to the host.

use std::sync::Arc;

use crate::client::effects::Effects;
use crate::client::error::ClientError;
use crate::client::layout::ReconstructPush;
use crate::client::lod::StreamLod;
use crate::client::pass::images::{PictureImages, StreamImages};
use crate::client::pass::mips::MipsPass;
use crate::client::pass::reconstruct::{ReconstructPass, StreamInput, levels_needed};
use crate::client::pass::tonemap::TonemapPass;
use crate::client::settings::{DisplayImage, FilmSpec, Output, Settings};
use crate::gpu::{Access, Buffer, BufferUse, Cmd, Format, Gpu, Image, Load, Region, Target, read_image};

/// The sums that a repaint shows.
pub struct Sums<'a> {
    /// Camera and light, each with its level of detail; `None` without samples.
    pub streams: [Option<(&'a mut StreamImages, StreamLod)>; 2],
    /// Texels of the picture / light paths; 0 while there are none.
    pub light_scale: f32,
    /// 1 / luminance scale, a power of two.
    pub inverse_scale: f32,
}

/// The passes from sums to picture, with the images that they draw into; made with the first repaint.
pub struct Repaint {
    gpu: Arc<Gpu>,
    spec: FilmSpec,
    mips: MipsPass,
    reconstruct: ReconstructPass,
    tonemap: TonemapPass,
    picture: PictureImages,
    readback: Buffer,
}

impl Repaint {
    /// Makes passes for this film; images are made when they are drawn into first.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory.
    pub fn new(gpu: &Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        let bytes = spec.width as usize * spec.height as usize * Format::Rgba8.bytes();
        Ok(Self {
            gpu: gpu.clone(),
            spec,
            mips: MipsPass::default(),
            reconstruct: ReconstructPass::default(),
            tonemap: TonemapPass::default(),
            picture: PictureImages::new([spec.width, spec.height]),
            readback: Buffer::new(gpu, "picture readback", BufferUse::Readback, bytes)?,
        })
    }

    /// Records everything up to the encoded picture; `detail` as in
    /// [`VulkanFilm::paint`](crate::client::film::VulkanFilm::paint).
    ///
    /// # Errors
    ///
    /// As [`display`](Self::display).
    pub fn paint(
        &mut self,
        cmd: &mut Cmd<'_>,
        sums: Sums<'_>,
        settings: &Settings,
        detail: u32,
    ) -> Result<&mut Image, ClientError> {
        let effects = Effects::new(settings, detail);
        self.record(cmd, sums, settings, &effects)?;
        let (xyz, encoded) = self.picture.get(&self.gpu, &effects)?;
        self.tonemap.record(&self.gpu, cmd, [xyz, &mut *encoded], (&effects, settings))?;
        Ok(encoded)
    }

    /// The encoded picture as it was painted last; `None` before the first time.
    pub fn painted(&mut self) -> Option<&mut Image> {
        self.picture.painted()
    }

    /// The encoded picture in 8 bits, whatever the window shows; waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory or the device was lost.
    pub fn display(&mut self, sums: Sums<'_>, settings: &Settings) -> Result<DisplayImage, ClientError> {
        let gpu = self.gpu.clone();
        let settings = Settings { output: Output::Sdr, ..settings.clone() };
        let mut frame = gpu.begin()?;
        let cmd = &mut frame.cmd();
        self.paint(cmd, sums, &settings, 1)?;
        let (_, encoded) = self.picture.get(&self.gpu, &Effects::new(&settings, 1))?;
        cmd.scope("readback").copy_to_buffer(encoded, region(&self.spec, 1), &self.readback);
        gpu.wait(frame.submit()?)?;
        let rgb = self.readback.mapped().chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect();
        Ok(DisplayImage { width: self.spec.width, height: self.spec.height, rgb })
    }

    /// The picture before the tone curve, scene-linear `[X, Y, Z]`, of `⌈size / detail⌉` pixels; waits for the GPU.
    ///
    /// # Errors
    ///
    /// As [`display`](Self::display).
    pub fn reconstruct(
        &mut self,
        sums: Sums<'_>,
        settings: &Settings,
        detail: u32,
    ) -> Result<Vec<[f32; 3]>, ClientError> {
        let gpu = self.gpu.clone();
        let effects = Effects::new(settings, detail);
        let mut frame = gpu.begin()?;
        self.record(&mut frame.cmd(), sums, settings, &effects)?;
        frame.submit()?;
        let (xyz, _) = self.picture.get(&gpu, &effects)?;
        let bytes = read_image(&gpu, xyz, region(&self.spec, effects.detail))?;
        Ok(floats(&bytes).chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect())
    }

    /// Mips and reconstruction; black without samples.
    fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        mut sums: Sums<'_>,
        settings: &Settings,
        effects: &Effects,
    ) -> Result<(), ClientError> {
        let (kind, masking) = (effects.reconstruction(settings), settings.vm > 0.0);
        for (images, lod) in sums.streams.iter_mut().flatten() {
            *lod = lod.coarsened(effects.detail);
            // Sums that were never written, because the batch that made the images could not be drawn.
            images.define(cmd);
            let levels = levels_needed(kind, masking, lod);
            self.mips.record(&self.gpu, cmd, images, levels, masking)?;
            if masking {
                images.fill_atlas(&self.gpu, cmd)?;
            }
        }
        let (target, _) = self.picture.get(&self.gpu, effects)?;
        let Some(max_level) = sums.streams.iter().flatten().map(|(_, lod)| lod.max_level).next() else {
            cmd.access(target, Access::ColorWrite);
            cmd.rendering(&[Target { image: target, level: 0, load: Load::Clear }], |_| ());
            return Ok(());
        };
        let push = ReconstructPush {
            inverse_target: self.spec.padded_extent().map(|n| 1.0 / n as f32),
            pad: self.spec.pad() as f32,
            light_scale: sums.light_scale,
            noise_masking: settings.vm,
            max_level,
            energy: self.spec.filter.energy(),
            inverse_scale: sums.inverse_scale,
            detail: effects.detail as f32,
            ..ReconstructPush::default()
        };
        let streams = sums.streams.map(|stream| stream.map(|(images, lod)| StreamInput { images, lod }));
        self.reconstruct.record(&self.gpu, cmd, streams, (kind, push), target)?;
        Ok(())
    }
}

/// The whole picture at this internal resolution.
fn region(spec: &FilmSpec, detail: u32) -> Region {
    Region { origin: [0, 0], extent: [spec.width, spec.height].map(|n| n.div_ceil(detail)) }
}

/// What the GPU has written, as numbers.
pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect()
}
