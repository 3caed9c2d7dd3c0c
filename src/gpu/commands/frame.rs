//! A frame: commands recorded and submitted together. Several may be in flight, numbered by one timeline semaphore.

use std::sync::MutexGuard;
use std::sync::atomic::Ordering;
use std::time::Instant;

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::device::gpu::{FrameNumber, Gpu};
use crate::gpu::device::ring::{FrameRing, IN_FLIGHT};
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::sync::ACQUIRED_AT;

/// A frame that is being recorded, until [`submit`](Self::submit).
///
/// Dropping it, as on an error between recording and submission, submits what was recorded: images and their owners track their last use,
/// which would be wrong if the commands were never executed.
#[must_use = "submit() tells when the commands have run"]
pub struct GpuFrame<'g> {
    gpu: &'g Gpu,
    ring: MutexGuard<'g, FrameRing>,
    number: u64,
    /// Semaphore signalled when the acquired swapchain image may be used.
    acquired: Option<vk::Semaphore>,
    /// Neither submitted nor failed.
    open: bool,
}

impl Gpu {
    /// Begins a frame, after waiting until fewer than `IN_FLIGHT` are in flight. Other threads block until it is submitted.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] when the device was lost or memory is exhausted.
    pub fn begin(&self) -> Result<GpuFrame<'_>, GpuError> {
        let mut ring = self.frames();
        let number = self.begun.fetch_add(1, Ordering::AcqRel) + 1;
        let FrameRing { slots, readings } = &mut *ring;
        let slot = &mut slots[number as usize % IN_FLIGHT];
        self.wait(FrameNumber(slot.number))?;
        slot.read(&self.device, readings);
        self.collect_retired(self.completed()?);
        let timing = self.timing.load(Ordering::Relaxed);
        slot.timers.restart(&self.device, timing);
        if let Some(clock) = readings.clock.as_mut().filter(|_| timing) {
            clock.calibrate();
        }
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last frame has completed, and the lock keeps others from recording.
        unsafe {
            self.device
                .reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty())
                .named("vkResetCommandPool")?;
            self.device.begin_command_buffer(slot.commands, &info).named("vkBeginCommandBuffer")?;
        }
        Ok(GpuFrame { gpu: self, ring, number, acquired: None, open: true })
    }
}

impl GpuFrame<'_> {
    /// Number of the frame once submitted.
    pub fn number(&self) -> FrameNumber {
        FrameNumber(self.number)
    }

    /// Makes the frame wait for a swapchain image, whether that is presented or not.
    pub(in crate::gpu) fn wait_for(&mut self, acquired: vk::Semaphore) {
        self.acquired = Some(acquired);
    }

    /// Recorder of commands.
    pub fn cmd(&mut self) -> Cmd<'_> {
        let slot = &mut self.ring.slots[self.number as usize % IN_FLIGHT];
        Cmd { gpu: self.gpu, raw: slot.commands, timers: &mut slot.timers }
    }

    /// Submits the commands to the GPU.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] when the device was lost or memory is exhausted.
    pub fn submit(mut self) -> Result<FrameNumber, GpuError> {
        self.finish(None)
    }

    /// Submits, and signals `drawn` when all commands have completed; the queue stays locked until the frame is dropped.
    pub(in crate::gpu) fn finish(&mut self, drawn: Option<vk::Semaphore>) -> Result<FrameNumber, GpuError> {
        self.open = false;
        #[cfg(feature = "faults")]
        self.gpu.loss.count_submission();
        self.gpu.alive("vkQueueSubmit2")?;
        let slot = &mut self.ring.slots[self.number as usize % IN_FLIGHT];
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(slot.commands)];
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let semaphore = |raw, stage| vk::SemaphoreSubmitInfo::default().semaphore(raw).stage_mask(stage);
        let mut signals = vec![semaphore(self.gpu.timeline, all).value(self.number)];
        signals.extend(drawn.map(|drawn| semaphore(drawn, all)));
        let waits: Vec<_> = self.acquired.iter().map(|raw| semaphore(*raw, ACQUIRED_AT)).collect();
        let submits = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals)];
        slot.submitted = Instant::now();
        // SAFETY: the buffer was begun by `Gpu::begin`; the lock that this frame holds protects queue and buffer;
        // objects that it uses are kept by `retire` until this number has completed.
        unsafe {
            self.gpu.device.end_command_buffer(slot.commands).named("vkEndCommandBuffer")?;
            self.gpu
                .device
                .queue_submit2(self.gpu.queue, &submits, vk::Fence::null())
                .named("vkQueueSubmit2")?;
        }
        slot.number = self.number;
        Ok(FrameNumber(self.number))
    }
}

impl Drop for GpuFrame<'_> {
    fn drop(&mut self) {
        // A panic may have left a rendering open; such commands must not be executed.
        if self.open
            && !std::thread::panicking()
            && let Err(error) = self.finish(None)
        {
            tracing::error!("a frame that was given up could not be submitted: {error}");
        }
    }
}
