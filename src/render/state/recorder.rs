//! A render that keeps its state on disk.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::client::Film;
use crate::render::observer::Observer;
use crate::render::state::file;
use crate::render::state::header::StateHeader;
use crate::stream::{Block, CHUNK, PathCounts, Rejections, Sample};

/// Hands over whole chunks of indices, and writes the state every now and then.
///
/// A block may end within a path, and a render may be stopped anywhere. So that the indices in the sums are known at any time, blocks,
/// which must come in the order of indices, wait until all of their chunk is there.
pub struct Recorder {
    file: PathBuf,
    /// Time between two states.
    every: Duration,
    saved: Instant,
    began: Instant,
    /// Seconds of rendering before this run of the program.
    before: f64,
    about: StateHeader,
    chunk: Chunk,
}

/// Blocks with consecutive indices.
#[derive(Debug, Default)]
pub struct Chunk {
    pub first_index: u64,
    pub paths: PathCounts,
    pub samples: Vec<Sample>,
    indices: u64,
    rejections: Rejections,
}

impl Recorder {
    /// Writes the state `about` says to `file`, from now on.
    pub fn new(file: PathBuf, every: Duration, about: StateHeader) -> Self {
        let now = Instant::now();
        Self { file, every, saved: now, began: now, before: about.seconds, about, chunk: Chunk::default() }
    }

    /// What is known of the render.
    pub fn about(&self) -> &StateHeader {
        &self.about
    }

    /// Forgets blocks that wait: another range of indices begins.
    pub fn begin_range(&mut self) {
        self.chunk = Chunk::default();
    }

    /// Takes the next block, and returns its chunk if that is complete.
    pub fn take(&mut self, block: &Block) -> Option<&Chunk> {
        let (header, chunk) = (&block.header, &mut self.chunk);
        if header.first_index >= chunk.end() || chunk.indices == 0 && chunk.samples.is_empty() {
            chunk.samples.clear();
            *chunk = Chunk {
                first_index: header.first_index,
                samples: std::mem::take(&mut chunk.samples),
                ..Chunk::default()
            };
        }
        chunk.indices += header.index_count;
        chunk.paths.camera += header.paths.camera;
        chunk.paths.light += header.paths.light;
        chunk.rejections.merge(&block.rejections);
        chunk.samples.extend_from_slice(block.samples());
        if chunk.first_index + chunk.indices < chunk.end().min(self.about.goal.indices.end) {
            return None;
        }
        self.about.rejections.merge(&chunk.rejections);
        // Indices are traced once: those of a range that is there already were not asked for.
        let _ = self.about.indices.add(chunk.first_index..chunk.first_index + chunk.indices);
        Some(chunk)
    }

    /// True when it is time for a state.
    pub fn is_due(&self) -> bool {
        self.saved.elapsed() >= self.every
    }

    /// Writes the state of all chunks that were handed over.
    ///
    /// # Errors
    ///
    /// When the file cannot be written; what stood there is as before.
    pub fn save(&mut self, film: &mut dyn Film, observer: Option<&Observer>) -> Result<()> {
        film.flush().into_diagnostic()?;
        let Some(film) = film.exact() else { return Ok(()) };
        let (replicates, progress) = observer.and_then(Observer::progress).unzip();
        self.about.progress = progress.unwrap_or_default();
        self.about.seconds = self.before + self.began.elapsed().as_secs_f64();
        file::write(&self.file, &self.about, film, replicates.as_ref())?;
        self.saved = Instant::now();
        Ok(())
    }
}

impl Chunk {
    /// One past the last index that may belong to it.
    fn end(&self) -> u64 {
        (self.first_index / CHUNK + 1).saturating_mul(CHUNK)
    }
}
