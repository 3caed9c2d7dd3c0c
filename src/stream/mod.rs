//! THE CONTRACT between server and client (paper §3): samples, blocks, lanes, epochs.
//!
//! ```text
//! worker i:  Integrator ─▶ BlockSink (checks, fills a Block) ─▶ LaneWriter ═ ring ═▶ Lanes::drain ─▶ client
//! ```
//!
//! - A **block** of up to 1024 samples is the unit of transfer; its header carries the path counts that normalise its
//!   samples, the contiguous range of indices that made them, and what was rejected.
//! - One **lane** per worker (`ring`: one producer, one consumer). A full lane puts its worker to sleep: no sample is
//!   dropped. [`Lanes`] is the client's end of all of them, drained in any order or in order of index.
//! - An **epoch** marks every block; blocks of older epochs are dropped on arrival, so an edit waits for nobody.

pub mod block;
pub mod block_sink;
pub mod control;
pub mod hub;
pub mod lanes;
pub mod rejections;
pub mod replicate;
pub mod ring;
pub mod sample;
pub mod signal;
pub mod sink;
pub mod sync;

pub use block::{BLOCK_SAMPLES, Block, Header};
pub use block_sink::{BlockSink, Totals};
pub use control::{Command, Epoch, Event, FinishReason};
pub use hub::{Hub, RunningEpoch};
pub use lanes::{DrainOrder, Drained, Fill, LANE_BLOCKS, LaneWriter, Lanes, lanes};
pub use rejections::{Cause, Rejections};
pub use replicate::{CHUNK, REPLICATES, replicate, replicate_seed};
pub use sample::{MAX_VALUE, Sample};
pub use sink::{PathCounts, SampleSink, UvWindow};
