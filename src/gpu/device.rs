//! The device: the root that every other object holds by `Arc`.

use std::ffi::CString;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::{ext, khr, vk};

use super::capability;
use super::choice::{DeviceChoice, DeviceInfo, enumerate, pick};
use super::cmd::Sampler;
use super::error::{GpuError, Named};
use super::frame::{FrameNumber, FrameRing};
use super::instance::Instance;
use super::memory::Memory;
use super::retire::{RetireQueue, Retired};
use super::timing::ScopeTime;

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
    /// Largest side of an image, texels.
    pub(in crate::gpu) max_extent: u32,
    /// Largest allocation, bytes.
    pub(in crate::gpu) max_allocation: u64,
    retired: Mutex<RetireQueue>,
    samplers: [vk::Sampler; 2],
    info: DeviceInfo,
    large_points: bool,
    /// Last: destroyed after the device.
    instance: Instance,
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
        let instance = Instance::new(options.validation)?;
        let (physical, info) = pick(enumerate(&instance)?, choice)?;
        let capability = capability::check(&instance, physical);
        let device = open(&instance, physical, &capability)?;
        let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut v11);
        // SAFETY: plain query of a device that knows Vulkan 1.3, as checked by `pick`.
        unsafe { instance.raw.get_physical_device_properties2(physical, &mut properties) };
        let limits = properties.properties.limits;
        let tick = if capability.timestamp_bits > 0 { limits.timestamp_period } else { 0.0 };
        let family = capability.queue_family;
        // From here on everything is destroyed by `Gpu::drop`; what fails in between leaks with the process's device.
        let memory = Memory::new(&instance, &device, physical)?;
        let gpu = Gpu {
            push_descriptor: khr::push_descriptor::Device::new(&instance.raw, &device),
            names: instance.names.then(|| ext::debug_utils::Device::new(&instance.raw, &device)),
            // SAFETY: one queue of this family was asked for in `open`.
            queue: unsafe { device.get_device_queue(family, 0) },
            memory,
            timeline: timeline(&device)?,
            frames: Mutex::new(FrameRing::new(&device, family, tick)?),
            begun: AtomicU64::new(0),
            timing: AtomicBool::new(false),
            max_extent: limits.max_image_dimension2_d,
            max_allocation: v11.max_memory_allocation_size,
            retired: Mutex::default(),
            samplers: [sampler(&device, vk::Filter::NEAREST)?, sampler(&device, vk::Filter::LINEAR)?],
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

    /// Everything the validation layer has said so far, oldest first; empty without validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.instance.messages()
    }

    /// Switches timestamps on or off for the frames that begin from now on.
    pub fn set_timing(&self, on: bool) {
        self.timing.store(on, Ordering::Relaxed);
    }

    /// Takes the sums of all scopes of completed frames since the last call, in the order of their first use.
    ///
    /// lavapipe does not count clears of attachments in the scope that does them.
    pub fn take_timings(&self) -> Vec<ScopeTime> {
        let mut frames = self.frames.lock().unwrap_or_else(|e| e.into_inner());
        frames.take_timings(&self.device, self.completed().unwrap_or(0))
    }

    /// Waits until a frame has completed on the GPU.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] when the device was lost.
    pub fn wait(&self, frame: FrameNumber) -> Result<(), GpuError> {
        let (semaphores, values) = ([self.timeline], [frame.0]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the timeline lives as long as `self`; every number given out was submitted.
        unsafe { self.device.wait_semaphores(&info, u64::MAX) }.named("vkWaitSemaphores")
    }

    /// Number of the last frame that has completed.
    pub(in crate::gpu) fn completed(&self) -> Result<u64, GpuError> {
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
            self.frames.lock().unwrap_or_else(|e| e.into_inner()).destroy(&self.device);
            self.samplers.iter().for_each(|s| self.device.destroy_sampler(*s, None));
            self.device.destroy_semaphore(self.timeline, None);
            self.memory.destroy();
            self.device.destroy_device(None);
        }
    }
}

/// Makes the device with one graphics queue and the features that `capability` has found.
fn open(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    capability: &capability::Capability,
) -> Result<ash::Device, GpuError> {
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(capability.queue_family)
        .queue_priorities(&[1.0])];
    let extensions = [khr::push_descriptor::NAME.as_ptr()];
    let features = vk::PhysicalDeviceFeatures::default().large_points(capability.large_points);
    let mut v12 =
        vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true).host_query_reset(true);
    let mut v13 =
        vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut v12)
        .push_next(&mut v13);
    // SAFETY: all features and extensions were found by `capability::check`; pointers outlive the call.
    unsafe { instance.raw.create_device(physical, &info, None) }.named("vkCreateDevice")
}

fn timeline(device: &ash::Device) -> Result<vk::Semaphore, GpuError> {
    let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
    // SAFETY: timelineSemaphore is enabled.
    unsafe { device.create_semaphore(&info, None) }.named("vkCreateSemaphore")
}

/// A sampler that clamps to the edge; `LINEAR` interpolates between levels too.
fn sampler(device: &ash::Device, filter: vk::Filter) -> Result<vk::Sampler, GpuError> {
    let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
    let mipmap = match filter {
        vk::Filter::LINEAR => vk::SamplerMipmapMode::LINEAR,
        _ => vk::SamplerMipmapMode::NEAREST,
    };
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(filter)
        .min_filter(filter)
        .mipmap_mode(mipmap)
        .address_mode_u(edge)
        .address_mode_v(edge)
        .address_mode_w(edge)
        .max_lod(vk::LOD_CLAMP_NONE);
    // SAFETY: no feature beyond core 1.0 is asked for.
    unsafe { device.create_sampler(&info, None) }.named("vkCreateSampler")
}
