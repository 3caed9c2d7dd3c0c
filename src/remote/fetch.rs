//! Fetches the scene of a tracer, for a viewer that has no copy of it.

use std::fs::{self, File};
use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use super::link::{LinkError, greet};
use super::message::{Side, ToTracer, ToViewer, Welcome};
use super::tracers::TracerAddress;

/// How long a tracer may be silent meanwhile.
const SILENCE: Duration = Duration::from_secs(10);

/// Most bytes and files of a scene that is fetched.
const MOST_BYTES: u64 = 16 << 30;
const MOST_FILES: usize = 100_000;

/// Why a scene cannot be fetched.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// The connection failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The tracer refused.
    #[error("{0}")]
    Refused(String),
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The tracer sends what is no scene.
    #[error("it sends no scene: {0}")]
    Nonsense(&'static str),
}

/// A scene that was fetched.
#[derive(Debug)]
pub struct Fetched {
    /// The scene file; the others lie beside it as they did there.
    pub scene: PathBuf,
    /// What the tracer says of it.
    pub welcome: Welcome,
}

/// Fetches the files of a tracer's scene into a folder below `folder` that is named by their digest, unless it is there already.
///
/// # Errors
///
/// [`FetchError`]; what was fetched so far is removed.
pub fn fetch(tracer: &TracerAddress, folder: &Path) -> Result<Fetched, FetchError> {
    let (mut reader, mut writer) = {
        let socket = connect(&tracer.address)?;
        greet(socket, Side::Viewer, tracer.token.as_ref())?
    };
    let outcome = (|| {
        let mut welcome = Welcome::default();
        let mut files =
            Files { folder: folder.to_path_buf(), part: None, open: None, paths: Vec::new(), bytes: 0 };
        loop {
            let Some((kind, payload)) = reader.read(Duration::from_millis(100))? else {
                if reader.heard.elapsed() > SILENCE {
                    return Err(LinkError::Late.into());
                }
                continue;
            };
            match ToViewer::read(kind, payload).map_err(LinkError::from)? {
                ToViewer::Welcome(said) => {
                    let there = files.begin(&said.digest)?;
                    welcome = said;
                    if let Some(scene) = there {
                        return Ok(Fetched { scene, welcome });
                    }
                    let mut frames = Vec::new();
                    ToTracer::Fetch.write(&mut frames);
                    writer.write(&frames)?;
                }
                ToViewer::File(file) => files.file(&file.path, file.length)?,
                ToViewer::FilePart(part) => files.part(part)?,
                ToViewer::FilesEnd => return Ok(Fetched { scene: files.end()?, welcome }),
                ToViewer::Refused(why) => return Err(FetchError::Refused(why)),
                _ => {}
            }
        }
    })();
    writer.close();
    outcome
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

/// The files on their way.
struct Files {
    /// Where scenes are kept.
    folder: PathBuf,
    /// Where the files are written, and the name of the folder that they will have.
    part: Option<(tempfile::TempDir, PathBuf)>,
    /// The file that is written, and how many bytes of it are to come.
    open: Option<(File, PathBuf, u64)>,
    /// All files, relative to the folder.
    paths: Vec<PathBuf>,
    bytes: u64,
}

/// Beside the files: which of them is the scene.
const SCENE: &str = ".scene";

impl Files {
    /// The scene has this hash; returns its file if it is there already.
    fn begin(&mut self, digest: &str) -> Result<Option<PathBuf>, FetchError> {
        let plain =
            !digest.is_empty() && digest.len() <= 64 && digest.chars().all(|c| c.is_ascii_alphanumeric());
        if !plain {
            return Err(FetchError::Nonsense("its hash is none"));
        }
        let place = self.folder.join(digest);
        let scene = fs::read_to_string(place.join(SCENE)).ok().map(|scene| place.join(scene));
        if let Some(scene) = scene.filter(|scene| scene.is_file()) {
            return Ok(Some(scene));
        }
        let write = |source| FetchError::Write { path: self.folder.clone(), source };
        fs::create_dir_all(&self.folder).map_err(write)?;
        self.part = Some((tempfile::tempdir_in(&self.folder).map_err(write)?, place));
        Ok(None)
    }

    /// A file begins.
    fn file(&mut self, path: &str, length: u64) -> Result<(), FetchError> {
        let Some((part, _)) = &self.part else {
            return Err(FetchError::Nonsense("a file that nobody has asked for"));
        };
        let relative = Path::new(path);
        let plain = path.len() <= 1000 && !path.contains('\\') && relative.components().count() > 0;
        if !plain || !relative.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(FetchError::Nonsense("a file outside the folder"));
        }
        self.bytes = self.bytes.saturating_add(length);
        if self.open.as_ref().is_some_and(|(_, _, left)| *left > 0) {
            return Err(FetchError::Nonsense("a file within another one"));
        }
        if self.bytes > MOST_BYTES || self.paths.len() >= MOST_FILES {
            return Err(FetchError::Nonsense("more than 16 GiB or 100,000 files"));
        }
        let path = part.path().join(relative);
        let write = |source| FetchError::Write { path: path.clone(), source };
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(write)?;
        }
        let file = File::create_new(&path).map_err(write)?;
        self.open = Some((file, path, length));
        self.paths.push(relative.to_path_buf());
        Ok(())
    }

    /// More bytes of it.
    fn part(&mut self, bytes: &[u8]) -> Result<(), FetchError> {
        let Some((file, path, left)) = &mut self.open else {
            return Err(FetchError::Nonsense("bytes of no file"));
        };
        *left = left.checked_sub(bytes.len() as u64).ok_or(FetchError::Nonsense("too many bytes"))?;
        file.write_all(bytes).map_err(|source| FetchError::Write { path: path.clone(), source })
    }

    /// All files are there.
    fn end(self) -> Result<PathBuf, FetchError> {
        let complete = self.open.is_none_or(|(_, _, left)| left == 0);
        let (Some((part, place)), Some(scene), true) = (self.part, self.paths.first(), complete) else {
            return Err(FetchError::Nonsense("not all of its files"));
        };
        let write = |source| FetchError::Write { path: place.clone(), source };
        fs::write(part.path().join(SCENE), scene.to_string_lossy().as_bytes()).map_err(write)?;
        // Another viewer may have been faster with the same files.
        if fs::rename(part.path(), &place).is_ok() {
            let _ = part.keep();
        } else if !place.join(scene).is_file() {
            return Err(write(std::io::Error::other("the folder exists and is not that scene")));
        }
        Ok(place.join(scene))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(folder: &Path) -> Files {
        Files { folder: folder.to_path_buf(), part: None, open: None, paths: Vec::new(), bytes: 0 }
    }

    #[test]
    fn a_scene_comes_as_a_whole_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut good = files(folder.path());
        assert_eq!(good.begin("abc123").expect("a hash"), None);
        good.file("scenes/a.xml", 5).expect("a file");
        good.part(b"<sce").expect("bytes");
        good.part(b"n").expect("bytes");
        good.file("meshes/b.ply", 0).expect("a file");
        let scene = good.end().expect("a scene");
        assert_eq!(fs::read(&scene).expect("the scene"), b"<scen");
        // It need not be fetched again.
        assert_eq!(files(folder.path()).begin("abc123").expect("a hash"), Some(scene));

        let mut short = files(folder.path());
        assert_eq!(short.begin("def").expect("a hash"), None);
        short.file("a.xml", 5).expect("a file");
        short.part(b"1234").expect("bytes");
        assert!(short.end().is_err());
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1, "nothing half-written is left");
    }

    #[test]
    fn files_stay_in_their_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        for digest in ["", "..", "a/b", &"x".repeat(65)] {
            assert!(files(folder.path()).begin(digest).is_err(), "{digest}");
        }
        let mut files = files(folder.path());
        assert!(files.file("a.xml", 1).is_err(), "nobody has asked");
        files.begin("abc").expect("a hash");
        for path in ["../a", "/etc/passwd", "a/../../b", "", "a\\b", ".", "./../x"] {
            assert!(files.file(path, 1).is_err(), "{path}");
        }
        assert!(files.file("a", u64::MAX).is_err(), "endless");
        assert!(files.part(b"x").is_err(), "no file");
    }
}
