//! A window's images from frame to frame: taking the next one, and showing it.

use std::time::Duration;

use ash::vk;

use crate::gpu::commands::frame::{Frame, FrameNumber};
use crate::gpu::commands::sync::Access;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::window::present::Shown;
use crate::gpu::window::swapchain::{Readiness, Swapchain};

/// An image that waits to be drawn.
pub(in crate::gpu) struct Acquired {
    pub index: u32,
    /// Signalled when it may be drawn.
    pub semaphore: vk::Semaphore,
    /// Number of the frame that waits for the semaphore.
    pub waiting: Option<u64>,
    pub shown: Shown,
    pub view: vk::ImageView,
}

impl Acquired {
    /// Makes the first frame that uses the image wait until it may.
    pub fn claim(&mut self, frame: &mut Frame<'_>) {
        if self.waiting.is_none() {
            frame.wait_for(self.semaphore);
            self.waiting = Some(frame.number());
        }
    }
}

impl Swapchain {
    /// Takes the next image, waiting at most `timeout`; recreates the swapchain where it must be. An image that was taken
    /// and not presented is kept.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`]; [`GpuError::is_device_lost`] tells whether a new device helps.
    pub fn acquire(&mut self, timeout: Duration) -> Result<Readiness, GpuError> {
        self.gpu.alive("vkAcquireNextImageKHR")?;
        if self.acquired.is_some() {
            return Ok(Readiness::Ready);
        }
        // A window that is being resized may be out of date again at once: then the next frame tries.
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

    /// One attempt to acquire; `None` when the chain must be recreated first.
    fn take_image(&mut self, timeout: Duration) -> Result<Option<Readiness>, GpuError> {
        if let Some(result) = self.planned.take() {
            self.note(result).named("vkAcquireNextImageKHR")?;
            return Ok(self.surface_lost.then_some(Readiness::SurfaceLost));
        }
        let completed = self.gpu.completed()?;
        self.bury(completed);
        let semaphore = self.free_semaphore(completed)?;
        let Some(chain) = &self.chain else { return Ok(None) };
        let nanoseconds = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: nothing waits for the semaphore, and it is not signalled; no other image is acquired.
        let taken =
            unsafe { self.loader.acquire_next_image(chain.raw, nanoseconds, semaphore, vk::Fence::null()) };
        match taken {
            Ok((index, suboptimal)) => {
                let image = &chain.images[index as usize];
                let shown = Shown { raw: image.raw, extent: chain.extent, access: Access::Acquired };
                self.acquired = Some(Acquired { index, semaphore, waiting: None, shown, view: image.view });
                self.stale |= suboptimal;
                return Ok(Some(Readiness::Ready));
            }
            Err(_) => self.semaphores.push((0, semaphore)),
        }
        match taken {
            Err(vk::Result::NOT_READY | vk::Result::TIMEOUT) => Ok(Some(Readiness::Busy)),
            Err(result) => {
                self.note(result).named("vkAcquireNextImageKHR")?;
                Ok(self.surface_lost.then_some(Readiness::SurfaceLost))
            }
            Ok(_) => Ok(Some(Readiness::Ready)),
        }
    }

    /// A semaphore that nothing uses.
    fn free_semaphore(&mut self, completed: u64) -> Result<vk::Semaphore, GpuError> {
        if let Some(i) = self.semaphores.iter().position(|(frame, _)| *frame <= completed) {
            return Ok(self.semaphores.swap_remove(i).1);
        }
        let info = vk::SemaphoreCreateInfo::default();
        // SAFETY: nothing is asked for that could be missing.
        let made = unsafe { self.gpu.device.create_semaphore(&info, None) }.named("vkCreateSemaphore")?;
        self.gpu.name(made, "window image acquired");
        Ok(made)
    }

    /// Remembers what a result says about the window; errors that say something else are returned.
    fn note(&mut self, result: vk::Result) -> Result<(), vk::Result> {
        match result {
            vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::SUBOPTIMAL_KHR => self.stale = true,
            vk::Result::ERROR_SURFACE_LOST_KHR => self.surface_lost = true,
            other => return Err(other),
        }
        Ok(())
    }

    /// Submits the frame and shows the acquired image. Suboptimal and out of date are no errors: the next
    /// [`acquire`](Self::acquire) recreates.
    ///
    /// # Errors
    ///
    /// As [`acquire`](Self::acquire).
    pub fn present(&mut self, mut frame: Frame<'_>) -> Result<FrameNumber, GpuError> {
        let (Some(mut acquired), Some(chain)) = (self.acquired.take(), &mut self.chain) else {
            return frame.submit();
        };
        acquired.claim(&mut frame);
        let shown = &mut acquired.shown;
        if shown.access == Access::Acquired {
            frame.cmd().clear_shown(shown);
        }
        frame.cmd().access_shown(shown.raw, &mut shown.access, Access::Present);
        let drawn = chain.images[acquired.index as usize].drawn;
        let submitted = frame.finish(Some(drawn));
        let Ok(number) = submitted else {
            // Still acquired; what this frame has drawn is not there.
            acquired.waiting = acquired.waiting.filter(|number| *number != frame.number());
            acquired.shown.access = Access::Acquired;
            self.acquired = Some(acquired);
            return submitted;
        };
        self.semaphores.push((number.0, acquired.semaphore));
        let (waits, chains, indices) = ([drawn], [chain.raw], [acquired.index]);
        let info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&indices);
        // SAFETY: the image is acquired and in the layout to be shown; the frame still locks the queue.
        let presented = unsafe { self.loader.queue_present(self.gpu.queue, &info) };
        drop(frame);
        chain.shown = true;
        self.presents += 1;
        match presented {
            Ok(suboptimal) => self.stale |= suboptimal,
            Err(result) => self.note(result).named("vkQueuePresentKHR")?,
        }
        Ok(number)
    }
}
