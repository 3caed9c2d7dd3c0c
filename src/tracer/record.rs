//! The record of a path, event by event: what `pointillist replay` prints.
//!
//! Integrators are generic over the set of materials. Compiled for [`Recorded`](super::bsdf::Recorded), which is every material and tells
//! what it is asked, they record what they do; compiled for any other set they have no trace of this.
//! [`Scattering::record`](super::bsdf::Scattering::record) is what they call.

use std::cell::RefCell;

use glam::{Vec2, Vec3};

use crate::color::Xyz;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::Fault;
use crate::stream::faults;

use super::bsdf::BsdfSample;
use super::interaction::SurfaceInteraction;
use super::light::LightSample;
use super::medium::MediumIndex;
use super::wavelength_mis::WavelengthMis;

/// Something that happened on a path.
#[derive(Clone, Debug)]
pub enum PathEvent {
    /// A path, or a subpath of one, begins.
    Begins(CarriedLight),
    /// A path, or a branch of one, came to a surface, or is scattered in a medium. [`Trail`] tells from where.
    Meets(CarriedLight, SurfaceInteraction),
    /// A path, or a branch of one, meets nothing any more, or is as long as the scene allows. One that ends otherwise ends at the vertex that
    /// it met last.
    Leaves(CarriedLight),
    /// A material was evaluated for two directions of its shading space: f·|cos| and the density per steradian.
    Evaluated {
        /// To where the path came from.
        wo: Vec3,
        /// To where light comes from.
        wi: Vec3,
        /// `None` for nothing.
        value: Option<(SampledSpectrum, PdfW)>,
    },
    /// A material chose a direction.
    Sampled {
        /// To where the path came from.
        wo: Vec3,
        /// The random numbers.
        u: Vec2,
        /// The random number that chose the lobe.
        lobe: f32,
        /// The sample; `None` where the path ends.
        sample: Option<BsdfSample>,
    },
    /// A light was sampled from the last vertex, or before the next one from a point along the flight to that.
    Light {
        /// The point that it lights.
        from: Vec3,
        /// Its number.
        light: u32,
        /// The sample.
        sample: LightSample,
        /// Unoccluded contribution with its MIS weight.
        value: SampledSpectrum,
        /// Transmittance of the connection, in [0, 1]; at most 4 where colours part in a medium.
        visible: f32,
    },
    /// Radiance, or flux of a light path, that goes on from the last vertex, after roulette.
    Throughput(SampledSpectrum),
    /// The radiance that the path has found after it hit a light.
    Radiance(SampledSpectrum),
    /// Photons around the last vertex were gathered.
    Gathered {
        /// How many of them count.
        photons: usize,
        /// The area of the disc that they lie on, or the cross section of the beam around which they lie in media.
        area: f32,
        /// The colour that the path has found by photons so far.
        xyz: Xyz,
    },
    /// The last vertex of a light path was connected to the camera.
    ToCamera {
        /// Where it is seen.
        uv: [f32; 2],
        /// Unoccluded contribution without MIS weight.
        value: SampledSpectrum,
    },
    /// Two vertices of subpaths were connected.
    Connection {
        /// Position of the vertex of the camera subpath.
        camera: Vec3,
        /// Position of the vertex of the light subpath.
        light: Vec3,
        /// Unoccluded contribution with its MIS weight, over its probability.
        value: SampledSpectrum,
        /// Transmittance of the connection, in [0, 1]; at most 4 where colours part in a medium.
        visible: f32,
    },
    /// A path from the camera has ended: this is the radiance that it has found, at its wavelengths.
    Estimate {
        /// The wavelengths.
        lambda: SampledWavelengths,
        /// The radiance.
        radiance: SampledSpectrum,
    },
    /// A value was rejected here.
    Fault(Fault),
}

/// The state of a path between two vertices.
#[derive(Clone, Copy, Debug)]
pub struct CarriedLight {
    /// The wavelengths of the path.
    pub lambda: SampledWavelengths,
    /// Product of the weights so far: flux of a path from a light, importance of one from the camera.
    pub throughput: SampledSpectrum,
    /// Relative densities with which each wavelength as the hero would have sampled the same directions.
    pub wavelength_mis: WavelengthMis,
    /// The path begins at a light.
    pub from_light: bool,
    /// Number of segments so far.
    pub depth: u32,
    /// The medium that the path is in, or in which it came to its last vertex.
    pub medium: MediumIndex,
}

/// The vertices of a path, to tell where each segment begins: a hit knows only the distance from what its ray has passed last, and a branch
/// begins at the vertex at which its path has split.
#[derive(Clone, Debug, Default)]
pub struct Trail(Vec<Option<Vec3>>);

impl Trail {
    /// Begins another path.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes the vertex that a path, or a branch of one, [meets](PathEvent::Meets) at `p`, and returns where the segment begins that led there: the
    /// vertex before. `None` for the first segment, which begins at the camera or at a light.
    pub fn meets(&mut self, carried: &CarriedLight, p: Vec3) -> Option<Vec3> {
        self.0.resize((carried.depth as usize).saturating_sub(1), None);
        let from = self.0.last().copied().flatten();
        self.0.push(Some(p));
        from
    }
}

thread_local! {
    static EVENTS: RefCell<Vec<PathEvent>> = const { RefCell::new(Vec::new()) };
}

/// Records an event, behind the faults that were raised since the last one.
#[cold]
pub fn record(event: PathEvent) {
    EVENTS.with_borrow_mut(|events| {
        record_faults(events);
        events.push(event);
    });
}

fn record_faults(events: &mut Vec<PathEvent>) {
    let pending = faults::pending();
    if pending.is_empty() {
        return;
    }
    let known = events.iter().filter(|event| matches!(event, PathEvent::Fault(_))).count();
    events.extend(pending.into_iter().skip(known).map(|raised| PathEvent::Fault(raised.fault)));
}

/// The events of `path` and the faults that it raised.
pub fn recorded(path: impl FnOnce()) -> Vec<PathEvent> {
    faults::take();
    EVENTS.take();
    path();
    let mut events = EVENTS.take();
    record_faults(&mut events);
    faults::take();
    events
}
