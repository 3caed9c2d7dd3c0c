//! The `pointillist` command: parse, run, print the error, set the exit code.

use std::process::ExitCode;

use clap::Parser;
use pointillist::cmd::{Cli, print_messages, run, tell};

fn main() -> ExitCode {
    print_messages();
    match run(Cli::parse()) {
        Ok(code) => code,
        Err(report) => {
            tell(&format!("{report:?}"));
            ExitCode::FAILURE
        }
    }
}
