//! Loads a scene on its own thread while the window shows the progress, or another scene.

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

/// Scene to load and how it is traced.
#[derive(Clone)]
pub struct ViewSource {
    pub args: SceneOptions,
    pub deterministic: bool,
    pub replicated: bool,
    /// Remote machines trace it.
    pub remote: bool,
}

/// A scene ready to be traced.
pub struct ReadyScene {
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
    job: Job<Result<ReadyScene>>,
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
            // Files specify path tracing by default, so that does not count as the author's choice. It is used until the background choice
            // is made.
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

    /// Returns the scene or the error, once, when loading has ended.
    pub fn take(&mut self) -> Option<Result<ReadyScene>> {
        Some(self.job.poll()?.unwrap_or_else(|panic| {
            let path = self.source.args.scene.display();
            Err(miette::miette!(
                help = "please report it with that file",
                "{path} could not be read: {panic}"
            ))
        }))
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
