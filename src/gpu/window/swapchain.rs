//! A window's swapchain: recreation of its images, and the acquire–draw–present cycle.
//!
//! - `recreate` creates images for the window's size and format; earlier generations live until nothing uses them.
//! - [`Swapchain::acquire`] takes the next image, [`Swapchain::draw`] copies the picture into it, and
//!   [`Swapchain::present`] shows it.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use crate::gpu::commands::frame::GpuFrame;
use crate::gpu::device::faults::{CallFaults, DeviceCall};
use crate::gpu::device::gpu::{FrameNumber, Gpu};
use crate::gpu::device::instance::VulkanInstance;
use crate::gpu::device::options::GpuOptions;
use crate::gpu::device::physical::DeviceChoice;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::image::Image;
use crate::gpu::resources::sync::Access;
use crate::gpu::window::images::{
    CopyFilter, CopyRegion, ImagesDesc, MOST_LAYERS, SwapchainImages, WindowImage,
};
use crate::gpu::window::offers::{HdrMetadata, PresentWait};
use crate::gpu::window::reduced::ReducedPictures;
use crate::gpu::window::surface::{ColorOutput, Surface};

/// Least age of images that are recreated only because the driver reports them as suboptimal: some drivers always do.
const SUBOPTIMAL_AGE: Duration = Duration::from_secs(1);

/// The outcome of an attempt to acquire an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// An image can be drawn.
    Ready,
    /// No image within the timeout: try later.
    Busy,
    /// Minimised or without extent: nothing to draw into.
    Hidden,
    /// The surface is lost: replace it with [`Swapchain::replace_surface`].
    SurfaceLost,
}

/// An acquired image.
pub(in crate::gpu) struct Acquired {
    index: u32,
    /// Semaphore signalled when it may be drawn.
    semaphore: vk::Semaphore,
    /// Number of the frame that waits for the semaphore.
    waiting: Option<u64>,
    pub image: WindowImage,
}

impl Acquired {
    /// Makes the first frame that uses the image wait for its semaphore.
    pub fn claim(&mut self, frame: &mut GpuFrame<'_>) {
        if self.waiting.is_none() {
            frame.wait_for(self.semaphore);
            self.waiting = Some(frame.number().0);
        }
    }
}

/// An earlier generation.
struct OldImages {
    /// Number of the last frame that can use it.
    frame: u64,
    /// Total number of presented images from which on it is no longer needed.
    presents: u64,
    chain: SwapchainImages,
}

/// The swapchain of a window. Recreates itself when out of date.
///
/// Resizing does not wait for the GPU: images of the old size live until the frames that use them have completed and some of the new ones
/// have been presented. Dropping it waits. The window must outlive it.
pub struct Swapchain {
    gpu: Arc<Gpu>,
    loader: khr::swapchain::Device,
    surface: Surface,
    chain: Option<SwapchainImages>,
    /// Earlier generations.
    old: Vec<OldImages>,
    /// Number of images presented.
    presents: u64,
    /// Semaphores for acquiring, each with the number of the frame that waits for it.
    semaphores: Vec<(u64, vk::Semaphore)>,
    pub(in crate::gpu) acquired: Option<Acquired>,
    /// Extent of the window, as set by the caller.
    wanted: [u32; 2],
    output: ColorOutput,
    outputs: Vec<ColorOutput>,
    /// Requested layers of the images, and most that the surface offers.
    layers: u32,
    most_layers: u32,
    /// Whether the images no longer fit the window.
    stale: bool,
    hidden: bool,
    surface_lost: bool,
    /// Whether the driver reports the images as suboptimal.
    suboptimal: bool,
    /// When the images were made.
    made: Instant,
    /// The error of the last attempt to present.
    failed: Option<GpuError>,
    /// Presentation times, if supported.
    waits: Option<PresentWait>,
    /// Mastering metadata, if supported.
    metadata: Option<HdrMetadata>,
    /// Peak luminance of wide-range colours, cd/m².
    peak: f32,
    /// Downsampled copies of a picture larger than the window.
    reduced: ReducedPictures,
}

