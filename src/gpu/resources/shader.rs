//! The embedded SPIR-V, by the name of its GLSL file.

use ash::vk;

use crate::gpu::device::gpu::Gpu;
use crate::gpu::error::GpuError;

/// Name and code of every shader; see `glsl/build.rs`.
static SHADERS: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// The names of all shaders, such as `splat.vert`, sorted.
pub fn shader_names() -> impl Iterator<Item = &'static str> {
    SHADERS.iter().map(|(name, _)| *name)
}

/// The SPIR-V of a shader, as bytes in little-endian order.
///
/// # Errors
///
/// [`GpuError::Shader`] when there is none of this name.
pub fn shader_code(name: &str) -> Result<&'static [u8], GpuError> {
    let found = SHADERS.iter().find(|(shader, _)| *shader == name);
    found.map(|(_, code)| *code).ok_or_else(|| GpuError::Shader(name.to_owned()))
}

/// A shader module. It is needed until its pipelines are made.
pub(in crate::gpu) struct ShaderModule<'g> {
    gpu: &'g Gpu,
    pub raw: vk::ShaderModule,
}

impl<'g> ShaderModule<'g> {
    pub fn new(gpu: &'g Gpu, name: &str) -> Result<Self, GpuError> {
        let mut bytes = std::io::Cursor::new(shader_code(name)?);
        let words = ash::util::read_spv(&mut bytes).map_err(|_| GpuError::Shader(name.to_owned()))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the code is SPIR-V for Vulkan 1.3, compiled from `glsl/` and validated by the tests.
        let made = unsafe { gpu.device.create_shader_module(&info, None) };
        Ok(Self { gpu, raw: gpu.made(made, "vkCreateShaderModule", name)? })
    }
}

impl Drop for ShaderModule<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once they are made.
        unsafe { self.gpu.device.destroy_shader_module(self.raw, None) };
    }
}
