//! A render on a thread of its own, whose pictures are taken on the way.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use miette::Report;
use pointillist::cmd::library::{PlannedRender, RenderMoment, RenderedPicture};
use pyo3::prelude::*;

use crate::errors::of_render;
use crate::picture::NativePicture;
use crate::scene::{ToldMoment, tell};

/// How long Ctrl-C may wait.
const PATIENCE: Duration = Duration::from_millis(50);

/// Reading the film may take at most one part in this many of the time.
const SHARE: u32 = 20;

/// The pictures of a render: the newest one that was not taken yet, and at the end the last one.
#[pyclass(frozen, name = "Pictures", module = "pointillist._native")]
pub struct Pictures {
    shared: Arc<PictureInbox>,
    /// The scene is a file as it is.
    is_file: bool,
}

/// What the render and the caller share.
#[derive(Default)]
struct PictureInbox {
    state: Mutex<InboxState>,
    news: Condvar,
    stop: AtomicBool,
}

#[derive(Default)]
struct InboxState {
    /// The newest picture on the way, and how far the render was.
    newest: Option<(NativePicture, ToldMoment)>,
    /// How the render ended; taken once.
    end: Option<Result<RenderedPicture, Report>>,
    is_over: bool,
}

impl Pictures {
    /// Starts the thread; a picture is taken every so often. `is_file`: the scene is a file as it is.
    pub fn start(plan: PlannedRender, every: Duration, is_file: bool) -> std::io::Result<Self> {
        let shared = Arc::new(PictureInbox::default());
        let inbox = shared.clone();
        std::thread::Builder::new().name("pointillist render".to_owned()).spawn(move || {
            let rendered = catch_unwind(AssertUnwindSafe(|| inbox.render(&plan, every)));
            let rendered =
                rendered.unwrap_or_else(|_| Err(miette::miette!("the render panicked; please report it")));
            let mut state = inbox.lock();
            (state.end, state.is_over) = (Some(rendered), true);
            drop(state);
            inbox.news.notify_all();
        })?;
        Ok(Self { shared, is_file })
    }
}

impl PictureInbox {
    /// State is valid at every moment, so that a panic elsewhere does not matter.
    fn lock(&self) -> MutexGuard<'_, InboxState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn render(&self, plan: &PlannedRender, every: Duration) -> Result<RenderedPicture, Report> {
        let (mut next, mut failed) = (Instant::now() + every, None);
        let rendered = plan.render(&mut |mut moment: RenderMoment<'_>| {
            if self.stop.load(Ordering::Relaxed) {
                return ControlFlow::Break(());
            }
            let start = Instant::now();
            if start < next || moment.samples_per_pixel == 0.0 {
                return ControlFlow::Continue(());
            }
            let told = tell(&moment);
            match moment.picture() {
                Ok(layers) => {
                    next = Instant::now() + every.max(SHARE * start.elapsed());
                    self.lock().newest = Some((layers.into(), told));
                    self.news.notify_all();
                    ControlFlow::Continue(())
                }
                Err(error) => {
                    failed = Some(error);
                    ControlFlow::Break(())
                }
            }
        });
        failed.map_or(rendered, Err)
    }
}

#[pymethods]
impl Pictures {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    /// Waits for the next picture; `None` as its moment for the last one.
    fn __next__(&self, py: Python<'_>) -> PyResult<Option<(NativePicture, Option<ToldMoment>)>> {
        loop {
            let taken = py.detach(|| {
                let state = self.shared.lock();
                let waits = |state: &mut InboxState| state.newest.is_none() && !state.is_over;
                let waited = self.shared.news.wait_timeout_while(state, PATIENCE, waits);
                let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
                match (state.is_over, state.newest.take()) {
                    (true, _) => Some(state.end.take().map(Err)),
                    (false, Some(newest)) => Some(Some(Ok(newest))),
                    (false, None) => None,
                }
            });
            let told =
                |picture: NativePicture| if self.is_file { picture } else { picture.without_command() };
            match taken {
                Some(Some(Ok((picture, moment)))) => return Ok(Some((told(picture), Some(moment)))),
                Some(Some(Err(end))) => {
                    let last = end.map_err(|error| of_render(&error))?;
                    return Ok(Some((told(last.into()), None)));
                }
                Some(None) => return Ok(None),
                None => py.check_signals().inspect_err(|_| self.close())?,
            }
        }
    }

    /// Ends the render soon; what it has so far is its last picture.
    fn close(&self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        self.close();
    }
}
