//! `pointillist render`: a picture without a window.

use miette::Result;

use crate::cmd::args::RenderArgs;
use crate::render::batch;

/// Runs the subcommand.
///
/// # Errors
///
/// Those of the render.
pub fn render(args: RenderArgs) -> Result<()> {
    batch::render(args.into())
}
