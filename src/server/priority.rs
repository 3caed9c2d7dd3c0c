//! Who gives way when there are more threads than cores.

/// How the tracing threads stand beside all others of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Priority {
    /// As every thread.
    #[default]
    Normal,
    /// They take what others leave: a window, or a driver that draws on the processor, is served first. A scheduler that
    /// shares by weight (Linux) still lets them run, so that they hear commands.
    Background,
}

impl Priority {
    /// Gives the calling thread this priority. Lowering it needs no rights; where a system knows no priorities of threads,
    /// it stays as it was, which costs responsiveness and nothing else.
    pub fn apply(self) {
        #[cfg(target_os = "linux")]
        if self == Priority::Background {
            /// The lowest of nice(2).
            const LOWEST: i32 = 19;
            // On Linux a nice value belongs to a thread, and "this process" is the calling one.
            let _ = rustix::process::setpriority_process(None, LOWEST);
        }
    }
}
