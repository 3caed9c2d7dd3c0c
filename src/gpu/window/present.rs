//! Recording what a window shows.

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::commands::sync::Access;
use crate::gpu::resources::image::Image;
use crate::gpu::window::chain::WHOLE;

/// What the window shows where there is no picture.
const BACKGROUND: vk::ClearColorValue = vk::ClearColorValue { float32: [0.0, 0.0, 0.0, 1.0] };

/// The image of a window that is being drawn.
#[derive(Clone, Copy)]
pub(in crate::gpu) struct Shown {
    pub raw: vk::Image,
    pub extent: [u32; 2],
    /// How it was used last.
    pub access: Access,
}

impl Cmd<'_> {
    /// Copies level 0 of `picture`, texel by texel from the left top, and clears what it does not cover.
    ///
    /// A blit without scaling: the channels find their places, and the values of equal formats stay the same bits.
    pub(in crate::gpu) fn show(&mut self, picture: &mut Image, shown: &mut Shown) {
        let (from, to) = (picture.extent(0), shown.extent);
        let both = [from[0].min(to[0]), from[1].min(to[1])];
        if both != to {
            self.clear_shown(shown);
        }
        self.access_levels(picture, 0..1, Access::TransferRead);
        self.access_shown(shown.raw, &mut shown.access, Access::TransferWrite);
        let layer = vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        };
        let corners = [vk::Offset3D::default(), vk::Offset3D { x: both[0] as i32, y: both[1] as i32, z: 1 }];
        let blit = vk::ImageBlit::default()
            .src_subresource(layer)
            .src_offsets(corners)
            .dst_subresource(layer)
            .dst_offsets(corners);
        // SAFETY: the rectangle lies within both images, whose layouts were set above.
        unsafe {
            self.gpu.device.cmd_blit_image(
                self.raw,
                picture.raw,
                Access::TransferRead.layout(),
                shown.raw,
                Access::TransferWrite.layout(),
                &[blit],
                vk::Filter::NEAREST,
            );
        }
    }

    /// Fills the whole image with the background.
    pub(in crate::gpu) fn clear_shown(&mut self, shown: &mut Shown) {
        self.access_shown(shown.raw, &mut shown.access, Access::TransferWrite);
        // SAFETY: the image can be copied to and is in this layout.
        unsafe {
            self.gpu.device.cmd_clear_color_image(
                self.raw,
                shown.raw,
                Access::TransferWrite.layout(),
                &BACKGROUND,
                &[WHOLE],
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::gpu::commands::readback::{Region, read_image};
    use crate::gpu::device::choice::DeviceChoice;
    use crate::gpu::device::{Gpu, GpuOptions};
    use crate::gpu::resources::buffer::{Buffer, BufferUse};
    use crate::gpu::resources::image::{Format, ImageDesc};

    use super::*;

    /// Pictures reach images of their own format as they are, whatever the format; what is left is background.
    #[test]
    fn every_output_is_shown_bit_by_bit() {
        let options = GpuOptions { validation: true, quads: false };
        let gpu = Gpu::with_options(&DeviceChoice::Best, options).expect("a device with validation");
        let (from, to) = ([37, 21], [40, 30]);
        for (format, background) in [
            (Format::Rgba8, 0xff00_0000_u64),
            (Format::Rgb10A2, 0xc000_0000),
            (Format::Rgba16F, 0x3c00 << 48),
        ] {
            let image =
                |name, extent| Image::new(&gpu, ImageDesc { name, format, extent, mips: false }).expect(name);
            let (mut picture, mut window) = (image("picture", from), image("window", to));
            let size = format.bytes();
            let mut buffer =
                Buffer::new(&gpu, "texels", BufferUse::Upload, size * 37 * 21).expect("a buffer");
            for (i, byte) in buffer.mapped_mut().iter_mut().enumerate() {
                // Half floats must be numbers, and normal ones: the exponent, in the odd bytes, is bounded.
                let noise = (i as u32).wrapping_mul(2_654_435_761).rotate_left(9) as u8;
                *byte = if format == Format::Rgba16F && i % 2 == 1 { 16 + noise % 64 } else { noise };
            }
            let texels = buffer.mapped().to_vec();
            let mut frame = gpu.begin().expect("a frame");
            let mut cmd = frame.cmd();
            cmd.copy_from_buffer(&buffer, &mut picture);
            let mut shown = Shown { raw: window.raw, extent: to, access: Access::Undefined };
            cmd.show(&mut picture, &mut shown);
            window.access[0] = shown.access;
            gpu.wait(frame.submit().expect("submit")).expect("wait");
            let read = read_image(&gpu, &mut window, Region { origin: [0, 0], extent: to }).expect("read");
            for (i, texel) in read.chunks_exact(size).enumerate() {
                let (x, y) = (i % 40, i / 40);
                let at = (y * 37 + x) * size;
                let black = &background.to_le_bytes()[..size];
                let wanted = if x < 37 && y < 21 { &texels[at..at + size] } else { black };
                assert!(texel == wanted, "{format:?}: {texel:?} at {x}, {y} instead of {wanted:?}");
            }
        }
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
    }
}
