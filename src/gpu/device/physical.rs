//! The physical devices of the machine: features, missing requirements, and selection.

use std::ffi::CStr;

use ash::{ext, khr, vk};

use crate::gpu::device::heaps::{LocalMemory, MemorySource};
use crate::gpu::device::instance::VulkanInstance;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::clock;

/// The user's choice of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The best usable device: discrete before integrated, virtual and CPU.
    #[default]
    Best,
    /// The device at this place of the list that [`devices`] returns.
    Index(usize),
    /// The device with this text in its name, in any case of letters.
    Name(String),
}

impl DeviceChoice {
    /// Reads a word of the command line: empty is [`Best`](Self::Best), a number is an index, anything else a name.
    pub fn parse(text: &str) -> Self {
        match (text.is_empty(), text.parse()) {
            (true, _) => DeviceChoice::Best,
            (_, Ok(index)) => DeviceChoice::Index(index),
            _ => DeviceChoice::Name(text.to_owned()),
        }
    }
}

/// The kind of hardware of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Graphics that shares the processor's memory.
    Integrated,
    /// A graphics card lent to a virtual machine.
    Virtual,
    /// A software rasteriser such as lavapipe.
    Cpu,
    /// Anything else.
    Other,
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            DeviceKind::Discrete => "discrete GPU",
            DeviceKind::Integrated => "integrated GPU",
            DeviceKind::Virtual => "virtual GPU",
            DeviceKind::Cpu => "CPU",
            DeviceKind::Other => "other",
        })
    }
}

/// Description of a device for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Index in the list, for `--device`.
    pub index: usize,
    /// Name as the driver gives it.
    pub name: String,
    /// Kind of hardware.
    pub kind: DeviceKind,
    /// Driver's name and version, such as `llvmpipe Mesa 22.3.6 (LLVM 15.0.6)`.
    pub driver: String,
    /// Vulkan version, `major.minor.patch`.
    pub api: String,
    /// One sentence for each unmet requirement; empty when the device can be used.
    pub missing: Vec<String>,
}

impl DeviceInfo {
    /// Whether the device meets all requirements.
    pub fn is_suitable(&self) -> bool {
        self.missing.is_empty()
    }

    /// One sentence: usable, or what is missing.
    pub fn suitability(&self) -> String {
        if self.is_suitable() { "can be used".into() } else { self.missing.join(" ") }
    }
}

/// All devices of this machine, in the driver's order.
///
/// # Errors
///
/// [`GpuError::NoLoader`] and [`GpuError::NoDevice`] where Vulkan or its drivers are not installed.
pub fn devices() -> Result<Vec<DeviceInfo>, GpuError> {
    Ok(devices_with_memory()?.into_iter().map(|(info, _)| info).collect())
}

/// As [`devices`], with the present state of each one's memory.
///
/// # Errors
///
/// As [`devices`].
pub fn devices_with_memory() -> Result<Vec<(DeviceInfo, LocalMemory)>, GpuError> {
    let instance = VulkanInstance::new(false, None)?;
    let with_memory = |device: PhysicalDevice| {
        let source = MemorySource::new(&instance, &device);
        (device.info, source.read())
    };
    Ok(enumerate(&instance)?.into_iter().map(with_memory).collect())
}

/// Device and driver that a pipeline cache is valid for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::gpu) struct PipelineOrigin {
    pub vendor: u32,
    pub device: u32,
    pub driver: u32,
    pub uuid: [u8; vk::UUID_SIZE],
}

impl PipelineOrigin {
    pub fn new(properties: &vk::PhysicalDeviceProperties) -> Self {
        Self {
            vendor: properties.vendor_id,
            device: properties.device_id,
            driver: properties.driver_version,
            uuid: properties.pipeline_cache_uuid,
        }
    }

