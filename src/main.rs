//! The `pointillist` command: parse, run, print the error, set the exit code.

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::Parser;
use pointillist::cmd::{Cli, run, tell};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

fn main() -> ExitCode {
    let level = std::env::var("POINTILLIST_LOG").ok().and_then(|text| text.parse::<LevelFilter>().ok());
    // Other crates warn of things that nobody can mend here, such as a display without a theme.
    let filter = match level {
        Some(level) => Targets::new().with_default(level),
        None => Targets::new().with_default(LevelFilter::ERROR).with_target("pointillist", LevelFilter::WARN),
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time();
    tracing_subscriber::registry().with(lines.with_filter(filter)).init();
    match run(Cli::parse()) {
        Ok(code) => code,
        Err(report) => {
            tell(&format!("{report:?}"));
            ExitCode::FAILURE
        }
    }
}
