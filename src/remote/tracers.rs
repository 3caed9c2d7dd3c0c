//! Tracers on other machines, as a producer of samples: each fills a lane of its own, as a worker of this machine would.
//!
//! Two threads serve a tracer. One connects, reads its messages, and connects again where the connection breaks; the other one writes, so
//! that nobody waits for a tracer that does not read. A tracer that is gone costs variance only: what it has sent remains, and when it
//! comes back it gets a sequence that no other tracer of this picture has had.

use std::collections::{BTreeSet, VecDeque};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use super::blocks;
use super::fetch::connect;
use super::link::{LinkError, LinkReader, LinkWriter, Token, greet};
use super::message::{Ended, RejectedValues, Request, Side, ToTracer, ToViewer, Welcome};
use super::window::CreditWindow;
use crate::stream::{
    Block, Epoch, Event, FinishReason, Hub, LANE_BLOCKS, LaneWriter, Lanes, Rejections, lanes, tracer_seed,
};

/// Shortest and longest pause before the next attempt to connect.
const PAUSE: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(5)];

/// Time between two pings.
const PING: Duration = Duration::from_millis(500);

/// A tracer that has sent nothing for so long is called silent, and one whose answer to a ping takes so long, slow.
const SILENCE: Duration = Duration::from_secs(2);

/// How often a reader looks whether it shall end.
const LOOK: Duration = Duration::from_millis(100);

/// Where a tracer is, and how to speak to it.
#[derive(Clone, Debug)]
pub struct TracerAddress {
    /// `host:port`.
    pub address: String,
    /// The secret, if it wants one.
    pub token: Option<Token>,
    /// Samples come in 12 bytes each.
    pub compressed: bool,
}

/// What all tracers are to trace.
#[derive(Clone, Debug)]
pub struct RemoteRender {
    /// Number of the render; newer than every one before.
    pub epoch: Epoch,
    /// Seed of the picture, from which those of the tracers are made.
    pub seed: u32,
    /// Camera paths after which the render ends; `None` is no end.
    pub paths: Option<u64>,
    /// What is traced, as JSON of the program.
    pub order: String,
}

/// How a tracer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// It answers.
    Well,
    /// It is being connected to for the first time.
    Connecting,
    /// Something is wrong with it.
    Ill,
}

/// How a tracer is, for the user.
#[derive(Clone, Debug, PartialEq)]
pub struct TracerStatus {
    /// Where it is.
    pub address: String,
    /// How it is.
    pub health: Health,
    /// The same in words.
    pub words: String,
    /// Its tracing threads; 0 before it is known.
    pub threads: usize,
}

/// Connections to tracers, which fill the lanes. Dropping it closes them and waits for its threads.
pub struct RemoteTracers {
    peers: Vec<Arc<RemoteTracer>>,
    shared: Arc<TracerHub>,
    threads: Vec<JoinHandle<()>>,
}

/// What the threads of all tracers share.
struct TracerHub {
    hub: Arc<Hub>,
    closing: AtomicBool,
    present: Mutex<Present>,
    events: Mutex<VecDeque<Event>>,
    /// Samples that came, of all epochs.
    samples: AtomicU64,
    /// Number of tracers, there or not.
    tracers: u64,
    /// Number of those of which nothing is known yet: they may still join a render that the others have done.
    unknown: AtomicUsize,
}

/// The present render.
#[derive(Default)]
struct Present {
    render: Option<RemoteRender>,
    /// Sequences that were dealt out.
    dealt: u32,
    /// Tracers that trace it.
    tracing: BTreeSet<usize>,
    /// One of them has traced all it was to.
    completed: bool,
    /// Its end was told.
    ended: bool,
    rejections: Rejections,
}

/// One tracer.
struct RemoteTracer {
    place: usize,
    target: TracerAddress,
    mailbox: Mutex<Mailbox>,
    bell: Condvar,
    report: Mutex<Report>,
}

