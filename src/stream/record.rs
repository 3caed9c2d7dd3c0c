//! A stream on disk: the client runs from it without a tracer, and a run can be looked at afterwards.
//!
//! Little-endian. The eight bytes [`MAGIC`], then for each block: epoch, first index, index count, camera paths, light
//! paths (u64 each), the count of each rejection [`Cause`] (u64 each), the number of rejection examples and of samples
//! (u32 each), the examples (u64 index, u32 cause), the samples (six f32: u, v, x, y, z, w).

use std::io::{self, Read, Write};

use crate::color::Xyz;
use crate::stream::block::{BLOCK_SAMPLES, Block, Header};
use crate::stream::control::Epoch;
use crate::stream::rejected::{Cause, EXAMPLES, Rejections};
use crate::stream::sample::Sample;
use crate::stream::sink::PathCounts;

/// The first bytes of a record: name and version.
pub const MAGIC: [u8; 8] = *b"PTSTRM\x00\x02";

/// More paths than any block counts, few enough that a client's sums cannot overflow.
const MAX_PATHS: u64 = 1 << 32;

const WORDS: usize = 5 + Cause::ALL.len();

/// What may be wrong with a record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file could not be written.
    #[error("record: cannot write block {block}: {source}; is the disk full?")]
    Write {
        /// Blocks written before.
        block: u64,
        /// Why.
        source: io::Error,
    },
    /// The file could not be read or ends too early.
    #[error("record: cannot read block {block}: {source}; the file was cut short or the disk fails")]
    Read {
        /// Blocks read before.
        block: u64,
        /// Why.
        source: io::Error,
    },
    /// The first bytes are not [`MAGIC`].
    #[error("record: not a sample stream of this version; record it again")]
    Magic,
    /// The block breaks a rule of the stream.
    #[error("record: block {block} is damaged: {what}; record the stream again")]
    Damaged {
        /// Blocks read before.
        block: u64,
        /// Which rule.
        what: &'static str,
    },
}

/// Writes blocks. Give it a buffered writer; it flushes nothing by itself.
#[derive(Debug)]
pub struct Recorder<W> {
    out: W,
    blocks: u64,
}

impl<W: Write> Recorder<W> {
    /// Begins a record.
    ///
    /// # Errors
    ///
    /// [`RecordError::Write`].
    pub fn new(mut out: W) -> Result<Self, RecordError> {
        out.write_all(&MAGIC).map_err(|source| RecordError::Write { block: 0, source })?;
        Ok(Self { out, blocks: 0 })
    }

    /// Appends one block.
    ///
    /// # Errors
    ///
    /// [`RecordError::Write`]; the record then ends in half a block.
    pub fn block(&mut self, block: &Block) -> Result<(), RecordError> {
        let Header { epoch, first_index, index_count, paths, rejections } = &block.header;
        let mut bytes = Vec::with_capacity(256 + 24 * block.samples().len());
        for word in [epoch.0, *first_index, *index_count, paths.camera, paths.light] {
            bytes.extend(word.to_le_bytes());
        }
        for cause in Cause::ALL {
            bytes.extend(rejections.count(cause).to_le_bytes());
        }
        bytes.extend((rejections.examples().len() as u32).to_le_bytes());
        bytes.extend((block.samples().len() as u32).to_le_bytes());
        for (index, cause) in rejections.examples() {
            bytes.extend(index.to_le_bytes());
            bytes.extend((*cause as u32).to_le_bytes());
        }
        for Sample { uv: [u, v], xyz: Xyz { x, y, z }, w } in block.samples() {
            for value in [u, v, x, y, z, w] {
                bytes.extend(value.to_le_bytes());
            }
        }
        let block = self.blocks;
        self.blocks += 1;
        self.out.write_all(&bytes).map_err(|source| RecordError::Write { block, source })
    }

    /// Gives the writer back.
    pub fn into_inner(self) -> W {
        self.out
    }
}

/// Reads blocks. Give it a buffered reader. Whatever the file holds, what comes out keeps the rules of the stream, and
/// memory stays that of one block.
#[derive(Debug)]
pub struct Player<R> {
    input: R,
    block: Box<Block>,
    blocks: u64,
}

