//! The film on a Vulkan device: accumulators, batches and the order of the passes.

use std::sync::Arc;
use std::time::Duration;

use glam::Vec3;

use crate::client::Film;
use crate::client::background::BackgroundPolicy;
use crate::client::error::ClientError;
use crate::client::pass::compose::PictureLayer;
use crate::client::pass::images::StreamImages;
use crate::client::pass::repaint::{FilmSums, Repaint, ShownTexels, floats};
use crate::client::raster::{Raster, Streams};
use crate::client::settings::{DisplayImage, FilmCounts, FilmData, FilmSpec, Settings};
use crate::client::state::FilmState;
use crate::gpu::{Cmd, FrameNumber, Gpu, Image, Region, read_image};
use crate::image::Grid;
use crate::stream::{PathCounts, Sample};

/// A film on a Vulkan device; [`ReferenceFilm`](crate::client::reference::ReferenceFilm) is its reference.
///
/// The same samples in the same order give the same bits on the same device, however they are split into calls.
pub struct VulkanFilm {
    gpu: Arc<Gpu>,
    state: FilmState,
    raster: Raster,
    /// Camera and light; made with the stream's first sample.
    streams: Streams,
    /// Made with the first repaint.
    repaint: Option<Repaint>,
    /// Whether [`paint`](Self::paint) waits for tables that take long to make.
    policy: BackgroundPolicy,
    /// Whether only full batches are rasterised.
    keep_batch: bool,
    /// A batch was lost since the last clear.
    damaged: bool,
}

impl VulkanFilm {
    /// An empty film.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Gpu`] when there is no memory.
    pub fn new(gpu: Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        let state = FilmState::new(spec)?;
        let raster = Raster::device(&gpu)?;
        Ok(Self::with_raster(gpu, state, raster))
    }

    /// As [`new`](Self::new), with sums that the processor makes, as the reference does: for devices that are the processor. Its bits
    /// are not those of the device's passes.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`].
    pub fn summed_on_host(gpu: Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        let raster = Raster::host(&gpu);
        Ok(Self::with_raster(gpu, FilmState::new(spec)?, raster))
    }

    fn with_raster(gpu: Arc<Gpu>, state: FilmState, raster: Raster) -> Self {
        Self {
            gpu,
            state,
            raster,
            streams: [None, None],
            repaint: None,
            policy: BackgroundPolicy::Block,
            keep_batch: false,
            damaged: false,
        }
    }

    /// The specification of the film.
    pub fn spec(&self) -> &FilmSpec {
        self.state.spec()
    }

    /// Samples of the batch, which [`flush`](Self::flush) would rasterise.
    pub fn waiting(&self) -> usize {
        self.state.waiting()
    }

    /// Whether a batch was lost to an error since the last clear: the counts and paths are those of more samples than the sums.
    pub fn is_damaged(&self) -> bool {
        self.damaged
    }

    /// The frame that rasterises the last batch.
    pub fn rasterised(&self) -> FrameNumber {
        self.raster.rasterised()
    }

