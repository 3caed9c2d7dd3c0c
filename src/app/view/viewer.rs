//! Everything the window's loop works on.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::app::method::{self, Chooser};
use crate::app::observer::Observer;
use crate::app::outputs::Outputs;
use crate::app::run_spec::RunSpec;
use crate::app::timings::TimingCapture;
use crate::app::view::costs::Costs;
use crate::app::view::figures::Figures;
use crate::app::view::saving::Saving;
use crate::app::view::screen::{Losses, Screen};
use crate::app::view::session::Session;
use crate::app::view::ui::Ui;
use crate::app::view::user::User;
use crate::app::view::watching::Maps;
use crate::client::kept::Kept;
use crate::client::pacing::Pacer;
use crate::client::window::input::Input;
use crate::client::window::panel::{Action, Controls, Effect};
use crate::client::{FilmCounts, FilmSpec, Settings, SplatFilter};
use crate::gpu::DeviceChoice;
use crate::scene::desc::IntegratorKind;
use crate::scene::edit::Edits;
use crate::stream::UvWindow;

/// What the command line decides once.
pub struct Plan {
    /// What makes the picture.
    pub run: RunSpec,
    /// Files to be written at the end.
    pub outputs: Outputs,
    /// Figures at the end.
    pub json: Option<PathBuf>,
    /// The device.
    pub choice: DeviceChoice,
    /// Who computes where, in words; known once the device is.
    pub cores: String,
    /// Where times of every pass go.
    pub timings: Option<PathBuf>,
    /// What is to be lost on purpose.
    pub losses: Losses,
    /// Frame length asked for; otherwise the display's.
    pub budget: Option<Duration>,
    /// Name of the scene, for title and file names.
    pub name: String,
}

/// When things happened and are due.
pub struct Clock {
    /// The next frame.
    pub due: Instant,
    /// The last edit or gesture.
    pub edited: Instant,
    /// The last repaint, how many samples it showed, and at which `detail`.
    pub repainted: (Instant, u64, u32),
    /// The loop was through with the last frame.
    pub ended: Instant,
    /// The last tick of flying.
    pub tick: Instant,
}

/// What must be done before the next picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pending {
    /// The scene or camera changed: a new epoch must begin.
    pub restart: bool,
    /// The present epoch has not been shown yet.
    pub unseen: bool,
    /// The picture must be painted anew from the same samples.
    pub repaint: bool,
    /// The window must be drawn, even with the same picture.
    pub show: bool,
    /// Nobody can see the window, as far as is known: nothing is drawn until it is resized or shown.
    pub hidden: bool,
    /// The render goes on; when it has ended, all of its samples must be shown once.
    pub end: bool,
}

/// The viewer: owned by the event loop.
pub struct Viewer {
    /// Decided once.
    pub plan: Plan,
    /// The server's side.
    pub session: Session,
    /// Samples for films to come.
    pub kept: Kept,
    /// Camera and edits.
    pub user: User,
    /// Watches the error, where the render is divided into replicates.
    pub observer: Option<Observer>,
    /// Maps over the picture.
    pub maps: Maps,
    /// What the effects cost, if somebody wants to know.
    pub costs: Costs,
    /// Chooses the method, where that is asked for.
    pub chooser: Chooser,
    /// Mouse and keys.
    pub input: Input,
    /// Display controls.
    pub controls: Controls,
    /// Shares out the frame.
    pub pacer: Pacer,
    /// Present when the window is open.
    pub screen: Option<Screen>,
    /// Present when the window is open.
    pub ui: Option<Ui>,
    /// What is measured.
    pub figures: Figures,
    /// Writes times of passes and workers, if asked for.
    pub capture: Option<TimingCapture>,
    /// Times.
    pub clock: Clock,
    /// To do.
    pub pending: Pending,
    /// Size of the picture, physical pixels.
    pub size: [u32; 2],
    /// Asked for, to be done before the next frame.
    pub actions: Vec<Action>,
    /// Files that are being written.
    pub saving: Saving,
    /// Camera and edits that were saved last, and where.
    pub saved_scene: Option<(Edits, PathBuf)>,
    /// The plan as the panel lists it, and the method and settings that it holds for; nothing after an edit.
    pub listed: Option<((IntegratorKind, Settings), Vec<Effect>)>,
    /// Display controls have changed since the last frame.
    pub settings_changed: bool,
    /// The window is to close.
    pub quit: bool,
    /// Why it ended, if not because the user wanted it.
    pub outcome: Result<()>,
}

