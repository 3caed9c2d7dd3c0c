//! Path tracing from the camera with next-event estimation.
//!
//! ```text
//! tracer     one path: hits, materials, lights; splits once
//! splitting  into how many branches, and how long they live
//! carried    what a path (or branch) carries from vertex to vertex, and what it has found
//! ```

mod carried;
mod splitting;
mod tracer;

pub use tracer::PathTracer;
