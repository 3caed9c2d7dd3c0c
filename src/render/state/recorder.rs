//! Records a render into a state on disk.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::accounting::observer::Observer;
use crate::client::Film;
use crate::client::reference::ExactFilm;
use crate::render::state::file::{self, SharedSums};
use crate::render::state::header::StateHeader;
use crate::render::stereo::RightEye;
use crate::stream::{Block, BlockEyes, CHUNK, PathCounts, Rejections, Sample};
use crate::study::{AccumulatedSamples, MonitorProgress};

/// Passes on whole chunks of indices, and writes the state periodically.
///
/// A block may end within a path, and a render may be stopped at any time. So that the indices in the sums are always known, blocks, which
/// must arrive in index order, are held back until their chunk is complete.
pub struct Recorder {
    file: PathBuf,
    /// Interval between writes of the state.
    every: Duration,
    saved: Instant,
    began: Instant,
    /// Seconds of rendering before the state was resumed.
    before: f64,
    about: StateHeader,
    /// The eyes that blocks have samples of.
    eyes: BlockEyes,
    chunk: Chunk,
}

/// Blocks with consecutive indices.
#[derive(Debug, Default)]
pub struct Chunk {
    pub first_index: u64,
    pub paths: PathCounts,
    /// Samples of the picture or of the left eye, and of the right eye.
    pub samples: [Vec<Sample>; 2],
    indices: u64,
    rejections: Rejections,
}

impl Recorder {
    /// Starts recording the render described by `about` to `file`.
    pub fn new(file: PathBuf, every: Duration, about: StateHeader) -> Self {
        let now = Instant::now();
        let (eyes, before) = (about.run.eyes(), about.seconds);
        Self { file, every, saved: now, began: now, before, about, eyes, chunk: Chunk::default() }
    }

    /// Header of the state so far.
    pub fn about(&self) -> &StateHeader {
        &self.about
    }

    /// Discards held-back blocks, because another range of indices begins.
    pub fn begin_range(&mut self) {
        self.chunk = Chunk::default();
    }

    /// Takes the next block; returns its chunk if complete.
    pub fn take(&mut self, block: &Block) -> Option<&Chunk> {
        let (header, chunk) = (&block.header, &mut self.chunk);
        let is_empty = chunk.indices == 0 && chunk.samples.iter().all(Vec::is_empty);
        if header.first_index >= chunk.end() || is_empty {
            let mut samples = std::mem::take(&mut chunk.samples);
            samples.iter_mut().for_each(Vec::clear);
            *chunk = Chunk { first_index: header.first_index, samples, ..Chunk::default() };
        }
        chunk.indices += header.index_count;
        chunk.paths.camera += header.paths.camera;
        chunk.paths.light += header.paths.light;
        chunk.rejections.merge(&block.rejections);
        for (samples, more) in chunk.samples.iter_mut().zip(self.eyes.split(block)) {
            samples.extend_from_slice(more);
        }
        if chunk.first_index + chunk.indices < chunk.end().min(self.about.goal.indices.end) {
            return None;
        }
        self.about.rejections.merge(&chunk.rejections);
        // An index is traced only once: ranges already present were not requested.
        let _ = self.about.indices.add(chunk.first_index..chunk.first_index + chunk.indices);
        Some(chunk)
    }

    /// Whether a write is due.
    pub fn is_due(&self) -> bool {
        self.saved.elapsed() >= self.every
    }

    /// Writes the state of all chunks passed on so far.
    ///
    /// # Errors
    ///
    /// When the file cannot be written; the previous file stays unchanged.
    pub fn save(
        &mut self,
        film: &mut dyn Film,
        observer: Option<&Observer>,
        right_eye: Option<&mut RightEye>,
    ) -> Result<()> {
        let Some((film, account, progress)) = recorded(film, observer)? else { return Ok(()) };
        self.about.progress = progress;
        let mut right = None;
        if let Some(RightEye { film, observer, .. }) = right_eye {
            let Some((film, account, progress)) = recorded(&mut **film, observer.as_ref())? else {
                return Ok(());
            };
            self.about.right_eye.get_or_insert_default().progress = progress;
            right = Some((film, account));
        }
        self.about.seconds = self.before + self.began.elapsed().as_secs_f64();
        let right = right.as_ref().map(|(film, account)| shared(film, account.as_ref()));
        file::write(&self.file, &self.about, shared(film, account.as_ref()), right)?;
        self.saved = Instant::now();
        Ok(())
    }
}

/// A film without a batch and what is known of its samples, for the state; `None` if its sums are not exact.
fn recorded<'a>(
    film: &'a mut dyn Film,
    observer: Option<&Observer>,
) -> Result<Option<(&'a ExactFilm, Option<AccumulatedSamples>, MonitorProgress)>> {
    film.flush().into_diagnostic()?;
    let Some(film) = ExactFilm::of(film) else { return Ok(None) };
    let progress = observer.map(Observer::progress).unwrap_or_default();
    Ok(Some((&*film, observer.and_then(Observer::accumulated), progress)))
}

fn shared<'a>(film: &'a ExactFilm, account: Option<&'a AccumulatedSamples>) -> SharedSums<'a> {
    SharedSums { film, replicates: account.and_then(AccumulatedSamples::exact_sums) }
}

impl Chunk {
    /// One past the last index that may belong to the chunk.
    fn end(&self) -> u64 {
        (self.first_index / CHUNK + 1).saturating_mul(CHUNK)
    }
}
