//! The film on a Vulkan device: sums, repaint, and coarse sums for a moving picture.

use std::any::Any;
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
use crate::image::stereo::Eye;
use crate::stream::{PathCounts, Sample};

/// Picture pixels per texel of coarse sums, along each axis.
const COARSE: u32 = 4;

/// A film on a Vulkan device; [`ReferenceFilm`] is its reference.
///
/// The same samples in the same order give the same bits on the same device, however they are split into calls.
///
/// A picture of few samples is blurred over several mip levels, and the finest levels are not read.
/// [`begin_coarsely`](Self::begin_coarsely) omits these: the sums have one texel per 4×4 pixels, at a sixteenth of the work, while the
/// level of detail is 2 or more.
pub struct VulkanFilm {
    spec: FilmSpec,
    gpu: Arc<Gpu>,
    place: SumsPlace,
    /// Sums at full resolution.
    sums: SampleSums,
    /// Coarse sums, created on first use.
    coarse: Option<SampleSums>,
    is_coarse: bool,
    /// Created with the first repaint.
    repaint: Option<Repaint>,
    /// Whether [`paint`](Self::paint) blocks on tables that take long to compute.
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
        Self::with_sums(gpu, spec, SumsPlace::Device, 1)
    }

    /// As [`new`](Self::new), with sums computed on the CPU as by the reference, for devices that are the CPU. The bits differ from those
    /// of the device's passes.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`].
    pub fn summed_on_host(gpu: Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        Self::with_sums(gpu, spec, SumsPlace::Host, 1)
    }

    /// The same film without samples for two eyes, both of which are layers of the same images. Its display shows both as
    /// [`Settings::stereo`] says; counts, sums and texels that are read are those of the left eye where no other is asked for.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and [`ClientError::Layers`].
    pub fn with_right_eye(self) -> Result<Self, ClientError> {
        if !self.gpu.draws_layers() {
            return Err(ClientError::Layers);
        }
        Self::with_sums(self.gpu, self.spec, self.place, 2)
    }

    /// Whether it has a right eye.
    pub fn has_right_eye(&self) -> bool {
        self.sums.eyes() > 1
    }

    fn with_sums(gpu: Arc<Gpu>, spec: FilmSpec, place: SumsPlace, eyes: u32) -> Result<Self, ClientError> {
        Ok(Self {
            spec,
            place,
            sums: SampleSums::new(&gpu, spec, place, eyes)?,
            gpu,
            coarse: None,
            is_coarse: false,
            repaint: None,
            policy: BackgroundPolicy::Block,
            keep_batch: false,
        })
    }

    /// `film`, if it is one on a Vulkan device.
    pub fn of(film: &mut dyn Film) -> Option<&mut Self> {
        film.as_any()?.downcast_mut()
    }

    /// Moves the film to another device after this one was lost; `None` if its sums were on it.
    pub fn moved_to(self, gpu: &Arc<Gpu>) -> Option<Self> {
        let sums = self.sums.moved_to(gpu)?;
        let coarse = self.coarse.and_then(|coarse| coarse.moved_to(gpu));
        let is_coarse = self.is_coarse && coarse.is_some();
        Some(Self { gpu: gpu.clone(), sums, coarse, is_coarse, repaint: None, ..self })
    }

    /// Converts to a CPU film with `threads` threads as in [`ReferenceFilm::new`]; `None` if the sums were on the device, are coarse or
    /// lack samples.
    pub fn into_reference(self, threads: usize) -> Option<Result<ReferenceFilm, ClientError>> {
        let (state, sums) =
            Some(self).filter(|film| !film.is_coarse && !film.is_damaged())?.sums.into_host()?;
        Some(ReferenceFilm::with_sums(state, sums, threads))
    }

    /// Restores sums read from a film of one eye and of the same specification by [`begin_backup`](Self::begin_backup).
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] if memory runs out; the film is empty then.
    pub fn restore(&mut self, data: &FilmData) -> Result<(), ClientError> {
        self.clear();
        self.sums.restore(data)
    }

    /// Reads the sums including the overscan, without blocking on the GPU, as a copy that survives the device.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn begin_backup(&mut self) -> Result<Readback<FilmData>, ClientError> {
        self.flush()?;
        self.present_mut().develop(Eye::Left, 0)
    }

    /// The specification of the film.
    pub fn spec(&self) -> &FilmSpec {
        &self.spec
    }

    /// The sums in use: full or coarse.
    fn present(&self) -> &SampleSums {
        self.coarse.as_ref().filter(|_| self.is_coarse).unwrap_or(&self.sums)
    }

    fn present_mut(&mut self) -> &mut SampleSums {
        self.coarse.as_mut().filter(|_| self.is_coarse).unwrap_or(&mut self.sums)
    }

    /// Clears the film and accumulates samples in coarse sums until [`sharpen`](Self::sharpen).
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`].
    pub fn begin_coarsely(&mut self) -> Result<(), ClientError> {
        self.clear();
        if self.coarse.is_none() {
            let spec = Self::coarse_spec(&self.spec);
            self.coarse = Some(SampleSums::new(&self.gpu, spec, self.place, self.sums.eyes())?);
        }
        self.is_coarse = true;
        Ok(())
    }

    /// The specification of the coarse sums of a film.
    pub fn coarse_spec(spec: &FilmSpec) -> FilmSpec {
        // With this splat filter, the tent is about as wide as the mip level that the coarse texels replace.
        let [width, height] = [spec.width, spec.height].map(|n| n.div_ceil(COARSE));
        FilmSpec { width, height, filter: SplatFilter::Tent, ..*spec }
    }

    /// Whether the sums are coarse.
    pub fn is_coarse(&self) -> bool {
        self.is_coarse
    }

    /// Whether the sums are coarse and a stream has more samples than they can resolve: its level of detail is below 2.
    pub fn must_sharpen(&self) -> bool {
        let FilmCounts { camera_samples, light_samples, .. } = self.counts();
        self.is_coarse && camera_samples.max(light_samples) > Self::coarse_samples(&self.spec)
    }

    /// Largest number of samples of a stream for which coarse sums suffice: its level of detail is 2 then.
    pub fn coarse_samples(spec: &FilmSpec) -> u64 {
        let [width, height] = spec.padded_extent().map(u64::from);
        width * height / u64::from(COARSE * COARSE)
    }

    /// Switches to empty full-resolution sums; the same samples must be added again.
    pub fn sharpen(&mut self) {
        self.sums.clear();
        self.is_coarse = false;
    }

    /// Samples of a full batch.
    pub fn batch_capacity(&self) -> usize {
        self.present().spec().batch_capacity()
    }

    /// Number of samples in the batch, not yet rasterised; [`flush`](Self::flush) rasterises them.
    pub fn waiting(&self) -> usize {
        self.present().waiting()
    }

    /// Whether samples were lost to an error since the last clear: counts and paths then exceed those of the sums.
    pub fn is_damaged(&self) -> bool {
        self.present().is_damaged()
    }

    /// Number of the frame that rasterises the last batch.
    pub fn rasterised(&self) -> FrameNumber {
        let coarse = self.coarse.as_ref().map_or(FrameNumber::default(), SampleSums::rasterised);
        self.sums.rasterised().max(coarse)
    }

    /// Samples rasterised by the CPU since the last call, and the time that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let (samples, time) = self.sums.take_host_time();
        let (more, longer) = self.coarse.as_mut().map(SampleSums::take_host_time).unwrap_or_default();
        (samples + more, time + longer)
    }

    /// Adds samples of the right eye; without one they are ignored.
    ///
    /// # Errors
    ///
    /// As [`add`](Film::add).
    pub fn add_right(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        self.present_mut().add(Eye::Right, samples)
    }

    /// Begins to read the sums of each eye, the left one's first, as [`begin_develop`](Film::begin_develop) those of the left.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn begin_develop_eyes(&mut self) -> Result<Vec<Readback<FilmData>>, ClientError> {
        self.complete()?;
        let sums = self.present_mut();
        let (eyes, pad) = (sums.eyes() as usize, sums.spec().pad());
        Eye::BOTH.into_iter().take(eyes).map(|eye| sums.develop(eye, pad)).collect()
    }

    /// Whether camera and light stream have images, which are allocated with their first sample.
    pub fn allocated_streams(&self) -> [bool; 2] {
        self.present().allocated_streams()
    }

    /// Records what [`display`](Self::display) does, without readback: the encoded picture, to be drawn into a window. The batch must have
    /// been flushed before the frame began.
    ///
    /// `detail` is the internal resolution, picture pixels per reconstructed one and axis: 1, 2 or 4. Above 1 the blur is computed on a
    /// coarser grid and interpolated; the encoded picture has full size. `regions` of the picture, at the same internal resolution, are
    /// composed into it.
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

    /// As [`paint`](Self::paint), with the sum of these layers, at the same internal resolution, instead of the reconstructed sums.
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

    /// Records the picture before glare and tone curve, scene-linear XYZ, of a film that is a region of another picture: reconstructed from
    /// the sums, or the denoised picture `filtered` of the same samples.
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

    /// As [`paint`](Self::paint) at full resolution, with these denoised pictures of the same samples, one for each eye (scene-linear XYZ,
    /// the film's size), instead of the reconstructed sums.
    pub fn paint_filtered(
        &mut self,
        cmd: &mut Cmd<'_>,
        pictures: &[&Grid<Vec3>],
        settings: &Settings,
        regions: &mut [PictureLayer<'_>],
    ) -> Result<&mut Image, ClientError> {
        let policy = self.policy;
        let (repaint, _) = self.sums();
        repaint.policy = policy;
        repaint.paint_filtered(cmd, pictures, settings, regions)
    }

    /// Whether the sums are in main memory, so that [`develop`](Film::develop) does not wait for a device.
    pub fn is_summed_on_host(&self) -> bool {
        self.place == SumsPlace::Host
    }

    /// Sets whether [`paint`](Self::paint) blocks on tables that take long to compute (the default) or shows the picture without them
    /// meanwhile; [`display`](Self::display) always blocks.
    pub fn set_background_policy(&mut self, policy: BackgroundPolicy) {
        self.policy = policy;
    }

    /// Whether a table that [`paint`](Self::paint) went without is ready: the next [`paint`](Self::paint) shows another picture.
    pub fn is_background_ready(&self) -> bool {
        self.repaint.as_ref().is_some_and(Repaint::is_background_ready)
    }

    /// Whether the last [`paint`](Self::paint) left the previous picture in place, because one of its pipelines is being compiled on
    /// another thread.
    pub fn has_given_up(&self) -> bool {
        self.repaint.as_ref().is_some_and(Repaint::has_given_up)
    }

    /// Encoded picture of the last [`paint`](Self::paint), to be shown again; `None` before the first.
    pub fn painted(&mut self) -> Option<&mut Image> {
        self.repaint.as_mut().and_then(Repaint::painted)
    }

    /// Sum of the weights of the camera samples at a pixel; their number if all weights are 1. Waits for the GPU.
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

    /// Displayed texels of an eye in the last [`paint`](Self::paint) within a rectangle of its picture; `None` before the first. Waits for
    /// the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn shown(&mut self, eye: Eye, region: Region) -> Result<Option<ShownTexels>, ClientError> {
        self.repaint.as_mut().map_or(Ok(None), |repaint| repaint.shown(eye, region))
    }

    /// The reconstructed picture of the left eye before the tone curve: scene-linear `[X, Y, Z]` of `⌈size / detail⌉` pixels, `[height][width]`, as
    /// [`paint`](Self::paint) computes it before interpolation; waits for the GPU.
    pub fn reconstruct(&mut self, settings: &Settings, detail: u32) -> Result<Vec<[f32; 3]>, ClientError> {
        let (repaint, sums) = self.repaint()?;
        repaint.reconstruct(sums, settings, detail, Eye::Left)
    }

    /// Sums including the overscan; `width` and `height` are those of the padded target. Coarse sums have one texel per 4×4 pixels.
    pub fn develop_padded(&mut self) -> Result<FilmData, ClientError> {
        self.complete()?;
        self.present_mut().develop(Eye::Left, 0)?.wait()
    }

    /// Rasterises the batch; returns the repaint passes and the sums.
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

    /// Rasterises all samples or, if partial batches are to be kept, those of full batches.
    fn complete(&mut self) -> Result<(), ClientError> {
        if self.keep_batch { self.settle() } else { self.flush() }
    }

    /// Rasterises all full batches, the last of which [`add`](Film::add) leaves to a thread.
    ///
    /// # Errors
    ///
    /// As [`add`](Film::add).
    pub fn settle(&mut self) -> Result<(), ClientError> {
        self.present_mut().settle()
    }

    /// The repaint passes and the sums.
    fn sums(&mut self) -> (&mut Repaint, FilmSums<'_>) {
        let repaint = match &mut self.repaint {
            Some(repaint) => repaint,
            empty => empty.insert(Repaint::new(&self.gpu, self.spec, self.sums.eyes())),
        };
        let sums = self.coarse.as_mut().filter(|_| self.is_coarse).unwrap_or(&mut self.sums);
        (repaint, sums.view())
    }
}

impl Film for VulkanFilm {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        self.present_mut().add(Eye::Left, samples)
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

    fn as_any(&mut self) -> Option<&mut dyn Any> {
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
        sums.develop(Eye::Left, sums.spec().pad())
    }
}
