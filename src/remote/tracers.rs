//! Tracers on other machines, as a producer of samples: each fills a lane of its own, as a worker of this machine would.
//!
//! Two threads serve a tracer (`receiver`). One connects, reads its messages, and connects again where the connection breaks; the other one
//! writes, so that nobody waits for a tracer that does not read. A tracer that is gone costs variance only: what it has sent remains, and when it
//! comes back it gets a sequence that no other tracer of this picture has had.

mod receiver;

use std::collections::{BTreeSet, VecDeque};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use self::receiver::Receiver;
use super::link::Token;
use super::message::{Request, Welcome};
use crate::stream::{Epoch, Event, FinishReason, Hub, LANE_BLOCKS, Lanes, Rejections, lanes, tracer_seed};

/// Time between two pings.
const PING: Duration = Duration::from_millis(500);

/// A tracer that has sent nothing for so long is called silent, and one whose answer to a ping takes so long, slow.
const SILENCE: Duration = Duration::from_secs(2);

/// How long the end of a thread is waited for that looks up a name or connects.
const LAST: Duration = Duration::from_secs(1);

/// Where a tracer is, and how to speak to it.
#[derive(Clone, Debug)]
pub struct TracerAddress {
    /// `host:port`.
    pub address: String,
    /// The secret, if it wants one.
    pub token: Option<Token>,
    /// Samples come in 12 bytes each, and as film deltas where the link is slower than they are.
    pub compressed: bool,
}

/// The render that all tracers work on.
#[derive(Clone, Debug)]
pub struct RemoteRender {
    /// Number of the render; newer than every one before.
    pub epoch: Epoch,
    /// Seed of the picture, from which those of the tracers are made.
    pub seed: u32,
    /// Camera paths after which the render ends; `None` is no end.
    pub paths: Option<u64>,
    /// Pixels along the longer side of the picture.
    pub side: u32,
    /// The scene, view and settings, as in [`Request::order`].
    pub order: String,
}

/// The state of the connection to a tracer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// It answers.
    Well,
    /// It is being connected to for the first time.
    Connecting,
    /// Something is wrong with it.
    Ill,
}

/// The state of a tracer, for the user.
#[derive(Clone, Debug, PartialEq)]
pub struct TracerStatus {
    /// `host:port`.
    pub address: String,
    /// The state of the connection.
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

/// Shared state of the threads of all tracers.
struct TracerHub {
    hub: Arc<Hub>,
    closing: AtomicBool,
    present: Mutex<Present>,
    events: Mutex<VecDeque<Event>>,
    /// Number of the last render.
    epoch: AtomicU64,
    /// Samples that came, of all epochs.
    samples: AtomicU64,
    /// Number of tracers, there or not.
    tracers: u64,
    /// Number of tracers that have neither connected nor failed yet: they may still join a render that the others have completed.
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
    /// How many of them have traced all they were to.
    completed: u64,
    /// The event of its end was sent.
    ended: bool,
    rejections: Rejections,
}

/// One tracer.
struct RemoteTracer {
    place: usize,
    target: TracerAddress,
    /// Seed of the sequence that it traces.
    seed: AtomicU32,
    mailbox: Mutex<Mailbox>,
    bell: Condvar,
    report: Mutex<Report>,
}

/// Messages for the writing thread to send, and the connection that it sends them on.
#[derive(Default)]
struct Mailbox {
    request: Option<Request>,
    abort: bool,
    credit: u32,
    /// A connection stands, and its tracer has been welcomed.
    connected: bool,
    socket: Option<TcpStream>,
}

/// The last news of a tracer.
struct Report {
    welcome: Option<Welcome>,
    /// When bytes last arrived.
    heard: Instant,
    /// When a ping was last answered, or the connection was made.
    answered: Instant,
    bytes_per_second: f64,
    /// Its lane is full, so nothing is read from the connection now.
    parked: bool,
    /// Why there is no connection, or what the tracer has refused.
    problem: Option<String>,
}

impl RemoteTracers {
    /// Begins to connect to these tracers; returns at once. Samples arrive on the lanes.
    ///
    /// # Errors
    ///
    /// The system's error, if a thread cannot be started.
    pub fn start(targets: Vec<TracerAddress>) -> std::io::Result<(Self, Lanes)> {
        let (writers, lanes) = lanes(targets.len(), LANE_BLOCKS);
        let shared = Arc::new(TracerHub {
            hub: lanes.hub().clone(),
            closing: AtomicBool::new(false),
            present: Mutex::default(),
            events: Mutex::default(),
            epoch: AtomicU64::new(0),
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
                seed: AtomicU32::new(0),
                mailbox: Mutex::default(),
                bell: Condvar::new(),
                report: Mutex::new(report),
            });
            tracers.peers.push(peer.clone());
            let mut receiver = Receiver::new(peer, tracers.shared.clone(), lane);
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
        self.shared.epoch.store(epoch.0, Ordering::SeqCst);
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

    /// Values that the present render has rejected.
    pub fn rejections(&self) -> Rejections {
        locked(&self.shared.present).rejections.clone()
    }

    /// The state of each tracer.
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
        let begin = Instant::now();
        for thread in self.threads.drain(..) {
            while !thread.is_finished() && begin.elapsed() < LAST {
                std::thread::sleep(Duration::from_millis(2));
            }
            // One that looks up a name or connects has nothing that anybody waits for, and ends by itself.
            if thread.is_finished() {
                let _ = thread.join();
            }
        }
    }
}

impl TracerHub {
    fn is_closing(&self) -> bool {
        self.closing.load(Ordering::SeqCst)
    }

    /// The request for a tracer, with a sequence that none has had; `None` where nothing is to be traced.
    fn deal(&self, present: &mut Present, peer: &RemoteTracer) -> Option<Request> {
        let render = present.render.as_ref().filter(|_| !present.ended)?;
        let request = Request {
            epoch: render.epoch.0,
            seed: tracer_seed(render.seed, present.dealt),
            paths: render.paths.map(|paths| paths.div_ceil(self.tracers)),
            compressed: peer.target.compressed,
            finest: if peer.target.compressed { render.side } else { 0 },
            order: render.order.clone(),
        };
        peer.seed.store(request.seed, Ordering::Relaxed);
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
        present.completed += u64::from(completed);
        self.end_if_done(&mut present, now);
    }

    /// Ends the render once everybody who is there has done a part of it.
    fn end_if_done(&self, present: &mut Present, epoch: Epoch) {
        let waits = self.unknown.load(Ordering::SeqCst) > 0;
        if present.tracing.is_empty() && present.completed > 0 && !waits {
            // The share of a tracer that is not there is missing.
            let complete = present.completed >= self.tracers;
            let reason = if complete { FinishReason::Complete } else { FinishReason::Aborted };
            self.finish(present, epoch, reason);
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

/// No thread that panicked leaves these in disorder: each change of them is one assignment.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
