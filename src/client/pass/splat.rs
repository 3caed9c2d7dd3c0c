//! Draws samples as filter-shaped sprites, additively (paper §4.2, steps 1 and 2).

use std::ops::Range;
use std::sync::Arc;

use crate::client::layout::SplatPush;
use crate::client::settings::{FilmSpec, SplatFilter};
use crate::client::upload::STRIDE;
use crate::gpu::{
    Access, Blend, Buffer, Cmd, Format, Gpu, GpuError, GraphicsDesc, Image, Load, Pipeline, Target, Topology,
    VertexLayout,
};

/// The samples of one stream in a vertex buffer.
pub struct Sprites<'a> {
    /// The buffer of the batch.
    pub vertices: &'a Buffer,
    /// The stream's part of it.
    pub range: Range<u32>,
}

impl Sprites<'_> {
    /// Draws them with the pipeline that is bound.
    pub fn draw(&self, cmd: &mut Cmd<'_>) {
        let count = self.range.end - self.range.start;
        cmd.draw_sprites(self.vertices, STRIDE, self.range.start, count);
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
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`] naming the pipeline.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, GpuError> {
        let filter = filter_constant(spec.filter);
        let frag = ("splat_color.frag", &[filter][..]);
        let pipeline = sprite_pipeline(gpu, frag, [filter, 0], 0, Format::Rgba32F)?;
        Ok(Self { pipeline })
    }

    /// Draws `sprites` into `target`.
    pub fn record(&self, cmd: &mut Cmd<'_>, sprites: &Sprites<'_>, push: &SplatPush, target: &mut Image) {
        let cmd = &mut cmd.scope("splat");
        cmd.access(target, Access::ColorWrite);
        cmd.rendering(&[Target { image: target, level: 0, load: Load::Clear }], |cmd| {
            cmd.bind(&self.pipeline, bytemuck::bytes_of(push), &[]);
            sprites.draw(cmd);
        });
    }
}

/// The filter as the shaders number it (`glsl/include/filter.glsl`).
pub fn filter_constant(filter: SplatFilter) -> u32 {
    match filter {
        SplatFilter::Gaussian => 0,
        SplatFilter::Tent => 1,
        SplatFilter::Box => 2,
    }
}

/// A pipeline that draws sprites additively into one target. `constants` are filter and luminance of `splat.vert`.
pub fn sprite_pipeline(
    gpu: &Arc<Gpu>,
    frag: (&str, &[u32]),
    constants: [u32; 2],
    textures: u32,
    format: Format,
) -> Result<Pipeline, GpuError> {
    let quads = !gpu.large_points();
    let [filter, luminance] = constants;
    Pipeline::new(
        gpu,
        &GraphicsDesc {
            name: frag.0,
            vert: ("splat.vert", &[filter, u32::from(quads), luminance]),
            frag,
            push_bytes: size_of::<SplatPush>(),
            textures,
            targets: &[(format, Blend::Add)],
            topology: if quads { Topology::Quads } else { Topology::Points },
            // uv, and xyz with w.
            vertex: VertexLayout { stride: STRIDE as u32, attributes: &[(2, 0), (4, 8)] },
        },
    )
}

/// The constants of `splat.vert` for this film.
pub fn splat_push(spec: &FilmSpec, inverse_scale: f32) -> SplatPush {
    let target = spec.padded_extent().map(|n| n as f32);
    SplatPush {
        picture: [spec.width as f32, spec.height as f32],
        target,
        ndc_scale: target.map(|n| 2.0 / n),
        pad: spec.pad() as f32,
        inverse_scale,
    }
}
