//! The price of textures: paths per tracing second on the same geometry with pictures and with their mean colours, by turns.

use std::path::PathBuf;
use std::sync::Arc;

use pointillist::color::srgb;
use pointillist::image::bitmap::Bitmap;
use pointillist::math::random::Random;
use pointillist::scene::SceneDesc;
use pointillist::scene::desc::BsdfDesc;
use pointillist::scene::desc::texture::{BitmapTexture, SpectrumTexture};
use pointillist::scene::load;
use pointillist::spectrum::Spectrum;
use pointillist::stream::UvWindow;
use pointillist::tracer::effects::{Effect, decide, without};
use pointillist::tracer::integrator::{PathTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, Scene};

use super::common::{Nowhere, Outcome, thread_seconds};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// The number of pairs of turns
    #[arg(long, default_value_t = 40)]
    turns: usize,
    /// Texels along a side of the pictures that matt surfaces of a scene without textures get
    #[arg(long, default_value_t = 1024)]
    side: usize,
    /// These pictures hold floats; otherwise 8 bits, as most pictures of scenes
    #[arg(long)]
    floats: bool,
    /// The scene files
    #[arg(default_values = ["scenes/staircase2/scene.xml", "scenes/cornell.xml", "scenes/cornell_spheres.xml"])]
    scenes: Vec<PathBuf>,
}

/// Seconds of a turn.
const TURN: f64 = 0.25;

/// Beyond the first paths of the sequence, which do not split.
const FIRST: u64 = 1 << 20;

/// Measures the scenes one after the other.
pub fn run(arguments: &Arguments) -> Outcome {
    println!(
        "Time of a path with textures over that of one with their mean colours, {} pairs of turns",
        arguments.turns
    );
    for file in &arguments.scenes {
        let mut textured = load(file, &[])?.desc;
        let has =
            decide(&textured, textured.integrator.kind).iter().any(|d| d.on && d.effect == Effect::Textures);
        if !has {
            put_pictures(&mut textured, arguments);
        }
        let mut plain = textured.clone();
        without(&mut plain, Effect::Textures)?;
        Spectrum::prepare_textures();
        let tracers = [tracer(&textured)?, tracer(&plain)?];
        let mut next = FIRST;
        let mut turn = |tracer: &PathTracer| {
            let (start, first) = (thread_seconds(), next);
            while thread_seconds() - start < TURN {
                (0..32).for_each(|i| tracer.trace(next + i, &mut (), &mut Nowhere));
                next += 32;
            }
            (thread_seconds() - start) / (next - first) as f64
        };
        for tracer in &tracers {
            turn(tracer);
        }
        let ratios: Vec<f64> = (0..arguments.turns)
            .map(|i| {
                // Each goes first in half of the pairs.
                let mut seconds = [0.0; 2];
                for k in [i % 2, 1 - i % 2] {
                    seconds[k] = turn(&tracers[k]);
                }
                (seconds[0] / seconds[1]).ln()
            })
            .collect();
        let n = ratios.len() as f64;
        let mean = ratios.iter().sum::<f64>() / n;
        let error = (ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
        let what = if has { "its own textures" } else { "pictures on every colour" };
        println!("  {}, {what}: {:.3} ± {:.3}", file.display(), mean.exp(), mean.exp() * error);
    }
    Ok(())
}

fn tracer(desc: &SceneDesc) -> Outcome<PathTracer> {
    let scene = Arc::new(Scene::prepare(desc)?);
    let context = RenderContext::new(scene, Camera::of(desc)?, &desc.integrator, 0, UvWindow::PICTURE);
    Ok(PathTracer { context })
}

/// Gives every diffuse material a picture of its own, noise around its colour.
fn put_pictures(desc: &mut SceneDesc, arguments: &Arguments) {
    let (mut random, side) = (Random(1), arguments.side);
    for bsdf in &mut desc.bsdfs {
        let BsdfDesc::Diffuse(bsdf) = bsdf else { continue };
        let Some(color) = bsdf.reflectance.uniform().map(Spectrum::reflected_rgb) else { continue };
        let mut texel = || color.map(|v| (v * (0.5 + random.f32())).clamp(0.0, 1.0));
        let bitmap = if arguments.floats {
            Bitmap::from_linear(side, (0..side * side).map(|_| texel()).collect())
        } else {
            let texels = (0..side * side).map(|_| texel().map(srgb::encode_8bit));
            Bitmap::of_eight_bits(side, texels.collect(), false)
        };
        bsdf.reflectance = SpectrumTexture::Bitmap(BitmapTexture::repeated(bitmap));
    }
}
