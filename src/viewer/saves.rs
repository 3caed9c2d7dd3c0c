//! Files written by background threads.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, miette};

use crate::job::Job;

/// A file being written.
struct FileInProgress {
    path: PathBuf,
    job: Job<Result<()>>,
}

/// All files being written.
#[derive(Default)]
pub struct BackgroundSaves(Vec<FileInProgress>);

impl BackgroundSaves {
    /// Begins to write a file.
    pub fn begin(
        &mut self,
        path: PathBuf,
        write: impl FnOnce(&Path) -> Result<()> + Send + 'static,
    ) -> Result<()> {
        let target = path.clone();
        let job = Job::start("saving a file", move |_| write(&target)).into_diagnostic()?;
        self.0.push(FileInProgress { path, job });
        Ok(())
    }

    /// A path for a new file, as [`free_path`], that is not being written either.
    pub fn free_path(&self, name: &str, ending: &str) -> Result<PathBuf> {
        free_path(name, ending, |path| self.0.iter().any(|file| file.path == path))
    }

    /// Whether no file is being written.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Messages about files completed since the last call, or failed.
    pub fn done(&mut self) -> Vec<String> {
        self.0.extract_if(.., |file| file.job.is_finished()).map(message).collect()
    }

    /// Waits for all files; returns the messages about them.
    pub fn finish(&mut self) -> Vec<String> {
        self.0.drain(..).map(message).collect()
    }
}

/// `NAME-001.ENDING`, or the next number that is neither in use in the working directory nor `taken`.
pub fn free_path(name: &str, ending: &str, taken: impl Fn(&Path) -> bool) -> Result<PathBuf> {
    let mut paths = (1..100_000).map(|i| PathBuf::from(format!("{name}-{i:03}.{ending}")));
    let free = paths.find(|path| !path.exists() && !taken(path));
    free.ok_or_else(|| miette!("no free name {name}-….{ending} in this folder"))
}

fn message(FileInProgress { path, job }: FileInProgress) -> String {
    match job.wait() {
        Ok(Ok(())) => format!("saved {}", path.display()),
        Ok(Err(error)) => error.to_string(),
        Err(panic) => format!("{} could not be written: {panic}", path.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Barrier};

    #[test]
    fn names_are_taken_at_once_and_outcomes_told_later() {
        let (mut saves, gate) = (BackgroundSaves::default(), Arc::new(Barrier::new(2)));
        let path = saves.free_path("no such picture", "png").expect("free");
        assert_eq!(path, Path::new("no such picture-001.png"));
        let inside = gate.clone();
        let write = move |_: &Path| {
            inside.wait();
            Err(miette!("the disk is full"))
        };
        saves.begin(path, write).expect("a thread");
        assert_eq!(
            saves.free_path("no such picture", "png").expect("free"),
            Path::new("no such picture-002.png")
        );
        assert!(saves.done().is_empty() && !saves.is_empty());
        gate.wait();
        assert_eq!(saves.finish(), ["the disk is full"]);
        assert!(saves.is_empty());
    }
}