/// What the writing thread is to send.
#[derive(Default)]
struct Mailbox {
    request: Option<Request>,
    abort: bool,
    credit: u32,
    /// A connection stands, and its tracer has been welcomed.
    connected: bool,
    socket: Option<TcpStream>,
}

/// What is known of a tracer.
struct Report {
    welcome: Option<Welcome>,
    /// Bytes came last.
    heard: Instant,
    /// A ping was answered last, or the connection was made.
    answered: Instant,
    bytes_per_second: f64,
    /// Its lane is full: nobody reads from it now.
    parked: bool,
    /// Why there is no connection, or what the tracer has refused.
    problem: Option<String>,
}

impl RemoteTracers {
    /// Begins to connect to these tracers; returns at once. Samples arrive on the lanes.
    ///
    /// # Errors
    ///
    /// Of the system, when it refuses a thread.
    pub fn start(targets: Vec<TracerAddress>) -> std::io::Result<(Self, Lanes)> {
        let (writers, lanes) = lanes(targets.len(), LANE_BLOCKS);
        let shared = Arc::new(TracerHub {
            hub: lanes.hub().clone(),
            closing: AtomicBool::new(false),
            present: Mutex::default(),
            events: Mutex::default(),
            samples: AtomicU64::new(0),
            tracers: targets.len() as u64,
            unknown: AtomicUsize::new(targets.len()),
        });
        let mut tracers = Self { peers: Vec::new(), shared, threads: Vec::new() };
        for ((place, target), lane) in targets.into_iter().enumerate().zip(writers) {
            let now = Instant::now();
            let report = Report {
                welcome: None,
                heard: now,
                answered: now,
                bytes_per_second: 0.0,
                parked: false,
                problem: None,
            };
            let peer = Arc::new(RemoteTracer {
                place,
                target,
                mailbox: Mutex::default(),
                bell: Condvar::new(),
                report: Mutex::new(report),
            });
            tracers.peers.push(peer.clone());
            let mut receiver =
                Receiver { peer, shared: tracers.shared.clone(), lane, block: Box::default(), known: false };
            tracers.threads.push(Builder::new().name("remote".into()).spawn(move || receiver.run())?);
        }
        Ok((tracers, lanes))
    }

    /// Has all tracers trace this from now on. Returns at once; a tracer that is not there begins with it when it is.
    pub fn render(&self, render: RemoteRender) {
        let epoch = render.epoch;
        let mut present = locked(&self.shared.present);
        if let Some(last) = present.render.take() {
            self.shared.finish(&mut present, last.epoch, FinishReason::Aborted);
        }
        *present = Present { render: Some(render), ..Present::default() };
        self.shared.hub.run(Some(epoch));
        for peer in &self.peers {
            let mut mailbox = locked(&peer.mailbox);
            if mailbox.connected {
                mailbox.request = self.shared.deal(&mut present, peer);
                mailbox.abort = false;
                peer.bell.notify_all();
            }
        }
    }

    /// Stops tracing. What has come remains valid.
    pub fn abort(&self) {
        self.shared.hub.run(None);
        let mut present = locked(&self.shared.present);
        if let Some(last) = present.render.take() {
            self.shared.finish(&mut present, last.epoch, FinishReason::Aborted);
        }
        for peer in &self.peers {
            let mut mailbox = locked(&peer.mailbox);
            (mailbox.request, mailbox.abort) = (None, true);
            peer.bell.notify_all();
        }
    }

    /// The oldest event that has not been read.
    pub fn event(&self) -> Option<Event> {
        locked(&self.shared.events).pop_front()
    }

    /// Samples that came since the start.
    pub fn samples(&self) -> u64 {
        self.shared.samples.load(Ordering::Relaxed)
    }

    /// What the present render has rejected.
    pub fn rejections(&self) -> Rejections {
        locked(&self.shared.present).rejections.clone()
    }

