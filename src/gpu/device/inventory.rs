//! What lives on a device, by name.

use crate::gpu::device::Gpu;

/// Everything that was made on a device and still is there.
#[derive(Clone, Debug, Default)]
pub struct Inventory {
    /// Images and buffers, with the bytes of device memory that each holds; sorted by name.
    pub memory: Vec<(String, u64)>,
    /// Pipelines that were compiled, with what each is specialised for, in that order.
    pub pipelines: Vec<String>,
}

impl Gpu {
    /// What is there now; what was dropped in the last frames may still be in it.
    pub fn inventory(&self) -> Inventory {
        let allocator = self.memory.shared();
        let report = allocator.lock().unwrap_or_else(|e| e.into_inner()).generate_report();
        let mut memory: Vec<(String, u64)> =
            report.allocations.into_iter().map(|a| (a.name, a.size)).collect();
        memory.sort();
        let pipelines = self.compiled.lock().unwrap_or_else(|e| e.into_inner()).clone();
        Inventory { memory, pipelines }
    }

    /// Notes that a pipeline of these shaders, with their constants, was compiled.
    pub(in crate::gpu) fn note_compiled(&self, (name, constants): (&str, &[u32])) {
        let text = constants.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
        self.compiled.lock().unwrap_or_else(|e| e.into_inner()).push(format!("{name} [{text}]"));
    }
}
