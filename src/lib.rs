//! Pointillist: an interactive global-illumination renderer in two halves.
//!
//! It implements the system of Radziszewski, Alda and Boryczko, *Interactive Ray Tracing Client* (WSCG 2010), and keeps its words. A
//! **server** traces paths on every core and never stops producing point samples `[u, v], [x, y, z, w]`. A **client** splats them into
//! floating-point images, blurs by sample count and variance, and shows the best picture it can. Data goes one way:
//!
//! ```text
//! scenes/*.xml ─ scene::mitsuba ─▶ SceneDesc ─ tracer::Scene::prepare ─▶ Scene (immutable)
//!   server: workers claim index ranges of one sequence over the whole screen
//!     index ─ Sampler ─▶ wavelengths, ray ─ Integrator ─▶ SampledSpectrum ─ CIE 1931 ─▶ Xyz
//!     ─▶ SampleSink ─▶ Block ─▶ lane ════════ the contract: module stream ════════
//!   client: lanes.drain ─▶ splat ─▶ fold ─▶ variance ─▶ mips ─▶ reconstruct ─▶ glare ─▶ post-processes
//!     ─▶ tonemap ─▶ PNG, EXR, or with the panel over it the swapchain: viewer runs this as a loop, once a frame
//! ```
//!
//! # A sample from the integrator to the screen
//!
//! 1. `server/worker.rs` claims a chunk of indices and calls [`Integrator::trace`](tracer::Integrator::trace) for each.
//! 2. The integrator hands its samples to a [`BlockSink`](stream::BlockSink), which fills a block; `LaneWriter::send` swaps
//!    it into the lane of the worker.
//! 3. The lanes are drained ([`stream::Lanes::drain`]) by `render/drive.rs` for a render and by `viewer/picture/feed.rs` for the window, both
//!    through `render/film_writer.rs`, which counts paths, adds the samples to the film and copies them to the accounts
//!    (`accounting`), from which the stated error, the noise filter and the predictions read. The window also keeps
//!    them ([`client::retained`]), to fill a film of another size.
//! 4. The film ([`client::film::VulkanFilm`], or without Vulkan its [`client::reference`], which also makes the sums where the Vulkan device
//!    is a CPU, see `client/raster.rs`) splats a full batch, or before a repaint what there is of one: there samples become texels
//!    (`client/pass/splat.rs`, `client/reference/splat.rs`). It folds the batch into its sums and updates the variance.
//! 5. A repaint (`client/pass/repaint.rs`) builds mips, reconstructs, adds glare, runs the post-processes and tone-maps.
//! 6. `viewer/screen.rs` copies the picture to the swapchain and draws the panel over it; without a window it is read back and written.
//!
//! A tracer may be on another machine: then [`remote`] stands where the lanes do, and its blocks come over the network.
//!
//! # Where to begin
//!
//! [`tracer`] for light transport, [`stream`] for the contract, [`client`] for the display, [`study`] for the error and its interval, [`cmd`] for the
//! program, with an example that loads a scene, renders it and reads the error.
//!
//! Imports go downwards only; `tests/architecture.rs` holds the table and fails with file and line.

mod accounting;
pub mod client;
pub mod cmd;
pub mod color;
mod denoise;
pub mod gpu;
pub mod image;
mod job;
pub mod math;
mod memory;
pub mod regress;
pub mod remote;
mod render;
pub mod scene;
pub mod server;
pub mod spectrum;
pub mod stream;
pub mod study;
pub mod tracer;
mod viewer;
