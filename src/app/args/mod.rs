//! The command line, turned into plain option structs: one file per subcommand, and the groups that they share.

pub mod bench;
pub mod compare;
pub mod display;
pub mod effects;
pub mod explain;
pub mod render;
pub mod scene;
pub mod study;
mod values;
pub mod view;

pub use bench::BenchArgs;
pub use compare::CompareArgs;
pub use explain::ExplainArgs;
pub use render::RenderArgs;
pub use study::StudyArgs;
pub use view::ViewArgs;

use clap::{Parser, Subcommand};

/// Interactive global illumination: point samples become the best picture possible, at once.
#[derive(Parser, Debug)]
#[command(name = "pointillist", version, about, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Render a Mitsuba 3 scene file to EXR and PNG, without a window.
    Render(Box<RenderArgs>),
    /// Open a window that shows the scene at once, and sharper by the second.
    View(Box<ViewArgs>),
    /// Measure every pass of the client without a window.
    Bench(Box<BenchArgs>),
    /// Say which effects a scene calls for, why, and what each costs.
    Explain(Box<ExplainArgs>),
    /// Say how far a picture is from a reference, by several figures; reads EXR files of any program.
    Compare(Box<CompareArgs>),
    /// Say what accuracy costs in time: convergence, prices, predictions, as a page and a table.
    Study(Box<StudyArgs>),
    /// List the Vulkan devices and say of each whether it can be used.
    Devices,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
