//! Size of the device-local memory, and the part that this program may use.

use ash::vk;

use crate::gpu::device::instance::VulkanInstance;
use crate::gpu::device::physical::PhysicalDevice;

/// Device-local memory; on a device that shares main memory, that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LocalMemory {
    /// Size in bytes.
    pub bytes: u64,
    /// Present budget; `None` if the driver lacks `VK_EXT_memory_budget`.
    pub budget: Option<MemoryBudget>,
}

/// Memory budget that the system grants this program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryBudget {
    /// Bytes that this program can use in total before allocations fail or become slow.
    pub granted: u64,
    /// Bytes that it uses.
    pub used: u64,
}

impl std::fmt::Display for LocalMemory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of memory", Megabytes(self.bytes))?;
        match self.budget {
            Some(MemoryBudget { granted, used }) => {
                write!(
                    f,
                    ", of which this program may use {} and uses {}",
                    Megabytes(granted),
                    Megabytes(used)
                )
            }
            None => Ok(()),
        }
    }
}

/// A number of bytes, printed in MB.
pub(in crate::gpu) struct Megabytes(pub u64);

impl std::fmt::Display for Megabytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1} MB", self.0 as f64 * 1e-6)
    }
}

/// Queries the heap sizes of a device. The instance must outlive it.
pub(in crate::gpu) struct MemorySource {
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    /// Whether the driver reports budgets.
    tells_budget: bool,
}

impl MemorySource {
    pub fn new(instance: &VulkanInstance, physical: &PhysicalDevice) -> Self {
        Self { instance: instance.raw.clone(), physical: physical.raw, tells_budget: physical.tells_budget() }
    }

    /// Queries the present state.
    pub fn read(&self) -> LocalMemory {
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut all = vk::PhysicalDeviceMemoryProperties2::default();
        if self.tells_budget {
            all = all.push_next(&mut budget);
        }
        // SAFETY: the instance lives, and the driver knows the structure that is asked to be filled.
        unsafe { self.instance.get_physical_device_memory_properties2(self.physical, &mut all) };
        let heaps = all.memory_properties;
        local_memory(heaps.memory_heaps_as_slice(), self.tells_budget.then_some(&budget))
    }
}

/// Sums over the device-local heaps.
fn local_memory(
    heaps: &[vk::MemoryHeap],
    budget: Option<&vk::PhysicalDeviceMemoryBudgetPropertiesEXT<'_>>,
) -> LocalMemory {
    let own = || (0..).zip(heaps).filter(|(_, heap)| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    let sum = |of: &[u64]| own().filter_map(|(i, _): (usize, _)| of.get(i)).sum();
    LocalMemory {
        bytes: own().map(|(_, heap)| heap.size).sum(),
        budget: budget
            .map(|budget| MemoryBudget { granted: sum(&budget.heap_budget), used: sum(&budget.heap_usage) }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Host heaps are not counted, and all numbers are reported.
    #[test]
    fn heaps_of_the_device_are_told() {
        let heap = |size, flags| vk::MemoryHeap { size, flags };
        let own = vk::MemoryHeapFlags::DEVICE_LOCAL;
        let heaps =
            [heap(7_000_000, own), heap(90_000_000, vk::MemoryHeapFlags::empty()), heap(1_000_000, own)];
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        budget.heap_budget[..3].copy_from_slice(&[6_000_000, 80_000_000, 500_000]);
        budget.heap_usage[..3].copy_from_slice(&[1_000_000, 2_000_000, 0]);
        let memory = local_memory(&heaps, Some(&budget));
        let wanted = MemoryBudget { granted: 6_500_000, used: 1_000_000 };
        assert_eq!(memory, LocalMemory { bytes: 8_000_000, budget: Some(wanted) });
        let words = memory.to_string();
        assert_eq!(words, "8.0 MB of memory, of which this program may use 6.5 MB and uses 1.0 MB");
        assert_eq!(local_memory(&heaps, None).to_string(), "8.0 MB of memory");
    }
}
