//! Messages of the program on standard error, as the environment variable `POINTILLIST_LOG` asks for them.

use std::io::IsTerminal;

use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Prints messages from now on: warnings, or down to the level of `POINTILLIST_LOG`. Does nothing where the process has a subscriber already.
pub fn print_messages() {
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
    let _ = tracing_subscriber::registry().with(lines.with_filter(filter)).try_init();
}
