//! Fetches the scene of a tracer, for a viewer that has no copy of it.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use std::time::{Duration, Instant};

use super::link::{LinkError, connect, greet};
use super::message::{Refusal, Side, ToTracer, ToViewer, Welcome, printable};
use super::tracers::TracerAddress;

/// Time between two pings.
const PING: Duration = Duration::from_secs(1);

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
    /// The tracer's description of it.
    pub welcome: Welcome,
}

/// How a scene is fetched.
pub struct FetchOptions<'a> {
    /// Where scenes are kept, each in a folder that is named by its digest.
    pub folder: &'a Path,
    /// The digest of these files as the program makes it: what comes is checked with it, and what is there already.
    pub digest: &'a dyn Fn(&[PathBuf], &Welcome) -> Option<String>,
    /// The user wants it no more.
    pub is_over: &'a dyn Fn() -> bool,
}

/// Fetches the files of a tracer's scene, unless they are there already.
///
/// # Errors
///
/// [`FetchError`]; what was fetched so far is removed.
pub fn fetch(tracer: &TracerAddress, options: &FetchOptions) -> Result<Fetched, FetchError> {
    let (mut reader, mut writer) = {
        let socket = connect(&tracer.address)?;
        greet(socket, Side::Viewer, tracer.token.as_ref())?
    };
    let outcome = (|| {
        let mut files = Files::new(options);
        let (mut frames, mut pinged) = (Vec::new(), Instant::now());
        loop {
            if (options.is_over)() {
                return Err(FetchError::Refused("it was interrupted".to_owned()));
            }
            // One that says nothing for long is taken for gone.
            if pinged.elapsed() > PING {
                pinged = Instant::now();
                ToTracer::Ping(0).write(&mut frames);
                writer.write(&frames)?;
                frames.clear();
            }
            let Some((kind, payload)) = reader.read(Duration::from_millis(100))? else {
                if reader.heard.elapsed() > SILENCE {
                    return Err(LinkError::Silent(SILENCE.as_secs()).into());
                }
                continue;
            };
            match ToViewer::read(kind, payload).map_err(LinkError::from)? {
                ToViewer::Welcome(welcome) => {
                    if let Some(scene) = files.begin(welcome)? {
                        return Ok(scene);
                    }
                    ToTracer::Fetch.write(&mut frames);
                    writer.write(&frames)?;
                    frames.clear();
                }
                ToViewer::File(file) => files.file(&file.path, file.length)?,
                ToViewer::FilePart(part) => files.part(part)?,
                ToViewer::FilesEnd => return files.end(),
                ToViewer::Refused(Refusal { why, .. }) => return Err(FetchError::Refused(printable(&why))),
                _ => {}
            }
        }
    })();
    writer.close();
    outcome
}

/// The files on their way.
struct Files<'a> {
    options: &'a FetchOptions<'a>,
    welcome: Welcome,
    /// Where the files are written until all of them are there.
    part: Option<tempfile::TempDir>,
    /// The file that is written, and how many bytes of it are to come.
    open: Option<(File, PathBuf, u64)>,
    /// All files in the order in which they came, relative to the folder.
    paths: Vec<PathBuf>,
    bytes: u64,
}

/// Beside the files: their names in order, a line each. The first one is the scene.
const LIST: &str = ".files";

impl<'a> Files<'a> {
    fn new(options: &'a FetchOptions) -> Self {
        Self { options, welcome: Welcome::default(), part: None, open: None, paths: Vec::new(), bytes: 0 }
    }

    /// The folder of this scene.
    fn place(&self) -> PathBuf {
        self.options.folder.join(&self.welcome.digest)
    }

    /// The scene in a folder, if these files are it.
    fn scene(&self, folder: &Path, paths: &[PathBuf]) -> Option<PathBuf> {
        let paths: Vec<PathBuf> = paths.iter().map(|path| folder.join(path)).collect();
        let digest = (self.options.digest)(&paths, &self.welcome)?;
        paths.into_iter().next().filter(|_| digest == self.welcome.digest)
    }

    /// The tracer has said what it has; returns the scene if it is there already.
    fn begin(&mut self, welcome: Welcome) -> Result<Option<Fetched>, FetchError> {
        let digest = &welcome.digest;
        if digest.is_empty() || digest.len() > 64 || !digest.chars().all(|c| c.is_ascii_alphanumeric()) {
            return Err(FetchError::Nonsense("its digest is none"));
        }
        self.welcome = welcome;
        let place = self.place();
        let list = fs::read_to_string(place.join(LIST)).unwrap_or_default();
        let there: Vec<PathBuf> = list.lines().map(PathBuf::from).collect();
        if let Some(scene) = self.scene(&place, &there) {
            return Ok(Some(Fetched { scene, welcome: self.welcome.clone() }));
        }
        let folder = self.options.folder;
        let write = |source| FetchError::Write { path: folder.to_path_buf(), source };
        fs::create_dir_all(folder).map_err(write)?;
        self.part = Some(tempfile::tempdir_in(folder).map_err(write)?);
        Ok(None)
    }

