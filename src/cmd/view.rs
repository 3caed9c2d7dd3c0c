//! `pointillist view`: a window that shows the scene at once.

use miette::Result;

use crate::cmd::args::ViewArgs;
use crate::viewer;

/// Runs the subcommand.
///
/// # Errors
///
/// Those of the window. A picture that was asked for is written even after an error.
pub fn view(args: ViewArgs) -> Result<()> {
    viewer::view(&args.into())
}
