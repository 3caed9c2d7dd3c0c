//! Participating media: absorption and scattering between surfaces.
//!
//! ```text
//! phase        phase functions: the bsdf of a vertex in a medium
//! phase_table  those by a table
//! microflakes  those of mirrors that lie in space
//! phase_field  the phase function at each point of a medium, and what it hides in each direction
//! emission     the light that a medium emits
//! homogeneous  coefficients that are the same everywhere
//! grid         coefficients that vary: delta and ratio tracking
//! flight       the free flight of a path to its next vertex, and the transmittance of an edge between two vertices
//! crossing     boundaries that lie in one place with each other, and with other surfaces
//! interface    which medium is on which side of a vertex
//! line         what all media along a line of sight do together
//! place        the medium around a point, found by rays: that of a camera or of a lamp
//! boundaries   whether a boundary goes through a lamp, or through the points at which the rays of a camera begin
//! ```
//!
//! A vertex in a medium is a vertex whose bsdf is a [`PhaseFunction`] ([`in_medium`](super::SurfaceInteraction::in_medium)), so that every integrator treats it
//! like any other: it samples lights from it, connects it to other vertices and to the camera, and goes on. A [`Walk`](super::walk::Walk) carries
//! the medium that it is in. Integrators are generic over the set of materials; only the sets with phase functions
//! ([`Scattering::Media`](super::bsdf::Scattering::Media)) have code for media, so that a scene without media pays nothing for them.
//!
//! # Wavelengths
//!
//! The hero of a path samples its distances, and where extinction depends on the wavelength the other three would have sampled them with other
//! densities. They are weighted as in the null-scattering path integral of Miller, Georgiev and Jarosz (*A null-scattering path integral
//! formulation of light transport*, 2019), in the form of [`wavelength_mis`](super::wavelength_mis): the factor g of a lane is its
//! transmittance along each edge of the path, times its extinction at each vertex in a medium. This is a property of the path, whichever
//! strategy found it. So the transmittance of an edge that is not sampled, to a light or between two subpaths, belongs to it as well.
//!
//! In a homogeneous medium that only absorbs no distance is sampled: every wavelength goes on, with its transmittance as a weight, and g has no
//! part of it, neither along flights nor along edges.
//!
//! # Emission
//!
//! Each piece of a flight of a camera path adds the light that the medium emits along it: in closed form where nothing varies, and on a grid at
//! each tentative collision (the absorption and emission estimator of Fong, Wrenninge, Kulla and Habel, *Production Volume Rendering*, SIGGRAPH
//! 2017 course, §5.4, before it is known whether the collision is one). No other strategy samples it, so that it has no MIS weight. Lights
//! that are chosen are shapes, environments and points; paths from lights do not begin in a medium.
//!
//! # MIS weights
//!
//! Extinction appears in the density of every strategy and cancels, except for the projected area of microflakes, which stands in for the cosine at
//! a surface. The transmittance of edges is left out, which keeps the weights a partition of one. On a grid the densities of wavelengths are
//! those of the tentative collisions of a flight and of the estimate of an edge, so that the partition over wavelengths holds for each
//! strategy and not for all of them together.
//!
//! Path tracing has one strategy more where a light is a point and the medium homogeneous: a distance along the flight that is chosen by the
//! light, since free flights seldom end where 1/r² is large (`integrator/lit_flight.rs`). It finds what next-event estimation finds.

mod boundaries;
mod crossing;
mod emission;
mod flight;
mod grid;
mod homogeneous;
mod interface;
mod line;
mod microflakes;
mod phase;
mod phase_field;
mod phase_table;
mod place;

use glam::{Vec3, Vec4};

use crate::scene::SceneDesc;
use crate::scene::desc::{MediumDesc, MediumId, MediumInterface, Name};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::prepare::PrepareError;
use boundaries::Boundaries;
use emission::EmissionField;
use grid::GridMedium;
use homogeneous::HomogeneousMedium;
use phase_field::PhaseField;

pub use flight::FreeFlight;
pub(super) use flight::{EdgeWavelengths, FlightPiece};
pub(super) use grid::MarchSteps;
pub use interface::{MediumIndex, MediumSides, PathMedia};
pub(super) use line::{LineMedia, LineOfSight};
pub use phase::{MOST_LOBES, PhaseFunction};
pub use place::CameraMedium;

