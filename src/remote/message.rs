//! Messages between a viewer and a tracer, and their bytes.
//!
//! A frame is its kind (1 byte), the length of its payload (u32, little endian) and the payload. A receiver knows before the payload comes
//! how long it may be, and takes no more than that.

use serde::{Deserialize, Serialize};

use crate::stream::{FinishReason, Rejections};

/// Version of the protocol. Both sides must have the same one: they say it first, and part with an error that names both if they differ.
pub const VERSION: u16 = 2;

/// Largest payload of a frame of samples, bytes.
pub const MOST_SAMPLE_BYTES: usize = 60 << 10;

/// Largest payload of any other frame, bytes.
pub const MOST_BYTES: usize = 1 << 20;

/// Largest part of a file in one frame, bytes.
pub const FILE_PART: usize = 60 << 10;

/// Why a message cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// There is no such kind of message.
    #[error("a message of unknown kind {0}")]
    Kind(u8),
    /// It is longer than messages of its kind may be.
    #[error("a message of kind {kind} with {length} bytes, of which {most} are allowed")]
    Length {
        /// The kind.
        kind: u8,
        /// Length of its payload.
        length: usize,
        /// Largest length.
        most: usize,
    },
    /// The payload does not say what it should.
    #[error("a message that makes no sense: {0}")]
    Content(String),
}

/// A kind of message, by the number that is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// To the tracer, JSON: [`Request`].
    Render = 1,
    /// To the tracer, empty: stop tracing.
    Abort = 2,
    /// To the tracer, u32: so many more bytes of samples may be sent.
    Credit = 3,
    /// To the tracer, u64: to be sent back.
    Ping = 4,
    /// To the tracer, empty: send the files of the scene.
    Fetch = 5,
    /// To the viewer, JSON: [`Welcome`].
    Welcome = 65,
    /// To the viewer: blocks of samples, see [`super::blocks`].
    Samples = 66,
    /// To the viewer, JSON: [`Ended`].
    Ended = 67,
    /// To the viewer, u64: the answer to a ping.
    Pong = 68,
    /// To the viewer, JSON: [`Refusal`].
    Refused = 69,
    /// To the viewer, JSON: [`RejectedValues`].
    Rejected = 70,
    /// To the viewer, JSON: [`FileStart`].
    File = 71,
    /// To the viewer: the next bytes of the file.
    FilePart = 72,
    /// To the viewer, empty: all files were sent.
    FilesEnd = 73,
}

impl Kind {
    const ALL: [Kind; 14] = [
        Kind::Render,
        Kind::Abort,
        Kind::Credit,
        Kind::Ping,
        Kind::Fetch,
        Kind::Welcome,
        Kind::Samples,
        Kind::Ended,
        Kind::Pong,
        Kind::Refused,
        Kind::Rejected,
        Kind::File,
        Kind::FilePart,
        Kind::FilesEnd,
    ];

    /// Kind and length of a frame from its first [`FRAME_HEADER`] bytes.
    ///
    /// # Errors
    ///
    /// [`MessageError::Kind`], also for one that only the other side sends, and [`MessageError::Length`].
    pub fn of_frame(header: [u8; FRAME_HEADER], sender: Side) -> Result<(Self, usize), MessageError> {
        let [number, length @ ..] = header;
        let kind = Self::ALL.into_iter().find(|kind| *kind as u8 == number && kind.sender() == sender);
        let kind = kind.ok_or(MessageError::Kind(number))?;
        let (length, most) = (u32::from_le_bytes(length) as usize, kind.most());
        if length > most {
            return Err(MessageError::Length { kind: number, length, most });
        }
        Ok((kind, length))
    }

    fn sender(self) -> Side {
        if (self as u8) < 64 { Side::Viewer } else { Side::Tracer }
    }