    /// A file begins.
    fn file(&mut self, path: &str, length: u64) -> Result<(), FetchError> {
        let Some(part) = &self.part else {
            return Err(FetchError::Nonsense("a file that nobody has asked for"));
        };
        let relative = Path::new(path);
        let plain = path.len() <= 1000 && !path.contains(['\\', '\n']) && relative.components().count() > 0;
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
    fn end(mut self) -> Result<Fetched, FetchError> {
        let complete = self.open.take().is_none_or(|(_, _, left)| left == 0);
        let (Some(part), true) = (self.part.take(), complete) else {
            return Err(FetchError::Nonsense("not all of its files"));
        };
        if self.scene(part.path(), &self.paths).is_none() {
            return Err(FetchError::Nonsense(
                "its files have changed since it has read them; start it again",
            ));
        }
        let place = self.place();
        let write = |source| FetchError::Write { path: place.clone(), source };
        let list: Vec<_> = self.paths.iter().map(|path| path.to_string_lossy()).collect();
        fs::write(part.path().join(LIST), list.join("\n")).map_err(write)?;
        // The folder holds another scene, or an incomplete one.
        let _ = fs::remove_dir_all(&place);
        match fs::rename(part.path(), &place) {
            Ok(()) => drop(part.keep()),
            // Another viewer may have been faster with the same files.
            Err(error) if self.scene(&place, &self.paths).is_none() => return Err(write(error)),
            Err(_) => {}
        }
        let scene = self.paths.first().map(|scene| place.join(scene));
        let scene = scene.ok_or(FetchError::Nonsense("no file"))?;
        Ok(Fetched { scene, welcome: self.welcome })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All lengths in a row: enough of a digest here.
    fn digest(paths: &[PathBuf], _: &Welcome) -> Option<String> {
        paths.iter().map(|path| Some(fs::metadata(path).ok()?.len().to_string())).collect()
    }

    fn options(folder: &Path) -> FetchOptions<'_> {
        FetchOptions { folder, digest: &digest, is_over: &|| false }
    }

    fn welcome(digest: &str) -> Welcome {
        Welcome { digest: digest.into(), ..Welcome::default() }
    }

    #[test]
    fn a_scene_comes_as_a_whole_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let options = options(folder.path());
        let fetched = |digest: &str, files: &[(&str, &[u8])]| {
            let mut fetching = Files::new(&options);
            if let Some(there) = fetching.begin(welcome(digest)).expect("a digest") {
                return Ok((there.scene, false));
            }
            for (path, bytes) in files {
                fetching.file(path, bytes.len() as u64).expect("a file");
                bytes.chunks(3).for_each(|part| fetching.part(part).expect("bytes"));
            }
            fetching.end().map(|fetched| (fetched.scene, true))
        };
        let files: [(&str, &[u8]); 2] = [("scenes/a.xml", b"<scen"), ("meshes/b.ply", b"")];
        let (scene, new) = fetched("50", &files).expect("a scene");
        assert_eq!((fs::read(&scene).expect("the scene"), new), (b"<scen".to_vec(), true));
        // It need not be fetched again, unless somebody has changed it.
        assert_eq!(fetched("50", &files).expect("a scene"), (scene.clone(), false));
        fs::write(&scene, b"other").expect("a file");
        fs::write(&scene, b"longer than that").expect("a file");
        assert_eq!(fetched("50", &files).expect("a scene"), (scene, true));
        // Other files than those of the digest are refused.
        assert!(fetched("51", &files).is_err());
        let mut short = Files::new(&options);
        assert!(short.begin(welcome("def")).expect("a digest").is_none());
        short.file("a.xml", 5).expect("a file");
        short.part(b"1234").expect("bytes");
        assert!(short.end().is_err());
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1, "nothing half-written is left");
    }

    #[test]
    fn files_stay_in_their_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let options = options(folder.path());
        for digest in ["", "..", "a/b", &"x".repeat(65)] {
            assert!(Files::new(&options).begin(welcome(digest)).is_err(), "{digest}");
        }
        let mut files = Files::new(&options);
        assert!(files.file("a.xml", 1).is_err(), "nobody has asked");
        assert!(files.begin(welcome("abc")).expect("a digest").is_none());
        for path in ["../a", "/etc/passwd", "a/../../b", "", "a\\b", ".", "./../x", "a\nb"] {
            assert!(files.file(path, 1).is_err(), "{path}");
        }
        assert!(files.file("a", u64::MAX).is_err(), "endless");
        assert!(files.part(b"x").is_err(), "no file");
    }
}
