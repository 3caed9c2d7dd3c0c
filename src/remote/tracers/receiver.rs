//! The two threads of a tracer elsewhere: one reads what it says, one writes what it is told.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use super::{Mailbox, PING, RemoteTracer, TracerAddress, TracerHub, locked};
use crate::remote::blocks;
use crate::remote::link::{LinkError, LinkReader, LinkWriter, connect, greet};
use crate::remote::message::{Ended, Refusal, RejectedValues, Side, ToTracer, ToViewer, printable};
use crate::remote::window::CreditWindow;
use crate::stream::{Block, Epoch, FinishReason, LaneWriter};

/// Shortest and longest pause before the next attempt to connect.
const PAUSE: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(5)];

/// A tracer of which no whole message has come for so long is connected to anew: it is gone, or what comes belongs to a record whose length
/// was damaged, or to much more than the link carries now.
const GONE: Duration = Duration::from_secs(20);

/// How often a reader checks whether to end.
const LOOK: Duration = Duration::from_millis(100);

/// The thread that connects to a tracer and reads from it.
pub(super) struct Receiver {
    peer: Arc<RemoteTracer>,
    shared: Arc<TracerHub>,
    lane: LaneWriter,
    block: Box<Block>,
    /// It has answered or failed before.
    known: bool,
    /// It has refused something on this connection.
    refused: bool,
}

impl Receiver {
    /// Serves this tracer, which has said nothing yet.
    pub fn new(peer: Arc<RemoteTracer>, shared: Arc<TracerHub>, lane: LaneWriter) -> Self {
        Self { peer, shared, lane, block: Box::default(), known: false, refused: false }
    }

    /// Connects and reads until all is to end.
    pub fn run(&mut self) {
        let mut pause = PAUSE[0];
        while !self.shared.is_closing() {
            self.refused = false;
            let outcome = self.connect().and_then(|(reader, writer)| {
                let was_there = &mut false;
                let outcome = self.converse(reader, writer, was_there);
                if *was_there {
                    pause = PAUSE[0];
                }
                outcome
            });
            self.shared.leave(self.peer.place, None, false);
            self.know();
            if let Err(error) = outcome {
                tracing::info!("tracer {}: {error}", self.peer.target.address);
                // One that refuses says why before it closes the connection.
                let told = self.refused && matches!(error, LinkError::Closed);
                self.peer.note(|report| {
                    report.welcome = None;
                    if !told {
                        report.problem = Some(error.to_string());
                    }
                });
            }
            self.peer.pause(pause, &self.shared);
            pause = (2 * pause).min(PAUSE[1]);
        }
    }

    fn connect(&self) -> Result<(LinkReader, LinkWriter), LinkError> {
        let TracerAddress { address, token, .. } = &self.peer.target;
        let socket = connect(address)?;
        // So that the greeting can be cut off.
        locked(&self.peer.mailbox).socket = Some(socket.try_clone()?);
        greet(socket, Side::Viewer, token.as_ref())
    }

