//! What the process has used, as far as the system tells.

use std::fs;

/// Largest resident memory so far in bytes, from `/proc/self/status`; `None` elsewhere than on Linux.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
