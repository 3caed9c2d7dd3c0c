//! Which devices there are and which one is taken.

use ash::vk;

use crate::gpu::device::capability;
use crate::gpu::device::instance::Instance;
use crate::gpu::error::{GpuError, Named};

/// How the user names a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The best that can be used: discrete before integrated, virtual and CPU.
    #[default]
    Best,
    /// By its place in the list that [`devices`] returns.
    Index(usize),
    /// By a part of its name, in any case of letters.
    Name(String),
}

impl DeviceChoice {
    /// Reads a command line's word: empty is [`Best`](Self::Best), a number an index, anything else a name.
    pub fn parse(text: &str) -> Self {
        match (text.is_empty(), text.parse()) {
            (true, _) => DeviceChoice::Best,
            (_, Ok(index)) => DeviceChoice::Index(index),
            _ => DeviceChoice::Name(text.to_owned()),
        }
    }
}

/// What sort of hardware a device is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Graphics that shares the processor's memory.
    Integrated,
    /// A card lent to a virtual machine.
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

/// One device as the user sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Place in the list, for `--device`.
    pub index: usize,
    /// Name as the driver gives it.
    pub name: String,
    /// Sort of hardware.
    pub kind: DeviceKind,
    /// Driver's name and version, such as `llvmpipe Mesa 22.3.6 (LLVM 15.0.6)`.
    pub driver: String,
    /// Vulkan version, `major.minor.patch`.
    pub api: String,
    /// One sentence for each thing that is missing; empty when the device can be used.
    pub missing: Vec<String>,
}

impl DeviceInfo {
    /// True when the device has everything that is needed.
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
    Ok(enumerate(&Instance::new(false, None)?)?.into_iter().map(|(_, info)| info).collect())
}

/// All devices with their handles.
pub(in crate::gpu) fn enumerate(
    instance: &Instance,
) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>, GpuError> {
    // SAFETY: plain query of a live instance.
    let handles = unsafe { instance.raw.enumerate_physical_devices() }.named("vkEnumeratePhysicalDevices")?;
    if handles.is_empty() {
        return Err(GpuError::NoDevice);
    }
    Ok(handles.into_iter().enumerate().map(|(index, h)| (h, describe(instance, h, index))).collect())
}

fn describe(instance: &Instance, device: vk::PhysicalDevice, index: usize) -> DeviceInfo {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the handle comes from this instance; drivers ignore structures that they do not know.
    unsafe { instance.raw.get_physical_device_properties2(device, &mut all) };
    let p = all.properties;
    let text =
        |s: Result<&std::ffi::CStr, _>| s.map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let (v, info) = (p.api_version, text(driver.driver_info_as_c_str()));
    DeviceInfo {
        index,
        name: text(p.device_name_as_c_str()),
        kind: match p.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        },
        driver: format!("{} {info}", text(driver.driver_name_as_c_str())).trim().to_owned(),
        api: format!(
            "{}.{}.{}",
            vk::api_version_major(v),
            vk::api_version_minor(v),
            vk::api_version_patch(v)
        ),
        missing: capability::check(instance, device).missing,
    }
}

/// The device of this choice.
pub(in crate::gpu) fn pick(
    list: Vec<(vk::PhysicalDevice, DeviceInfo)>,
    choice: &DeviceChoice,
) -> Result<(vk::PhysicalDevice, DeviceInfo), GpuError> {
    let available: Vec<String> = list.iter().map(|(_, d)| format!("{} {}", d.index, d.name)).collect();
    // A stable sort by suitability, then kind: the driver's order decides between equals.
    let mut ranked = list;
    ranked.sort_by_key(|(_, d)| (!d.is_suitable(), d.kind));
    let found = ranked.into_iter().find(|(_, d)| match choice {
        DeviceChoice::Best => true,
        DeviceChoice::Index(index) => d.index == *index,
        DeviceChoice::Name(name) => d.name.to_lowercase().contains(&name.to_lowercase()),
    });
    let (handle, info) = found.ok_or_else(|| GpuError::NoMatch {
        wanted: match choice {
            DeviceChoice::Best => "best".into(),
            DeviceChoice::Index(index) => index.to_string(),
            DeviceChoice::Name(name) => name.clone(),
        },
        available: available.join(", "),
    })?;
    if !info.is_suitable() {
        return Err(GpuError::Unsuitable { device: info.name, missing: info.missing });
    }
    Ok((handle, info))
}
