//! `pointillist view`: the window, responsive whatever the tracer is doing (paper §4.2, Figure 1).
//!
//! One thread runs the loop; the server's workers trace beside it and are never waited for. [`Viewer::frame`](frame) is the
//! paper's list:
//!
//! ```text
//!            ┌──────────────────────────────── frame ───────────────────────────────┐
//!  winit ──▶ messages ──▶ read samples ──▶ rasterise them ──▶ repaint ──▶ panel ──▶ swap
//!            user, server  lanes, kept        film             film      overlay  swapchain
//!                 │ edit: next epoch
//!                 ▼
//!  server ── workers ──▶ lanes
//! ```
//!
//! The event loop owns the [`Viewer`]. Each of its parts has one owner, which alone changes it:
//!
//! ```text
//! Viewer
//! ├─ RenderSession   session   lanes, epoch; what is rendered and by which method
//! │  └─ Tracers      tracers   server, or tracers on other machines
//! ├─ LivePicture     picture   kept samples, pacing of frames, observers of the error of each eye
//! │  ├─ LightMix     light_mix  films of groups of lights, and how they are mixed
//! │  ├─ Regions      picture/regions  rectangles that have samples of their own
//! │  ├─ WindowFilter window_filter  the noise filter: a thread for each eye, which reads the accounts of its observer, the last filtered pictures
//! │  └─ Screen       screen    window, device, swapchain, and the FILM
//! ├─ SceneEditor     editor    scene, camera moves, edits, selection; saves them as a scene file
//! ├─ ViewerPanel     panel     egui, mouse and keys, display controls
//! ├─ Tools           tools     what the user works with: each has its state, its actions, and its part of the panel
//! ├─ ViewerMetrics   metrics   frame times, latencies, rates
//! ├─ Preferences     preferences what is remembered from session to session
//! ├─ SceneLoader     loader    a scene that a thread reads and prepares: the first, one that was dropped, one that has changed
//! ├─ FrameClock      clock     when frames are due
//! └─ FileWatch       watch     the files of the scene on the disk
//! ```
//!
//! `start` leads from the command line to the open window, where `loading` shows the progress of the first scene; `reload` replaces the
//! scene by another one, or by a new version after its files have changed; `handler` handles winit events and decides when a frame is due;
//! `frame` is the loop, and `recovery` what follows its errors; `steering` redirects camera paths after a move; `stereo` says what does not go with two
//! eyes; `actions` carries out user actions; `ending` writes the requested files when the window closes.

mod actions;
mod clock;
mod context;
mod editor;
mod ending;
mod frame;
mod handler;
mod light_mix;
mod loader;
mod loading;
mod metrics;
pub mod options;
mod panel;
mod picture;
mod preferences;
mod recovery;
mod reload;
mod saves;
mod screen;
mod session;
mod start;
mod steering;
mod stereo;
mod tools;
mod tracers;
mod watch;
mod window_filter;

use std::time::Instant;

use miette::Result;

use crate::client::window::action::{CursorAction, UserAction};
use crate::client::window::keys::KeyTable;
use crate::render::timings::TimingCapture;
use crate::viewer::clock::{Backoff, FrameClock};
use crate::viewer::context::SessionContext;
use crate::viewer::editor::SceneEditor;
use crate::viewer::loader::{SceneLoader, ViewSource};
use crate::viewer::metrics::ViewerMetrics;
use crate::viewer::panel::ViewerPanel;
use crate::viewer::picture::LivePicture;
use crate::viewer::preferences::Preferences;
use crate::viewer::session::RenderSession;
use crate::viewer::tools::{ToolAction, Tools};
use crate::viewer::watch::FileWatch;

pub use start::view;

/// What the next click in the picture is for.
enum AskedPlace {
    Window(CursorAction),
    Tool(ToolAction),
}

/// The window and everything behind it; owned by the event loop.
struct Viewer {
    /// Scene, options and method of the scene in the window.
    source: ViewSource,
    /// Loader of the next scene, or of a new version of the present one.
    loader: Option<SceneLoader>,
    watch: FileWatch,
    options: SessionContext,
    session: RenderSession,
    picture: LivePicture,
    editor: SceneEditor,
    panel: ViewerPanel,
    tools: Tools,
    keys: KeyTable<ToolAction>,
    /// The user's actions, performed before the next frame.
    actions: Vec<UserAction<ToolAction>>,
    metrics: ViewerMetrics,
    /// Recorder of pass and worker timings, if requested.
    capture: Option<TimingCapture>,
    clock: FrameClock,
    /// Back-off of frames that failed.
    errors: Backoff,
    ended: Instant,
    /// Last time that the camera was moved by flying.
    tick: Instant,
    /// Time at which the render was paused: no samples are read then, so the tracer stops once its lanes are full. `None` while it traces.
    paused: Option<Instant>,
    /// Action of the next click in the picture, such as setting the focus.
    asked: Option<AskedPlace>,
    /// When the user was warned that unsaved changes would be lost.
    warned: Option<Instant>,
    preferences: Preferences,
    /// When to check next which display the window is on.
    look_at_display: Instant,
    /// Whether free memory was given back since the last edit.
    has_returned_memory: bool,
    /// Deadline of a requested window resize. Until then the window is expected to take a size in which the picture keeps its present area.
    awaited: Option<Instant>,
    /// The window must close.
    quit: bool,
    /// Why the window closes, if not at the user's request.
    outcome: Result<()>,
}
