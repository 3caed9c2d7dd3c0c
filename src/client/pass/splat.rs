//! Draws samples as filter-shaped sprites, additively (paper §4.2, steps 1 and 2).

use std::sync::Arc;

use crate::client::layout::SplatPush;
use crate::client::settings::FilmSpec;
use crate::client::upload::{STRIDE, VertexBatch, VertexPart};
use crate::gpu::{
    Access, Attachment, Blend, Cmd, Gpu, GpuError, GraphicsDesc, Image, Pipeline, TexelFormat, Texture,
    Topology, VertexLayout,
};

/// The samples of one stream of a batch.
pub struct Sprites<'a> {
    /// The batch.
    pub vertices: &'a VertexBatch,
    /// 0 for the camera stream, 1 for the light stream.
    pub stream: usize,
    /// The constants of `splat.vert`.
    pub push: SplatPush,
}

impl Sprites<'_> {
    /// Draws every sample into `target`, cleared first, with a pipeline of [`sprite_pipeline`].
    pub fn draw(&self, cmd: &mut Cmd<'_>, pipeline: &Pipeline, textures: &[Texture<'_>], target: &mut Image) {
        self.draw_parts(cmd, pipeline, textures, target, &[(VertexPart::All, self.push)]);
    }

    /// As [`draw`](Self::draw), for a pipeline that is linear in the samples, so that samples of dense cells are drawn merged.
    pub fn draw_merged(&self, cmd: &mut Cmd<'_>, pipeline: &Pipeline, target: &mut Image) {
        // Positions of merged samples are in texels already.
        let merged = SplatPush { picture: [1.0; 2], pad: 0.0, ..self.push };
        let parts = [(VertexPart::Single, self.push), (VertexPart::Merged, merged)];
        self.draw_parts(cmd, pipeline, &[], target, &parts);
    }

    fn draw_parts(
        &self,
        cmd: &mut Cmd<'_>,
        pipeline: &Pipeline,
        textures: &[Texture<'_>],
        target: &mut Image,
        parts: &[(VertexPart, SplatPush)],
    ) {
        cmd.access(target, Access::ColorWrite);
        cmd.rendering(&[Attachment::cleared(target)], |cmd| {
            for (part, push) in parts {
                let mut ranges = self.vertices.ranges(self.stream, *part).peekable();
                if ranges.peek().is_some() {
                    cmd.bind(pipeline, bytemuck::bytes_of(push), textures);
                }
                for (buffer, range) in ranges {
                    cmd.draw_sprites(buffer, STRIDE, range.start, range.end - range.start);
                }
            }
        });
    }
}

/// Draws every sample of one stream into the batch image, weighted by the splat filter.
///
/// Reads: the batch's vertices. Writes: `batch.color`, cleared first, additively.
pub struct SplatPass {
    pipeline: Pipeline,
}

impl SplatPass {
    /// Compiles the pass for one filter.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, GpuError> {
        let frag = ("splat_color.frag", &sprite_constants(spec)[..]);
        Ok(Self { pipeline: sprite_pipeline(gpu, frag, false, 0, TexelFormat::Rgba32F)? })
    }

    /// Draws `sprites` into `target`.
    pub fn record(&self, cmd: &mut Cmd<'_>, sprites: &Sprites<'_>, target: &mut Image) {
        sprites.draw_merged(&mut cmd.scope("splat"), &self.pipeline, target);
    }
}

/// Constants common to all sprite shaders: filter and slots.
pub fn sprite_constants(spec: &FilmSpec) -> [u32; 2] {
    [spec.filter.constant(), spec.batch_slots()]
}

/// A pipeline that draws sprites additively into one attachment. The constants of `frag` begin with [`sprite_constants`];
/// `luminance` is a constant of `splat.vert`.
pub fn sprite_pipeline(
    gpu: &Arc<Gpu>,
    frag: (&str, &[u32]),
    luminance: bool,
    textures: u32,
    format: TexelFormat,
) -> Result<Pipeline, GpuError> {
    let quads = !gpu.large_points();
    let (filter, slots) = (frag.1[0], frag.1[1]);
    Pipeline::new(
        gpu,
        &GraphicsDesc {
            name: frag.0,
            vert: ("splat.vert", &[filter, slots, u32::from(quads), u32::from(luminance)]),
            frag,
            push_bytes: size_of::<SplatPush>(),
            textures,
            attachments: &[(format, Blend::Add)],
            layers: 1,
            topology: if quads { Topology::Quads } else { Topology::Points },
            // Attributes: uv, and xyz with w.
            vertex: VertexLayout { stride: STRIDE as u32, attributes: &[(2, 0), (4, 8)] },
        },
    )
}

/// The constants of `splat.vert` for this film.
pub fn splat_push(spec: &FilmSpec, inverse_scale: f32) -> SplatPush {
    let [width, height] = spec.padded_extent();
    SplatPush {
        picture: [spec.width as f32, spec.height as f32],
        target: [width as f32, height as f32],
        ndc_scale: [width, height * spec.batch_slots()].map(|n| 2.0 / n as f32),
        pad: spec.pad() as f32,
        inverse_scale,
    }
}
