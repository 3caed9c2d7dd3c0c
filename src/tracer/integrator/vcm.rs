//! Vertex connection and merging (Georgiev, Křivánek, Davidovič, Slusallek 2012, *Light Transport Simulation with Vertex Connection and
//! Merging*), where merging finds what connections cannot.
//!
//! Bidirectional path tracing finds a path by connecting two vertices next to each other that are no deltas: the camera's and the
//! light's count among them. Where a path has no such pair, E S⁺ (D S⁺)⁺ L, the camera subpath has to hit the light by chance:
//! caustics seen in a mirror or through glass are noisy, and those of lamps that nothing can hit are missing. Exactly these
//! paths, if the surface D next to the light has a diffuse part, are found by merging: light paths leave photons where they meet
//! such a surface over deltas alone, L S⁺ D, and camera paths E S⁺ (D S⁺)* D gather them as caustics are in photon mapping
//! ([`photon`](super::photon)). A point in a medium counts as such a surface, unless its phase function is a narrow peak; there photons are gathered
//! around the flight of the camera path. All other paths are those of [`BidirectionalTracer`], unbiased.
//!
//! A path is found by the one or the other, so that no weights are needed, where the original weights both for every path. Merging such
//! paths alone loses little, because the photons find the others worse than connections do, and it blurs nothing else.
//!
//! **Bias.** That of photon mapping in what is merged: the disc of a lookup shrinks as 1/n with the light paths n.

use crate::stream::{PathCounts, SampleSink, faults};
use crate::tracer::Sampler;
use crate::tracer::light_groups::GroupColors;

use super::bidirectional::{CAMERA_SUBPATHS, LIGHT_SUBPATHS, Scratch};
use super::{BidirectionalTracer, Integrator, PhotonScratch, PhotonTracer, RenderContext, SeesPhotons};

/// Bidirectional path tracing, and photons for what it finds by chance only.
#[derive(Clone, Debug)]
pub struct VcmTracer {
    bidirectional: BidirectionalTracer,
    /// The photons that are merged.
    photons: PhotonTracer,
}

/// Memory that one worker reuses from path to path of one tracer.
#[derive(Debug, Default)]
pub struct VcmScratch {
    bidirectional: Scratch,
    photons: PhotonScratch,
}

impl VcmTracer {
    /// A tracer without photons yet; `deterministic` as in [`PhotonTracer::new`].
    pub fn new(context: RenderContext, deterministic: bool) -> Self {
        Self {
            photons: PhotonTracer::for_merging(context.clone(), deterministic),
            bidirectional: BidirectionalTracer { context },
        }
    }
}

impl SeesPhotons for VcmTracer {
    fn without_photons(context: RenderContext, deterministic: bool) -> Self {
        Self::new(context, deterministic)
    }

    fn seeing(self, generations: u64) -> Self {
        Self { photons: self.photons.seeing(generations), ..self }
    }

    fn photons(&self) -> &PhotonTracer {
        &self.photons
    }
}

impl Integrator for VcmTracer {
    type Scratch = VcmScratch;

    fn trace(&self, index: u64, scratch: &mut VcmScratch, out: &mut impl SampleSink) {
        let VcmScratch { bidirectional, photons } = scratch;
        if !self.bidirectional.context.photons.caustics {
            return self.bidirectional.trace(index, bidirectional, out);
        }
        let sample = index.saturating_mul(CAMERA_SUBPATHS);
        let Some(snapshot) = self.photons.snapshot(sample, photons, &|| out.is_wanted()) else { return };
        faults::sees_generations(snapshot.generations);
        let wavelength = Self::wavelength_number(index, &self.bidirectional.context);
        let mut merge = |sampler: &Sampler, colors: &mut GroupColors| {
            self.photons.merge(&snapshot, photons, sampler, wavelength, colors)
        };
        self.bidirectional.trace_merging(index, bidirectional, Some(&mut merge), out);
        photons.keep(snapshot);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: CAMERA_SUBPATHS, light: LIGHT_SUBPATHS }
    }

    fn with_photons_of(self, first: &Self) -> Self {
        Self { photons: self.photons.with_photons_of(&first.photons), ..self }
    }

    fn wavelength_number(index: u64, context: &RenderContext) -> f32 {
        BidirectionalTracer::wavelength_number(index, context)
    }
}

/// A deterministic tracer, as a check of the plan needs it.
impl From<RenderContext> for VcmTracer {
    fn from(context: RenderContext) -> Self {
        Self::new(context, true)
    }
}