impl Swapchain {
    /// Opens a device that can present in this window, and creates the window's images. `extent` is the window's size in physical pixels,
    /// used if the window system leaves it to the program (Wayland).
    ///
    /// The handles must be those of a live window and of its connection, and both must outlive what is returned.
    ///
    /// # Errors
    ///
    /// As [`Gpu::with_options`], [`GpuError::NoWindow`] where no device can show pictures in this window, and
    /// [`GpuError::Call`] for surface and swapchain.
    pub fn open(
        choice: &DeviceChoice,
        options: GpuOptions,
        window: (RawDisplayHandle, RawWindowHandle),
        extent: [u32; 2],
        faults: &CallFaults,
    ) -> Result<Self, GpuError> {
        let instance = Arc::new(VulkanInstance::new(options.validation, Some(window.0))?);
        let surface = Surface::new(&instance, window, faults)?;
        let physical = surface.pick(choice)?;
        let offers = physical.window;
        let gpu = Gpu::open(instance, physical, options, true, faults.clone())?;
        let mut swapchain = Self {
            loader: khr::swapchain::Device::new(&gpu.instance.raw, &gpu.device),
            waits: offers.present_wait.then(|| PresentWait::new(&gpu)),
            metadata: offers.hdr_metadata.then(|| HdrMetadata::new(&gpu)),
            gpu,
            surface,
            chain: None,
            old: Vec::new(),
            presents: 0,
            semaphores: Vec::new(),
            acquired: None,
            wanted: extent,
            output: ColorOutput::Sdr,
            outputs: Vec::new(),
            layers: 1,
            most_layers: 1,
            stale: false,
            hidden: false,
            surface_lost: false,
            suboptimal: false,
            made: Instant::now(),
            failed: None,
            peak: 0.0,
            reduced: ReducedPictures::default(),
        };
        swapchain.recreate()?;
        Ok(swapchain)
    }

    /// The device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// Extent of the images in physical pixels; `None` while hidden.
    pub fn extent(&self) -> Option<[u32; 2]> {
        self.chain.as_ref().filter(|_| !self.hidden).map(|chain| chain.extent)
    }

    /// The encoding of the window's colours.
    pub fn output(&self) -> ColorOutput {
        self.output
    }

    /// The outputs that the surface offers.
    pub fn outputs(&self) -> Vec<ColorOutput> {
        self.outputs.clone()
    }

    /// Format of the window's images; undefined before there are any.
    pub(in crate::gpu) fn format(&self) -> vk::Format {
        self.chain.as_ref().map_or(vk::Format::UNDEFINED, |chain| chain.format)
    }

    /// Whether an image is acquired.
    pub fn is_acquired(&self) -> bool {
        self.acquired.is_some()
    }

    /// Requests another output, effective with the next image. `false` if unsupported.
    pub fn set_output(&mut self, output: ColorOutput) -> bool {
        let offered = self.outputs.contains(&output);
        if offered && self.output != output {
            self.output = output;
            self.stale = true;
        }
        offered
    }

    /// Most layers of an image that the surface offers (`maxImageArrayLayers`): with two, each eye can see its own.
    pub fn most_layers(&self) -> u32 {
        self.most_layers
    }

    /// Requests images of so many layers, one or two, effective with the next image. `false` if unsupported.
    pub fn set_layers(&mut self, layers: u32) -> bool {
        let offered = (1..=self.most_layers.min(MOST_LAYERS)).contains(&layers);
        if offered && self.layers != layers {
            self.layers = layers;
            self.stale = true;
        }
        offered
    }

    /// Layers of the present images.
    pub(in crate::gpu) fn layers(&self) -> u32 {
        self.chain.as_ref().map_or(1, |chain| chain.layers)
    }

    /// Sets the peak luminance of wide-range colours for the display, cd/m².
    pub fn set_peak(&mut self, peak: f32) {
        if std::mem::replace(&mut self.peak, peak) != peak {
            self.describe_colors();
        }
    }

    fn describe_colors(&self) {
        let is_known = self.output == ColorOutput::Hdr10 && self.peak > 0.0;
        if let (Some(metadata), Some(chain), true) = (&self.metadata, &self.chain, is_known) {
            metadata.set(chain.raw, self.peak);
        }
    }

    /// The last frame that the window has displayed, or never will; `None` if the device does not report it. Never blocks.
    pub fn shown(&mut self) -> Option<FrameNumber> {
        let waits = self.waits.as_mut()?;
        Some(waits.shown(self.chain.as_ref()?.raw))
    }

    /// Records the new size of the window.
    pub fn resize(&mut self, extent: [u32; 2]) {
        self.wanted = extent;
        self.stale |= self.chain.as_ref().is_none_or(|chain| chain.extent != extent);
    }

