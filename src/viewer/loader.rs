//! Loads a scene on its own thread while the window shows the progress, or another scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::client::window::panel::LoadingData;
use crate::job::{Job, StopFlag};
use crate::render::load::{self, SceneInput};
use crate::render::options::SceneOptions;
use crate::render::remote_order::scene_digest;
use crate::render::run_spec::RunSpec;
use crate::render::{method, warnings};
use crate::scene::desc::IntegratorKind;
use crate::scene::{LoadProgress, Loaded, SceneDesc, SceneError};
use crate::tracer::Scene;
use crate::viewer::editor::SceneEditor;

/// Scene to load and how it is traced.
#[derive(Clone)]
pub struct ViewSource {
    pub args: SceneOptions,
    pub deterministic: bool,
    pub replicated: bool,
    /// Remote machines trace it.
    pub remote: bool,
}

/// Longest wait for the first picture of a preview.
const MOST_WAIT: Duration = Duration::from_secs(2);

/// How much of a scene has been read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadStage {
    /// All of it.
    Whole,
    /// Its large pictures are yet to be read: one texel stands for each.
    Preview,
    /// What was missing from a preview.
    Rest,
}

/// A scene ready to be traced.
pub struct ReadyScene {
    pub stage: LoadStage,
    pub run: RunSpec,
    /// The method is still to be chosen, in the background.
    pub choose: bool,
    pub editor: SceneEditor,
    /// Digest by which remote tracers identify the scene, if there are any.
    pub digest: Option<String>,
}

/// A scene being loaded. If dropped early, the thread runs to its end and its result is discarded.
pub struct SceneLoader {
    pub source: ViewSource,
    progress: Arc<LoadProgress>,
    /// All files are read; the scene is being prepared.
    preparing: Arc<AtomicBool>,
    previews: Receiver<ReadyScene>,
    /// The preview was taken.
    previewed: bool,
    /// It is on the screen.
    seen: Arc<AtomicBool>,
    job: Job<Result<ReadyScene>>,
}

/// Where a preview goes.
struct PreviewSender {
    scenes: Sender<ReadyScene>,
    seen: Arc<AtomicBool>,
}

