//! Feeds samples to the film of the window: retained ones first, then those in the lanes.

use std::time::{Duration, Instant};

use crate::accounting::observer::Observer;
use crate::client::film::VulkanFilm;
use crate::client::reference::ReferenceFilm;
use crate::client::{CHUNK_SAMPLES, ClientError, Film, FilmSpec};
use crate::render::film_writer::FilmWriter;
use crate::stream::BLOCK_SAMPLES;
use crate::viewer::picture::LivePicture;
use crate::viewer::screen::Screen;
use crate::viewer::session::RenderSession;

/// Longest wait for the first samples after an edit, before messages are read again.
const FIRST_SAMPLES_WAIT: Duration = Duration::from_millis(4);

/// Most samples read at once while the sums are coarse, since all of them must be retained.
const COARSE_PART: usize = 8 * BLOCK_SAMPLES;

/// Number of samples that suffice for a first picture: at a high level of detail it shows the scene.
const FIRST_SAMPLES: u64 = 512;

impl LivePicture {
    /// Reads the samples of a frame that began at `begin`. After an edit it blocks shortly for the first ones.
    pub fn read_samples(
        &mut self,
        session: &mut RenderSession,
        budget: usize,
        begin: Instant,
    ) -> Result<(), ClientError> {
        self.read(session, budget)?;
        while self.unseen && !session.is_through() && self.samples() < FIRST_SAMPLES {
            let left = FIRST_SAMPLES_WAIT.saturating_sub(begin.elapsed());
            if left.is_zero() {
                break;
            }
            session.wait(left);
            session.hear_server();
            self.read(session, budget)?;
        }
        // In index order a lost film is rebuilt from the first index instead, and one of two eyes from the retained samples.
        let run = session.run_spec();
        if run.deterministic || run.stereo.is_some() { Ok(()) } else { self.back_up(begin) }
    }

    /// Notes that samples from now on may be steered: weighted by the inverse of their density.
    pub fn note_steering(&mut self) {
        self.steered = true;
        self.observer.iter().for_each(Observer::set_density_weights);
    }

    /// Adds `budget` samples to the film: retained ones first if it is behind, then those in the lanes.
    fn read(&mut self, session: &mut RenderSession, budget: usize) -> Result<(), ClientError> {
        let (begin, before) = (Instant::now(), self.rasterised);
        let outcome = self.take(session, budget);
        self.fed = (self.fed.0 + self.rasterised - before, self.fed.1 + begin.elapsed());
        outcome?;
        let film = self.film().filter(|film| film.is_coarse());
        match film.is_some_and(|film| film.must_sharpen() || self.kept.is_half_full()) {
            true => self.sharpen(),
            false => Ok(()),
        }
    }

    fn take(&mut self, session: &mut RenderSession, budget: usize) -> Result<(), ClientError> {
        let left = self.feed(budget)?;
        if let Some(region) = self.regions.traced_mut() {
            let (film, observer) = region.feed();
            let mut writer = FilmWriter::new(film, observer);
            let drained = session.drain(left.max(BLOCK_SAMPLES), |block| writer.block(block));
            self.rasterised += drained.samples as u64;
            return writer.finish();
        }
        if session.is_in_region() {
            // The region's film is gone, so its samples are dropped.
            session.drain(left.max(BLOCK_SAMPLES), |_| ());
            return Ok(());
        }
        let (observer, of_right) = (self.observer.as_ref(), self.right_observer.as_ref());
        let film = self.screen.as_mut().and_then(Screen::film_mut).filter(|_| self.kept.caught_up());
        let Some(film) = film else {
            // Without a film, samples are retained while there is room; then the workers block.
            self.read_ahead(session, budget);
            return Ok(());
        };
        let (coarse, eyes) = (film.is_coarse(), session.run_spec().eyes());
        let mut writer = FilmWriter::new(film, observer).with_meter(&mut self.meter);
        writer = writer.with_groups(self.mix.films()).with_eyes(eyes).with_layer_observer(of_right);
        let mut left = left.max(BLOCK_SAMPLES);
        while left > 0 {
            let drained = session.drain(if coarse { left.min(COARSE_PART) } else { left }, |block| {
                self.kept.push(block);
                writer.block(block);
            });
            self.rasterised += drained.samples as u64;
            left = left.saturating_sub(drained.samples.max(1));
            if !coarse || drained.blocks == 0 || self.kept.is_half_full() {
                break;
            }
        }
        writer.finish()
    }