    /// Whether the last image was not presented, because of an error that the next [`acquire`](Self::acquire) returns.
    pub fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    /// Copies rectangles of `picture` into the acquired image, and clears the rest. With a linear filter every texel contributes, however
    /// small it is displayed, as far as memory allows downsampled copies; these are updated if the picture `is_new`.
    pub fn draw(
        &mut self,
        frame: &mut GpuFrame<'_>,
        picture: &mut Image,
        regions: &[CopyRegion],
        filter: CopyFilter,
        is_new: bool,
    ) {
        let Some(acquired) = &mut self.acquired else { return };
        acquired.claim(frame);
        let mut cmd = frame.cmd();
        let cmd = &mut cmd.scope("show");
        if filter == CopyFilter::Linear
            && let Ok((reduced, regions)) = self.reduced.of(&self.gpu, cmd, picture, regions, is_new)
        {
            return cmd.show(reduced, &mut acquired.image, &regions, filter);
        }
        cmd.show(picture, &mut acquired.image, regions, filter);
    }

    /// Replaces a lost surface of the same window.
    pub fn replace_surface(&mut self, window: (RawDisplayHandle, RawWindowHandle)) -> Result<(), GpuError> {
        self.clear();
        self.surface = Surface::new(&self.gpu.instance, window, self.gpu.faults())?;
        if !self.surface.is_shown_by(self.gpu.physical, self.gpu.queue_family) {
            return Err(GpuError::NoWindow("this device cannot show pictures in it any more.".into()));
        }
        (self.surface_lost, self.stale) = (false, false);
        self.recreate()
    }

    /// Acquires the next image, waiting at most `timeout`; recreates the swapchain if necessary. An image that was acquired and not
    /// presented is kept. After an error, of this call or of the last present, the next call recreates all images.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`]; [`GpuError::is_device_lost`] tells whether a new device helps.
    pub fn acquire(&mut self, timeout: Duration) -> Result<Readiness, GpuError> {
        self.gpu.alive("vkAcquireNextImageKHR")?;
        let outcome = self.failed.take().map_or_else(|| self.try_acquire(timeout), Err);
        if outcome.is_err() {
            self.clear();
        }
        outcome
    }

    fn try_acquire(&mut self, timeout: Duration) -> Result<Readiness, GpuError> {
        if self.acquired.is_some() {
            return Ok(Readiness::Ready);
        }
        if std::mem::take(&mut self.suboptimal) {
            self.stale |= self.made.elapsed() >= SUBOPTIMAL_AGE || self.has_other_extent()?;
        }
        // A window being resized may be out of date again at once; the next frame retries.
        for _ in 0..3 {
            if self.stale || self.chain.is_none() {
                self.recreate()?;
            }
            match (self.surface_lost, self.hidden, &self.chain) {
                (true, ..) => return Ok(Readiness::SurfaceLost),
                (_, true, _) => return Ok(Readiness::Hidden),
                (.., None) => return Ok(Readiness::Busy),
                _ => {}
            }
            if let Some(readiness) = self.take_image(timeout)? {
                return Ok(readiness);
            }
        }
        Ok(Readiness::Busy)
    }

