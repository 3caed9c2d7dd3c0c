//! Cores for a driver that computes on the processor.

/// Number of threads that Mesa's llvmpipe rasterises with.
const VARIABLE: &str = "LP_NUM_THREADS";

/// Limits llvmpipe to `threads` threads, so that it leaves the other cores to whoever traces; a number that the user has set
/// stays. Returns the number in force. Other drivers do not look at it.
///
/// Must be called before the program starts a thread or opens a device: it writes to the environment.
pub fn reserve_driver_threads(threads: usize) -> usize {
    if let Some(set) = std::env::var(VARIABLE).ok().and_then(|text| text.parse().ok()) {
        return set;
    }
    // SAFETY: the caller promises that no other thread runs that could read the environment meanwhile.
    unsafe { std::env::set_var(VARIABLE, threads.to_string()) };
    threads
}
