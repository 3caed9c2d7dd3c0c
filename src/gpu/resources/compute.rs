//! Compute pipelines and their dispatch.

use std::sync::Arc;

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::commands::sync::Access;
use crate::gpu::device::Gpu;
use crate::gpu::device::retire::Retired;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::buffer::Buffer;
use crate::gpu::resources::image::Image;
use crate::gpu::resources::pipeline::{entries, words};
use crate::gpu::resources::shader;

/// What a compute pipeline is made of.
#[derive(Clone, Copy, Debug)]
pub struct ComputeDesc<'a> {
    /// The shader, and its specialization constants, ids 0, 1, ….
    pub shader: (&'a str, &'a [u32]),
    /// Size of the push constants in bytes, at most 128.
    pub push_bytes: usize,
    /// What stands at the bindings 0, 1, … of set 0: true for a storage image, false for a storage buffer.
    pub images: &'a [bool],
}

/// Something that a compute shader reads or writes.
#[derive(Clone, Copy)]
pub enum Binding<'a> {
    /// All of a buffer.
    Buffer(&'a Buffer),
    /// Level 0 of an image that [`Cmd::access`] has made ready for [`Access::Storage`].
    Image(&'a Image),
}

/// A compiled compute shader with its layouts. Dropping it retires it.
pub struct ComputePipeline {
    gpu: Arc<Gpu>,
    raw: vk::Pipeline,
    layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    push_bytes: usize,
    bindings: usize,
}

impl ComputePipeline {
    /// Compiles a pipeline.
    ///
    /// # Errors
    ///
    /// [`GpuError::Shader`] for an unknown shader, [`GpuError::Call`] naming it.
    pub fn new(gpu: &Arc<Gpu>, desc: &ComputeDesc<'_>) -> Result<Self, GpuError> {
        let name = desc.shader.0;
        // A failure drops `pipeline`, which retires what has been made.
        let mut pipeline = ComputePipeline {
            gpu: gpu.clone(),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            push_bytes: desc.push_bytes,
            bindings: desc.images.len(),
        };
        pipeline.make_layouts(desc)?;
        let module = shader::module(gpu, name)?;
        let (map, data) = (entries(desc.shader.1), words(desc.shader.1));
        let constants = vk::SpecializationInfo::default().map_entries(&map).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&constants);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(pipeline.layout);
        // SAFETY: every pointer in `info` lives until the call returns; the module is not needed once it has.
        let made = unsafe {
            let made = gpu.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            gpu.device.destroy_shader_module(module, None);
            made
        };
        pipeline.raw = made
            .map(|list| list[0])
            .map_err(|(_, result)| result)
            .named(&format!("vkCreateComputePipelines({name})"))?;
        gpu.name(pipeline.raw, name);
        gpu.note_compiled(desc.shader);
        Ok(pipeline)
    }

    /// One push descriptor set, and the push constants.
    fn make_layouts(&mut self, desc: &ComputeDesc<'_>) -> Result<(), GpuError> {
        let name = desc.shader.0;
        let bindings: Vec<_> = (0..)
            .zip(desc.images)
            .map(|(binding, image)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(if *image { STORAGE_IMAGE } else { STORAGE_BUFFER })
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        // SAFETY: VK_KHR_push_descriptor is enabled; fewer than 32 bindings.
        self.set_layout = unsafe { self.gpu.device.create_descriptor_set_layout(&info, None) }
            .named(&format!("vkCreateDescriptorSetLayout({name})"))?;
        let ranges = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::COMPUTE,
            offset: 0,
            size: desc.push_bytes as u32,
        }];
        let sets = [self.set_layout];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets)
            .push_constant_ranges(if desc.push_bytes > 0 { &ranges } else { &[] });
        // SAFETY: the set layout was made above; client/layout.rs asserts at most 128 bytes.
        self.layout = unsafe { self.gpu.device.create_pipeline_layout(&info, None) }
            .named(&format!("vkCreatePipelineLayout({name})"))?;
        self.gpu.name(self.layout, name);
        Ok(())
    }
}

const STORAGE_IMAGE: vk::DescriptorType = vk::DescriptorType::STORAGE_IMAGE;
const STORAGE_BUFFER: vk::DescriptorType = vk::DescriptorType::STORAGE_BUFFER;

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        self.gpu.retire(Retired::Pipeline(self.raw, self.layout, self.set_layout));
    }
}

impl Cmd<'_> {
    /// Runs `groups` workgroups of a compute shader with these push constants and bindings 0, 1, ….
    pub fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        push: &[u8],
        bindings: &[Binding<'_>],
        groups: u32,
    ) {
        assert_eq!(push.len(), pipeline.push_bytes, "push constants are not those of the pipeline");
        assert_eq!(bindings.len(), pipeline.bindings, "bindings are not those of the pipeline");
        let infos: Vec<_> = bindings.iter().map(|binding| describe(*binding)).collect();
        let writes: Vec<_> = (0..)
            .zip(&infos)
            .map(|(binding, (buffer, image))| {
                let write = vk::WriteDescriptorSet::default().dst_binding(binding);
                match buffer {
                    Some(buffer) => {
                        write.descriptor_type(STORAGE_BUFFER).buffer_info(std::slice::from_ref(buffer))
                    }
                    None => write.descriptor_type(STORAGE_IMAGE).image_info(std::slice::from_ref(image)),
                }
            })
            .collect();
        let (compute, layout) = (vk::PipelineBindPoint::COMPUTE, pipeline.layout);
        // SAFETY: the frame is recording outside of a rendering, sizes were checked above; all objects are kept by
        // `retire` until the frame has completed.
        unsafe {
            self.gpu.device.cmd_bind_pipeline(self.raw, compute, pipeline.raw);
            if !push.is_empty() {
                let stage = vk::ShaderStageFlags::COMPUTE;
                self.gpu.device.cmd_push_constants(self.raw, layout, stage, 0, push);
            }
            self.gpu.push_descriptor.cmd_push_descriptor_set(self.raw, compute, layout, 0, &writes);
            self.gpu.device.cmd_dispatch(self.raw, groups, 1, 1);
        }
    }
}

/// Either half of the pair is used.
fn describe(binding: Binding<'_>) -> (Option<vk::DescriptorBufferInfo>, vk::DescriptorImageInfo) {
    let none = vk::DescriptorImageInfo::default();
    match binding {
        Binding::Buffer(buffer) => {
            (Some(vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)), none)
        }
        Binding::Image(image) => {
            (None, none.image_view(image.view_of(Some(0))).image_layout(Access::Storage.layout()))
        }
    }
}
