//! One side of `tools/bench effects`: traces paths for as long as it is asked to, again and again. Processes that answer in turn have the
//! same share of the machine.
//!
//! `turns trace SCENE.xml [everything] [bidirectional] [grey]` traces on one thread, as planned or with everything, by the scene's method
//! or bidirectionally, in colour or without; `turns paint` has a Vulkan device take a
//! batch of samples and paint the picture, 512×512, as plain as it can be. Reads a number of milliseconds per line and answers with the
//! nanoseconds of a path, or of a frame.

use std::hint::black_box;
use std::io::{BufRead, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::client::film::VulkanFilm;
use pointillist::client::{BATCH_CAPACITY, FilmSpec, Settings, SplatFilter};
use pointillist::color::Xyz;
use pointillist::gpu::{DeviceChoice, Gpu};
use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::load;
use pointillist::stream::{PathCounts, Sample, SampleSink, UvWindow};
use pointillist::tracer::effects::{Effect, without};
use pointillist::tracer::integrator::{
    BidirectionalTracer, ParticleTracer, PathTracer, PhotonTracer, RenderContext,
};
use pointillist::tracer::{Camera, Integrator, Scene};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Indices between two looks at the clock.
const AT_ONCE: u64 = 32;

/// Beyond the first paths of the sequence, which do not split.
const FIRST: u64 = 1 << 20;

fn main() -> Outcome {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["trace", scene, how @ ..] => trace(scene, how),
        ["paint"] => paint(),
        _ => Err("usage: turns trace SCENE.xml [everything] [bidirectional] [grey] | turns paint".into()),
    }
}

fn trace(scene: &str, how: &[&str]) -> Outcome {
    let known = ["everything", "bidirectional", "grey"];
    if let Some(unknown) = how.iter().find(|word| !known.contains(word)) {
        return Err(format!("{unknown}: there are {}", known.join(", ")).into());
    }
    let is = |word| how.contains(&word);
    let mut desc = load(scene.as_ref(), &[])?.desc;
    if is("grey") {
        without(&mut desc, Effect::Wavelengths)?;
    }
    if is("bidirectional") {
        desc.integrator.kind = IntegratorKind::Bidirectional;
    }
    let scene = if is("everything") { Scene::prepare_general(&desc)? } else { Scene::prepare(&desc)? };
    let context =
        RenderContext::new(Arc::new(scene), Camera::of(&desc)?, &desc.integrator, 0, UvWindow::PICTURE);
    match desc.integrator.kind {
        IntegratorKind::Path | IntegratorKind::Auto => paths(&PathTracer { context }),
        IntegratorKind::Light => paths(&ParticleTracer { context }),
        IntegratorKind::Bidirectional => paths(&BidirectionalTracer { context }),
        IntegratorKind::Photon => paths(&PhotonTracer::new(context, true)),
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
        (0..BATCH_CAPACITY).map(|i| Sample { uv: at(i), xyz: Xyz::new(0.4, 0.5, 0.6), w: 1.0 }).collect();
    let settings = Settings::default();
    answer(|| {
        film.count_paths(PathCounts { camera: samples.len() as u64, light: 0 });
        film.add(&samples)?;
        black_box(film.display(&settings)?);
        Ok(1)
    })
}

/// Answers every line: for so many milliseconds does `work`, which says how much it did, and prints the nanoseconds of one.
fn answer(mut work: impl FnMut() -> Result<u64, Box<dyn std::error::Error>>) -> Outcome {
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

/// Takes samples and forgets them.
struct Nowhere;

impl SampleSink for Nowhere {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        black_box((uv, value, weight));
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        black_box((uv, value));
    }
}
