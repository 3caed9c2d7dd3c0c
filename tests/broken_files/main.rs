//! Broken and hostile scene files. A process of its own, because its allocator counts what the reader holds.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod corrupt;
mod gltf;
mod guard;
mod images;
mod limits;
mod meshes;
#[path = "../support/models.rs"]
mod models;
mod spectra;
