//! What every post-process consists of, and what runs it: on the device, and in plain Rust.

use std::marker::PhantomData;
use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::client::pass::{CompilePolicy, ShaderVariants};
use crate::gpu::{Access, Attachment, Cmd, Gpu, GpuError, Image, ImageDesc, TexelFormat, Texture};
use crate::image::Grid;

/// A post-process by its parameters. They are part of the [`Settings`](crate::client::Settings), and options of the command line.
///
/// The shader declares its own block of push constants, member by member as the pass file does by `blocks!`, reads
/// the picture at `binding = 0`, and writes X, Y, Z to `location = 0`.
pub trait PostProcess: clap::Args + Clone + Default + PartialEq + Sync {
    /// Its name in the list of effects and in the timings.
    const NAME: &'static str;

    /// Its fragment shader.
    const SHADER: &'static str;

    /// The push constants of the shader.
    type Push: bytemuck::Pod + Sync;

    /// Whether it runs. By default it does not.
    fn is_on(&self) -> bool;

    /// Parameters in their simplest form with which it runs.
    fn example() -> Self;

    /// The options of the command line that give these parameters.
    fn options(&self) -> String;

    /// The controls of the parameters in the panel.
    fn sliders(&mut self) -> Vec<PostSlider<'_>>;

    /// The push constants for a picture on this grid.
    fn push(&self, grid: PictureGrid) -> Self::Push;

    /// The specialization constants of the shader, in order.
    fn constants(&self) -> Vec<u32> {
        Vec::new()
    }

    /// The reference: what the shader writes at this texel.
    fn texel(&self, push: &Self::Push, picture: &Grid<Vec3>, at: [usize; 2]) -> Vec3;
}

/// The texels of a picture that is computed at an internal resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureGrid {
    /// Width and height of the picture, pixels.
    pub extent: [u32; 2],
    /// Pixels per texel, along each axis.
    pub detail: u32,
}

/// The control of one parameter; a double click sets it to its default.
pub struct PostSlider<'a> {
    /// Its label.
    pub label: &'static str,
    /// Its tooltip.
    pub hint: &'static str,
    /// The parameter.
    pub value: &'a mut f32,
    /// Its default.
    pub default: f32,
    /// Its range.
    pub range: RangeInclusive<f32>,
}

/// Reads an option's number within this range.
pub fn number(text: &str, range: RangeInclusive<f32>) -> Result<f32, String> {
    let inside = text.parse::<f32>().ok().filter(|value| range.contains(value));
    inside.ok_or_else(|| format!("expected a number from {} to {}", range.start(), range.end()))
}

/// The Vulkan pass of a post-process.
///
/// Reads: the picture. Writes: the other image of the pair, which then is the picture.
pub struct PostPass<P> {
    pipelines: ShaderVariants,
    process: PhantomData<P>,
}

impl<P: PostProcess> PostPass<P> {
    /// A pass without pipelines.
    pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
        let pipelines = ShaderVariants::new(gpu, P::SHADER, size_of::<P::Push>(), 1).compiled(policy);
        Self { pipelines, process: PhantomData }
    }

    /// Records the post-process, if it runs.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        process: &P,
        grid: PictureGrid,
        picture: &mut PicturePair,
    ) -> Result<(), GpuError> {
        if !process.is_on() {
            return Ok(());
        }
        let pipeline = self.pipelines.get(&process.constants(), &[TexelFormat::Rgba32F])?;
        let (push, (xyz, target)) = (process.push(grid), picture.both()?);
        let cmd = &mut cmd.scope(P::NAME);
        cmd.access(xyz, Access::Sampled);
        cmd.access(target, Access::ColorWrite);
        let (textures, targets) = ([Texture::texels(xyz)], [Attachment::whole(target)]);
        cmd.draw_fullscreen(pipeline, bytemuck::bytes_of(&push), &textures, &targets);
        std::mem::swap(xyz, target);
        Ok(())
    }
}

/// The picture after this post-process, by its reference; `None` without memory.
pub fn apply<P: PostProcess>(process: &P, picture: &Grid<Vec3>, grid: PictureGrid) -> Option<Grid<Vec3>> {
    let (push, width) = (process.push(grid), picture.width());
    let mut result = Grid::try_filled(width, picture.height(), Vec3::ZERO)?;
    result.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = process.texel(&push, picture, [x, y]);
        }
    });
    Some(result)
}

/// A scene-linear picture, and an image of the same extent for the next one, created on first use.
pub struct PicturePair {
    gpu: Arc<Gpu>,
    desc: ImageDesc,
    /// X, Y, Z of the picture.
    pub xyz: Image,
    spare: Option<Image>,
}

impl PicturePair {
    /// A picture of this extent, with so many layers.
    pub fn new(gpu: &Arc<Gpu>, extent: [u32; 2], layers: u32) -> Result<Self, GpuError> {
        // A storage image, since glare and reconstruction write it from compute shaders.
        let desc = ImageDesc::new(TexelFormat::Rgba32F, extent).layered(layers).storage();
        Ok(Self { gpu: gpu.clone(), xyz: Image::of(gpu, "picture XYZ", desc)?, desc, spare: None })
    }

    /// The picture, and the image for the next one.
    fn both(&mut self) -> Result<(&mut Image, &mut Image), GpuError> {
        let Self { gpu, desc, xyz, spare } = self;
        let spare = match spare {
            Some(spare) => spare,
            empty => {
                let spare = Image::of(gpu, "picture spare", *desc)?;
                empty.insert(spare)
            }
        };
        Ok((xyz, spare))
    }
}
