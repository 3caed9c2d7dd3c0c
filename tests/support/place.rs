//! Where the files are that tests read, and the program that they start.

use std::path::PathBuf;

/// The folder of the repository: where cargo says it is while tests run, else where it was when they were compiled. Compiled tests that are
/// carried to another machine (`tools/gpu`) are told so by the environment.
pub fn root() -> PathBuf {
    told("CARGO_MANIFEST_DIR", env!("CARGO_MANIFEST_DIR"))
}

/// What the environment says, or else what was known at compile time.
pub fn told(variable: &str, compiled: &str) -> PathBuf {
    std::env::var_os(variable).map_or_else(|| compiled.into(), PathBuf::from)
}
