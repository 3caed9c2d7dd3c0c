//! Pipeline cache of a device, stored between runs in the program's state directory.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`], with the version of the format |
//! | 32 | BLAKE3 of the rest |
//! | … | the name of the device and its driver, [`Gpu::pipeline_origin`], and the end of a line |
//! | … | what [`Gpu::take_pipelines`] has given |
//!
//! The cache is optional: if it cannot be read or written, one line is logged and pipelines are compiled anew.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::gpu::Gpu;
use crate::image::write::atomically;
use crate::job::Job;
use crate::render::predictions;

/// Magic number of the file.
const MAGIC: [u8; 8] = *b"\x8bPNTLPC1";

/// Longest file that is read, bytes.
const LONGEST: u64 = 256 << 20;

/// Bytes of the hash.
const HASH: usize = 32;

/// In a window, the cache is written once no pipeline was compiled for this long.
const QUIET: Duration = Duration::from_secs(5);

/// Devices whose caches are written at program exit, after their owners may have dropped them.
static KEPT: Mutex<Vec<Arc<Gpu>>> = Mutex::new(Vec::new());

/// Loads the cache of this device; [`save_kept`] writes it at exit.
pub fn keep(gpu: &Arc<Gpu>) {
    load(gpu);
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).push(gpu.clone());
}

/// Writes the caches of the registered devices and releases them.
pub fn save_kept() {
    let kept = std::mem::take(&mut *KEPT.lock().unwrap_or_else(PoisonError::into_inner));
    kept.iter().for_each(|gpu| save(gpu));
}

/// Loads the cache of this device.
fn load(gpu: &Gpu) {
    let Some(path) = file(gpu) else { return };
    let loaded = match read(&path) {
        Ok(None) => return,
        Ok(Some(bytes)) => parse(&bytes, &gpu.pipeline_origin())
            .and_then(|data| gpu.load_pipelines(data).map_err(|error| error.to_string())),
        Err(error) => Err(error.to_string()),
    };
    if let Err(error) = loaded {
        tracing::warn!("{} is ignored, and pipelines are compiled anew: {error}", path.display());
    }
}

/// Writes the cache of this device if pipelines were compiled since it was loaded or written.
fn save(gpu: &Gpu) {
    let Some(path) = file(gpu) else { return };
    let written = match gpu.take_pipelines() {
        Ok(None) => return,
        Ok(Some(data)) => write(&path, &gpu.pipeline_origin(), &data),
        Err(error) => Err(error.to_string()),
    };
    if let Err(error) = written {
        tracing::info!("compiled pipelines are not kept: {error}");
    }
}

/// Path of this device's cache; `None` without a state directory.
fn file(gpu: &Gpu) -> Option<PathBuf> {
    Some(predictions::folder()?.join("pipelines").join(gpu.pipeline_origin()))
}

/// Contents of the file; `None` if it does not exist.
fn read(path: &Path) -> std::io::Result<Option<Vec<u8>>> {
    let file = match File::open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        file => file?,
    };
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes)?;
    Ok(Some(bytes))
}

/// Extracts the pipelines from the file's contents, if they belong to `origin`.
fn parse<'a>(bytes: &'a [u8], origin: &str) -> Result<&'a [u8], String> {
    let rest = bytes.strip_prefix(&MAGIC).ok_or("it is no file of compiled pipelines")?;
    let (hash, body) = rest.split_at_checked(HASH).ok_or("it ends too early")?;
    if blake3::hash(body).as_bytes() != hash {
        return Err("it is damaged".into());
    }
    let of_origin = body.strip_prefix(origin.as_bytes()).and_then(|rest| rest.strip_prefix(b"\n"));
    of_origin.ok_or_else(|| "it is of another device or driver".into())
}

fn write(path: &Path, origin: &str, data: &[u8]) -> Result<(), String> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let body = [origin.as_bytes(), b"\n", data].concat();
    let bytes = [&MAGIC[..], blake3::hash(&body).as_bytes(), &body].concat();
    atomically(path, &bytes).map_err(|error| error.to_string())
}

/// Writes the cache of a device whenever new pipelines have been compiled, and when dropped.
pub struct PipelineKeeper {
    gpu: Arc<Gpu>,
    /// Last known number of compiled pipelines, and since when.
    seen: (usize, Instant),
    saved: usize,
    saving: Option<Job<()>>,
}

impl PipelineKeeper {
    /// Loads the cache of this device and keeps it up to date.
    pub fn new(gpu: Arc<Gpu>) -> Self {
        load(&gpu);
        Self { gpu, seen: (0, Instant::now()), saved: 0, saving: None }
    }

    /// Begins to write new pipelines once none was compiled for some seconds. Never blocks.
    pub fn tick(&mut self) {
        let (compiled, now) = (self.gpu.compiled_pipelines(), Instant::now());
        if compiled != self.seen.0 {
            self.seen = (compiled, now);
        }
        let quiet = now - self.seen.1 >= QUIET;
        if compiled == self.saved || !quiet || self.saving.as_ref().is_some_and(|task| !task.is_finished()) {
            return;
        }
        self.saved = compiled;
        let gpu = self.gpu.clone();
        self.saving = Job::start("writing compiled pipelines", move |_| save(&gpu)).ok();
    }
}

impl Drop for PipelineKeeper {
    fn drop(&mut self) {
        // A panic has already been reported.
        let _ = self.saving.take().map(Job::wait);
        save(&self.gpu);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file yields what was written, and nothing if any byte differs.
    #[test]
    fn files_are_checked() {
        let folder = tempfile::tempdir().expect("a folder");
        let deeper = folder.path().join("deeper");
        let path = deeper.join("one");
        assert_eq!(read(&path).expect("no file"), None);
        write(&path, "device", b"code").expect("write");
        let bytes = read(&path).expect("read").expect("a file");
        assert_eq!(parse(&bytes, "device"), Ok(&b"code"[..]));
        assert!(parse(&bytes, "devic").is_err() && parse(&bytes, "other device").is_err());
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert!(parse(&damaged, "device").is_err(), "byte {at}");
            assert!(parse(&bytes[..at], "device").is_err(), "{at} bytes");
        }
        assert_eq!(std::fs::read_dir(&deeper).expect("a folder").count(), 1);
        assert!(write(&path.join("in a file"), "device", b"code").is_err());
    }
}
