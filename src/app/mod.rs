//! The program: the only module that knows both server and client. One file per subcommand.

mod args;
mod auto;
mod bench;
mod compare;
mod device;
mod drive;
mod error_report;
mod explain;
mod interrupt;
mod load;
mod method;
mod observer;
mod outputs;
mod plan;
mod predictions;
mod progress;
mod render;
mod report;
mod run_spec;
mod study;
mod timings;
mod trace;
mod usage;
mod view;

pub use args::{Cli, Command};

use std::io::Write;

use miette::Result;

/// Runs what the command line asks for.
///
/// # Errors
///
/// Everything that stops the run, ready to be printed: with file, line and column where a scene is at fault.
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Render(args) => render::render(&args),
        Command::View(args) => view::view(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Explain(args) => explain::explain(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Study(args) => study::study(&args),
        Command::Devices => device::list(),
    }
}

/// Prints a line on standard error. Whether anybody still reads it must not decide over a picture, so that a closed
/// pipe is not an error here (and a panic in `eprintln!`).
pub fn tell(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
