//! Shows the picture of a render in progress in the image viewer tev (<https://github.com/Tom94/tev>).
//!
//! [`TevLink`] passes linear Rec.709 to a thread that connects and sends. The render never waits for the network: while the thread is busy,
//! or tev is not running, pictures are skipped.

use std::io::{self, ErrorKind};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use crate::client::{ClientError, Film, FilmCounts, FilmData, develop};
use crate::color::Profile;
use crate::image::stereo::Eye;
use crate::job::unpoisoned;
use crate::render::process::tell;

/// Interval between pictures.
const EVERY: Duration = Duration::from_secs(1);

/// Reading the film may take at most one part in this many of the time.
const SHARE: u32 = 20;

/// Time between two attempts to connect.
const RETRY: Duration = Duration::from_secs(3);

/// Longest wait for a connection.
const CONNECT: Duration = Duration::from_secs(2);

/// Longest wait for tev to take data.
const WRITE: Duration = Duration::from_secs(5);

/// Names of the channels.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Sends pictures to tev. Dropping it waits until the last one has been sent or has failed.
pub struct TevLink {
    shared: Arc<TevInbox>,
    thread: Option<JoinHandle<()>>,
    /// Earliest time for the next picture.
    next: Instant,
    /// Counts of the last picture sent.
    sent: FilmCounts,
}

/// State shared by the render and the thread.
#[derive(Default)]
struct TevInbox {
    state: Mutex<InboxState>,
    news: Condvar,
}

#[derive(Default)]
struct InboxState {
    /// The pictures to be sent next: one, or those of both eyes.
    pictures: Vec<TevPicture>,
    /// Whether the thread is sending pictures, or waiting before it reconnects.
    busy: bool,
    closing: bool,
}

struct TevPicture {
    name: String,
    data: FilmData,
}

impl TevLink {
    /// Starts the thread, which connects to `address` (HOST:PORT) when there is a picture.
    pub fn start(address: &str) -> Result<Self> {
        let shared = Arc::new(TevInbox::default());
        let sender = TevSender { address: address.to_owned(), connection: None, told: false };
        let inbox = shared.clone();
        let thread = Builder::new().name("tev".into()).spawn(move || sender.run(&inbox)).into_diagnostic()?;
        Ok(Self { shared, thread: Some(thread), next: Instant::now(), sent: FilmCounts::default() })
    }

    /// Whether a picture of a film with these counts is due.
    pub fn is_due(&self, counts: FilmCounts) -> bool {
        counts != self.sent && Instant::now() >= self.next && {
            let state = unpoisoned(&self.shared.state);
            !state.busy && state.pictures.is_empty()
        }
    }

    /// Passes on the picture of a film under this name.
    ///
    /// # Errors
    ///
    /// When the film cannot be read.
    pub fn send(&mut self, name: &str, film: &mut dyn Film) -> Result<(), ClientError> {
        self.send_all([(name.to_owned(), film)])
    }

    /// Passes on the pictures of both eyes, the left one's first, under this name with that of the eye.
    ///
    /// # Errors
    ///
    /// When a film cannot be read.
    pub fn send_eyes(&mut self, name: &str, films: [&mut dyn Film; 2]) -> Result<(), ClientError> {
        let [left, right] = films;
        let named = |eye: Eye| format!("{name} {}", eye.name());
        self.send_all([(named(Eye::Left), left), (named(Eye::Right), right)])
    }

    fn send_all<const N: usize>(&mut self, films: [(String, &mut dyn Film); N]) -> Result<(), ClientError> {
        let start = Instant::now();
        let read = |(name, film): (String, &mut dyn Film)| Ok(TevPicture { name, data: film.develop()? });
        let pictures = films.into_iter().map(read).collect::<Result<Vec<_>, ClientError>>()?;
        self.next = start + EVERY.max(SHARE * start.elapsed());
        self.sent = pictures.first().map(|picture| picture.data.counts).unwrap_or_default();
        unpoisoned(&self.shared.state).pictures = pictures;
        self.shared.news.notify_one();
        Ok(())
    }
}

