//! Device memory: one allocator, shared by all resources.

use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationError, AllocationSizes, MemoryLocation};

use crate::gpu::device::faults::{CallFaults, DeviceCall};
use crate::gpu::device::heaps::{Megabytes, MemorySource};
use crate::gpu::device::instance::VulkanInstance;
use crate::gpu::device::physical::PhysicalDevice;
use crate::gpu::error::GpuError;

const MIB: u64 = 1 << 20;

/// The allocator behind a lock. Not dropped automatically: [`Memory::destroy`] must be called before the device is destroyed.
pub(in crate::gpu) struct Memory {
    allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    faults: CallFaults,
    /// Bytes in use, and their limit.
    used: AtomicU64,
    limit: AtomicU64,
    source: MemorySource,
}

impl Memory {
    pub fn new(
        instance: &VulkanInstance,
        device: &ash::Device,
        physical: &PhysicalDevice,
        faults: &CallFaults,
    ) -> Result<Self, GpuError> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: physical.raw,
            debug_settings: Default::default(),
            buffer_device_address: false,
            // Films of 512² need about 30 MiB per stream: the library's default blocks of 256 MiB would waste memory on CPU devices.
            allocation_sizes: AllocationSizes::new(32 * MIB, 8 * MIB)
                .with_max_device_memblock_size(256 * MIB),
        })
        .map_err(|source| GpuError::Memory {
            name: "the allocator".into(),
            source,
            numbers: String::new(),
        })?;
        Ok(Self {
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            faults: faults.clone(),
            used: AtomicU64::new(0),
            limit: AtomicU64::new(u64::MAX),
            source: MemorySource::new(instance, physical),
        })
    }

    /// Allocates memory for a resource. `linear` is true for buffers.
    pub fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, GpuError> {
        let in_use = self.used.load(Ordering::Relaxed).saturating_add(requirements.size);
        let is_refused = self.faults.check(DeviceCall::Allocation).is_err();
        if in_use > self.limit.load(Ordering::Relaxed) || is_refused {
            return Err(self.refused(name, requirements.size, AllocationError::OutOfMemory));
        }
        let desc = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocation = self.allocator.lock().unwrap_or_else(|e| e.into_inner()).allocate(&desc);
        let allocation = allocation.map_err(|source| self.refused(name, requirements.size, source))?;
        self.used.fetch_add(allocation.size(), Ordering::Relaxed);
        Ok(allocation)
    }

    /// Checks whether `bytes` can be allocated once `freed` are released: within the limit, and within the system's budget if reported.
    pub fn check_room(&self, name: &str, bytes: u64, freed: u64) -> Result<(), GpuError> {
        let after = self.used.load(Ordering::Relaxed).saturating_sub(freed).saturating_add(bytes);
        let granted = self.source.read().budget.map_or(u64::MAX, |budget| budget.granted);
        match after > self.limit.load(Ordering::Relaxed).min(granted) {
            true => Err(self.refused(name, bytes, AllocationError::OutOfMemory)),
            false => Ok(()),
        }
    }

    /// The error of an allocation of this size, with the numbers that explain why it does not fit.
    fn refused(&self, name: &str, bytes: u64, source: AllocationError) -> GpuError {
        let used = Megabytes(self.used.load(Ordering::Relaxed));
        let limit = match self.limit.load(Ordering::Relaxed) {
            u64::MAX => String::new(),
            limit => format!(" and may use {}", Megabytes(limit)),
        };
        let numbers = format!(
            " (it needs {}; images and buffers use {used}{limit}; the device has {}): render a smaller picture, or close \
             other programs that use the device",
            Megabytes(bytes),
            self.source.read()
        );
        GpuError::Memory { name: name.into(), source, numbers }
    }

    /// The allocator, shared with renderers of other crates, which must be dropped before [`destroy`](Self::destroy).
    pub fn shared(&self) -> Arc<Mutex<Allocator>> {
        Arc::clone(&self.allocator)
    }

    /// Limits the total size of allocations.
    #[cfg(feature = "faults")]
    pub fn limit(&self, bytes: u64) {
        self.limit.store(bytes, Ordering::Relaxed);
    }

    /// Frees memory; the resource that used it must have been destroyed.
    pub fn free(&self, allocation: Allocation) {
        let mut allocator = self.allocator.lock().unwrap_or_else(|e| e.into_inner());
        self.used.fetch_sub(allocation.size(), Ordering::Relaxed);
        if let Err(error) = allocator.free(allocation) {
            tracing::error!("GPU memory could not be freed: {error}");
        }
    }

    /// Frees all blocks.
    ///
    /// # Safety
    ///
    /// Called once, while the device still lives, and nothing is allocated or freed afterwards, also by those who share
    /// it.
    pub unsafe fn destroy(&mut self) {
        // SAFETY: the caller promises that this is the last use.
        unsafe { ManuallyDrop::drop(&mut self.allocator) };
    }
}
