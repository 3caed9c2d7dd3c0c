//! Watches the files of the open scene.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use notify::{Event, RecommendedWatcher, RecursiveMode, Watcher};

/// A burst of changes has ended if no change followed for this long.
const QUIET: Duration = Duration::from_millis(200);

/// Watches files for changes. It watches their directories, because an editor may write a new file and rename it to the old name.
pub struct FileWatch {
    /// `None` if the system does not support watching, which is reported once.
    watcher: Option<RecommendedWatcher>,
    events: Receiver<notify::Result<Event>>,
    files: BTreeSet<PathBuf>,
    folders: BTreeSet<PathBuf>,
    /// Time of the last change that has not been reported.
    last: Option<Instant>,
}

impl FileWatch {
    /// A watch of no files, and a message if this system does not support watching.
    pub fn new() -> (Self, Option<String>) {
        let (send, events) = channel();
        let watcher = notify::recommended_watcher(send);
        let problem = watcher.as_ref().err().map(|e| format!("changed files are not read again: {e}"));
        let (files, folders) = Default::default();
        (Self { watcher: watcher.ok(), events, files, folders, last: None }, problem)
    }

    /// Replaces the watched files; returns a message about those that cannot be watched.
    pub fn follow(&mut self, files: Vec<PathBuf>) -> Option<String> {
        let watcher = self.watcher.as_mut()?;
        // For a symbolic link, both the link and its target are watched.
        let names = |file: &PathBuf| [named(file), file.canonicalize().ok()];
        self.files = files.iter().flat_map(names).flatten().collect();
        let folders: BTreeSet<PathBuf> =
            self.files.iter().filter_map(|file| file.parent().map(Path::to_owned)).collect();
        for gone in self.folders.difference(&folders) {
            let _ = watcher.unwatch(gone); // it may be gone from the disk, too
        }
        let mut problem = None;
        for new in folders.difference(&self.folders) {
            if let Err(error) = watcher.watch(new, RecursiveMode::NonRecursive) {
                problem = Some(format!("changes in {} will not be seen: {error}", new.display()));
            }
        }
        self.folders = folders;
        problem
    }

    /// The watched files, under all of their names.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.files.iter().cloned()
    }

    /// True once after a file has changed and no further change followed.
    pub fn has_changed(&mut self, now: Instant) -> bool {
        while let Ok(event) = self.events.try_recv() {
            let Ok(event) = event else { continue };
            if !event.kind.is_access() && event.paths.iter().any(|path| self.files.contains(path)) {
                self.last = Some(now);
            }
        }
        self.last.take_if(|last| now.saturating_duration_since(*last) >= QUIET).is_some()
    }
}

/// Path of the file with its directory canonicalised and its own name unresolved.
fn named(file: &Path) -> Option<PathBuf> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(file.file_name()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waits for a change, at most `patience`.
    fn changes(watch: &mut FileWatch, patience: Duration) -> bool {
        let start = Instant::now();
        while start.elapsed() < patience {
            if watch.has_changed(Instant::now()) {
                return true;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        false
    }

    #[test]
    fn writes_and_renames_are_heard_once_and_neighbours_never() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name| folder.path().join(name);
        std::fs::write(path("a.xml"), "1").expect("writable");
        let (mut watch, problem) = FileWatch::new();
        assert_eq!((problem, watch.follow(vec![path("a.xml")])), (None, None));
        std::fs::write(path("b.xml"), "1").expect("writable");
        assert!(!changes(&mut watch, 3 * QUIET), "a neighbour");
        for text in ["2", "3", "4"] {
            std::fs::write(path("a.xml"), text).expect("writable");
        }
        assert!(changes(&mut watch, 50 * QUIET));
        assert!(!changes(&mut watch, 3 * QUIET), "a burst is one change");
        std::fs::write(path("new"), "5").expect("writable");
        std::fs::rename(path("new"), path("a.xml")).expect("a free name");
        assert!(changes(&mut watch, 50 * QUIET), "renamed");
    }
}
