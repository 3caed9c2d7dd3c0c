//! From samples to vertex buffers: a thread of each film sorts its chunks and copies them into the buffers that frames in flight read.
//!
//! ```text
//! loop: push ─▶ chunk ─▶ send ═ chunks ═▶ thread: sort, copy, end the batch ═ batches ═▶ loop: draw, submitted ─▶ spare buffers ─▶ thread
//! ```
//!
//! The thread alone decides where a batch ends: after its last chunk, where its samples are too dense, or where it is asked to. So the
//! batches depend on the samples and on their order, and not on how fast the thread is.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use crate::client::error::ClientError;
use crate::client::settings::{CHUNK_SAMPLES, FilmSpec};
use crate::client::sorting::{SampleSorter, StreamRange};
use crate::gpu::{Buffer, BufferUse, FrameNumber, Gpu};
use crate::stream::Sample;

/// Bytes of a vertex.
pub const STRIDE: usize = size_of::<Sample>();

/// Chunks that the thread may have at most: one that it sorts, and the next. Whoever asks for the batch waits for them.
pub const MOST_PENDING: usize = 2;

/// Vertices in one of the buffers of a batch.
struct VertexRange {
    buffer: usize,
    range: Range<u32>,
}

/// Vertices of one stream of a batch; none of the ranges is empty.
#[derive(Default)]
struct StreamVertices {
    /// All samples.
    all: Vec<VertexRange>,
    /// Those outside of dense cells.
    single: Vec<VertexRange>,
    /// What the others were merged to, at positions in padded texels.
    merged: Vec<VertexRange>,
}

/// The part of a stream's samples that a draw takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexPart {
    /// All samples.
    All,
    /// Those outside of dense cells.
    Single,
    /// What the others were merged to, at positions in padded texels.
    Merged,
}

/// What a film knows when it sends a chunk. The batch that ends with the chunk is drawn with it, however late: so the sums do not depend on
/// how fast the thread is.
#[derive(Clone, Copy, Debug)]
pub struct BatchSnapshot {
    /// Samples of the camera and of the light stream so far.
    pub samples: [u64; 2],
    /// The luminance scale.
    pub scale: f32,
}

/// The samples of a batch in mapped buffers. Dropping it gives the buffers back.
pub struct VertexBatch {
    pool: Arc<BufferPool>,
    /// Each holds a chunk.
    buffers: Vec<Buffer>,
    /// Camera and light.
    streams: [StreamVertices; 2],
    /// Number of its samples, with those outside of the target.
    samples: usize,
    /// When its last chunk was sent.
    moment: BatchSnapshot,
    /// Whether it has all of its samples.
    is_whole: bool,
    /// The frame that reads it; 0 before there is one.
    frame: FrameNumber,
}

impl VertexBatch {
    fn new(pool: &Arc<BufferPool>, moment: BatchSnapshot) -> Self {
        let (buffers, streams, frame) = Default::default();
        Self { pool: pool.clone(), buffers, streams, samples: 0, moment, is_whole: false, frame }
    }

    /// When its last chunk was sent.
    pub fn moment(&self) -> BatchSnapshot {
        self.moment
    }

    /// Number of its samples, with those outside of the target, which are not drawn.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Whether a stream, 0 of the camera and 1 of light, has no samples to be drawn.
    pub fn is_empty(&self, stream: usize) -> bool {
        self.streams[stream].all.is_empty()
    }

    /// Buffers and ranges of vertices of a part of a stream.
    pub fn ranges(&self, stream: usize, part: VertexPart) -> impl Iterator<Item = (&Buffer, &Range<u32>)> {
        let vertices = &self.streams[stream];
        let ranges = match part {
            VertexPart::All => &vertices.all,
            VertexPart::Single => &vertices.single,
            VertexPart::Merged => &vertices.merged,
        };
        ranges.iter().map(|VertexRange { buffer, range }| (&self.buffers[*buffer], range))
    }

    /// Gives the buffers back, which `frame` reads.
    pub fn submitted(mut self, frame: FrameNumber) {
        self.frame = frame;
    }

    /// Copies samples into another buffer, once the device has finished with it; returns its index. For no samples there is no buffer.
    fn copy(&mut self, gpu: &Arc<Gpu>, samples: &[Sample]) -> Result<usize, ClientError> {
        if !samples.is_empty() {
            let mut buffer = self.pool.take(gpu, self.buffers.len())?;
            buffer.mapped_mut()[..size_of_val(samples)].copy_from_slice(bytemuck::cast_slice(samples));
            self.buffers.push(buffer);
        }
        Ok(self.buffers.len().saturating_sub(1))
    }

    /// Notes that it has all of its samples, and its buffers as ones that come back once it is drawn.
    fn end(mut self, moment: BatchSnapshot) -> Self {
        (self.is_whole, self.moment) = (true, moment);
        self.pool.locked().undrawn += self.buffers.len();
        self
    }
}

