//! The `pointillist` command: parse, run, print the error, set the exit code.

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::Parser;
use pointillist::app::{Cli, run, tell};
use tracing_subscriber::filter::LevelFilter;

fn main() -> ExitCode {
    let level = std::env::var("POINTILLIST_LOG").ok().and_then(|text| text.parse::<LevelFilter>().ok());
    tracing_subscriber::fmt()
        .with_max_level(level.unwrap_or(LevelFilter::WARN))
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        .init();
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(report) => {
            tell(&format!("{report:?}"));
            ExitCode::FAILURE
        }
    }
}