impl<R: Read> Player<R> {
    /// Opens a record.
    ///
    /// # Errors
    ///
    /// [`RecordError::Read`], [`RecordError::Magic`].
    pub fn new(mut input: R) -> Result<Self, RecordError> {
        let mut magic = [0; MAGIC.len()];
        input.read_exact(&mut magic).map_err(|source| RecordError::Read { block: 0, source })?;
        if magic != MAGIC {
            return Err(RecordError::Magic);
        }
        Ok(Self { input, block: Box::default(), blocks: 0 })
    }

    /// The next block, or `None` at the end.
    ///
    /// # Errors
    ///
    /// [`RecordError::Read`], [`RecordError::Damaged`]. Do not go on after an error.
    pub fn next_block(&mut self) -> Result<Option<&Block>, RecordError> {
        let mut head = [0; 8 * WORDS + 8];
        // The end of the file is in order only before the first byte of a block.
        let first = self.input.by_ref().take(1).read(&mut head).map_err(|source| self.read_error(source))?;
        if first == 0 {
            return Ok(None);
        }
        self.fill(&mut head[1..])?;
        let word = |n: usize| u64::from_le_bytes(array(&head[8 * n..]));
        let half = |n: usize| u32::from_le_bytes(array(&head[8 * WORDS + 4 * n..])) as usize;
        let (examples, samples) = (half(0), half(1));
        if examples > EXAMPLES || samples > BLOCK_SAMPLES {
            return Err(self.damaged("more samples or examples than a block holds"));
        }
        let rejections = self.rejections(std::array::from_fn(|n| word(5 + n)), examples)?;
        let (epoch, first_index, index_count) = (Epoch(word(0)), word(1), word(2));
        if first_index.checked_add(index_count).is_none() {
            return Err(self.damaged("indices beyond 2^64"));
        }
        let paths = PathCounts { camera: word(3), light: word(4) };
        if paths.camera.max(paths.light) > MAX_PATHS {
            return Err(self.damaged("more paths than a block can stand for"));
        }
        self.block.restart(epoch, first_index);
        self.block.header = Header { epoch, first_index, index_count, paths, rejections };
        self.samples(samples)?;
        self.blocks += 1;
        Ok(Some(&self.block))
    }

    fn rejections(
        &mut self,
        counts: [u64; Cause::ALL.len()],
        examples: usize,
    ) -> Result<Rejections, RecordError> {
        let mut list = Vec::with_capacity(examples);
        for _ in 0..examples {
            let mut bytes = [0; 12];
            self.fill(&mut bytes)?;
            let cause = u32::from_le_bytes(array(&bytes[8..])) as usize;
            let cause = Cause::ALL.get(cause).ok_or_else(|| self.damaged("an unknown cause of rejection"))?;
            list.push((u64::from_le_bytes(array(&bytes)), *cause));
        }
        Ok(Rejections::from_parts(counts, list))
    }

    fn samples(&mut self, count: usize) -> Result<(), RecordError> {
        for _ in 0..count {
            let mut bytes = [0; 24];
            self.fill(&mut bytes)?;
            let value = |n: usize| f32::from_le_bytes(array(&bytes[4 * n..]));
            let uv = [value(0), value(1)];
            let sample = Sample { uv, xyz: Xyz::new(value(2), value(3), value(4)), w: value(5) };
            let weight_ok = sample.w == -1.0 || sample.w > 0.0;
            if !(weight_ok && sample.in_range() && uv[0].is_finite() && uv[1].is_finite()) {
                return Err(self.damaged("a sample that breaks the sign rule, is too large or not finite"));
            }
            self.block.push(sample);
        }
        Ok(())
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), RecordError> {
        self.input.read_exact(bytes).map_err(|source| self.read_error(source))
    }

    fn read_error(&self, source: io::Error) -> RecordError {
        RecordError::Read { block: self.blocks, source }
    }

    fn damaged(&self, what: &'static str) -> RecordError {
        RecordError::Damaged { block: self.blocks, what }
    }
}

/// The first bytes of a slice that is long enough.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|n| bytes[n])
}
