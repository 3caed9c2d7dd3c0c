//! Scene files: reading, editing, saving, instances, and messages with a place.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod edit;
mod editable;
mod instances;
mod load;
mod rough;
mod save;
mod sky;
mod xml;
