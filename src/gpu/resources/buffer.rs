//! Buffers, persistently mapped for the host.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use crate::gpu::device::faults::DeviceCall;
use crate::gpu::device::gpu::Gpu;
use crate::gpu::device::retire::Retired;
use crate::gpu::error::{GpuError, Named};

/// Use of a buffer: which side writes it, and which reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    /// Vertices: written by the host, read by draws.
    Vertices,
    /// Upload: written by the host, read by copies into images.
    Upload,
    /// Readback: written by copies, read by the host.
    Readback,
    /// Tables: written by the host, read by compute shaders.
    Table,
    /// Scratch: written and read by compute shaders; not visible to the host.
    Scratch,
}

/// Memory shared by host and GPU. Dropping the buffer retires it.
///
/// Accesses must be synchronised: [`Gpu::wait`] for the last frame that used the buffer before the host accesses it.
pub struct Buffer {
    gpu: Arc<Gpu>,
    pub(in crate::gpu) raw: vk::Buffer,
    allocation: Option<Allocation>,
    bytes: usize,
}

impl Buffer {
    /// Makes a buffer of `bytes` bytes with undefined contents.
    ///
    /// # Errors
    ///
    /// [`GpuError::Memory`], [`GpuError::Unmapped`] or [`GpuError::Call`], naming the buffer.
    pub fn new(gpu: &Arc<Gpu>, name: &str, usage: BufferUse, bytes: usize) -> Result<Self, GpuError> {
        let (flags, location) = match usage {
            BufferUse::Vertices => (vk::BufferUsageFlags::VERTEX_BUFFER, MemoryLocation::CpuToGpu),
            BufferUse::Upload => (vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu),
            BufferUse::Readback => (vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu),
            BufferUse::Table => (vk::BufferUsageFlags::STORAGE_BUFFER, MemoryLocation::CpuToGpu),
            BufferUse::Scratch => (vk::BufferUsageFlags::STORAGE_BUFFER, MemoryLocation::GpuOnly),
        };
        let info = vk::BufferCreateInfo::default().size(bytes.max(1) as u64).usage(flags);
        // SAFETY: the size is not zero.
        let made = unsafe { gpu.device.create_buffer(&info, None) };
        let raw = gpu.made(made, "vkCreateBuffer", name)?;
        let mut buffer = Buffer { gpu: gpu.clone(), raw, allocation: None, bytes };
        // SAFETY: the buffer was just made.
        let needs = unsafe { gpu.device.get_buffer_memory_requirements(raw) };
        let memory = gpu.memory.allocate(name, needs, location, true)?;
        // SAFETY: the allocation fits the requirements and is used by this buffer alone.
        let bound = unsafe { gpu.device.bind_buffer_memory(raw, memory.memory(), memory.offset()) };
        buffer.allocation = Some(memory);
        bound.named(&format!("vkBindBufferMemory({name})"))?;
        let mapped = || gpu.faults().check(DeviceCall::Mapping).is_ok() && buffer.mapped().len() == bytes;
        if usage != BufferUse::Scratch && !mapped() {
            return Err(GpuError::Unmapped(name.into()));
        }
        Ok(buffer)
    }

    /// Makes a buffer that holds these bytes; not for [`BufferUse::Scratch`], which the host cannot see.
    pub fn filled(gpu: &Arc<Gpu>, name: &str, usage: BufferUse, bytes: &[u8]) -> Result<Self, GpuError> {
        let mut buffer = Self::new(gpu, name, usage, bytes.len())?;
        buffer.mapped_mut().copy_from_slice(bytes);
        Ok(buffer)
    }

    /// The contents as the host sees them; empty for [`BufferUse::Scratch`].
    pub fn mapped(&self) -> &[u8] {
        let mapped = self.allocation.as_ref().and_then(Allocation::mapped_slice);
        mapped.and_then(|all| all.get(..self.bytes)).unwrap_or_default()
    }

    /// The contents, to be written by the host; empty for [`BufferUse::Scratch`].
    pub fn mapped_mut(&mut self) -> &mut [u8] {
        let bytes = self.bytes;
        let mapped = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        mapped.and_then(|all| all.get_mut(..bytes)).unwrap_or_default()
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.gpu.retire(Retired::Buffer(self.raw, self.allocation.take()));
    }
}
