//! A tracer that serves a viewer: it listens, checks who comes, and sends samples as fast as the viewer gives credit.
//!
//! A connection has two threads. The reading one hears requests and has them traced at once; the writing one drains the lanes of the
//! tracer. One viewer is served at a time: the next one is told so.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, TryLockError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::blocks::{self, PartedBlock};
use super::link::{LinkError, LinkReader, LinkWriter, Token, greet};
use super::message::{
    Ended, FILE_PART, FileStart, MOST_SAMPLE_BYTES, RejectedValues, Request, Side, ToTracer, ToViewer,
    Welcome,
};
use crate::stream::{BLOCK_SAMPLES, DrainOrder, Epoch, Event, Hub, Lanes, Rejections};

/// Connections that may be open at once, most of them in the handshake.
const MOST_CONNECTIONS: usize = 16;

/// How often the loops look whether they shall end.
const LOOK: Duration = Duration::from_millis(20);

/// A viewer pings twice a second. One that has said nothing for so long is gone, and makes room for the next.
const SILENCE: Duration = Duration::from_secs(15);

/// Traces for one viewer.
pub trait Tracing: Send + Sync {
    /// Traces this from now on; what was traced before is stopped. The error is told to the viewer.
    ///
    /// # Errors
    ///
    /// In words, when it cannot be traced.
    fn render(&self, request: &Request) -> Result<(), String>;

    /// Stops tracing.
    fn abort(&self);

    /// The oldest event that has not been read.
    fn event(&self) -> Option<Event>;
}

/// What is served: a scene, for one viewer after the other.
pub trait Host: Send + Sync + 'static {
    /// What a viewer is told first.
    fn welcome(&self) -> Welcome;

    /// Makes a tracer for a viewer, and the lanes that it fills.
    ///
    /// # Errors
    ///
    /// In words.
    fn open(self: Arc<Self>) -> Result<(Box<dyn Tracing>, Lanes), String>;

    /// The files of the scene with their places relative to one folder, the scene itself first.
    fn files(&self) -> Vec<(String, PathBuf)>;
}

/// Why a service cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// The address is none.
    #[error("{address} is no address: give HOST:PORT, such as 127.0.0.1:7070")]
    Address {
        /// The address.
        address: String,
    },
    /// It is not of this machine alone, and there is no token.
    #[error(
        "{address} can be reached from other machines: give --token-file, or listen on 127.0.0.1 and use a tunnel (ssh -L)"
    )]
    Open {
        /// The address.
        address: SocketAddr,
    },
    /// The system refused.
    #[error("cannot listen on {address}: {source}")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// The system's error.
        source: std::io::Error,
    },
}

/// Listens on an address. Without a token it must be one that only this machine can reach.
///
/// # Errors
///
/// [`ListenError`].
pub fn listen(address: &str, token: Option<&Token>) -> Result<TcpListener, ListenError> {
    let unknown = || ListenError::Address { address: address.to_owned() };
    let found: Vec<SocketAddr> = address.to_socket_addrs().map_err(|_| unknown())?.collect();
    if let Some(open) = found.iter().find(|found| !is_loopback(found.ip()))
        && token.is_none()
    {
        return Err(ListenError::Open { address: *open });
    }
    let address = *found.first().ok_or_else(unknown)?;
    TcpListener::bind(address).map_err(|source| ListenError::Bind { address, source })
}

/// Whether an address is of this machine alone.
pub fn is_loopback(address: IpAddr) -> bool {
    address.to_canonical().is_loopback()
}

/// A service that runs. Dropping it ends it.
pub struct Service {
    /// Where it can be reached from here.
    address: SocketAddr,
    closing: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Service {
    /// Serves those who come to `listener`; `log` gets a line for everything that happens.
    ///
    /// # Errors
    ///
    /// Of the system.
    pub fn start(
        listener: TcpListener,
        token: Option<Token>,
        host: Arc<dyn Host>,
        log: impl Fn(String) + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let mut address = listener.local_addr()?;
        match address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
            IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
            _ => {}
        }
        let closing = Arc::<AtomicBool>::default();
        let door = Arc::new(Door {
            token,
            host,
            log: Box::new(log),
            closing: closing.clone(),
            room: Mutex::new(()),
        });
        let thread = Builder::new().name("listen".into()).spawn(move || door.keep(&listener))?;
        Ok(Self { address, closing, thread: Some(thread) })
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::SeqCst);
        // Who waits for a connection gets one.
        let _ = TcpStream::connect_timeout(&self.address, LOOK);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Lets viewers in.
struct Door {
    token: Option<Token>,
    host: Arc<dyn Host>,
    log: Box<dyn Fn(String) + Send + Sync>,
    closing: Arc<AtomicBool>,
    /// Locked while a viewer is served.
    room: Mutex<()>,
}

impl Door {
    fn keep(self: Arc<Self>, listener: &TcpListener) {
        let open = Arc::<AtomicUsize>::default();
        let mut threads: Vec<JoinHandle<()>> = Vec::new();
        while !self.closing.load(Ordering::SeqCst) {
            threads.retain(|thread| !thread.is_finished());
            let (socket, from) = match listener.accept() {
                Ok(accepted) => accepted,
                Err(error) => {
                    (self.log)(format!("a connection could not be taken: {error}"));
                    std::thread::sleep(LOOK);
                    continue;
                }
            };
            if self.closing.load(Ordering::SeqCst) {
                break;
            }
            if open.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
                open.fetch_sub(1, Ordering::SeqCst);
                (self.log)(format!("{from}: refused, {MOST_CONNECTIONS} connections are open"));
                continue;
            }
            let (door, count) = (self.clone(), open.clone());
            let spawned = Builder::new().name("viewer".into()).spawn(move || {
                door.receive(socket, from);
                count.fetch_sub(1, Ordering::SeqCst);
            });
            match spawned {
                Ok(thread) => threads.push(thread),
                Err(error) => {
                    open.fetch_sub(1, Ordering::SeqCst);
                    (self.log)(format!("{from}: refused, no thread: {error}"));
                }
            }
        }
        for thread in threads {
            let _ = thread.join();
        }
    }