    /// How each tracer is.
    pub fn status(&self) -> Vec<TracerStatus> {
        self.peers.iter().map(|peer| peer.status()).collect()
    }

    /// Threads of all tracers that are known.
    pub fn threads(&self) -> usize {
        self.status().iter().map(|status| status.threads).sum()
    }
}

impl Drop for RemoteTracers {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::SeqCst);
        self.shared.hub.run(None);
        for peer in &self.peers {
            let mailbox = locked(&peer.mailbox);
            if let Some(socket) = &mailbox.socket {
                let _ = socket.shutdown(std::net::Shutdown::Both);
            }
            peer.bell.notify_all();
        }
        for thread in self.threads.drain(..) {
            // Its panic would have been told by the panic hook.
            let _ = thread.join();
        }
    }
}

impl TracerHub {
    fn is_closing(&self) -> bool {
        self.closing.load(Ordering::SeqCst)
    }

    /// The request for a tracer, with a sequence that none has had; `None` where nothing is to be traced.
    fn deal(&self, present: &mut Present, peer: &RemoteTracer) -> Option<Request> {
        let render = present.render.as_ref()?;
        let request = Request {
            epoch: render.epoch.0,
            seed: tracer_seed(render.seed, present.dealt),
            paths: render.paths.map(|paths| paths.div_ceil(self.tracers)),
            compressed: peer.target.compressed,
            order: render.order.clone(),
        };
        present.dealt += 1;
        present.tracing.insert(peer.place);
        Some(request)
    }

    /// A tracer has left the render, having done all it was to or not.
    fn leave(&self, place: usize, epoch: Option<Epoch>, completed: bool) {
        let mut present = locked(&self.present);
        let Some(now) = present.render.as_ref().map(|render| render.epoch) else { return };
        if epoch.is_some_and(|epoch| epoch != now) || !present.tracing.remove(&place) {
            return;
        }
        present.completed |= completed;
        self.end_if_done(&mut present, now);
    }

    /// Ends the render once everybody who is there has done a part of it.
    fn end_if_done(&self, present: &mut Present, epoch: Epoch) {
        let waits = self.unknown.load(Ordering::SeqCst) > 0;
        if present.tracing.is_empty() && present.completed && !waits {
            self.finish(present, epoch, FinishReason::Complete);
        }
    }

    /// A tracer has answered or has failed for the first time.
    fn know(&self) {
        self.unknown.fetch_sub(1, Ordering::SeqCst);
        let mut present = locked(&self.present);
        if let Some(epoch) = present.render.as_ref().map(|render| render.epoch) {
            self.end_if_done(&mut present, epoch);
        }
    }

    /// Tells the end of a render, once.
    fn finish(&self, present: &mut Present, epoch: Epoch, reason: FinishReason) {
        if !std::mem::replace(&mut present.ended, true) {
            locked(&self.events).push_back(Event::Finished { epoch, reason, at: Instant::now() });
            self.hub.end(epoch);
        }
    }
}

impl RemoteTracer {
    fn status(&self) -> TracerStatus {
        let report = locked(&self.report);
        let since = |then: Instant| then.elapsed();
        let (health, words) = match (&report.welcome, &report.problem) {
            (_, Some(problem)) => (Health::Ill, problem.clone()),
            (None, None) => (Health::Connecting, "connecting".to_owned()),
            (Some(_), None) if !report.parked && since(report.heard) > SILENCE => {
                (Health::Ill, format!("silent for {} s", since(report.heard).as_secs()))
            }
            (Some(_), None) if !report.parked && since(report.answered) > SILENCE + PING => {
                (Health::Ill, format!("slow: {}", rate(report.bytes_per_second)))
            }
            (Some(welcome), None) => {
                let threads = if welcome.threads == 1 { "thread" } else { "threads" };
                let rate = rate(report.bytes_per_second);
                (Health::Well, format!("{} {threads}, {rate}", welcome.threads))
            }
        };
        let connected = report.welcome.as_ref();
        let threads = connected.map_or(0, |welcome| welcome.threads);
        TracerStatus { address: self.target.address.clone(), health, words, threads }
    }

