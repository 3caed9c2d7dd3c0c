//! The film's side of the stream: the one routine by which `render`, `view` and `bench` put blocks onto a film.

use crate::client::light_meter::LightMeter;
use crate::client::{ClientError, Film};
use crate::denoise::noise_filter::NoiseFilter;
use crate::render::light_groups::GroupFilms;
use crate::render::observer::Observer;
use crate::stream::{Block, PathCounts, Sample};

/// Puts blocks onto a film: counts their paths, adds their samples, hands copies to the observer of the error and to the noise
/// filter, and remembers the first error, after which the film gets nothing more.
pub struct FilmWriter<'a> {
    film: &'a mut dyn Film,
    observer: Option<&'a Observer>,
    filter: Option<&'a NoiseFilter>,
    meter: Option<&'a mut LightMeter>,
    groups: Option<&'a mut GroupFilms>,
    outcome: Result<(), ClientError>,
}

impl<'a> FilmWriter<'a> {
    /// A writer to this film.
    pub fn new(film: &'a mut dyn Film, observer: Option<&'a Observer>) -> Self {
        Self { film, observer, filter: None, meter: None, groups: None, outcome: Ok(()) }
    }

    /// The same writer, which hands copies to this filter.
    pub fn with_filter(self, filter: Option<&'a NoiseFilter>) -> Self {
        Self { filter, ..self }
    }

    /// The same writer, which hands copies to this light meter.
    pub fn with_meter(self, meter: &'a mut LightMeter) -> Self {
        Self { meter: Some(meter), ..self }
    }

    /// The same writer, which puts the parts of groups of lights onto these films.
    pub fn with_groups(self, groups: Option<&'a mut GroupFilms>) -> Self {
        Self { groups, ..self }
    }

    /// Where copies for the estimate of the error go.
    pub fn observer(&self) -> Option<&'a Observer> {
        self.observer
    }

    /// Takes a block from the lanes.
    pub fn block(&mut self, block: &Block) {
        self.samples(block.header.first_index, block.header.paths, block.samples());
        if let Some(groups) = self.groups.as_mut().filter(|_| self.outcome.is_ok()) {
            self.outcome = groups.add(block);
        }
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
        if let Some(filter) = self.filter {
            filter.samples(first_index, paths, samples);
        }
        if let Some(meter) = &mut self.meter {
            meter.add(paths, samples);
        }
    }

    /// Ends the writing, with the first error of the film.
    pub fn finish(self) -> Result<(), ClientError> {
        self.outcome
    }
}
