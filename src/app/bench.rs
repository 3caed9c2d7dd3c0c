//! `pointillist bench`: the time of every pass.

use miette::Result;

use super::args::BenchArgs;

/// Runs the subcommand.
///
/// # Errors
///
/// Whatever stops the run.
pub fn bench(args: &BenchArgs) -> Result<()> {
    let _ = args;
    Err(miette::miette!("no bench yet"))
}