impl PreviewSender {
    /// Waits until the preview is on the screen: reading on would take the processor from its first picture.
    fn wait_until_seen(&self) {
        let sent = Instant::now();
        while !self.seen.load(Ordering::Relaxed) && sent.elapsed() < MOST_WAIT {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl ViewSource {
    /// The same options for another scene. Overrides of names and effects are dropped: they refer to the first scene.
    pub fn with_scene(&self, scene: PathBuf) -> Self {
        let args = SceneOptions { scene, defines: Vec::new(), effects: Vec::new(), ..self.args.clone() };
        Self { args, ..self.clone() }
    }

    /// Name of the scene, for title and file names.
    pub fn name(&self) -> String {
        self.args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Reads and prepares the scene; `preview` gets it before its large pictures are read, if that takes long. Warnings go to standard error.
    fn load(
        &self,
        progress: &Arc<LoadProgress>,
        preparing: &AtomicBool,
        preview: Option<&PreviewSender>,
    ) -> Result<ReadyScene> {
        let args = &self.args;
        let mut shown: Option<Arc<Scene>> = None;
        let mut show = |desc: SceneDesc| {
            // What is wrong with it is told when all of it is read.
            let loaded = Loaded { desc, warnings: Vec::new() };
            let scene = load::prepare(Scene::prepare, &loaded.desc, args.simd);
            let ready =
                scene.and_then(|scene| self.ready(LoadStage::Preview, loaded, scene, progress.files()));
            if let (Ok(ready), Some(preview)) = (ready, preview) {
                shown = Some(ready.editor.scene());
                // Nobody may be waiting any more.
                if preview.scenes.send(ready).is_ok() {
                    preview.wait_until_seen();
                }
            }
        };
        // Pictures that depend on nothing but the scene begin with all of it.
        let loaded = match preview.is_some() && !self.deterministic && !self.remote {
            true => load::read_previewing(args, progress, &mut show)?,
            false => load::read_telling(args, progress)?,
        };
        preparing.store(true, Ordering::Relaxed);
        warnings::tell_warnings(&loaded.warnings, args);
        let (stage, scene) = match shown {
            Some(before) => {
                (LoadStage::Rest, load::prepare(|desc| before.edited(desc), &loaded.desc, args.simd)?)
            }
            None => (LoadStage::Whole, load::prepare(Scene::prepare, &loaded.desc, args.simd)?),
        };
        warnings::tell_notices(scene.notices(), args);
        self.ready(stage, loaded, scene, progress.files())
    }

    /// A prepared scene with its method and editor.
    fn ready(
        &self,
        stage: LoadStage,
        loaded: Loaded,
        scene: Scene,
        files: Vec<PathBuf>,
    ) -> Result<ReadyScene> {
        let Self { args, deterministic, replicated, remote } = self;
        let forced = load::forced(&loaded.desc, args)?;
        let input = SceneInput { loaded, forced, files };
        let mut run = RunSpec {
            deterministic: *deterministic,
            replicated: *replicated,
            ..input.run(args, String::new())
        };
        let SceneInput { loaded, forced, files } = input;
        let digest = remote.then(|| scene_digest(&files, &args.defines, args.lenient)).transpose()?;
        let mut editor = SceneEditor::new(loaded.desc, scene)?;
        forced.into_iter().try_for_each(|forced| editor.force(forced))?;
        run.photons = editor.desc().integrator.photons;
        let mut choose = false;
        if run.deterministic {
            let size = [run.film.width, run.film.height];
            method::choose(&mut run, &editor.scene(), &editor.camera(size)?, args.threads());
            method::tell_choice(&run);
        } else if run.integrator == IntegratorKind::Auto
            || run.integrator == IntegratorKind::Path && args.integrator.is_none()
        {
            // Files specify path tracing by default, so that does not count as the author's choice. It is used until the background choice
            // is made.
            run.integrator = IntegratorKind::Path;
            choose = true;
        }
        Ok(ReadyScene { stage, run, choose, editor, digest })
    }
}

impl SceneLoader {
    /// Begins to load; with `previews`, the scene may come twice ([`LoadStage::Preview`]).
    pub fn start(source: ViewSource, previews: bool) -> Result<Self> {
        let (progress, preparing) = (Arc::<LoadProgress>::default(), Arc::<AtomicBool>::default());
        let (scenes, receiver) = channel();
        let seen = Arc::<AtomicBool>::default();
        let preview = previews.then(|| PreviewSender { scenes, seen: seen.clone() });
        let work = {
            let (source, progress, preparing) = (source.clone(), progress.clone(), preparing.clone());
            move |_: &StopFlag| source.load(&progress, &preparing, preview.as_ref())
        };
        let job = Job::start("the reader of scenes", work).into_diagnostic()?;
        Ok(Self { source, progress, preparing, previews: receiver, previewed: false, seen, job })
    }

    /// Returns the preview, if there is one, and then the scene or the error, each once. After those it must not be called again.
    pub fn take(&mut self) -> Option<Result<ReadyScene>> {
        if let Ok(preview) = self.previews.try_recv() {
            self.previewed = true;
            return Some(Ok(preview));
        }
        Some(self.job.poll()?.unwrap_or_else(|panic| {
            let path = self.source.args.scene.display();
            Err(miette::miette!(
                help = "please report it with that file",
                "{path} could not be read: {panic}"
            ))
        }))
    }

    /// Whether the preview was taken, and the scene itself is still to come.
    pub fn is_previewed(&self) -> bool {
        self.previewed
    }

    /// Notes that what was taken is on the screen: what a preview lacks is read now.
    pub fn note_seen(&self) {
        self.seen.store(self.previewed, Ordering::Relaxed);
    }

    /// Size of the picture in pixels, as soon as it is known.
    pub fn film(&self) -> Option<[u32; 2]> {
        self.source.args.size.map(<[u32; 2]>::from).or(self.progress.film())
    }

    /// The files that were opened so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.progress.files()
    }

    /// Progress for the panel.
    pub fn state(&self) -> LoadingData {
        let (files, total) = (self.progress.files(), self.progress.total());
        let what = match files.last() {
            _ if self.preparing.load(Ordering::Relaxed) => "building the acceleration structure".to_owned(),
            Some(file) => format!("reading {} · {} of {total} files", short(file), files.len()),
            None => "reading".to_owned(),
        };
        LoadingData { name: self.source.name(), what, files: [files.len(), total] }
    }
}

/// The last two parts of a path.
fn short(path: &Path) -> String {
    let parts: Vec<_> = path.iter().rev().take(2).map(|part| part.to_string_lossy()).collect();
    parts.into_iter().rev().collect::<Vec<_>>().join("/")
}

/// Formats an error as one line, with its location.
pub fn brief(error: &miette::Report) -> String {
    match error.downcast_ref::<SceneError>() {
        Some(found) => {
            let (file, line, column) = found.location();
            format!("{file}:{line}:{column}: {found}")
        }
        None => error.to_string(),
    }
}
