//! Samples from tracers on other machines: the protocol, and both ends of it. Neither knows what is traced.
//!
//! ```text
//! tracer:  Host, Tracing ─ Service ─ lanes ─▶ blocks ─▶ frames ═ TCP ═▶ RemoteTracers ─▶ lanes ─▶ the viewer
//!                             ◀─ render, abort, credit ═════════════════ (epochs as in one process)
//! ```
//!
//! The viewer asks and the tracer answers ([`message`]). A render is a [`Request`]: an epoch, a seed that no other tracer
//! of the picture has, and an order in the words of the program. Samples come in [`blocks`], as many bytes as the viewer has given credit
//! for (`window`); where that is less than what is traced, as film deltas (`delta`). A [`link`] is plain where both are on one machine, or encrypted with a token. [`fetch()`] brings the scene to a viewer
//! that has no copy of it. `tools/farm/README.md` describes the protocol for those who write another end.

pub mod blocks;
mod delta;
pub mod fetch;
pub mod link;
pub mod message;
pub mod service;
pub mod tracers;
mod window;

pub use fetch::{FetchError, FetchOptions, Fetched, fetch};
pub use link::Token;
pub use message::{Request, Welcome};
pub use service::{Host, ListenError, Service, Tracing, is_loopback, listen};
pub use tracers::{Health, RemoteRender, RemoteTracers, TracerAddress, TracerStatus};
