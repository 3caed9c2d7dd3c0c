//! One-pass photon mapping (paper §3.4; Jensen 1996, *Global Illumination using Photon Maps*; Jensen and Christensen 1998 in media; Knaus and
//! Zwicker 2011).
//!
//! **What counts once.** A scattering is either *spread* (S̄: by a surface with a diffuse part, other than by a delta of
//! its coat, or by a medium) or *mirrored* (S: by a delta, or by a rough metal, a rough interface or a phase function that is a narrow peak,
//! which have no diffuse part). Photons lie, and are gathered, where light can be spread. Written from the eye E to the light L, a path is found
//!
//! | path | by |
//! |---|---|
//! | E S* L | hitting the light, and sampling it from rough mirrors (weighted by the power heuristic) |
//! | E S* S̄ L, and … S̄ L at every later spread | sampling the light and hitting it (weighted likewise) |
//! | … S̄ S⁺ L | photons of the caustic layer: at every spread, the first one included |
//! | E S* S̄ (S* S̄)⁺ … | a ray sampled by the material of the first spread, and photons of the global layer where it ends |
//!
//! So a photon is stored from the second surface of a light path on: in the caustic layer if nothing has spread the light
//! yet, else in the global one. A gather ray that ends nearer than the lookup radius would show the blur of the map
//! where it lies next to what is looked at; such a path goes on as a path (light and caustics are looked up, the next
//! ray gathers). The same vertex is never both: where global photons are taken, the spread path ends, but for the light of media
//! that emit, which no photon carries.
//!
//! **In media** photons lie where light paths are scattered. They are gathered around the flights of a camera path instead of at its vertices
//! (beam radiance estimate, Jarosz et al. 2008): within a fixed radius of the flight up to where it ends. Of the later scatterings of a
//! light path in media only some leave a photon, with more weight. Where few light paths come into media, as into a glass of milk on a large
//! table, no photons lie in them, and they scatter as rough mirrors do.
//!
//! **Bias.** Everything in the first two rows is unbiased. The two others are density estimates: blurred over the lookup
//! disc, or across the beam in a medium, and too dark within a radius of an edge, whose other side holds no photons. The disc's area falls as 1/n with the
//! light paths n of the map, so the bias of a curved or unevenly lit surface as 1/n and that of edges as 1/√n; a
//! picture is the mean over samples that saw growing maps. What a path through a dispersive delta gathers is
//! blurred over wavelengths as well, by a window that falls as n^(−1/3).
//!
//! **Two eyes** see the same photons, as many at an index of both as one eye at an index of its own: from one generation to the next each
//! takes half of the samples. Camera paths share their first vertex by [`pair`](super::pair), and their photons are evaluated for both ([`eyes`]).
//!
//! **Wavelengths.** A photon counts at its own wavelengths ([`photon_map`](crate::tracer::photon_map)): the steps of
//! the camera path are recorded (`camera_path`) and evaluated again for each photon.

mod beams;
mod camera_path;
mod extent;
mod eyes;
mod light_paths;
mod recorded_step;
mod schedule;
mod tracer;

use std::sync::Arc;

use crate::color::Xyz;
use crate::stream::{PathCounts, SampleSink, faults};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, CreditedBsdf, InMedia, Recorded, Scattering, Unmixed};
use crate::tracer::light_groups::{GroupColors, LightCredits};
use crate::tracer::output::send_camera;
use crate::tracer::photon_map::{PhotonMap, Schedule, Snapshot};
use crate::tracer::{MaterialClass, Sampler, TracingMode};

use super::{Integrator, RenderContext};
use beams::FREE_PATHS;
use camera_path::PathStart;
use extent::Extent;
use schedule::schedule;
use tracer::PhotonPaths;
pub use tracer::{PhotonScratch, PhotonTracer, SeesPhotons};

/// Light paths of one generation. They take a few hundredths of a second, so that the first picture is not kept waiting.
const PATHS: u64 = 4096;

/// Samples per generation: four per light path.
pub const SAMPLES_PER_GENERATION: u64 = 16_384;

/// Photons that lie around a flight at the first generation, at least, for photons in media to be of use.
const FEWEST: f32 = 4.0;

