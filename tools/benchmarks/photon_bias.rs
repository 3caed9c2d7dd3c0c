//! Bias of photon mapping against the number of samples.
//!
//! Each picture (16×16 pixels, luminance) is the mean over independent seeds of n samples each. First a furnace, a closed box
//! that emits 1 and reflects half, whose radiance is 2 everywhere: all bias is that of its edges. Then scenes (the Cornell
//! box), against path tracing with many more samples. The bias of a pixel is what noise does not explain of the squared distance.

use glam::{DAffine3, DVec3};

use pointillist::image::compare::Measured;
use pointillist::scene::desc::{SceneDesc, ShapeKind};
use pointillist::stream::UvWindow;

use super::common::{Outcome, line};
use super::support::agreement::{Method, Plan, measure};
use super::support::scenes;

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Scenes of `scenes/`
    #[arg(default_value = "cornell.xml")]
    scenes: Vec<String>,
}

const SIDE: usize = 16;

/// Samples of a level in all, at least.
const BUDGET: u64 = 1 << 20;

/// Bias relative to the mean: of the whole picture, and root mean square over pixels, each with its standard error.
fn bias(found: &Measured, reference: &Measured) -> [(f64, f64); 2] {
    let n = found.mean.len() as f64;
    let mean = reference.mean.iter().sum::<f64>() / n;
    let variances: Vec<f64> = found.variance.iter().zip(&reference.variance).map(|(a, b)| a + b).collect();
    let off: Vec<f64> = found.mean.iter().zip(&reference.mean).map(|(a, b)| a - b).collect();
    let whole = (off.iter().sum::<f64>() / n / mean, variances.iter().sum::<f64>().sqrt() / n / mean);
    let square = off.iter().zip(&variances).map(|(d, v)| d * d - v).sum::<f64>() / n / (mean * mean);
    let spread = variances.iter().map(|v| 2.0 * v * v).sum::<f64>().sqrt() / n / (mean * mean);
    let root = square.max(0.0).sqrt();
    [whole, (root, spread / (2.0 * root.max(spread.sqrt())))]
}

const PLAN: Plan = Plan { side: SIDE, paths_per_pixel: 4096, seeds: 32, window: UvWindow::PICTURE };

fn curve(name: &str, desc: &SceneDesc, reference: &Measured) {
    println!("\n{name}: {SIDE}x{SIDE} pixels, luminance, relative to the mean");
    println!("    samples  seeds   bias of the mean        root mean square bias of a pixel");
    let mut points = Vec::new();
    for shift in [14, 16, 18, 20] {
        let samples = 1u64 << shift;
        let seeds = (BUDGET / samples).clamp(4, 64) as u32;
        let plan = Plan { paths_per_pixel: samples / (SIDE * SIDE) as u64, seeds, ..PLAN };
        let [whole, pixel] =
            bias(&measure(desc, Method::Photon, plan), reference).map(|(x, e)| (100.0 * x, 100.0 * e));
        println!(
            "{samples:11} {seeds:6} {:+10.4} % ± {:.4} % {:15.4} % ± {:.4} %",
            whole.0, whole.1, pixel.0, pixel.1,
        );
        if whole.0.abs() > 3.0 * whole.1 {
            points.push(((samples as f64).ln(), whole.0.abs().ln()));
        }
    }
    let (slope, _) = line(&points);
    println!(
        "  slope of the mean's bias over {} levels that stand out of the noise: {slope:.2}",
        points.len()
    );
}

fn furnace() {
    let mut desc = scenes::empty();
    desc.camera.perspective_mut().unwrap().fov = 70.0;
    let half = scenes::material(&mut desc, scenes::grey(0.5));
    let size = DAffine3::from_scale(DVec3::new(1.0, 1.5, 2.0));
    scenes::shape(&mut desc, ShapeKind::Cube, size, half, 1.0);
    desc.shapes[0].flip_normals = true;
    let (mean, variance) = (vec![2.0; SIDE * SIDE], vec![0.0; SIDE * SIDE]);
    curve("furnace", &desc, &Measured { width: SIDE, height: SIDE, mean, variance });
}

fn scene(name: &str) -> Outcome {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[])?.desc;
    (desc.film.width, desc.film.height) = (SIDE as u32, SIDE as u32);
    curve(name, &desc, &measure(&desc, Method::Path, PLAN));
    Ok(())
}

/// Measures the furnace and the scenes.
pub fn run(arguments: &Arguments) -> Outcome {
    furnace();
    arguments.scenes.iter().try_for_each(|name| scene(name))
}
