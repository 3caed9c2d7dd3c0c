//! The server (paper §4.1): threads that trace without pause and obey three commands.
//!
//! ```text
//! Server::start(threads) ─▶ Server (commands, events, statistics) and Lanes (the samples, for the consumer)
//!   render ─▶ one broadcast to the threads of a rayon pool ─▶ finish event when the last worker is done
//!   worker i: claim a chunk of 1024 indices ─▶ trace ─▶ block ─▶ lane i
//! ```
//!
//! - *render* and *abort* take effect at once, because workers load one atomic epoch between two paths.
//! - The *finish* event is asynchronous. Draining the lanes is the paper's synchronous query.
//! - A path that panics ends its render with an event that names the path's index. The threads live on.
//!
//! `handle` is the interface. `job` describes a render and hands out chunks of its indices. `render` runs one
//! on all threads and reports its end, and `worker` is the loop of a thread. `stats`, `cost` and `spans` measure.
//!
//! # Writing another producer
//!
//! Whatever makes samples needs no server: [`stream`](crate::stream) describes how a producer fills the lanes. To trace with
//! another algorithm, implement [`Integrator`](crate::tracer::Integrator) and hand it to [`Server::render`], as this example does:
//!
//! ```
//! # use std::{sync::Arc, time::Duration};
//! # use pointillist::{color::Xyz, server::*, stream::*, tracer::Integrator};
//! # struct White;
//! # impl Integrator for White {
//! #     type Scratch = ();
//! #     fn trace(&self, _: u64, _: &mut (), out: &mut impl SampleSink) {
//! #         out.camera([0.5; 2], Xyz::new(1.0, 1.0, 1.0), 1.0);
//! #     }
//! #     fn paths_per_index(&self) -> PathCounts { PathCounts { camera: 1, light: 0 } }
//! # }
//! let (server, mut lanes) = Server::start(2)?;
//! let epoch = Epoch(1);
//! server.render(RenderJob::new(Arc::new(White), 0..5000), epoch)?;
//! lanes.follow(epoch, DrainOrder::Arrival);
//! let mut samples = 0;
//! while !lanes.is_drained() {
//!     lanes.wait(Duration::from_millis(100));
//!     lanes.drain(64 * 1024, |block| samples += block.samples().len());
//! }
//! let Some(Event::Finished { reason, .. }) = server.event() else { unreachable!("the render has ended") };
//! assert_eq!((reason, samples), (FinishReason::Complete, 5000));
//! # Ok::<(), ServerError>(())
//! ```

pub mod cost;
pub mod handle;
pub mod job;
mod render;
pub mod spans;
pub mod stats;
mod worker;

pub use crate::job::Priority;
pub use cost::{COST_CELLS, CostMap};
pub use handle::{Server, ServerError};
pub use job::{CHUNK, DEADLINE, RenderJob};
pub use spans::{ChunkSpan, Spans};
pub use stats::{Stats, WorkerStats, thread_cpu_time};
