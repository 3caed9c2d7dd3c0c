//! Scenes: their descriptions as plain data, the formats that they are read from, and changes to them.
//!
//! ```text
//! load ─▶ edit ─▶ mitsuba ─▶ model ─▶ mesh ─▶ desc        each imports only what stands to its right
//! ```
//!
//! [`load`] reads Mitsuba 3 XML and everything it names (includes, meshes, spectra) into a
//! [`SceneDesc`]. Three rules hold here:
//!
//! - **Nothing is ignored in silence.** What the reader does not know is an error or a
//!   [`SceneWarning`], both with file, line, column and the source line under a caret.
//! - **No input may hurt.** Sizes, depths and counts are bounded by [`limits`]; numbers are finite
//!   or refused; no file can make the reader panic or hang (`tests/broken_files/corrupt.rs`).
//! - **One plugin, one function, one line.** Each group of plugins has its file or folder in [`mitsuba`] with a
//!   table of names at its top.
//!
//! A model without a scene file becomes the text of a scene first ([`model`]).
//!
//! This module knows nothing of rendering.

pub mod desc;
mod diagnostic;
pub mod edit;
mod files;
mod leftovers;
pub mod light_groups;
pub mod limits;
mod load;
pub mod mesh;
pub mod mitsuba;
pub mod model;
pub(crate) mod suggest;

pub use desc::SceneDesc;
pub use diagnostic::{FindingKind, SceneError, SceneWarning};
pub use files::LoadProgress;
pub use load::{
    Loaded, load, load_previewing, load_str, load_str_with, load_str_with_files, load_telling, load_with,
};
pub use mitsuba::{LoadOptions, UNSUPPORTED};
