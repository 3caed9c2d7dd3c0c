//! A scene, its changes, and a render of it on the calling thread.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{Diagnostic, Severity};
use pointillist::cmd::library::{PlannedRender, RenderMoment};
use pointillist::scene::edit::{Edits, named_values};
use pointillist::scene::{self, LoadOptions, Loaded};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::{of_render, of_scene, of_value};
use crate::picture::NativePicture;
use crate::progressive::Pictures;

/// How often Ctrl-C is looked for, and progress told.
const EVERY: Duration = Duration::from_millis(50);

/// A warning: its text, file, line, column and whether it needs no action.
type Warning = (String, String, usize, usize, bool);

/// Progress as Python sees it: share, samples per pixel, seconds, and the error with the ends of its interval.
pub type ToldMoment = (f64, f64, f64, Option<(f64, f64, f64)>);

/// A scene, as it was read and with changes.
#[pyclass(frozen, name = "Scene", module = "pointillist._native")]
pub struct NativeScene {
    name: String,
    /// The scene as it was read.
    original: Arc<Loaded>,
    edits: Edits,
    /// The scene with its changes.
    edited: Arc<Loaded>,
    /// It is a file as it is, which the command line reads the same.
    is_file: bool,
}

impl NativeScene {
    fn new(name: String, loaded: Loaded, is_file: bool) -> Self {
        let loaded = Arc::new(loaded);
        Self { name, original: loaded.clone(), edits: Edits::default(), edited: loaded, is_file }
    }

    fn plan(&self, words: &[String]) -> PyResult<PlannedRender> {
        PlannedRender::new(&self.name, self.edited.clone(), words).map_err(|error| of_value(&error))
    }
}

#[pymethods]
impl NativeScene {
    /// Reads a file.
    #[staticmethod]
    fn load_file(
        py: Python<'_>,
        path: PathBuf,
        defines: Vec<(String, String)>,
        lenient: bool,
    ) -> PyResult<Self> {
        let options = LoadOptions { defines: &defines, lenient };
        let loaded = py.detach(|| scene::load_with(&path, &options));
        let loaded = loaded.map_err(|error| of_scene(py, &error))?;
        let is_plain = defines.is_empty() && !lenient;
        Ok(Self::new(path.display().to_string(), loaded, is_plain))
    }

    /// Reads a text that stands for a file called `name`, and files in memory beside it.
    #[staticmethod]
    fn load_text(
        py: Python<'_>,
        name: String,
        text: &str,
        files: Vec<(String, Vec<u8>)>,
        defines: Vec<(String, String)>,
        lenient: bool,
    ) -> PyResult<Self> {
        let options = LoadOptions { defines: &defines, lenient };
        let folder = Path::new(&name).parent().unwrap_or(Path::new(""));
        let files: BTreeMap<_, _> =
            files.into_iter().map(|(file, bytes)| (folder.join(file), bytes)).collect();
        let loaded = py.detach(|| scene::load_str_with_files(&name, text, files, &options));
        let loaded = loaded.map_err(|error| of_scene(py, &error))?;
        Ok(Self::new(name, loaded, false))
    }

    /// The file, or what stands for it.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Size of the picture in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        let film = &self.edited.desc.film;
        film.crop.map_or((film.width, film.height), |crop| (crop.width, crop.height))
    }

    /// Warnings and remarks of reading it.
    #[getter]
    fn warnings(&self) -> Vec<Warning> {
        let told = |warning: &scene::SceneWarning| {
            let (file, line, column) = warning.location();
            let idle = warning.severity() == Some(Severity::Advice);
            (warning.to_string(), file.to_owned(), line, column, idle)
        };
        self.original.warnings.iter().map(told).collect()
    }

    /// Values that can be changed, with their names.
    fn parameters(&self) -> Vec<(String, Vec<f64>)> {
        named_values(&self.edited.desc).into_iter().map(|value| (value.name, value.numbers)).collect()
    }

    /// The scene with further changes.
    fn edit(&self, changes: Vec<(String, Vec<f64>)>) -> PyResult<Self> {
        let mut edits = self.edits.clone();
        for (name, numbers) in &changes {
            let set = edits.set_named(&self.original.desc, name, numbers);
            set.map_err(|error| PyValueError::new_err(error.to_string()))?;
        }
        let desc = edits.apply(&self.original.desc);
        let desc = desc.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let edited = Arc::new(Loaded { desc, warnings: Vec::new() });
        let is_file = self.is_file && edits.is_empty();
        Ok(Self { name: self.name.clone(), original: self.original.clone(), edits, edited, is_file })
    }

    /// Renders; `watch` is told of the progress. An exception of it, and Ctrl-C, end the render and are raised.
    fn render(
        &self,
        py: Python<'_>,
        words: Vec<String>,
        watch: Option<Py<PyAny>>,
    ) -> PyResult<NativePicture> {
        let plan = self.plan(&words)?;
        let mut raised = None;
        let mut next = Instant::now();
        let mut look = |moment: RenderMoment<'_>| {
            if raised.is_some() {
                return ControlFlow::Break(());
            }
            // The last look tells that all is done.
            if Instant::now() < next && moment.share < 1.0 {
                return ControlFlow::Continue(());
            }
            next = Instant::now() + EVERY;
            let told = tell(&moment);
            let outcome = Python::attach(|py| {
                py.check_signals()?;
                watch.as_ref().map_or(Ok(()), |watch| watch.call1(py, told).map(drop))
            });
            match outcome {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    raised = Some(error);
                    ControlFlow::Break(())
                }
            }
        };
        let rendered = py.detach(|| plan.render(&mut look));
        if let Some(error) = raised {
            return Err(error);
        }
        let picture = NativePicture::from(rendered.map_err(|error| of_render(&error))?);
        Ok(if self.is_file { picture } else { picture.without_command() })
    }

    /// Starts a render, and returns its pictures: one every so many seconds, and the last one.
    fn progressive(&self, words: Vec<String>, every: f64) -> PyResult<Pictures> {
        let every = Duration::try_from_secs_f64(every);
        let every = every.map_err(|_| PyValueError::new_err("`every` is a number of seconds from 0 on"))?;
        Ok(Pictures::start(self.plan(&words)?, every, self.is_file)?)
    }
}

/// A moment as a tuple.
pub fn tell(moment: &RenderMoment<'_>) -> ToldMoment {
    let error = moment.error.map(|error| (error.value, error.low, error.high));
    (moment.share, moment.samples_per_pixel, moment.elapsed.as_secs_f64(), error)
}
