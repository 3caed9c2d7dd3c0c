//! The open device, which every other object holds by `Arc`.

mod abilities;

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::{ext, khr, vk};

use crate::gpu::device::cache::PipelineCache;
use crate::gpu::device::faults::{CallFaults, DeviceFaults};
use crate::gpu::device::instance::{DebugNames, VulkanInstance};
#[cfg(feature = "faults")]
use crate::gpu::device::loss::Loss;
use crate::gpu::device::memory::Memory;
use crate::gpu::device::options::GpuOptions;
use crate::gpu::device::physical::{DeviceChoice, DeviceInfo, DeviceKind, PhysicalDevice, enumerate, pick};
use crate::gpu::device::retire::{PipelineHandles, RetireQueue, Retired};
use crate::gpu::device::ring::FrameRing;
use crate::gpu::device::spares::SparePipelines;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::clock::DeviceClock;
use crate::gpu::timing::rows::{ScopeTime, TimingInfo, TimingRows};
use crate::memory::limit_free_memory;

/// Number of a submitted frame, on which one can wait; monotonically increasing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FrameNumber(pub(in crate::gpu) u64);

impl FrameNumber {
    /// The raw number, as in [`ScopeRow::frame`](crate::gpu::ScopeRow::frame).
    pub fn get(self) -> u64 {
        self.0
    }
}

/// Objects existing on a device.
#[derive(Clone, Debug, Default)]
pub struct Inventory {
    /// Images and buffers, with the bytes of device memory that each holds; sorted by name.
    pub memory: Vec<(String, u64)>,
    /// Compiled pipelines with their specialization constants, in order of compilation.
    pub pipelines: Vec<String>,
}

/// An open device with its queue, its memory and its frames.
///
/// One thread records at a time ([`Gpu::begin`] holds a lock until the frame is submitted); everything else may be
/// called from any thread.
pub struct Gpu {
    pub(in crate::gpu) device: ash::Device,
    pub(in crate::gpu) push_descriptor: khr::push_descriptor::Device,
    pub(in crate::gpu) debug: DebugNames,
    pub(in crate::gpu) queue: vk::Queue,
    pub(in crate::gpu) queue_family: u32,
    pub(in crate::gpu) physical: vk::PhysicalDevice,
    pub(in crate::gpu) memory: Memory,
    pub(in crate::gpu) timeline: vk::Semaphore,
    frames: Mutex<FrameRing>,
    /// Number of the frame begun last.
    pub(in crate::gpu) begun: AtomicU64,
    pub(in crate::gpu) timing: AtomicBool,
    /// Number of timestamps recorded.
    pub(in crate::gpu) queries: AtomicU64,
    /// Largest side of an image, texels.
    pub(in crate::gpu) max_extent: u32,
    /// Largest allocation, bytes.
    pub(in crate::gpu) max_allocation: u64,
    /// Bytes of shared memory per workgroup, and of a storage buffer binding.
    max_shared: AtomicU32,
    max_storage: u32,
    /// Device loss planned by a test.
    #[cfg(feature = "faults")]
    pub(in crate::gpu) loss: Loss,
    /// Call results planned by a test.
    faults: CallFaults,
    retired: Mutex<RetireQueue>,
    /// Unowned pipelines that can be reused.
    spares: Mutex<SparePipelines>,
    /// The driver's cache of compiled pipelines.
    pub(in crate::gpu) pipelines: PipelineCache,
    /// Names and constants of the compiled pipelines.
    compiled: Mutex<Vec<String>>,
    pub(in crate::gpu) sampler: vk::Sampler,
    info: DeviceInfo,
    large_points: bool,
    draws_layers: bool,
    prefers_compute: bool,
    is_processor: bool,
    /// Last field, so that it is destroyed after the device.
    pub(in crate::gpu) instance: Arc<VulkanInstance>,
}

