//! Runs the scene reader under limits: a counting allocator bounds its memory, and a watchdog ends the test when one file takes too
//! long.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use miette::{GraphicalReportHandler, GraphicalTheme};
use pointillist::scene::{LoadOptions, load_with};

/// The most memory that the reader may hold for one small broken file, in bytes. Inputs here are below 2 MB.
pub const MEMORY: usize = 256 << 20;

/// The time that one file may take: hundreds of times that of the slowest, so that a busy machine does not fail the test, but an
/// endless loop does.
const TIME: Duration = Duration::from_secs(60);

/// Counts the bytes held, and the most ever held.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Lets one reader run at a time, so that only its memory is counted.
static ALONE: Mutex<()> = Mutex::new(());

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs `work` on a thread with a small stack and fails if it panics, takes too long or too much.
pub fn guarded<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (done, wait) = mpsc::channel();
    PEAK.store(HELD.load(Ordering::Relaxed), Ordering::Relaxed);
    let before = HELD.load(Ordering::Relaxed);
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
    let peak = PEAK.load(Ordering::Relaxed).saturating_sub(before);
    assert!(peak < MEMORY, "{what}: held {peak} bytes");
    result
}

/// The message as the user sees it.
pub fn render(d: &dyn miette::Diagnostic) -> String {
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut out, d).expect("a string never fails");
    out
}

/// The message shows `file:line:column` of one of the files, and is of a readable size.
pub fn assert_has_place(what: &str, shown: &str, names: &[&str]) {
    let numbered = |rest: &str| {
        let mut parts = rest.split(|c: char| !c.is_ascii_digit());
        parts.next().is_some_and(|line| line.parse::<u32>().is_ok_and(|l| l > 0))
    };
    let places = |name: &str| {
        shown.match_indices(name).any(|(i, n)| shown[i + n.len()..].strip_prefix(':').is_some_and(numbered))
    };
    assert!(names.iter().any(|n| places(n)), "{what}: no place in\n{shown}");
    assert!(shown.len() < 20_000, "{what}: {} bytes of message", shown.len());
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
