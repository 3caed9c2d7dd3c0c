//! The film on a Vulkan device: sums, the repaint that shows them, and what a film of a moving picture leaves out.

use std::sync::Arc;
use std::time::Duration;

use glam::Vec3;

use crate::client::Film;
use crate::client::background::BackgroundPolicy;
use crate::client::error::ClientError;
use crate::client::pass::compose::PictureLayer;
use crate::client::pass::repaint::{FilmSums, Repaint, ShownTexels};
use crate::client::readback::Readback;
use crate::client::reference::ReferenceFilm;
use crate::client::sample_sums::{SampleSums, SumsPlace};
use crate::client::settings::{DisplayImage, FilmCounts, FilmData, FilmSpec, Settings, SplatFilter};
use crate::gpu::{Cmd, FrameNumber, Gpu, Image, Region};
use crate::image::Grid;
use crate::stream::{PathCounts, Sample};

/// Pixels of the picture along a side of a texel of coarse sums.
const COARSE: u32 = 4;

/// A film on a Vulkan device; [`ReferenceFilm`](crate::client::reference::ReferenceFilm) is its reference.
///
/// The same samples in the same order give the same bits on the same device, however they are split into calls.
///
/// A picture of few samples is blurred over several mip levels, and those below are not read. [`begin_coarsely`](Self::begin_coarsely)
/// leaves them out: the sums have a texel for 4×4 pixels, a sixteenth of the work, as long as the level of detail is 2 or more.
pub struct VulkanFilm {
    spec: FilmSpec,
    gpu: Arc<Gpu>,
    place: SumsPlace,
    /// The sums of the picture.
    sums: SampleSums,
    /// The coarse ones; made when they are wanted first.
    coarse: Option<SampleSums>,
    is_coarse: bool,
    /// Made with the first repaint.
    repaint: Option<Repaint>,
    /// Whether [`paint`](Self::paint) waits for tables that take long to make.
    policy: BackgroundPolicy,
    /// Whether only full batches are rasterised.
    keep_batch: bool,
}

impl VulkanFilm {
    /// An empty film.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Threads`] for the thread that sorts its samples.
    pub fn new(gpu: Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        Self::with_sums(gpu, spec, SumsPlace::Device)
    }

    /// As [`new`](Self::new), with sums that the processor makes, as the reference does: for devices that are the processor. Its bits
    /// are not those of the device's passes.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`].
    pub fn summed_on_host(gpu: Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        Self::with_sums(gpu, spec, SumsPlace::Host)
    }

    fn with_sums(gpu: Arc<Gpu>, spec: FilmSpec, place: SumsPlace) -> Result<Self, ClientError> {
        Ok(Self {
            spec,
            place,
            sums: SampleSums::new(&gpu, spec, place)?,
            gpu,
            coarse: None,
            is_coarse: false,
            repaint: None,
            policy: BackgroundPolicy::Block,
            keep_batch: false,
        })
    }

    /// The same film for another device, after this one was lost; `None` where its sums were on it.
    pub fn moved_to(self, gpu: &Arc<Gpu>) -> Option<Self> {
        let sums = self.sums.moved_to(gpu)?;
        let coarse = self.coarse.and_then(|coarse| coarse.moved_to(gpu));
        let is_coarse = self.is_coarse && coarse.is_some();
        Some(Self { gpu: gpu.clone(), sums, coarse, is_coarse, repaint: None, ..self })
    }

    /// The film without its device, on `threads` threads as [`ReferenceFilm::new`] says; `None` where its sums were on it, are coarse or
    /// lack samples.
    pub fn into_reference(self, threads: usize) -> Option<Result<ReferenceFilm, ClientError>> {
        let (state, sums) =
            Some(self).filter(|film| !film.is_coarse && !film.is_damaged())?.sums.into_host()?;
        Some(ReferenceFilm::with_sums(state, sums, threads))
    }

    /// Takes over sums that were read from a film of the same specification by [`begin_backup`](Self::begin_backup).
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory; the film is empty then.
    pub fn restore(&mut self, data: &FilmData) -> Result<(), ClientError> {
        self.clear();
        self.sums.restore(data)
    }

