//! The sampler: the low-discrepancy sequence NX8, with a fixed dimension for every random number of a path.
//!
//! The sequence consists of blocks of eight dimensions that have low discrepancy *together*, so numbers that interact most
//! share a block. These are the dimensions within each block (the pairs (0, 1), (2, 3), (4, 5) are the best, 6 and 7 the
//! weakest):
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
//! | 2^18 + d | free flight to vertex d, distance along it at which a light is sampled | – | choice of that light, – | – | – |
//! | 2^19 + d | free flight to light vertex d, – | – | – | – | – |
//!
//! Light subpaths begin at block L = 2^16. Their vertex 0 is the first surface point after the light, and it is connected to
//! the lens. No path has 2^16 vertices (Russian roulette ends it before), so camera and light subpaths share no block.
//!
//! The second randomisation of a picture assigns dimensions 2 to 5 of block 0 in another order, and shares the leading digits of the place on the
//! screen with the first ([`cells`]).
//!
//! A path may split. Its branches use the same dimensions and exchange the leading digits of every number
//! ([`Sampler::branch`]).
//!
//! Dimension 6 is used in block 0 only, because between two blocks it is the one dimension whose correlation is noticeably
//! larger than chance (2.5/√N).
//!
//! A number's dimension is never "the next free one": the meaning of a dimension does not depend on the path. Block 0 uses
//! the index itself, or in a corner of the sequence's screen the number of the point that comes index-th there ([`cells`]), so that every aligned range of 4^k
//! indices covers the whole screen evenly. The other blocks are padded: they
//! use a shuffled number (`scramble`). For light paths, and for the first camera path in each pixel, this is the index; for later
//! camera paths it is the number of the visit to the pixel's cell ([`cells`]). Every dimension is Owen-scrambled with its own seed.
//!
//! `nx8` constructs and evaluates the sequence, and `scramble` randomises it.

mod branch;
pub mod cells;
pub mod nx8;
pub mod scramble;
pub mod squares;

use branch::Branch;
use cells::{ScreenCells, Visit};
use nx8::{Coordinates, reversed_halves};
use scramble::{BlockKey, first_block, padded_block};

/// The first block of light subpaths.
const LIGHT_BLOCK: u32 = 1 << 16;

/// The block that the paths of a group share.
const GROUP_BLOCK: u32 = 1 << 17;

/// The blocks of free flights in participating media, of camera paths and of light paths.
const FLIGHT_BLOCKS: [u32; 2] = [1 << 18, 1 << 19];

/// Random numbers for the start of a camera path, all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct CameraNumbers {
    /// Position over the whole window. It keeps 30 to 32 bits of precision until the splat, and is never exactly 0.
    pub screen: [f64; 2],
    /// Position on the lens.
    pub lens: [f32; 2],
    /// Wavelength.
    pub wavelength: f32,
    /// Time.
    pub time: f32,
    /// Selects the connections of bidirectional methods.
    pub connection: f32,
}

/// Random numbers for the start of a light subpath, all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct LightNumbers {
    /// Point on the light, or on the disk through which the environment illuminates the scene.
    pub place: [f32; 2],
    /// Direction of emission.
    pub direction: [f32; 2],
    /// Selects the light, with 32 bits of precision.
    pub choice: f64,
    /// Whether the ray is aimed, and at what.
    pub aim: f32,
}

/// Random numbers for a light that is sampled from somewhere along a flight, all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct FlightNumbers {
    /// Selects the light.
    pub light_choice: f64,
    /// Distance along the flight.
    pub distance: f32,
}

/// Random numbers for one vertex of a path, all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct VertexNumbers {
    /// Point on the light.
    pub light: [f32; 2],
    /// Direction of the BSDF sample.
    pub bsdf: [f32; 2],
    /// Selects the light, with 32 bits of precision, since there may be a million lights.
    pub light_choice: f64,
    /// Selects the lobe of the BSDF.
    pub lobe: f32,
    /// Russian roulette.
    pub roulette: f32,
}

