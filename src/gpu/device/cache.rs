//! The driver's pipeline cache, as bytes that a later run can load.
//!
//! This module does no file access: the owner of the device decides where the bytes are stored.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};

use ash::vk;

use crate::gpu::device::faults::{CallFaults, DeviceCall};
use crate::gpu::device::gpu::Gpu;
use crate::gpu::device::physical::PipelineOrigin;
use crate::gpu::error::{GpuError, Named};

/// The driver's cache of compiled pipelines.
#[derive(Default)]
pub(in crate::gpu) struct PipelineCache {
    /// Compiling takes a read lock: Vulkan synchronises that internally, but not the merging of caches.
    raw: RwLock<vk::PipelineCache>,
    origin: PipelineOrigin,
    /// Number of pipelines being compiled on other threads.
    under_way: AtomicUsize,
    faults: CallFaults,
    /// State of the cache data loaded or taken last.
    known: Mutex<KnownPipelines>,
}

/// Identification of cache data that the owner of the device has.
#[derive(Default)]
struct KnownPipelines {
    /// Number of pipelines compiled at that time.
    compiled: usize,
    /// Hash of the data.
    hash: Option<u64>,
}

/// Guard that counts a pipeline as being compiled on another thread.
pub struct CompilingPipeline(Arc<Gpu>);

impl Drop for CompilingPipeline {
    fn drop(&mut self) {
        self.0.pipelines.under_way.fetch_sub(1, Ordering::Release);
    }
}

impl PipelineCache {
    /// A cache without a handle.
    pub fn new(origin: PipelineOrigin, faults: &CallFaults) -> Self {
        Self { origin, faults: faults.clone(), ..Self::default() }
    }

    /// Creates the handle.
    pub fn fill(&mut self, device: &ash::Device) -> Result<vk::PipelineCache, GpuError> {
        let made = make(device, &[])?;
        *self.raw.get_mut().unwrap_or_else(PoisonError::into_inner) = made;
        Ok(made)
    }

    /// Locks the handle for compiling one pipeline; an error if a test has planned one.
    pub fn to_compile(&self) -> Result<RwLockReadGuard<'_, vk::PipelineCache>, vk::Result> {
        self.faults.check(DeviceCall::Pipeline).map(|()| self.lock())
    }

    fn lock(&self) -> RwLockReadGuard<'_, vk::PipelineCache> {
        self.raw.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// # Safety
    ///
    /// Nothing is compiled any more.
    pub unsafe fn destroy(&mut self, device: &ash::Device) {
        let raw = *self.raw.get_mut().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the caller promises that this is the last use; pipelines do not need it.
        unsafe { device.destroy_pipeline_cache(raw, None) };
    }
}

impl Gpu {
    /// Identifies this device and its driver, for a file name: compiled pipelines are valid for no other.
    pub fn pipeline_origin(&self) -> String {
        let PipelineOrigin { vendor, device, driver, uuid } = self.pipelines.origin;
        let uuid: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        format!("{vendor:04x}-{device:04x}-{driver:08x}-{uuid}")
    }

    /// Adds pipelines of an earlier run, as returned by [`take_pipelines`](Self::take_pipelines) on the same device and driver; these are
    /// not compiled again.
    ///
    /// # Errors
    ///
    /// [`GpuError::ForeignPipelines`] for any other data, and [`GpuError::Call`]; the cache stays unchanged then.
    pub fn load_pipelines(&self, data: &[u8]) -> Result<(), GpuError> {
        self.pipelines.origin.check(data).map_err(GpuError::ForeignPipelines)?;
        let loaded = make(&self.device, data)?;
        let raw = self.pipelines.raw.write().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the lock keeps others from using the destination, and the source is used here alone.
        let merged = unsafe {
            let merged = self.device.merge_pipeline_caches(*raw, &[loaded]);
            self.device.destroy_pipeline_cache(loaded, None);
            merged
        };
        merged.named("vkMergePipelineCaches")?;
        self.known_pipelines(|known| known.hash = Some(hash(data)));
        Ok(())
    }

    /// Compiled and loaded pipelines, as bytes for [`load_pipelines`](Self::load_pipelines); `None` if none were added since the last call.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`].
    pub fn take_pipelines(&self) -> Result<Option<Vec<u8>>, GpuError> {
        let compiled = self.compiled_pipelines();
        if self.known_pipelines(|known| known.compiled == compiled) {
            return Ok(None);
        }
        let raw = self.pipelines.lock();
        // SAFETY: the cache lives as long as `self`.
        let data = unsafe { self.device.get_pipeline_cache_data(*raw) }.named("vkGetPipelineCacheData")?;
        let hash = Some(hash(&data));
        let is_new = self.known_pipelines(|known| {
            known.compiled = compiled;
            std::mem::replace(&mut known.hash, hash) != hash
        });
        Ok(Some(data).filter(|_| is_new))
    }

    /// Whether a pipeline is being compiled on another thread.
    pub fn is_compiling(&self) -> bool {
        self.pipelines.under_way.load(Ordering::Acquire) > 0
    }

    /// Counts a pipeline as being compiled on another thread until the guard is dropped.
    pub fn count_compiling(self: &Arc<Self>) -> CompilingPipeline {
        self.pipelines.under_way.fetch_add(1, Ordering::Relaxed);
        CompilingPipeline(self.clone())
    }

    fn known_pipelines<T>(&self, change: impl FnOnce(&mut KnownPipelines) -> T) -> T {
        change(&mut self.pipelines.known.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Creates a cache from validated data of this device.
fn make(device: &ash::Device, data: &[u8]) -> Result<vk::PipelineCache, GpuError> {
    let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
    // SAFETY: the data outlive the call and, where there are any, have the header of this device.
    unsafe { device.create_pipeline_cache(&info, None) }.named("vkCreatePipelineCache")
}

/// A hash for comparisons within this run.
fn hash(data: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    data.hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Only data with a complete header of the same device and driver are passed to the driver.
    #[test]
    fn foreign_data_are_refused() {
        let origin = PipelineOrigin { vendor: 0x10de, device: 0x2330, driver: 7, uuid: [9; 16] };
        let words = [32_u32, 1, 0x10de, 0x2330];
        let mut data: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        data.extend([9; 16]);
        data.extend(b"code");
        assert_eq!(origin.check(&data), Ok(()));
        for length in 0..32 {
            assert!(origin.check(&data[..length]).is_err(), "{length} bytes");
        }
        // No byte of length, version, vendor, device and UUID may differ; a longer header is allowed.
        for at in 0..32 {
            let mut other = data.clone();
            other[at] ^= 0x40;
            assert!(origin.check(&other).is_err(), "byte {at}");
        }
    }
}