    fn most(self) -> usize {
        match self {
            Kind::Abort | Kind::Fetch | Kind::FilesEnd => 0,
            Kind::Credit => 4,
            Kind::Ping | Kind::Pong => 8,
            Kind::Samples => MOST_SAMPLE_BYTES,
            Kind::FilePart => FILE_PART,
            Kind::Render | Kind::Welcome | Kind::Ended | Kind::Refused | Kind::Rejected | Kind::File => {
                MOST_BYTES
            }
        }
    }
}

/// Bytes before the payload of a frame.
pub const FRAME_HEADER: usize = 5;

/// The two sides of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Has the window, and asks.
    Viewer,
    /// Traces, and sends samples.
    Tracer,
}

impl Side {
    /// The side at the other end.
    pub fn other(self) -> Self {
        match self {
            Side::Viewer => Side::Tracer,
            Side::Tracer => Side::Viewer,
        }
    }
}

/// The command *render*: what is to be traced from now on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Number of the render; newer than every one before on this connection.
    pub epoch: u64,
    /// The tracer's own sequence: no two tracers of a picture have the same, so that no sample is counted twice.
    pub seed: u32,
    /// Camera paths after which the render ends; `None` is no end.
    pub paths: Option<u64>,
    /// Samples are to be sent in 12 bytes.
    pub compressed: bool,
    /// Cells along the longer side of the picture in the finest film delta, where the link is slower than the tracer; 0 is no deltas.
    pub finest: u32,
    /// The scene, view and settings: JSON that this module does not interpret.
    pub order: String,
}

/// The first message of a tracer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Welcome {
    /// Version of the program.
    pub program: String,
    /// Digest of the scene, to compare with the viewer's.
    pub digest: String,
    /// Values that the scene was read with.
    pub defines: Vec<(String, String)>,
    /// The scene was read leniently: unsupported parts were left out.
    pub lenient: bool,
    /// Number of tracing threads.
    pub threads: usize,
}

/// A render has ended; all of its samples were sent before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// The render.
    pub epoch: u64,
    /// How it ended.
    pub reason: FinishReason,
}

/// A request that is not carried out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// The render that is refused; 0 if the refused request is no render.
    pub epoch: u64,
    /// Why.
    pub why: String,
}

/// Values rejected since the last message of this kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RejectedValues {
    /// The render.
    pub epoch: u64,
    /// The values.
    pub rejections: Rejections,
}

/// A file of the scene begins; its bytes follow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileStart {
    /// Path relative to the common folder of all files, parts separated by `/`. The first file is the scene.
    pub path: String,
    /// Its length, bytes.
    pub length: u64,
}

/// A message from the viewer to the tracer.
#[derive(Clone, Debug, PartialEq)]
pub enum ToTracer {
    /// Trace this from now on.
    Render(Request),
    /// Stop tracing.
    Abort,
    /// So many more bytes of samples may be sent.
    Credit(u32),
    /// To be answered with the same number.
    Ping(u64),
    /// Send the files of the scene.
    Fetch,
}

impl ToTracer {
    /// Appends the frame to `bytes`.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        match self {
            ToTracer::Render(request) => frame(bytes, Kind::Render, &json(request)),
            ToTracer::Abort => frame(bytes, Kind::Abort, &[]),
            ToTracer::Credit(more) => frame(bytes, Kind::Credit, &more.to_le_bytes()),
            ToTracer::Ping(number) => frame(bytes, Kind::Ping, &number.to_le_bytes()),
            ToTracer::Fetch => frame(bytes, Kind::Fetch, &[]),
        }
    }

    /// Reads the payload of a frame.
    ///
    /// # Errors
    ///
    /// [`MessageError`].
    pub fn read(kind: Kind, payload: &[u8]) -> Result<Self, MessageError> {
        match kind {
            Kind::Render => match of_json::<Request>(payload)? {
                // The last number stands for no epoch.
                Request { epoch: 0 | u64::MAX, .. } => {
                    Err(MessageError::Content("the number of a render".into()))
                }
                request => Ok(ToTracer::Render(request)),
            },
            Kind::Abort => Ok(ToTracer::Abort),
            Kind::Credit => array(payload).map(|bytes| ToTracer::Credit(u32::from_le_bytes(bytes))),
            Kind::Ping => array(payload).map(|bytes| ToTracer::Ping(u64::from_le_bytes(bytes))),
            Kind::Fetch => Ok(ToTracer::Fetch),
            kind => Err(MessageError::Kind(kind as u8)),
        }
    }
}

