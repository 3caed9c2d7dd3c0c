//! What the constants of the costs in `src/tracer/choice/cost.rs` are fitted to: the events that are recorded on a path of each method, and
//! the processor time of a path on one thread, traced without recording.

use std::path::PathBuf;
use std::sync::Arc;

use pointillist::scene::desc::{IntegratorKind, PhotonUse};
use pointillist::stream::UvWindow;
use pointillist::tracer::choice::EventCounts;
use pointillist::tracer::integrator::{IntegratorVisitor, RenderContext, visit};
use pointillist::tracer::{Camera, Integrator, PrepareOptions, Scene};

use super::common::{Nowhere, Outcome, thread_seconds};

/// Paths that are left out at the beginning, where path tracing does not split yet.
const FIRST: u64 = 1 << 16;

/// Processor time of each method.
const SECONDS: f64 = 1.5;

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scene files
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// Width and height of the picture
    #[arg(long, num_args = 2, default_values_t = [256, 256])]
    size: Vec<u32>,
}

/// Prints one line of JSON for each scene and method.
pub fn run(arguments: &Arguments) -> Outcome {
    let [width, height] = *arguments.size else { return Err("--size wants two numbers".into()) };
    for path in &arguments.scenes {
        let desc = pointillist::scene::load(path, &[])?.desc;
        let camera =
            Camera::new(&desc.camera, &desc.film, &PrepareOptions { width, height })?.placed(&desc.space);
        let scene = Arc::new(Scene::prepare(&desc)?);
        let context = RenderContext::new(scene, camera, &desc.integrator, 0, UvWindow::PICTURE);
        // The costs of those with photons are factors on the others'.
        for kind in IntegratorKind::candidates().filter(|kind| kind.traits().photons == PhotonUse::None) {
            let counts = EventCounts::of(&context, kind);
            let seconds = visit(kind, Timed { context: context.clone().of_size([width, height]) });
            println!(
                "{}",
                serde_json::json!({
                    "scene": path,
                    "method": kind.name(),
                    "begun": counts.begun,
                    "vertices": counts.vertices,
                    "sampled": counts.sampled,
                    "evaluated": counts.evaluated,
                    "light_samples": counts.light_samples,
                    "to_camera": counts.to_camera,
                    "connections": counts.connections,
                    "microseconds": seconds * 1e6,
                })
            );
        }
    }
    Ok(())
}

/// Times the paths of a method.
struct Timed {
    context: RenderContext,
}

impl IntegratorVisitor for Timed {
    type Output = f64;

    /// Seconds per path: from the camera, where there are such.
    fn visit<I: Integrator + From<RenderContext>>(self) -> f64 {
        let integrator = I::from(self.context);
        let counts = integrator.paths_per_index();
        let (mut scratch, mut indices) = (I::Scratch::default(), 0);
        let mut trace = |count: u64| {
            (0..count).for_each(|_| {
                integrator.trace(FIRST + indices, &mut scratch, &mut Nowhere);
                indices += 1;
            });
        };
        trace(1000);
        let start = thread_seconds();
        while thread_seconds() - start < SECONDS {
            trace(1000);
        }
        let seconds = thread_seconds() - start;
        seconds
            / (indices - 1000) as f64
            / if counts.camera > 0 { counts.camera } else { counts.light } as f64
    }
}
