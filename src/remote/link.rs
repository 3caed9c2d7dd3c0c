//! A connection between a viewer and a tracer: who is there, the token, and frames in both directions.
//!
//! ```text
//! viewer ─▶ tracer   "PNTLLIVE", version u16, token? u8          both in clear, within HANDSHAKE
//! tracer ─▶ viewer   the same
//! both               with a token: Noise_NNpsk0_25519_ChaChaPoly_BLAKE2s, whose pre-shared key is derived from it
//! both               frames (see `message`); with a token within encrypted records: length u16, record
//! ```
//!
//! Nothing is read beyond what the next frame or record may hold, and before the handshake is over nothing beyond its few bytes.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::{Duration, Instant};

use snow::StatelessTransportState;

use super::message::{FRAME_HEADER, Kind, MessageError, Side, VERSION};

/// The first bytes of every connection.
const MAGIC: [u8; 8] = *b"PNTLLIVE";

/// Time for a handshake.
const HANDSHAKE: Duration = Duration::from_secs(5);

/// How long a write may make no progress before the connection is closed.
const STUCK: Duration = Duration::from_secs(20);

/// Longest encrypted record, and its overhead.
const RECORD: usize = 65_535;
const TAG: usize = 16;

/// The Noise protocol with a token.
const NOISE: &str = "Noise_NNpsk0_25519_ChaChaPoly_BLAKE2s";

/// Longest time for what is written at once, however slowly it goes on.
const SLOWEST: Duration = Duration::from_secs(180);

/// Bytes read from a socket at once.
const CHUNK: usize = 64 << 10;

/// Why a connection cannot be made or has ended.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The network failed, or the other side has gone.
    #[error("the connection broke: {0}")]
    Io(#[from] std::io::Error),
    /// The other side has closed the connection.
    #[error("the other side has closed the connection")]
    Closed,
    /// It does not speak this protocol.
    #[error("it does not speak the protocol of Pointillist")]
    Foreign,
    /// It speaks another version.
    #[error(
        "it speaks version {theirs} of the protocol, this program {VERSION}: use the same version of Pointillist on both machines"
    )]
    Version {
        /// Its version.
        theirs: u16,
    },
    /// One side has a token and the other has none.
    #[error("{}", if *.here { "it has no token, and this side has one: give --token-file to both" } else { "it wants a token: give --token-file" })]
    TokenMissing {
        /// This side has one.
        here: bool,
    },
    /// The tokens differ.
    #[error("the token is not the same on both sides")]
    Token,
    /// An encrypted record was changed on its way.
    #[error("a record was damaged on its way")]
    Damaged,
    /// No message came for so long that there is nobody, or nobody who makes sense.
    #[error("no message has come for {0} s")]
    Silent(u64),
    /// The handshake took too long.
    #[error("it said nothing for {} s", HANDSHAKE.as_secs())]
    Late,
    /// It sent an invalid message.
    #[error("it sent {0}")]
    Message(#[from] MessageError),
}

/// A secret that both sides know.
#[derive(Clone)]
pub struct Token([u8; 32]);

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

impl Token {
    /// Fewest characters of a token: whoever hears a handshake can try short ones without anybody noticing.
    pub const SHORTEST: usize = 16;

    /// The token of this text, without the blanks around it; `None` if it is too short.
    pub fn new(text: &str) -> Option<Self> {
        let text = text.trim();
        (text.chars().count() >= Self::SHORTEST)
            .then(|| Self(blake3::derive_key("Pointillist live protocol, token", text.as_bytes())))
    }
}

/// The receiving half of a connection.
pub struct LinkReader {
    socket: TcpStream,
    /// The other side, whose frames are read.
    sender: Side,
    cipher: Option<Arc<StatelessTransportState>>,
    /// Records read so far.
    records: u64,
    /// Encrypted bytes that are no whole record yet.
    sealed: Vec<u8>,
    /// Frames, from `at` on.
    open: Vec<u8>,
    at: usize,
    chunk: Box<[u8]>,
    /// When bytes last arrived.
    pub heard: Instant,
    /// Bytes that came since the start.
    pub bytes: u64,
}

/// The sending half of a connection.
pub struct LinkWriter {
    socket: TcpStream,
    cipher: Option<Arc<StatelessTransportState>>,
    records: u64,
    sealed: Vec<u8>,
}

/// Connects to `host:port`.
pub(super) fn connect(address: &str) -> Result<TcpStream, LinkError> {
    /// Time for each address of the host.
    const CONNECT: Duration = Duration::from_secs(5);
    let mut last = std::io::Error::new(std::io::ErrorKind::NotFound, "the host has no address");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(socket) => return Ok(socket),
            Err(error) => last = error,
        }
    }
    Err(last.into())
}

