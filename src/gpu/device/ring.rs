//! Command buffers and timestamps of the frames in flight.

use std::time::Instant;

use ash::vk;

use crate::gpu::device::instance::DebugNames;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::clock::DeviceClock;
use crate::gpu::timing::queries::Timers;
use crate::gpu::timing::rows::{FrameTimes, Readings};

/// Most frames in flight: a batch and a picture that the device works on, and the same again being recorded.
pub(in crate::gpu) const IN_FLIGHT: usize = 4;

/// The objects of one frame in flight.
pub(in crate::gpu) struct FrameSlot {
    pub pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    pub timers: Timers,
    /// Number of the frame submitted last from this slot.
    pub number: u64,
    /// When that frame was submitted.
    pub submitted: Instant,
}

impl FrameSlot {
    /// Reads the timestamps of its completed frame, once.
    pub fn read(&mut self, device: &ash::Device, readings: &mut Readings) {
        let times =
            FrameTimes { frame: self.number, submitted: self.submitted, seen: Instant::now(), untimed: 0 };
        self.timers.read(device, times, readings);
    }
}

/// The slots, used round-robin.
pub(in crate::gpu) struct FrameRing {
    pub slots: Vec<FrameSlot>,
    /// The timings of completed frames.
    pub readings: Readings,
}

impl FrameRing {
    /// A ring without slots.
    pub fn new(clock: Option<DeviceClock>) -> Self {
        Self { slots: Vec::new(), readings: Readings::new(clock) }
    }

    /// Creates the slots of an empty ring. After an error [`destroy`](Self::destroy) frees what was created.
    ///
    /// If the queue has no timestamps there is no clock, and the host times frames.
    pub fn fill(&mut self, device: &ash::Device, debug: &DebugNames, family: u32) -> Result<(), GpuError> {
        let stamps = self.readings.clock.is_some();
        for i in 0..IN_FLIGHT {
            let timers = Timers::new(device, stamps)?;
            debug.name(timers.pool, &format!("frame {i} timestamps"));
            let (pool, commands) = (vk::CommandPool::null(), vk::CommandBuffer::null());
            self.slots.push(FrameSlot { pool, commands, timers, number: 0, submitted: Instant::now() });
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
            debug.name(slot.pool, &format!("frame {i} pool"));
            debug.name(slot.commands, &format!("frame {i} commands"));
        }
        Ok(())
    }

    /// The readings, including every frame up to `completed`.
    pub fn read_completed(&mut self, device: &ash::Device, completed: u64) -> &mut Readings {
        let mut order: Vec<_> = self.slots.iter_mut().collect();
        order.sort_by_key(|slot| slot.number);
        for slot in order.into_iter().filter(|slot| slot.number <= completed) {
            slot.read(device, &mut self.readings);
        }
        &mut self.readings
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