    fn note(&self, change: impl FnOnce(&mut Report)) {
        change(&mut locked(&self.report));
    }

    /// Sleeps until the connection is to be tried again, or all is to end.
    fn pause(&self, time: Duration, shared: &TracerHub) {
        let mailbox = locked(&self.mailbox);
        let _ = self.bell.wait_timeout_while(mailbox, time, |_| !shared.is_closing());
    }
}

fn rate(bytes_per_second: f64) -> String {
    match bytes_per_second {
        b if b >= 1e6 => format!("{:.1} MB/s", b * 1e-6),
        b if b >= 1e3 => format!("{:.1} KB/s", b * 1e-3),
        b => format!("{b:.0} B/s"),
    }
}

/// The thread that connects to a tracer and reads from it.
struct Receiver {
    peer: Arc<RemoteTracer>,
    shared: Arc<TracerHub>,
    lane: LaneWriter,
    block: Box<Block>,
    /// It has answered or failed before.
    known: bool,
}

impl Receiver {
    fn run(&mut self) {
        let mut pause = PAUSE[0];
        while !self.shared.is_closing() {
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
                self.peer.note(|report| {
                    (report.welcome, report.problem) = (None, Some(error.to_string()));
                });
            }
            self.peer.pause(pause, &self.shared);
            pause = (2 * pause).min(PAUSE[1]);
        }
    }

    fn connect(&self) -> Result<(LinkReader, LinkWriter), LinkError> {
        let TracerAddress { address, token, .. } = &self.peer.target;
        greet(connect(address)?, Side::Viewer, token.as_ref())
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
            let outcome = loop {
                if self.shared.is_closing() || ended.load(Ordering::SeqCst) {
                    break Ok(());
                }
                let before = reader.bytes;
                match self.hear(&mut reader, &mut window, was_there) {
                    Ok(()) => {}
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

    /// Hears one message, if one comes.
    fn hear(
        &mut self,
        reader: &mut LinkReader,
        window: &mut CreditWindow,
        was_there: &mut bool,
    ) -> Result<(), LinkError> {
        let Some((kind, payload)) = reader.read(LOOK)? else { return Ok(()) };
        match ToViewer::read(kind, payload)? {
            ToViewer::Samples(payload) => {
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
                    let problem = format!("path {index} panicked: {message}");
                    self.peer.note(|report| report.problem = Some(problem));
                }
                let completed = reason == FinishReason::Complete;
                self.shared.leave(self.peer.place, Some(Epoch(epoch)), completed);
            }
            ToViewer::Refused(why) => self.peer.note(|report| report.problem = Some(why)),
            ToViewer::Rejected(RejectedValues { epoch, rejections }) => {
                let mut present = locked(&self.shared.present);
                if present.render.as_ref().is_some_and(|render| render.epoch == Epoch(epoch)) {
                    present.rejections.merge(&rejections);
                }
            }
            // Nobody has asked for files here.
            ToViewer::File(_) | ToViewer::FilePart(_) | ToViewer::FilesEnd => {}
        }
        Ok(())
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
        let epoch = blocks::epoch(payload)?;
        if !shared.hub.is_running(epoch) && !shared.hub.is_idle() {
            return Ok(());
        }
        peer.note(|report| report.problem = None);
        blocks::read(payload, block, |block| {
            let samples = block.samples().len() as u64;
            peer.note(|report| report.parked = true);
            if lane.send(block) {
                shared.samples.fetch_add(samples, Ordering::Relaxed);
            }
            peer.note(|report| report.parked = false);
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

/// No thread that panicked leaves these in disorder: each change of them is one assignment.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