    /// Reads the sums, with the overscan of the film, without waiting for the GPU: they survive the device.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn begin_backup(&mut self) -> Result<Readback<FilmData>, ClientError> {
        self.flush()?;
        self.present_mut().develop(0)
    }

    /// The specification of the film.
    pub fn spec(&self) -> &FilmSpec {
        &self.spec
    }

    /// The sums that samples are added to.
    fn present(&self) -> &SampleSums {
        self.coarse.as_ref().filter(|_| self.is_coarse).unwrap_or(&self.sums)
    }

    fn present_mut(&mut self) -> &mut SampleSums {
        self.coarse.as_mut().filter(|_| self.is_coarse).unwrap_or(&mut self.sums)
    }

    /// Forgets everything, and adds up the samples that come coarsely until [`sharpen`](Self::sharpen).
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`].
    pub fn begin_coarsely(&mut self) -> Result<(), ClientError> {
        self.clear();
        if self.coarse.is_none() {
            let spec = Self::coarse_spec(&self.spec);
            self.coarse = Some(SampleSums::new(&self.gpu, spec, self.place)?);
        }
        self.is_coarse = true;
        Ok(())
    }

    /// The specification of the coarse sums of a film.
    pub fn coarse_spec(spec: &FilmSpec) -> FilmSpec {
        // The tent is about as wide as the mip level whose texels they are, with the splat filter that it is made with.
        let [width, height] = [spec.width, spec.height].map(|n| n.div_ceil(COARSE));
        FilmSpec { width, height, filter: SplatFilter::Tent, ..*spec }
    }

    /// Whether the sums are coarse.
    pub fn is_coarse(&self) -> bool {
        self.is_coarse
    }

    /// Whether the sums are coarse and there are samples for a finer picture than they can give: one stream has its level of detail
    /// below 2.
    pub fn must_sharpen(&self) -> bool {
        let FilmCounts { camera_samples, light_samples, .. } = self.counts();
        self.is_coarse && camera_samples.max(light_samples) > Self::coarse_samples(&self.spec)
    }

    /// The samples of a stream up to which coarse sums suffice: then its level of detail is 2.
    pub fn coarse_samples(spec: &FilmSpec) -> u64 {
        let [width, height] = spec.padded_extent().map(u64::from);
        width * height / u64::from(COARSE * COARSE)
    }

    /// Begins with sums of full resolution, which are empty: the same samples must be added again.
    pub fn sharpen(&mut self) {
        self.sums.clear();
        self.is_coarse = false;
    }

    /// Samples of a full batch.
    pub fn batch_capacity(&self) -> usize {
        self.present().spec().batch_capacity()
    }

    /// Samples that were not rasterised yet, which [`flush`](Self::flush) would do.
    pub fn waiting(&self) -> usize {
        self.present().waiting()
    }

    /// Whether samples were lost to an error since the last clear: the counts and paths are those of more samples than the sums.
    pub fn is_damaged(&self) -> bool {
        self.present().is_damaged()
    }

    /// The frame that rasterises the last batch.
    pub fn rasterised(&self) -> FrameNumber {
        let coarse = self.coarse.as_ref().map_or(FrameNumber::default(), SampleSums::rasterised);
        self.sums.rasterised().max(coarse)
    }

    /// Samples that the processor has drawn since the last call, and how long it took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let (samples, time) = self.sums.take_host_time();
        let (more, longer) = self.coarse.as_mut().map(SampleSums::take_host_time).unwrap_or_default();
        (samples + more, time + longer)
    }

    /// Whether the camera and the light stream have images, because they had a sample.
    pub fn allocated_streams(&self) -> [bool; 2] {
        self.present().allocated_streams()
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
        self.present_mut().complete(cmd)?;
        let (repaint, sums) = self.sums();
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
        let (repaint, _) = self.sums();
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
            self.present_mut().complete(cmd)?;
        }
        let (repaint, sums) = self.sums();
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
        let (repaint, _) = self.sums();
        repaint.policy = policy;
        repaint.paint_filtered(cmd, picture, settings, regions)
    }

    /// Whether the sums are in memory: [`develop`](Film::develop) waits for no device.
    pub fn is_summed_on_host(&self) -> bool {
        self.place == SumsPlace::Host
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
        let scale = if self.is_coarse { COARSE } else { 1 };
        let sums = self.present_mut();
        let pad = sums.spec().pad();
        Ok(sums.weight_at(pixel.map(|at| at / scale + pad))? / (scale * scale) as f32)
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

    /// The sums with the overscan around the picture, `width` and `height` being those of the padded target. Coarse ones have a texel
    /// for 4×4 pixels.
    pub fn develop_padded(&mut self) -> Result<FilmData, ClientError> {
        self.complete()?;
        self.present_mut().develop(0)?.wait()
    }

    /// Rasterises the batch; returns the passes of a repaint, and the sums.
    fn repaint(&mut self) -> Result<(&mut Repaint, FilmSums<'_>), ClientError> {
        self.complete()?;
        if self.is_summed_on_host() {
            let gpu = self.gpu.clone();
            let mut frame = gpu.begin()?;
            self.present_mut().complete(&mut frame.cmd())?;
            frame.submit()?;
        }
        Ok(self.sums())
    }

    /// Rasterises all samples, or where the last batch is to be kept those of full ones.
    fn complete(&mut self) -> Result<(), ClientError> {
        if self.keep_batch { self.settle() } else { self.flush() }
    }

    /// Rasterises all full batches: [`add`](Film::add) leaves the last ones to a thread.
    ///
    /// # Errors
    ///
    /// As [`add`](Film::add).
    pub fn settle(&mut self) -> Result<(), ClientError> {
        self.present_mut().settle()
    }

    /// The passes of a repaint, and the sums.
    fn sums(&mut self) -> (&mut Repaint, FilmSums<'_>) {
        let repaint = match &mut self.repaint {
            Some(repaint) => repaint,
            empty => empty.insert(Repaint::new(&self.gpu, self.spec)),
        };
        let sums = self.coarse.as_mut().filter(|_| self.is_coarse).unwrap_or(&mut self.sums);
        (repaint, sums.view())
    }
}

impl Film for VulkanFilm {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        self.present_mut().add(samples)
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.present_mut().count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        self.present_mut().flush()
    }

    fn clear(&mut self) {
        self.sums.clear();
        self.coarse.iter_mut().for_each(SampleSums::clear);
        self.is_coarse = false;
    }

    fn keep_batch(&mut self, keep: bool) {
        self.keep_batch = keep;
    }

    fn counts(&self) -> FilmCounts {
        self.present().counts()
    }

    fn on_device(&mut self) -> Option<&mut VulkanFilm> {
        Some(self)
    }

    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        self.begin_display(settings)?.wait()
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        self.begin_develop()?.wait()
    }

    fn begin_display(&mut self, settings: &Settings) -> Result<Readback<DisplayImage>, ClientError> {
        let (repaint, sums) = self.repaint()?;
        repaint.display(sums, settings)
    }

    fn begin_develop(&mut self) -> Result<Readback<FilmData>, ClientError> {
        self.complete()?;
        let sums = self.present_mut();
        sums.develop(sums.spec().pad())
    }
}
