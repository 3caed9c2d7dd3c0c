//! Survives the loss of the connection to an X display.
//!
//! When its connection breaks, Xlib exits the process immediately, and unsaved work is lost. Since libX11 1.7 a program can opt out of this
//! per connection; calls then return without effect, and the program must detect the loss and end by itself.

use std::ffi::{c_int, c_void};
use std::sync::atomic::{AtomicBool, Ordering};

use raw_window_handle::RawDisplayHandle;

static LOST: AtomicBool = AtomicBool::new(false);

type Handler = unsafe extern "C" fn(*mut c_void);
type SetExitHandler = unsafe extern "C" fn(*mut c_void, Handler, *mut c_void);
type ErrorHandler = unsafe extern "C" fn(*mut c_void) -> c_int;
type SetErrorHandler = unsafe extern "C" fn(Option<ErrorHandler>) -> Option<ErrorHandler>;

/// Called by Xlib instead of `exit`.
unsafe extern "C" fn stay(_: *mut c_void) {
    LOST.store(true, Ordering::SeqCst);
}

/// Called by Xlib before that; the default handler prints a line.
unsafe extern "C" fn note(_: *mut c_void) -> c_int {
    LOST.store(true, Ordering::SeqCst);
    0
}

/// Keeps the process running when the connection to this display breaks. `false` if not supported: not X11, or a libX11 before 1.7.
///
/// `display` must be that of a live connection.
pub fn survive_display_loss(display: RawDisplayHandle) -> bool {
    let RawDisplayHandle::Xlib(handle) = display else { return false };
    let Some(connection) = handle.display else { return false };
    // SAFETY: the library that the connection was opened with is loaded already; this counts one more user of it.
    let Ok(library) = (unsafe { libloading::Library::new("libX11.so.6") }) else { return false };
    // SAFETY: the functions have these types in every libX11 that has them; the handlers are valid for ever, touch an atomic
    // only, and the connection is live, as the caller promises.
    unsafe {
        let Ok(set_exit) = library.get::<SetExitHandler>(b"XSetIOErrorExitHandler\0") else { return false };
        set_exit(connection.as_ptr(), stay, std::ptr::null_mut());
        if let Ok(set_error) = library.get::<SetErrorHandler>(b"XSetIOErrorHandler\0") {
            set_error(Some(note));
        }
    }
    true
}

/// Whether the connection to the display has broken.
pub fn display_lost() -> bool {
    LOST.load(Ordering::SeqCst)
}
