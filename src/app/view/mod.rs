//! `pointillist view`: the window.

use miette::Result;

use super::args::ViewArgs;

/// Runs the subcommand.
///
/// # Errors
///
/// Whatever stops the viewer.
pub fn view(args: &ViewArgs) -> Result<()> {
    let _ = args;
    Err(miette::miette!("no window yet"))
}
