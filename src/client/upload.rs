//! Staging of samples: a thread per film sorts its chunks and copies them into the vertex buffers that frames in flight read.
//!
//! ```text
//! loop: push ─▶ chunk ─▶ send ═ chunks ═▶ thread: sort, copy, end the batch ═ batches ═▶ loop: draw, submitted ─▶ spare buffers ─▶ thread
//! ```
//!
//! The thread alone decides where a batch ends: after its last chunk, when samples are too dense, or on request. Hence batches depend only
//! on the samples and their order, not on the speed of the thread.

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

/// Most chunks in the queue: one being sorted, and the next. Flushing the batch waits for them.
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
    /// Samples outside of dense cells.
    single: Vec<VertexRange>,
    /// Merged samples of dense cells, at positions in padded texels.
    merged: Vec<VertexRange>,
}

/// Part of a stream's samples to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexPart {
    /// All samples.
    All,
    /// Samples outside of dense cells.
    Single,
    /// Merged samples of dense cells, at positions in padded texels.
    Merged,
}

/// State of the film when it sends a chunk. A batch that ends with the chunk is drawn with this state, however late, so that the sums do
/// not depend on the speed of the thread.
#[derive(Clone, Copy, Debug)]
pub struct BatchSnapshot {
    /// Samples of the camera and of the light stream so far.
    pub samples: [u64; 2],
    /// The luminance scale.
    pub scale: f32,
}

/// Samples of a batch in mapped buffers. Dropping the batch returns the buffers to the pool.
pub struct VertexBatch {
    pool: Arc<BufferPool>,
    /// One buffer per chunk.
    buffers: Vec<Buffer>,
    /// Camera and light.
    streams: [StreamVertices; 2],
    /// Number of samples, including those outside of the target.
    samples: usize,
    /// State of the film when the last chunk was sent.
    moment: BatchSnapshot,
    /// Whether all of its samples are present.
    is_whole: bool,
    /// The frame that reads the buffers; 0 before there is one.
    frame: FrameNumber,
}

impl VertexBatch {
    fn new(pool: &Arc<BufferPool>, moment: BatchSnapshot) -> Self {
        let (buffers, streams, frame) = Default::default();
        Self { pool: pool.clone(), buffers, streams, samples: 0, moment, is_whole: false, frame }
    }

    /// State of the film when the last chunk was sent.
    pub fn moment(&self) -> BatchSnapshot {
        self.moment
    }

    /// Number of samples, including those outside of the target, which are not drawn.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Whether a stream (0 camera, 1 light) has no samples to draw.
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

    /// Returns the buffers to the pool, to be reused once `frame` has completed.
    pub fn submitted(mut self, frame: FrameNumber) {
        self.frame = frame;
    }

    /// Copies samples into a buffer that the device has finished with; returns its index. Without samples no buffer is used.
    fn copy(&mut self, gpu: &Arc<Gpu>, samples: &[Sample]) -> Result<usize, ClientError> {
        if !samples.is_empty() {
            let mut buffer = self.pool.take(gpu, self.buffers.len())?;
            buffer.mapped_mut()[..size_of_val(samples)].copy_from_slice(bytemuck::cast_slice(samples));
            self.buffers.push(buffer);
        }
        Ok(self.buffers.len().saturating_sub(1))
    }

    /// Marks the batch as complete, and its buffers as ones that will return once it is drawn.
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

/// Pool of buffers that are in no batch.
#[derive(Default)]
struct BufferPool {
    spare: Mutex<SpareBuffers>,
    /// Signalled when buffers return.
    returned: Condvar,
}

#[derive(Default)]
struct SpareBuffers {
    /// Each with the last frame that reads it; least recently used first.
    buffers: VecDeque<(Buffer, FrameNumber)>,
    /// Number of buffers in complete batches that were not drawn yet.
    undrawn: usize,
    /// Number of buffers of the batch drawn last.
    busy: usize,
}

impl BufferPool {
    fn locked(&self) -> MutexGuard<'_, SpareBuffers> {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until there is a spare buffer, until no undrawn batch could return one, or until none is `wanted`.
    fn rested(&self, wanted: impl Fn(&SpareBuffers) -> bool) -> MutexGuard<'_, SpareBuffers> {
        let must_wait =
            |spare: &mut SpareBuffers| spare.buffers.is_empty() && spare.undrawn > 0 && wanted(spare);
        self.returned.wait_while(self.locked(), must_wait).unwrap_or_else(PoisonError::into_inner)
    }

