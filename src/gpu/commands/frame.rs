//! Frames: two may be in flight, numbered by one timeline semaphore.

use std::sync::MutexGuard;
use std::sync::atomic::Ordering;
use std::time::Instant;

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::commands::sync::ACQUIRED_AT;
use crate::gpu::device::Gpu;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::clock::Clock;
use crate::gpu::timing::queries::{ScopeTime, Timers};
use crate::gpu::timing::rows::{FrameTimes, Readings, TimingInfo, TimingRows};

/// How many frames may be in flight.
pub(in crate::gpu) const IN_FLIGHT: usize = 2;

/// The number of a submitted frame, to wait for it; numbers only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FrameNumber(pub(in crate::gpu) u64);

impl FrameNumber {
    /// The number itself, as it stands in [`ScopeRow::frame`](crate::gpu::timing::rows::ScopeRow::frame).
    pub fn get(self) -> u64 {
        self.0
    }
}

/// What one frame in flight needs.
struct Slot {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    timers: Timers,
    /// Number of the frame submitted last from this slot.
    number: u64,
    /// When it was handed over.
    submitted: Instant,
}

impl Slot {
    /// Reads the timestamps of its frame, which has completed, once.
    fn read(&mut self, device: &ash::Device, readings: &mut Readings) {
        let times =
            FrameTimes { frame: self.number, submitted: self.submitted, seen: Instant::now(), untimed: 0 };
        self.timers.read(device, times, readings);
    }
}

/// The slots, used in turn.
#[derive(Default)]
pub(in crate::gpu) struct FrameRing {
    slots: Vec<Slot>,
    /// What is known of frames that have completed.
    readings: Readings,
}

impl FrameRing {
    /// Makes the slots of an empty ring. After an error [`destroy`](Self::destroy) frees what was made.
    ///
    /// `tick` is the duration of a timestamp step in nanoseconds; 0 where the queue has no timestamps.
    pub fn fill(&mut self, device: &ash::Device, family: u32, tick: f32) -> Result<(), GpuError> {
        for _ in 0..IN_FLIGHT {
            let timers = Timers::new(device, tick)?;
            let (pool, commands) = (vk::CommandPool::null(), vk::CommandBuffer::null());
            self.slots.push(Slot { pool, commands, timers, number: 0, submitted: Instant::now() });
            let Some(slot) = self.slots.last_mut() else { continue };
            let info = vk::CommandPoolCreateInfo::default()
                .flags(vk::CommandPoolCreateFlags::TRANSIENT)
                .queue_family_index(family);
            // SAFETY: the family exists.
            slot.pool = unsafe { device.create_command_pool(&info, None) }.named("vkCreateCommandPool")?;
            let info =
                vk::CommandBufferAllocateInfo::default().command_pool(slot.pool).command_buffer_count(1);
            // SAFETY: the pool was made above.
            let made = unsafe { device.allocate_command_buffers(&info) }.named("vkAllocateCommandBuffers")?;
            slot.commands = made.first().copied().unwrap_or_default();
        }
        Ok(())
    }

    /// Names the slots' objects.
    pub fn name(&self, gpu: &Gpu) {
        for (i, slot) in self.slots.iter().enumerate() {
            gpu.name(slot.pool, &format!("frame {i} pool"));
            gpu.name(slot.commands, &format!("frame {i} commands"));
            slot.timers.name(gpu, i);
        }
    }

    /// Takes the clock that rows are told in.
    pub fn clock(&mut self, clock: Option<Clock>) {
        self.readings.clock = clock;
    }

    /// Sums since the last call.
    pub fn take_timings(&mut self, device: &ash::Device, completed: u64) -> Vec<ScopeTime> {
        self.read_completed(device, completed);
        std::mem::take(&mut self.readings.totals)
    }

    /// Rows since the last call.
    pub fn take_rows(&mut self, device: &ash::Device, completed: u64) -> TimingRows {
        self.read_completed(device, completed);
        self.readings.take_rows()
    }

