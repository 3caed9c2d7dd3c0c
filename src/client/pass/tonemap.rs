//! From radiance to an encoded picture (paper §4.2, steps 6 to 8; §4.3).

use std::sync::Arc;

use crate::client::compiled_effects::{self, Effects};
use crate::client::dither::{MASK_SIDE, blue_noise};
use crate::client::layout::TonemapPush;
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::client::settings::{Dither, Settings};
use crate::color::TransferTable;
use crate::gpu::{
    Access, Attachment, Buffer, BufferUse, Cmd, Gpu, GpuError, Image, ImageDesc, TexelFormat, Texture,
};

/// Tone curve, matrix, desaturation at constant luminance, transfer, dither and rounding.
///
/// Reads: the reconstructed picture, interpolated if coarser; the profile's transfer table and the blue-noise mask if used. Writes: the
/// encoded picture.
pub struct TonemapPass {
    gpu: Arc<Gpu>,
    /// Constants: [`Effects::tonemap_constants`].
    pipelines: ShaderVariants,
    /// The profile's transfer table, and the image that holds it.
    transfer: Option<(TransferTable, Image)>,
    mask: Option<Image>,
}

impl TonemapPass {
    /// A pass without pipelines and tables.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let pipelines =
            ShaderVariants::new(gpu, "tonemap.frag", size_of::<TonemapPush>(), 3).compiled(policy);
        Self { gpu: gpu.clone(), pipelines, transfer: None, mask: None }
    }

    /// Encodes the picture.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        effects: &Effects,
        settings: &Settings,
        xyz: &mut Image,
        encoded: &mut Image,
    ) -> Result<(), GpuError> {
        self.upload(cmd, effects, settings, xyz.layers())?;
        let pipeline = self.pipelines.get(&effects.tonemap_constants(), &[effects.encoded_format()])?;
        let cmd = &mut cmd.scope("tonemap");
        cmd.access(xyz, Access::Sampled);
        cmd.access(encoded, Access::ColorWrite);
        // Every binding must be bound to an image, so a table that is not read is replaced by the picture.
        let transfer = self.transfer.as_ref().filter(|_| effects.table).map_or(&*xyz, |(_, image)| image);
        let mask = self.mask.as_ref().unwrap_or(&*xyz);
        let textures = [&*xyz, transfer, mask].map(Texture::texels);
        let push = tonemap_push(settings);
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[Attachment::whole(encoded)]);
        Ok(())
    }

    /// Uploads the tables that are read, once, to so many layers.
    fn upload(
        &mut self,
        cmd: &mut Cmd<'_>,
        effects: &Effects,
        settings: &Settings,
        layers: u32,
    ) -> Result<(), GpuError> {
        if let Some(table) = settings.profile.transfer.as_ref().filter(|_| effects.table)
            && self.transfer.as_ref().is_none_or(|(held, _)| held != table)
        {
            let texels: Vec<[f32; 4]> = table.0.iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
            let desc = ImageDesc::new(TexelFormat::Rgba32F, [texels.len() as u32, 1]).layered(layers);
            let image = filled(&self.gpu, cmd, "transfer", desc, bytemuck::cast_slice(&texels))?;
            self.transfer = Some((table.clone(), image));
        }
        if effects.dither == Dither::BlueNoise && self.mask.is_none() {
            let desc = ImageDesc::new(TexelFormat::R32F, [MASK_SIDE as u32; 2]).layered(layers);
            let texels = bytemuck::cast_slice(blue_noise());
            self.mask = Some(filled(&self.gpu, cmd, "blue noise", desc, texels)?);
        }
        Ok(())
    }
}

/// Creates an image with these texels in every layer, ready to be sampled.
fn filled(
    gpu: &Arc<Gpu>,
    cmd: &mut Cmd<'_>,
    name: &str,
    desc: ImageDesc,
    texels: &[u8],
) -> Result<Image, GpuError> {
    let buffer = Buffer::filled(gpu, name, BufferUse::Upload, texels)?;
    let mut image = Image::of(gpu, name, desc)?;
    let cmd = &mut cmd.scope("upload");
    cmd.copy_from_buffers(&vec![&buffer; desc.layers as usize], &mut image);
    cmd.access(&mut image, Access::Sampled);
    // Dropping the buffer retires it, so it lives until the frame has completed.
    Ok(image)
}

/// The constants of `tonemap.frag`.
fn tonemap_push(settings: &Settings) -> TonemapPush {
    let p = compiled_effects::matrix(settings);
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
