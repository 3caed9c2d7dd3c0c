//! From radiance to an encoded picture (paper §4.2, steps 6 to 8; §4.3).

use std::sync::Arc;

use crate::client::dither::{MASK_SIDE, blue_noise};
use crate::client::effects::{self, Effects};
use crate::client::layout::TonemapPush;
use crate::client::pass::{Variants, fullscreen, texels};
use crate::client::settings::{Dither, Settings};
use crate::color::TransferTable;
use crate::gpu::{Access, Buffer, BufferUse, Cmd, Format, Gpu, GpuError, Image, ImageDesc, Load, Target};

/// Tone curve, matrix, desaturation at constant luminance, transfer, dither and rounding.
///
/// Reads: the reconstructed picture, interpolated where it is coarser; the profile's transfer and the blue-noise mask where
/// they are wanted. Writes: the encoded picture.
#[derive(Default)]
pub struct TonemapPass {
    pipelines: Variants<Effects>,
    /// The transfer that the image holds.
    transfer: Option<(TransferTable, Image)>,
    mask: Option<Image>,
}

impl TonemapPass {
    /// Encodes the picture.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline, [`GpuError::Memory`] for a table.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        [xyz, encoded]: [&mut Image; 2],
        (effects, settings): (&Effects, &Settings),
    ) -> Result<(), GpuError> {
        self.upload(gpu, cmd, (effects, settings))?;
        let pipeline = self.pipelines.get(*effects, || {
            let frag = ("tonemap.frag", &effects.tonemap_constants()[..]);
            fullscreen(gpu, frag, size_of::<TonemapPush>(), 3, &[effects.encoded_format()])
        })?;
        let cmd = &mut cmd.scope("tonemap");
        cmd.access(xyz, Access::Sampled);
        cmd.access(encoded, Access::ColorWrite);
        // A binding that is not read holds an image that is: every binding must hold one.
        let transfer = self.transfer.as_ref().filter(|_| effects.table).map_or(&*xyz, |(_, image)| image);
        let mask = self.mask.as_ref().unwrap_or(&*xyz);
        let push = tonemap_push(settings);
        cmd.rendering(&[Target { image: encoded, level: 0, load: Load::Discard }], |cmd| {
            let read = [texels(xyz), texels(transfer), texels(mask)];
            cmd.bind(pipeline, bytemuck::bytes_of(&push), &read);
            cmd.draw_fullscreen();
        });
        Ok(())
    }

    /// Brings the tables that are read to the device, once.
    fn upload(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        (effects, settings): (&Effects, &Settings),
    ) -> Result<(), GpuError> {
        if let Some(table) = settings.profile.transfer.as_ref().filter(|_| effects.table)
            && self.transfer.as_ref().is_none_or(|(held, _)| held != table)
        {
            let texels: Vec<[f32; 4]> = table.0.iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
            let extent = [texels.len() as u32, 1];
            let desc = ImageDesc { name: "transfer", format: Format::Rgba32F, extent, mips: false };
            self.transfer = Some((table.clone(), filled(gpu, cmd, desc, bytemuck::cast_slice(&texels))?));
        }
        if effects.dither == Dither::BlueNoise && self.mask.is_none() {
            let extent = [MASK_SIDE as u32; 2];
            let desc = ImageDesc { name: "blue noise", format: Format::R32F, extent, mips: false };
            self.mask = Some(filled(gpu, cmd, desc, bytemuck::cast_slice(blue_noise()))?);
        }
        Ok(())
    }
}

/// An image with these texels, to be sampled.
fn filled(gpu: &Arc<Gpu>, cmd: &mut Cmd<'_>, desc: ImageDesc<'_>, texels: &[u8]) -> Result<Image, GpuError> {
    let mut buffer = Buffer::new(gpu, desc.name, BufferUse::Upload, texels.len())?;
    buffer.mapped_mut().copy_from_slice(texels);
    let mut image = Image::new(gpu, desc)?;
    let cmd = &mut cmd.scope("upload");
    cmd.copy_from_buffer(&buffer, &mut image);
    cmd.access(&mut image, Access::Sampled);
    // The buffer is retired: it lives until the frame has completed.
    Ok(image)
}

/// The constants of `tonemap.frag`.
fn tonemap_push(settings: &Settings) -> TonemapPush {
    let p = effects::matrix(settings);
    let row = |i: usize| p.row(i).extend(0.0).to_array();
    TonemapPush {
        red: row(0),
        green: row(1),
        blue: row(2),
        exposure: settings.exposure,
        contrast: settings.contrast,
        inverse_gamma: 1.0 / settings.gamma,
        padding: 0.0,
    }
}
