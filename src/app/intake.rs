//! The film's side of the stream: the one routine by which `render`, `view` and `bench` put blocks onto a film.

use super::observer::Observer;
use crate::client::retained::RetainedSamples;
use crate::client::{ClientError, Film};
use crate::stream::{Block, PathCounts, Sample};

/// Puts blocks onto a film: counts their paths, adds their samples, hands a copy to the observer of the error and to the store
/// of kept samples, and remembers the first error, after which the film gets nothing more.
pub struct Intake<'a> {
    film: &'a mut dyn Film,
    observer: Option<&'a Observer>,
    kept: Option<&'a mut RetainedSamples>,
    outcome: Result<(), ClientError>,
}

impl<'a> Intake<'a> {
    /// An intake of this film.
    pub fn new(film: &'a mut dyn Film, observer: Option<&'a Observer>) -> Self {
        Self { film, observer, kept: None, outcome: Ok(()) }
    }

    /// Keeps every block from the lanes as well.
    pub fn keeping(self, kept: &'a mut RetainedSamples) -> Self {
        Self { kept: Some(kept), ..self }
    }

    /// Takes a block from the lanes.
    pub fn block(&mut self, block: &Block) {
        if let Some(kept) = &mut self.kept {
            kept.push(block);
        }
        self.samples(block.header.first_index, block.header.paths, block.samples());
    }

    /// Takes the samples of a block that was kept.
    pub fn samples(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        if self.outcome.is_err() {
            return;
        }
        self.film.count_paths(paths);
        self.outcome = self.film.add(samples);
        if let Some(observer) = self.observer {
            observer.samples(first_index, paths, samples);
        }
    }

    /// Ends the intake.
    ///
    /// # Errors
    ///
    /// The film's first error.
    pub fn finish(self) -> Result<(), ClientError> {
        self.outcome
    }
}
