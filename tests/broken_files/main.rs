//! Broken and hostile scene files. A process of its own, because its allocator counts what the reader holds.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod compressed;
mod corpus;
mod corrupt;
mod gltf;
mod guard;
#[path = "../support/held_memory.rs"]
mod held_memory;
mod images;
mod limits;
mod media;
mod meshes;
#[path = "../support/messages.rs"]
mod messages;
#[path = "../support/models.rs"]
mod models;
mod spectra;
#[path = "../../tools/fuzz_targets/src/targets.rs"]
mod targets;
mod usd;
mod volumes;
