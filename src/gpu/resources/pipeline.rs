//! Graphics pipelines for dynamic rendering, specialised by constants.

use std::sync::Arc;

use ash::vk;

use crate::gpu::device::Gpu;
use crate::gpu::device::retire::Retired;
use crate::gpu::device::spare::{Handles, Key};
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::image::Format;
use crate::gpu::resources::shader;

/// What happens to the texel that is already there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// It is replaced.
    Replace,
    /// The new value is added.
    Add,
    /// The new value, premultiplied by its alpha, covers the old one.
    Over,
}

/// What vertices become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topology {
    /// One triangle without vertex data that covers the target.
    Fullscreen,
    /// One point for each vertex.
    Points,
    /// One quad for each vertex, as an instance.
    Quads,
}

/// Float attributes of one vertex, at locations 0, 1, ….
#[derive(Clone, Copy, Debug, Default)]
pub struct VertexLayout<'a> {
    /// Bytes from one vertex to the next.
    pub stride: u32,
    /// Number of floats (1 … 4) and offset in bytes of each attribute.
    pub attributes: &'a [(u32, u32)],
}

/// What a pipeline is made of.
#[derive(Clone, Copy, Debug)]
pub struct GraphicsDesc<'a> {
    /// Name for debuggers and messages.
    pub name: &'a str,
    /// Vertex shader and its specialization constants, ids 0, 1, ….
    pub vert: (&'a str, &'a [u32]),
    /// Fragment shader and its specialization constants.
    pub frag: (&'a str, &'a [u32]),
    /// Size of the push constants in bytes, at most 128.
    pub push_bytes: usize,
    /// Number of textures, at set 0, bindings 0, 1, ….
    pub textures: u32,
    /// Format and blending of each target.
    pub targets: &'a [(Format, Blend)],
    /// What is drawn.
    pub topology: Topology,
    /// What a vertex holds; not used by [`Topology::Fullscreen`].
    pub vertex: VertexLayout<'a>,
}

/// A compiled pipeline with its layouts. Dropping it leaves it to the next one of the same kind.
pub struct Pipeline {
    gpu: Arc<Gpu>,
    key: Key,
    pub(in crate::gpu) raw: vk::Pipeline,
    pub(in crate::gpu) layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    pub(in crate::gpu) textures: u32,
    pub(in crate::gpu) push_bytes: usize,
}

/// Stages that see push constants.
pub(in crate::gpu) const PUSH_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

impl Pipeline {
    /// A pipeline of this kind: one that nobody uses any more, else a new one.
    ///
    /// # Errors
    ///
    /// [`GpuError::Shader`] for an unknown shader, [`GpuError::Call`] naming the pipeline.
    pub fn new(gpu: &Arc<Gpu>, desc: &GraphicsDesc<'_>) -> Result<Self, GpuError> {
        let key = Key::of(desc);
        let spare = gpu.spares.lock().unwrap_or_else(|e| e.into_inner()).take(&key);
        if let Some(Handles { pipeline, layout, set_layout }) = spare {
            let (gpu, textures, push_bytes) = (gpu.clone(), desc.textures, desc.push_bytes);
            return Ok(Self { gpu, key, raw: pipeline, layout, set_layout, textures, push_bytes });
        }
        Self::compile(gpu, desc, key)
    }

    fn compile(gpu: &Arc<Gpu>, desc: &GraphicsDesc<'_>, key: Key) -> Result<Self, GpuError> {
        let (set_layout, layout) = layouts(gpu, desc)?;
        // From here on a failure drops `pipeline`, which retires the layouts.
        let mut pipeline = Pipeline {
            gpu: gpu.clone(),
            key,
            raw: vk::Pipeline::null(),
            layout,
            set_layout,
            textures: desc.textures,
            push_bytes: desc.push_bytes,
        };
        gpu.name(set_layout, desc.name);
        gpu.name(layout, desc.name);
        let vert = shader::module(gpu, desc.vert.0)?;
        let made = shader::module(gpu, desc.frag.0).and_then(|frag| {
            let made = compile(gpu, desc, layout, [vert, frag]);
            // SAFETY: modules are not needed once the pipeline is made.
            unsafe { gpu.device.destroy_shader_module(frag, None) };
            made
        });
        // SAFETY: as above.
        unsafe { gpu.device.destroy_shader_module(vert, None) };
        pipeline.raw = made?;
        gpu.name(pipeline.raw, desc.name);
        gpu.note_compiled(desc.frag);
        Ok(pipeline)
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let handles = Handles { pipeline: self.raw, layout: self.layout, set_layout: self.set_layout };
        if self.raw == vk::Pipeline::null() {
            // It could not be compiled.
            self.gpu.retire(Retired::Pipeline(self.raw, self.layout, self.set_layout));
            return;
        }
        self.gpu.spares.lock().unwrap_or_else(|e| e.into_inner()).put(self.key.clone(), handles);
    }
}

