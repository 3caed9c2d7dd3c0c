//! Pointillist: an interactive global-illumination renderer in two halves.
//!
//! The words are those of Radziszewski, Alda and Boryczko, *Interactive Ray Tracing Client*. A
//! **server** traces paths on every core and never stops producing point samples `[u, v], [x, y, z, w]`.
//! A **client** splats them into float images, blurs by sample count and variance, and shows the best
//! picture it can. Data goes one way:
//!
//! ```text
//! scenes/*.xml ─ scene::mitsuba ─▶ SceneDesc ─ tracer::Scene::prepare ─▶ Scene (immutable)
//!   server: workers claim index ranges of one sequence over the whole screen
//!     index ─ Sampler ─▶ wavelengths, ray ─ Integrator ─▶ SampledSpectrum ─ CIE 1931 ─▶ Xyz
//!     ─▶ SampleSink ─▶ Block ─▶ lane ════════ the contract: module stream ════════
//!   client: lanes.drain ─▶ splat ─▶ fold ─▶ variance ─▶ mips ─▶ reconstruct ─▶ glare ─▶ tonemap
//!     ─▶ PNG, EXR, or with the panel over it the swapchain: app::view runs this as a loop, once a frame
//! ```
//!
//! Imports go downwards only; `tests/architecture.rs` holds the table and fails with file and line.

pub mod app;
pub mod client;
pub mod color;
pub mod gpu;
pub mod image;
pub mod math;
pub mod scene;
pub mod server;
pub mod spectrum;
pub mod stream;
pub mod study;
pub mod tracer;
