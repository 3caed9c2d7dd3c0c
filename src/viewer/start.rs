//! From the command line to the open window, and from there to the exit code.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};

use crate::client::background;
use crate::client::window::host::ReaderEvent;
use crate::client::window::panel::{CommandPalette, PanelControls, PanelLayout};
use crate::client::{Denoise, Settings, SplatFilter};
use crate::color::Profile;
use crate::denoise::view_filter::check as check_denoise;
use crate::gpu::{self, DeviceChoice};
use crate::job::panic_message;
use crate::remote::{FetchOptions, Fetched, TracerAddress, fetch};
use crate::render::device::CPU;
use crate::render::options::SceneOptions;
use crate::render::outputs::Outputs;
use crate::render::process::tell;
use crate::render::remote_order::scene_digest;
use crate::render::tev::TevLink;
use crate::render::timings::{self, TimingCapture};
use crate::render::{predictions, process};
use crate::viewer::Viewer;
use crate::viewer::clock::{Backoff, FrameClock};
use crate::viewer::context::SessionContext;
use crate::viewer::loader::{LoadStage, ReadyScene, ViewSource};
use crate::viewer::loading::{LoadingWindow, OpenWindow, title, window_size};
use crate::viewer::metrics::ViewerMetrics;
use crate::viewer::options::{OF_TRACER, ViewOptions};
use crate::viewer::panel::ViewerPanel;
use crate::viewer::picture::LivePicture;
use crate::viewer::preferences::Preferences;
use crate::viewer::reload::previewed;
use crate::viewer::screen::is_device_lost;
use crate::viewer::session::RenderSession;
use crate::viewer::stereo::refusal;
use crate::viewer::tools::Tools;
use crate::viewer::tracers::{self, Tracers};
use crate::viewer::watch::FileWatch;

/// Runs the subcommand. Requested pictures are written even after an error.
pub fn view(args: &ViewOptions) -> Result<()> {
    let began = Instant::now();
    if args.source.device.as_deref() == Some(CPU) {
        return Err(miette::miette!(
            "a window needs a Vulkan device, and --device cpu is none: leave it out, or use `pointillist render`"
        ));
    }
    if args.deterministic && !args.tracers.connect.is_empty() {
        return Err(miette::miette!(
            help = "leave --deterministic away, or render in parts: `pointillist shard`",
            "samples of tracers elsewhere come in any order: --deterministic and --connect exclude each other"
        ));
    }
    if let Some(why) = args
        .stereo
        .and_then(|_| refusal(args.deterministic, !args.tracers.connect.is_empty(), args.tev.is_some()))
    {
        return Err(miette::miette!("--stereo: {why}"));
    }
    let denoise = denoise(args)?;
    let outputs = Outputs::check(args.outputs.clone(), args.json.as_ref(), &args.source.scene)?;
    if let Some(path) = &args.gpu_timings {
        timings::check(path, args.outputs.iter().chain(&args.json).chain([&args.source.scene]))?;
    }
    process::listen_for_interrupt();
    let mut events = EventLoop::<ReaderEvent>::with_user_event();
    let events = events.build().map_err(|error| no_display(&error.to_string()))?;
    let mut app = ViewerApp::start(args, denoise, outputs, events.create_proxy(), began)?;
    // The window system may fail at any moment; the traced samples are saved nevertheless.
    let run = catch_unwind(AssertUnwindSafe(|| events.run_app(&mut app)));
    match run {
        Ok(Ok(())) => {}
        Ok(Err(error)) => app.fail(miette::miette!("the window system failed: {error}")),
        // winit panics when the connection to the display is lost.
        Err(_) if gpu::display_lost() => app.fail(miette::miette!("the connection to the display broke")),
        Err(panic) => app.fail(internal(panic.as_ref())),
    }
    let outcome = app.finish();
    // Threads of a closed film must not be inside the driver when the process exits.
    background::join_abandoned();
    outcome
}

/// Converts a panic of the viewer to an error.
fn internal(panic: &(dyn Any + Send)) -> miette::Report {
    let words = panic_message(panic).unwrap_or_default();
    miette::miette!(
        help = "please report this, with what you did last",
        "the viewer made a mistake and had to close: {words}"
    )
}

/// Error if there is no window system. `why`: message of winit, which begins with a source location.
fn no_display(why: &str) -> miette::Report {
    let why =
        why.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(why, |(_, words)| words);
    miette::miette!(
        help = "set DISPLAY or WAYLAND_DISPLAY to a running display, or make the picture without a window: \
                `pointillist render SCENE -o FILE`",
        "no window can be opened: {}",
        why.trim_end_matches('.')
    )
}

