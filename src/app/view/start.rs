//! From the command line to the open window, and from there to the exit code.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use miette::Result;
use winit::event_loop::EventLoop;

use crate::app::args::ViewArgs;
use crate::app::device::CPU;
use crate::app::load::SceneInput;
use crate::app::outputs::Outputs;
use crate::app::run_spec::RunSpec;
use crate::app::view::editor::SceneEditor;
use crate::app::view::metrics::ViewerMetrics;
use crate::app::view::panel::ViewerPanel;
use crate::app::view::picture::LivePicture;
use crate::app::view::saves::BackgroundSaves;
use crate::app::view::screen::SimulatedLosses;
use crate::app::view::session::RenderSession;
use crate::app::view::{ViewOptions, Viewer};
use crate::app::{load, method, process, tell, timings};
use crate::client::Settings;
use crate::client::background;
use crate::client::window::panel::{DEFAULT_TARGET, MapChoice, PanelControls};
use crate::color::Profile;
use crate::gpu::{self, DeviceChoice};
use crate::scene::desc::IntegratorKind;
use crate::server::panic_message;
use crate::tracer::Scene;

/// Runs the subcommand. A picture that was asked for is written even after an error.
pub fn view(args: &ViewArgs) -> Result<()> {
    if args.source.device.as_deref() == Some(CPU) {
        return Err(miette::miette!(
            "a window needs a Vulkan device, and --device cpu is none: leave it out, or use `pointillist render`"
        ));
    }
    let outputs = Outputs::check(args.outputs.clone(), args.json.as_ref(), &args.source.scene)?;
    if let Some(path) = &args.gpu_timings {
        timings::check(path, args.outputs.iter().chain(&args.json).chain([&args.source.scene]))?;
    }
    process::listen_for_interrupt();
    let events = EventLoop::new().map_err(|error| no_display(&error.to_string()))?;
    let mut viewer = prepare(args, outputs)?;
    // The window system may fail at any moment: what was traced is saved all the same.
    let run = catch_unwind(AssertUnwindSafe(|| events.run_app(&mut viewer)));
    match run {
        Ok(Ok(())) => {}
        Ok(Err(error)) => viewer.fail(miette::miette!("the window system failed: {error}")),
        // winit panics when its display goes away.
        Err(_) if gpu::display_lost() => viewer.fail(miette::miette!("the connection to the display broke")),
        Err(panic) => viewer.fail(internal(panic.as_ref())),
    }
    let outcome = viewer.finish();
    // Threads that a closed film has left must not be inside the driver when the program ends.
    background::join_abandoned();
    outcome
}

/// The error of a panic in the viewer.
fn internal(panic: &(dyn Any + Send)) -> miette::Report {
    let words = panic_message(panic).unwrap_or_default();
    miette::miette!(
        help = "please report this, with what you did last",
        "the viewer made a mistake and had to close: {words}"
    )
}

/// The error where no window system answers. `why` is the message of winit, which begins with the place in its source.
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

/// Loads the scene and starts the threads.
fn prepare(args: &ViewArgs, outputs: Outputs) -> Result<Viewer> {
    let loaded = load::read(&args.source)?;
    load::tell_warnings(&loaded);
    let scene = load::prepare(Scene::prepare, &loaded.desc, args.source.simd)?;
    for notice in scene.notices() {
        tell(&format!("warning: {notice}"));
    }
    let forced = load::forced(&loaded.desc, &args.source)?;
    let input = SceneInput { loaded, forced };
    let mut run = RunSpec {
        deterministic: args.deterministic,
        replicated: args.replicates > 1,
        ..RunSpec::of(&args.source, &input, String::new())
    };
    let SceneInput { loaded, forced } = input;
    let mut editor = SceneEditor::new(loaded.desc, scene)?;
    forced.into_iter().try_for_each(|forced| editor.force(forced))?;
    run.photons = editor.desc().integrator.photons;
    let threads = args.source.threads();
    let size = [run.film.width, run.film.height];
    let mut choose = false;
    if run.deterministic {
        method::choose(&mut run, &editor.scene(), &editor.camera(size)?, threads);
        method::tell_choice(&run);
    } else if run.integrator == IntegratorKind::Auto {
        // Until the method is chosen, beside the window.
        run.integrator = IntegratorKind::Path;
        choose = true;
    }
    let settings = args.display.settings();
    let controls = PanelControls {
        own_profile: Some(settings.profile.clone()).filter(|p| Profile::named(&p.name).is_none()),
        settings: Settings { output: args.hdr, ..settings },
        filter: run.film.filter,
        visible: !args.no_panel,
        help: false,
        map: MapChoice::default(),
        target: DEFAULT_TARGET,
    };
    let name =
        args.source.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned());
    let options = ViewOptions {
        outputs,
        json: args.json.clone(),
        device: args.source.device.as_deref().map_or(DeviceChoice::Best, DeviceChoice::parse),
        timings: args.gpu_timings.clone(),
        losses: SimulatedLosses { devices: args.lose_device_after.clone(), surface: args.lose_surface_after },
        budget: args.fps.map(|fps| Duration::from_secs_f32(1.0 / fps.clamp(0.1, 1000.0))),
        name,
    };
    let panel = ViewerPanel::new(controls, size);
    let picture = LivePicture::new(&run, options.budget, panel.target())?;
    let session = RenderSession::start(run, choose, threads, args.samples)?;
    let now = Instant::now();
    Ok(Viewer {
        options,
        session,
        picture,
        editor,
        panel,
        metrics: ViewerMetrics::default(),
        saves: BackgroundSaves::default(),
        capture: None,
        due: now,
        ended: now,
        tick: now,
        quit: false,
        outcome: Ok(()),
    })
}