    /// Samples that the processor has drawn since the last call, and how long it took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        self.raster.take_host_time()
    }

    /// Whether the camera and the light stream have images, because they had a sample.
    pub fn allocated_streams(&self) -> [bool; 2] {
        [self.streams[0].is_some(), self.streams[1].is_some()]
    }

    /// Records into `cmd` what [`display`](Self::display) does, without reading back: the encoded picture, to be drawn into a
    /// window. The batch must have been flushed before the frame was begun.
    ///
    /// `detail` is the internal resolution, picture pixels per reconstructed one and axis: 1, 2 or 4. Above 1 the blur is
    /// computed on a coarser grid and interpolated; the encoded picture has full size. `regions` of the picture, of the same internal
    /// resolution, are drawn into it.
    pub fn paint(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        detail: u32,
        regions: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let policy = self.policy;
        self.raster.complete(cmd, self.state.spec(), &mut self.streams)?;
        let (repaint, sums) = self.sums()?;
        repaint.policy = policy;
        repaint.paint(cmd, sums, settings, detail, regions)
    }

    /// As [`paint`](Self::paint), with the sum of these layers, of the same internal resolution, in the place of what the sums give.
    pub fn paint_sum(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        detail: u32,
        layers: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let policy = self.policy;
        let (repaint, _) = self.sums()?;
        repaint.policy = policy;
        repaint.paint_sum(cmd, settings, detail, layers)
    }

    /// Records the picture before glare and tone curve, scene-linear XYZ, where this film is a region of another one's picture: that of
    /// the sums, or the `filtered` one that a noise filter has made of the same samples.
    pub fn linear(
        &mut self,
        cmd: &mut Cmd<'_>,
        filtered: Option<&Grid<Vec3>>,
        settings: &Settings,
        detail: u32,
    ) -> Result<&mut Image, ClientError> {
        let policy = self.policy;
        if filtered.is_none() {
            self.raster.complete(cmd, self.state.spec(), &mut self.streams)?;
        }
        let (repaint, sums) = self.sums()?;
        repaint.policy = policy;
        match filtered {
            Some(picture) => repaint.linear_filtered(cmd, picture, settings, detail),
            None => repaint.linear(cmd, sums, settings, detail),
        }
    }

    /// As [`paint`](Self::paint) at full resolution, with this picture, scene-linear XYZ of the film's size, in the place of what the sums
    /// give: one that a noise filter has made of the same samples.
    pub fn paint_filtered(
        &mut self,
        cmd: &mut Cmd<'_>,
        picture: &Grid<Vec3>,
        settings: &Settings,
        regions: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let policy = self.policy;
        let (repaint, _) = self.sums()?;
        repaint.policy = policy;
        repaint.paint_filtered(cmd, picture, settings, regions)
    }

    /// Whether the sums are in memory: [`develop`](Film::develop) waits for no device.
    pub fn is_summed_on_host(&self) -> bool {
        self.raster.host_sums().is_some()
    }

    /// Whether [`paint`](Self::paint) waits for tables that take long to make, as it does at first, or shows the picture
    /// without them meanwhile; [`display`](Self::display) always waits.
    pub fn set_background_policy(&mut self, policy: BackgroundPolicy) {
        self.policy = policy;
    }

    /// Whether something is being made in the background that [`paint`](Self::paint) went without.
    pub fn awaits_background(&self) -> bool {
        self.repaint.as_ref().is_some_and(Repaint::awaits_background)
    }

    /// Whether it is ready: the next [`paint`](Self::paint) shows another picture.
    pub fn is_background_ready(&self) -> bool {
        self.repaint.as_ref().is_some_and(Repaint::is_background_ready)
    }

    /// Whether the last [`paint`](Self::paint) left the picture of before, because one of its pipelines is compiled on another thread.
    pub fn has_given_up(&self) -> bool {
        self.repaint.as_ref().is_some_and(Repaint::has_given_up)
    }

    /// The encoded picture of the last [`paint`](Self::paint), to be shown again; `None` before the first.
    pub fn painted(&mut self) -> Option<&mut Image> {
        self.repaint.as_mut().and_then(Repaint::painted)
    }

    /// The sum of the weights of the camera samples at a pixel: their number, where they have weight 1. Waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn weight_at(&mut self, pixel: [u32; 2]) -> Result<f32, ClientError> {
        let pad = self.state.spec().pad();
        let texel = pixel.map(|at| at + pad);
        let sum = match self.raster.host_sums() {
            Some(sums) => sums.stream(0).and_then(|sums| sums.color_at(texel)),
            None => {
                let region = Region { origin: texel, extent: [1, 1] };
                self.develop_region(region)?.camera.first().copied()
            }
        };
        Ok(sum.map_or(0.0, |sum| sum[3]))
    }

    /// What the last [`paint`](Self::paint) shows within a rectangle of the picture; `None` before the first. Waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn shown(&mut self, region: Region) -> Result<Option<ShownTexels>, ClientError> {
        self.repaint.as_mut().map_or(Ok(None), |repaint| repaint.shown(region))
    }

    /// The reconstructed picture before the tone curve: scene-linear `[X, Y, Z]` of `⌈size / detail⌉` pixels, `[height][width]`, as
    /// [`paint`](Self::paint) computes it before interpolation; waits for the GPU.
    pub fn reconstruct(&mut self, settings: &Settings, detail: u32) -> Result<Vec<[f32; 3]>, ClientError> {
        let (repaint, sums) = self.repaint()?;
        repaint.reconstruct(sums, settings, detail)
    }

    /// The sums with the overscan around the picture, `width` and `height` being those of the padded target.
    pub fn develop_padded(&mut self) -> Result<FilmData, ClientError> {
        self.complete()?;
        if let Some(sums) = self.raster.host_sums() {
            return Ok(sums.develop(&self.state, 0));
        }
        self.develop_region(Region { origin: [0, 0], extent: self.state.spec().padded_extent() })
    }

    fn develop_region(&mut self, region: Region) -> Result<FilmData, ClientError> {
        let mut data = FilmData {
            width: region.extent[0],
            height: region.extent[1],
            luminance_scale: self.state.scale(),
            counts: self.state.counts(),
            ..FilmData::default()
        };
        let samples = self.state.samples();
        for (i, stream) in self.streams.iter_mut().enumerate() {
            let Some(stream) = stream.as_mut().filter(|s| samples[i] > 0 && s.is_defined()) else {
                continue;
            };
            // hi is the rounded sum: lo adds nothing to an f32.
            let color = read_image(&self.gpu, stream.color.sums_mut(), region)?;
            let color = floats(&color).chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
            let variance = match &mut stream.variance {
                Some(variance) => floats(&read_image(&self.gpu, variance.sums_mut(), region)?),
                None => Vec::new(),
            };
            if i == 0 {
                (data.camera, data.camera_variance) = (color, variance);
            } else {
                (data.light, data.light_variance) = (color, variance);
            }
        }
        Ok(data)
    }

    /// Rasterises the batch; returns the passes of a repaint, and the sums.
    fn repaint(&mut self) -> Result<(&mut Repaint, FilmSums<'_>), ClientError> {
        self.complete()?;
        if self.raster.host_sums().is_some() {
            let mut frame = self.gpu.begin()?;
            self.raster.complete(&mut frame.cmd(), self.state.spec(), &mut self.streams)?;
            frame.submit()?;
        }
        self.sums()
    }

    /// Rasterises the batch, unless it is to be kept.
    fn complete(&mut self) -> Result<(), ClientError> {
        if self.keep_batch { Ok(()) } else { self.flush() }
    }

    /// The passes of a repaint, and the sums.
    fn sums(&mut self) -> Result<(&mut Repaint, FilmSums<'_>), ClientError> {
        let lods = self.state.lods();
        let (light_scale, inverse_scale) = (self.state.light_scale(), self.state.scale().recip());
        let repaint = match &mut self.repaint {
            Some(repaint) => repaint,
            empty => empty.insert(Repaint::new(&self.gpu, *self.state.spec())?),
        };
        let [camera, light] = &mut self.streams;
        let streams = [camera.as_mut().zip(lods[0]), light.as_mut().zip(lods[1])];
        Ok((repaint, FilmSums { streams, light_scale, inverse_scale }))
    }
}

