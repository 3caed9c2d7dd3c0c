//! Two-dimensional images with mip levels.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use crate::gpu::device::gpu::Gpu;
use crate::gpu::device::retire::Retired;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::sync::{Access, levels};

/// The format of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TexelFormat {
    /// Four floats.
    Rgba32F,
    /// One float.
    R32F,
    /// Two floats.
    Rg32F,
    /// Four bytes, 0 … 255 stands for 0 … 1.
    Rgba8,
    /// Four half floats.
    Rgba16F,
    /// Ten bits for each colour, 0 … 1023 stands for 0 … 1, red in the lowest; two bits of alpha above.
    Rgb10A2,
    /// The same with blue in the lowest.
    Bgr10A2,
}

impl TexelFormat {
    /// Bytes per texel.
    pub fn bytes(self) -> usize {
        match self {
            TexelFormat::Rgba32F => 16,
            TexelFormat::Rgba16F | TexelFormat::Rg32F => 8,
            TexelFormat::R32F | TexelFormat::Rgba8 | TexelFormat::Rgb10A2 | TexelFormat::Bgr10A2 => 4,
        }
    }

    pub(in crate::gpu) fn raw(self) -> vk::Format {
        match self {
            TexelFormat::Rgba32F => vk::Format::R32G32B32A32_SFLOAT,
            TexelFormat::R32F => vk::Format::R32_SFLOAT,
            TexelFormat::Rg32F => vk::Format::R32G32_SFLOAT,
            TexelFormat::Rgba8 => vk::Format::R8G8B8A8_UNORM,
            TexelFormat::Rgba16F => vk::Format::R16G16B16A16_SFLOAT,
            TexelFormat::Rgb10A2 => vk::Format::A2B10G10R10_UNORM_PACK32,
            TexelFormat::Bgr10A2 => vk::Format::A2R10G10B10_UNORM_PACK32,
        }
    }
}

/// The shape and the uses of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageDesc {
    /// Its texels.
    pub format: TexelFormat,
    /// Width and height, texels.
    pub extent: [u32; 2],
    /// Layers. Shaders see an image of several as an array, and one draw covers all of them.
    pub layers: u32,
    /// Whether it has mip levels down to 1×1.
    pub mips: bool,
    /// Whether compute shaders read and write it; of [`TexelFormat::Rgba32F`] or [`TexelFormat::R32F`], which every device offers for that.
    pub storage: bool,
}

impl ImageDesc {
    /// An image of one layer without mip levels.
    pub fn new(format: TexelFormat, extent: [u32; 2]) -> Self {
        Self { format, extent, layers: 1, mips: false, storage: false }
    }

    /// With this number of layers.
    pub fn layered(self, layers: u32) -> Self {
        Self { layers, ..self }
    }

    /// With mip levels down to 1×1.
    pub fn with_mips(self) -> Self {
        Self { mips: true, ..self }
    }

    /// For compute shaders.
    pub fn storage(self) -> Self {
        Self { storage: true, ..self }
    }
}

/// An image to render to and read from. Dropping it retires it.
pub struct Image {
    gpu: Arc<Gpu>,
    pub(in crate::gpu) raw: vk::Image,
    /// A view of each level, followed by one of all levels; of all layers.
    views: Vec<vk::ImageView>,
    /// A view of level 0 of each layer, where there are several.
    layer_views: Vec<vk::ImageView>,
    /// Last use of each level.
    pub(in crate::gpu) access: Vec<Access>,
    allocation: Option<Allocation>,
    desc: ImageDesc,
}

/// An error equal to the driver's.
fn out_of_memory(name: &str, size: u64) -> GpuError {
    let call = format!("vkAllocateMemory({name}, {size} bytes)");
    GpuError::Call { call, result: vk::Result::ERROR_OUT_OF_DEVICE_MEMORY }
}

impl Image {
    /// Makes an image of one layer without mip levels, with undefined contents. `extent` is width and height in texels, `name` is for
    /// debuggers and messages.
    ///
    /// # Errors
    ///
    /// As [`of`](Self::of).
    pub fn new(gpu: &Arc<Gpu>, name: &str, format: TexelFormat, extent: [u32; 2]) -> Result<Self, GpuError> {
        Self::of(gpu, name, ImageDesc::new(format, extent))
    }

