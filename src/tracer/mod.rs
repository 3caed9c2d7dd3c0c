//! The tracer: one path at a time, a pure function of (scene, integrator, seed, index).
//!
//! Knows no thread, no clock, no file and no resolution.
//!
//! ```text
//! SceneDesc ─ prepare ─▶ Scene { accel, shapes, materials, lights }   immutable, shared by Arc
//! CameraDesc, FilmDesc ──▶ Camera                                      small, the integrator's own
//!   integrator::path: Sampler → Camera::ray → Scene::closest → SurfaceInteraction
//!     Material at the wavelengths of the path → Bsdf: eval, pdf, sample
//!     Lights: sample, pdf → Scene::visible → mis
//!   integrator::{particle, bidirectional}: Sampler::light → Lights::emit → subpath::Walk → Vertex, its densities in chain
//!     Vertex → Camera::view → light stream; Vertex ↔ Vertex → camera stream
//!   choice: which of these suits a scene, from a few thousand paths of each
//!   effects: what a scene calls for, and why
//! ```
//!
//! A material is one file in `bsdf/` and one line in each of its enums; so is a light in `light/`, a shape in `shape/`.

pub mod accel;
pub mod bsdf;
pub mod camera;
pub mod chain;
pub mod choice;
pub mod effects;

pub mod integrator;
pub mod interaction;
pub mod light;
pub mod material;
pub mod mis;
pub mod photon_map;
mod placement;
mod prepare;
mod primitives;
mod roulette;
pub mod sampler;
pub mod scene;
pub mod shape;
pub mod subpath;
mod tangents;
pub mod wavelength_mis;

pub use camera::Camera;
pub use integrator::{Integrator, PathTracer};
pub use interaction::SurfaceInteraction;
pub use prepare::{PrepareError, PrepareOptions};
pub use sampler::Sampler;
pub use scene::{MaterialClass, Pick, Scene};