/// A medium that can be traced.
#[derive(Clone, Debug)]
struct Medium {
    kind: MediumKind,
    phase: PhaseField,
    emission: Option<EmissionField>,
    /// Neither of its coefficients depends on the wavelength.
    is_grey: bool,
    /// A lower bound of the mean free path, over places and wavelengths.
    free_path: f32,
}

/// How the coefficients of a medium vary.
#[derive(Clone, Debug)]
enum MediumKind {
    Homogeneous(HomogeneousMedium),
    Grid(Box<GridMedium>),
}

/// The coefficients of a medium at a point and the wavelengths of a path.
#[derive(Clone, Copy, Debug)]
struct Coefficients {
    /// σₜ per unit of length of rendering space.
    extinction: Vec4,
    /// σₛ / σₜ.
    albedo: Vec4,
}

/// The media of a scene.
#[derive(Clone, Debug)]
pub struct Media {
    /// By id; `None` for those that nothing names.
    media: Box<[Option<Medium>]>,
    /// What is behind and in front of each surface: interior, exterior. `None` for a surface that leaves the medium as it is.
    interfaces: Box<[Option<[MediumIndex; 2]>]>,
    /// Where boundaries are.
    boundaries: Boundaries,
    /// The medium that each source of light shines into, in the order of [`Lights::source`](super::light::Lights::source); `None` where it shines into
    /// several.
    of_sources: Box<[Option<MediumIndex>]>,
    /// What is far outside, where no boundary tells.
    outside: MediumIndex,
}

impl Media {
    /// The media of a description in rendering space; `None` where no surface and no camera names one, or the integrator knows surfaces only. Where boundaries and lights are is yet
    /// to be [found](super::Scene::place_lights_in_media).
    ///
    /// # Errors
    ///
    /// [`PrepareError`] when a medium is of a kind that is not traced, or an id points nowhere.
    pub(super) fn of(desc: &SceneDesc) -> Result<Option<Self>, PrepareError> {
        if !desc.has_media() {
            return Ok(None);
        }
        let known = |id: MediumId| match desc.media.get(id.0 as usize) {
            Some(_) => Ok(id),
            None => Err(PrepareError::UnknownMedium { id }),
        };
        let used = desc.used_media();
        let prepared =
            |(i, medium)| used.contains(&i).then(|| Medium::new(medium, || named(desc, i))).transpose();
        let media = desc.media.iter().enumerate().map(prepared).collect::<Result<Box<_>, _>>()?;
        let of_groups = desc.groups.iter().flat_map(|group| &group.shapes);
        let interfaces = desc.shapes.iter().chain(of_groups).map(|shape| {
            let MediumInterface { interior, exterior } = shape.medium_interface;
            [interior, exterior].into_iter().flatten().try_for_each(|id| known(id).map(|_| ()))?;
            let sides = || [interior, exterior].map(MediumIndex::from);
            Ok(shape.medium_interface.is_transition().then(sides))
        });
        let interfaces = interfaces.collect::<Result<Box<_>, _>>()?;
        // What fills a scene without boundaries is the medium of its camera.
        let outside = desc.camera.medium.map(known).transpose()?.into();
        let boundaries = Boundaries::default();
        Ok(Some(Self { media, interfaces, boundaries, of_sources: Box::default(), outside }))
    }

    /// These media, with the boundaries and those around sources of light of `before`.
    pub(super) fn with_places_of(self, before: &Self) -> Self {
        let (of_sources, boundaries) = (before.of_sources.clone(), before.boundaries.clone());
        Self { of_sources, boundaries, outside: before.outside, ..self }
    }

    #[inline]
    fn get(&self, index: MediumIndex) -> Option<&Medium> {
        self.media.get(index.0 as usize)?.as_ref()
    }

    /// What is behind and in front of a surface; `None` where both is what it was.
    #[inline]
    pub(super) fn interface(&self, surface: u32) -> Option<[MediumIndex; 2]> {
        *self.interfaces.get(surface as usize)?
    }