/// Photons at which a map stops growing: 1.3 GB, and up to 2.5 times as much in all while its largest trees are merged. From
/// there on noise goes on shrinking and blur does not.
pub(super) const LIMIT: usize = 1 << 25;

/// About the generation of the last photons, where a light path leaves two.
pub const LAST_GENERATION: u64 = LIMIT as u64 / (2 * PATHS);

impl PhotonTracer {
    /// A tracer with an empty map. If `deterministic`, a sample sees exactly the photons that its index demands, whichever worker
    /// traces it and when; otherwise the newest.
    pub fn new(context: RenderContext, deterministic: bool) -> Self {
        Self::with_paths(context, PhotonPaths::Whole, deterministic)
    }

    /// The tracer of the photons of vertex connection and merging.
    pub(super) fn for_merging(context: RenderContext, deterministic: bool) -> Self {
        Self::with_paths(context, PhotonPaths::Specular, deterministic)
    }

    fn with_paths(context: RenderContext, photon_paths: PhotonPaths, deterministic: bool) -> Self {
        let extent = Extent::of(&context);
        let bounds @ [min, max] = extent.bounds;
        let eyes = if context.other_eye.is_some() { 2 } else { 1 };
        let schedule = schedule(&extent, &context.photons, eyes);
        // Where few light paths come into media, camera paths find better what is scattered there.
        let in_media = context.scene.media().is_none_or(|media| {
            let flight = media.free_paths().fold(f32::INFINITY, f32::min).min((max - min).max_element());
            let radius = schedule.beam_radius.min(FREE_PATHS * flight);
            extent.photons_around(flight, radius, PATHS) >= FEWEST
        });
        let photon_paths = match photon_paths {
            PhotonPaths::Whole if !in_media => PhotonPaths::OnSurfaces,
            other => other,
        };
        let map = PhotonMap::new(min, max, schedule.paths_per_generation, LIMIT);
        Self { context, map: Arc::new(map), schedule, bounds, photon_paths, deterministic, generations: None }
    }

    /// Contribution of merging ([`vcm`](super::vcm)) to the camera path with the screen and lens position of `sampler` and the wavelengths of the number
    /// `wavelength`. Its parts by groups of lights are written to `colors`, if there are groups.
    pub(super) fn merge(
        &self,
        snapshot: &Snapshot,
        scratch: &mut PhotonScratch,
        sampler: &Sampler,
        wavelength: f32,
        colors: &mut GroupColors,
    ) -> Xyz {
        let Some((path, ray)) = self.begin(snapshot, sampler, wavelength) else { return Xyz::default() };
        let scene = &self.context.scene;
        match (scene.tracing_mode(), scene.material_class()) {
            (TracingMode::Plain, MaterialClass::Mixed) => path.begin(scratch).merge::<Bsdf>(ray, sampler).0,
            (TracingMode::Plain, MaterialClass::InMedia) => {
                path.begin(scratch).merge::<InMedia>(ray, sampler).0
            }
            (TracingMode::Record, _) => path.begin(scratch).merge::<Recorded>(ray, sampler).0,
            (TracingMode::LightGroups, _) => {
                let (value, credits) = path.begin(scratch).merge::<CreditedBsdf>(ray, sampler);
                *colors = credits.colors();
                value
            }
            _ => path.begin(scratch).merge::<Unmixed>(ray, sampler).0,
        }
    }

