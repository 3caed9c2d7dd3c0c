//! A tracer that serves a viewer: it listens, checks who comes, and sends samples as fast as the viewer gives credit.
//!
//! A connection has two threads. The reading one hears requests and has them traced at once; the writing one drains the lanes of the
//! tracer (`sending`). One viewer is served at a time: the next one is told so.

mod sending;

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use self::sending::{EndOfConnection, SendQueue, Sending};
use super::link::{LinkError, LinkReader, LinkWriter, Token, greet};
use super::message::{Refusal, Request, Side, ToTracer, ToViewer, Welcome};
use crate::stream::{Event, Lanes};

/// Connections that may be open at once, most of them in the handshake.
const MOST_CONNECTIONS: usize = 64;

/// How long a new viewer waits for the previous one to disconnect.
const LEAVING: Duration = Duration::from_secs(1);

/// How often the loops check whether to end.
const LOOK: Duration = Duration::from_millis(20);

/// A viewer pings twice a second. One that has said nothing for so long is gone, and makes room for the next.
const SILENCE: Duration = Duration::from_secs(15);

/// Traces for one viewer.
pub trait Tracing: Send + Sync {
    /// Starts this render and stops the previous one. The error is sent to the viewer.
    ///
    /// # Errors
    ///
    /// A description for the user, if it cannot be traced.
    fn render(&self, request: &Request) -> Result<(), String>;

    /// Stops tracing.
    fn abort(&self);

    /// The oldest event that has not been read.
    fn event(&self) -> Option<Event>;
}

/// Serves a scene to one viewer after the other.
pub trait Host: Send + Sync + 'static {
    /// The first message to a viewer.
    fn welcome(&self) -> Welcome;

    /// Makes a tracer for a viewer, and the lanes that it fills.
    ///
    /// # Errors
    ///
    /// A description for the user.
    fn open(self: Arc<Self>) -> Result<(Box<dyn Tracing>, Lanes), String>;

    /// The files of the scene with their places relative to one folder, the scene itself first.
    fn files(&self) -> Vec<(String, PathBuf)>;
}

/// Why a service cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// It cannot be parsed or resolved.
    #[error("{address} is no address: give HOST:PORT, such as 127.0.0.1:7070")]
    Address {
        /// The address.
        address: String,
    },
    /// Other machines can reach it, and there is no token.
    #[error(
        "{address} can be reached from other machines: give --token-file, or listen on 127.0.0.1 and use a tunnel (ssh -L)"
    )]
    Open {
        /// The address.
        address: SocketAddr,
    },
    /// The system refused to listen.
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
    /// Serves viewers that connect to `listener`; `log` receives a line for every event.
    ///
    /// # Errors
    ///
    /// The system's error.
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
        let acceptor = Arc::new(Acceptor {
            token,
            host,
            log: Box::new(log),
            closing: closing.clone(),
            room: Mutex::new(()),
        });
        let thread = Builder::new().name("listen".into()).spawn(move || acceptor.keep(&listener))?;
        Ok(Self { address, closing, thread: Some(thread) })
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::SeqCst);
        // Wakes the thread that waits in `accept`.
        let _ = TcpStream::connect_timeout(&self.address, LOOK);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Counts a connection while it is open, however it ends.
struct OpenConnection(Arc<AtomicUsize>);

