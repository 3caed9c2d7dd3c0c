//! Copies: from images back to the host, from the host to images, and between images.

use std::sync::Arc;

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::device::gpu::Gpu;
use crate::gpu::error::GpuError;
use crate::gpu::resources::buffer::{Buffer, BufferUse};
use crate::gpu::resources::image::Image;
use crate::gpu::resources::sync::{Access, BufferBarrier, level};

/// A rectangle of level 0, texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Left and top texel.
    pub origin: [u32; 2],
    /// Width and height.
    pub extent: [u32; 2],
}

impl Region {
    /// Size in bytes of the copy, rows without gaps.
    pub fn bytes(&self, image: &Image) -> usize {
        self.extent[0] as usize * self.extent[1] as usize * image.format().bytes()
    }
}

impl Cmd<'_> {
    /// Copies a rectangle of level 0 of one layer to the start of `buffer`, row by row without gaps. The host may read it once the
    /// frame has completed.
    pub fn copy_to_buffer(&mut self, image: &mut Image, layer: u32, region: Region, buffer: &Buffer) {
        let [width, height] = region.extent;
        let [x, y] = region.origin;
        let extent = image.extent(0);
        assert!(x + width <= extent[0] && y + height <= extent[1], "region beyond the image");
        assert!(region.bytes(image) <= buffer.bytes(), "readback buffer too small");
        self.access_levels(image, 0..1, Access::TransferRead);
        self.buffer_barrier(BufferBarrier::CopiesInTurn);
        let copy = vk::BufferImageCopy::default()
            .image_subresource(level(0, layer..layer + 1))
            .image_offset(vk::Offset3D { x: x as i32, y: y as i32, z: 0 })
            .image_extent(vk::Extent3D { width, height, depth: 1 });
        // SAFETY: the rectangle lies within the image and the bytes within the buffer, as asserted above.
        unsafe {
            self.gpu.device.cmd_copy_image_to_buffer(
                self.raw,
                image.raw,
                Access::TransferRead.layout(),
                buffer.raw,
                &[copy],
            );
        }
        self.buffer_barrier(BufferBarrier::CopiesToHost);
    }

    /// Fills level 0 of each layer of `image` with the start of its buffer, row by row without gaps.
    pub fn copy_from_buffers(&mut self, buffers: &[&Buffer], image: &mut Image) {
        let [width, height] = image.extent(0);
        let whole = Region { origin: [0, 0], extent: [width, height] };
        assert_eq!(buffers.len(), image.layers() as usize, "a buffer for each layer");
        self.access_levels(image, 0..1, Access::TransferWrite);
        for (layer, buffer) in (0..).zip(buffers) {
            assert!(whole.bytes(image) <= buffer.bytes(), "upload buffer too small");
            let copy = vk::BufferImageCopy::default()
                .image_subresource(level(0, layer..layer + 1))
                .image_extent(vk::Extent3D { width, height, depth: 1 });
            let layout = Access::TransferWrite.layout();
            // SAFETY: the bytes lie within the buffer, as asserted; the host has written them before submitting.
            unsafe {
                self.gpu.device.cmd_copy_buffer_to_image(self.raw, buffer.raw, image.raw, layout, &[copy]);
            }
        }
    }

    /// Copies level `i` of `source` to level 0 of `target`, of as many layers, its left top texel at `origins[i]`.
    pub fn copy_levels(&mut self, source: &mut Image, target: &mut Image, origins: &[[u32; 2]]) {
        self.access_levels(source, 0..origins.len() as u32, Access::TransferRead);
        self.access(target, Access::TransferWrite);
        let layers = 0..source.layers();
        let regions: Vec<_> = (0..)
            .zip(origins)
            .map(|(i, [x, y])| {
                let [width, height] = source.extent(i);
                let room = target.extent(0);
                assert!(x + width <= room[0] && y + height <= room[1], "level beyond the target");
                vk::ImageCopy::default()
                    .src_subresource(level(i, layers.clone()))
                    .dst_subresource(level(0, layers.clone()))
                    .dst_offset(vk::Offset3D { x: *x as i32, y: *y as i32, z: 0 })
                    .extent(vk::Extent3D { width, height, depth: 1 })
            })
            .collect();
        let (from, to) = (Access::TransferRead.layout(), Access::TransferWrite.layout());
        // SAFETY: levels exist (the accesses above index them) and lie within the target, as asserted.
        unsafe {
            self.gpu.device.cmd_copy_image(self.raw, source.raw, from, target.raw, to, &regions);
        }
    }
}

/// Reads a rectangle of level 0 of one layer, row by row without gaps; waits for the GPU.
///
/// # Errors
///
/// [`GpuError::Memory`] or [`GpuError::Call`].
pub fn read_image(
    gpu: &Arc<Gpu>,
    image: &mut Image,
    layer: u32,
    region: Region,
) -> Result<Vec<u8>, GpuError> {
    let buffer = Buffer::new(gpu, "readback", BufferUse::Readback, region.bytes(image))?;
    let mut frame = gpu.begin()?;
    frame.cmd().scope("readback").copy_to_buffer(image, layer, region, &buffer);
    gpu.wait(frame.submit()?)?;
    Ok(buffer.mapped().to_vec())
}