    /// Speaks with the tracer until the connection ends.
    fn converse(
        &mut self,
        mut reader: LinkReader,
        writer: LinkWriter,
        was_there: &mut bool,
    ) -> Result<(), LinkError> {
        let mut window = CreditWindow::default();
        *locked(&self.peer.mailbox) =
            Mailbox { credit: window.grant(), socket: Some(writer.socket()?), ..Mailbox::default() };
        let (peer, shared) = (self.peer.clone(), self.shared.clone());
        let (ended, begin) = (AtomicBool::new(false), window.begin);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                write_mail(&peer, &shared, writer, &ended, begin);
                // The reader ends with the writer.
                ended.store(true, Ordering::SeqCst);
            });
            let mut last = Instant::now();
            let outcome = loop {
                if self.shared.is_closing() || ended.load(Ordering::SeqCst) {
                    break Ok(());
                }
                let before = reader.bytes;
                match self.hear(&mut reader, &mut window, was_there) {
                    Ok(true) => last = Instant::now(),
                    Ok(false) if last.elapsed() > GONE => break Err(LinkError::Silent(GONE.as_secs())),
                    Ok(false) => {}
                    Err(error) => break Err(error),
                }
                if reader.bytes != before {
                    let heard = reader.heard;
                    self.peer.note(|report| report.heard = heard);
                }
                if let Some(rate) = window.measure(reader.bytes) {
                    self.peer.note(|report| report.bytes_per_second = rate);
                }
            };
            ended.store(true, Ordering::SeqCst);
            let mut mailbox = locked(&self.peer.mailbox);
            mailbox.connected = false;
            if let Some(socket) = mailbox.socket.take() {
                let _ = socket.shutdown(std::net::Shutdown::Both);
            }
            self.peer.bell.notify_all();
            outcome
        })
    }

    /// Hears one message; returns false if none has come.
    fn hear(
        &mut self,
        reader: &mut LinkReader,
        window: &mut CreditWindow,
        was_there: &mut bool,
    ) -> Result<bool, LinkError> {
        let Some((kind, payload)) = reader.read(LOOK)? else { return Ok(false) };
        match ToViewer::read(kind, payload)? {
            ToViewer::Samples(payload) => {
                self.refused = false;
                self.take(payload)?;
                window.took(payload.len());
                let grant = window.grant();
                if grant > 0 {
                    locked(&self.peer.mailbox).credit += grant;
                    self.peer.bell.notify_all();
                }
            }
            ToViewer::Welcome(welcome) => {
                *was_there = true;
                let now = Instant::now();
                self.peer.note(|report| {
                    (report.welcome, report.problem) = (Some(welcome), None);
                    (report.heard, report.answered) = (now, now);
                });
                self.join_render();
                self.know();
            }
            ToViewer::Pong(sent) => {
                window.answered(sent);
                self.peer.note(|report| report.answered = Instant::now());
            }
            ToViewer::Ended(Ended { epoch, reason }) => {
                if let FinishReason::Panicked { index, message } = &reason {
                    let seed = self.peer.seed.load(Ordering::Relaxed);
                    let problem = printable(&format!("path {index} of --seed {seed} panicked: {message}"));
                    self.peer.note(|report| report.problem = Some(problem));
                }
                let completed = reason == FinishReason::Complete;
                self.shared.leave(self.peer.place, Some(Epoch(epoch)), completed);
            }
            ToViewer::Refused(Refusal { epoch, why }) => {
                self.refused = true;
                self.peer.note(|report| report.problem = Some(printable(&why)));
                // It has no part in that render.
                self.shared.leave(self.peer.place, Some(Epoch(epoch)), false);
            }
            ToViewer::Rejected(RejectedValues { epoch, rejections }) => {
                let mut present = locked(&self.shared.present);
                if let Some(render) = present.render.as_ref().filter(|render| render.epoch == Epoch(epoch)) {
                    // Examples are repeated with the seed of the picture, which only one of the tracers has.
                    let own = self.peer.seed.load(Ordering::Relaxed) == render.seed;
                    let rejections = if own { rejections } else { rejections.without_examples() };
                    present.rejections.merge(&rejections);
                }
            }
            // Files are requested by `fetch` only.
            ToViewer::File(_) | ToViewer::FilePart(_) | ToViewer::FilesEnd => {}
        }
        Ok(true)
    }

    fn know(&mut self) {
        if !std::mem::replace(&mut self.known, true) {
            self.shared.know();
        }
    }

    /// The tracer is there: it joins the render in progress.
    fn join_render(&self) {
        let mut present = locked(&self.shared.present);
        let mut mailbox = locked(&self.peer.mailbox);
        mailbox.connected = true;
        mailbox.request = self.shared.deal(&mut present, &self.peer);
        self.peer.bell.notify_all();
    }

    /// Hands over the blocks of a payload, unless nobody wants them any more.
    fn take(&mut self, payload: &[u8]) -> Result<(), LinkError> {
        let Self { peer, shared, lane, block, .. } = self;
        // After an abort what was on its way belongs to the last render.
        if blocks::epoch(payload)?.0 != shared.epoch.load(Ordering::SeqCst) {
            return Ok(());
        }
        peer.note(|report| report.problem = None);
        blocks::read(payload, block, |block| {
            let samples = block.samples().len() as u64;
            let begin = Instant::now();
            peer.note(|report| report.parked = true);
            if lane.send(block) {
                shared.samples.fetch_add(samples, Ordering::Relaxed);
            }
            peer.note(|report| {
                // While nobody reads, nothing can be heard.
                let waited = begin.elapsed();
                (report.heard, report.answered) = (report.heard + waited, report.answered + waited);
                report.parked = false;
            });
        })?;
        Ok(())
    }
}

/// Writes what is in the mailbox of a tracer, and pings, until the connection ends.
fn write_mail(
    peer: &RemoteTracer,
    shared: &TracerHub,
    mut writer: LinkWriter,
    ended: &AtomicBool,
    begin: Instant,
) {
    let (mut pinged, mut frames) = (None::<Instant>, Vec::new());
    let over = || ended.load(Ordering::SeqCst) || shared.is_closing();
    while !over() {
        frames.clear();
        let mut mailbox = locked(&peer.mailbox);
        let idle = |mailbox: &mut Mailbox| {
            mailbox.request.is_none() && !mailbox.abort && mailbox.credit == 0 && !over()
        };
        let left = pinged.map_or(Duration::ZERO, |at| PING.saturating_sub(at.elapsed()));
        if idle(&mut mailbox) && !left.is_zero() {
            let waited = peer.bell.wait_timeout_while(mailbox, left, idle);
            mailbox = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let credit = std::mem::take(&mut mailbox.credit);
        if credit > 0 {
            ToTracer::Credit(credit).write(&mut frames);
        }
        if std::mem::take(&mut mailbox.abort) {
            ToTracer::Abort.write(&mut frames);
        }
        if let Some(request) = mailbox.request.take() {
            ToTracer::Render(request).write(&mut frames);
        }
        drop(mailbox);
        if pinged.is_none_or(|at| at.elapsed() >= PING) {
            pinged = Some(Instant::now());
            ToTracer::Ping(begin.elapsed().as_micros() as u64).write(&mut frames);
        }
        if !frames.is_empty() && writer.write(&frames).is_err() {
            break;
        }
    }
    writer.close();
}
