//! The parts of a camera path of path tracing: vertices, light samples and occluded ones per path, counted from recorded paths; and the processor time of
//! a path on one thread, traced without recording. Quotients of these are the cost per vertex, which other renderers can be compared by.

use std::path::PathBuf;
use std::sync::Arc;

use pointillist::stream::UvWindow;
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::record::{PathEvent, recorded};
use pointillist::tracer::{Camera, Integrator, PathTracer, PrepareOptions, Scene};

use super::common::{Nowhere, Outcome, thread_seconds};

/// Paths that are left out at the beginning, where path tracing does not split yet.
const FIRST: u64 = 1 << 16;

/// What to count.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scene file
    scene: PathBuf,
    /// Width and height of the picture
    #[arg(long, num_args = 2, default_values_t = [256, 256])]
    size: Vec<u32>,
    /// Paths that are recorded
    #[arg(long, default_value_t = 100_000)]
    recorded: u64,
    /// Paths that are timed
    #[arg(long, default_value_t = 1_000_000)]
    timed: u64,
}

/// Prints the counts as JSON.
pub fn run(arguments: &Arguments) -> Outcome {
    let [width, height] = *arguments.size else { return Err("--size wants two numbers".into()) };
    let desc = pointillist::scene::load(&arguments.scene, &[])?.desc;
    let camera =
        Camera::new(&desc.camera, &desc.film, &PrepareOptions { width, height })?.placed(&desc.space);
    let scene = Scene::prepare(&desc)?;
    let tracer = |scene: Scene| {
        let context =
            RenderContext::new(Arc::new(scene), camera.clone(), &desc.integrator, 0, UvWindow::PICTURE);
        PathTracer { context: context.of_size([width, height]) }
    };
    let (mut vertices, mut light_samples, mut occluded) = (0u64, 0u64, 0u64);
    let recording = tracer(scene.clone().recorded());
    for index in FIRST..FIRST + arguments.recorded {
        for event in recorded(|| recording.trace(index, &mut (), &mut Nowhere)) {
            match event {
                PathEvent::Meets(..) => vertices += 1,
                PathEvent::Light { visible, .. } => {
                    light_samples += 1;
                    occluded += u64::from(visible == 0.0);
                }
                _ => {}
            }
        }
    }
    let plain = tracer(scene);
    let start = thread_seconds();
    (FIRST..FIRST + arguments.timed).for_each(|index| plain.trace(index, &mut (), &mut Nowhere));
    let seconds = (thread_seconds() - start) / arguments.timed as f64;
    let per_path = |count: u64| count as f64 / arguments.recorded as f64;
    println!(
        "{}",
        serde_json::json!({
            "vertices": per_path(vertices),
            "light_samples": per_path(light_samples),
            "occluded": per_path(occluded),
            "seconds": seconds,
        })
    );
    Ok(())
}