    /// Checks the header that Vulkan prescribes for the data of a cache (`VkPipelineCacheHeaderVersionOne`). Drivers are
    /// to refuse what is not theirs, but not all of them survive it.
    pub fn check(&self, data: &[u8]) -> Result<(), &'static str> {
        /// Length, version, vendor and device of four bytes each, then the UUID.
        const HEADER: usize = 16 + vk::UUID_SIZE;
        let header = data.get(..HEADER).ok_or("they are too short")?;
        let word = |i: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| header[4 * i + byte]));
        let version = vk::PipelineCacheHeaderVersion::ONE.as_raw() as u32;
        let length = word(0) as usize;
        if length != HEADER || word(1) != version {
            return Err("their header is damaged");
        }
        if word(2) != self.vendor || word(3) != self.device {
            return Err("another device has compiled them");
        }
        if header[16..] != self.uuid {
            return Err("another driver has compiled them");
        }
        Ok(())
    }
}

/// Optional window extensions, used if the device offers them.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::gpu) struct WindowOffers {
    /// `VK_KHR_present_id` and `VK_KHR_present_wait`, with their features.
    pub present_wait: bool,
    /// `VK_EXT_hdr_metadata`.
    pub hdr_metadata: bool,
}

/// A physical device with the features relevant to this program.
pub(in crate::gpu) struct PhysicalDevice {
    pub raw: vk::PhysicalDevice,
    pub info: DeviceInfo,
    /// Whether points of at least 8 pixels can be drawn; otherwise sprites are instanced quads.
    pub large_points: bool,
    /// Whether vertex shaders choose the layer that they draw to.
    pub output_layer: bool,
    /// Family of a queue for graphics and compute.
    pub queue_family: u32,
    /// Valid bits of a timestamp on that queue; 0 if timing is not supported.
    pub timestamp_bits: u32,
    /// The extension for reading the device's clock, if supported.
    pub calibrated: Option<&'static CStr>,
    pub limits: vk::PhysicalDeviceLimits,
    /// Identification for the pipeline cache.
    pub origin: PipelineOrigin,
    /// Optional features for windows.
    pub window: WindowOffers,
    extensions: Vec<vk::ExtensionProperties>,
    families: Vec<vk::QueueFamilyProperties>,
}

/// All devices of the instance, each checked against the requirements.
pub(in crate::gpu) fn enumerate(instance: &VulkanInstance) -> Result<Vec<PhysicalDevice>, GpuError> {
    // SAFETY: plain query of a live instance.
    let handles = unsafe { instance.raw.enumerate_physical_devices() }.named("vkEnumeratePhysicalDevices")?;
    if handles.is_empty() {
        return Err(GpuError::NoDevice);
    }
    Ok(handles.into_iter().enumerate().map(|(i, raw)| PhysicalDevice::describe(instance, raw, i)).collect())
}

