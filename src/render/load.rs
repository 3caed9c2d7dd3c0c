//! Loads the scene of a command line: the file, with the options applied.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use miette::{IntoDiagnostic, Result};

use crate::render::device::Device;
use crate::render::figures::Seconds;
use crate::render::forced::{Forced, last_of_each};
use crate::render::options::SceneOptions;
use crate::render::process::tell;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::{AovDesc, IntegratorKind, SceneDesc};
use crate::scene::{self, LoadOptions, LoadProgress, Loaded};
use crate::tracer::accel::SimdKernel;
use crate::tracer::effects::{Effect, decide, force_on, refusal, without};
use crate::tracer::{Camera, PrepareError, Scene};

/// A loaded scene, with the effects that the command line forces.
pub struct SceneInput {
    /// The scene, with all forced effects applied.
    pub loaded: Loaded,
    /// Effects forced on or off against what the scene needs.
    pub forced: Vec<Forced>,
    /// Files read.
    pub files: Vec<PathBuf>,
}

impl SceneInput {
    /// The run specified by these options and the scene, on the device of this name. It begins at index 0, in any order of rasterisation.
    pub fn run(&self, source: &SceneOptions, device: String) -> RunSpec {
        RunSpec::of(source, &self.loaded.desc, &self.forced, device)
    }
}

/// A prepared scene and its device.
pub struct Opened {
    pub input: SceneInput,
    pub scene: Scene,
    pub camera: Camera,
    pub device: Device,
}

/// Loads and prepares the scene while the device opens; adds the time of each step to `seconds`.
pub fn open(source: &SceneOptions, seconds: &mut Seconds) -> Result<Opened> {
    open_with_layers(source, None, seconds)
}

/// As [`open`], with these layers instead of those that the scene requests.
pub fn open_with_layers(
    source: &SceneOptions,
    aovs: Option<Vec<AovDesc>>,
    seconds: &mut Seconds,
) -> Result<Opened> {
    std::thread::scope(|scope| {
        let device = scope.spawn(|| {
            let start = Instant::now();
            (Device::open(source.device.as_deref()), start.elapsed())
        });
        let start = Instant::now();
        let mut input = load(source)?;
        let desc = &mut input.loaded.desc;
        desc.integrator.aovs = aovs.unwrap_or_else(|| std::mem::take(&mut desc.integrator.aovs));
        seconds.load = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let scene = prepare(Scene::prepare, desc, source.simd)?;
        let camera = Camera::of(desc).into_diagnostic()?;
        seconds.prepare = start.elapsed().as_secs_f64();
        let (device, opening) = device.join().map_err(|_| miette::miette!("opening the device panicked"))?;
        seconds.open_device = opening.as_secs_f64();
        Ok(Opened { input, scene, camera, device: device? })
    })
}

/// Loads the scene, with size and method from the command line, and reports every file to `progress`.
pub fn read_telling(source: &SceneOptions, progress: &Arc<LoadProgress>) -> Result<Loaded> {
    let mut loaded = match &source.loaded {
        Some(loaded) => Loaded { desc: loaded.desc.clone(), warnings: Vec::new() },
        None => scene::load_telling(&source.scene, &options(source), progress)?,
    };
    set_options(&mut loaded.desc, source);
    Ok(loaded)
}

/// As [`read_telling`]; `preview` gets the scene before its large pictures are read, if that takes long ([`scene::load_previewing`]).
pub fn read_previewing(
    source: &SceneOptions,
    progress: &Arc<LoadProgress>,
    mut preview: impl FnMut(SceneDesc),
) -> Result<Loaded> {
    let mut preview = |mut desc| {
        set_options(&mut desc, source);
        preview(desc);
    };
    let mut loaded = scene::load_previewing(&source.scene, &options(source), progress, &mut preview)?;
    set_options(&mut loaded.desc, source);
    Ok(loaded)
}

fn options(source: &SceneOptions) -> LoadOptions<'_> {
    LoadOptions { defines: &source.defines, lenient: source.lenient }
}

/// Replaces size and method by those of the command line.
fn set_options(desc: &mut SceneDesc, source: &SceneOptions) {
    if let Some((width, height)) = source.size {
        (desc.film.width, desc.film.height) = (width, height);
        desc.film.crop = None;
    }
    desc.integrator.kind = source.integrator.unwrap_or(desc.integrator.kind);
}