/// Application state driven by the event loop.
pub(super) struct ViewerApp {
    pub(super) stage: Stage,
}

/// Stage of the application.
pub(super) enum Stage {
    /// The first scene is being loaded.
    Loading(Box<LoadingWindow>),
    /// A scene is shown.
    Open(Box<Viewer>),
    /// The window has closed before a scene was loaded.
    Over(Result<()>),
}

impl ViewerApp {
    /// Begins to load the scene.
    fn start(
        args: &ViewOptions,
        denoise: Denoise,
        outputs: Outputs,
        proxy: EventLoopProxy<ReaderEvent>,
        began: Instant,
    ) -> Result<Self> {
        let tracers = tracers::addresses(&args.tracers)?;
        let scene = scene(args, &tracers)?;
        let source = ViewSource {
            args: scene,
            deterministic: args.deterministic,
            replicated: args.replicates > 1,
            remote: !tracers.is_empty(),
        };
        let (reproject, steer) = (!args.no_reproject, args.steer);
        let settings = Settings { denoise, reproject, steer, ..args.display.clone() };
        let preferences = Preferences::read();
        let mut layout = PanelLayout::new(!args.no_panel);
        preferences.arrange(&mut layout);
        let controls = PanelControls {
            own_profile: Some(settings.profile.clone()).filter(|p| Profile::named(&p.name).is_none()),
            settings,
            filter: SplatFilter::Gaussian,
            layout,
            help: false,
            palette: CommandPalette::default(),
            enters: false,
            // In index order the picture must equal that of `render` to the byte.
            auto_exposure: !args.fixed_exposure && !args.deterministic,
        };
        let options = SessionContext {
            began,
            outputs,
            json: args.json.clone(),
            device: args.source.device.as_deref().map_or(DeviceChoice::Best, DeviceChoice::parse),
            timings: args.gpu_timings.clone(),
            faults: args.faults.clone(),
            budget: args.fps.map(|fps| Duration::from_secs_f32(1.0 / fps.clamp(0.1, 1000.0))),
            samples: args.samples,
            tev: args.tev.as_deref().map(TevLink::start).transpose()?,
            tracers,
            stereo: args.stereo,
            controls,
            name: source.name(),
        };
        let loading = LoadingWindow::start(source, options, preferences, proxy)?;
        Ok(Self { stage: Stage::Loading(Box::new(loading)) })
    }

    /// Performs the due work; switches from loading to the viewer when the scene is ready.
    pub(super) fn step(&mut self, events: &ActiveEventLoop) {
        match &mut self.stage {
            Stage::Open(viewer) => viewer.turn(),
            Stage::Over(_) => {}
            Stage::Loading(loading) => {
                loading.quit |= process::is_interrupted();
                match loading.step(events) {
                    _ if gpu::display_lost() => {
                        self.fail(miette::miette!("the connection to the display broke"))
                    }
                    Ok(None) => {}
                    Ok(Some(ready)) => self.open(ready),
                    Err(error) => self.fail(error),
                }
            }
        }
    }

    /// Shows the first scene in the open window.
    fn open(&mut self, ready: ReadyScene) {
        let Stage::Loading(loading) = std::mem::replace(&mut self.stage, Stage::Over(Ok(()))) else { return };
        self.stage = match viewer(*loading, ready) {
            Ok(viewer) => Stage::Open(Box::new(viewer)),
            Err(error) => Stage::Over(Err(error)),
        };
    }

    /// Ends the loop for this reason; only the first call has an effect.
    fn fail(&mut self, error: miette::Report) {
        match &mut self.stage {
            Stage::Open(viewer) => viewer.fail(error),
            Stage::Over(Err(_)) => {}
            stage => *stage = Stage::Over(Err(error)),
        }
    }

    /// Writes the requested files and returns why the window has closed, if not at the user's request.
    fn finish(self) -> Result<()> {
        match self.stage {
            Stage::Loading(_) => Ok(()),
            Stage::Open(viewer) => viewer.finish(),
            Stage::Over(outcome) => outcome,
        }
    }
}

/// The requested noise filter, if it is available.
fn denoise(args: &ViewOptions) -> Result<Denoise> {
    let usual = if args.deterministic || args.replicates == 1 { Denoise::Off } else { Denoise::Wavelet };
    match args.denoise {
        Some(kind) if kind != Denoise::Off && args.replicates == 1 => {
            Err(miette::miette!(help = "leave --replicates away", "--denoise needs two randomisations"))
        }
        kind => {
            let kind = kind.unwrap_or(usual);
            check_denoise(kind).map(|()| kind)
        }
    }
}

