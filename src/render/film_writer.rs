//! The film's side of the stream: the one routine by which `render`, `view` and `bench` put blocks onto a film.

use crate::accounting::observer::Observer;
use crate::client::film::VulkanFilm;
use crate::client::light_meter::LightMeter;
use crate::client::{ClientError, Film};
use crate::render::light_groups::GroupFilms;
use crate::render::stereo::RightEye;
use crate::stream::{Block, BlockEyes, PathCounts, Sample};

/// Adds blocks to a film: counts their paths, adds their samples, and passes copies to the observer. After the
/// first error of the film, which is kept, no more samples are added.
pub struct FilmWriter<'a> {
    film: &'a mut dyn Film,
    observer: Option<&'a Observer>,
    meter: Option<&'a mut LightMeter>,
    groups: Option<&'a mut GroupFilms>,
    right_eye: Option<&'a mut RightEye>,
    eyes: BlockEyes,
    /// Observer of the picture of the right eye where that is a layer of the film.
    layer_observer: Option<&'a Observer>,
    outcome: Result<(), ClientError>,
}

impl<'a> FilmWriter<'a> {
    /// A writer to this film.
    pub fn new(film: &'a mut dyn Film, observer: Option<&'a Observer>) -> Self {
        let eyes = BlockEyes::One;
        Self {
            film,
            observer,
            meter: None,
            groups: None,
            right_eye: None,
            eyes,
            layer_observer: None,
            outcome: Ok(()),
        }
    }

    /// Also copies samples to this light meter.
    pub fn with_meter(self, meter: &'a mut LightMeter) -> Self {
        Self { meter: Some(meter), ..self }
    }

    /// Also adds the contributions of light groups to these films.
    pub fn with_groups(self, groups: Option<&'a mut GroupFilms>) -> Self {
        Self { groups, ..self }
    }

    /// The film is the left eye's, and this the right eye of the render.
    pub fn with_right_eye(self, right_eye: Option<&'a mut RightEye>) -> Self {
        let eyes = right_eye.as_ref().map_or(self.eyes, |eye| eye.eyes);
        Self { right_eye, eyes, ..self }
    }

    /// Blocks have samples of these eyes; those of the right one go onto its layer of the film.
    pub fn with_eyes(self, eyes: BlockEyes) -> Self {
        Self { eyes, ..self }
    }

    /// Also passes copies of the right eye's samples that go onto its layer of the film to this observer.
    pub fn with_layer_observer(self, layer_observer: Option<&'a Observer>) -> Self {
        Self { layer_observer, ..self }
    }

    /// The observer that receives copies.
    pub fn observer(&self) -> Option<&'a Observer> {
        self.observer
    }

    /// The observer of the right eye's picture, if there is one.
    pub fn right_observer(&self) -> Option<&Observer> {
        self.right_eye.as_ref().and_then(|eye| eye.observer.as_ref())
    }

    /// Adds a block from the lanes.
    pub fn block(&mut self, block: &Block) {
        self.of_eyes(block.header.first_index, block.header.paths, self.eyes.split(block));
        if let Some(groups) = self.groups.as_mut().filter(|_| self.outcome.is_ok()) {
            self.outcome = groups.add(block, self.eyes);
        }
    }

    /// Adds samples of the picture or of the left eye, and of the right eye by the same paths.
    pub fn of_eyes(&mut self, first_index: u64, paths: PathCounts, [left, right]: [&[Sample]; 2]) {
        self.samples(first_index, paths, left);
        match &mut self.right_eye {
            None => self.right_samples(first_index, paths, right),
            Some(eye) if self.outcome.is_ok() => self.outcome = eye.add(first_index, paths, right),
            Some(_) => {}
        }
    }

    /// Adds the samples of a retained block.
    pub fn samples(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        if self.outcome.is_err() {
            return;
        }
        self.film.count_paths(paths);
        self.outcome = self.film.add(samples);
        if let Some(observer) = self.observer {
            observer.samples(first_index, paths, samples);
        }
        if let Some(meter) = &mut self.meter {
            meter.add(paths, samples);
        }
    }

    /// Adds samples of the right eye to its layer of the film, after those of the left eye of the same block. A film without one leaves them
    /// out.
    pub fn right_samples(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        if self.outcome.is_err() {
            return;
        }
        if !samples.is_empty()
            && let Some(film) = VulkanFilm::of(self.film).filter(|film| film.has_right_eye())
        {
            self.outcome = film.add_right(samples);
        }
        if let Some(observer) = self.layer_observer {
            observer.samples(first_index, paths, samples);
        }
    }

    /// Returns the first error of the film.
    pub fn finish(self) -> Result<(), ClientError> {
        self.outcome
    }
}