impl VertexNumbers {
    #[inline(always)]
    fn new(light: [u32; 2], bsdf: [u32; 2], single: &Coordinates) -> Self {
        Self {
            light: light.map(unit_f32),
            bsdf: bsdf.map(unit_f32),
            light_choice: unit_f64(single[4]),
            lobe: unit_f32(single[5]),
            roulette: unit_f32(single[7]),
        }
    }
}

/// A 32-bit fraction as `f32` in [0, 1). It is shifted before the conversion, which would otherwise round up to 1.
#[inline(always)]
pub fn unit_f32(x: u32) -> f32 {
    (x >> 8) as f32 * NUMBER_STEP
}

/// The distance of neighbouring random numbers that [`unit_f32`] makes.
pub const NUMBER_STEP: f32 = 1.0 / 16_777_216.0;

/// The least probability from `p` ≤ 1 on with which a random number of the sequence ([`unit_f32`], a multiple of 2⁻²⁴) is below it. Below
/// any other number it is more often than that number says: below 1e-9 sixty times as often.
#[inline]
pub fn attainable(p: f32) -> f32 {
    // Numbers from 0.5 to 1 are as far apart as the grid, so that the sum is rounded to it, and the difference is exact.
    let nearest = (p + 0.5) - 0.5;
    let above = if nearest < p { nearest + NUMBER_STEP } else { nearest };
    if p < 0.5 { above } else { p }
}

/// A 32-bit fraction as `f64` in (0, 1), at the middle of its cell, exact.
#[inline(always)]
pub fn unit_f64(x: u32) -> f64 {
    (f64::from(x) + 0.5) * (1.0 / 4_294_967_296.0)
}

/// The random numbers of one path: a pure function of (index, seed) and the division of the screen, cheap to copy.
///
/// The first 2^64 screen positions of a seed are all different; in a corner of the sequence the first 2^60 ([`cells`]).
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    visit: ReversedVisit,
    first: Coordinates,
    second: Coordinates,
    /// Set for a branch of a path that has split.
    branch: Option<Branch>,
}

impl Sampler {
    /// The numbers of path `index` for `seed`, by the index alone.
    #[inline]
    pub fn at(index: u64, seed: u32) -> Self {
        let first = first_block(reversed_halves(index), &BlockKey::new(seed, 0));
        Self::new(first, Visit { number: index, seed })
    }

    /// The numbers of camera path `index` for `seed`, which are even within each cell.
    #[inline]
    pub fn in_cells(index: u64, seed: u32, cells: &ScreenCells) -> Self {
        let first = cells.first_block(index, seed);
        Self::new(first, cells.visit(index, [first[0], first[1]], seed))
    }

    #[inline(always)]
    fn new(first: Coordinates, visit: Visit) -> Self {
        let visit = ReversedVisit::from(visit);
        Self { visit, first, second: visit.block(1), branch: None }
    }