    /// See [`Gpu::timing_info`].
    pub fn timing_info(&self, software: bool) -> TimingInfo {
        self.readings.info(software)
    }

    fn read_completed(&mut self, device: &ash::Device, completed: u64) {
        let mut order: Vec<_> = self.slots.iter_mut().collect();
        order.sort_by_key(|slot| slot.number);
        for slot in order.into_iter().filter(|slot| slot.number <= completed) {
            slot.read(device, &mut self.readings);
        }
    }

    /// Destroys the slots.
    ///
    /// # Safety
    ///
    /// The device is idle, and the ring is not used afterwards.
    pub unsafe fn destroy(&mut self, device: &ash::Device) {
        for slot in self.slots.drain(..) {
            // SAFETY: the caller promises that nothing is pending.
            unsafe {
                slot.timers.destroy(device);
                device.destroy_command_pool(slot.pool, None);
            }
        }
    }
}

/// A frame that is being recorded, to be handed over by [`submit`](Self::submit).
///
/// Dropping it, as an error between recording and submitting does, submits what was recorded: images remember how they
/// were used last, and so do their owners, which would be wrong had the commands never run.
#[must_use = "submit() tells when the commands have run"]
pub struct Frame<'g> {
    gpu: &'g Gpu,
    ring: MutexGuard<'g, FrameRing>,
    number: u64,
    /// Signalled when the image of a window may be used.
    acquired: Option<vk::Semaphore>,
    /// Neither submitted nor failed.
    open: bool,
}

impl Gpu {
    /// Begins a frame, as soon as the frame before the last has completed. Other threads wait until it is submitted.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] when the device was lost or memory is exhausted.
    pub fn begin(&self) -> Result<Frame<'_>, GpuError> {
        let mut ring = self.frames.lock().unwrap_or_else(|e| e.into_inner());
        let number = self.begun.fetch_add(1, Ordering::AcqRel) + 1;
        let FrameRing { slots, readings } = &mut *ring;
        let slot = &mut slots[number as usize % IN_FLIGHT];
        self.wait(FrameNumber(slot.number))?;
        slot.read(&self.device, readings);
        self.collect_retired(self.completed()?);
        let timing = self.timing.load(Ordering::Relaxed);
        slot.timers.restart(&self.device, timing);
        if timing {
            readings.calibrate();
        }
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last frame has completed, and the lock keeps others from recording.
        unsafe {
            self.device
                .reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty())
                .named("vkResetCommandPool")?;
            self.device.begin_command_buffer(slot.commands, &info).named("vkBeginCommandBuffer")?;
        }
        Ok(Frame { gpu: self, ring, number, acquired: None, open: true })
    }
}

impl Frame<'_> {
    /// Its number, once it is submitted.
    pub(in crate::gpu) fn number(&self) -> u64 {
        self.number
    }

    /// Makes the frame wait for an image of a window, whether it is presented or given up.
    pub(in crate::gpu) fn wait_for(&mut self, acquired: vk::Semaphore) {
        self.acquired = Some(acquired);
    }

    /// The recorder.
    pub fn cmd(&mut self) -> Cmd<'_> {
        let slot = &mut self.ring.slots[self.number as usize % IN_FLIGHT];
        Cmd { gpu: self.gpu, raw: slot.commands, timers: &mut slot.timers }
    }

    /// Hands the commands to the GPU.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] when the device was lost or memory is exhausted.
    pub fn submit(mut self) -> Result<FrameNumber, GpuError> {
        self.finish(None)
    }

    /// Submits, to signal `drawn` when all has run; the frame keeps the queue locked until it is dropped.
    pub(in crate::gpu) fn finish(&mut self, drawn: Option<vk::Semaphore>) -> Result<FrameNumber, GpuError> {
        self.open = false;
        self.gpu.may_submit()?;
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

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        // A panic may have left a rendering open; such commands must not run.
        if self.open
            && !std::thread::panicking()
            && let Err(error) = self.finish(None)
        {
            tracing::error!("a frame that was given up could not be submitted: {error}");
        }
    }
}
