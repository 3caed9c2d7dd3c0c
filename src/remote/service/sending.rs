//! The writing thread of a connection to a viewer: it drains the lanes of the tracer and sends what the viewer has given credit for.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::{Host, LOOK, Tracing};
use crate::remote::blocks::{self, PartedBlock};
use crate::remote::delta::FilmDeltas;
use crate::remote::link::{LinkError, LinkWriter};
use crate::remote::message::{
    Ended, FILE_PART, FileStart, MOST_SAMPLE_BYTES, Refusal, RejectedValues, Request, ToViewer,
};
use crate::stream::{BLOCK_SAMPLES, DrainOrder, Epoch, Event, Hub, Lanes, Rejections};

/// Orders for the writing thread that it has not carried out yet. The size is bounded: a new order replaces an older one of its kind.
#[derive(Default)]
pub(super) struct QueuedOrders {
    /// The last order: samples of this render are sent from now on, or it is refused.
    pub order: Option<Result<Request, Refusal>>,
    pub credit: u32,
    pub pong: Option<u64>,
    pub fetch: bool,
    /// The connection has ended.
    pub over: bool,
}

/// The queue of orders for the writing thread, which wakes it.
pub(super) struct SendQueue {
    queued: Mutex<QueuedOrders>,
    bell: Condvar,
    hub: Arc<Hub>,
}

impl SendQueue {
    pub fn new(hub: Arc<Hub>) -> Self {
        Self { queued: Mutex::default(), bell: Condvar::new(), hub }
    }

    /// Adds or replaces an order, and wakes the writing thread.
    pub fn update(&self, change: impl FnOnce(&mut QueuedOrders)) {
        change(&mut self.queued.lock().unwrap_or_else(PoisonError::into_inner));
        self.bell.notify_one();
        // With credit, the writing thread waits for samples at the hub.
        self.hub.announce();
    }

    /// Takes the orders since the last call. Waits for one, `patience` at most.
    fn take(&self, patience: Duration) -> QueuedOrders {
        let queued = self.queued.lock().unwrap_or_else(PoisonError::into_inner);
        let nothing = |queued: &mut QueuedOrders| {
            let QueuedOrders { order, credit, pong, fetch, over } = queued;
            order.is_none() && *credit == 0 && pong.is_none() && !*fetch && !*over
        };
        let waited = self.bell.wait_timeout_while(queued, patience, nothing);
        std::mem::take(&mut *waited.unwrap_or_else(PoisonError::into_inner).0)
    }
}

/// Tells the writing thread that the connection has ended, also when the reading one panics.
pub(super) struct EndOfConnection<'a>(pub &'a SendQueue, pub TcpStream);

impl Drop for EndOfConnection<'_> {
    fn drop(&mut self) {
        self.0.update(|queued| queued.over = true);
        // The writing thread may wait for a viewer that does not read.
        let _ = self.1.shutdown(Shutdown::Both);
    }
}

/// The writing thread of a connection.
pub(super) struct Sending<'a> {
    tracing: &'a dyn Tracing,
    host: &'a dyn Host,
    lanes: Lanes,
    writer: LinkWriter,
    queue: &'a SendQueue,
    /// Bytes of samples that may be sent; below 0 after a frame that was longer.
    credit: i64,
    /// The render whose samples are sent.
    request: Option<Request>,
    /// Blocks that were drained and are not completely sent.
    waiting: VecDeque<PartedBlock>,
    /// Sums of the samples traced while the link is busy.
    deltas: FilmDeltas,
    /// When the present render began, and the bytes of samples sent since.
    followed: Instant,
    sent: u64,
    /// Values rejected in blocks that have been sent.
    rejections: Rejections,
    /// Renders that have ended, which the viewer does not know yet.
    ends: VecDeque<Ended>,
    payload: Vec<u8>,
}

impl<'a> Sending<'a> {
    /// Sends nothing yet: a render must be ordered, and credit given.
    pub fn new(
        tracing: &'a dyn Tracing,
        host: &'a dyn Host,
        lanes: Lanes,
        writer: LinkWriter,
        queue: &'a SendQueue,
    ) -> Self {
        Self {
            tracing,
            host,
            lanes,
            writer,
            queue,
            credit: 0,
            request: None,
            waiting: VecDeque::new(),
            deltas: FilmDeltas::new(0),
            followed: Instant::now(),
            sent: 0,
            rejections: Rejections::default(),
            ends: VecDeque::new(),
            payload: Vec::new(),
        }
    }

    /// Sends until the connection ends.
    pub fn run(mut self) -> Result<(), LinkError> {
        let outcome = self.send();
        // The reading thread ends with the writing one.
        self.writer.close();
        outcome
    }

    fn send(&mut self) -> Result<(), LinkError> {
        loop {
            // Without credit only the viewer can bring news; otherwise samples do, too, and words ring the same bell.
            let queued = self.queue.take(if self.credit > 0 { Duration::ZERO } else { LOOK });
            if queued.over {
                return Ok(());
            }
            self.obey(queued)?;
            self.gather();
            if self.credit > 0 && (self.has_samples() || self.lanes.wait(LOOK)) {
                self.send_samples()?;
            }
            self.tell_ends()?;
        }
    }

    /// The render whose samples are sent; 0 before the first one.
    fn epoch(&self) -> Epoch {
        Epoch(self.request.as_ref().map_or(0, |request| request.epoch))
    }

