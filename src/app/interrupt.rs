//! Ctrl-C asks for the picture as it is; a second one ends the process.

use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Starts listening. Where no handler can be set, Ctrl-C simply ends the process, as ever.
pub fn listen() {
    let set = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
    });
    if let Err(error) = set {
        tracing::warn!("Ctrl-C will end the program without a picture: {error}");
    }
}

/// True once Ctrl-C was pressed.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}
