//! Files that are being written while the window goes on.

use std::path::{Path, PathBuf};
use std::thread::{Builder, JoinHandle};

use miette::{IntoDiagnostic, Result, miette};

/// Files under way.
#[derive(Default)]
pub struct Saving(Vec<(PathBuf, JoinHandle<Result<()>>)>);

impl Saving {
    /// Begins to write a file.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn begin(
        &mut self,
        path: PathBuf,
        write: impl FnOnce(&Path) -> Result<()> + Send + 'static,
    ) -> Result<()> {
        let target = path.clone();
        let thread = Builder::new().name("save".into()).spawn(move || write(&target)).into_diagnostic()?;
        self.0.push((path, thread));
        Ok(())
    }

    /// `NAME-001.ENDING`, or the next number that is free in the working folder and not being written.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn fresh(&self, name: &str, ending: &str) -> Result<PathBuf> {
        let path = |i: u32| PathBuf::from(format!("{name}-{i:03}.{ending}"));
        let free = |path: &PathBuf| !path.exists() && self.0.iter().all(|(taken, _)| taken != path);
        let none = || miette!("no free name {name}-….{ending} in this folder");
        (1..100_000).map(path).find(free).ok_or_else(none)
    }

    /// Nothing is being written.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What is to be said of files that are written by now, or could not be.
    pub fn done(&mut self) -> Vec<String> {
        self.0.extract_if(.., |(_, thread)| thread.is_finished()).map(told).collect()
    }

    /// The same for all files, waited for.
    pub fn finish(&mut self) -> Vec<String> {
        self.0.drain(..).map(told).collect()
    }
}

fn told((path, thread): (PathBuf, JoinHandle<Result<()>>)) -> String {
    match thread.join() {
        Ok(Ok(())) => format!("saved {}", path.display()),
        Ok(Err(error)) => error.to_string(),
        Err(_) => format!("{} could not be written: a mistake of ours; please report it", path.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Barrier};

    #[test]
    fn names_are_taken_at_once_and_outcomes_told_later() {
        let (mut saving, gate) = (Saving::default(), Arc::new(Barrier::new(2)));
        let path = saving.fresh("no such picture", "png").expect("free");
        assert_eq!(path, Path::new("no such picture-001.png"));
        let inside = gate.clone();
        let write = move |_: &Path| {
            inside.wait();
            Err(miette!("the disk is full"))
        };
        saving.begin(path, write).expect("a thread");
        assert_eq!(
            saving.fresh("no such picture", "png").expect("free"),
            Path::new("no such picture-002.png")
        );
        assert!(saving.done().is_empty() && !saving.is_empty());
        gate.wait();
        assert_eq!(saving.finish(), ["the disk is full"]);
        assert!(saving.is_empty());
    }
}
