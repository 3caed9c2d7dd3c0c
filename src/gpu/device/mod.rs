//! The device: the root that every other object holds by `Arc`.

pub(in crate::gpu) mod capability;
pub(in crate::gpu) mod choice;
pub(in crate::gpu) mod instance;
pub(in crate::gpu) mod inventory;
pub(in crate::gpu) mod loss;
pub(in crate::gpu) mod memory;
pub(in crate::gpu) mod opening;
pub(in crate::gpu) mod retire;
pub(in crate::gpu) mod spare;

use std::ffi::CString;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::{ext, khr, vk};

use crate::gpu::commands::cmd::Sampler;
use crate::gpu::commands::frame::{FrameNumber, FrameRing};
use crate::gpu::device::capability;
use crate::gpu::device::choice::{DeviceChoice, DeviceInfo, DeviceKind, enumerate, pick};
use crate::gpu::device::instance::Instance;
use crate::gpu::device::loss::Loss;
use crate::gpu::device::memory::{Memory, keep_freed_host_memory};
use crate::gpu::device::opening::{Opening, Parts};
use crate::gpu::device::retire::{RetireQueue, Retired};
use crate::gpu::device::spare::Spares;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::clock::Clock;
use crate::gpu::timing::queries::ScopeTime;
use crate::gpu::timing::rows::{TimingInfo, TimingRows};
use crate::gpu::window::surface::{Surface, WindowHandles};

/// How a [`Gpu`] is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Run the validation layer with synchronization validation; slow.
    pub validation: bool,
    /// Draw sprites as instanced quads even where large points exist (the fallback, for its tests).
    pub quads: bool,
}

impl GpuOptions {
    /// Validation when `POINTILLIST_VALIDATION` is set to anything but `0`.
    pub fn from_env() -> Self {
        let validation = std::env::var("POINTILLIST_VALIDATION").is_ok_and(|v| !v.is_empty() && v != "0");
        Self { validation, quads: false }
    }
}

/// An open device with its queue, its memory and its frames.
///
/// One thread records at a time ([`Gpu::begin`] holds a lock until the frame is submitted); everything else may be
/// called from any thread.
pub struct Gpu {
    pub(in crate::gpu) device: ash::Device,
    pub(in crate::gpu) push_descriptor: khr::push_descriptor::Device,
    pub(in crate::gpu) names: Option<ext::debug_utils::Device>,
    pub(in crate::gpu) queue: vk::Queue,
    pub(in crate::gpu) memory: Memory,
    pub(in crate::gpu) timeline: vk::Semaphore,
    pub(in crate::gpu) frames: Mutex<FrameRing>,
    /// Number of the frame begun last.
    pub(in crate::gpu) begun: AtomicU64,
    pub(in crate::gpu) timing: AtomicBool,
    /// Timestamps recorded so far.
    pub(in crate::gpu) queries: AtomicU64,
    /// Largest side of an image, texels.
    pub(in crate::gpu) max_extent: u32,
    /// Largest allocation, bytes.
    pub(in crate::gpu) max_allocation: u64,
    /// What tests have planned.
    pub(in crate::gpu) loss: Loss,
    pub(in crate::gpu) physical: vk::PhysicalDevice,
    pub(in crate::gpu) queue_family: u32,
    /// Bytes that a workgroup can share, and that a shader can see of one buffer.
    pub(in crate::gpu) max_shared: u32,
    pub(in crate::gpu) max_storage: u32,
    retired: Mutex<RetireQueue>,
    /// Pipelines without a holder.
    pub(in crate::gpu) spares: Mutex<Spares>,
    /// Pipelines that were compiled, in words.
    pub(in crate::gpu) compiled: Mutex<Vec<String>>,
    samplers: [vk::Sampler; 2],
    info: DeviceInfo,
    large_points: bool,
    /// Last: destroyed after the device.
    pub(in crate::gpu) instance: Arc<Instance>,
}

impl Gpu {
    /// Opens the device of this choice, with validation as the environment says.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoLoader`], [`GpuError::NoDevice`], [`GpuError::NoMatch`] and [`GpuError::Unsuitable`] say what to
    /// install or to choose; [`GpuError::Call`] names the call that failed.
    pub fn new(choice: &DeviceChoice) -> Result<Arc<Self>, GpuError> {
        Self::with_options(choice, GpuOptions::from_env())
    }