impl PhysicalDevice {
    fn describe(instance: &VulkanInstance, raw: vk::PhysicalDevice, index: usize) -> Self {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the handle comes from this instance; drivers ignore structures that they do not know.
        let (extensions, families) = unsafe {
            instance.raw.get_physical_device_properties2(raw, &mut all);
            (
                instance.raw.enumerate_device_extension_properties(raw).unwrap_or_default(),
                instance.raw.get_physical_device_queue_family_properties(raw),
            )
        };
        let p = all.properties;
        let text = |s: Result<&CStr, _>| s.map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let version = p.api_version;
        let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
        let driver = [driver.driver_name_as_c_str(), driver.driver_info_as_c_str()].map(text).join(" ");
        let info = DeviceInfo {
            index,
            name: text(p.device_name_as_c_str()),
            kind: match p.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
                vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
                vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
                vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
                _ => DeviceKind::Other,
            },
            driver: driver.trim().to_owned(),
            api: format!("{major}.{minor}.{}", vk::api_version_patch(version)),
            missing: Vec::new(),
        };
        let calibrated = clock::extension(&instance.entry, &instance.raw, raw, &extensions);
        let mut device = Self {
            raw,
            info,
            large_points: false,
            output_layer: false,
            queue_family: 0,
            timestamp_bits: 0,
            calibrated,
            limits: p.limits,
            origin: PipelineOrigin::new(&p),
            window: WindowOffers::default(),
            extensions,
            families,
        };
        if version < vk::API_VERSION_1_3 {
            device.lacks(format!(
                "Vulkan 1.3 is needed, the driver offers {major}.{minor}: update the graphics driver."
            ));
        } else {
            device.check_features(instance);
            device.window = device.window_offers(instance);
        }
        if !device.offers(khr::push_descriptor::NAME) {
            device.lacks("The extension VK_KHR_push_descriptor is missing: update the graphics driver.");
        }
        device.check_formats(instance);
        device.take_queue_family(|_| true, "It has no queue for both graphics and compute.");
        device
    }

    /// Restricts the queue families to those that can present in a window, as determined by `presents`.
    pub fn check_window(&mut self, presents: impl Fn(u32) -> bool) {
        if !self.offers(khr::swapchain::NAME) {
            return self.lacks("It cannot draw into windows (VK_KHR_swapchain is missing).");
        }
        self.take_queue_family(presents, "It cannot show pictures in this window.");
    }

    fn lacks(&mut self, sentence: impl Into<String>) {
        self.info.missing.push(sentence.into());
    }

    fn offers(&self, extension: &CStr) -> bool {
        self.extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(extension))
    }

    /// Selects the first graphics and compute family that is `fit`; if there is none, records `missing` as a missing requirement.
    fn take_queue_family(&mut self, fit: impl Fn(u32) -> bool, missing: &str) {
        match usable_family(&self.families, fit) {
            Some((family, timestamp_bits)) => {
                (self.queue_family, self.timestamp_bits) = (family, timestamp_bits);
            }
            None => self.lacks(missing),
        }
    }

    /// Whether the system reports memory budgets.
    pub fn tells_budget(&self) -> bool {
        self.offers(ext::memory_budget::NAME)
    }

    /// Checks the core features of 1.2 and 1.3.
    fn check_features(&mut self, instance: &VulkanInstance) {
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        // SAFETY: the chain holds structures of versions that this device knows.
        unsafe { instance.raw.get_physical_device_features2(self.raw, &mut all) };
        let large_points = all.features.large_points == vk::TRUE;
        self.large_points = large_points && self.limits.point_size_range[1] >= 8.0;
        self.output_layer = v12.shader_output_layer == vk::TRUE;
        for (have, name) in [
            (v12.timeline_semaphore, "timelineSemaphore"),
            (v12.host_query_reset, "hostQueryReset"),
            (v13.dynamic_rendering, "dynamicRendering"),
            (v13.synchronization2, "synchronization2"),
            (v13.maintenance4, "maintenance4"), // SPIR-V 1.6 gives the size of workgroups by constants
        ] {
            if have == vk::FALSE {
                self.lacks(format!(
                    "The feature {name} of Vulkan 1.3 is missing: update the graphics driver."
                ));
            }
        }
    }

    /// Optional window features of the device.
    fn window_offers(&self, instance: &VulkanInstance) -> WindowOffers {
        let has_wait = self.offers(khr::present_id::NAME) && self.offers(khr::present_wait::NAME);
        let mut id = vk::PhysicalDevicePresentIdFeaturesKHR::default();
        let mut wait = vk::PhysicalDevicePresentWaitFeaturesKHR::default();
        if has_wait {
            let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut id).push_next(&mut wait);
            // SAFETY: the chain holds structures of extensions that this device offers.
            unsafe { instance.raw.get_physical_device_features2(self.raw, &mut all) };
        }
        WindowOffers {
            present_wait: id.present_id == vk::TRUE && wait.present_wait == vk::TRUE,
            hdr_metadata: self.offers(ext::hdr_metadata::NAME),
        }
    }

    /// Checks the required features of each format.
    fn check_formats(&mut self, instance: &VulkanInstance) {
        use vk::FormatFeatureFlags as F;
        let accumulate = F::COLOR_ATTACHMENT | F::COLOR_ATTACHMENT_BLEND | F::SAMPLED_IMAGE;
        let copied = F::TRANSFER_SRC | F::TRANSFER_DST;
        for (format, needs) in [
            (vk::Format::R32G32B32A32_SFLOAT, accumulate | copied),
            (vk::Format::R32_SFLOAT, accumulate | copied),
            (vk::Format::R8G8B8A8_UNORM, F::COLOR_ATTACHMENT | F::SAMPLED_IMAGE | copied),
        ] {
            // SAFETY: plain query.
            let have = unsafe { instance.raw.get_physical_device_format_properties(self.raw, format) };
            let lacks = needs & !have.optimal_tiling_features;
            for (flag, verb) in [
                (F::COLOR_ATTACHMENT, "be drawn into"),
                (
                    F::COLOR_ATTACHMENT_BLEND,
                    "be blended (COLOR_ATTACHMENT_BLEND), so samples cannot be added up",
                ),
                (F::SAMPLED_IMAGE, "be read by a shader"),
                (F::TRANSFER_SRC, "be copied from"),
                (F::TRANSFER_DST, "be copied to"),
            ] {
                if lacks.contains(flag) {
                    self.lacks(format!("Images of format {format:?} cannot {verb}."));
                }
            }
        }
    }
}

