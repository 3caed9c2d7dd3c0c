//! Composes a picture from layers: regions with additional samples, or a mix of light groups.

use std::sync::Arc;

use glam::Mat3;

use crate::client::layout::ComposePush;
use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::gpu::{
    Access, Attachment, Blend, Cmd, Gpu, GpuError, Image, LoadOp, Region, TexelFormat, Texture,
};

/// A layer of a composed picture.
pub struct PictureLayer<'a> {
    /// Scene-linear XYZ, at the internal resolution of the whole picture.
    pub xyz: &'a mut Image,
    /// First pixel of the layer in the picture, a multiple of the internal resolution.
    pub origin: [u32; 2],
    /// Matrix applied to its XYZ.
    pub matrix: Mat3,
    /// Rectangles of the picture with the layer's weight there, 0 to 1, relative to what is drawn already. They begin and end at multiples
    /// of the internal resolution, or at the edge of the picture. In a sum every layer has weight 1 everywhere.
    pub shares: Vec<(Region, f32)>,
}

/// Draws layers into a picture before glare and tone curve.
///
/// Reads: the layer. Writes: the rectangle of the picture it covers.
pub struct ComposePass {
    over: ShaderVariants,
    add: ShaderVariants,
}

impl ComposePass {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let pass = |blend| {
            ShaderVariants::new(gpu, "compose.frag", size_of::<ComposePush>(), 1)
                .compiled(policy)
                .blended(blend)
        };
        Self { over: pass(Blend::Over), add: pass(Blend::Add) }
    }

    /// Blends the layer into `target`, of this internal resolution, by its weights.
    pub fn mean(
        &mut self,
        cmd: &mut Cmd<'_>,
        layer: &mut PictureLayer<'_>,
        detail: u32,
        target: &mut Image,
    ) -> Result<(), GpuError> {
        draw(&mut self.over, cmd, layer, detail, target, LoadOp::Keep)
    }

    /// Writes the sum of the layers to `target`, replacing its contents.
    pub fn sum(
        &mut self,
        cmd: &mut Cmd<'_>,
        layers: &mut [PictureLayer<'_>],
        detail: u32,
        target: &mut Image,
    ) -> Result<(), GpuError> {
        for (i, layer) in layers.iter_mut().enumerate() {
            let load = if i == 0 { LoadOp::Clear } else { LoadOp::Keep };
            draw(&mut self.add, cmd, layer, detail, target, load)?;
        }
        Ok(())
    }
}

fn draw(
    pipelines: &mut ShaderVariants,
    cmd: &mut Cmd<'_>,
    layer: &mut PictureLayer<'_>,
    detail: u32,
    target: &mut Image,
    load: LoadOp,
) -> Result<(), GpuError> {
    let pipeline = pipelines.get(&[], &[TexelFormat::Rgba32F])?;
    let cmd = &mut cmd.scope("compose");
    cmd.access(layer.xyz, Access::Sampled);
    cmd.access(target, Access::ColorBlend);
    let row = |i: usize| layer.matrix.row(i).extend(0.0).to_array();
    let textures = [Texture::texels(layer.xyz)];
    cmd.rendering(&[Attachment { image: target, level: 0, load }], |cmd| {
        for (Region { origin: [x, y], extent: [width, height] }, share) in &layer.shares {
            let ends = [x + width, y + height].map(|end| end.div_ceil(detail) as i32);
            let push = ComposePush {
                x: row(0),
                y: row(1),
                z: row(2),
                part: [(x / detail) as i32, (y / detail) as i32, ends[0], ends[1]],
                origin: layer.origin.map(|at| (at / detail) as i32),
                share: *share,
                padding: 0.0,
            };
            cmd.bind(pipeline, bytemuck::bytes_of(&push), &textures);
            cmd.draw_triangle(pipeline);
        }
    });
    Ok(())
}
