//! Recording what a window shows.

use ash::vk;

use super::chain::WHOLE;
use super::cmd::Cmd;
use super::image::Image;
use super::sync::Access;

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
