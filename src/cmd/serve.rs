//! `pointillist serve`: a tracer without a window, for viewers on this machine or on others.

use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use crate::client::FilmSpec;
use crate::cmd::args::ServeArgs;
use crate::remote::{Host, Request, Service, Tracing, Welcome, listen};
use crate::render::edited_scene::EditedScene;
use crate::render::load::{self, SceneInput};
use crate::render::method::{self, Photons, RenderOrder};
use crate::render::options::SceneOptions;
use crate::render::process::tell;
use crate::render::remote_order::{RemoteOrder, read_token, scene_digest};
use crate::render::run_spec::RunSpec;
use crate::render::{process, warnings};
use crate::scene::LoadProgress;
use crate::server::{Priority, Server};
use crate::stream::{Epoch, Event, Lanes};
use crate::tracer::Scene;

/// Runs the subcommand until Ctrl-C.
pub fn serve(args: &ServeArgs) -> Result<()> {
    let token = args.token_file.as_deref().map(read_token).transpose()?;
    let listener = listen(&args.listen, token.as_ref()).into_diagnostic()?;
    process::listen_for_interrupt();
    let source = args.source();
    let scene = ServedScene::load(&source)?;
    let host = ServedHost { threads: source.threads(), source, scene: Mutex::new(scene) };
    let (name, threads) = (args.scene.display().to_string(), host.threads);
    let address = listener.local_addr().into_diagnostic()?;
    let _service = Service::start(listener, token, Arc::new(host), |line| tell(&line)).into_diagnostic()?;
    tell(&format!(
        "{name} on {address}, {threads} threads; `pointillist view --connect {address}` shows it, Ctrl-C ends it"
    ));
    while !process::is_interrupted() {
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

/// The scene as loaded.
struct ServedScene {
    edited: EditedScene,
    run: RunSpec,
    files: Vec<PathBuf>,
    digest: String,
}

impl ServedScene {
    fn load(source: &SceneOptions) -> Result<Self> {
        let progress = Arc::<LoadProgress>::default();
        let loaded = load::read_telling(source, &progress)?;
        warnings::tell_warnings(&loaded.warnings, source);
        let scene = load::prepare(Scene::prepare, &loaded.desc, source.simd)?;
        warnings::tell_notices(scene.notices(), source);
        let files = progress.files();
        let digest = scene_digest(&files, &source.defines, source.lenient)?;
        let input = SceneInput { loaded, forced: Vec::new(), files: files.clone() };
        let run = input.run(source, String::new());
        Ok(Self { edited: EditedScene::new(input.loaded.desc, scene), run, files, digest })
    }
}

/// State shared by all connections.
struct ServedHost {
    source: SceneOptions,
    threads: usize,
    scene: Mutex<ServedScene>,
}

/// Locks a mutex, ignoring poisoning: a panic leaves nothing half-changed here.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Host for ServedHost {
    fn welcome(&self) -> Welcome {
        Welcome {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            digest: locked(&self.scene).digest.clone(),
            defines: self.source.defines.clone(),
            lenient: self.source.lenient,
            threads: self.threads,
        }
    }

    fn open(self: Arc<Self>) -> Result<(Box<dyn Tracing>, Lanes), String> {
        let (server, lanes) =
            Server::start_with(self.threads, Priority::Background).map_err(|error| error.to_string())?;
        Ok((Box::new(ServedTracer { host: self, server, present: Mutex::default() }), lanes))
    }

    /// Paths relative to the common directory of all files, under the names that the scene uses for them.
    fn files(&self) -> Vec<(String, PathBuf)> {
        let mut all: Vec<PathBuf> = Vec::new();
        for path in locked(&self.scene).files.iter().map(|path| plain(path)) {
            if !all.contains(&path) {
                all.push(path);
            }
        }
        let Some(mut folder) = all.first().and_then(|scene| scene.parent()) else { return Vec::new() };
        while !all.iter().all(|path| path.starts_with(folder)) {
            let Some(parent) = folder.parent() else { break };
            folder = parent;
        }
        let place = |path: &PathBuf| {
            let inside = path.strip_prefix(folder).unwrap_or(path);
            let parts: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
            (parts.join("/"), path.clone())
        };
        all.iter().map(place).collect()
    }
}

/// An absolute path without `.` and `..`; symbolic links are not resolved.
fn plain(path: &Path) -> PathBuf {
    let from_root = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut plain = PathBuf::new();
    for part in from_root.components() {
        match part {
            Component::ParentDir => _ = plain.pop(),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// Tracer of one viewer.
struct ServedTracer {
    host: Arc<ServedHost>,
    server: Server,
    present: Mutex<Option<PresentScene>>,
}

/// The scene with the changes of a viewer.
struct PresentScene {
    digest: String,
    film: Option<(u32, u32)>,
    edited: EditedScene,
    run: RunSpec,
    photons: Option<Photons>,
}

impl ServedTracer {
    /// The scene of an order. If its digest differs from the loaded scene's, the files are loaded again, since they may have changed here
    /// as they have on the viewer's machine.
    fn scene_of(&self, order: &RemoteOrder) -> Result<PresentScene, String> {
        let host = &self.host;
        let mut scene = locked(&host.scene);
        if scene.digest != order.scene {
            let words = |error: miette::Report| format!("the scene cannot be read again: {error}");
            let now = scene_digest(&scene.files, &host.source.defines, host.source.lenient).map_err(words)?;
            if now != scene.digest {
                *scene = ServedScene::load(&host.source).map_err(words)?;
            }
        }
        if scene.digest != order.scene {
            return Err(format!(
                "it serves another scene than this one, or another version of it: {}",
                host.source.scene.display()
            ));
        }
        let mut present = PresentScene {
            digest: scene.digest.clone(),
            film: order.film,
            edited: scene.edited.clone(),
            run: scene.run.clone(),
            photons: None,
        };
        if let Some((width, height)) = order.film {
            present.edited.set_film(width, height);
        }
        Ok(present)
    }

    fn trace(&self, request: &Request, order: RemoteOrder) -> Result<(), String> {
        let words = |error: miette::Report| error.to_string();
        let mut present = locked(&self.present);
        let same = |now: &PresentScene| now.digest == order.scene && now.film == order.film;
        let mut scene = match present.take().filter(same) {
            Some(scene) => scene,
            None => self.scene_of(&order)?,
        };
        let RemoteOrder { edits, forced, size, window, .. } = order;
        let without_pose = scene.edited.without_pose(edits.clone());
        if *scene.edited.edits() != without_pose || scene.edited.forced() != forced {
            scene.edited.change(without_pose, forced.clone()).map_err(words)?;
        }
        let camera = edits.camera.unwrap_or_else(|| scene.edited.original().camera.clone());
        let camera = scene.edited.camera(camera, size).map_err(words)?;
        let run = RunSpec {
            integrator: order.integrator,
            max_depth: order.max_depth,
            rr_depth: order.rr_depth,
            hide_emitters: order.hide_emitters,
            replicated: order.replicated,
            seed: request.seed,
            effects: forced,
            photons: scene.edited.desc().integrator.photons,
            film: FilmSpec { width: size[0], height: size[1], ..scene.run.film },
            ..scene.run.clone()
        };
        let order = RenderOrder {
            scene: scene.edited.scene(),
            camera,
            range: 0..request.paths.unwrap_or(u64::MAX),
            window,
            epoch: Epoch(request.epoch),
            sampling: Default::default(),
            check: None,
            right_eye: None,
        };
        method::start(&self.server, &run, order, &mut scene.photons).map_err(words)?;
        *present = Some(scene);
        Ok(())
    }
}

impl Tracing for ServedTracer {
    fn render(&self, request: &Request) -> Result<(), String> {
        self.trace(request, RemoteOrder::read(&request.order)?)
    }

    fn abort(&self) {
        self.server.abort();
    }

    fn event(&self) -> Option<Event> {
        self.server.event()
    }
}