/// The first graphics and compute family that is `fit`, and the valid bits of its timestamps.
fn usable_family(families: &[vk::QueueFamilyProperties], fit: impl Fn(u32) -> bool) -> Option<(u32, u32)> {
    let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let mut usable = (0..).zip(families).filter(|(family, f)| f.queue_flags.contains(both) && fit(*family));
    usable.next().map(|(family, properties)| (family, properties.timestamp_valid_bits))
}

/// The selected device.
pub(in crate::gpu) fn pick(
    mut devices: Vec<PhysicalDevice>,
    choice: &DeviceChoice,
) -> Result<PhysicalDevice, GpuError> {
    let available = names(&devices);
    // A stable sort by suitability, then kind: the driver's order decides between equals.
    devices.sort_by_key(|device| (!device.info.is_suitable(), device.info.kind));
    let found = devices.into_iter().find(|device| match choice {
        DeviceChoice::Best => true,
        DeviceChoice::Index(index) => device.info.index == *index,
        DeviceChoice::Name(name) => device.info.name.to_lowercase().contains(&name.to_lowercase()),
    });
    let device = found.ok_or_else(|| GpuError::NoMatch {
        wanted: match choice {
            DeviceChoice::Best => "best".into(),
            DeviceChoice::Index(index) => index.to_string(),
            DeviceChoice::Name(name) => name.clone(),
        },
        available,
    })?;
    if !device.info.is_suitable() {
        return Err(GpuError::Unsuitable { device: device.info.name, missing: device.info.missing });
    }
    Ok(device)
}

/// Index and name of every device.
pub(in crate::gpu) fn names(devices: &[PhysicalDevice]) -> String {
    let names: Vec<_> = devices.iter().map(|d| format!("{} {}", d.info.index, d.info.name)).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A queue family with graphics and without compute is skipped.
    #[test]
    fn a_queue_draws_and_computes() {
        use vk::QueueFlags as Q;
        let family = |queue_flags, timestamp_valid_bits| vk::QueueFamilyProperties {
            queue_flags,
            timestamp_valid_bits,
            ..Default::default()
        };
        let families = [
            family(Q::TRANSFER, 64),
            family(Q::GRAPHICS | Q::TRANSFER, 64),
            family(Q::COMPUTE, 64),
            family(Q::GRAPHICS | Q::COMPUTE, 36),
            family(Q::GRAPHICS | Q::COMPUTE, 0),
        ];
        assert_eq!(usable_family(&families, |_| true), Some((3, 36)));
        assert_eq!(usable_family(&families, |family| family != 3), Some((4, 0)));
        assert_eq!(usable_family(&families[..3], |_| true), None);
    }
}
