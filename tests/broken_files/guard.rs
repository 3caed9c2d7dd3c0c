//! Runs the scene reader under limits: a counting allocator bounds its memory, and a watchdog ends the test when one file takes too
//! long.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use pointillist::scene::{LoadOptions, load_with};

use crate::held_memory;
use crate::messages::{assert_has_place, render};

/// The time that one file may take: hundreds of times that of the slowest, so that a busy machine does not fail the test, but an
/// endless loop does.
const TIME: Duration = Duration::from_secs(60);

/// Lets one reader run at a time, so that only its memory is counted.
static ALONE: Mutex<()> = Mutex::new(());

/// Loads a model under guard; the rendered message if it is refused. `places`: endings of files that a warning may be about.
pub fn model_outcome(
    folder: &Path,
    name: &str,
    what: &str,
    places: &'static [&'static str],
) -> Result<(), String> {
    let path = folder.join(name);
    guarded(what, move || match load_with(&path, &LoadOptions::default()) {
        Ok(loaded) => {
            loaded.warnings.iter().for_each(|w| assert_has_place("a warning", &render(w), places));
            Ok(())
        }
        Err(e) => Err(render(&e)),
    })
}

/// Runs `work` on a thread with a small stack and fails if it panics, takes too long or too much.
pub fn guarded<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (done, wait) = mpsc::channel();
    let before = held_memory::start();
    let thread = std::thread::Builder::new().stack_size(1 << 20);
    let handle = thread
        .spawn(move || {
            let result = work();
            let _ = done.send(()); // nobody listens any more if it took too long
            result
        })
        .expect("a thread");
    if wait.recv_timeout(TIME) == Err(mpsc::RecvTimeoutError::Timeout) {
        panic!("{what}: still not done after {TIME:?}");
    }
    let result = handle.join().unwrap_or_else(|_| panic!("{what}: the reader panicked"));
    let peak = held_memory::peak_since(before);
    assert!(peak < held_memory::MOST, "{what}: held {peak} bytes");
    result
}

/// An empty folder for this test's files.
pub fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path); // not there the first time
    std::fs::create_dir_all(&path).expect("a writable target folder");
    path
}

/// Writes a file.
pub fn write(folder: &Path, name: &str, bytes: &[u8]) {
    std::fs::write(folder.join(name), bytes).expect("a writable folder");
}

/// Loads `scene.xml` of a folder under guard; the rendered message if it is refused.
pub fn outcome(folder: &Path, what: &str) -> Result<(), String> {
    outcome_with(folder, what, false)
}

/// [`outcome`] in a lenient run or a strict one.
pub fn outcome_with(folder: &Path, what: &str, lenient: bool) -> Result<(), String> {
    let path = folder.join("scene.xml");
    guarded(what, move || match load_with(&path, &LoadOptions { defines: &[], lenient }) {
        Ok(loaded) => {
            for w in &loaded.warnings {
                let shown = render(w);
                assert_has_place("a warning", &shown, &[".xml", ".obj", ".ply", ".serialized", "curve"]);
            }
            Ok(())
        }
        Err(e) => Err(render(&e)),
    })
}
