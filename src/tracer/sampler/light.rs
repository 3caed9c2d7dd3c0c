//! The numbers of light subpaths, in blocks of their own.

use super::scramble::BlockKey;
use super::tables::{self, Lanes};
use super::{Sampler, VertexNumbers, unit_f32, unit_f64, vertex_numbers};

/// Numbers for the start of a light subpath; all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct LightNumbers {
    /// Point on the light, or on the disk through which the environment shines.
    pub place: [f32; 2],
    /// Direction from the light.
    pub direction: [f32; 2],
    /// Which light; 32 bits of precision.
    pub choice: f64,
}

/// The first block of light subpaths.
const LIGHT_BLOCK: u32 = 1 << 16;

/// The block of what the paths of a group share.
const GROUP_BLOCK: u32 = 1 << 17;

/// The numbers of one light subpath; see [`Sampler::light`].
#[derive(Clone, Copy, Debug)]
pub struct LightSampler {
    index: [u32; 2],
    seed: u32,
    first: Lanes,
    second: Lanes,
}

impl LightSampler {
    /// Numbers for the light.
    #[inline]
    pub fn emission(&self) -> LightNumbers {
        let a = &self.first;
        LightNumbers {
            place: [a[0], a[1]].map(unit_f32),
            direction: [a[2], a[3]].map(unit_f32),
            choice: unit_f64(self.second[4]),
        }
    }

    /// Numbers for vertex `depth`; 0 is the first surface point after the light. `light` is for the lens,
    /// `light_choice` is for nothing.
    #[inline]
    pub fn vertex(&self, depth: u32) -> VertexNumbers {
        if depth == 0 {
            let b = &self.second;
            return vertex_numbers([b[0], b[1]], [self.first[4], self.first[5]], b);
        }
        let b = tables::padded_block(self.index, &BlockKey::new(self.seed, LIGHT_BLOCK + 1 + depth));
        vertex_numbers([b[0], b[1]], [b[2], b[3]], &b)
    }
}

impl Sampler {
    /// The number of the wavelengths that the paths of a group share; `self` is of the group's index.
    #[inline]
    pub fn group_wavelength(&self) -> f32 {
        unit_f32(tables::padded_block(self.index, &BlockKey::new(self.seed, GROUP_BLOCK))[0])
    }

    /// The numbers of the light subpath of this path.
    #[inline]
    pub fn light(&self) -> LightSampler {
        let (index, seed) = (self.index, self.seed);
        let block = |n| tables::padded_block(index, &BlockKey::new(seed, n));
        LightSampler { index, seed, first: block(LIGHT_BLOCK), second: block(LIGHT_BLOCK + 1) }
    }
}
