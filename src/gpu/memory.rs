//! Device memory: one allocator, shared by all resources.

use std::mem::ManuallyDrop;
use std::sync::Mutex;

use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationSizes, MemoryLocation};

use super::error::GpuError;
use super::instance::Instance;

const MIB: u64 = 1 << 20;

/// The allocator behind a lock. Not dropped by itself: [`Memory::destroy`] must come before the device is destroyed.
pub(in crate::gpu) struct Memory {
    allocator: ManuallyDrop<Mutex<Allocator>>,
}

impl Memory {
    pub fn new(
        instance: &Instance,
        device: &ash::Device,
        physical: vk::PhysicalDevice,
    ) -> Result<Self, GpuError> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            // Films of 512² need some 30 MiB a stream: the library's blocks of 256 MiB would waste memory on CPU devices.
            allocation_sizes: AllocationSizes::new(32 * MIB, 8 * MIB)
                .with_max_device_memblock_size(256 * MIB),
        })
        .map_err(|source| GpuError::Memory { name: "the allocator".into(), source })?;
        Ok(Self { allocator: ManuallyDrop::new(Mutex::new(allocator)) })
    }

    /// Memory for a resource of these requirements. `linear` is true for buffers.
    pub fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, GpuError> {
        let desc = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let mut allocator = self.allocator.lock().unwrap_or_else(|e| e.into_inner());
        allocator.allocate(&desc).map_err(|source| GpuError::Memory { name: name.into(), source })
    }

    /// Gives memory back; the resource that used it must be destroyed already.
    pub fn free(&self, allocation: Allocation) {
        let mut allocator = self.allocator.lock().unwrap_or_else(|e| e.into_inner());
        if let Err(error) = allocator.free(allocation) {
            tracing::error!("GPU memory could not be freed: {error}");
        }
    }

    /// Frees all blocks.
    ///
    /// # Safety
    ///
    /// Called once, while the device still lives, and nothing is allocated or freed afterwards.
    pub unsafe fn destroy(&mut self) {
        // SAFETY: the caller promises that this is the last use.
        unsafe { ManuallyDrop::drop(&mut self.allocator) };
    }
}