/// A message from the tracer to the viewer.
#[derive(Clone, Debug, PartialEq)]
pub enum ToViewer<'a> {
    /// The first message.
    Welcome(Welcome),
    /// Blocks of samples, for [`super::blocks::read`].
    Samples(&'a [u8]),
    /// A render has ended.
    Ended(Ended),
    /// The answer to a ping.
    Pong(u64),
    /// A request is refused.
    Refused(Refusal),
    /// Values that were rejected.
    Rejected(RejectedValues),
    /// A file of the scene begins.
    File(FileStart),
    /// Its next bytes.
    FilePart(&'a [u8]),
    /// All files were sent.
    FilesEnd,
}

impl<'a> ToViewer<'a> {
    /// Appends the frame to `bytes`.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        match self {
            ToViewer::Welcome(welcome) => frame(bytes, Kind::Welcome, &json(welcome)),
            ToViewer::Samples(samples) => frame(bytes, Kind::Samples, samples),
            ToViewer::Ended(ended) => frame(bytes, Kind::Ended, &json(ended)),
            ToViewer::Pong(number) => frame(bytes, Kind::Pong, &number.to_le_bytes()),
            ToViewer::Refused(refusal) => frame(bytes, Kind::Refused, &json(refusal)),
            ToViewer::Rejected(rejected) => frame(bytes, Kind::Rejected, &json(rejected)),
            ToViewer::File(file) => frame(bytes, Kind::File, &json(file)),
            ToViewer::FilePart(part) => frame(bytes, Kind::FilePart, part),
            ToViewer::FilesEnd => frame(bytes, Kind::FilesEnd, &[]),
        }
    }

    /// Reads the payload of a frame.
    ///
    /// # Errors
    ///
    /// [`MessageError`].
    pub fn read(kind: Kind, payload: &'a [u8]) -> Result<Self, MessageError> {
        match kind {
            Kind::Welcome => of_json(payload).map(ToViewer::Welcome),
            Kind::Samples => Ok(ToViewer::Samples(payload)),
            Kind::Ended => of_json(payload).map(ToViewer::Ended),
            Kind::Pong => array(payload).map(|bytes| ToViewer::Pong(u64::from_le_bytes(bytes))),
            Kind::Refused => of_json(payload).map(ToViewer::Refused),
            Kind::Rejected => of_json(payload).map(ToViewer::Rejected),
            Kind::File => of_json(payload).map(ToViewer::File),
            Kind::FilePart => Ok(ToViewer::FilePart(payload)),
            Kind::FilesEnd => Ok(ToViewer::FilesEnd),
            kind => Err(MessageError::Kind(kind as u8)),
        }
    }
}

/// Text of the other side, which goes to the log and the panel: at most 300 characters, none of them a control character.
pub fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(300).collect()
}

fn frame(bytes: &mut Vec<u8>, kind: Kind, payload: &[u8]) {
    debug_assert!(payload.len() <= kind.most(), "{kind:?}: {} bytes", payload.len());
    bytes.push(kind as u8);
    bytes.extend((payload.len() as u32).to_le_bytes());
    bytes.extend(payload);
}

fn json<T: Serialize>(value: &T) -> Vec<u8> {
    // These types have neither maps with other keys than text nor fallible parts.
    serde_json::to_vec(value).unwrap_or_default()
}

