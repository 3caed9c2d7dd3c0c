//! Scene files: reading, editing, saving, instances, and messages with a place.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod aov;
mod attributes;
mod bsdfs;
mod bumps;
mod cameras;
mod edit;
mod editable;
mod emitters;
mod foreign;
mod gltf;
mod gltf_compressed;
mod gltf_materials;
mod gltf_words;
mod instances;
mod load;
mod media;
mod media_edits;
mod media_light;
mod mixed;
mod models;
mod moved;
mod mtl_materials;
mod obj_models;
mod old_bsdfs;
mod rough;
mod save;
mod shapes;
mod sky;
mod spectra;
mod subsurface;
mod usd;
mod usd_files;
mod usd_lights;
mod usd_materials;
mod usd_words;
mod versions;
mod volumes;
mod xml;
