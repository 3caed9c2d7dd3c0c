//! The pictures of both eyes as one; [`compose`](crate::image::stereo::compose) is the reference.

use std::sync::Arc;

use glam::{Mat3, Vec3};

use crate::client::error::ClientError;
use crate::client::layout::StereoPush;
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::client::settings::{ColorOutput, OptionNames, Settings};
use crate::gpu::{Access, Attachment, Buffer, BufferUse, Cmd, Gpu, Image, TexelFormat, Texture};
use crate::image::stereo::{Anaglyph, DisplayCoding, StereoError, StereoLayout};

/// Composes the encoded pictures of both eyes.
///
/// Reads: two layers of the encoded picture. Writes: the composed one, of the extent that the layout has. Where a window shows the layers
/// themselves there is nothing to compose, and the encoded picture is what is shown.
pub struct StereoPass {
    gpu: Arc<Gpu>,
    /// Constants: the layout.
    pipelines: ShaderVariants,
    /// The tables of the encoding that the image holds.
    coding: Option<(CodingKey, Image)>,
    composed: Option<Image>,
}

/// Profile, gamma and glasses that the tables are for.
type CodingKey = (crate::color::Profile, u32, Option<Anaglyph>);

/// Entries of a channel's tables.
const VALUES: usize = 256;

impl StereoPass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let pipelines = ShaderVariants::new(gpu, "stereo.frag", size_of::<StereoPush>(), 2)
            .compiled(&policy.of_one_layer());
        Self { gpu: gpu.clone(), pipelines, coding: None, composed: None }
    }

    /// Composes `encoded`, which has the picture's extent; [`composed`](Self::composed) is the result.
    ///
    /// # Errors
    ///
    /// [`StereoError::Encoding`] if a layout that mixes pixels is asked for in a wide-range encoding, and those of the device.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        encoded: &mut Image,
    ) -> Result<(), ClientError> {
        let layout = settings.stereo;
        let Some(number) = number(layout) else {
            self.composed = None;
            return Ok(());
        };
        if layout.mixes_light() && settings.output != ColorOutput::Sdr {
            return Err(StereoError::Encoding(settings.output.label()).into());
        }
        self.upload(cmd, settings)?;
        let size = encoded.extent(0);
        let extent = composed_extent(layout, size)?;
        let format = encoded.format();
        let fits = |image: &Image| image.extent(0) == extent && image.format() == format;
        let mut composed = match self.composed.take().filter(fits) {
            Some(image) => image,
            None => Image::new(&self.gpu, "picture of both eyes", format, extent)?,
        };
        let pipeline = self.pipelines.get(&[number], &[format])?;
        let cmd = &mut cmd.scope("stereo");
        cmd.access(encoded, Access::Sampled);
        cmd.access(&mut composed, Access::ColorWrite);
        let coding = self.coding.as_ref().map_or(&*encoded, |(_, image)| image);
        let textures = [&*encoded, coding].map(Texture::texels);
        let push = StereoPush { size: size.map(|n| n as i32) };
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &[Attachment::whole(&composed)]);
        self.composed = Some(composed);
        Ok(())
    }

    /// The composed picture of the last [`record`](Self::record); `None` where that left both layers as they are.
    pub fn composed(&mut self) -> Option<&mut Image> {
        self.composed.as_mut()
    }

    /// Uploads the tables of the encoding, if the image holds others.
    fn upload(&mut self, cmd: &mut Cmd<'_>, settings: &Settings) -> Result<(), ClientError> {
        let glasses = match settings.stereo {
            StereoLayout::Anaglyph(glasses) => Some(glasses),
            _ => None,
        };
        let key = (settings.profile.clone(), settings.gamma.to_bits(), glasses);
        if self.coding.as_ref().is_some_and(|(held, _)| *held == key) {
            return Ok(());
        }
        let texels =
            tables(&DisplayCoding::new(&settings.profile, settings.gamma), glasses.unwrap_or_default());
        let upload =
            Buffer::filled(&self.gpu, "stereo coding", BufferUse::Upload, bytemuck::cast_slice(&texels))?;
        let mut image = Image::new(&self.gpu, "stereo coding", TexelFormat::Rgba32F, [VALUES as u32, 3])?;
        cmd.copy_from_buffers(&[&upload], &mut image);
        cmd.access(&mut image, Access::Sampled);
        self.coding = Some((key, image));
        Ok(())
    }
}

/// Width and height of the composed picture of two of this size.
///
/// # Errors
///
/// [`StereoError::Memory`] if they overflow.
pub fn composed_extent(layout: StereoLayout, size: [u32; 2]) -> Result<[u32; 2], ClientError> {
    let size = size.map(|n| n as usize);
    let composed = layout.size(size).ok_or(StereoError::Memory { size })?;
    Ok(composed.map(|n| n as u32))
}

/// The number of a layout in `stereo.frag`; `None` for layers, which are not composed.
fn number(layout: StereoLayout) -> Option<u32> {
    Some(match layout {
        StereoLayout::SideBySide => 0,
        StereoLayout::SideBySideHalf => 1,
        StereoLayout::OverUnder => 2,
        StereoLayout::OverUnderHalf => 3,
        StereoLayout::CrossEyed => 4,
        StereoLayout::Anaglyph(_) => 5,
        StereoLayout::RowInterlaced => 6,
        StereoLayout::ColumnInterlaced => 7,
        StereoLayout::Checkerboard => 8,
        StereoLayout::Swapchain => return None,
    })
}

/// Three rows of [`VALUES`] texels, as `stereo.frag` reads them.
fn tables(coding: &DisplayCoding, glasses: Anaglyph) -> Vec<[f32; 4]> {
    let linear = (0..VALUES).map(|value| coding.decode([value as u8; 3]).extend(0.0).to_array());
    let edges = coding.edges();
    let edge = |value: usize| [0, 1, 2].map(|c| edges[c].get(value).copied().unwrap_or(f32::INFINITY));
    let edges = (0..VALUES).map(|value| Vec3::from(edge(value)).extend(0.0).to_array());
    let matrix =
        |apply: &dyn Fn(Vec3) -> Vec3| Mat3::from_cols(apply(Vec3::X), apply(Vec3::Y), apply(Vec3::Z));
    let rows = |m: Mat3| [0, 1, 2].map(|i| m.row(i).to_array());
    let to_rec709 = rows(matrix(&|light| coding.rec709_from_display(light)));
    let from_rec709 = rows(matrix(&|light| coding.display_from_rec709(light)));
    let [left, right] = glasses.matrices();
    let matrices = [left, right, to_rec709, from_rec709].into_iter().flatten();
    let mut matrices: Vec<_> = matrices.map(|row| Vec3::from(row).extend(0.0).to_array()).collect();
    matrices.resize(VALUES, [0.0; 4]);
    linear.chain(edges).chain(matrices).collect()
}
