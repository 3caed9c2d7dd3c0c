//! An X server without a screen (Xvfb), under the first free number.

use std::io::Read;
use std::process::{Child, Command, Stdio};

/// The server; it ends when this is dropped.
pub struct Server {
    child: Child,
    /// Its name, such as `:99`.
    pub display: String,
}

impl Server {
    /// Starts a server with a screen of this size.
    ///
    /// # Panics
    ///
    /// When Xvfb is not installed.
    pub fn start(width: u32, height: u32) -> Self {
        let screen = format!("{width}x{height}x24");
        let mut child = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp", "-noreset"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|e| panic!("Xvfb cannot be started ({e}): install it with `tools/setup --test`"));
        let mut number = String::new();
        let mut out = child.stdout.take().expect("piped");
        let mut byte = [0];
        while out.read(&mut byte).expect("Xvfb's display number") == 1 && byte[0] != b'\n' {
            number.push(byte[0] as char);
        }
        assert!(!number.is_empty(), "Xvfb ended at once: run tools/setup --test");
        Self { child, display: format!(":{}", number.trim()) }
    }

    /// Its process.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// True until it has ended.
    pub fn is_alive(&self) -> bool {
        // Not reaped while it runs, so its folder is there; a zombie has no memory map.
        std::fs::read_to_string(format!("/proc/{}/statm", self.pid())).is_ok_and(|m| !m.starts_with("0 "))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
