//! The film's side of the stream: the one routine by which `render`, `view` and `bench` put blocks onto a film.

use super::observer::Observer;
use crate::client::film::VulkanFilm;
use crate::client::{Client, ClientError};
use crate::stream::{Block, PathCounts, Sample};

/// A film that samples can be added to.
pub trait SampleFilm {
    /// Counts paths that were started, whether or not they gave samples.
    fn count_paths(&mut self, paths: PathCounts);

    /// Adds samples to the batch; a full batch is rasterised at once.
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError>;
}

macro_rules! sample_film {
    ($($film:ty),*) => {
        $(impl SampleFilm for $film {
            fn count_paths(&mut self, paths: PathCounts) {
                self.count_paths(paths);
            }

            fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
                self.add(samples)
            }
        })*
    };
}

sample_film!(Client, VulkanFilm);

/// Puts blocks onto a film: counts their paths, adds their samples, hands a copy to the observer of the error, and remembers the
/// first error, after which the film gets nothing more.
pub struct FilmWriter<'a, F> {
    film: &'a mut F,
    observer: Option<&'a Observer>,
    outcome: Result<(), ClientError>,
}

impl<'a, F: SampleFilm> FilmWriter<'a, F> {
    /// A writer to this film.
    pub fn new(film: &'a mut F, observer: Option<&'a Observer>) -> Self {
        Self { film, observer, outcome: Ok(()) }
    }

    /// Takes a block from the lanes.
    pub fn block(&mut self, block: &Block) {
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

    /// Ends the writing, with the first error of the film.
    pub fn finish(self) -> Result<(), ClientError> {
        self.outcome
    }
}