impl Drop for OpenConnection {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Accepts connections, and lets one viewer in at a time.
struct Acceptor {
    token: Option<Token>,
    host: Arc<dyn Host>,
    log: Box<dyn Fn(String) + Send + Sync>,
    closing: Arc<AtomicBool>,
    /// Locked while a viewer is served.
    room: Mutex<()>,
}

impl Acceptor {
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
            let (acceptor, counted) = (self.clone(), OpenConnection(open.clone()));
            let spawned = Builder::new().name("viewer".into()).spawn(move || {
                let _counted = counted;
                acceptor.receive(socket, from);
            });
            match spawned {
                Ok(thread) => threads.push(thread),
                Err(error) => (self.log)(format!("{from}: refused, no thread: {error}")),
            }
        }
        for thread in threads {
            let _ = thread.join();
        }
    }

    fn receive(&self, socket: TcpStream, from: SocketAddr) {
        let served = greet(socket, Side::Tracer, self.token.as_ref()).and_then(|(reader, writer)| {
            let Some(room) = self.enter() else { return turn_away(writer) };
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

    /// Waits briefly until the previous viewer has disconnected.
    fn enter(&self) -> Option<MutexGuard<'_, ()>> {
        let begin = Instant::now();
        loop {
            match self.room.try_lock() {
                Ok(room) => return Some(room),
                Err(TryLockError::Poisoned(room)) => return Some(room.into_inner()),
                Err(TryLockError::WouldBlock) if begin.elapsed() > LEAVING => return None,
                Err(TryLockError::WouldBlock) => std::thread::sleep(LOOK / 4),
            }
        }
    }

    /// Serves a viewer until the connection ends.
    fn serve(&self, mut reader: LinkReader, mut writer: LinkWriter) -> Result<(), LinkError> {
        let mut frames = Vec::new();
        let (tracing, lanes) = match self.host.clone().open() {
            Ok(opened) => opened,
            Err(why) => {
                ToViewer::Refused(Refusal { epoch: 0, why }).write(&mut frames);
                return writer.write(&frames);
            }
        };
        ToViewer::Welcome(self.host.welcome()).write(&mut frames);
        writer.write(&frames)?;
        let queue = SendQueue::new(lanes.hub().clone());
        let (ended, end) = (AtomicBool::new(false), EndOfConnection(&queue, writer.socket()?));
        std::thread::scope(|scope| {
            let sending = Sending::new(&*tracing, &*self.host, lanes, writer, &queue);
            let writing = scope.spawn(|| {
                let outcome = sending.run();
                ended.store(true, Ordering::SeqCst);
                outcome
            });
            let end = end;
            let read = self.hear(&mut reader, &*tracing, &queue, &ended);
            tracing.abort();
            drop(end);
            let written = writing.join().unwrap_or(Ok(()));
            read.and(written)
        })
    }

    /// Reads requests until the connection ends.
    fn hear(
        &self,
        reader: &mut LinkReader,
        tracing: &dyn Tracing,
        queue: &SendQueue,
        ended: &AtomicBool,
    ) -> Result<(), LinkError> {
        let mut newest = None;
        while !self.closing.load(Ordering::SeqCst) && !ended.load(Ordering::SeqCst) {
            // Of several requests that wait, only the last one is carried out.
            let patience = if newest.is_some() { Duration::ZERO } else { LOOK };
            let Some((kind, payload)) = reader.read(patience)? else {
                if let Some(request) = newest.take() {
                    render(tracing, request, queue);
                } else if reader.heard.elapsed() > SILENCE {
                    return Err(LinkError::Silent(SILENCE.as_secs()));
                }
                continue;
            };
            match ToTracer::read(kind, payload)? {
                ToTracer::Render(request) => newest = Some(request),
                ToTracer::Abort => {
                    newest = None;
                    tracing.abort();
                }
                ToTracer::Credit(more) => {
                    queue.update(|queued| queued.credit = queued.credit.saturating_add(more))
                }
                ToTracer::Ping(number) => queue.update(|queued| queued.pong = Some(number)),
                ToTracer::Fetch => queue.update(|queued| queued.fetch = true),
            }
        }
        Ok(())
    }
}

/// Refuses a viewer because another one is served.
fn turn_away(mut writer: LinkWriter) -> Result<(), LinkError> {
    let (mut frames, why) = (Vec::new(), "it serves another viewer already".to_owned());
    ToViewer::Refused(Refusal { epoch: 0, why }).write(&mut frames);
    writer.write(&frames)?;
    writer.close();
    Ok(())
}

/// Starts a render, and tells the writing thread to send its samples.
fn render(tracing: &dyn Tracing, request: Request, queue: &SendQueue) {
    let order = match tracing.render(&request) {
        Ok(()) => Ok(request),
        Err(why) => {
            // The render in progress is obsolete.
            tracing.abort();
            Err(Refusal { epoch: request.epoch, why })
        }
    };
    queue.update(|queued| queued.order = Some(order));
}