/// One push descriptor set of textures, and the push constants.
fn layouts(
    gpu: &Gpu,
    desc: &GraphicsDesc<'_>,
) -> Result<(vk::DescriptorSetLayout, vk::PipelineLayout), GpuError> {
    let bindings: Vec<_> = (0..desc.textures)
        .map(|binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        })
        .collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
        .bindings(&bindings);
    // SAFETY: VK_KHR_push_descriptor is enabled; fewer than 32 bindings.
    let set_layout = unsafe { gpu.device.create_descriptor_set_layout(&info, None) }
        .named(&format!("vkCreateDescriptorSetLayout({})", desc.name))?;
    let ranges =
        [vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: desc.push_bytes as u32 }];
    let sets = [set_layout];
    let info = vk::PipelineLayoutCreateInfo::default()
        .set_layouts(&sets)
        .push_constant_ranges(if desc.push_bytes > 0 { &ranges } else { &[] });
    // SAFETY: the set layout was made above; client/layout.rs asserts at most 128 bytes.
    let layout = unsafe { gpu.device.create_pipeline_layout(&info, None) };
    match layout.named(&format!("vkCreatePipelineLayout({})", desc.name)) {
        Ok(layout) => Ok((set_layout, layout)),
        Err(error) => {
            // SAFETY: nothing uses it.
            unsafe { gpu.device.destroy_descriptor_set_layout(set_layout, None) };
            Err(error)
        }
    }
}

fn compile(
    gpu: &Gpu,
    desc: &GraphicsDesc<'_>,
    layout: vk::PipelineLayout,
    [vert, frag]: [vk::ShaderModule; 2],
) -> Result<vk::Pipeline, GpuError> {
    let (vert_map, frag_map) = (entries(desc.vert.1), entries(desc.frag.1));
    let (vert_data, frag_data) = (words(desc.vert.1), words(desc.frag.1));
    let vert_spec = vk::SpecializationInfo::default().map_entries(&vert_map).data(&vert_data);
    let frag_spec = vk::SpecializationInfo::default().map_entries(&frag_map).data(&frag_data);
    let stage =
        |flag, module| vk::PipelineShaderStageCreateInfo::default().stage(flag).module(module).name(c"main");
    let stages = [
        stage(vk::ShaderStageFlags::VERTEX, vert).specialization_info(&vert_spec),
        stage(vk::ShaderStageFlags::FRAGMENT, frag).specialization_info(&frag_spec),
    ];
    let (binding, attributes) = vertex_input(desc);
    let bindings = [binding];
    let input = match desc.topology {
        Topology::Fullscreen => vk::PipelineVertexInputStateCreateInfo::default(),
        _ => vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes),
    };
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(match desc.topology {
        Topology::Fullscreen => vk::PrimitiveTopology::TRIANGLE_LIST,
        Topology::Points => vk::PrimitiveTopology::POINT_LIST,
        Topology::Quads => vk::PrimitiveTopology::TRIANGLE_STRIP,
    });
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let blends: Vec<_> = desc.targets.iter().map(|(_, blend)| attachment(*blend)).collect();
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let formats: Vec<_> = desc.targets.iter().map(|(format, _)| format.raw()).collect();
    let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: every pointer in `info` lives until the call returns; dynamicRendering is enabled.
    let made = unsafe { gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
    made.map(|list| list[0])
        .map_err(|(_, result)| result)
        .named(&format!("vkCreateGraphicsPipelines({})", desc.name))
}

/// Binding 0 and its attributes; quads take one vertex for each instance.
fn vertex_input(
    desc: &GraphicsDesc<'_>,
) -> (vk::VertexInputBindingDescription, Vec<vk::VertexInputAttributeDescription>) {
    const FORMATS: [vk::Format; 4] = [
        vk::Format::R32_SFLOAT,
        vk::Format::R32G32_SFLOAT,
        vk::Format::R32G32B32_SFLOAT,
        vk::Format::R32G32B32A32_SFLOAT,
    ];
    let input_rate = match desc.topology {
        Topology::Quads => vk::VertexInputRate::INSTANCE,
        _ => vk::VertexInputRate::VERTEX,
    };
    let binding = vk::VertexInputBindingDescription { binding: 0, stride: desc.vertex.stride, input_rate };
    let attributes = (0..).zip(desc.vertex.attributes).map(|(location, (floats, offset))| {
        let format = FORMATS[(*floats as usize).clamp(1, 4) - 1];
        vk::VertexInputAttributeDescription { location, binding: 0, format, offset: *offset }
    });
    (binding, attributes.collect())
}

fn attachment(blend: Blend) -> vk::PipelineColorBlendAttachmentState {
    let kept = match blend {
        Blend::Over => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
        Blend::Add | Blend::Replace => vk::BlendFactor::ONE,
    };
    vk::PipelineColorBlendAttachmentState {
        blend_enable: vk::Bool32::from(blend != Blend::Replace),
        src_color_blend_factor: vk::BlendFactor::ONE,
        dst_color_blend_factor: kept,
        color_blend_op: vk::BlendOp::ADD,
        src_alpha_blend_factor: vk::BlendFactor::ONE,
        dst_alpha_blend_factor: kept,
        alpha_blend_op: vk::BlendOp::ADD,
        color_write_mask: vk::ColorComponentFlags::RGBA,
    }
}

/// Constant `i` is the `i`-th word.
pub(in crate::gpu) fn entries(constants: &[u32]) -> Vec<vk::SpecializationMapEntry> {
    (0..constants.len() as u32)
        .map(|i| vk::SpecializationMapEntry { constant_id: i, offset: 4 * i, size: 4 })
        .collect()
}

pub(in crate::gpu) fn words(constants: &[u32]) -> Vec<u8> {
    constants.iter().flat_map(|word| word.to_ne_bytes()).collect()
}
