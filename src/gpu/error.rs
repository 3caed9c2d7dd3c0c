//! Errors of Vulkan, in sentences that say what to do.

use ash::vk;

/// An error of a Vulkan operation.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// There is no Vulkan loader on this machine.
    #[error(
        "no Vulkan loader was found ({0}): install it (Debian: libvulkan1 and mesa-vulkan-drivers), \
         or render with --device cpu"
    )]
    NoLoader(String),
    /// The loader is there, but no driver.
    #[error(
        "Vulkan is installed but no driver offers a device: install one (Debian: mesa-vulkan-drivers), \
         or render with --device cpu"
    )]
    NoDevice,
    /// Validation was requested, but its layer is not installed.
    #[error(
        "validation was asked for, but the layer VK_LAYER_KHRONOS_validation is not installed: install it \
         (Debian: vulkan-validationlayers), or unset POINTILLIST_VALIDATION"
    )]
    NoValidationLayer,
    /// No device matches the choice.
    #[error("no Vulkan device matches \"{wanted}\"; there are: {available}")]
    NoMatch {
        /// The requested device.
        wanted: String,
        /// Index and name of every device.
        available: String,
    },
    /// The device lacks something this program needs.
    #[error("{device} cannot be used: {}", missing.join(" "))]
    Unsuitable {
        /// Name of the device.
        device: String,
        /// One sentence per missing requirement.
        missing: Vec<String>,
    },
    /// Vulkan cannot draw into windows here.
    #[error("Vulkan cannot draw into this window: {0}")]
    NoWindow(String),
    /// The panel's triangles refer to missing textures.
    #[error("the panel cannot be drawn: {0}")]
    Panel(String),
    /// A Vulkan call failed.
    #[error("{call} failed: {result}{}", hint(*result))]
    Call {
        /// The Vulkan function and, if helpful, the object.
        call: String,
        /// Its result.
        result: vk::Result,
    },
    /// Memory could not be allocated.
    #[error("no GPU memory for {name}: {source}{numbers}")]
    Memory {
        /// Debug name of the resource.
        name: String,
        /// The error of the allocator.
        source: gpu_allocator::AllocationError,
        /// Requested and available sizes in words, with a leading space; may be empty.
        numbers: String,
    },
    /// The memory of a buffer is not visible to the host.
    #[error("the memory of {0} could not be mapped: render a smaller picture, or with --device cpu")]
    Unmapped(String),
    /// An image is larger than the device allows.
    #[error(
        "{name} of {width}×{height} texels is larger than this device's limit of {limit}: render a smaller picture"
    )]
    TooLarge {
        /// Debug name of the image.
        name: String,
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
        /// Largest extent of a 2-D image, texels.
        limit: u32,
    },
    /// A pipeline is still being compiled on another thread.
    #[error("the pipeline {0} is still being compiled: try again")]
    Compiling(&'static str),
    /// The bytes are not compiled pipelines of this device.
    #[error("compiled pipelines cannot be loaded: {0}")]
    ForeignPipelines(&'static str),
    /// Embedded shader code is missing or damaged: the build is broken.
    #[error("shader {0} is not embedded in this program or is damaged: build it anew")]
    Shader(String),
}

impl GpuError {
    /// Whether the operation can be retried once a pipeline has been compiled.
    pub fn is_compiling(&self) -> bool {
        matches!(self, GpuError::Compiling(_))
    }

    /// Whether the device is lost and a new one may help.
    pub fn is_device_lost(&self) -> bool {
        matches!(self, GpuError::Call { result: vk::Result::ERROR_DEVICE_LOST, .. })
    }
}

/// Advice to the user about a result.
fn hint(result: vk::Result) -> &'static str {
    match result {
        vk::Result::ERROR_DEVICE_LOST => {
            " (the device was lost: restart the program; the system log may tell why)"
        }
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            " (out of memory: render a smaller picture)"
        }
        vk::Result::ERROR_INITIALIZATION_FAILED => {
            " (is the driver installed properly? `vulkaninfo` may tell)"
        }
        _ => "",
    }
}

/// Names the call that a `VkResult` comes from.
pub(in crate::gpu) trait Named<T> {
    /// Turns the result into a [`GpuError::Call`] of this name.
    fn named(self, call: &str) -> Result<T, GpuError>;
}

impl<T> Named<T> for Result<T, vk::Result> {
    fn named(self, call: &str) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::Call { call: call.to_owned(), result })
    }
}
