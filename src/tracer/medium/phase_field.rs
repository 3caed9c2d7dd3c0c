//! The phase function of a medium at each of its points, and by how much its particles hide what is behind them.

use std::sync::Arc;

use glam::Vec3;

use crate::scene::desc::{MicroflakeGrid, PhaseDesc};
use crate::tracer::bsdf::ScatteringModel;

use super::phase::PhaseFunction;

/// The phase function of a medium.
#[derive(Clone, Debug)]
pub(super) struct PhaseField {
    /// Where it varies, with what it is in the mean.
    mean: PhaseFunction,
    /// The lobes that vary.
    grids: Box<[(usize, Arc<MicroflakeGrid>)]>,
    /// Bound of the projected area.
    most_area: f32,
}

impl PhaseField {
    /// Prepares a description; `None` for one with more lobes than [`MOST_LOBES`](super::MOST_LOBES), and for a table that is none.
    pub(super) fn new(desc: &PhaseDesc) -> Option<Self> {
        let (mean, grids) = PhaseFunction::with_grids(desc)?;
        let most_area = mean.most_area(&grids);
        Some(Self { mean, grids: grids.into(), most_area })
    }

    /// Bound of the factor on the extinction in any direction.
    pub(super) fn most_area(&self) -> f32 {
        self.most_area
    }

    /// True where it depends on the position.
    pub(super) fn varies(&self) -> bool {
        !self.grids.is_empty()
    }

    /// The phase function at the point `p` of rendering space.
    #[inline]
    pub(super) fn at(&self, p: Vec3) -> PhaseFunction {
        let mut phase = self.mean;
        for (lobe, grid) in &self.grids {
            phase.set_microflakes(*lobe, grid.at(p));
        }
        phase
    }

    /// The factor on the extinction along the unit direction `d`.
    #[inline]
    pub(super) fn along(&self, d: Vec3) -> AreaAlong<'_> {
        match self.varies() {
            true => AreaAlong { most: self.most_area, varying: Some((self, d)) },
            false => AreaAlong { most: self.mean.projected_area(d), varying: None },
        }
    }
}

/// The factor of microflakes on the extinction along one direction: their projected area, and 1 without them.
#[derive(Clone, Copy, Debug)]
pub(super) struct AreaAlong<'a> {
    most: f32,
    varying: Option<(&'a PhaseField, Vec3)>,
}

impl AreaAlong<'_> {
    /// Its bound, and the factor itself where that is the same everywhere.
    #[inline]
    pub(super) fn most(&self) -> f32 {
        self.most
    }

    /// True where it depends on the position.
    #[inline]
    pub(super) fn varies(&self) -> bool {
        self.varying.is_some()
    }

    /// The factor at the point `p` of rendering space.
    #[inline]
    pub(super) fn at(&self, p: Vec3) -> f32 {
        self.varying.map_or(self.most, |(phase, d)| phase.at(p).projected_area(d))
    }
}
