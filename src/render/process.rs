//! What the process asks of the system: signals, memory in use, standard error.

use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// When the process was interrupted first.
static INTERRUPTED: OnceLock<Instant> = OnceLock::new();

/// Signals that come within this time are one wish: `timeout` sends one to the program and another to its group.
const ONE_WISH: Duration = Duration::from_millis(500);

/// Takes the first Ctrl-C as the wish for the picture as it is; another one later ends the process. If no handler can be
/// installed, Ctrl-C ends the process as usual.
pub fn listen_for_interrupt() {
    let set = ctrlc::set_handler(|| {
        if INTERRUPTED.get_or_init(Instant::now).elapsed() > ONE_WISH {
            std::process::exit(130);
        }
    });
    if let Err(error) = set {
        tracing::warn!("Ctrl-C will end the program without a picture: {error}");
    }
}

/// True once Ctrl-C was pressed.
pub fn is_interrupted() -> bool {
    INTERRUPTED.get().is_some()
}

/// A snapshot was asked for.
#[cfg(unix)]
static SNAPSHOT: OnceLock<std::sync::Arc<AtomicBool>> = OnceLock::new();

/// Takes SIGUSR1, which would end the process otherwise, as the wish for a snapshot. What has no picture goes on as if nothing had
/// happened: the signal is often sent to all processes of this name.
#[cfg(unix)]
pub fn listen_for_snapshots() {
    use signal_hook::{consts::SIGUSR1, flag};
    if let Err(error) = flag::register(SIGUSR1, SNAPSHOT.get_or_init(Default::default).clone()) {
        tracing::warn!("SIGUSR1 will end the program instead of saving a snapshot: {error}");
    }
}

/// There is no such signal here.
#[cfg(not(unix))]
pub fn listen_for_snapshots() {}

/// True if a snapshot was asked for since the last call.
pub fn take_snapshot_request() -> bool {
    #[cfg(unix)]
    return SNAPSHOT.get().is_some_and(|request| request.swap(false, Ordering::SeqCst));
    #[cfg(not(unix))]
    false
}

/// Largest resident memory so far in bytes, from `/proc/self/status`; `None` on systems other than Linux.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// Prints a line on standard error. A closed pipe is not an error here, unlike in `eprintln!`: a picture is made
/// whether or not anybody reads the messages.
pub fn tell(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