    /// Opens the device of this choice with these options.
    ///
    /// # Errors
    ///
    /// As [`Gpu::new`], and [`GpuError::NoValidationLayer`].
    pub fn with_options(choice: &DeviceChoice, options: GpuOptions) -> Result<Arc<Self>, GpuError> {
        let instance = Arc::new(Instance::new(options.validation, None)?);
        let picked = pick(enumerate(&instance)?, choice)?;
        let capability = capability::check(&instance, picked.0);
        Self::open(instance, picked, &capability, (options, false))
    }

    /// Opens the device of this choice among those that can show pictures in a window, and the window's surface.
    pub(in crate::gpu) fn for_window(
        choice: &DeviceChoice,
        options: GpuOptions,
        window: WindowHandles,
    ) -> Result<(Arc<Self>, Surface), GpuError> {
        let instance = Arc::new(Instance::new(options.validation, Some(window.0))?);
        let surface = Surface::new(&instance, window)?;
        let (picked, capability) = surface.pick(choice)?;
        Ok((Self::open(instance, picked, &capability, (options, true))?, surface))
    }

    /// Opens a device that was picked; for windows where the second of the options says so.
    fn open(
        instance: Arc<Instance>,
        (physical, info): (vk::PhysicalDevice, DeviceInfo),
        capability: &capability::Capability,
        (options, windows): (GpuOptions, bool),
    ) -> Result<Arc<Self>, GpuError> {
        let mut opening = Opening::new(&instance, physical, capability, windows)?;
        let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut v11);
        // SAFETY: plain query of a device that knows Vulkan 1.3, as checked by `pick`.
        unsafe { instance.raw.get_physical_device_properties2(physical, &mut properties) };
        let limits = properties.properties.limits;
        let tick = if capability.timestamp_bits > 0 { limits.timestamp_period } else { 0.0 };
        let family = capability.queue_family;
        let memory = opening.fill(&instance, physical, (family, tick))?;
        if info.kind == DeviceKind::Cpu {
            keep_freed_host_memory();
        }
        // Nothing fails from here on: `Gpu::drop` destroys what `opening` would have.
        let Parts { device, timeline, mut frames, samplers } = opening.take();
        frames.clock(Clock::new(&instance, &device, capability, limits.timestamp_period));
        let gpu = Gpu {
            push_descriptor: khr::push_descriptor::Device::new(&instance.raw, &device),
            names: instance.names.then(|| ext::debug_utils::Device::new(&instance.raw, &device)),
            // SAFETY: one queue of this family was asked for in `Opening::new`.
            queue: unsafe { device.get_device_queue(family, 0) },
            memory,
            timeline,
            frames: Mutex::new(frames),
            begun: AtomicU64::new(0),
            timing: AtomicBool::new(false),
            queries: AtomicU64::new(0),
            max_extent: limits.max_image_dimension2_d,
            max_allocation: v11.max_memory_allocation_size,
            loss: Loss::default(),
            physical,
            queue_family: family,
            max_shared: limits.max_compute_shared_memory_size,
            max_storage: limits.max_storage_buffer_range,
            retired: Mutex::default(),
            spares: Mutex::default(),
            compiled: Mutex::default(),
            samplers,
            large_points: capability.large_points && !options.quads,
            device,
            info,
            instance,
        };
        gpu.name(gpu.queue, "queue");
        gpu.name(gpu.timeline, "frame timeline");
        gpu.name(gpu.samplers[0], "sampler nearest");
        gpu.name(gpu.samplers[1], "sampler trilinear");
        if let Ok(frames) = gpu.frames.lock() {
            frames.name(&gpu);
        }
        Ok(Arc::new(gpu))
    }

    /// What this device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// True when points of at least 8 pixels can be drawn; sprites are instanced quads otherwise.
    pub fn large_points(&self) -> bool {
        self.large_points
    }

    /// Bytes that the threads of one workgroup can share.
    pub fn shared_bytes(&self) -> usize {
        self.max_shared as usize
    }

    /// Bytes of one buffer that a shader can see.
    pub fn storage_bytes(&self) -> usize {
        self.max_storage as usize
    }

    /// Everything the validation layer has said so far, oldest first; empty without validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.instance.messages()
    }

    /// Switches timestamps on or off for the frames that begin from now on.
    pub fn set_timing(&self, on: bool) {
        self.timing.store(on, Ordering::Relaxed);
    }

    /// Lets `count` more images and buffers get memory; all later ones are refused as if it were exhausted. For tests of
    /// what happens then; `u64::MAX` ends it.
    pub fn fail_allocations_after(&self, count: u64) {
        self.memory.fail_after(count);
    }

    /// Takes the sums of all scopes of completed frames since the last call, in the order of their first use.
    ///
    /// lavapipe does not count clears of attachments in the scope that does them.
    pub fn take_timings(&self) -> Vec<ScopeTime> {
        let mut frames = self.frames.lock().unwrap_or_else(|e| e.into_inner());
        frames.take_timings(&self.device, self.completed().unwrap_or(0))
    }

    /// Takes the rows of all scopes of completed frames since the last call, in the order of the frames; see
    /// [`TimingRows`]. To get those of every frame, call it at least every few hundred frames.
    pub fn take_rows(&self) -> TimingRows {
        let mut frames = self.frames.lock().unwrap_or_else(|e| e.into_inner());
        frames.take_rows(&self.device, self.completed().unwrap_or(0))
    }

    /// How timestamps of this device become times of the host, and what cannot be timed.
    pub fn timing_info(&self) -> TimingInfo {
        let frames = self.frames.lock().unwrap_or_else(|e| e.into_inner());
        frames.timing_info(self.info.kind == DeviceKind::Cpu)
    }

    /// Timestamps recorded since the device was opened: stays 0 while timing is off.
    pub fn queries_recorded(&self) -> u64 {
        self.queries.load(Ordering::Relaxed)
    }

    /// Waits until a frame has completed on the GPU.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] when the device was lost.
    pub fn wait(&self, frame: FrameNumber) -> Result<(), GpuError> {
        self.alive("vkWaitSemaphores")?;
        let (semaphores, values) = ([self.timeline], [frame.0]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the timeline lives as long as `self`; every number given out was submitted.
        unsafe { self.device.wait_semaphores(&info, u64::MAX) }.named("vkWaitSemaphores")
    }

    /// True when this frame has completed on the GPU, and when the device is lost; never waits.
    pub fn has_completed(&self, frame: FrameNumber) -> bool {
        self.completed().map_or(true, |last| last >= frame.0)
    }

    /// Number of the last frame that has completed.
    pub(in crate::gpu) fn completed(&self) -> Result<u64, GpuError> {
        self.alive("vkGetSemaphoreCounterValue")?;
        // SAFETY: the timeline lives as long as `self`.
        unsafe { self.device.get_semaphore_counter_value(self.timeline) }.named("vkGetSemaphoreCounterValue")
    }

    /// Destroys `object` as soon as no frame can use it any more.
    pub(in crate::gpu) fn retire(&self, object: Retired) {
        let frame = self.begun.load(Ordering::Acquire);
        self.retired.lock().unwrap_or_else(|e| e.into_inner()).push(frame, object);
    }

    /// Destroys what was retired in frames that have completed.
    pub(in crate::gpu) fn collect_retired(&self, completed: u64) {
        let mut retired = self.retired.lock().unwrap_or_else(|e| e.into_inner());
        // SAFETY: the timeline has reached `completed`.
        unsafe { retired.collect(completed, &self.device, &self.memory) };
    }

    pub(in crate::gpu) fn sampler(&self, kind: Sampler) -> vk::Sampler {
        self.samplers[kind as usize]
    }

    /// Gives a handle its name in debuggers and messages.
    pub(in crate::gpu) fn name(&self, handle: impl vk::Handle, name: &str) {
        if let (Some(names), Ok(name)) = (&self.names, CString::new(name)) {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
            // SAFETY: the handle belongs to this device; a failure only costs the name.
            let _ = unsafe { names.set_debug_utils_object_name(&info) };
        }
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gpu").field("info", &self.info).finish_non_exhaustive()
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: this is the last owner (everything else holds an `Arc<Gpu>`), and after the wait nothing is pending.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.collect_retired(u64::MAX);
            self.spares.get_mut().unwrap_or_else(|e| e.into_inner()).destroy(&self.device);
            let mut frames = self.frames.lock().unwrap_or_else(|e| e.into_inner());
            Parts::destroy_children(&self.device, self.timeline, &mut frames, self.samplers);
            drop(frames);
            self.memory.destroy();
            self.device.destroy_device(None);
        }
    }
}
