//! Making a device: what fails on the way destroys what was made before.

use ash::{khr, vk};

use crate::gpu::commands::frame::FrameRing;
use crate::gpu::device::capability::Capability;
use crate::gpu::device::instance::Instance;
use crate::gpu::device::memory::Memory;
use crate::gpu::error::{GpuError, Named};

/// A device and what belongs to it alone, all by its handles.
pub(in crate::gpu) struct Parts {
    pub device: ash::Device,
    /// Null until made, as the samplers are.
    pub timeline: vk::Semaphore,
    pub frames: FrameRing,
    /// Nearest and trilinear.
    pub samplers: [vk::Sampler; 2],
}

impl Parts {
    /// Destroys everything but the device.
    ///
    /// # Safety
    ///
    /// The device is idle, and none of the handles is used afterwards.
    pub unsafe fn destroy_children(
        device: &ash::Device,
        timeline: vk::Semaphore,
        frames: &mut FrameRing,
        samplers: [vk::Sampler; 2],
    ) {
        // SAFETY: the caller promises that nothing is pending; null handles are allowed here.
        unsafe {
            frames.destroy(device);
            samplers.into_iter().for_each(|s| device.destroy_sampler(s, None));
            device.destroy_semaphore(timeline, None);
        }
    }
}

/// A device on its way to become a [`Gpu`](crate::gpu::device::Gpu); dropping it destroys the device.
pub(in crate::gpu) struct Opening(Option<Parts>);

impl Opening {
    /// Makes the device; `windows` when it is to draw into windows.
    pub fn new(
        instance: &Instance,
        physical: vk::PhysicalDevice,
        capability: &Capability,
        windows: bool,
    ) -> Result<Self, GpuError> {
        let device = open(instance, physical, capability, windows)?;
        let (timeline, samplers) = (vk::Semaphore::null(), [vk::Sampler::null(); 2]);
        Ok(Self(Some(Parts { device, timeline, frames: FrameRing::default(), samplers })))
    }

    /// Makes all parts, and the memory last: what has it must not fail any more.
    ///
    /// `family` and `tick` are those of [`FrameRing::fill`].
    pub fn fill(
        &mut self,
        instance: &Instance,
        physical: vk::PhysicalDevice,
        (family, tick): (u32, f32),
    ) -> Result<Memory, GpuError> {
        let parts = self.0.as_mut().expect("only take() empties it");
        parts.timeline = timeline(&parts.device)?;
        parts.samplers[0] = sampler(&parts.device, vk::Filter::NEAREST)?;
        parts.samplers[1] = sampler(&parts.device, vk::Filter::LINEAR)?;
        parts.frames.fill(&parts.device, family, tick)?;
        Memory::new(instance, &parts.device, physical)
    }

    /// Hands the parts over; the caller destroys them.
    pub fn take(mut self) -> Parts {
        self.0.take().expect("only take() empties it")
    }
}

impl Drop for Opening {
    fn drop(&mut self) {
        if let Some(Parts { device, timeline, mut frames, samplers }) = self.0.take() {
            // SAFETY: nothing was ever submitted to this device.
            unsafe {
                Parts::destroy_children(&device, timeline, &mut frames, samplers);
                device.destroy_device(None);
            }
        }
    }
}

/// Makes the device with one graphics queue and the features that `capability` has found.
fn open(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    capability: &Capability,
    windows: bool,
) -> Result<ash::Device, GpuError> {
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(capability.queue_family)
        .queue_priorities(&[1.0])];
    let mut extensions = vec![khr::push_descriptor::NAME.as_ptr()];
    if windows {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    extensions.extend(capability.calibrated.map(|name| name.as_ptr()));
    let features = vk::PhysicalDeviceFeatures::default().large_points(capability.large_points);
    let mut v12 =
        vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true).host_query_reset(true);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true)
        .maintenance4(true);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::device::capability;
    use crate::gpu::device::choice::{DeviceChoice, enumerate, pick};

    /// Whatever was made before an error is destroyed, children before the device and the device before the instance: the
    /// validation layer reports every object that is left.
    #[test]
    fn an_error_leaves_nothing_behind() {
        let instance =
            Instance::new(true, None).expect("the validation layer (Debian: vulkan-validationlayers)");
        let (physical, _) =
            pick(enumerate(&instance).expect("a driver"), &DeviceChoice::Best).expect("a device");
        let capability = capability::check(&instance, physical);
        let family = capability.queue_family;
        let empty = Opening::new(&instance, physical, &capability, false).expect("a device");
        drop(empty);
        let mut full = Opening::new(&instance, physical, &capability, false).expect("a device");
        let mut memory = full.fill(&instance, physical, (family, 1.0)).expect("its parts");
        // SAFETY: nothing was allocated.
        unsafe { memory.destroy() };
        drop(full);
        let messages = instance.messages();
        assert!(messages.is_empty(), "{messages:?}");
    }
}
