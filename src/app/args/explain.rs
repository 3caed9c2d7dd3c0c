//! Options of `pointillist explain`.

use std::path::PathBuf;

use clap::Args;

use super::display::DisplayArgs;
use super::scene::SceneArgs;

/// Options of `pointillist explain`.
#[derive(Args, Debug)]
pub struct ExplainArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneArgs,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Only say what is on and why; measure nothing.
    #[arg(long)]
    pub no_costs: bool,

    /// Write the plan as JSON, to standard output or to FILE: `--json=FILE`.
    #[arg(long, value_name = "FILE|-", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<PathBuf>,
}
