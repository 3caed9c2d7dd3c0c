//! Loads a scene on a thread of its own, while the window shows how far it is, or another scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use miette::{IntoDiagnostic, Result};

use crate::client::window::panel::LoadingData;
use crate::job::{Job, StopFlag};
use crate::render::load::{self, SceneInput};
use crate::render::options::SceneOptions;
use crate::render::remote_order::scene_digest;
use crate::render::run_spec::RunSpec;
use crate::render::{method, warnings};
use crate::scene::desc::IntegratorKind;
use crate::scene::{LoadProgress, SceneError};
use crate::tracer::Scene;
use crate::viewer::editor::SceneEditor;

/// What is loaded and how it is traced.
#[derive(Clone)]
pub struct ViewSource {
    pub args: SceneOptions,
    pub deterministic: bool,
    pub replicated: bool,
    /// It is traced elsewhere.
    pub remote: bool,
}

/// A scene that is ready to be traced.
pub struct ReadyScene {
    pub run: RunSpec,
    /// The method is to be chosen beside the window.
    pub choose: bool,
    pub editor: SceneEditor,
    /// What tracers elsewhere know the scene by, where there are any.
    pub digest: Option<String>,
}

/// A scene that is being loaded. Dropped before its end, the thread goes on and nobody hears of it.
pub struct SceneLoader {
    pub source: ViewSource,
    progress: Arc<LoadProgress>,
    /// All files are read.
    preparing: Arc<AtomicBool>,
    job: Job<Result<ReadyScene>>,
}

impl ViewSource {
    /// The same for another scene: names and effects on the command line were those of the first.
    pub fn with_scene(&self, scene: PathBuf) -> Self {
        let args = SceneOptions { scene, defines: Vec::new(), effects: Vec::new(), ..self.args.clone() };
        Self { args, ..self.clone() }
    }

    /// Name of the scene, for title and file names.
    pub fn name(&self) -> String {
        self.args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Reads and prepares the scene. Warnings go to standard error.
    fn load(&self, progress: &Arc<LoadProgress>, preparing: &AtomicBool) -> Result<ReadyScene> {
        let Self { args, deterministic, replicated, remote } = self;
        let loaded = load::read_telling(args, progress)?;
        preparing.store(true, Ordering::Relaxed);
        warnings::tell_warnings(&loaded.warnings, args);
        let scene = load::prepare(Scene::prepare, &loaded.desc, args.simd)?;
        warnings::tell_notices(scene.notices(), args);
        let forced = load::forced(&loaded.desc, args)?;
        let input = SceneInput { loaded, forced, files: progress.files() };
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
            // Files name path tracing because it is the usual method: that is no order. Until one is chosen, beside the window, it is used.
            run.integrator = IntegratorKind::Path;
            choose = true;
        }
        Ok(ReadyScene { run, choose, editor, digest })
    }
}

impl SceneLoader {
    /// Begins to load.
    pub fn start(source: ViewSource) -> Result<Self> {
        let (progress, preparing) = (Arc::<LoadProgress>::default(), Arc::<AtomicBool>::default());
        let work = {
            let (source, progress, preparing) = (source.clone(), progress.clone(), preparing.clone());
            move |_: &StopFlag| source.load(&progress, &preparing)
        };
        let job = Job::start("the reader of scenes", work).into_diagnostic()?;
        Ok(Self { source, progress, preparing, job })
    }

    /// The scene or the error, once, when it is there.
    pub fn take(&mut self) -> Option<Result<ReadyScene>> {
        Some(self.job.poll()?.unwrap_or_else(|panic| {
            let path = self.source.args.scene.display();
            Err(miette::miette!(
                help = "please report it with that file",
                "{path} could not be read: {panic}"
            ))
        }))
    }

    /// Size of the picture, as soon as it is known.
    pub fn film(&self) -> Option<[u32; 2]> {
        self.source.args.size.map(<[u32; 2]>::from).or(self.progress.film())
    }

    /// The files that were opened so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.progress.files()
    }

    /// How far it is.
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

/// An error in one line, with its place.
pub fn brief(error: &miette::Report) -> String {
    match error.downcast_ref::<SceneError>() {
        Some(found) => {
            let (file, line, column) = found.location();
            format!("{file}:{line}:{column}: {found}")
        }
        None => error.to_string(),
    }
}
