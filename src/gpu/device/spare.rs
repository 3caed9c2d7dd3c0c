//! Pipelines that nobody holds at present, for the next one who wants the same: a film of another size compiles nothing.

use ash::vk;

use crate::gpu::resources::image::Format;
use crate::gpu::resources::pipeline::{Blend, GraphicsDesc, Topology};

/// Everything that a [`GraphicsDesc`] says but its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::gpu) struct Key {
    shaders: [(String, Vec<u32>); 2],
    push_bytes: usize,
    textures: u32,
    targets: Vec<(Format, Blend)>,
    topology: Topology,
    stride: u32,
    attributes: Vec<(u32, u32)>,
}

impl Key {
    pub fn of(desc: &GraphicsDesc<'_>) -> Self {
        Self {
            shaders: [desc.vert, desc.frag].map(|(name, constants)| (name.to_owned(), constants.to_vec())),
            push_bytes: desc.push_bytes,
            textures: desc.textures,
            targets: desc.targets.to_vec(),
            topology: desc.topology,
            stride: desc.vertex.stride,
            attributes: desc.vertex.attributes.to_vec(),
        }
    }
}

/// A pipeline's handles.
#[derive(Clone, Copy)]
pub(in crate::gpu) struct Handles {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
}

/// Spare pipelines; as many of a kind as were ever in use at once.
#[derive(Default)]
pub(in crate::gpu) struct Spares(Vec<(Key, Handles)>);

impl Spares {
    /// One of this kind, if there is one.
    pub fn take(&mut self, key: &Key) -> Option<Handles> {
        let at = self.0.iter().position(|(spare, _)| spare == key)?;
        Some(self.0.swap_remove(at).1)
    }

    /// Keeps one. It may still be in use on the device: pipelines do not change.
    pub fn put(&mut self, key: Key, handles: Handles) {
        self.0.push((key, handles));
    }

    /// Destroys all.
    ///
    /// # Safety
    ///
    /// The device is idle.
    pub unsafe fn destroy(&mut self, device: &ash::Device) {
        for (_, Handles { pipeline, layout, set_layout }) in self.0.drain(..) {
            // SAFETY: the caller promises that nothing is pending.
            unsafe {
                device.destroy_pipeline(pipeline, None);
                device.destroy_pipeline_layout(layout, None);
                device.destroy_descriptor_set_layout(set_layout, None);
            }
        }
    }
}
