//! `pointillist view`: the window, always interactive, whatever the tracer is doing (paper §4.2, Figure 1).
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
//! The [`Viewer`] belongs to the event loop. Each thing in it has one owner, which alone changes it:
//!
//! ```text
//! Viewer
//! ├─ RenderSession   session   lanes, epoch; what is rendered and by which method
//! │  └─ Tracers      tracers   server, or tracers on other machines
//! ├─ LivePicture     picture   kept samples, pacing of frames, observer of the error
//! │  ├─ LightMix     light_mix  films of groups of lights, and how they are mixed
//! │  ├─ Regions      picture/regions  rectangles that have samples of their own
//! │  ├─ WindowFilter window_filter  the noise filter: its thread, the last filtered picture
//! │  └─ Screen       screen    window, device, swapchain, and the FILM
//! ├─ SceneEditor     editor    scene, camera moves, edits, selection; saves them as a scene file
//! ├─ ViewerPanel     panel     egui, mouse and keys, display controls, list of effects
//! │  ├─ MapCache     maps      maps of error and cost over the picture
//! │  └─ EffectCosts  costs     measured costs of the effects
//! ├─ ViewerMetrics   metrics   frame times, latencies, rates
//! ├─ Inspector       inspector   the paths of the pixel that was clicked at
//! ├─ Outline         outline     the outline of the selected object
//! ├─ Gizmo           gizmo       handles that move, turn and scale it
//! ├─ Comparison      comparison  snapshots and other pictures beside the present one
//! ├─ HistogramCache  histogram   the histogram of the picture
//! ├─ CameraBookmarks  camera_bookmarks  views of the camera by number, beside the scene
//! ├─ Preferences     preferences what is remembered from session to session
//! ├─ BackgroundSaves saves     files that are being written
//! ├─ SceneLoader     loader    a scene that a thread reads and prepares: the first, one that was dropped, one that has changed
//! ├─ FrameClock      clock     when frames are due
//! └─ FileWatch       watch     the files of the scene on the disk
//! ```
//!
//! `start` goes from the command line to the open window, in which `loading` shows how far the first scene is; `reload` replaces the
//! scene by another one, or by itself after a change; `handler` hears winit and decides when a frame is due; `frame` is the
//! loop; `actions` does what the user asks for, `saving` what of it makes files; `ending` writes what is left behind when the window closes.

mod actions;
mod camera_bookmarks;
mod clock;
mod comparison;
mod costs;
mod editor;
mod ending;
mod exposure;
mod frame;
mod gizmo;
mod handler;
mod histogram;
mod inspector;
mod light_mix;
mod loader;
mod loading;
mod maps;
mod metrics;
pub mod options;
mod outline;
mod panel;
mod picture;
mod preferences;
mod reload;
mod saves;
mod saving;
mod screen;
mod session;
mod start;
mod tracers;
mod watch;
mod window_filter;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use miette::Result;

use crate::client::window::keys::CursorAction;
use crate::gpu::{DeviceChoice, Region};
use crate::remote::TracerAddress;
use crate::render::outputs::Outputs;
use crate::render::tev::TevLink;
use crate::render::timings::TimingCapture;
use crate::viewer::camera_bookmarks::CameraBookmarks;
use crate::viewer::clock::{Backoff, FrameClock};
use crate::viewer::comparison::Comparison;
use crate::viewer::editor::SceneEditor;
use crate::viewer::exposure::AutoExposure;
use crate::viewer::gizmo::Gizmo;
use crate::viewer::histogram::HistogramCache;
use crate::viewer::inspector::Inspector;
use crate::viewer::loader::{SceneLoader, ViewSource};
use crate::viewer::metrics::ViewerMetrics;
use crate::viewer::outline::Outline;
use crate::viewer::panel::ViewerPanel;
use crate::viewer::picture::LivePicture;
use crate::viewer::preferences::Preferences;
use crate::viewer::saves::BackgroundSaves;
use crate::viewer::screen::SimulatedLosses;
use crate::viewer::session::RenderSession;
use crate::viewer::watch::FileWatch;

pub use start::view;

/// What is decided when the window opens, apart from what is rendered.
struct SessionContext {
    /// When the program began.
    began: Instant,
    /// Pictures to be written at the end.
    outputs: Outputs,
    /// Figures to be written at the end.
    json: Option<PathBuf>,
    device: DeviceChoice,
    /// Where the times of every pass go.
    timings: Option<PathBuf>,
    losses: SimulatedLosses,
    /// Camera paths of a render; `None` is no end.
    samples: Option<u64>,
    /// Shows the picture in tev, too.
    tev: Option<TevLink>,
    /// Tracers on other machines; none are threads of this process.
    tracers: Vec<TracerAddress>,
    /// Length of a frame; otherwise the display's.
    budget: Option<Duration>,
    /// Name of the scene, for title and file names.
    name: String,
}

/// The window and everything behind it; owned by the event loop.
struct Viewer {
    /// What is shown.
    source: ViewSource,
    /// The scene that will be shown next, or the same one read again.
    loader: Option<SceneLoader>,
    watch: FileWatch,
    options: SessionContext,
    session: RenderSession,
    picture: LivePicture,
    editor: SceneEditor,
    panel: ViewerPanel,
    metrics: ViewerMetrics,
    /// The exposure, where it follows the light of the scene.
    light: AutoExposure,
    saves: BackgroundSaves,
    /// Records times of passes and workers, if asked for.
    capture: Option<TimingCapture>,
    clock: FrameClock,
    /// Attempts at frames that have failed.
    errors: Backoff,
    ended: Instant,
    /// The last tick of flying.
    tick: Instant,
    /// Since when no samples are read, so that the tracer stops once its lanes are full; `None` while it traces.
    paused: Option<Instant>,
    /// What is done where the user clicks next.
    asked: Option<CursorAction>,
    /// The rectangle that is being dragged.
    dragged: Option<Region>,
    /// When the user was warned that changes would be lost.
    warned: Option<Instant>,
    inspector: Inspector,
    outline: Outline,
    gizmo: Gizmo,
    comparison: Comparison,
    histogram: HistogramCache,
    views: CameraBookmarks,
    preferences: Preferences,
    /// When it looks which display the window is on.
    look_at_display: Instant,
    /// Until then the window is about to take a size that it was asked for, in which the picture has the area that it has now.
    awaited: Option<Instant>,
    /// The window is to close.
    quit: bool,
    /// Why the window closes, if not because the user wanted it.
    outcome: Result<()>,
}
