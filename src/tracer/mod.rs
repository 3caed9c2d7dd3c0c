//! The tracer: one path at a time, a pure function of (scene, integrator, seed, index).
//!
//! It knows no thread, no clock and no file, and of the resolution only this: the division of the screen into cells of about a pixel
//! decides which random numbers a camera path has ([`sampler::cells`]).
//!
//! # Reading path
//!
//! ```text
//! SceneDesc ─ effects::planned ─ prepare ─▶ Scene { accel, surfaces, materials, lights }   immutable, shared by Arc
//! Integrator::trace(index)
//!   RenderContext::sampler(index) ─▶ the random numbers of the path
//!   Camera::ray ─ Scene::closest ─▶ SurfaceInteraction ─ Scene::surface_material ─▶ SurfaceMaterial ─▶ SurfaceVertex { hit, bsdf, … }
//!   Lights::sample_by_contribution ─ Bsdf::eval ─ Scene::visible                         next-event estimation
//!   Walk::sample, scatter, survive ─▶ the next ray
//!   SampledSpectrum ─ to_xyz ─▶ SampleSink::camera or SampleSink::light
//! ```
//!
//! - **Next-event estimation** is `sample_direct` in `integrator/direct_lighting.rs`, for all integrators except particle tracing. The
//!   MIS weight of path tracing and photon mapping is in its `PathState::unoccluded_contribution`; that of the bidirectional method
//!   is in `bidirectional/strategies.rs`.
//! - **A sample** leaves the tracer through `output`, which gives it to a [`SampleSink`](crate::stream::SampleSink): in the
//!   renderer [`BlockSink`](crate::stream::BlockSink), which fills blocks for the lane of its worker. From there the client draws
//!   it into the film.
//! - **A bsdf** is one file in `bsdf/` and one line in its table; [`bsdf`] says how to add one.
//! - **A light** is one file in `light/` and one line in its table; [`light`] says how to add one.
//! - **Whether dispersion is simulated**, or any other effect, is decided by [`effects::decide`] whenever a scene is prepared or edited; the entry
//!   of the effect (`effects/materials.rs`) says what calls for it. [`effects::planned`] takes the rest out of the scene. While paths are
//!   traced, `Bsdf::is_dispersive` tells whether a material disperses light.
//! - **A step from vertex to vertex** (BSDF sample, throughput, dispersion, Russian roulette) is [`walk`], for all integrators.
//! - **Which light** a contribution comes from, for pictures of groups of lights: [`light_groups`].
//! - **Dispersion** within a path of four wavelengths, and its MIS weight: [`wavelength_mis`].
//! - **Participating media**: [`medium`]. A vertex in a medium is a vertex whose bsdf is a phase function.
//! - **MIS weights**: [`mis`] for two strategies, [`subpath_mis`] for all strategies of the bidirectional method.
//! - **Opacity**, masks and surfaces that are not there: `opacity` passes rays through them before paths know of a hit.
//! - **A value that is not finite** is left out where it is found, and raised as a fault ([`stream::faults`](crate::stream::faults)); [`record`]
//!   lists the events of a path, for `pointillist replay` and for audits.
//! - **Lights seen in mirrors and through glass** are found also along the chains of deltas that a path does not sample: [`specular_chain`].
//! - **Where camera paths begin** on the screen, evenly or where the picture needs them: [`screen`].
//! - **Light that a method may not find** is estimated by other methods: [`witness`]; small lights in mirrors and glass: `highlights`.
//! - **Which integrator** suits a scene: [`choice`]; what each is for: [`integrator`].

pub mod accel;
pub mod aov;
pub mod bounding_sphere;
pub mod bsdf;
pub mod camera;
pub mod choice;
pub mod curve;
pub mod effects;
mod faces;
pub mod features;
mod highlights;
pub mod integrator;
pub mod interaction;
pub mod light;
pub mod light_groups;
pub mod medium;
pub mod mis;
mod opacity;
mod output;
pub mod photon_map;
mod pick;
mod placement;
mod prepare;
mod primitives;
pub mod record;
pub mod roulette;
pub mod sampler;
pub mod scene;
pub mod screen;
pub mod shape;
pub mod specular_chain;
pub mod subpath;
pub mod subpath_mis;
mod tangents;
mod texture_coordinates;
pub mod vertex;
pub mod walk;
pub mod wavelength_mis;
pub mod witness;

pub use camera::Camera;
pub use integrator::{Integrator, PathTracer};
pub use interaction::SurfaceInteraction;
pub use pick::{MediumPick, Pick};
pub use prepare::{PrepareError, PrepareOptions};
pub use sampler::Sampler;
pub use scene::{MaterialClass, Scene, SurfaceMaterial, TracingMode};
