//! From radiance to an encoded picture (paper §4.2, steps 6 to 8; §4.3).

use std::sync::Arc;

use crate::client::layout::TonemapPush;
use crate::client::pass::images::PictureImages;
use crate::client::pass::{fullscreen, texels};
use crate::client::settings::Settings;
use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Load, Pipeline, Target};

/// Tone curve, matrix, desaturation at constant luminance, gamma, rounding to 8 bits.
///
/// Reads: `picture.xyz`. Writes: `picture.encoded`.
pub struct TonemapPass {
    pipeline: Pipeline,
}

impl TonemapPass {
    /// Compiles the pass.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, GpuError> {
        let pipeline = fullscreen(gpu, ("tonemap.frag", &[]), size_of::<TonemapPush>(), 1, &[Format::Rgba8])?;
        Ok(Self { pipeline })
    }

    /// Encodes the picture.
    pub fn record(&self, cmd: &mut Cmd<'_>, picture: &mut PictureImages, push: &TonemapPush) {
        let cmd = &mut cmd.scope("tonemap");
        cmd.access(&mut picture.xyz, Access::Sampled);
        cmd.access(&mut picture.encoded, Access::ColorWrite);
        cmd.rendering(&[Target { image: &picture.encoded, level: 0, load: Load::Discard }], |cmd| {
            cmd.bind(&self.pipeline, bytemuck::bytes_of(push), &[texels(&picture.xyz)]);
            cmd.draw_fullscreen();
        });
    }
}

/// The constants of `tonemap.frag`.
pub fn tonemap_push(settings: &Settings) -> TonemapPush {
    let p = settings.profile.from_xyz;
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
