//! Interaction with the operating system: signals, memory use, standard error.

use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time of the first interrupt.
static INTERRUPTED: OnceLock<Instant> = OnceLock::new();

/// Signals within this time count as one: `timeout` sends one to the program and another to its process group.
const ONE_WISH: Duration = Duration::from_millis(500);

/// Makes the first Ctrl-C end the render with the picture so far, and a later one end the process. If no handler can be installed, Ctrl-C
/// ends the process as usual.
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

/// Set when a snapshot is requested.
#[cfg(unix)]
static SNAPSHOT: OnceLock<std::sync::Arc<AtomicBool>> = OnceLock::new();

/// Makes SIGUSR1, which would end the process, a request for a snapshot. A process without a picture ignores it: the signal is often sent
/// to all processes of this name.
#[cfg(unix)]
pub fn listen_for_snapshots() {
    use signal_hook::{consts::SIGUSR1, flag};
    if let Err(error) = flag::register(SIGUSR1, SNAPSHOT.get_or_init(Default::default).clone()) {
        tracing::warn!("SIGUSR1 will end the program instead of saving a snapshot: {error}");
    }
}

/// SIGUSR1 does not exist on this system.
#[cfg(not(unix))]
pub fn listen_for_snapshots() {}

/// Whether a snapshot was requested since the last call.
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

/// The name of this machine; `None` where the system does not tell one.
pub fn machine_name() -> Option<String> {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    let name = std::env::var("COMPUTERNAME").unwrap_or_default();
    Some(name).filter(|name| !name.trim().is_empty())
}

/// Prints a line on standard error. Unlike with `eprintln!`, a closed pipe is not an error: the picture is rendered whether or not messages
/// are read.
pub fn tell(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
