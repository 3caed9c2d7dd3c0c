//! The release build of the program with a window on a display of its own.

use std::path::Path;
use std::process::{Child, Command};
use std::time::Duration;

use super::common::Outcome;
use super::support::desktop::Desktop;

/// Pixels of a display beside the picture that leave room for the dock: with less the picture is shown smaller than it is.
pub const DOCK: u32 = 512;

/// A running viewer; it ends with [`ask_to_end`](Viewer::ask_to_end).
pub struct Viewer {
    pub desktop: Desktop,
    pub window: u32,
    pub process: Child,
}

impl Viewer {
    /// Opens a display of `size` pixels and the window in it; `prepare` adds arguments and environment.
    pub fn open(size: [u32; 2], scene: &str, prepare: impl FnOnce(&mut Command)) -> Outcome<Self> {
        let desktop = Desktop::start(size[0], size[1]);
        let program = std::fs::canonicalize("target/release/pointillist")
            .map_err(|e| format!("target/release/pointillist: {e}; build it with --release"))?;
        let mut command = Command::new(program);
        command.env("DISPLAY", &desktop.display).env_remove("WAYLAND_DISPLAY").arg("view").arg(scene);
        prepare(&mut command);
        let mut process = command.spawn()?;
        let Some(window) = desktop.find("ointillist", Duration::from_secs(30)) else {
            let _ = process.kill().and_then(|()| process.wait());
            return Err("no window within 30 s".into());
        };
        Ok(Self { desktop, window, process })
    }

    /// Asks it to end, as a session manager does.
    pub fn ask_to_end(&self) {
        let _ = Command::new("kill").args(["-TERM", &self.process.id().to_string()]).status();
    }
}

/// What the viewer wrote with `--json`; null when it wrote nothing.
pub fn figures(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap_or_default()).unwrap_or_default()
}
