//! Phase functions: the density of directions into which a medium scatters.

use std::sync::Arc;

use glam::{DAffine3, Vec3};

use super::rendering_space::RenderingSpace;
use super::volume::{VolumeGrid, VolumeTexture};
use super::wrap::WrapMode;

/// A phase function: the density of directions into which a medium scatters.
#[derive(Clone, Debug, PartialEq)]
pub enum PhaseDesc {
    /// All directions alike.
    Isotropic,
    /// Henyey and Greenstein's lobe, Mitsuba's `hg`.
    HenyeyGreenstein {
        /// Mean cosine of the angle between the directions of propagation before and after: above 0 forwards. In (−1, 1).
        g: f64,
    },
    /// Scattering by particles much smaller than the wavelength, Mitsuba's `rayleigh`: 3/(16π) (1 + cos²θ).
    Rayleigh,
    /// A table over the cosine of the angle between the directions of propagation before and after, Mitsuba's `tabphase`.
    Tabulated {
        /// Values at equal steps from −1, which is backwards, to 1, linear in between: finite, not negative, at least two, and not all 0.
        /// They need not be normalised.
        values: Arc<[f64]>,
    },
    /// Mirrors much smaller than a mean free path, Mitsuba's `sggx`. They scale the extinction of the medium by the area that they have seen
    /// from the direction of a ray.
    Microflakes(MicroflakeDesc),
    /// One or the other, Mitsuba's `blendphase`.
    Blend {
        /// Share of the second, in [0, 1].
        weight: f64,
        /// Both.
        phases: Box<[PhaseDesc; 2]>,
    },
}

/// The SGGX distribution of the normals of microflakes: S of Heitz, Dupuy, Crassin and Dachsbacher, *The SGGX microflake distribution*
/// (2015), in world space. Six numbers are S_xx, S_yy, S_zz, S_xy, S_xz and S_yz of a symmetric positive definite matrix.
#[derive(Clone, Debug)]
pub enum MicroflakeDesc {
    /// The same everywhere.
    Uniform([f64; 6]),
    /// On a grid.
    Grid(Arc<MicroflakeGrid>),
}

/// S on a grid.
#[derive(Clone, Debug)]
pub struct MicroflakeGrid {
    /// S_xx, S_yy, S_zz.
    diagonal: VolumeTexture,
    /// S_xy, S_xz, S_yz.
    others: VolumeTexture,
    mean: [f64; 6],
    most: f32,
}

impl PhaseDesc {
    /// Most phase functions that one is made of.
    pub const MOST_PARTS: usize = 4;

    /// Most values of a table.
    pub const MOST_VALUES: usize = 1 << 20;

    /// True where it depends on the position.
    pub fn varies(&self) -> bool {
        match self {
            Self::Microflakes(flakes) => matches!(flakes, MicroflakeDesc::Grid(_)),
            Self::Blend { phases, .. } => phases.iter().any(Self::varies),
            _ => false,
        }
    }

    /// Replaces each grid by its mean.
    pub fn make_uniform(&mut self) {
        self.each_grid(|flakes, grid| *flakes = MicroflakeDesc::Uniform(grid.mean));
    }

    /// Moves it from world space to `space`: grids lie in space. That space is not turned, so that the matrices are the same.
    pub(super) fn place(&mut self, space: &RenderingSpace) {
        self.each_grid(|flakes, grid| {
            let (diagonal, others) = (grid.diagonal.placed(space), grid.others.placed(space));
            *flakes = MicroflakeDesc::Grid(Arc::new(MicroflakeGrid { diagonal, others, ..grid.clone() }));
        });
    }

    fn each_grid(&mut self, change: impl Fn(&mut MicroflakeDesc, &MicroflakeGrid) + Copy) {
        match self {
            Self::Microflakes(flakes) => {
                if let MicroflakeDesc::Grid(grid) = flakes {
                    let grid = grid.clone();
                    change(flakes, &grid);
                }
            }
            Self::Blend { phases, .. } => phases.iter_mut().for_each(|phase| phase.each_grid(change)),
            _ => {}
        }
    }
}

impl PartialEq for MicroflakeDesc {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Uniform(a), Self::Uniform(b)) => a == b,
            (Self::Grid(a), Self::Grid(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl MicroflakeGrid {
    /// Grids of the diagonal and of the other three numbers, with three channels and the same size, which fill the unit cube of the space
    /// to which `to_grid` transforms world space. Lookup is `nearest`-neighbour or trilinear.
    pub fn new(grids: [Arc<VolumeGrid>; 2], to_grid: DAffine3, wrap: WrapMode, nearest: bool) -> Self {
        let (mut sum, mut most, mut count) = ([0.0; 6], 0f32, 0.0);
        for s in Self::matrices(&grids) {
            (0..6).for_each(|i| sum[i] += f64::from(s[i]));
            // The Frobenius norm, of which interpolation makes no more. It is at least the largest eigenvalue.
            let [a, b, c, d, e, f] = s;
            most = most.max((a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)).sqrt());
            count += 1.0;
        }
        let [diagonal, others] = grids.map(|grid| VolumeTexture::new(grid, to_grid, wrap, nearest));
        Self { diagonal, others, mean: sum.map(|v| v / count), most }
    }

    /// The matrices at the points of two grids as in [`MicroflakeGrid::new`], x fastest.
    pub fn matrices([diagonal, others]: &[Arc<VolumeGrid>; 2]) -> impl Iterator<Item = [f32; 6]> {
        let pairs = diagonal.values().chunks_exact(3).zip(others.values().chunks_exact(3));
        pairs.map(|(d, o)| [d[0], d[1], d[2], o[0], o[1], o[2]])
    }

    /// S at a position.
    #[inline]
    pub fn at(&self, p: Vec3) -> [f32; 6] {
        let [a, b, c] = self.diagonal.value(p, |point| point).to_array();
        let [d, e, f] = self.others.value(p, |point| point).to_array();
        [a, b, c, d, e, f]
    }

    /// The mean of S.
    pub fn mean(&self) -> [f64; 6] {
        self.mean
    }

    /// At least the largest eigenvalue of S anywhere.
    pub fn most(&self) -> f32 {
        self.most
    }
}
