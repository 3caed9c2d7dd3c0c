//! Integrators: each turns one point of the sample sequence into samples on the stream.
//!
//! ```text
//! context          scene, view and settings; connection of light path vertices to the camera
//! direct_lighting  next-event estimation and emission with MIS; PathState, what a camera path carries
//! lit_flight       point lights that camera paths sample from along their flights in media
//! delta_chains     lights seen over mirrors and through glass, along chains of deltas that a camera path does not sample
//! path             path tracing
//! pair             camera paths of two eyes that share their first vertex; `stereo` has an integrator for each eye
//! particle         particle tracing, from the lights
//! bidirectional    subpaths from both ends, connected
//! photon           photon mapping
//! vcm              bidirectional path tracing, and photons for what it cannot connect; `prefix` tells the two apart
//! caustic_witness  the same with few paths, for the error of other methods
//! depth            distances, without light
//! visitor          the integrator of a method that is known at run time only
//! check            `--check-plan`: the plan of effects is compared with the code for everything
//! ```
//!
//! # Which integrator for what
//!
//! | method | finds paths | is for | is not for |
//! |---|---|---|---|
//! | `path` ([`PathTracer`]) | from the camera, with a light sampled at each vertex | lamps that shine on what is seen; rough metal; the evenest first picture | light around corners; caustics of small lamps |
//! | `light` ([`ParticleTracer`]) | from the lamps, each vertex connected to the camera | rooms lit from a cove; caustics on diffuse surfaces | what is seen in or through mirrors, glass and smooth plastic: it stays black |
//! | `bidirectional` ([`BidirectionalTracer`]) | from both ends, the pairs of largest importance connected | caustics and mirrors together; half-hidden lamps | what camera paths find anyway: an index costs several times a camera path |
//! | `photon` ([`PhotonTracer`]) | camera paths gather what light paths left behind | caustics seen in mirrors and through glass, of lamps that nothing can hit | an exact picture soon: it begins too smooth, and its blur shrinks with the number of samples |
//! | `vcm` ([`VcmTracer`]) | as `bidirectional`, and by photons what no connection finds | the same, where caustics are seen in mirrors and through glass | an exact picture of these caustics: they are biased as those of `photon` |
//! | `depth` ([`DepthTracer`]) | the first surface only | a picture of distances | light |
//! | `auto` ([`choice`](crate::tracer::choice)) | by one of these, and says why | when you do not know | |
//!
//! `path` and `bidirectional` are unbiased. `light` is, except for what it cannot find: a delta that the camera sees. `photon` is
//! biased by density estimation, in media as well, and so are the caustics that `vcm` sees in mirrors and through glass; `photon/mod.rs` says how
//! this bias falls with the number of photons.
//!
//! # Adding an integrator
//!
//! 1. A file here with a struct that holds a [`RenderContext`] and implements [`Integrator`]. `particle.rs` is the shortest.
//!    Camera paths build on `direct_lighting::PathState`, light paths and connections on
//!    [`Subpath`](crate::tracer::subpath::Subpath); both take their steps by [`Walk`](crate::tracer::walk::Walk).
//!    Random numbers come only from the [`Sampler`](crate::tracer::Sampler) of the index, so that a path is a pure function.
//! 2. `impl From<RenderContext>`. One that sees photons implements [`SeesPhotons`], too, and is started by `render/method.rs`.
//! 3. A variant of [`IntegratorKind`](crate::scene::desc::IntegratorKind), which is the help of `--integrator`, and in the same file its
//!    [traits](crate::scene::desc::IntegratorTraits): its names, its paths per index, what it finds and what it cannot do. The command line,
//!    the reader of scene files, the window and the study ask these. One line in `visitor.rs` names its type.
//! 4. A row in the table above; `Method` in `tests/support/agreement.rs`, by which `tests/agreement` asks all integrators to agree on every
//!    scene; and a line in `tests/tracer/effects_check.rs`.

mod bidirectional;
mod caustic_witness;
mod check;
mod context;
mod delta_chains;
mod depth;
mod direct_lighting;
mod lit_flight;
mod pair;
mod particle;
mod path;
mod photon;
mod prefix;
mod stereo;
mod vcm;
mod visitor;

