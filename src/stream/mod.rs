//! The contract between tracer and display (paper §3): point samples, sent in blocks over one lane per worker.
//!
//! ```text
//! worker i:  Integrator ─▶ SampleSink = BlockSink (checks, fills a Block) ─▶ LaneWriter ═ lane i ═▶ Lanes ─▶ consumer
//! ```
//!
//! Neither side knows the other. This module knows nothing of scenes, of films or of a GPU, and every producer of samples
//! works with every consumer of them.
//!
//! # Samples
//!
//! A [`Sample`] is `[u, v], [x, y, z, w]`: a screen position, a colour and a weight. Screen position (0, 0) is the top left
//! corner of the picture, (1, 1) the bottom right. Samples may lie outside, in the overscan that feeds the filter at the
//! border. There is no resolution: that is the film's business. The sign of the weight selects one of two streams:
//!
//! - The **camera stream** (`w > 0`): `x, y, z` are the CIE XYZ of radiance times `w`. The picture is `Σ xyz / Σ w`.
//! - The **light stream** (`w = −1`): `x, y, z` are densities over uv, that is, flux per unit of uv². The picture is
//!   `Σ xyz · (pixels per unit of uv²) / (number of light paths)`.
//!
//! [`BlockSink`] rejects samples that break these rules, and counts them by [`Fault`], with the index of the path. A bad contribution that
//! an integrator finds within a path is left out by itself, raised as a fault ([`faults`]) and counted there, too.
//!
//! # Groups of lights
//!
//! A render may tell which part of the picture comes from which group of lights, up to [`MOST_GROUPS`]. Every path is traced once. Its
//! integrator sends each sample together with its parts ([`SampleSink::camera_by_groups`], [`SampleSink::light_of_group`]):
//!
//! - A camera sample has one part for every group, at the same uv and with the same weight, black ones included. So the samples of a group are
//!   those of an ordinary picture, and what is on its film needs nothing from any other: `Σ w` is that of the whole picture.
//! - A light sample comes from one light, so it is sent a second time for the group of that light only.
//! - The parts of a block stand in sections behind the samples of the picture ([`Block::groups`]). [`Block::samples`] are the picture's alone,
//!   bit for bit those of a render without groups. A consumer that asks for no groups (error estimate, noise filter, states, windows
//!   elsewhere) is therefore right as it is, and so are path counts and the order of indices: the header is that of all sections.
//! - The films of the groups take the same counts of paths as that of the picture. Then their sum is the picture within rounding, at any
//!   moment, and each may be scaled and coloured afterwards without tracing anything again.
//!
//! A [`Sample`] does not know its group: it keeps its 24 bytes, and a section can be copied to a device as it is.
//!
//! # Two eyes
//!
//! In a render for two eyes each chunk of indices is of one eye ([`eye`]), and [`Block::samples`] are those of that eye. Where a path is one of the
//! other eye, too, its sample for that eye ([`SampleSink::camera_of_other_eye`]) stands in the first section behind ([`Block::groups`]). Path
//! counts are those of both eyes: each light path lights both pictures.
//!
//! In a render with groups of lights, too, the eyes share no paths: sections are those of groups, for the eye whose chunk it is
//! ([`BlockEyes::Apart`]). Paths are counted for both eyes all the same, so that light samples, half as many of each eye, are twice as large.
//!
//! # Blocks, lanes and epochs
//!
//! - A **block** of up to 1024 samples is the unit of transfer. Its header holds the numbers of paths that normalise its
//!   samples, the contiguous range of path indices they come from, and the number of rejected samples.
//! - A **lane** is a bounded single-producer single-consumer ring of blocks (`ring`), one per worker. One release store
//!   publishes a block, and nothing is allocated or copied. A worker sleeps while its lane is full: no sample is dropped.
//! - An **epoch** numbers the renders. Every edit of the scene starts a new one. Workers load the running epoch between two
//!   paths, and the consumer drops blocks of older epochs, so nobody waits for an abort.
//!
//! # Writing a producer or a consumer
//!
//! A producer takes the [`LaneWriter`]s from [`lanes()`], one per thread, puts a [`BlockSink`] on each, and tells the [`Hub`]
//! when an epoch runs and when it has ended. `server` is the producer of the renderer. A consumer owns the [`Lanes`]: it
//! follows one epoch at a time, in order of arrival or of path index, and drains blocks within a budget of samples.
//!
//! ```
//! use std::time::Duration;
//! use pointillist::color::Xyz;
//! use pointillist::stream::*;
//!
//! let (mut writers, mut lanes) = lanes(1, LANE_BLOCKS);
//! let epoch = Epoch(1);
//! lanes.hub().run(Some(epoch));
//!
//! // The producer: 5000 paths with one sample each.
//! let mut sink = BlockSink::new(writers.remove(0));
//! let producer = std::thread::spawn(move || {
//!     sink.start(epoch, UvWindow::PICTURE);
//!     for index in 0..5000 {
//!         sink.begin_path(index);
//!         sink.camera([index as f32 / 5000.0, 0.5], Xyz::new(0.2, 0.3, 0.4), 1.0);
//!         sink.end_path(PathCounts { camera: 1, light: 0 });
//!     }
//!     sink.flush();
//!     sink.writer().hub().end(epoch);
//! });
//!
//! // The consumer: the mean of all samples.
//! lanes.follow(epoch, DrainOrder::Index { first: 0 });
//! let (mut sum, mut weight) = (Xyz::BLACK, 0.0);
//! while !lanes.is_drained() {
//!     lanes.wait(Duration::from_millis(100));
//!     lanes.drain(16 * BLOCK_SAMPLES, |block| {
//!         for sample in block.samples() {
//!             sum += sample.xyz;
//!             weight += sample.w;
//!         }
//!     });
//! }
//! producer.join().expect("the producer does not panic");
//! assert_eq!(weight, 5000.0);
//! assert!((sum.y / weight - 0.3).abs() < 1e-4);
//! ```

pub mod block;
pub mod block_sink;
pub mod control;
pub mod faults;
pub mod hub;
pub mod lanes;
pub mod rejections;
pub mod replicate;
pub mod ring;
pub mod sample;
pub mod signal;
pub mod sync;
pub mod witnessed;

pub use block::{BLOCK_SAMPLES, Block, BlockEyes, Header, MOST_GROUPS};
pub use block_sink::{BlockSink, Totals};
pub use control::{Epoch, Event, FinishReason};
pub use hub::Hub;
pub use lanes::{DrainOrder, Drained, Fill, LANE_BLOCKS, LaneWriter, Lanes, lanes};
pub use rejections::{Cause, Fault, FaultyValue, Rejected, Rejections};
pub use replicate::{CHUNK, REPLICATES, eye, replicate, replicate_seed, tracer_seed};
pub use sample::{MAX_VALUE, PathCounts, Sample, SampleSink, UvWindow};
pub use witnessed::{Highlight, Witnessed, WitnessedArea};