    fn receive(&self, socket: TcpStream, from: SocketAddr) {
        let served = greet(socket, Side::Tracer, self.token.as_ref()).and_then(|(reader, writer)| {
            let room = match self.room.try_lock() {
                Ok(room) => room,
                Err(TryLockError::Poisoned(room)) => room.into_inner(),
                Err(TryLockError::WouldBlock) => return self.turn_away(reader, writer),
            };
            (self.log)(format!("{from}: connected"));
            let served = self.serve(reader, writer);
            drop(room);
            served
        });
        match served {
            Ok(()) | Err(LinkError::Closed) => (self.log)(format!("{from}: gone")),
            Err(error) => (self.log)(format!("{from}: {error}")),
        }
    }

    fn turn_away(&self, _reader: LinkReader, mut writer: LinkWriter) -> Result<(), LinkError> {
        let mut frames = Vec::new();
        ToViewer::Refused("it serves another viewer already".into()).write(&mut frames);
        writer.write(&frames)?;
        writer.close();
        Ok(())
    }

    /// Serves a viewer until the connection ends.
    fn serve(&self, mut reader: LinkReader, mut writer: LinkWriter) -> Result<(), LinkError> {
        let mut frames = Vec::new();
        let (tracing, lanes) = match self.host.clone().open() {
            Ok(opened) => opened,
            Err(why) => {
                ToViewer::Refused(why).write(&mut frames);
                return writer.write(&frames);
            }
        };
        ToViewer::Welcome(self.host.welcome()).write(&mut frames);
        writer.write(&frames)?;
        let (say, heard) = channel();
        let hub = lanes.hub().clone();
        let ended = AtomicBool::new(false);
        let socket = writer.socket()?;
        std::thread::scope(|scope| {
            let sending = Sending {
                tracing: &*tracing,
                lanes,
                writer,
                heard,
                credit: 0,
                compressed: false,
                epoch: Epoch::default(),
                waiting: VecDeque::new(),
                rejections: Rejections::default(),
                ends: VecDeque::new(),
                payload: Vec::new(),
            };
            let writing = scope.spawn(|| {
                let outcome = sending.run();
                ended.store(true, Ordering::SeqCst);
                outcome
            });
            let read = self.hear(&mut reader, &*tracing, &Says { say, hub }, &ended);
            tracing.abort();
            // The writing thread may wait for a viewer that does not read.
            let _ = socket.shutdown(Shutdown::Both);
            let written = writing.join().unwrap_or(Ok(()));
            read.and(written)
        })
    }

    /// Hears requests until the connection ends.
    fn hear(
        &self,
        reader: &mut LinkReader,
        tracing: &dyn Tracing,
        says: &Says,
        ended: &AtomicBool,
    ) -> Result<(), LinkError> {
        while !self.closing.load(Ordering::SeqCst) && !ended.load(Ordering::SeqCst) {
            let Some((kind, payload)) = reader.read(LOOK)? else {
                if reader.heard.elapsed() > SILENCE {
                    return Err(LinkError::Closed);
                }
                continue;
            };
            match ToTracer::read(kind, payload)? {
                ToTracer::Render(request) => match tracing.render(&request) {
                    Ok(()) => says.say(Say::Follow(Epoch(request.epoch), request.compressed)),
                    Err(why) => says.say(Say::Refuse(why)),
                },
                ToTracer::Abort => tracing.abort(),
                ToTracer::Credit(more) => says.say(Say::Credit(more)),
                ToTracer::Ping(number) => says.say(Say::Pong(number)),
                ToTracer::Fetch => says.say(Say::Files(self.host.files())),
            }
        }
        Ok(())
    }
}

/// What the reading thread has the writing one do.
enum Say {
    /// Samples of this render are sent from now on, in 12 bytes each or not.
    Follow(Epoch, bool),
    Credit(u32),
    Pong(u64),
    Refuse(String),
    Files(Vec<(String, PathBuf)>),
}

