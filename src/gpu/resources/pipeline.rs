//! Graphics and compute pipelines, specialized by constants.

use std::borrow::Cow;
use std::sync::Arc;

use ash::vk;

use crate::gpu::device::gpu::Gpu;
use crate::gpu::device::retire::{PipelineHandles, Retired};
use crate::gpu::error::GpuError;
use crate::gpu::resources::image::TexelFormat;
use crate::gpu::resources::shader::ShaderModule;

/// Blend mode of a new value with the existing texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// Replaces the texel.
    Replace,
    /// Is added to the texel.
    Add,
    /// Covers the texel (premultiplied alpha).
    Over,
}

/// Primitives generated from vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topology {
    /// One triangle without vertex data that covers the attachments.
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

/// The description of a graphics pipeline.
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
    /// Format and blending of each attachment.
    pub attachments: &'a [(TexelFormat, Blend)],
    /// Layers of the attachments and of the textures, all of which are drawn at once; several need [`Gpu::draws_layers`].
    pub layers: u32,
    /// The primitives that are drawn.
    pub topology: Topology,
    /// Attributes of a vertex; not used by [`Topology::Fullscreen`].
    pub vertex: VertexLayout<'a>,
}

/// A graphics pipeline with its layouts. When dropped it is kept for reuse by description.
pub struct Pipeline {
    gpu: Arc<Gpu>,
    /// The description as text, the key for reuse.
    description: String,
    pub(in crate::gpu) handles: PipelineHandles,
    pub(in crate::gpu) textures: u32,
    pub(in crate::gpu) push_bytes: usize,
    pub(in crate::gpu) layers: u32,
}

/// Stages of a graphics pipeline that see push constants.
pub(in crate::gpu) const PUSH_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

impl Pipeline {
    /// A pipeline of this description: an unowned one if available, else a new one.
    ///
    /// # Errors
    ///
    /// [`GpuError::Shader`] for an unknown shader, [`GpuError::Call`] naming the pipeline.
    pub fn new(gpu: &Arc<Gpu>, desc: &GraphicsDesc<'_>) -> Result<Self, GpuError> {
        let description = format!("{desc:?}");
        let spare = gpu.take_spare(&description);
        // From here on a failure drops `pipeline`, which retires what was created.
        let mut pipeline = Pipeline {
            gpu: gpu.clone(),
            description,
            handles: spare.unwrap_or_default(),
            textures: desc.textures,
            push_bytes: desc.push_bytes,
            layers: desc.layers,
        };
        if spare.is_none() {
            let (texture, fragment) =
                (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, vk::ShaderStageFlags::FRAGMENT);
            let bindings = vec![(texture, fragment); desc.textures as usize];
            make_layouts(gpu, desc.name, &bindings, PUSH_STAGES, desc.push_bytes, &mut pipeline.handles)?;
            pipeline.handles.pipeline = compile(gpu, desc, pipeline.handles.layout)?;
            gpu.note_compiled(desc.frag.0, desc.frag.1);
        }
        Ok(pipeline)
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        leave(&self.gpu, &mut self.description, self.handles);
    }
}

/// Keeps a pipeline for reuse by description.
fn leave(gpu: &Gpu, description: &mut String, handles: PipelineHandles) {
    if handles.pipeline == vk::Pipeline::null() {
        // The pipeline could not be compiled.
        gpu.retire(Retired::Pipeline(handles));
    } else {
        gpu.keep_spare(std::mem::take(description), handles);
    }
}

/// The variant of a shader for images of so many layers: see `glsl/include/layers.glsl`.
fn variant(shader: &str, layers: u32) -> Cow<'_, str> {
    if layers > 1 { format!("{shader}.layers").into() } else { shader.into() }
}

/// The description of a compute pipeline.
#[derive(Clone, Copy, Debug)]
pub struct ComputeDesc<'a> {
    /// The shader, and its specialization constants, ids 0, 1, ….
    pub shader: (&'a str, &'a [u32]),
    /// Size of the push constants in bytes, at most 128.
    pub push_bytes: usize,
    /// Number of textures, at set 0, bindings 0, 1, ….
    pub textures: u32,
    /// Further bindings: true for a storage image, false for a storage buffer.
    pub images: &'a [bool],
    /// Layers of the images, each of which has workgroups of its own.
    pub layers: u32,
}

/// A compute pipeline with its layouts. When dropped it is kept for reuse by description.
pub struct ComputePipeline {
    gpu: Arc<Gpu>,
    /// The description as text, the key for reuse.
    description: String,
    pub(in crate::gpu) handles: PipelineHandles,
    pub(in crate::gpu) push_bytes: usize,
    pub(in crate::gpu) layers: u32,
    bindings: usize,
}