impl Viewer {
    /// A viewer whose window is not open yet.
    pub fn new((plan, chooser): (Plan, Chooser), session: Session, user: User, controls: Controls) -> Self {
        let now = Instant::now();
        let spec = plan.run.film;
        let size = [spec.width, spec.height];
        Self {
            pacer: Pacer::new(plan.budget.unwrap_or(DEFAULT_BUDGET)),
            plan,
            session,
            kept: Kept::default(),
            user,
            observer: None,
            maps: Maps::default(),
            costs: Costs::default(),
            chooser,
            input: Input::new(size),
            controls,
            screen: None,
            ui: None,
            figures: Figures::default(),
            capture: None,
            clock: Clock { due: now, edited: now, repainted: (now, 0, 1), ended: now, tick: now },
            pending: Pending {
                restart: true,
                repaint: true,
                show: true,
                unseen: false,
                hidden: false,
                end: true,
            },
            size,
            actions: Vec::new(),
            saving: Saving::default(),
            saved_scene: None,
            listed: None,
            settings_changed: false,
            quit: false,
            outcome: Ok(()),
        }
    }

    /// The film that the window needs now.
    pub fn spec(&self) -> FilmSpec {
        let [width, height] = self.size;
        FilmSpec { width, height, filter: self.controls.filter, ..self.plan.run.film }
    }

    /// Where samples must lie for a film of this size. Samples in index order are those of a headless render, exactly;
    /// otherwise they suffice for every splat filter, so that changing it asks for no new ones.
    pub fn uv_window(&self) -> UvWindow {
        let spec = self.spec();
        if self.plan.run.deterministic { spec.window() } else { widest(spec).window() }
    }

    /// Begins the next epoch with the present scene, camera and size. The old picture stays until the new one is there.
    ///
    /// # Errors
    ///
    /// When the camera cannot be used or the server has ended.
    pub fn restart(&mut self) -> Result<()> {
        let camera = self.user.camera(self.size)?;
        self.session.render(&self.plan.run, (self.user.scene(), camera), self.uv_window())?;
        self.kept.clear();
        self.watch(true);
        if let Some(film) = self.screen.as_mut().and_then(Screen::film) {
            film.clear().into_diagnostic()?;
        }
        self.pending.restart = false;
        (self.pending.unseen, self.pending.end) = (true, true);
        self.figures.statistics.epoch();
        self.figures.epochs += 1;
        Ok(())
    }

    /// Chooses the method anew where that is asked for and what is shown has changed and come to rest; takes over what was
    /// chosen. Until then the method stays what it is, so that nothing waits for the choice.
    ///
    /// # Errors
    ///
    /// When the camera cannot be used.
    pub fn choose(&mut self) -> Result<()> {
        if let Some(chosen) = self.chooser.take() {
            let run = &mut self.plan.run;
            self.pending.restart |= run.integrator != chosen.kind;
            run.integrator = chosen.kind;
            run.auto = Some(chosen);
            method::tell_choice(run);
            self.refresh();
        }
        let first = self.plan.run.auto.is_none();
        if self.chooser.wanted && self.chooser.stale && (first || self.clock.edited.elapsed() > REST) {
            let camera = self.user.camera(self.size)?;
            self.chooser.begin(&self.plan.run, &self.user.scene(), &camera);
        }
        Ok(())
    }

    /// Notes an edit of scene or camera.
    pub fn edited(&mut self) {
        let now = Instant::now();
        self.clock.edited = now;
        self.figures.statistics.edit(now);
        self.pending.restart = true;
        self.chooser.stale = true;
        self.listed = None;
        self.costs.edited();
    }

    /// What the film has received.
    pub fn counts(&mut self) -> FilmCounts {
        self.screen.as_mut().and_then(Screen::film).map(|film| film.counts()).unwrap_or_default()
    }
}

/// Another method is thought about when nothing has been edited for this long.
const REST: Duration = Duration::from_millis(500);

/// Where neither the command line nor the display says.
pub const DEFAULT_BUDGET: Duration = Duration::from_micros(16_667);

/// The spec with the filter that reaches farthest.
fn widest(spec: FilmSpec) -> FilmSpec {
    FilmSpec { filter: SplatFilter::Gaussian, ..spec }
}
