//! Numbers for one path: the sequence NX8 with a fixed slot for every number a path can ask for.
//!
//! The sequence comes in blocks of eight dimensions that are low-discrepancy *together*; what interacts most shares a
//! block. Slots (dimension in block; pairs (0, 1), (2, 3), (4, 5) are the best ones, 6 and 7 the weakest):
//!
//! | block | 0, 1 | 2, 3 | 4, 5 | 6 | 7 |
//! |---|---|---|---|---|---|
//! | 0 | screen | light, vertex 0 | bsdf, vertex 0 | wavelength | time |
//! | 1 | lens | connections, – | light choice, lobe of vertex 0 | – | roulette of vertex 0 |
//! | 1 + d, vertex d ≥ 1 | light | bsdf | light choice, lobe | – | roulette |
//! | L | place on the light | direction from the light | bsdf, light vertex 0 | – | – |
//! | L + 1 | lens, light vertex 0 | – | light choice, lobe of light vertex 0 | – | roulette of light vertex 0 |
//! | L + 1 + d, light vertex d ≥ 1 | lens | bsdf | –, lobe | – | roulette |
//! | 2^17 | wavelength of a group of paths, – | – | – | – | – |
//!
//! L = 2^16: light subpaths. Their vertex 0 is the first surface point after the light; it is seen through the lens.
//!
//! A path may split; its branches share its slots and have the leading digits of every number exchanged ([`Sampler::branch`]).
//!
//! Dimension 6 is used in block 0 only: between two blocks it is the one dimension whose correlation is noticeably
//! larger than chance (2.5/√N; `tests/tracer/sampler_nets.rs`).
//!
//! A slot is never "the next free dimension": which branch a path takes does not change what a number means.
//! Block 0 uses the index itself, so that every aligned chunk of 4^k indices covers the whole screen evenly; later
//! blocks use a shuffled index (`scramble`). Every dimension is Owen-scrambled with its own seed. No path has 2^16
//! vertices (roulette), so camera and light subpaths share no block.

mod branch;
mod light;
mod numbers;
pub mod nx8;
pub mod scramble;
pub mod tables;

pub use light::{LightNumbers, LightSampler};
pub use numbers::{CameraNumbers, VertexNumbers, unit_f32, unit_f64};

use branch::Branch;
use numbers::vertex_numbers;
use scramble::BlockKey;
use tables::Lanes;

/// The numbers of one path. Every number has a fixed slot: a dimension always means the same thing.
///
/// A pure function of (index, seed) and cheap to copy. The first 2^64 screen positions of a seed are all different.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    /// The index as bit-reversed halves.
    index: [u32; 2],
    seed: u32,
    first: Lanes,
    second: Lanes,
    /// Of a path that has split.
    branch: Option<Branch>,
}

impl Sampler {
    /// The numbers of path `index` under `seed`.
    #[inline]
    pub fn at(index: u64, seed: u32) -> Self {
        let index = tables::reversed_halves(index);
        Self {
            index,
            seed,
            first: tables::first_block(index, &BlockKey::new(seed, 0)),
            second: tables::padded_block(index, &BlockKey::new(seed, 1)),
            branch: None,
        }
    }

    /// The numbers of branch `number` of `1 << bits` into which this path splits.
    #[inline]
    pub fn branch(&self, number: u32, bits: u32) -> Self {
        Self { branch: Some(Branch { number, bits }), ..*self }
    }

    /// Numbers for the camera.
    #[inline]
    pub fn camera(&self) -> CameraNumbers {
        let (a, b) = (&self.first, &self.second);
        CameraNumbers {
            screen: [unit_f64(a[0]), unit_f64(a[1])],
            lens: [unit_f32(b[0]), unit_f32(b[1])],
            wavelength: unit_f32(a[6]),
            time: unit_f32(a[7]),
            connection: unit_f32(b[2]),
        }
    }

    /// Numbers for vertex `depth`; 0 is the first surface point after the camera.
    #[inline]
    pub fn vertex(&self, depth: u32) -> VertexNumbers {
        if depth == 0 {
            let (a, b) = (&self.first, &self.second);
            return self.part([a[2], a[3], a[4], a[5], b[4], b[5], b[6], b[7]]);
        }
        self.part(tables::padded_block(self.index, &BlockKey::new(self.seed, 1 + depth)))
    }

    #[inline(always)]
    fn part(&self, lanes: Lanes) -> VertexNumbers {
        let lanes = self.branch.map_or(lanes, |branch| branch.of(lanes));
        vertex_numbers([lanes[0], lanes[1]], [lanes[2], lanes[3]], &lanes)
    }
}