/// Loads the scene and applies the forced effects of the command line.
pub fn load(source: &SceneOptions) -> Result<SceneInput> {
    let progress = Arc::default();
    let mut loaded = read_telling(source, &progress)?;
    let forced = forced(&loaded.desc, source)?;
    forced.iter().try_for_each(|forced| force(&mut loaded.desc, *forced))?;
    Ok(SceneInput { loaded, forced, files: progress.files() })
}

/// Prepares `desc` for tracing with `make`, such as [`Scene::prepare`], and selects the SIMD kernel of ray traversal.
///
/// # Errors
///
/// When the processor lacks the kernel's instructions, or `make` fails.
pub fn prepare(
    make: impl FnOnce(&SceneDesc) -> Result<Scene, PrepareError>,
    desc: &SceneDesc,
    kernel: SimdKernel,
) -> Result<Scene> {
    if !kernel.is_available() {
        return Err(lacking(kernel, SimdKernel::is_available));
    }
    let scene = make(desc).into_diagnostic()?.with_kernel(kernel);
    scene.ok_or_else(|| lacking(kernel, SimdKernel::is_available))
}

/// The error for an unsupported kernel; `has` tells which kernels are supported.
fn lacking(kernel: SimdKernel, has: impl Fn(SimdKernel) -> bool) -> miette::Report {
    let there: Vec<&str> = SimdKernel::ALL.into_iter().filter(|k| has(*k)).map(SimdKernel::name).collect();
    miette::miette!(
        help = "leave --simd away, or give auto: that takes the fastest that there is, and the picture is the same",
        "--simd {}: this processor lacks the instructions; it has {}",
        kernel.name(),
        there.join(" and ")
    )
}

/// Effects that the command line forces and that are not in that state already. Switches without effect are reported.
pub fn forced(desc: &SceneDesc, source: &SceneOptions) -> Result<Vec<Forced>> {
    let kind = desc.integrator.kind;
    let plan = decide(desc, kind);
    let mut effective = Vec::new();
    for forced in last_of_each(&source.effects) {
        let Some(decision) = plan.iter().find(|decision| decision.effect == forced.effect) else {
            continue;
        };
        let open = kind == IntegratorKind::Auto && refusal(forced.effect, IntegratorKind::Path).is_some();
        if forced.on == decision.on && !open {
            tell(&format!("note: --effects {forced} changes nothing: {}", decision.reason));
            continue;
        }
        force(&mut desc.clone(), forced)?;
        effective.push(forced);
    }
    Ok(effective)
}

/// Forces one effect.
pub fn force(desc: &mut SceneDesc, forced: Forced) -> Result<()> {
    let forcing: fn(&mut SceneDesc, Effect) -> Result<(), &'static str> =
        if forced.on { force_on } else { without };
    let impossible =
        |advice: &str| miette::miette!(help = advice.to_string(), "--effects {forced} is not possible here");
    forcing(desc, forced.effect).map_err(impossible)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Message and help text of an error.
    fn words(error: &miette::Report) -> (String, String) {
        (error.to_string(), error.help().map(|help| help.to_string()).unwrap_or_default())
    }

    #[test]
    fn a_kernel_that_is_lacking_is_an_error_that_names_the_others() {
        let (what, help) = words(&lacking(SimdKernel::Avx512, |kernel| kernel != SimdKernel::Avx512));
        assert_eq!(what, "--simd avx512: this processor lacks the instructions; it has scalar and avx2");
        assert!(help.contains("auto"), "{help}");
        let (what, _) = words(&lacking(SimdKernel::Avx2, |kernel| kernel == SimdKernel::Scalar));
        assert_eq!(what, "--simd avx2: this processor lacks the instructions; it has scalar");
    }

    /// An unsupported kernel is rejected before the scene is prepared; supported ones are used as requested.
    #[test]
    fn scenes_are_walked_as_asked() {
        let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"cube\"/>\
                    <emitter type=\"constant\"/></scene>";
        let desc = scene::load_str("t.xml", text, &[]).expect("valid").desc;
        for kernel in SimdKernel::ALL {
            for make in [Scene::prepare, Scene::prepare_general] {
                let made = prepare(make, &desc, kernel).map(|scene| scene.kernel());
                assert_eq!(made.ok(), kernel.is_available().then_some(kernel));
            }
        }
    }
}