/// Greets the other side of a fresh connection and checks version and token.
///
/// # Errors
///
/// [`LinkError`]; the connection is closed then.
pub fn greet(
    socket: TcpStream,
    side: Side,
    token: Option<&Token>,
) -> Result<(LinkReader, LinkWriter), LinkError> {
    let deadline = Instant::now() + HANDSHAKE;
    socket.set_nodelay(true)?;
    socket.set_nonblocking(false)?;
    socket.set_write_timeout(Some(STUCK))?;
    let secure = token.is_some();
    let hello = {
        let [low, high] = VERSION.to_le_bytes();
        let mut hello = MAGIC.to_vec();
        hello.extend([low, high, u8::from(secure)]);
        hello
    };
    let mut socket_out = &socket;
    if side == Side::Viewer {
        socket_out.write_all(&hello)?;
    }
    let mut theirs = [0; MAGIC.len() + 3];
    read_exact(&socket, &mut theirs[..MAGIC.len()], deadline)?;
    if theirs[..MAGIC.len()] != MAGIC {
        return Err(LinkError::Foreign);
    }
    read_exact(&socket, &mut theirs[MAGIC.len()..], deadline)?;
    if side == Side::Tracer {
        // Also to those that are refused, so that they can tell why.
        socket_out.write_all(&hello)?;
    }
    let [.., low, high, with_token] = theirs;
    match u16::from_le_bytes([low, high]) {
        VERSION => {}
        theirs => return Err(LinkError::Version { theirs }),
    }
    if (with_token != 0) != secure {
        return Err(LinkError::TokenMissing { here: secure });
    }
    let cipher = match token {
        Some(token) => Some(Arc::new(agree(&socket, side, token, &hello, deadline)?)),
        None => None,
    };
    let mut reader = LinkReader {
        socket: socket.try_clone()?,
        sender: side.other(),
        cipher: cipher.clone(),
        records: 0,
        sealed: Vec::new(),
        open: Vec::new(),
        at: 0,
        chunk: vec![0; CHUNK].into_boxed_slice(),
        heard: Instant::now(),
        bytes: 0,
    };
    let mut writer = LinkWriter { socket, cipher, records: 0, sealed: Vec::new() };
    // The record that ends the handshake had the number 0.
    match side {
        _ if token.is_none() => {}
        Side::Viewer => writer.records = 1,
        Side::Tracer => reader.records = 1,
    }
    Ok((reader, writer))
}

/// The Noise handshake: two messages, and an empty record from the viewer, after which both sides have proven that they know the token now:
/// the first message alone could be a copy of one that was sent long ago.
fn agree(
    socket: &TcpStream,
    side: Side,
    token: &Token,
    hello: &[u8],
    deadline: Instant,
) -> Result<StatelessTransportState, LinkError> {
    let builder = |()| -> Result<_, snow::Error> {
        let builder = snow::Builder::new(NOISE.parse()?).psk(0, &token.0)?.prologue(hello)?;
        match side {
            Side::Viewer => builder.build_initiator(),
            Side::Tracer => builder.build_responder(),
        }
    };
    let mut state = builder(()).map_err(|_| LinkError::Token)?;
    // Messages without payload: a key and a tag.
    let mut message = [0; 32 + TAG];
    let mut empty = [0; TAG];
    let mut send = |state: &mut snow::HandshakeState| -> Result<(), LinkError> {
        let length = state.write_message(&[], &mut message).map_err(|_| LinkError::Token)?;
        let mut socket = socket;
        Ok(socket.write_all(&message[..length])?)
    };
    let mut receive = |state: &mut snow::HandshakeState| -> Result<(), LinkError> {
        let mut message = [0; 32 + TAG];
        // A tracer closes the connection where the token is wrong.
        read_exact(socket, &mut message, deadline).map_err(|error| match error {
            LinkError::Closed if side == Side::Viewer => LinkError::Token,
            error => error,
        })?;
        state.read_message(&message, &mut empty).map(drop).map_err(|_| LinkError::Token)
    };
    match side {
        Side::Viewer => {
            send(&mut state)?;
            receive(&mut state)?;
        }
        Side::Tracer => {
            receive(&mut state)?;
            send(&mut state)?;
        }
    }
    let cipher = state.into_stateless_transport_mode().map_err(|_| LinkError::Token)?;
    let mut record = [0; TAG];
    match side {
        Side::Viewer => {
            cipher.write_message(0, &[], &mut record).map_err(|_| LinkError::Token)?;
            let mut socket = socket;
            socket.write_all(&record)?;
        }
        Side::Tracer => {
            read_exact(socket, &mut record, deadline)?;
            cipher.read_message(0, &record, &mut []).map_err(|_| LinkError::Token)?;
        }
    }
    Ok(cipher)
}