    /// A buffer for a batch that has `filled` buffers, once the device has finished with it. If memory allows, the pool has one buffer more
    /// than the last batch, which is filled while the device reads the others (double buffering). Therefore this waits until a complete
    /// batch is drawn.
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

/// A chunk for the thread.
struct SentChunk {
    samples: Vec<Sample>,
    moment: BatchSnapshot,
    /// Whether the batch ends with this chunk although it is not full.
    is_last: bool,
    /// Number of times that the film was cleared before it.
    epoch: u64,
}

/// Outcome of a chunk.
struct StoredChunk {
    /// The memory of its samples, to be reused.
    samples: Vec<Sample>,
    /// The batch that ended with the chunk; `None` if none did or it is empty. With an error: the number of lost samples.
    outcome: Result<Option<VertexBatch>, (ClientError, usize)>,
    epoch: u64,
}

/// Handle to the thread that makes the batches of a film. Dropping it ends the thread.
pub struct Uploader {
    /// The chunk being filled, and spare memory for others.
    chunk: Vec<Sample>,
    empty: Vec<Vec<Sample>>,
    /// Number of times that the film was cleared; the thread skips chunks from before.
    epoch: Arc<AtomicU64>,
    /// Chunks sent whose outcome has not been fetched.
    pending: usize,
    /// `None` while the handle is being dropped.
    chunks: Option<Sender<SentChunk>>,
    stored: Option<Receiver<StoredChunk>>,
    thread: Option<JoinHandle<()>>,
}

impl Uploader {
    /// A thread without work; buffers are allocated on demand.
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

    /// Adds one valid sample. When [`is_chunk_full`](Self::is_chunk_full) returns true, [`send`](Self::send) must be called next.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        self.chunk.push(sample);
    }

    /// Whether the chunk is full.
    #[inline]
    pub fn is_chunk_full(&self) -> bool {
        self.chunk.len() >= CHUNK_SAMPLES
    }

    /// Sends the chunk to the thread; the batch ends with it if `is_last`. [`next_batch`](Self::next_batch) must be called next.
    pub fn send(&mut self, moment: BatchSnapshot, is_last: bool) {
        let samples = std::mem::replace(&mut self.chunk, self.empty.pop().unwrap_or_default());
        let epoch = self.epoch.load(Ordering::Relaxed);
        // A panic of the thread is reported when the outcome is fetched.
        let _ = self.chunks.as_ref().map(|chunks| chunks.send(SentChunk { samples, moment, is_last, epoch }));
        self.pending += 1;
    }

    /// Discards all samples.
    pub fn clear(&mut self) {
        self.chunk.clear();
        self.epoch.fetch_add(1, Ordering::Relaxed);
    }

    /// The next finished batch, in order; `None` once the thread has at most `pending` chunks left and no batch is ready. An error comes
    /// with the number of lost samples; more batches may follow it.
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
                    // All waiting samples.
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
        // Batches not fetched are dropped too, since the thread may be waiting for their buffers.
        (self.chunks, self.stored) = (None, None);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Work of the thread: sorts chunks into the buffers of a batch.
struct BatchMaker {
    gpu: Arc<Gpu>,
    spec: FilmSpec,
    sorter: SampleSorter,
    pool: Arc<BufferPool>,
    /// The batch being filled; `None` before its first chunk.
    batch: Option<VertexBatch>,
    /// Epoch of the batch, and the present one.
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

    /// Adds a chunk to the batch; returns the batch if it ends with the chunk and is not empty. On an error the batch is lost.
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
