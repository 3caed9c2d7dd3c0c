//! One side of `tools/bench effects`: works for a while on each request, so that two processes that answer in turn share the
//! machine alike.
//!
//! `trace` traces on one thread, as planned or with the general code; `paint` has a Vulkan device take a batch of samples and paint
//! the picture, 512×512, as plain as it can be. Each line of standard input is a number of milliseconds; the answer is the nanoseconds
//! of one path or one frame.

use std::hint::black_box;
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::client::film::VulkanFilm;
use pointillist::client::{CHUNK_SAMPLES, Film, FilmSpec, Settings, SplatFilter};
use pointillist::color::Xyz;
use pointillist::gpu::{DeviceChoice, Gpu};
use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::load;
use pointillist::stream::{PathCounts, Sample, UvWindow};
use pointillist::tracer::effects::{Effect, without};
use pointillist::tracer::integrator::{
    BidirectionalTracer, ParticleTracer, PathTracer, PhotonTracer, RenderContext, VcmTracer,
};
use pointillist::tracer::{Camera, Integrator, Scene};

use super::common::{Nowhere, Outcome};

/// What to do.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    work: Work,
}

#[derive(clap::Subcommand)]
enum Work {
    /// Traces paths
    Trace {
        /// The scene file
        scene: PathBuf,
        /// `everything` takes the general code, `bidirectional` the bidirectional method, `grey` one wavelength for all
        how: Vec<How>,
    },
    /// Paints frames
    Paint,
}

/// How a scene is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum How {
    Everything,
    Bidirectional,
    Grey,
}

/// Indices between two readings of the clock.
const AT_ONCE: u64 = 32;

/// Beyond the first paths of the sequence, which do not split.
const FIRST: u64 = 1 << 20;

/// Answers until standard input ends.
pub fn run(arguments: &Arguments) -> Outcome {
    match &arguments.work {
        Work::Trace { scene, how } => trace(scene, how),
        Work::Paint => paint(),
    }
}

fn trace(scene: &Path, how: &[How]) -> Outcome {
    let is = |word| how.contains(&word);
    let mut desc = load(scene, &[])?.desc;
    if is(How::Grey) {
        without(&mut desc, Effect::Wavelengths)?;
    }
    if is(How::Bidirectional) {
        desc.integrator.kind = IntegratorKind::Bidirectional;
    }
    let scene = if is(How::Everything) { Scene::prepare_general(&desc)? } else { Scene::prepare(&desc)? };
    let context =
        RenderContext::new(Arc::new(scene), Camera::of(&desc)?, &desc.integrator, 0, UvWindow::PICTURE);
    match desc.integrator.kind {
        IntegratorKind::Path | IntegratorKind::Depth | IntegratorKind::Auto => paths(&PathTracer { context }),
        IntegratorKind::Light => paths(&ParticleTracer { context }),
        IntegratorKind::Bidirectional => paths(&BidirectionalTracer { context }),
        IntegratorKind::Photon => paths(&PhotonTracer::new(context, true)),
        IntegratorKind::Vcm => paths(&VcmTracer::new(context, true)),
    }
}

fn paths<I: Integrator>(integrator: &I) -> Outcome {
    let (mut next, mut scratch) = (FIRST, I::Scratch::default());
    answer(|| {
        for _ in 0..AT_ONCE {
            integrator.trace(next, &mut scratch, &mut Nowhere);
            next += 1;
        }
        Ok(AT_ONCE)
    })
}

fn paint() -> Outcome {
    let gpu = Gpu::new(&DeviceChoice::Best)?;
    let spec = FilmSpec {
        width: 512,
        height: 512,
        filter: SplatFilter::Gaussian,
        variance: None,
        sums: Default::default(),
    };
    let mut film = VulkanFilm::new(gpu, spec)?;
    // The R2 sequence (Roberts 2018).
    let at = |i: usize| [0.754_877_7, 0.569_840_3].map(|a: f64| (a * i as f64).fract() as f32);
    let samples: Vec<Sample> =
        (0..CHUNK_SAMPLES).map(|i| Sample { uv: at(i), xyz: Xyz::new(0.4, 0.5, 0.6), w: 1.0 }).collect();
    let settings = Settings::default();
    answer(|| {
        film.count_paths(PathCounts { camera: samples.len() as u64, light: 0 });
        film.add(&samples)?;
        black_box(film.display(&settings)?);
        Ok(1)
    })
}

/// Answers every line: for so many milliseconds does `work`, which says how much it did, and prints the nanoseconds of one.
fn answer(mut work: impl FnMut() -> Outcome<u64>) -> Outcome {
    for line in std::io::stdin().lock().lines() {
        let time = Duration::from_millis(line?.trim().parse()?);
        let (start, mut done) = (Instant::now(), 0);
        while start.elapsed() < time {
            done += work()?;
        }
        println!("{}", start.elapsed().as_nanos() as f64 / done as f64);
        std::io::stdout().flush()?;
    }
    Ok(())
}
