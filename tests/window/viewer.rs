//! The real program with a window on a display of its own, in a folder of its own.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::support::desktop::Desktop;

/// How long a machine may take for what must happen.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// The program, with the validation layer and without Wayland.
pub fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.env_remove("WAYLAND_DISPLAY").env("POINTILLIST_VALIDATION", "1");
    command
}

pub fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml")
}

/// A folder of this test alone.
pub fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("pointillist-view-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Opens the window.
pub fn view(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    view_of(&scene(), desktop, folder, options)
}

/// Opens the window with this scene.
pub fn view_of(scene: &Path, desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    spawn(viewer(desktop, folder).arg(scene).args(options))
}

/// Opens the window on a device that is treated as a GPU although it is the processor: it makes the sums, beside the loop.
pub fn view_as_gpu(desktop: &Desktop, folder: &Path, options: &[&str]) -> Child {
    spawn(viewer(desktop, folder).env("POINTILLIST_AS_GPU", "1").arg(scene()).args(options))
}

/// The command that opens a window of this display, without the scene.
pub fn viewer(desktop: &Desktop, folder: &Path) -> Command {
    let mut command = program();
    command.current_dir(folder).env("DISPLAY", &desktop.display).env("POINTILLIST_LOG", "info").arg("view");
    command
}

/// Starts the viewer, of which standard error is heard.
pub fn spawn(command: &mut Command) -> Child {
    command.stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits for the end, which must come.
pub fn end(mut viewer: Child) -> Output {
    let start = Instant::now();
    while viewer.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            let _ = viewer.kill();
            panic!("the viewer did not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    viewer.wait_with_output().unwrap()
}

/// Ends the viewer as a session manager does.
pub fn terminate(viewer: Child) -> Output {
    assert!(Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status().unwrap().success());
    end(viewer)
}

/// Ends the viewer once it has said all of these on standard error, however long that takes a busy machine.
pub fn end_when(viewer: Child, said: &[&str]) -> Output {
    let mut viewer = Listened::new(viewer);
    said.iter().for_each(|one| viewer.wait_for(one));
    viewer.terminate()
}

/// A viewer, and what it has said on standard error.
pub struct Listened {
    viewer: Child,
    heard: Arc<Mutex<Vec<u8>>>,
    listener: JoinHandle<()>,
}

impl Listened {
    pub fn new(mut viewer: Child) -> Self {
        let mut stderr = viewer.stderr.take().unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let listener = std::thread::spawn({
            let heard = heard.clone();
            move || {
                let mut bytes = [0; 1024];
                while let Ok(n @ 1..) = stderr.read(&mut bytes) {
                    heard.lock().unwrap().extend_from_slice(&bytes[..n]);
                }
            }
        });
        Self { viewer, heard, listener }
    }

    fn words(&self) -> String {
        String::from_utf8_lossy(&self.heard.lock().unwrap()).into_owned()
    }

    /// How often it has said this so far.
    pub fn times(&self, said: &str) -> usize {
        self.words().matches(said).count()
    }

    /// Waits until it has said this, or has ended, however long that takes a busy machine.
    pub fn wait_for(&mut self, said: &str) {
        self.wait_for_times(said, 1);
    }

    /// Waits until it has said this so often, or has ended.
    pub fn wait_for_times(&mut self, said: &str, times: usize) {
        let start = Instant::now();
        while self.times(said) < times && self.viewer.try_wait().unwrap().is_none() {
            if start.elapsed() > PATIENCE {
                let _ = self.viewer.kill();
                panic!("the viewer has not said {said:?}: {}", self.words());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Ends it, if it has not.
    pub fn terminate(mut self) -> Output {
        let ended = self.viewer.try_wait().unwrap().is_some();
        let output = if ended { end(self.viewer) } else { terminate(self.viewer) };
        self.listener.join().unwrap();
        let stderr = self.heard.lock().unwrap().clone();
        Output { stderr, ..output }
    }
}

/// What it wrote on standard error.
pub fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What `--json figures.json` left.
pub fn figures(folder: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("figures.json")).unwrap()).unwrap()
}

/// Width, height and R, G, B of a PNG.
pub fn png(path: &Path) -> (u32, u32, Vec<u8>) {
    let file = std::fs::File::open(path).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width, info.height, bytes)
}