/// Reads until `bytes` is full.
fn read_exact(mut socket: &TcpStream, bytes: &mut [u8], deadline: Instant) -> Result<(), LinkError> {
    let mut filled = 0;
    while filled < bytes.len() {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(LinkError::Late);
        }
        socket.set_read_timeout(Some(left))?;
        match socket.read(&mut bytes[filled..]) {
            Ok(0) => return Err(LinkError::Closed),
            Ok(n) => filled += n,
            Err(error) if is_pause(&error) => {}
            Err(error) => return Err(broken(error)),
        }
    }
    Ok(())
}

/// Writes all of `bytes`.
fn write_all(mut socket: &TcpStream, mut bytes: &[u8]) -> Result<(), LinkError> {
    let begin = Instant::now();
    while !bytes.is_empty() {
        match socket.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(broken(error)),
        }
        if begin.elapsed() > SLOWEST && !bytes.is_empty() {
            return Err(LinkError::Io(ErrorKind::TimedOut.into()));
        }
    }
    Ok(())
}

/// Nothing has come yet.
fn is_pause(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// The connection has ended: by the other side, or by the network.
fn broken(error: std::io::Error) -> LinkError {
    match error.kind() {
        ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => LinkError::Closed,
        _ => LinkError::Io(error),
    }
}

impl LinkReader {
    /// The next frame: its kind and payload; `None` if it is not there as a whole after `patience`.
    ///
    /// # Errors
    ///
    /// [`LinkError`], after which the connection is of no use.
    pub fn read(&mut self, patience: Duration) -> Result<Option<(Kind, &[u8])>, LinkError> {
        let deadline = Instant::now() + patience;
        loop {
            if let Some((kind, length)) = self.frame()? {
                let start = self.at + FRAME_HEADER;
                self.at = start + length;
                return Ok(Some((kind, &self.open[start..start + length])));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || !self.fill(left)? {
                return Ok(None);
            }
        }
    }

    /// Kind and length of the frame that is there as a whole.
    fn frame(&mut self) -> Result<Option<(Kind, usize)>, LinkError> {
        let Some(header) = self.open[self.at..].first_chunk() else { return Ok(None) };
        let (kind, length) = Kind::of_frame(*header, self.sender)?;
        Ok((self.open.len() - self.at >= FRAME_HEADER + length).then_some((kind, length)))
    }

    /// Waits for bytes and takes them; returns whether there were any.
    fn fill(&mut self, patience: Duration) -> Result<bool, LinkError> {
        self.socket.set_read_timeout(Some(patience))?;
        let count = match self.socket.read(&mut self.chunk) {
            Ok(0) => return Err(LinkError::Closed),
            Ok(count) => count,
            Err(error) if is_pause(&error) => return Ok(false),
            Err(error) => return Err(broken(error)),
        };
        (self.heard, self.bytes) = (Instant::now(), self.bytes + count as u64);
        self.open.drain(..std::mem::take(&mut self.at));
        let Some(cipher) = &self.cipher else {
            self.open.extend(&self.chunk[..count]);
            return Ok(true);
        };
        self.sealed.extend(&self.chunk[..count]);
        let mut read = 0;
        while let Some(length) = self.sealed[read..].first_chunk() {
            let length = usize::from(u16::from_le_bytes(*length));
            let Some(record) = self.sealed.get(read + 2..read + 2 + length) else { break };
            let start = self.open.len();
            self.open.resize(start + length, 0);
            let opened = cipher.read_message(self.records, record, &mut self.open[start..]);
            self.open.truncate(start + opened.map_err(|_| LinkError::Damaged)?);
            (self.records, read) = (self.records + 1, read + 2 + length);
        }
        self.sealed.drain(..read);
        Ok(true)
    }
}

impl LinkWriter {
    /// Sends frames.
    ///
    /// # Errors
    ///
    /// [`LinkError`] where the connection has ended, has stood still for too long, or takes minutes for what should take a moment.
    pub fn write(&mut self, frames: &[u8]) -> Result<(), LinkError> {
        let Some(cipher) = &self.cipher else { return write_all(&self.socket, frames) };
        self.sealed.clear();
        for part in frames.chunks(RECORD - TAG) {
            let start = self.sealed.len();
            self.sealed.resize(start + 2 + part.len() + TAG, 0);
            let (length, record) = self.sealed[start..].split_at_mut(2);
            let sealed = cipher.write_message(self.records, part, record).map_err(|_| LinkError::Damaged)?;
            length.copy_from_slice(&(sealed as u16).to_le_bytes());
            self.records += 1;
        }
        write_all(&self.socket, &self.sealed)
    }

    /// Ends the connection, for the thread that reads from it as well.
    pub fn close(&self) {
        let _ = self.socket.shutdown(Shutdown::Both);
    }

    /// Another handle to the socket, to end the connection with.
    ///
    /// # Errors
    ///
    /// The system's error, if it has no handles left.
    pub fn socket(&self) -> std::io::Result<TcpStream> {
        self.socket.try_clone()
    }
}