/// Locks a mutex, ignoring poisoning: every change is made in one step, so a panic of another thread leaves nothing half-changed.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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
        let instance = Arc::new(VulkanInstance::new(options.validation, None)?);
        let physical = pick(enumerate(&instance)?, choice)?;
        Self::open(instance, physical, options, false, CallFaults::default())
    }

    /// Opens a physical device; `windows` if it will draw into windows. `faults`: call results planned by a test.
    pub(in crate::gpu) fn open(
        instance: Arc<VulkanInstance>,
        physical: PhysicalDevice,
        options: GpuOptions,
        windows: bool,
        faults: CallFaults,
    ) -> Result<Arc<Self>, GpuError> {
        if physical.info.kind == DeviceKind::Cpu {
            limit_free_memory();
        }
        let mut gpu = Self::bare(instance, physical, options, windows, faults)?;
        // From here on a failure drops `gpu`, which destroys everything created so far.
        gpu.fill()?;
        Ok(Arc::new(gpu))
    }

    /// A device with memory, but without the objects that [`fill`](Self::fill) creates.
    fn bare(
        instance: Arc<VulkanInstance>,
        physical: PhysicalDevice,
        options: GpuOptions,
        windows: bool,
        faults: CallFaults,
    ) -> Result<Self, GpuError> {
        let device = create_device(&instance, &physical, windows)?;
        let memory = match Memory::new(&instance, &device, &physical, &faults) {
            Ok(memory) => memory,
            Err(error) => {
                // SAFETY: nothing was made of the device.
                unsafe { device.destroy_device(None) };
                return Err(error);
            }
        };
        let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut v11);
        // SAFETY: plain query of a device that knows Vulkan 1.3, as was checked when it was picked.
        unsafe { instance.raw.get_physical_device_properties2(physical.raw, &mut properties) };
        let PhysicalDevice { limits, queue_family, timestamp_bits, calibrated, .. } = physical;
        let clock =
            DeviceClock::new(&instance.raw, &device, calibrated, timestamp_bits, limits.timestamp_period);
        let is_processor = physical.info.kind == DeviceKind::Cpu && !options.as_gpu;
        Ok(Gpu {
            push_descriptor: khr::push_descriptor::Device::new(&instance.raw, &device),
            debug: DebugNames::new(&instance, &device),
            // SAFETY: `create_device` has asked for one queue of this family.
            queue: unsafe { device.get_device_queue(queue_family, 0) },
            queue_family,
            physical: physical.raw,
            memory,
            timeline: vk::Semaphore::null(),
            frames: Mutex::new(FrameRing::new(clock)),
            begun: AtomicU64::new(0),
            timing: AtomicBool::new(false),
            queries: AtomicU64::new(0),
            max_extent: limits.max_image_dimension2_d,
            max_allocation: v11.max_memory_allocation_size,
            max_shared: AtomicU32::new(limits.max_compute_shared_memory_size),
            max_storage: limits.max_storage_buffer_range,
            #[cfg(feature = "faults")]
            loss: Loss::default(),
            retired: Mutex::default(),
            spares: Mutex::default(),
            pipelines: PipelineCache::new(physical.origin, &faults),
            faults,
            compiled: Mutex::default(),
            sampler: vk::Sampler::null(),
            large_points: physical.large_points && !options.quads,
            draws_layers: physical.output_layer,
            is_processor,
            prefers_compute: options.compute.unwrap_or(!is_processor)
                && limits.max_compute_work_group_invocations >= 256,
            info: physical.info,
            device,
            instance,
        })
    }

    /// Creates the timeline semaphore, the pipeline cache, the sampler and the frames.
    fn fill(&mut self) -> Result<(), GpuError> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: timelineSemaphore is enabled.
        self.timeline = unsafe { self.device.create_semaphore(&info, None) }.named("vkCreateSemaphore")?;
        self.name(self.queue, "queue");
        self.name(self.timeline, "frame timeline");
        let cache = self.pipelines.fill(&self.device)?;
        self.name(cache, "compiled pipelines");
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let info = vk::SamplerCreateInfo::default()
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: no feature beyond core 1.0 is asked for.
        self.sampler = unsafe { self.device.create_sampler(&info, None) }.named("vkCreateSampler")?;
        self.name(self.sampler, "sampler");
        let frames = self.frames.get_mut().unwrap_or_else(PoisonError::into_inner);
        frames.fill(&self.device, &self.debug, self.queue_family)
    }

    /// Describes this device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// All messages of the validation layer so far, oldest first; empty without validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.instance.messages()
    }

    /// Lists the objects on the device; objects dropped during the last frames may still be included.
    pub fn inventory(&self) -> Inventory {
        let report = locked(&self.memory.shared()).generate_report();
        let mut memory: Vec<_> = report.allocations.into_iter().map(|a| (a.name, a.size)).collect();
        memory.sort();
        Inventory { memory, pipelines: locked(&self.compiled).clone() }
    }

    /// Records that a pipeline of this shader with these constants was compiled.
    pub(in crate::gpu) fn note_compiled(&self, shader: &str, constants: &[u32]) {
        let constants = constants.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
        locked(&self.compiled).push(format!("{shader} [{constants}]"));
    }

    /// Number of pipelines that were compiled.
    pub fn compiled_pipelines(&self) -> usize {
        locked(&self.compiled).len()
    }

    /// Fault injection, for tests.
    pub fn faults(&self) -> &CallFaults {
        &self.faults
    }

    /// Checks whether `bytes` can be allocated once `freed` are released, as far as the system reports budgets.
    ///
    /// # Errors
    ///
    /// [`GpuError::Memory`], naming what the bytes are for.
    pub fn check_room(&self, name: &str, bytes: u64, freed: u64) -> Result<(), GpuError> {
        self.memory.check_room(name, bytes, freed)
    }

    /// Plans the faults of a device that was opened after the loss of `earlier` others.
    pub fn plan(&self, faults: &DeviceFaults, earlier: u32) {
        #[cfg(feature = "faults")]
        {
            if let Some(frames) = faults.losses.get(earlier as usize) {
                self.lose_after(*frames);
            }
            if let Some(bytes) = faults.memory {
                self.limit_memory(bytes);
            }
        }
        #[cfg(not(feature = "faults"))]
        let _ = (faults, earlier);
    }

    /// Limits the memory for images and buffers, like a smaller device. For tests.
    #[cfg(feature = "faults")]
    pub fn limit_memory(&self, bytes: u64) {
        self.memory.limit(bytes);
    }

    /// Limits the shared memory per workgroup, like a smaller device. For tests.
    #[cfg(feature = "faults")]
    pub fn limit_shared(&self, bytes: u32) {
        self.max_shared.fetch_min(bytes, Ordering::Relaxed);
    }

    /// Lets `submits` more frames be submitted; after that the device stays lost: submitting, waiting, acquiring and presenting fail with
    /// an error for which [`GpuError::is_device_lost`] holds. For tests.
    #[cfg(feature = "faults")]
    pub fn lose_after(&self, submits: u64) {
        self.loss.after(submits);
    }

    /// The error of `call` once the device is lost as a test has planned.
    pub(in crate::gpu) fn alive(&self, call: &str) -> Result<(), GpuError> {
        #[cfg(feature = "faults")]
        return self.loss.check(call);
        #[cfg(not(feature = "faults"))]
        {
            let _ = call;
            Ok(())
        }
    }

    /// Switches timestamps on or off for the frames that begin from now on.
    pub fn set_timing(&self, on: bool) {
        self.timing.store(on, Ordering::Relaxed);
    }

    /// Takes the sums of all scopes of completed frames since the last call, in the order of their first use.
    ///
    /// lavapipe does not count clears of attachments in the scope that does them.
    pub fn take_timings(&self) -> Vec<ScopeTime> {
        let mut frames = self.frames();
        let readings = frames.read_completed(&self.device, self.completed().unwrap_or(0));
        std::mem::take(&mut readings.totals)
    }

    /// Takes the rows of all scopes of completed frames since the last call, in the order of the frames; see [`TimingRows`]. Must be called
    /// at least every few hundred frames, or rows are lost.
    pub fn take_rows(&self) -> TimingRows {
        let mut frames = self.frames();
        frames.read_completed(&self.device, self.completed().unwrap_or(0)).take_rows()
    }

    /// How timestamps of this device are converted to host times, and what cannot be timed.
    pub fn timing_info(&self) -> TimingInfo {
        self.frames().readings.info(self.info.kind == DeviceKind::Cpu)
    }

    /// Number of timestamps recorded since the device was opened: stays 0 while timing is off.
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

    /// Whether this frame has completed on the GPU, or the device is lost; never blocks.
    pub fn has_completed(&self, frame: FrameNumber) -> bool {
        self.completed().map_or(true, |last| last >= frame.0)
    }

    /// Number of the last frame that has completed.
    pub(in crate::gpu) fn completed(&self) -> Result<u64, GpuError> {
        self.alive("vkGetSemaphoreCounterValue")?;
        // SAFETY: the timeline lives as long as `self`.
        unsafe { self.device.get_semaphore_counter_value(self.timeline) }.named("vkGetSemaphoreCounterValue")
    }

    /// Locks the frames in flight; the holder of the lock may record and submit.
    pub(in crate::gpu) fn frames(&self) -> MutexGuard<'_, FrameRing> {
        locked(&self.frames)
    }

    /// Destroys `object` once no frame in flight can use it.
    pub(in crate::gpu) fn retire(&self, object: Retired) {
        let frame = self.begun.load(Ordering::Acquire);
        locked(&self.retired).push(frame, object);
    }

    /// Destroys objects retired by completed frames, to free memory before new objects are created; beginning a frame does the same.
    ///
    /// # Errors
    ///
    /// When the device was lost.
    pub fn free_retired(&self) -> Result<(), GpuError> {
        self.collect_retired(self.completed()?);
        Ok(())
    }

    /// Destroys what was retired in frames that have completed.
    pub(in crate::gpu) fn collect_retired(&self, completed: u64) {
        // SAFETY: the timeline has reached `completed`.
        unsafe { locked(&self.retired).collect(completed, &self.device, &self.memory) };
    }

    /// An unowned pipeline of this description, if there is one, so that a film of another size need not compile anything.
    pub(in crate::gpu) fn take_spare(&self, description: &str) -> Option<PipelineHandles> {
        locked(&self.spares).take(description)
    }

    /// Keeps a pipeline for reuse, and destroys the one that has waited longest if there are too many. The device may still be using it;
    /// pipelines are immutable.
    pub(in crate::gpu) fn keep_spare(&self, description: String, handles: PipelineHandles) {
        let oldest = locked(&self.spares).keep(description, handles);
        oldest.into_iter().for_each(|handles| self.retire(Retired::Pipeline(handles)));
    }

    /// Makes a semaphore of this name.
    pub(in crate::gpu) fn semaphore(&self, name: &str) -> Result<vk::Semaphore, GpuError> {
        // SAFETY: no feature is needed.
        let made = unsafe { self.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
        self.made(made, "vkCreateSemaphore", name)
    }

    /// Creates a named view of existing levels of an image.
    pub(in crate::gpu) fn view(
        &self,
        image: vk::Image,
        format: vk::Format,
        kind: vk::ImageViewType,
        levels: vk::ImageSubresourceRange,
        name: &str,
    ) -> Result<vk::ImageView, GpuError> {
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(kind)
            .format(format)
            .subresource_range(levels);
        // SAFETY: the image has these levels and this format.
        let made = unsafe { self.device.create_image_view(&info, None) };
        self.made(made, "vkCreateImageView", name)
    }

    /// Names an object created by `call`; the error names both.
    pub(in crate::gpu) fn made<T: vk::Handle + Copy>(
        &self,
        made: Result<T, vk::Result>,
        call: &str,
        name: &str,
    ) -> Result<T, GpuError> {
        let object = made.named(&format!("{call}({name})"))?;
        self.name(object, name);
        Ok(object)
    }

    /// Gives a handle its name in debuggers and messages.
    pub(in crate::gpu) fn name(&self, handle: impl vk::Handle, name: &str) {
        self.debug.name(handle, name);
    }
}