pub use bidirectional::{BidirectionalTracer, CAMERA_SUBPATHS, LIGHT_SUBPATHS};
pub use caustic_witness::{CausticWitness, SeenCaustic, WitnessScratch};
pub use check::{CheckedIntegrator, PlanCheckTally};
pub use context::RenderContext;
pub use depth::DepthTracer;
pub use particle::ParticleTracer;
pub use path::PathTracer;
pub use photon::{LAST_GENERATION, PhotonScratch, PhotonTracer, SAMPLES_PER_GENERATION, SeesPhotons};
pub use stereo::Stereo;
pub use vcm::{VcmScratch, VcmTracer};
pub use visitor::{IntegratorVisitor, visit};

use crate::stream::{PathCounts, REPLICATES, SampleSink, replicate};

/// Turns one point of the sample sequence into samples on the stream.
///
/// An integrator owns (or shares by `Arc`) the prepared scene, its settings, the seed and the [`UvWindow`] to cover, so that a
/// path is a pure function of `(self, index)`.
///
/// ```
/// use pointillist::color::Xyz;
/// use pointillist::scene;
/// use pointillist::stream::{SampleSink, UvWindow};
/// use pointillist::tracer::integrator::RenderContext;
/// use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};
///
/// /// Collects the samples of the camera stream.
/// #[derive(Default)]
/// struct Samples(Vec<([f32; 2], Xyz)>);
///
/// impl SampleSink for Samples {
///     fn camera(&mut self, uv: [f32; 2], value: Xyz, _weight: f32) {
///         self.0.push((uv, value));
///     }
///
///     fn light(&mut self, _uv: [f32; 2], _value: Xyz) {}
/// }
///
/// let desc = scene::load("scenes/cornell.xml".as_ref(), &[])?.desc;
/// let (scene, camera) = (Scene::prepare(&desc)?.into(), Camera::of(&desc)?);
/// let context = RenderContext::new(scene, camera, &desc.integrator, 0, UvWindow::PICTURE);
/// let tracer = PathTracer { context };
/// let mut samples = Samples::default();
/// for index in 0..64 {
///     tracer.trace(index, &mut (), &mut samples);
/// }
/// assert_eq!(samples.0.len(), 64);
/// assert!(samples.0.iter().any(|(_, value)| value.y > 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// [`UvWindow`]: crate::stream::UvWindow
pub trait Integrator: Send + Sync + 'static {
    /// Memory that one worker reuses from path to path of one integrator. It may cache data shared by several paths, so each integrator has its own.
    type Scratch: Default + Send;

    /// Traces path number `index`. Exactly one call per index; every sample goes to `out`.
    fn trace(&self, index: u64, scratch: &mut Self::Scratch, out: &mut impl SampleSink);

    /// This integrator of one of two eyes with the photons of `first`, that of the other eye, so that they are traced once. Most have none.
    fn with_photons_of(self, _first: &Self) -> Self
    where
        Self: Sized,
    {
        self
    }

    /// Paths started by one call of [`Integrator::trace`]: `{camera: 1, light: 0}` for path tracing.
    fn paths_per_index(&self) -> PathCounts;

    /// The number that chooses the wavelengths of path `index` of an integrator of this context.
    fn wavelength_number(index: u64, context: &RenderContext) -> f32 {
        context.sampler(index).camera().wavelength
    }
}

/// A render divided into independent randomisations, whose differences give the error of their mean: one integrator for all
/// indices, or one for each replicate, which take turns chunk by chunk
/// ([`replicate`](crate::stream::replicate())). Each replicate has a photon map of its own. Where they
/// are not through a round of all pixels they have visited different ones ([`cells`](crate::tracer::sampler::cells)).
#[derive(Clone, Debug)]
pub struct Replicated<I> {
    /// The integrators, one per replicate.
    pub parts: Vec<I>,
}

impl<I> Replicated<I> {
    /// Integrators that `make` makes of `context` with the seed of each replicate, or of `context` alone unless `divided`.
    pub fn new(context: &RenderContext, divided: bool, make: impl FnMut(RenderContext) -> I) -> Self {
        let count = if divided { REPLICATES } else { 1 };
        Self { parts: (0..count).map(|r| context.of_replicate(r)).map(make).collect() }
    }
}

impl<I: Integrator> Integrator for Replicated<I> {
    type Scratch = [I::Scratch; REPLICATES];

    #[inline]
    fn trace(&self, index: u64, scratch: &mut Self::Scratch, out: &mut impl SampleSink) {
        let (r, own) = if self.parts.len() > 1 { replicate(index) } else { (0, index) };
        self.parts[r].trace(own, &mut scratch[r], out);
    }

    fn paths_per_index(&self) -> PathCounts {
        self.parts[0].paths_per_index()
    }
}
