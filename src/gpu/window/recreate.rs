//! A window's images from generation to generation: made for its size and colours, destroyed when nothing needs them.

use std::sync::atomic::Ordering;

use ash::vk;

use crate::gpu::error::{GpuError, Named};
use crate::gpu::window::chain::{Chain, ChainDesc};
use crate::gpu::window::swapchain::Swapchain;

/// An earlier generation.
pub(in crate::gpu) struct Old {
    /// The last frame that can use it.
    frame: u64,
    /// How many images must have been presented in all before it can go.
    presents: u64,
    chain: Chain,
}

impl Swapchain {
    /// Makes images for the window as it is now, unless it has no extent.
    pub(in crate::gpu) fn recreate(&mut self) -> Result<(), GpuError> {
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
        let old = self.chain.take();
        let raw = old.as_ref().map_or(vk::SwapchainKHR::null(), |chain| chain.raw);
        let desc = ChainDesc { capabilities, extent, format, mode, old: raw };
        let made = Chain::new(&self.gpu, &self.loader, &self.surface, &desc);
        if let Some(old) = old {
            // Showing is not part of a frame: that some images of the next chain were shown tells that the last of this
            // one has been, too. A chain of which nothing was shown need not wait for that.
            let more = if old.shown { old.images.len() as u64 } else { 0 };
            let frame = self.gpu.begun.load(Ordering::Acquire);
            self.old.push(Old { frame, presents: self.presents + more, chain: old });
        }
        self.chain = Some(made?);
        self.stale = false;
        Ok(())
    }

    /// Destroys the generations that nothing can need any more.
    pub(in crate::gpu) fn bury(&mut self, completed: u64) {
        let presents = self.presents;
        for old in self.old.extract_if(.., |old| old.frame <= completed && old.presents <= presents) {
            // SAFETY: the frames that used it have completed, and its images have been shown.
            unsafe { old.chain.destroy(&self.gpu, &self.loader) };
        }
    }

    /// Waits until nothing is pending, and destroys all images and semaphores.
    pub(in crate::gpu) fn clear(&mut self) {
        if let Some(mut acquired) = self.acquired.take() {
            // Its semaphore will be signalled; only a frame that waits makes sure that it has been.
            if let Ok(mut frame) = self.gpu.begin() {
                acquired.claim(&mut frame);
            }
            self.semaphores.push((0, acquired.semaphore));
        }
        let frames = self.gpu.frames.lock().unwrap_or_else(|e| e.into_inner());
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

/// The extent that images of a surface must have, or may, where it has none of its own.
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
