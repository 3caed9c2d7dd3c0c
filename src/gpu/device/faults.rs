//! Fault injection: results of driver calls and losses of devices that tests plan, to test error handling without a faulty driver.
//!
//! Only programs with the feature `faults` can plan any, such as those that `cargo test` compiles.

#[cfg(feature = "faults")]
mod plan;

use ash::vk;

#[cfg(feature = "faults")]
pub use plan::CallFault;

/// A call with injectable results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceCall {
    /// `vkCreateSurfaceKHR` of the window system.
    Surface,
    /// `vkCreateSwapchainKHR`.
    Swapchain,
    /// `vkAcquireNextImageKHR`.
    Acquire,
    /// `vkQueuePresentKHR`.
    Present,
    /// Memory allocation for an image or a buffer; any result means that memory is exhausted.
    Allocation,
    /// Mapping of a buffer's memory; any result means that it fails.
    Mapping,
    /// `vkCreateGraphicsPipelines` and `vkCreateComputePipelines`.
    Pipeline,
}

/// Planned results of calls, and counts of calls. Clones share the state, which may outlive devices and surfaces.
#[derive(Clone, Debug, Default)]
pub struct CallFaults(#[cfg(feature = "faults")] plan::SharedCalls);

impl CallFaults {
    /// Counts a call; returns its planned result, if any.
    pub(in crate::gpu) fn next(&self, call: DeviceCall) -> Option<vk::Result> {
        #[cfg(feature = "faults")]
        return self.next_planned(call);
        #[cfg(not(feature = "faults"))]
        {
            let _ = call;
            None
        }
    }

    /// As [`next`](Self::next), as a `Result` for calls that create an object.
    pub(in crate::gpu) fn check(&self, call: DeviceCall) -> Result<(), vk::Result> {
        self.next(call).map_or(Ok(()), Err)
    }
}

/// Planned faults of the devices of a window.
#[derive(Clone, Debug, Default)]
pub struct DeviceFaults {
    /// Results of Vulkan calls.
    pub calls: CallFaults,
    /// Number of frames after which each device is lost, in order of opening; later devices are not.
    #[cfg(feature = "faults")]
    pub losses: Vec<u64>,
    /// Limit of device memory in bytes.
    #[cfg(feature = "faults")]
    pub memory: Option<u64>,
}