/// Creates the device with one graphics queue and the features found when it was picked.
fn create_device(
    instance: &VulkanInstance,
    physical: &PhysicalDevice,
    windows: bool,
) -> Result<ash::Device, GpuError> {
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(physical.queue_family)
        .queue_priorities(&[1.0])];
    let mut extensions = vec![khr::push_descriptor::NAME.as_ptr()];
    if windows {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    extensions.extend(physical.calibrated.map(|name| name.as_ptr()));
    let features = vk::PhysicalDeviceFeatures::default().large_points(physical.large_points);
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .timeline_semaphore(true)
        .host_query_reset(true)
        .shader_output_layer(physical.output_layer);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true)
        .maintenance4(true);
    let mut id = vk::PhysicalDevicePresentIdFeaturesKHR::default().present_id(true);
    let mut wait = vk::PhysicalDevicePresentWaitFeaturesKHR::default().present_wait(true);
    if windows && physical.window.hdr_metadata {
        extensions.push(ext::hdr_metadata::NAME.as_ptr());
    }
    let waits = windows && physical.window.present_wait;
    if waits {
        extensions.extend([khr::present_id::NAME.as_ptr(), khr::present_wait::NAME.as_ptr()]);
    }
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut v12)
        .push_next(&mut v13);
    if waits {
        info = info.push_next(&mut id).push_next(&mut wait);
    }
    // SAFETY: the physical device offers all features and extensions; pointers outlive the call.
    unsafe { instance.raw.create_device(physical.raw, &info, None) }.named("vkCreateDevice")
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gpu").field("info", &self.info).finish_non_exhaustive()
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        let spares = std::mem::take(&mut *locked(&self.spares));
        // SAFETY: this is the last owner (everything else holds an `Arc<Gpu>`), and after the wait nothing is pending; null
        // handles, of a device that could not be opened, are allowed here.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.collect_retired(u64::MAX);
            spares.into_handles().for_each(|handles| handles.destroy(&self.device));
            self.pipelines.destroy(&self.device);
            self.frames().destroy(&self.device);
            self.device.destroy_sampler(self.sampler, None);
            self.device.destroy_semaphore(self.timeline, None);
            self.memory.destroy();
            self.device.destroy_device(None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After an error all objects are destroyed, children before the device and the device before the instance: the validation layer
    /// reports any object that is left.
    #[test]
    fn an_error_leaves_nothing_behind() {
        let instance = VulkanInstance::new(true, None);
        let instance = Arc::new(instance.expect("the validation layer (Debian: vulkan-validationlayers)"));
        for filled in [false, true] {
            let physical = pick(enumerate(&instance).expect("a driver"), &DeviceChoice::Best);
            let options = GpuOptions::default();
            let gpu = Gpu::bare(
                instance.clone(),
                physical.expect("a device"),
                options,
                false,
                CallFaults::default(),
            );
            let mut gpu = gpu.expect("a device");
            if filled {
                gpu.fill().expect("its parts");
            }
        }
        let messages = instance.messages();
        assert!(messages.is_empty(), "{messages:?}");
    }

    /// Without timestamps the host times frames, and no query is recorded.
    #[test]
    fn queues_without_timestamps_are_timed_by_the_host() {
        let instance = Arc::new(VulkanInstance::new(true, None).expect("the validation layer"));
        let mut physical =
            pick(enumerate(&instance).expect("a driver"), &DeviceChoice::Best).expect("a device");
        physical.timestamp_bits = 0;
        let gpu = Gpu::open(instance, physical, GpuOptions::default(), false, CallFaults::default())
            .expect("a device");
        gpu.set_timing(true);
        for _ in 0..3 {
            let mut frame = gpu.begin().expect("a frame");
            {
                let mut cmd = frame.cmd();
                let mut outer = cmd.scope("outer");
                drop(outer.scope("inner"));
            }
            gpu.wait(frame.submit().expect("submit")).expect("wait");
        }
        let times = gpu.take_timings();
        let counts: Vec<_> = times.iter().map(|t| (t.name, t.count)).collect();
        assert_eq!(counts, [("outer", 3)]);
        assert!(times[0].milliseconds > 0.0, "{times:?}");
        assert_eq!(gpu.queries_recorded(), 0);
        assert_eq!(gpu.timing_info().bits, 0);
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
    }
}
