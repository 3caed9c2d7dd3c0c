//! What a device must be able to do, with one sentence for each thing that is missing.

use std::ffi::CStr;

use ash::{khr, vk};

use crate::gpu::device::instance::Instance;
use crate::gpu::resources::image::Format;
use crate::gpu::timing::clock;

/// What a physical device offers of what this program asks.
pub(in crate::gpu) struct Capability {
    /// One sentence for each requirement that is not met; empty when the device can be used.
    pub missing: Vec<String>,
    /// Points of at least 8 pixels can be drawn; otherwise sprites are instanced quads.
    pub large_points: bool,
    /// Family of a queue for graphics.
    pub queue_family: u32,
    /// Bits of a timestamp on that queue; 0: no timing.
    pub timestamp_bits: u32,
    /// The extension that reads the clock of timestamps.
    pub calibrated: Option<&'static CStr>,
}

/// Asks `device` for everything.
pub(in crate::gpu) fn check(instance: &Instance, device: vk::PhysicalDevice) -> Capability {
    let mut missing = Vec::new();
    // SAFETY: `device` was enumerated from this instance; all calls here are plain queries.
    let properties = unsafe { instance.raw.get_physical_device_properties(device) };
    let version = properties.api_version;
    let large_points = if version < vk::API_VERSION_1_3 {
        let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
        missing.push(format!(
            "Vulkan 1.3 is needed, the driver offers {major}.{minor}: update the graphics driver."
        ));
        false
    } else {
        features(instance, device, &mut missing)
    };
    extensions(instance, device, &mut missing);
    formats(instance, device, &mut missing);

    // SAFETY: as above.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(device) };
    let graphics = families.iter().position(|f| f.queue_flags.contains(vk::QueueFlags::GRAPHICS));
    if graphics.is_none() {
        missing.push("It has no queue for graphics.".into());
    }
    let family = graphics.unwrap_or(0);
    Capability {
        missing,
        large_points: large_points && properties.limits.point_size_range[1] >= 8.0,
        queue_family: family as u32,
        timestamp_bits: families.get(family).map_or(0, |f| f.timestamp_valid_bits),
        calibrated: clock::extension(instance, device),
    }
}

/// Narrows `capability` to what `shows` says of showing pictures in a window, by queue family.
pub(in crate::gpu) fn check_window(
    instance: &Instance,
    device: vk::PhysicalDevice,
    capability: &mut Capability,
    shows: impl Fn(u32) -> bool,
) {
    // SAFETY: `device` was enumerated from this instance; plain queries.
    let (families, offered) = unsafe {
        (
            instance.raw.get_physical_device_queue_family_properties(device),
            instance.raw.enumerate_device_extension_properties(device).unwrap_or_default(),
        )
    };
    if !offered.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME)) {
        capability.missing.push("It cannot draw into windows (VK_KHR_swapchain is missing).".into());
        return;
    }
    let both = (0..)
        .zip(&families)
        .find(|(family, f)| f.queue_flags.contains(vk::QueueFlags::GRAPHICS) && shows(*family));
    match both {
        Some((family, properties)) => {
            capability.queue_family = family;
            capability.timestamp_bits = properties.timestamp_valid_bits;
        }
        None => capability.missing.push("It cannot show pictures in this window.".into()),
    }
}

/// Core features of 1.2 and 1.3; returns whether `largePoints` is there.
fn features(instance: &Instance, device: vk::PhysicalDevice, missing: &mut Vec<String>) -> bool {
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
    // SAFETY: the chain holds structures of versions that this device knows.
    unsafe { instance.raw.get_physical_device_features2(device, &mut all) };
    let large_points = all.features.large_points == vk::TRUE;
    for (have, name) in [
        (v12.timeline_semaphore, "timelineSemaphore"),
        (v12.host_query_reset, "hostQueryReset"),
        (v13.dynamic_rendering, "dynamicRendering"),
        (v13.synchronization2, "synchronization2"),
        (v13.maintenance4, "maintenance4"), // SPIR-V 1.6 gives the size of workgroups by constants
    ] {
        if have == vk::FALSE {
            missing.push(format!("The feature {name} of Vulkan 1.3 is missing: update the graphics driver."));
        }
    }
    large_points
}

fn extensions(instance: &Instance, device: vk::PhysicalDevice, missing: &mut Vec<String>) {
    // SAFETY: plain query.
    let offered = unsafe { instance.raw.enumerate_device_extension_properties(device) }.unwrap_or_default();
    if !offered.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::push_descriptor::NAME)) {
        missing.push("The extension VK_KHR_push_descriptor is missing: update the graphics driver.".into());
    }
}

/// Formats and what must be possible with each.
fn formats(instance: &Instance, device: vk::PhysicalDevice, missing: &mut Vec<String>) {
    use vk::FormatFeatureFlags as F;
    let accumulate =
        F::COLOR_ATTACHMENT | F::COLOR_ATTACHMENT_BLEND | F::SAMPLED_IMAGE | F::SAMPLED_IMAGE_FILTER_LINEAR;
    let wanted = [
        (Format::Rgba32F, accumulate | F::TRANSFER_SRC | F::TRANSFER_DST),
        (Format::R32F, accumulate | F::TRANSFER_SRC | F::TRANSFER_DST),
        (Format::Rgba8, F::COLOR_ATTACHMENT | F::SAMPLED_IMAGE | F::TRANSFER_SRC | F::TRANSFER_DST),
    ];
    for (format, needs) in wanted {
        // SAFETY: plain query.
        let have = unsafe { instance.raw.get_physical_device_format_properties(device, format.raw()) };
        let lacks = needs & !have.optimal_tiling_features;
        for (flag, sentence) in [
            (F::COLOR_ATTACHMENT, "be drawn into"),
            (F::COLOR_ATTACHMENT_BLEND, "be blended (COLOR_ATTACHMENT_BLEND), so samples cannot be added up"),
            (F::SAMPLED_IMAGE, "be read by a shader"),
            (F::SAMPLED_IMAGE_FILTER_LINEAR, "be read with linear filtering"),
            (F::TRANSFER_SRC, "be copied from"),
            (F::TRANSFER_DST, "be copied to"),
        ] {
            if lacks.contains(flag) {
                missing.push(format!("Images of format {:?} cannot {sentence}.", format.raw()));
            }
        }
    }
}