    /// Whether samples of the present render may be sent in their short forms.
    fn compressed(&self) -> bool {
        self.request.as_ref().is_some_and(|request| request.compressed)
    }

    /// Tells the ends of renders, that of the present one once all of its samples have left.
    fn tell_ends(&mut self) -> Result<(), LinkError> {
        while let Some(Event::Finished { epoch, reason, .. }) = self.tracing.event() {
            self.ends.push_back(Ended { epoch: epoch.0, reason });
        }
        while let Some(end) = self.ends.front() {
            let left = self.waiting.is_empty() && self.deltas.is_empty() && self.lanes.is_drained();
            let epoch = self.epoch().0;
            if end.epoch > epoch || end.epoch == epoch && !left {
                break;
            }
            let frame = ToViewer::Ended(end.clone());
            self.write(&frame)?;
            self.ends.pop_front();
        }
        Ok(())
    }

    fn obey(&mut self, queued: QueuedOrders) -> Result<(), LinkError> {
        self.credit = self.credit.saturating_add(i64::from(queued.credit));
        if let Some(number) = queued.pong {
            self.write(&ToViewer::Pong(number))?;
        }
        match queued.order {
            Some(Ok(request)) => {
                self.lanes.follow(Epoch(request.epoch), DrainOrder::Arrival);
                self.waiting.clear();
                self.deltas = FilmDeltas::new(request.finest);
                (self.followed, self.sent, self.rejections) = (Instant::now(), 0, Rejections::default());
                self.request = Some(request);
            }
            Some(Err(refusal)) => self.write(&ToViewer::Refused(refusal))?,
            None => {}
        }
        if queued.fetch {
            self.send_files()?;
        }
        Ok(())
    }

    fn write(&mut self, message: &ToViewer) -> Result<(), LinkError> {
        let mut frames = Vec::new();
        message.write(&mut frames);
        self.writer.write(&frames)
    }

    /// Whether there are samples to be sent; takes some from the lanes, or what was gathered.
    fn has_samples(&mut self) -> bool {
        let (epoch, compressed) = (self.epoch(), self.compressed());
        if self.waiting.is_empty() && !self.deltas.is_empty() {
            let blocks = self.deltas.take(epoch);
            self.waiting.extend(blocks.iter().map(|block| PartedBlock::new(block, compressed)));
        }
        if self.waiting.is_empty() && !self.deltas.gathers() {
            let Self { lanes, waiting, rejections, .. } = self;
            lanes.drain(4 * BLOCK_SAMPLES, |block| {
                rejections.merge(&block.rejections);
                waiting.push_back(PartedBlock::new(block, compressed));
            });
        }
        !self.waiting.is_empty()
    }

    /// Gathers samples where the link is slower than the tracer, so that it need not wait.
    fn gather(&mut self) {
        let fill = self.lanes.fill();
        if self.credit <= 0 && 2 * fill.blocks > fill.capacity {
            let seconds = self.followed.elapsed().as_secs_f64().max(0.05);
            self.deltas.begin(self.sent as f64 / seconds);
        }
        if self.deltas.gathers() {
            let Self { lanes, deltas, rejections, .. } = self;
            lanes.drain(usize::MAX, |block| {
                rejections.merge(&block.rejections);
                deltas.add(block);
            });
        }
    }

    /// Sends a frame of samples, if there are any.
    fn send_samples(&mut self) -> Result<(), LinkError> {
        let mut payload = std::mem::take(&mut self.payload);
        blocks::begin(&mut payload, self.epoch());
        let empty = payload.len();
        let most = (self.credit as usize).clamp(512, MOST_SAMPLE_BYTES);
        while self.has_samples() {
            let Some(block) = self.waiting.front_mut() else { break };
            if !block.write(&mut payload, most) {
                break;
            }
            self.waiting.pop_front();
        }
        if payload.len() > empty {
            self.credit -= payload.len() as i64;
            self.sent += payload.len() as u64;
            self.write(&ToViewer::Samples(&payload))?;
        }
        self.payload = payload;
        if self.rejections.total() > 0 {
            let rejections = std::mem::take(&mut self.rejections);
            let epoch = self.epoch().0;
            self.write(&ToViewer::Rejected(RejectedValues { epoch, rejections }))?;
        }
        Ok(())
    }

    /// Sends the files of the scene.
    fn send_files(&mut self) -> Result<(), LinkError> {
        let mut part = vec![0; FILE_PART];
        for (path, place) in self.host.files() {
            let unread = |why: &dyn std::fmt::Display| {
                ToViewer::Refused(Refusal {
                    epoch: 0,
                    why: format!("cannot read {}: {why}", place.display()),
                })
            };
            let opened = File::open(&place).and_then(|file| Ok((file.metadata()?.len(), file)));
            let (length, file) = match opened {
                Ok(opened) => opened,
                Err(error) => return self.write(&unread(&error)),
            };
            self.write(&ToViewer::File(FileStart { path, length }))?;
            let (mut file, mut left) = (file.take(length), length);
            while left > 0 {
                let count = match file.read(&mut part) {
                    Ok(0) => return self.write(&unread(&"it has become shorter")),
                    Ok(count) => count,
                    Err(error) => return self.write(&unread(&error)),
                };
                self.write(&ToViewer::FilePart(&part[..count]))?;
                left -= count as u64;
            }
        }
        self.write(&ToViewer::FilesEnd)
    }
}