    /// A camera path that sees these photons, and its first ray; `None` where the lens shows nothing.
    fn begin<'a>(
        &'a self,
        snapshot: &'a Snapshot,
        sampler: &Sampler,
        wavelength: f32,
    ) -> Option<(PathStart<'a>, Ray)> {
        let numbers = sampler.camera();
        let lookup = self.schedule.lookup(snapshot.generations);
        let ray = self.context.camera.ray(self.context.place(numbers.screen), numbers.lens)?;
        Some((PathStart { tracer: self, snapshot, lookup, wavelength }, ray))
    }

    /// Caustics on the first surface of the camera ray with the screen and lens position of `sampler`, by its photons.
    pub(super) fn seen(
        &self,
        snapshot: &Snapshot,
        scratch: &mut PhotonScratch,
        sampler: &Sampler,
        wavelength: f32,
    ) -> Xyz {
        let Some((path, ray)) = self.begin(snapshot, sampler, wavelength) else { return Xyz::default() };
        match self.context.scene.material_class() {
            MaterialClass::Mixed => path.begin(scratch).seen::<Bsdf>(ray, sampler),
            MaterialClass::InMedia => path.begin(scratch).seen::<InMedia>(ray, sampler),
            _ => path.begin(scratch).seen::<Unmixed>(ray, sampler),
        }
    }

    fn trace_as<B: Scattering>(
        &self,
        index: u64,
        snapshot: &Snapshot,
        scratch: &mut PhotonScratch,
        out: &mut impl SampleSink,
    ) {
        let lookup = self.schedule.lookup(snapshot.generations);
        let start = self.context.screen.start(index);
        let sampler = self.context.sampler(start.index);
        let numbers = sampler.camera();
        let uv = self.context.place(numbers.screen);
        let path = PathStart { tracer: self, snapshot, lookup, wavelength: numbers.wavelength };
        let ray = self.context.camera.ray(uv, numbers.lens);
        if let Some(other) = self.context.partner()
            && let Some(ray) = ray
        {
            return path.trace_pair::<B>(other, uv, ray, &sampler, scratch).send(start.weight, out);
        }
        let (value, credits) = match ray {
            Some(ray) => path.begin(scratch).trace::<B>(ray, &sampler),
            None => Default::default(),
        };
        send_camera(out, self.context.scene.lights(), uv, value, start.weight, &credits);
    }

    /// This tracer with another schedule, and an empty map that stops growing at `limit` photons.
    pub fn with_schedule(self, schedule: Schedule, limit: usize) -> Self {
        let [min, max] = self.bounds;
        let map = PhotonMap::new(min, max, schedule.paths_per_generation, limit);
        Self { schedule, map: Arc::new(map), ..self }
    }

    /// This tracer with the photons of `before` if they would be the same: they do not depend on the camera. A deterministic
    /// picture begins with the first photons, so that it keeps none.
    pub fn after(self, before: &Self) -> Self {
        let of = |t: &Self| {
            let RenderContext { seed, max_depth, rr_depth, photons, .. } = t.context;
            (seed, max_depth, rr_depth, photons, t.deterministic)
        };
        let same = Arc::ptr_eq(&self.context.scene, &before.context.scene) && of(&self) == of(before);
        match same && !self.deterministic && self.schedule == before.schedule {
            true => Self { map: Arc::clone(&before.map), ..self },
            false => self,
        }
    }
}

impl Integrator for PhotonTracer {
    type Scratch = PhotonScratch;

    fn trace(&self, index: u64, scratch: &mut PhotonScratch, out: &mut impl SampleSink) {
        let Some(snapshot) = self.snapshot(index, scratch, &|| out.is_wanted()) else { return };
        faults::sees_generations(snapshot.generations);
        let scene = &self.context.scene;
        match (scene.tracing_mode(), scene.material_class()) {
            (TracingMode::Plain, MaterialClass::Mixed) => {
                self.trace_as::<Bsdf>(index, &snapshot, scratch, out)
            }
            (TracingMode::Plain, MaterialClass::InMedia) => {
                self.trace_as::<InMedia>(index, &snapshot, scratch, out)
            }
            (TracingMode::Record, _) => self.trace_as::<Recorded>(index, &snapshot, scratch, out),
            (TracingMode::LightGroups, _) => self.trace_as::<CreditedBsdf>(index, &snapshot, scratch, out),
            _ => self.trace_as::<Unmixed>(index, &snapshot, scratch, out),
        }
        scratch.keep(snapshot);
    }

    fn with_photons_of(self, first: &Self) -> Self {
        Self { map: Arc::clone(&first.map), ..self }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 0 }
    }
}

impl SeesPhotons for PhotonTracer {
    fn without_photons(context: RenderContext, deterministic: bool) -> Self {
        Self::new(context, deterministic)
    }

    fn seeing(self, generations: u64) -> Self {
        Self { generations: Some(generations), deterministic: true, ..self }
    }

    fn photons(&self) -> &PhotonTracer {
        self
    }
}

/// A deterministic tracer, as a check of the plan needs it.
impl From<RenderContext> for PhotonTracer {
    fn from(context: RenderContext) -> Self {
        Self::new(context, true)
    }
}