/// Speaks to the writing thread, and wakes it.
struct Says {
    say: Sender<Say>,
    hub: Arc<Hub>,
}

impl Says {
    fn say(&self, what: Say) {
        // The writing thread may have ended with the connection.
        let _ = self.say.send(what);
        self.hub.announce();
    }
}

/// The writing thread of a connection.
struct Sending<'a> {
    tracing: &'a dyn Tracing,
    lanes: Lanes,
    writer: LinkWriter,
    heard: Receiver<Say>,
    /// Bytes of samples that may be sent; below 0 after a frame that was longer.
    credit: i64,
    compressed: bool,
    epoch: Epoch,
    /// Blocks that were drained and have not left as a whole.
    waiting: VecDeque<PartedBlock>,
    /// What was rejected in blocks that have left.
    rejections: Rejections,
    /// Renders that have ended, which was not told yet.
    ends: VecDeque<Ended>,
    payload: Vec<u8>,
}

impl Sending<'_> {
    fn run(mut self) -> Result<(), LinkError> {
        let outcome = self.send();
        // The reading thread ends with the writing one.
        self.writer.close();
        outcome
    }

    fn send(&mut self) -> Result<(), LinkError> {
        loop {
            // Without credit only the viewer can bring news; otherwise samples do, too, and words ring the same bell.
            let patience = if self.credit > 0 { Duration::ZERO } else { LOOK };
            match self.heard.recv_timeout(patience) {
                Ok(said) => {
                    self.obey(said)?;
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if self.credit > 0 && (!self.waiting.is_empty() || self.lanes.wait(LOOK)) {
                self.send_samples()?;
            }
            self.tell_ends()?;
        }
    }

    /// Tells the ends of renders, that of the present one once all of its samples have left.
    fn tell_ends(&mut self) -> Result<(), LinkError> {
        while let Some(Event::Finished { epoch, reason, .. }) = self.tracing.event() {
            self.ends.push_back(Ended { epoch: epoch.0, reason });
        }
        while let Some(end) = self.ends.front() {
            let left = self.waiting.is_empty() && self.lanes.is_drained();
            if end.epoch > self.epoch.0 || end.epoch == self.epoch.0 && !left {
                break;
            }
            let frame = ToViewer::Ended(end.clone());
            self.write(&frame)?;
            self.ends.pop_front();
        }
        Ok(())
    }

    fn obey(&mut self, said: Say) -> Result<(), LinkError> {
        match said {
            Say::Follow(epoch, compressed) => {
                self.lanes.follow(epoch, DrainOrder::Arrival);
                (self.epoch, self.compressed) = (epoch, compressed);
                self.waiting.clear();
                self.rejections = Rejections::default();
                Ok(())
            }
            Say::Credit(more) => {
                self.credit = self.credit.saturating_add(i64::from(more));
                Ok(())
            }
            Say::Pong(number) => self.write(&ToViewer::Pong(number)),
            Say::Refuse(why) => self.write(&ToViewer::Refused(why)),
            Say::Files(files) => self.send_files(files),
        }
    }

    fn write(&mut self, message: &ToViewer) -> Result<(), LinkError> {
        let mut frames = Vec::new();
        message.write(&mut frames);
        self.writer.write(&frames)
    }

    /// Whether there are samples to be sent; takes some from the lanes.
    fn has_samples(&mut self) -> bool {
        if self.waiting.is_empty() {
            let Self { lanes, waiting, rejections, compressed, .. } = self;
            lanes.drain(4 * BLOCK_SAMPLES, |block| {
                rejections.merge(&block.rejections);
                waiting.push_back(PartedBlock::new(block, *compressed));
            });
        }
        !self.waiting.is_empty()
    }

    /// Sends a frame of samples, if there are any.
    fn send_samples(&mut self) -> Result<(), LinkError> {
        let mut payload = std::mem::take(&mut self.payload);
        blocks::begin(&mut payload, self.epoch);
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
            self.write(&ToViewer::Samples(&payload))?;
        }
        self.payload = payload;
        if self.rejections.total() > 0 {
            let rejections = std::mem::take(&mut self.rejections);
            self.write(&ToViewer::Rejected(RejectedValues { epoch: self.epoch.0, rejections }))?;
        }
        Ok(())
    }

    /// Sends the files of the scene.
    fn send_files(&mut self, files: Vec<(String, PathBuf)>) -> Result<(), LinkError> {
        let mut part = vec![0; FILE_PART];
        for (path, place) in files {
            let length = std::fs::metadata(&place)?.len();
            let mut file = File::open(&place)?.take(length);
            self.write(&ToViewer::File(FileStart { path, length }))?;
            let mut left = length;
            while left > 0 {
                let count = file.read(&mut part)?;
                if count == 0 {
                    // It has become shorter meanwhile.
                    return self.write(&ToViewer::Refused(format!("{} changes", place.display())));
                }
                self.write(&ToViewer::FilePart(&part[..count]))?;
                left -= count as u64;
            }
        }
        self.write(&ToViewer::FilesEnd)
    }
}