    /// If the sums are coarse, adds the retained samples again at full resolution.
    pub fn sharpen(&mut self) -> Result<(), ClientError> {
        let film = self.screen.as_mut().and_then(Screen::film_mut).filter(|film| film.is_coarse());
        let Some(film) = film else { return Ok(()) };
        film.sharpen();
        let mut outcome = Ok(());
        self.kept.each(|[left, right], _, paths| {
            film.count_paths(paths);
            if outcome.is_ok() {
                outcome = film.add(left);
            }
            if outcome.is_ok() && film.has_right_eye() {
                outcome = film.add_right(right);
            }
            self.rasterised += (left.len() + right.len()) as u64;
        });
        outcome
    }

    /// Adds up to `budget` retained samples that the film lacks, and reads no others.
    pub fn read_kept(&mut self, budget: usize) -> Result<(), ClientError> {
        self.feed(budget).map(drop)
    }

    /// Adds retained samples if the film is behind; returns the rest of the budget.
    fn feed(&mut self, budget: usize) -> Result<usize, ClientError> {
        let observer = self.observer.as_ref();
        let Some(film) = self.screen.as_mut().and_then(Screen::film_mut) else { return Ok(budget) };
        let mut left = budget;
        let mut writer = FilmWriter::new(film, observer).with_meter(&mut self.meter);
        writer = writer.with_layer_observer(self.right_observer.as_ref());
        while left > 0
            && let Some(([samples, of_right], first_index, paths)) = self.kept.feed()
        {
            writer.samples(first_index, paths, samples);
            writer.right_samples(first_index, paths, of_right);
            let count = samples.len() + of_right.len();
            left = left.saturating_sub(count);
            self.rasterised += count as u64;
        }
        writer.finish()?;
        Ok(left)
    }

    /// Moves samples from the lanes to the store, so that the tracer is not blocked by a film that is behind.
    fn read_ahead(&mut self, session: &mut RenderSession, budget: usize) {
        let mut left = budget;
        while left > 0 && self.kept.has_room() {
            let drained = session.drain(BLOCK_SAMPLES, |block| _ = self.kept.push_for_later(block));
            if drained.blocks == 0 {
                break;
            }
            left = left.saturating_sub(drained.samples.max(1));
        }
    }

    /// Reads the last samples of a stopped render, for at most `time`. On an error the retained samples remain.
    pub fn read_rest(&mut self, session: &mut RenderSession, time: Duration) -> Result<(), ClientError> {
        let start = Instant::now();
        while !session.is_through() && start.elapsed() < time || !self.kept.caught_up() {
            session.hear_server();
            self.read(session, CHUNK_SAMPLES)?;
            if self.film().is_none() {
                break;
            }
            if !session.is_through() {
                session.wait(Duration::from_millis(5));
            }
        }
        Ok(())
    }

    /// A film without a device: that of `taken` or of a lost device if its sums are in memory, or else one restored from the last copy of
    /// the sums, or else one filled from the retained samples. It has no right eye.
    pub fn film_without_device(
        &mut self,
        spec: FilmSpec,
        taken: Option<VulkanFilm>,
    ) -> Result<ReferenceFilm, ClientError> {
        let rescued = taken.or_else(|| self.screen.as_mut().and_then(Screen::take_rescued));
        if let Some(film) = rescued.and_then(|film| film.into_reference(0)) {
            return film;
        }
        let mut film = ReferenceFilm::new(spec, 0)?;
        if let Some(copy) = self.backup.take(self.kept.len()) {
            film.restore(&copy)?;
            return Ok(film);
        }
        let mut writer = FilmWriter::new(&mut film, None);
        self.kept.rewind();
        while let Some(([samples, _], first_index, paths)) = self.kept.feed() {
            writer.samples(first_index, paths, samples);
        }
        writer.finish()?;
        film.flush()?;
        Ok(film)
    }
}
