//! The program: the only module that knows both server and client. One file per subcommand.

mod args;
mod bench;
mod compare;
mod device;
mod drive;
mod error_report;
mod explain;
mod intake;
mod load;
mod method;
mod observer;
mod outputs;
mod plan;
mod predictions;
mod process;
mod progress;
mod render;
mod report;
mod run_spec;
mod study;
mod timings;
mod trace;
mod view;

pub use args::{Cli, CliCommand};
pub use process::tell;

use miette::Result;

/// Runs what the command line asks for.
///
/// # Errors
///
/// Everything that stops the run, ready to be printed: with file, line and column where a scene is at fault.
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        CliCommand::Render(args) => render::render(&args),
        CliCommand::View(args) => view::view(&args),
        CliCommand::Bench(args) => bench::bench(&args),
        CliCommand::Explain(args) => explain::explain(&args),
        CliCommand::Compare(args) => compare::compare(&args),
        CliCommand::Study(args) => study::study(&args),
        CliCommand::Devices => device::list(),
    }
}