    /// Makes an image with undefined contents.
    ///
    /// # Errors
    ///
    /// [`GpuError::TooLarge`], [`GpuError::Memory`] or [`GpuError::Call`], naming the image.
    pub fn of(gpu: &Arc<Gpu>, name: &str, desc: ImageDesc) -> Result<Self, GpuError> {
        let ImageDesc { format, extent: [width, height], layers, mips, storage } = desc;
        if width.max(height) > gpu.max_extent || width.min(height) == 0 {
            return Err(GpuError::TooLarge { name: name.into(), width, height, limit: gpu.max_extent });
        }
        // Level 0 alone; the driver need not even be asked for an image beyond its limits.
        let size = u64::from(width) * u64::from(height) * u64::from(layers) * format.bytes() as u64;
        if size > gpu.max_allocation {
            return Err(out_of_memory(name, size));
        }
        let level_count = if mips { width.max(height).ilog2() + 1 } else { 1 };
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
            | vk::ImageUsageFlags::SAMPLED
            | vk::ImageUsageFlags::TRANSFER_SRC
            | vk::ImageUsageFlags::TRANSFER_DST
            | if storage { vk::ImageUsageFlags::STORAGE } else { vk::ImageUsageFlags::empty() };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format.raw())
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(level_count)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        // SAFETY: the format's features were checked when the device was chosen, the extent above; every device has 256 layers.
        let made = unsafe { gpu.device.create_image(&info, None) };
        let raw = gpu.made(made, "vkCreateImage", name)?;
        // From here on a failure drops `image`, which retires what was created.
        let mut image = Image {
            gpu: gpu.clone(),
            raw,
            views: Vec::new(),
            layer_views: Vec::new(),
            access: vec![Access::Undefined; level_count as usize],
            allocation: None,
            desc,
        };
        image.bind(name)?;
        let kind = if layers > 1 { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
        for (first, count) in (0..level_count).map(|level| (level, 1)).chain([(0, level_count)]) {
            let name = format!("{name} levels {first}+{count}");
            image.views.push(gpu.view(raw, format.raw(), kind, levels(first, count), &name)?);
        }
        for layer in 0..if layers > 1 { layers } else { 0 } {
            let range = vk::ImageSubresourceRange { base_array_layer: layer, layer_count: 1, ..levels(0, 1) };
            let (kind, name) = (vk::ImageViewType::TYPE_2D, format!("{name} layer {layer}"));
            image.layer_views.push(gpu.view(raw, format.raw(), kind, range, &name)?);
        }
        Ok(image)
    }

    fn bind(&mut self, name: &str) -> Result<(), GpuError> {
        // SAFETY: the image was just made and has no memory yet.
        let needs = unsafe { self.gpu.device.get_image_memory_requirements(self.raw) };
        if needs.size > self.gpu.max_allocation {
            return Err(out_of_memory(name, needs.size));
        }
        let memory = self.gpu.memory.allocate(name, needs, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the allocation fits the requirements and is used by this image alone.
        let bound = unsafe { self.gpu.device.bind_image_memory(self.raw, memory.memory(), memory.offset()) };
        self.allocation = Some(memory);
        bound.named(&format!("vkBindImageMemory({name})"))
    }

    /// The view of one level, or of all of them; of all layers.
    pub(in crate::gpu) fn view_of(&self, level: Option<u32>) -> vk::ImageView {
        let last = self.views.len() - 1;
        self.views[level.map_or(last, |level| level as usize)]
    }

    /// The view of level 0 of one layer.
    pub(in crate::gpu) fn layer_view(&self, layer: u32) -> vk::ImageView {
        self.layer_views.get(layer as usize).copied().unwrap_or(self.views[0])
    }

    /// Width and height of a level, texels: halved and rounded down from level to level, at least 1.
    pub fn extent(&self, level: u32) -> [u32; 2] {
        self.desc.extent.map(|n| (n >> level).max(1))
    }

    /// Number of mip levels.
    pub fn levels(&self) -> u32 {
        self.access.len() as u32
    }

    /// Texel format.
    pub fn format(&self) -> TexelFormat {
        self.desc.format
    }

    /// Number of layers.
    pub fn layers(&self) -> u32 {
        self.desc.layers
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let mut views = std::mem::take(&mut self.views);
        views.append(&mut self.layer_views);
        self.gpu.retire(Retired::Image(self.raw, views, self.allocation.take()));
    }
}