    /// True where a surface lets light through and another shape that is a boundary may lie upon it.
    #[inline]
    fn may_touch_boundary(&self, surface: u32) -> bool {
        self.boundaries.touched(surface)
    }

    /// True where some medium is a grid in which each wavelength has an extinction of its own.
    pub(super) fn has_chromatic_grids(&self) -> bool {
        let is = |medium: &Medium| matches!(&medium.kind, MediumKind::Grid(grid) if grid.is_chromatic());
        self.media.iter().flatten().any(is)
    }

    /// True where some medium emits light.
    pub(super) fn shine(&self) -> bool {
        self.media.iter().flatten().any(|medium| medium.emission.is_some())
    }

    /// The medium that a source of light shines into; `None` where that depends on the ray.
    #[inline]
    pub(super) fn of_source(&self, source: u32) -> Option<MediumIndex> {
        self.of_sources.get(source as usize).copied().unwrap_or(Some(self.outside))
    }

    /// The share of light from infinitely far away that gets through a medium: nothing at the wavelengths that it takes light from.
    pub(super) fn share_from_infinity(
        &self,
        medium: MediumIndex,
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        let extinction = match self.get(medium).map(|medium| &medium.kind) {
            None => Vec4::ZERO,
            Some(MediumKind::Homogeneous(medium)) => medium.at(lambda, 1.0).extinction,
            Some(MediumKind::Grid(grid)) => grid.extinction_at_infinity(lambda),
        };
        SampledSpectrum(Vec4::select(extinction.cmpgt(Vec4::ZERO), Vec4::ZERO, Vec4::ONE))
    }

    /// A lower bound of the mean free path of a medium; `None` for one that scatters nothing, and for vacuum.
    pub(super) fn free_path(&self, index: MediumIndex) -> Option<f32> {
        let scatters =
            |medium: &&Medium| !matches!(&medium.kind, MediumKind::Homogeneous(m) if m.only_absorbs());
        self.get(index).filter(scatters).map(|medium| medium.free_path)
    }

    /// The lower bounds of the mean free paths of all media that scatter.
    pub(super) fn free_paths(&self) -> impl Iterator<Item = f32> {
        (0..self.media.len() as u32).filter_map(|i| self.free_path(MediumIndex(i)))
    }

    /// True where the phase function of a medium depends on the position.
    pub(super) fn phase_varies(&self, index: MediumIndex) -> bool {
        self.get(index).is_some_and(|medium| medium.phase.varies())
    }

    /// The phase function of a medium at the point `p`; `None` for vacuum.
    #[inline]
    pub(super) fn phase(&self, index: MediumIndex, p: Vec3) -> Option<PhaseFunction> {
        self.get(index).map(|medium| medium.phase.at(p))
    }
}

impl Medium {
    fn new(desc: &MediumDesc, named: impl Fn() -> String) -> Result<Self, PrepareError> {
        let kind = match HomogeneousMedium::new(desc) {
            Some(medium) => MediumKind::Homogeneous(medium),
            None => MediumKind::Grid(Box::new(GridMedium::new(desc))),
        };
        let other = || PrepareError::PhaseFunction { named: named() };
        let phase = PhaseField::new(&desc.phase).ok_or_else(other)?;
        let emission = desc.emission.as_ref().filter(|light| !light.is_black()).map(EmissionField::new);
        let extinction = match &kind {
            MediumKind::Homogeneous(medium) => medium.largest_extinction(),
            MediumKind::Grid(grid) => grid.largest_extinction(),
        };
        let free_path = 1.0 / (extinction * phase.most_area());
        let is_grey = desc.sigma_t.is_grey() && desc.albedo.is_grey();
        Ok(Self { kind, phase, emission, is_grey, free_path })
    }
}

/// Name and place of a medium for messages, with a blank before them.
fn named(desc: &SceneDesc, index: usize) -> String {
    let Some(Name { id, place }) = desc.names.media.get(index) else { return String::new() };
    let id = id.as_ref().map_or(String::new(), |id| format!(" \"{id}\""));
    if place.line > 0 { format!("{id} at line {}, column {}", place.line, place.column) } else { id }
}