    /// The numbers of branch `number` of the `1 << bits` branches into which this path splits; those of branch 0 are its own.
    #[inline]
    pub fn branch(&self, number: u32, bits: u32) -> Self {
        Self { branch: (bits > 0).then_some(Branch { number, bits }), ..*self }
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

    /// Numbers for vertex `depth`. Vertex 0 is the first surface point after the camera.
    #[inline]
    pub fn vertex(&self, depth: u32) -> VertexNumbers {
        if depth == 0 {
            let (a, b) = (&self.first, &self.second);
            return self.part([a[2], a[3], a[4], a[5], b[4], b[5], b[6], b[7]]);
        }
        self.part(self.visit.block(1 + depth))
    }

    /// The number of the free flight to vertex `depth`, in (0, 1).
    #[inline]
    pub fn flight(&self, depth: u32) -> f64 {
        unit_f64(self.flight_block(depth)[0])
    }

    /// The other numbers for the flight to vertex `depth`.
    #[inline]
    pub fn along_flight(&self, depth: u32) -> FlightNumbers {
        let point = self.flight_block(depth);
        FlightNumbers { light_choice: unit_f64(point[4]), distance: unit_f32(point[1]) }
    }

    #[inline(always)]
    fn flight_block(&self, depth: u32) -> Coordinates {
        let point = self.visit.block(FLIGHT_BLOCKS[0] + depth);
        self.branch.map_or(point, |branch| branch.of(point))
    }

    #[inline(always)]
    fn part(&self, point: Coordinates) -> VertexNumbers {
        let point = self.branch.map_or(point, |branch| branch.of(point));
        VertexNumbers::new([point[0], point[1]], [point[2], point[3]], &point)
    }

    /// The random number that selects the wavelengths of all paths of a group.
    #[inline]
    pub fn group_wavelength(visit: Visit) -> f32 {
        unit_f32(ReversedVisit::from(visit).block(GROUP_BLOCK)[0])
    }

    /// The random numbers of the light subpath of this path.
    #[inline]
    pub fn light(&self) -> LightSampler {
        LightSampler::new(self.visit)
    }
}

/// A [`Visit`] whose number is in bit-reversed halves.
#[derive(Clone, Copy, Debug)]
struct ReversedVisit {
    number: [u32; 2],
    seed: u32,
}

impl From<Visit> for ReversedVisit {
    #[inline(always)]
    fn from(Visit { number, seed }: Visit) -> Self {
        Self { number: reversed_halves(number), seed }
    }
}

impl ReversedVisit {
    /// The coordinates of a padded block.
    #[inline(always)]
    fn block(&self, block: u32) -> Coordinates {
        padded_block(self.number, &BlockKey::new(self.seed, block))
    }
}

/// The random numbers of one light subpath; see [`Sampler::light`].
#[derive(Clone, Copy, Debug)]
pub struct LightSampler {
    visit: ReversedVisit,
    first: Coordinates,
    second: Coordinates,
}

impl LightSampler {
    /// The numbers of light subpath `number` of the `1 << bits` that a group of this visit shares. The leading `bits` digits of the visit's number
    /// are lost, which matters from 2^62 indices on in pictures of up to 32 cells.
    #[inline]
    pub fn of_group(visit: Visit, bits: u32, number: u64) -> Self {
        Self::new(Visit { number: visit.number << bits | number, ..visit }.into())
    }

    #[inline(always)]
    fn new(visit: ReversedVisit) -> Self {
        Self { visit, first: visit.block(LIGHT_BLOCK), second: visit.block(LIGHT_BLOCK + 1) }
    }

    /// Numbers for the emission.
    #[inline]
    pub fn emission(&self) -> LightNumbers {
        let a = &self.first;
        LightNumbers {
            place: [a[0], a[1]].map(unit_f32),
            direction: [a[2], a[3]].map(unit_f32),
            choice: unit_f64(self.second[4]),
            aim: unit_f32(a[6]),
        }
    }

    /// The number of the free flight to vertex `depth`, in (0, 1).
    #[inline]
    pub fn flight(&self, depth: u32) -> f64 {
        unit_f64(self.visit.block(FLIGHT_BLOCKS[1] + depth)[0])
    }

    /// Numbers for vertex `depth`. Vertex 0 is the first surface point after the light. `light` is for the lens, and
    /// `light_choice` is unused.
    #[inline]
    pub fn vertex(&self, depth: u32) -> VertexNumbers {
        if depth == 0 {
            let b = &self.second;
            return VertexNumbers::new([b[0], b[1]], [self.first[4], self.first[5]], b);
        }
        let b = self.visit.block(LIGHT_BLOCK + 1 + depth);
        VertexNumbers::new([b[0], b[1]], [b[2], b[3]], &b)
    }
}