    /// Whether the window's extent differs from the images'.
    fn has_other_extent(&mut self) -> Result<bool, GpuError> {
        match self.surface.capabilities(self.gpu.physical) {
            Ok(capabilities) => Ok(self.extent() != Some(extent(&capabilities, self.wanted))),
            Err(result) => {
                self.note(result).named("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
                Ok(true)
            }
        }
    }

    /// One attempt to acquire; `None` if the swapchain must be recreated first.
    fn take_image(&mut self, timeout: Duration) -> Result<Option<Readiness>, GpuError> {
        let completed = self.gpu.completed()?;
        self.destroy_old(completed);
        let semaphore = self.free_semaphore(completed)?;
        let Some(chain) = &self.chain else { return Ok(None) };
        let nanoseconds = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        let planned = self.gpu.faults().next(DeviceCall::Acquire);
        let taken = match planned {
            Some(result) if result != vk::Result::SUBOPTIMAL_KHR => Err(result),
            // SAFETY: nothing waits for the semaphore, and it is not signalled; no other image is acquired.
            _ => unsafe {
                self.loader.acquire_next_image(chain.raw, nanoseconds, semaphore, vk::Fence::null())
            },
        };
        let (index, suboptimal) = match taken {
            Ok(taken) => taken,
            Err(result) => {
                self.semaphores.push((0, semaphore));
                if matches!(result, vk::Result::NOT_READY | vk::Result::TIMEOUT) {
                    return Ok(Some(Readiness::Busy));
                }
                self.note(result).named("vkAcquireNextImageKHR")?;
                return Ok(self.surface_lost.then_some(Readiness::SurfaceLost));
            }
        };
        let image = WindowImage::acquired(chain, index);
        self.acquired = Some(Acquired { index, semaphore, waiting: None, image });
        self.suboptimal |= suboptimal || planned.is_some();
        Ok(Some(Readiness::Ready))
    }

    /// An unused semaphore.
    fn free_semaphore(&mut self, completed: u64) -> Result<vk::Semaphore, GpuError> {
        if let Some(i) = self.semaphores.iter().position(|(frame, _)| *frame <= completed) {
            return Ok(self.semaphores.swap_remove(i).1);
        }
        self.gpu.semaphore("window image acquired")
    }

    /// Handles results that concern the window; other errors are returned.
    fn note(&mut self, result: vk::Result) -> Result<(), vk::Result> {
        match result {
            vk::Result::SUBOPTIMAL_KHR => self.suboptimal = true,
            vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT => {
                self.stale = true;
            }
            vk::Result::ERROR_SURFACE_LOST_KHR => self.surface_lost = true,
            other => return Err(other),
        }
        Ok(())
    }

    /// Submits the frame and presents the acquired image. Suboptimal and out-of-date are not errors: the next [`acquire`](Self::acquire)
    /// recreates the swapchain. Once the frame is submitted, any error but a lost device is returned by the next
    /// [`acquire`](Self::acquire).
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] where the frame could not be submitted, or the device was lost.
    pub fn present(&mut self, mut frame: GpuFrame<'_>) -> Result<FrameNumber, GpuError> {
        let (Some(mut acquired), Some(chain)) = (self.acquired.take(), &mut self.chain) else {
            return frame.submit();
        };
        acquired.claim(&mut frame);
        let shown = &mut acquired.image;
        if shown.access == Access::Acquired {
            frame.cmd().clear_shown(shown);
        }
        frame.cmd().access_shown(shown.raw, &mut shown.access, Access::Present);
        let drawn = chain.images[acquired.index as usize].drawn;
        let submitted = frame.finish(Some(drawn));
        let Ok(number) = submitted else {
            // The image stays acquired, without what this frame has drawn.
            acquired.waiting = acquired.waiting.filter(|number| *number != frame.number().0);
            acquired.image.access = Access::Acquired;
            self.acquired = Some(acquired);
            return submitted;
        };
        self.semaphores.push((number.0, acquired.semaphore));
        let (waits, chains, indices) = ([drawn], [chain.raw], [acquired.index]);
        let ids = [self.presents + 1];
        let mut id = vk::PresentIdKHR::default().present_ids(&ids);
        let mut info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&indices);
        if self.waits.is_some() {
            info = info.push_next(&mut id);
        }
        let planned = self.gpu.faults().next(DeviceCall::Present);
        // After these results the semaphore wait is enqueued; after other errors nothing has happened.
        let is_enqueued = |result| {
            matches!(
                result,
                vk::Result::SUBOPTIMAL_KHR
                    | vk::Result::ERROR_OUT_OF_DATE_KHR
                    | vk::Result::ERROR_SURFACE_LOST_KHR
                    | vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT
            )
        };
        let presented = match planned {
            Some(result) if !is_enqueued(result) => Err(result),
            // SAFETY: the image is acquired and in the layout to be shown; the frame still locks the queue.
            _ => unsafe { self.loader.queue_present(self.gpu.queue, &info) },
        };
        let presented = planned.map_or(presented, Err);
        drop(frame);
        if presented.is_ok() || presented.is_err_and(is_enqueued) {
            chain.presented = true;
            self.presents += 1;
        }
        if let Some(waits) = self.waits.as_mut().filter(|_| presented.is_ok()) {
            waits.presented(ids[0], number);
        }
        match presented {
            Ok(suboptimal) => self.suboptimal |= suboptimal,
            Err(result) => {
                let noted = self.note(result).named("vkQueuePresentKHR");
                if noted.as_ref().is_err_and(GpuError::is_device_lost) {
                    return noted.map(|()| number);
                }
                self.failed = noted.err();
            }
        }
        Ok(number)
    }

    /// Recreates the images for the present window, unless that has no extent.
    fn recreate(&mut self) -> Result<(), GpuError> {
        match self.try_recreate() {
            Err(GpuError::Call { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. }) => {
                self.surface_lost = true;
                Ok(())
            }
            outcome => outcome,
        }
    }

    fn try_recreate(&mut self) -> Result<(), GpuError> {
        let physical = self.gpu.physical;
        let capabilities =
            self.surface.capabilities(physical).named("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        let formats = self.surface.formats(physical).named("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
        self.outputs = formats.iter().map(|(output, _)| *output).collect();
        self.most_layers = capabilities.max_image_array_layers.max(1);
        self.layers = self.layers.min(self.most_layers);
        let extent = extent(&capabilities, self.wanted);
        self.hidden = extent.contains(&0);
        if self.hidden {
            return Ok(());
        }
        let mode = self.surface.present_mode(physical).named("vkGetPhysicalDeviceSurfacePresentModesKHR")?;
        let wanted = formats.iter().find(|(output, _)| *output == self.output).or(formats.first());
        let &(output, format) = wanted.ok_or_else(|| {
            GpuError::NoWindow("it offers no format that pictures can be copied to unchanged.".into())
        })?;
        self.output = output;
        if let Some(waits) = &mut self.waits {
            waits.leave();
        }
        let old = self.chain.take();
        let raw = old.as_ref().map_or(vk::SwapchainKHR::null(), |chain| chain.raw);
        let (layers, faults) = (self.layers, self.gpu.faults().clone());
        let desc = ImagesDesc { capabilities, extent, format, mode, layers, old: raw, faults };
        let made = SwapchainImages::new(&self.gpu, &self.loader, &self.surface, &desc);
        if let Some(old) = old {
            // Presenting is not part of a frame. Once an image of the next generation was presented, so was the last one of this
            // generation. A generation without presented images need not wait for that.
            let more = if old.presented { old.images.len() as u64 } else { 0 };
            let frame = self.gpu.begun.load(Ordering::Acquire);
            self.old.push(OldImages { frame, presents: self.presents + more, chain: old });
        }
        self.chain = Some(made?);
        (self.stale, self.suboptimal, self.made) = (false, false, Instant::now());
        self.describe_colors();
        Ok(())
    }

    /// Destroys the generations that are no longer needed.
    fn destroy_old(&mut self, completed: u64) {
        let presents = self.presents;
        for old in self.old.extract_if(.., |old| old.frame <= completed && old.presents <= presents) {
            // SAFETY: the frames that used it have completed, and its images have been shown.
            unsafe { old.chain.destroy(&self.gpu, &self.loader) };
        }
    }

    /// Waits until nothing is pending, and destroys all images and semaphores.
    fn clear(&mut self) {
        if let Some(mut acquired) = self.acquired.take() {
            // The semaphore will be signalled; only a frame that waits for it ensures that it has been.
            if let Ok(mut frame) = self.gpu.begin() {
                acquired.claim(&mut frame);
            }
            self.semaphores.push((0, acquired.semaphore));
        }
        if let Some(waits) = &mut self.waits {
            waits.leave();
        }
        let frames = self.gpu.frames();
        // SAFETY: the lock keeps others from submitting. After a lost device nothing is pending either.
        let _ = unsafe { self.gpu.device.queue_wait_idle(self.gpu.queue) };
        drop(frames);
        let chains = self.old.drain(..).map(|old| old.chain).chain(self.chain.take());
        for chain in chains {
            // SAFETY: the queue is idle, and presenting is an operation of this queue.
            unsafe { chain.destroy(&self.gpu, &self.loader) };
        }
        for (_, semaphore) in self.semaphores.drain(..) {
            // SAFETY: as above.
            unsafe { self.gpu.device.destroy_semaphore(semaphore, None) };
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        self.clear();
    }
}

/// Extent that the surface prescribes or, if it prescribes none, the wanted one within its limits.
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, wanted: [u32; 2]) -> [u32; 2] {
    let (current, low, high) =
        (capabilities.current_extent, capabilities.min_image_extent, capabilities.max_image_extent);
    if wanted.contains(&0) || high.width.min(high.height) == 0 {
        return [0, 0];
    }
    if current.width == u32::MAX {
        let clamp = |n: u32, low: u32, high: u32| n.max(low).min(high);
        return [clamp(wanted[0], low.width, high.width), clamp(wanted[1], low.height, high.height)];
    }
    [current.width, current.height]
}