impl Drop for VertexBatch {
    fn drop(&mut self) {
        let mut spare = self.pool.locked();
        if self.is_whole {
            spare.undrawn -= self.buffers.len();
        }
        if self.frame > FrameNumber::default() {
            spare.busy = self.buffers.len();
        }
        for buffer in self.buffers.drain(..) {
            match self.frame > FrameNumber::default() {
                true => spare.buffers.push_back((buffer, self.frame)),
                false => spare.buffers.push_front((buffer, self.frame)),
            }
        }
        self.pool.returned.notify_one();
    }
}

/// The buffers that are in no batch.
#[derive(Default)]
struct BufferPool {
    spare: Mutex<SpareBuffers>,
    /// Rings when buffers come back.
    returned: Condvar,
}

#[derive(Default)]
struct SpareBuffers {
    /// Each with the last frame that reads it; those that have rested longest come first.
    buffers: VecDeque<(Buffer, FrameNumber)>,
    /// Number of those in whole batches that were not drawn yet.
    undrawn: usize,
    /// Number of those of the batch that was drawn last.
    busy: usize,
}

impl BufferPool {
    fn locked(&self) -> MutexGuard<'_, SpareBuffers> {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The spare buffers, once there is one, no batch is to be drawn that would give some back, or it is not `wanted`.
    fn rested(&self, wanted: impl Fn(&SpareBuffers) -> bool) -> MutexGuard<'_, SpareBuffers> {
        let must_wait =
            |spare: &mut SpareBuffers| spare.buffers.is_empty() && spare.undrawn > 0 && wanted(spare);
        self.returned.wait_while(self.locked(), must_wait).unwrap_or_else(PoisonError::into_inner)
    }

    /// A buffer for a batch that has so many, once the device has finished with it. There is one more than those of the last batch, where
    /// there is memory: it is filled while the device reads those. Therefore a whole batch is waited for until it is drawn.
    fn take(&self, gpu: &Arc<Gpu>, filled: usize) -> Result<Buffer, ClientError> {
        let count = |spare: &SpareBuffers| spare.buffers.len() + spare.undrawn + filled;
        let (rested, number) = {
            let mut spare = self.rested(|spare| count(spare) > spare.busy);
            let number = count(&spare);
            (if number > spare.busy { spare.buffers.pop_front() } else { None }, number)
        };
        let make = || {
            let name = format!("samples {number}");
            Buffer::new(gpu, &name, BufferUse::Vertices, CHUNK_SAMPLES * STRIDE)
        };
        let (buffer, frame) = match rested {
            Some(rested) => rested,
            None => match make() {
                Ok(made) => return Ok(made),
                Err(error) => self.rested(|_| true).buffers.pop_front().ok_or(error)?,
            },
        };
        if frame > FrameNumber::default() {
            gpu.wait(frame)?;
        }
        Ok(buffer)
    }
}

/// Samples for the thread.
struct SentChunk {
    samples: Vec<Sample>,
    moment: BatchSnapshot,
    /// Whether the batch ends with it although it is not full.
    is_last: bool,
    /// The number of times that all samples were forgotten before it.
    epoch: u64,
}

/// What has become of a chunk.
struct StoredChunk {
    /// The memory of its samples.
    samples: Vec<Sample>,
    /// The batch that has ended with it; `None` where it has not or there is nothing in it. The number of samples beside an error is that
    /// of those that are lost.
    outcome: Result<Option<VertexBatch>, (ClientError, usize)>,
    epoch: u64,
}

/// The loop's end of the thread that makes the batches of a film. Dropping it ends the thread.
pub struct Uploader {
    /// The chunk that is being filled, and the memory of others.
    chunk: Vec<Sample>,
    empty: Vec<Vec<Sample>>,
    /// Number of times that all samples were forgotten: the thread leaves out chunks from before.
    epoch: Arc<AtomicU64>,
    /// Chunks that were sent and whose outcome was not fetched.
    pending: usize,
    /// `None` while it is dropped.
    chunks: Option<Sender<SentChunk>>,
    stored: Option<Receiver<StoredChunk>>,
    thread: Option<JoinHandle<()>>,
}

impl Uploader {
    /// No samples, and a thread that sleeps; buffers are made when they are needed.
    ///
    /// # Errors
    ///
    /// [`ClientError::Threads`].
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, ClientError> {
        let (chunks, incoming) = channel();
        let (outgoing, stored) = channel();
        let epoch = Arc::<AtomicU64>::default();
        let mut maker = BatchMaker::new(gpu, spec, &epoch);
        let thread = thread::Builder::new()
            .name("upload".into())
            .spawn(move || maker.run(&incoming, &outgoing))
            .map_err(|error| ClientError::Threads { threads: 1, reason: error.to_string() })?;
        Ok(Self {
            chunk: Vec::new(),
            empty: Vec::new(),
            epoch,
            pending: 0,
            chunks: Some(chunks),
            stored: Some(stored),
            thread: Some(thread),
        })
    }

