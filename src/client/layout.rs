//! Every block that a shader reads from the host, member by member as in the shader, or in `glsl/include/layout.glsl` if several read it.
//! Those of the post-processes stand beside them.
//!
//! Offsets follow std430: scalars at multiples of 4, `vec2` of 8, `vec4` of 16. `tests/gpu/shaders.rs` walks the
//! compiled shaders and compares every member with [`BLOCKS`]. Vertices are [`Sample`](crate::stream::Sample)s.

/// Largest block: the push range that every Vulkan device has.
pub const MAX_PUSH_BYTES: usize = 128;

/// A block as the host lays it out.
pub struct PushBlock {
    /// The name of the struct, here and in the shader.
    pub name: &'static str,
    /// Its size.
    pub bytes: usize,
    /// Its members.
    pub members: &'static [Member],
}

/// A member's name and offset in bytes.
pub type Member = (&'static str, usize);

/// Declares blocks and lists them with their members.
macro_rules! blocks {
    ($($(#[$doc:meta])* $name:ident, $bytes:literal {
        $($(#[$member_doc:meta])* $member:ident: $kind:ty,)*
    })*) => {
        $($(#[$doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name {
            $($(#[$member_doc])* pub $member: $kind,)*
        }

        const _: () = assert!(size_of::<$name>() == $bytes && $bytes <= $crate::client::layout::MAX_PUSH_BYTES);)*

        /// Every block of this file.
        pub const BLOCKS: &[$crate::client::layout::PushBlock] = &[$($crate::client::layout::PushBlock {
            name: stringify!($name),
            bytes: size_of::<$name>(),
            members: &[$((stringify!($member), std::mem::offset_of!($name, $member)),)*],
        },)*];
    };
}

pub(crate) use blocks;

blocks! {
    /// Constants of `splat.vert`.
    SplatPush, 32 {
        /// Width and height of the picture: texels per unit of uv.
        picture: [f32; 2],
        /// Width and height of the padded target, texels.
        target: [f32; 2],
        /// `2 / target`.
        ndc_scale: [f32; 2],
        /// Texels of overscan on every side.
        pad: f32,
        /// 1 / luminance scale, a power of two.
        inverse_scale: f32,
    }

    /// Constants of `fold.comp`.
    FoldPush, 4 {
        /// 1 / luminance scale, a power of two.
        inverse_scale: f32,
    }

    /// Constants of `downsample.frag`.
    DownsamplePush, 8 {
        /// Extent of the finer level, texels.
        source: [i32; 2],
    }

    /// Constants of `reconstruct.frag` and `reconstruct.comp`; pairs are camera, light.
    ReconstructPush, 48 {
        /// Level of detail by sample count.
        lod: [f32; 2],
        /// Level at which colour and variance are read for noise masking.
        variance_lod: [f32; 2],
        /// Texels of overscan on every side.
        pad: f32,
        /// Texels of the picture / light paths; 0 while there are none.
        light_scale: f32,
        /// `Vm`: levels per factor 4 of excess relative variance.
        noise_masking: f32,
        /// Coarsest level.
        max_level: f32,
        /// Mean sum of squared weights of one splat.
        energy: f32,
        /// 1 / luminance scale, a power of two.
        inverse_scale: f32,
        /// Texels of the sums per pixel drawn, along each axis.
        texels: [f32; 2],
    }

    /// Constants of `compose.frag`.
    ComposePush, 80 {
        /// First row of the matrix that the layer's XYZ are multiplied by; the fourth number is not used.
        x: [f32; 4],
        /// Second row.
        y: [f32; 4],
        /// Third row.
        z: [f32; 4],
        /// The part of the picture that is drawn: first texel, and one past the last.
        part: [i32; 4],
        /// The layer's first texel in the picture.
        origin: [i32; 2],
        /// Its part of what is shown there.
        share: f32,
        /// Padding to a multiple of 16 bytes.
        padding: f32,
    }

    /// Constants of `bilateral_error.frag` and `bilateral.frag`.
    BilateralPush, 20 {
        /// Level at which colour and variance are read.
        variance_lod: f32,
        /// `Vm`: stages per factor 4 of excess relative variance.
        noise_masking: f32,
        /// Coarsest level.
        max_level: f32,
        /// Mean sum of squared weights of one splat.
        energy: f32,
        /// 1 / luminance scale, a power of two.
        inverse_scale: f32,
    }

    /// Constants of the shaders whose names begin with `adaptive`.
    AdaptivePush, 28 {
        /// Width and height of the level, texels.
        extent: [i32; 2],
        /// The level's first texel in the image of its light: the overscan at level 0.
        offset: [i32; 2],
        /// The level; 0 has a texel per pixel.
        level: i32,
        /// Levels below it keep nothing.
        finest: i32,
        /// 1 / luminance scale, a power of two.
        inverse_scale: f32,
    }

    /// Constants of `tonemap.frag`.
    TonemapPush, 64 {
        /// First row of `P`, XYZ to linear RGB; the fourth number is not used.
        red: [f32; 4],
        /// Second row.
        green: [f32; 4],
        /// Third row.
        blue: [f32; 4],
        /// `B`.
        exposure: f32,
        /// `C`.
        contrast: f32,
        /// `1 / G`.
        inverse_gamma: f32,
        /// Fills the last 16 bytes.
        padding: f32,
    }

    /// Constants of `stereo.frag`.
    StereoPush, 8 {
        /// Width and height of one eye's picture, pixels.
        size: [i32; 2],
    }

    /// Constants of `glare_rows.comp`, `glare_columns.comp` and `glare_back.comp`.
    GlarePush, 12 {
        /// Width and height of the picture, pixels.
        extent: [u32; 2],
        /// X, Y or Z: 0, 1 or 2.
        channel: u32,
    }

    /// Constants of the shaders whose names begin with `wavelet`.
    WaveletPush, 16 {
        /// Width and height of the picture, pixels.
        extent: [i32; 2],
        /// Pixels between neighbours.
        step: i32,
        /// Fills the last 8 bytes.
        padding: i32,
    }
}