impl Film for VulkanFilm {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        for sample in samples {
            if self.state.take(sample) {
                self.raster.push(*sample);
                if self.state.is_full() {
                    self.flush()?;
                }
            }
        }
        Ok(())
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.state.count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        let samples = self.state.waiting();
        if !self.state.start_raster() {
            return Ok(());
        }
        let outcome = self.raster.draw(&self.state, &mut self.streams, samples);
        self.damaged |= outcome.is_err();
        outcome
    }

    fn clear(&mut self) {
        self.raster.clear();
        self.damaged = false;
        self.streams.iter_mut().flatten().for_each(StreamImages::forget);
        self.state.clear();
    }

    fn keep_batch(&mut self, keep: bool) {
        self.keep_batch = keep;
    }

    fn counts(&self) -> FilmCounts {
        self.state.counts()
    }

    fn on_device(&mut self) -> Option<&mut VulkanFilm> {
        Some(self)
    }

    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        let (repaint, sums) = self.repaint()?;
        repaint.display(sums, settings)
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        self.complete()?;
        let spec = self.state.spec();
        let (pad, extent) = (spec.pad(), [spec.width, spec.height]);
        if let Some(sums) = self.raster.host_sums() {
            return Ok(sums.develop(&self.state, pad));
        }
        self.develop_region(Region { origin: [pad, pad], extent })
    }
}