impl Drop for TevLink {
    fn drop(&mut self) {
        unpoisoned(&self.shared.state).closing = true;
        self.shared.news.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The thread.
struct TevSender {
    address: String,
    connection: Option<TevConnection>,
    /// Whether the user has been told that tev is not running.
    told: bool,
}

impl TevSender {
    fn run(mut self, inbox: &TevInbox) {
        while let Some(pictures) = inbox.next() {
            match pictures.iter().try_for_each(|picture| self.show(picture)) {
                Ok(()) => self.told = false,
                Err(error) => {
                    self.connection = None;
                    if !std::mem::replace(&mut self.told, true) {
                        let address = &self.address;
                        tell(&format!(
                            "no tev at {address}: {error}; start tev, or leave --tev out. The render goes on and tries again every \
                             {} s",
                            RETRY.as_secs()
                        ));
                    }
                    inbox.rest(RETRY);
                }
            }
        }
    }

    /// Sends a picture, reconnecting if there is no connection or tev has closed it.
    fn show(&mut self, picture: &TevPicture) -> io::Result<()> {
        let known = self.connection.take().filter(TevConnection::is_open);
        let connection = match known {
            Some(connection) => connection,
            None => TevConnection::open(&self.address)?,
        };
        self.connection.insert(connection).show(picture)
    }
}

impl TevInbox {
    /// Waits for the next pictures; `None` at the end.
    fn next(&self) -> Option<Vec<TevPicture>> {
        let mut state = unpoisoned(&self.state);
        state.busy = false;
        loop {
            if !state.pictures.is_empty() {
                state.busy = true;
                return Some(std::mem::take(&mut state.pictures));
            }
            if state.closing {
                return None;
            }
            state = self.news.wait(state).unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// Waits for this time, or until the end of the render.
    fn rest(&self, time: Duration) {
        let state = unpoisoned(&self.state);
        let _ = self.news.wait_timeout_while(state, time, |state| !state.closing);
    }
}

/// A connection to tev.
struct TevConnection {
    client: TevClient,
    /// The same socket, to check whether it has been closed.
    socket: TcpStream,
    /// Names and sizes of the images created in tev.
    images: Vec<(String, [u32; 2])>,
}

impl TevConnection {
    fn open(address: &str) -> io::Result<Self> {
        let mut failed = io::Error::new(ErrorKind::NotFound, "the name has no address");
        for address in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(socket) => {
                    socket.set_write_timeout(Some(WRITE))?;
                    return Ok(Self {
                        client: TevClient::wrap(socket.try_clone()?),
                        socket,
                        images: Vec::new(),
                    });
                }
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }

    /// Whether tev is connected. It sends nothing, so data to read means that it has closed the connection.
    fn is_open(&self) -> bool {
        let peek = || {
            self.socket.set_nonblocking(true)?;
            let peeked = self.socket.peek(&mut [0]);
            self.socket.set_nonblocking(false)?;
            peeked
        };
        peek().is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }

    fn show(&mut self, TevPicture { name, data }: &TevPicture) -> io::Result<()> {
        let FilmData { width, height, .. } = *data;
        let image = (name.replace('\0', "?"), [width, height]);
        if !self.images.contains(&image) {
            let packet = PacketCreateImage {
                image_name: &image.0,
                grab_focus: true,
                width,
                height,
                channel_names: &CHANNELS,
            };
            self.client.send(packet)?;
            self.images.retain(|(name, _)| *name != image.0);
            self.images.push(image.clone());
        }
        let pixels = develop::linear_rgb(data, &Profile::srgb());
        self.client.send(PacketUpdateImage {
            image_name: &image.0,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3; 3],
            x: 0,
            y: 0,
            width,
            height,
            data: pixels.as_flattened(),
        })
    }
}