/// Scene of the command line; that of the first tracer if it names none.
fn scene(args: &ViewOptions, tracers: &[TracerAddress]) -> Result<SceneOptions> {
    if args.source.scene != Path::new(OF_TRACER) {
        return Ok(args.source.clone());
    }
    let Some(first) = tracers.first() else {
        return Err(miette::miette!(
            help = "`pointillist view scenes/cornell.xml`, or --connect HOST:PORT for the scene of a tracer",
            "there is no scene to show"
        ));
    };
    let folder = predictions::folder()
        .ok_or_else(|| miette::miette!("set POINTILLIST_STATE to a folder for fetched scenes"))?;
    tell(&format!("fetching the scene from {}", first.address));
    let options = FetchOptions {
        folder: &folder.join("scenes"),
        digest: &|files, welcome| scene_digest(files, &welcome.defines, welcome.lenient).ok(),
        is_over: &process::is_interrupted,
    };
    let fetched = fetch(first, &options);
    let Fetched { scene, welcome } = fetched
        .map_err(|error| miette::miette!("the scene of {} cannot be fetched: {error}", first.address))?;
    Ok(SceneOptions { scene, defines: welcome.defines, lenient: welcome.lenient, ..args.source.clone() })
}

/// Starts the tracer and the first epoch in the open window.
fn viewer(loading: LoadingWindow, ready: ReadyScene) -> Result<Viewer> {
    let LoadingWindow { mut options, mut preferences, loader, open, .. } = loading;
    let Some(OpenWindow { screen, host }) = open else {
        return Err(miette::miette!("there is no window for the scene"));
    };
    let ReadyScene { stage, run, choose, editor, digest } = ready;
    options.controls.filter = run.film.filter;
    let size = [run.film.width, run.film.height];
    let window = screen.window.clone();
    // Another scene may have been dropped onto the window while loading.
    options.name = loader.source.name();
    window.set_title(&title(&options.name));
    let panel = ViewerPanel::new(host, options.controls.clone(), size);
    let wanted = window_size(&window, size, panel.dock_pixels(&window));
    if window.inner_size() != wanted {
        // The window was opened before the size of the picture was known.
        let _ = window.request_inner_size(wanted);
    }
    let threads = loader.source.args.threads();
    let mut picture = LivePicture::new(&run, options.budget, threads)?;
    let (tracers, lanes) = match options.tracers.is_empty() {
        true => Tracers::here(threads)?,
        false => Tracers::elsewhere(options.tracers.clone(), digest.unwrap_or_default())?,
    };
    let mut session = RenderSession::new(run, choose, tracers, lanes, options.samples);
    let mut capture = None;
    if let Some(gpu) = screen.gpu() {
        session.set_device(gpu.info());
    }
    if let Some(path) = &options.timings {
        if let Some(server) = session.tracers.server() {
            server.set_tracing(true);
        }
        capture = Some(TimingCapture::new(path, screen.gpu())?);
    }
    picture.screen = Some(screen);
    if let Err(error) = picture.refit(session.run_spec()) {
        match is_device_lost(&error) {
            true => picture.lose_device(error).into_diagnostic()?,
            // The first frame retries it.
            false => tell(&error.to_string()),
        }
    }
    preferences.opened(&loader.source.args.scene, &panel.controls.layout);
    let mut tools = Tools::default();
    let problems = tools.open_scene(&loader.source.args.scene);
    let (mut watch, problem) = FileWatch::new();
    let unseen = watch.follow(loader.files());
    let now = Instant::now();
    let metrics = ViewerMetrics::since(options.began);
    let mut viewer = Viewer {
        source: loader.source.clone(),
        loader: (stage == LoadStage::Preview).then_some(loader),
        watch,
        options,
        session,
        picture,
        editor,
        panel,
        tools,
        keys: Tools::keys(),
        actions: Vec::new(),
        metrics,
        capture,
        clock: FrameClock::new(now),
        errors: Backoff::default(),
        ended: now,
        tick: now,
        paused: None,
        asked: None,
        warned: None,
        preferences,
        look_at_display: now,
        has_returned_memory: false,
        awaited: None,
        quit: false,
        outcome: Ok(()),
    };
    let preview = (stage == LoadStage::Preview).then(|| previewed(&viewer.source));
    let messages = problem.into_iter().chain(unseen).chain(problems).chain(preview);
    messages.for_each(|message| viewer.say(message));
    if let Some(wanted) = viewer.options.stereo {
        let about = viewer.with_tools(None, |tools, context| tools.stereo.open(wanted, context))?;
        viewer.say(about);
    }
    viewer.choose_method()?;
    viewer.restart()?;
    Ok(viewer)
}
