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

/// The samples of a batch in mapped buffers. Dropping it gives the buffers back.
pub struct VertexBatch {
    pool: Arc<BufferPool>,
    /// Each holds a chunk.
    buffers: Vec<Buffer>,
    /// Camera and light.
    streams: [StreamVertices; 2],
    /// Number of its samples, with those outside of the target.
    samples: usize,
    /// Whether it has all of its samples.
    is_whole: bool,
    /// The frame that reads it; 0 before there is one.
    frame: FrameNumber,
}

impl VertexBatch {
    fn new(pool: &Arc<BufferPool>) -> Self {
        let (buffers, streams, frame) = Default::default();
        Self { pool: pool.clone(), buffers, streams, samples: 0, is_whole: false, frame }
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

    /// Copies samples into another buffer, once the device has finished with it; returns its index.
    fn copy(&mut self, gpu: &Arc<Gpu>, samples: &[Sample]) -> Result<usize, ClientError> {
        if !samples.is_empty() {
            let mut buffer = self.pool.take(gpu, self.buffers.len())?;
            buffer.mapped_mut()[..size_of_val(samples)].copy_from_slice(bytemuck::cast_slice(samples));
            self.buffers.push(buffer);
        }
        Ok(self.buffers.len().saturating_sub(1))
    }

    /// Notes that it has all of its samples.
    fn end(mut self) -> Self {
        self.is_whole = true;
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

    /// A buffer for a batch that has so many, once the device has finished with it. There is one more than those of the last batch, where
    /// there is memory: it is filled while the device reads those. For that matter a whole batch is waited for until it is drawn.
    fn take(&self, gpu: &Arc<Gpu>, filled: usize) -> Result<Buffer, ClientError> {
        let must_wait = |spare: &mut SpareBuffers| {
            let count = spare.buffers.len() + spare.undrawn + filled;
            spare.buffers.is_empty() && spare.undrawn > 0 && count > spare.busy
        };
        let spare = self.locked();
        let mut spare = self.returned.wait_while(spare, must_wait).unwrap_or_else(PoisonError::into_inner);
        let count = spare.buffers.len() + spare.undrawn + filled;
        let rested = if count > spare.busy { spare.buffers.pop_front() } else { None };
        drop(spare);
        let (buffer, frame) = match rested {
            Some(rested) => rested,
            None => match Buffer::new(
                gpu,
                &format!("samples {count}"),
                BufferUse::Vertices,
                CHUNK_SAMPLES * STRIDE,
            ) {
                Ok(made) => return Ok(made),
                Err(error) => self.locked().buffers.pop_front().ok_or(error)?,
            },
        };
        if frame > FrameNumber::default() {
            gpu.wait(frame)?;
        }
        Ok(buffer)
    }
}

/// Samples for the thread.
struct Chunk {
    samples: Vec<Sample>,
    /// Whether the batch ends with it although it is not full.
    is_last: bool,
    /// The number of times that all samples were forgotten before it.
    epoch: u64,
}

/// What has become of a chunk.
struct Stored {
    /// The memory of its samples.
    samples: Vec<Sample>,
    /// The batch that has ended with it; `None` where it has not or there is nothing in it. The number of samples beside an error is that
    /// of those that are lost.
    outcome: Result<Option<VertexBatch>, (ClientError, usize)>,
    epoch: u64,
}

/// The loop's end of the thread that makes the batches of a film.
pub struct Uploader {
    gpu: Arc<Gpu>,
    spec: FilmSpec,
    /// The chunk that is being filled, and the memory of others.
    chunk: Vec<Sample>,
    empty: Vec<Vec<Sample>>,
    epoch: u64,
    /// Chunks that the thread has and has not answered for.
    pending: usize,
    /// Started with the first chunk.
    thread: Option<UploadThread>,
}

struct UploadThread {
    chunks: Option<Sender<Chunk>>,
    stored: Option<Receiver<Stored>>,
    handle: Option<JoinHandle<()>>,
}

impl Uploader {
    /// No samples; thread and buffers are made when they are needed.
    pub fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Self {
        let (chunk, empty) = Default::default();
        Self { gpu: gpu.clone(), spec: *spec, chunk, empty, epoch: 0, pending: 0, thread: None }
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
    ///
    /// # Errors
    ///
    /// [`ClientError::Threads`] when the thread cannot be started; the samples wait.
    pub fn send(&mut self, is_last: bool) -> Result<(), ClientError> {
        let thread = match &mut self.thread {
            Some(thread) => thread,
            empty => empty.insert(UploadThread::start(&self.gpu, &self.spec)?),
        };
        let empty = self.empty.pop().unwrap_or_else(|| Vec::with_capacity(CHUNK_SAMPLES));
        let samples = std::mem::replace(&mut self.chunk, empty);
        thread.send(Chunk { samples, is_last, epoch: self.epoch });
        self.pending += 1;
        Ok(())
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.chunk.clear();
        self.epoch += 1;
    }

    /// The next batch that has ended, in order; `None` where the thread has no more than `pending` chunks left and nothing is ready. After an
    /// error, beside which is the number of samples that are lost, there may be more.
    pub fn next_batch(&mut self, pending: usize) -> Option<Result<VertexBatch, (ClientError, usize)>> {
        while self.pending > 0 {
            let stored = self.thread.as_ref()?.stored.as_ref()?;
            let received = match self.pending > pending {
                true => stored.recv().map_err(|_| TryRecvError::Disconnected),
                false => stored.try_recv(),
            };
            if matches!(received, Err(TryRecvError::Empty)) {
                return None;
            }
            let Stored { mut samples, outcome, epoch } =
                received.expect("the thread answers for every chunk");
            self.pending -= 1;
            samples.clear();
            self.empty.push(samples);
            if epoch == self.epoch
                && let Some(outcome) = outcome.transpose()
            {
                return Some(outcome);
            }
        }
        None
    }
}

impl UploadThread {
    fn start(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, ClientError> {
        let (chunks, incoming) = channel();
        let (outgoing, stored) = channel();
        let (gpu, spec) = (gpu.clone(), *spec);
        let work = move || BatchMaker::new(gpu, spec).run(&incoming, &outgoing);
        let handle = thread::Builder::new()
            .name("upload".into())
            .spawn(work)
            .map_err(|error| ClientError::Threads { threads: 1, reason: error.to_string() })?;
        Ok(Self { chunks: Some(chunks), stored: Some(stored), handle: Some(handle) })
    }

    fn send(&self, chunk: Chunk) {
        // The thread goes on until the sender is dropped.
        let _ = self.chunks.as_ref().map(|chunks| chunks.send(chunk));
    }
}

impl Drop for UploadThread {
    fn drop(&mut self) {
        // With the batches that were not fetched: the thread may wait for their buffers.
        (self.chunks, self.stored) = (None, None);
        let _ = self.handle.take().map(JoinHandle::join);
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
    epoch: u64,
}

impl BatchMaker {
    fn new(gpu: Arc<Gpu>, spec: FilmSpec) -> Self {
        let (sorter, pool) = Default::default();
        Self { gpu, spec, sorter, pool, batch: None, epoch: 0 }
    }

    fn run(&mut self, chunks: &Receiver<Chunk>, stored: &Sender<Stored>) {
        for Chunk { samples, is_last, epoch } in chunks {
            if std::mem::replace(&mut self.epoch, epoch) != epoch {
                self.batch = None;
            }
            let outcome = self.store(&samples, is_last);
            if stored.send(Stored { samples, outcome, epoch }).is_err() {
                break;
            }
        }
    }

    /// Adds a chunk to the batch; returns the batch if it ends with it and has samples.
    fn store(
        &mut self,
        samples: &[Sample],
        is_last: bool,
    ) -> Result<Option<VertexBatch>, (ClientError, usize)> {
        let batch = match &mut self.batch {
            Some(batch) => batch,
            empty => {
                self.sorter.begin(&self.spec);
                empty.insert(VertexBatch::new(&self.pool))
            }
        };
        let (sorted, ranges) = self.sorter.sort(&self.spec, samples);
        match batch.copy(&self.gpu, sorted) {
            Ok(buffer) => {
                batch.samples += samples.len();
                for (stream, StreamRange { all, single }) in batch.streams.iter_mut().zip(ranges) {
                    let part =
                        |range: Range<u32>| (!range.is_empty()).then_some(VertexRange { buffer, range });
                    stream.all.extend(part(all));
                    stream.single.extend(part(single));
                }
            }
            // The batch goes on without them.
            Err(error) if !is_last => return Err((error, samples.len())),
            Err(error) => {
                let lost = batch.samples + samples.len();
                self.batch = None;
                return Err((error, lost));
            }
        }
        if !is_last && batch.samples < self.spec.batch_capacity() && !self.sorter.is_too_dense() {
            return Ok(None);
        }
        let Some(mut batch) = self.batch.take().filter(|batch| batch.samples > 0) else { return Ok(None) };
        for (stream, merged) in self.sorter.merged().into_iter().enumerate() {
            for samples in merged.chunks(CHUNK_SAMPLES) {
                let buffer = batch.copy(&self.gpu, samples).map_err(|error| (error, batch.samples))?;
                let range = 0..samples.len() as u32;
                batch.streams[stream].merged.push(VertexRange { buffer, range });
            }
        }
        Ok(Some(batch.end()))
    }
}