    /// Adds one valid sample; when the chunk [is full](Self::is_chunk_full), [`send`](Self::send) must be next.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        self.chunk.push(sample);
    }

    /// Whether the chunk is full.
    #[inline]
    pub fn is_chunk_full(&self) -> bool {
        self.chunk.len() >= CHUNK_SAMPLES
    }

    /// Hands the chunk to the thread, with which the batch ends if `is_last`. [`next_batch`](Self::next_batch) must be next.
    pub fn send(&mut self, moment: BatchSnapshot, is_last: bool) {
        let samples = std::mem::replace(&mut self.chunk, self.empty.pop().unwrap_or_default());
        let epoch = self.epoch.load(Ordering::Relaxed);
        // A thread that has panicked is found when the outcome is fetched.
        let _ = self.chunks.as_ref().map(|chunks| chunks.send(SentChunk { samples, moment, is_last, epoch }));
        self.pending += 1;
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.chunk.clear();
        self.epoch.fetch_add(1, Ordering::Relaxed);
    }

    /// The next batch that has ended, in order; `None` where the thread has no more than `pending` chunks left and nothing is ready. Beside
    /// an error is the number of samples that are lost; there may be more batches after it.
    pub fn next_batch(&mut self, pending: usize) -> Option<Result<VertexBatch, (ClientError, usize)>> {
        while self.pending > 0 {
            let stored = self.stored.as_ref()?;
            let received = match self.pending > pending {
                true => stored.recv().map_err(|_| TryRecvError::Disconnected),
                false => stored.try_recv(),
            };
            let StoredChunk { mut samples, outcome, epoch } = match received {
                Ok(stored) => stored,
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => {
                    self.pending = 0;
                    // All that wait.
                    return Some(Err((ClientError::SorterPanicked, usize::MAX)));
                }
            };
            self.pending -= 1;
            samples.clear();
            self.empty.push(samples);
            if epoch == self.epoch.load(Ordering::Relaxed)
                && let Some(outcome) = outcome.transpose()
            {
                return Some(outcome);
            }
        }
        None
    }
}

impl Drop for Uploader {
    fn drop(&mut self) {
        // With the batches that were not fetched: the thread may wait for their buffers.
        (self.chunks, self.stored) = (None, None);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// What the thread does: sorts chunks into the buffers of a batch.
struct BatchMaker {
    gpu: Arc<Gpu>,
    spec: FilmSpec,
    sorter: SampleSorter,
    pool: Arc<BufferPool>,
    /// The batch that is being filled; `None` before its first chunk.
    batch: Option<VertexBatch>,
    /// That of the batch, and the present one.
    batch_epoch: u64,
    epoch: Arc<AtomicU64>,
}

impl BatchMaker {
    fn new(gpu: &Arc<Gpu>, spec: &FilmSpec, epoch: &Arc<AtomicU64>) -> Self {
        let (sorter, pool) = Default::default();
        Self {
            gpu: gpu.clone(),
            spec: *spec,
            sorter,
            pool,
            batch: None,
            batch_epoch: 0,
            epoch: epoch.clone(),
        }
    }

    fn run(&mut self, chunks: &Receiver<SentChunk>, stored: &Sender<StoredChunk>) {
        for chunk in chunks {
            let epoch = chunk.epoch;
            if std::mem::replace(&mut self.batch_epoch, epoch) != epoch {
                self.batch = None;
            }
            let is_stale = epoch != self.epoch.load(Ordering::Relaxed);
            let outcome = if is_stale { Ok(None) } else { self.store(&chunk) };
            if stored.send(StoredChunk { samples: chunk.samples, outcome, epoch }).is_err() {
                break;
            }
        }
    }

    /// Adds a chunk to the batch; returns the batch if it ends with it and has samples. With an error the batch is lost.
    fn store(&mut self, chunk: &SentChunk) -> Result<Option<VertexBatch>, (ClientError, usize)> {
        let SentChunk { samples, moment, is_last, .. } = chunk;
        let mut batch = self.batch.take().unwrap_or_else(|| {
            self.sorter.begin(&self.spec);
            VertexBatch::new(&self.pool, *moment)
        });
        batch.samples += samples.len();
        let (sorted, ranges) = self.sorter.sort(&self.spec, samples);
        let buffer = batch.copy(&self.gpu, sorted).map_err(|error| (error, batch.samples))?;
        for (stream, StreamRange { all, single }) in batch.streams.iter_mut().zip(ranges) {
            let part = |range: Range<u32>| (!range.is_empty()).then_some(VertexRange { buffer, range });
            stream.all.extend(part(all));
            stream.single.extend(part(single));
        }
        if !is_last && batch.samples < self.spec.batch_capacity() && !self.sorter.is_too_dense() {
            self.batch = Some(batch);
            return Ok(None);
        }
        if batch.samples == 0 {
            return Ok(None);
        }
        for (stream, merged) in self.sorter.merged().into_iter().enumerate() {
            for samples in merged.chunks(CHUNK_SAMPLES) {
                let buffer = batch.copy(&self.gpu, samples).map_err(|error| (error, batch.samples))?;
                let range = 0..samples.len() as u32;
                batch.streams[stream].merged.push(VertexRange { buffer, range });
            }
        }
        Ok(Some(batch.end(*moment)))
    }
}
