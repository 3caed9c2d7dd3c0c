//! From radiance to an encoded picture (paper §4.2, steps 6 to 8; §4.3).

use std::sync::Arc;

use crate::client::effects::Effects;
use crate::client::layout::TonemapPush;
use crate::client::pass::{Variants, fullscreen, texels};
use crate::client::settings::Settings;
use crate::gpu::{Access, Cmd, Gpu, GpuError, Image, Load, Target};

/// Tone curve, matrix, desaturation at constant luminance, gamma, rounding to 8 bits.
///
/// Reads: the reconstructed picture, interpolated where it is coarser. Writes: the encoded picture.
#[derive(Default)]
pub struct TonemapPass {
    pipelines: Variants<Effects>,
}

impl TonemapPass {
    /// Encodes the picture.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        [xyz, encoded]: [&mut Image; 2],
        (effects, push): (&Effects, &TonemapPush),
    ) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(*effects, || {
            let frag = ("tonemap.frag", &effects.tonemap_constants()[..]);
            fullscreen(gpu, frag, size_of::<TonemapPush>(), 1, &[effects.encoded_format()])
        })?;
        let cmd = &mut cmd.scope("tonemap");
        cmd.access(xyz, Access::Sampled);
        cmd.access(encoded, Access::ColorWrite);
        cmd.rendering(&[Target { image: encoded, level: 0, load: Load::Discard }], |cmd| {
            cmd.bind(pipeline, bytemuck::bytes_of(push), &[texels(xyz)]);
            cmd.draw_fullscreen();
        });
        Ok(())
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