fn of_json<'a, T: Deserialize<'a>>(payload: &'a [u8]) -> Result<T, MessageError> {
    serde_json::from_slice(payload).map_err(|error| MessageError::Content(printable(&error.to_string())))
}

fn array<const N: usize>(payload: &[u8]) -> Result<[u8; N], MessageError> {
    payload.try_into().map_err(|_| MessageError::Content(format!("{} bytes for a number", payload.len())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kind and the payload of the only frame in `bytes`.
    fn unframed(bytes: &[u8], sender: Side) -> (Kind, &[u8]) {
        let (header, payload) = bytes.split_first_chunk().expect("a header");
        let (kind, length) = Kind::of_frame(*header, sender).expect("a frame");
        assert_eq!(payload.len(), length);
        (kind, payload)
    }

    #[test]
    fn messages_come_back_as_they_were() {
        let request = Request {
            epoch: 7,
            seed: 3,
            paths: Some(9),
            compressed: true,
            finest: 640,
            order: "{\"a\": 1}".into(),
        };
        let messages = [
            ToTracer::Render(request),
            ToTracer::Abort,
            ToTracer::Credit(77),
            ToTracer::Ping(1 << 40),
            ToTracer::Fetch,
        ];
        for message in messages {
            let mut bytes = Vec::new();
            message.write(&mut bytes);
            let (kind, payload) = unframed(&bytes, Side::Viewer);
            assert_eq!(ToTracer::read(kind, payload), Ok(message));
            let header = bytes.first_chunk().expect("a header");
            assert_eq!(Kind::of_frame(*header, Side::Tracer), Err(MessageError::Kind(bytes[0])));
        }
        let ended = Ended { epoch: 3, reason: FinishReason::Panicked { index: 5, message: "no".into() } };
        let messages = [
            ToViewer::Welcome(Welcome { digest: "s".into(), threads: 8, ..Welcome::default() }),
            ToViewer::Samples(&[1, 2, 3]),
            ToViewer::Ended(ended),
            ToViewer::Pong(5),
            ToViewer::Refused(Refusal { epoch: 0, why: "busy".into() }),
            ToViewer::Rejected(RejectedValues::default()),
            ToViewer::File(FileStart { path: "a/b.xml".into(), length: 3 }),
            ToViewer::FilePart(&[9; 100]),
            ToViewer::FilesEnd,
        ];
        for message in messages {
            let mut bytes = Vec::new();
            message.write(&mut bytes);
            let (kind, payload) = unframed(&bytes, Side::Tracer);
            assert_eq!(ToViewer::read(kind, payload), Ok(message));
        }
    }

    #[test]
    fn long_messages_are_refused_by_their_header() {
        let header = |kind: Kind, length: u32| {
            let [a, b, c, d] = length.to_le_bytes();
            Kind::of_frame([kind as u8, a, b, c, d], kind.sender())
        };
        assert!(header(Kind::Samples, MOST_SAMPLE_BYTES as u32).is_ok());
        for (kind, length) in
            [(Kind::Samples, 61_441), (Kind::Ping, 9), (Kind::Abort, 1), (Kind::Render, u32::MAX)]
        {
            assert!(matches!(header(kind, length), Err(MessageError::Length { .. })), "{kind:?}");
        }
        assert_eq!(Kind::of_frame([0; 5], Side::Viewer), Err(MessageError::Kind(0)));
    }

    #[test]
    fn foreign_text_is_made_harmless() {
        assert_eq!(printable("a\x1b[2J\nb"), "a[2Jb");
        assert_eq!(printable(&"x".repeat(4000)).len(), 300);
        let reason = format!("{{\"epoch\":1,\"reason\":\"{}\"}}", "\\u001b\\n".repeat(9000));
        let Err(error) = ToViewer::read(Kind::Ended, reason.as_bytes()) else { panic!("no such reason") };
        let words = error.to_string();
        assert!(words.len() < 400 && !words.contains(['\n', '\u{1b}']), "{words}");
    }
}