impl ComputePipeline {
    /// A pipeline of this description: an unowned one if available, else a new one.
    ///
    /// # Errors
    ///
    /// [`GpuError::Shader`] for an unknown shader, [`GpuError::Call`] naming it.
    pub fn new(gpu: &Arc<Gpu>, desc: &ComputeDesc<'_>) -> Result<Self, GpuError> {
        let (name, constants) = desc.shader;
        let description = format!("{desc:?}");
        let spare = gpu.take_spare(&description);
        // A failure drops `pipeline`, which retires what was created.
        let mut pipeline = ComputePipeline {
            gpu: gpu.clone(),
            description,
            handles: spare.unwrap_or_default(),
            push_bytes: desc.push_bytes,
            layers: desc.layers,
            bindings: desc.textures as usize + desc.images.len(),
        };
        if spare.is_some() {
            return Ok(pipeline);
        }
        let compute = vk::ShaderStageFlags::COMPUTE;
        let kind = |image: &bool| match image {
            true => vk::DescriptorType::STORAGE_IMAGE,
            false => vk::DescriptorType::STORAGE_BUFFER,
        };
        let textures = (0..desc.textures).map(|_| vk::DescriptorType::COMBINED_IMAGE_SAMPLER);
        let bindings: Vec<_> =
            textures.chain(desc.images.iter().map(kind)).map(|kind| (kind, compute)).collect();
        make_layouts(gpu, name, &bindings, compute, desc.push_bytes, &mut pipeline.handles)?;
        let module = ShaderModule::new(gpu, &variant(name, desc.layers))?;
        let constants = Constants::new(constants);
        let constants = constants.info();
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(compute)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&constants);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(pipeline.handles.layout);
        let made = gpu.pipelines.to_compile().and_then(|cache| {
            // SAFETY: every pointer in `info` lives until the call returns.
            let made = unsafe { gpu.device.create_compute_pipelines(*cache, &[info], None) };
            made.map(|list| list[0]).map_err(|(_, result)| result)
        });
        pipeline.handles.pipeline = gpu.made(made, "vkCreateComputePipelines", name)?;
        gpu.note_compiled(name, desc.shader.1);
        Ok(pipeline)
    }
}

impl ComputePipeline {
    /// Number of its bindings.
    pub fn bindings(&self) -> usize {
        self.bindings
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        leave(&self.gpu, &mut self.description, self.handles);
    }
}

/// Creates the layouts of a push descriptor set with these bindings, and of the push constants.
fn make_layouts(
    gpu: &Gpu,
    name: &str,
    bindings: &[(vk::DescriptorType, vk::ShaderStageFlags)],
    push_stages: vk::ShaderStageFlags,
    push_bytes: usize,
    handles: &mut PipelineHandles,
) -> Result<(), GpuError> {
    let bindings: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, (kind, stages))| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(*kind)
                .descriptor_count(1)
                .stage_flags(*stages)
        })
        .collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
        .bindings(&bindings);
    // SAFETY: VK_KHR_push_descriptor is enabled; fewer than 32 bindings.
    let made = unsafe { gpu.device.create_descriptor_set_layout(&info, None) };
    handles.set_layout = gpu.made(made, "vkCreateDescriptorSetLayout", name)?;
    let ranges = [vk::PushConstantRange { stage_flags: push_stages, offset: 0, size: push_bytes as u32 }];
    let sets = [handles.set_layout];
    let info = vk::PipelineLayoutCreateInfo::default()
        .set_layouts(&sets)
        .push_constant_ranges(if push_bytes > 0 { &ranges } else { &[] });
    // SAFETY: the set layout was made above; client/layout.rs asserts at most 128 bytes.
    let made = unsafe { gpu.device.create_pipeline_layout(&info, None) };
    handles.layout = gpu.made(made, "vkCreatePipelineLayout", name)?;
    Ok(())
}

/// Specialization constants: constant `i` is the `i`-th word.
struct Constants {
    map: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Constants {
    fn new(constants: &[u32]) -> Self {
        let entry = |i| vk::SpecializationMapEntry { constant_id: i, offset: 4 * i, size: 4 };
        Self {
            map: (0..constants.len() as u32).map(entry).collect(),
            data: constants.iter().flat_map(|word| word.to_ne_bytes()).collect(),
        }
    }

    fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.map).data(&self.data)
    }
}

fn compile(gpu: &Gpu, desc: &GraphicsDesc<'_>, layout: vk::PipelineLayout) -> Result<vk::Pipeline, GpuError> {
    let vert = ShaderModule::new(gpu, &variant(desc.vert.0, desc.layers))?;
    let frag = ShaderModule::new(gpu, &variant(desc.frag.0, desc.layers))?;
    let constants = [desc.vert.1, desc.frag.1].map(Constants::new);
    let constants = constants.each_ref().map(Constants::info);
    let stage = |flag, module: &ShaderModule<'_>| {
        vk::PipelineShaderStageCreateInfo::default().stage(flag).module(module.raw).name(c"main")
    };
    let stages = [
        stage(vk::ShaderStageFlags::VERTEX, &vert).specialization_info(&constants[0]),
        stage(vk::ShaderStageFlags::FRAGMENT, &frag).specialization_info(&constants[1]),
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
    let blends: Vec<_> = desc.attachments.iter().map(|(_, blend)| blend_state(*blend)).collect();
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let formats: Vec<_> = desc.attachments.iter().map(|(format, _)| format.raw()).collect();
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
    let made = gpu.pipelines.to_compile().and_then(|cache| {
        // SAFETY: every pointer in `info` lives until the call returns; dynamicRendering is enabled.
        let made = unsafe { gpu.device.create_graphics_pipelines(*cache, &[info], None) };
        made.map(|list| list[0]).map_err(|(_, result)| result)
    });
    gpu.made(made, "vkCreateGraphicsPipelines", desc.name)
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

fn blend_state(blend: Blend) -> vk::PipelineColorBlendAttachmentState {
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
