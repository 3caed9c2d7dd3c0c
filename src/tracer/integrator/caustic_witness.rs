//! The paths of a witness ([`Witness`](crate::tracer::witness::Witness)): those of bidirectional path tracing with merging. The caustics that photons
//! show are reported separately from all other light.

use crate::color::Xyz;
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::light_groups::GroupColors;
use crate::tracer::photon_map::Schedule;
use crate::tracer::{MaterialClass, Sampler};

use super::bidirectional::{CAMERA_SUBPATHS, LIGHT_SUBPATHS, Scratch};
use super::{BidirectionalTracer, Integrator, PhotonScratch, PhotonTracer, RenderContext};

/// Light paths of a generation of photons, and camera paths from one to the next: a witness has few of either.
const GENERATION: u64 = 1024;

/// Radius of the first discs over that of photon mapping. It may be small, since means over areas of the picture take the noise away, and what is
/// blurred would be missing elsewhere.
const RADIUS: f32 = 0.25;

/// Traces the paths of a witness.
#[derive(Clone, Debug)]
pub struct CausticWitness {
    bidirectional: BidirectionalTracer,
    /// `None` where nothing makes caustics.
    photons: Option<PhotonTracer>,
    /// Caustics that are seen directly are told apart too.
    all: bool,
}

/// Memory that is reused from path to path.
#[derive(Debug, Default)]
pub struct WitnessScratch {
    bidirectional: Scratch,
    photons: PhotonScratch,
    /// Caustics at the samples of this path.
    pub caustics: Vec<SeenCaustic>,
}

/// A caustic at a camera sample.
#[derive(Clone, Copy, Debug)]
pub struct SeenCaustic {
    /// Its place on the screen.
    pub uv: [f32; 2],
    /// How bright it is there.
    pub color: Xyz,
    /// The effective number of photons that show it.
    pub photons: f32,
}

impl CausticWitness {
    /// Paths over the picture of `context`. The caustics behind mirrors and glass are told apart, or `all`.
    pub fn new(context: &RenderContext, all: bool) -> Self {
        let makes_caustics =
            context.photons.caustics && context.scene.material_class() != MaterialClass::Diffuse;
        let photons = makes_caustics.then(|| {
            let tracer = PhotonTracer::for_merging(context.clone(), true);
            let (paths_per_generation, samples_per_generation) = (GENERATION, GENERATION);
            let [radius, beam_radius] =
                [tracer.schedule.radius, tracer.schedule.beam_radius].map(|radius| RADIUS * radius);
            let schedule = Schedule {
                paths_per_generation,
                samples_per_generation,
                radius,
                beam_radius,
                ..tracer.schedule
            };
            tracer.with_schedule(schedule, super::photon::LIMIT)
        });
        Self { bidirectional: BidirectionalTracer { context: context.clone() }, photons, all }
    }

    /// Traces path number `index`: its samples go to `out`, and the caustics at them to `scratch`.
    pub fn trace(&self, index: u64, scratch: &mut WitnessScratch, out: &mut impl SampleSink) {
        let WitnessScratch { bidirectional, photons, caustics } = scratch;
        let context = &self.bidirectional.context;
        let first = index.saturating_mul(CAMERA_SUBPATHS);
        let snapshot = self.photons.as_ref().and_then(|tracer| tracer.snapshot(first, photons, &|| true));
        let Some((tracer, snapshot)) = self.photons.as_ref().zip(snapshot) else {
            return self.bidirectional.trace(index, bidirectional, out);
        };
        let wavelength = BidirectionalTracer::wavelength_number(index, context);
        let place = |sampler: &Sampler| context.place(sampler.camera().screen).map(|c| c as f32);
        let mut keep = |sampler: &Sampler, color: Xyz, photons: f32| {
            if color.y > 0.0 && color.is_finite() {
                caustics.push(SeenCaustic { uv: place(sampler), color, photons });
            }
        };
        let mut merge = |sampler: &Sampler, colors: &mut GroupColors| {
            let merged = tracer.merge(&snapshot, photons, sampler, wavelength, colors);
            keep(sampler, merged, photons.gathered);
            merged
        };
        self.bidirectional.trace_merging(index, bidirectional, Some(&mut merge), out);
        if self.all {
            for number in 0..CAMERA_SUBPATHS {
                let start = context.screen.start(first.wrapping_add(number));
                let sampler = context.sampler(start.index);
                let seen = tracer.seen(&snapshot, photons, &sampler, wavelength);
                keep(&sampler, seen, photons.gathered);
            }
        }
        photons.keep(snapshot);
    }

    /// Paths started by one call of [`trace`](Self::trace).
    pub fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: CAMERA_SUBPATHS, light: LIGHT_SUBPATHS }
    }
}
