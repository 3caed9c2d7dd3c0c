//! One side of `tools/bench effects`: traces a scene for as long as it is asked to, again and again, on one thread.
//!
//! Reads a number of milliseconds per line and answers with the nanoseconds that an index took. Two builds that answer in turn have
//! the same weather.

use std::hint::black_box;
use std::io::{BufRead, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::color::Xyz;
use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::load;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{BidirectionalTracer, ParticleTracer, PathTracer, PhotonTracer, Setup};
use pointillist::tracer::{Camera, Integrator, Scene};

/// Indices between two looks at the clock.
const AT_ONCE: u64 = 32;

/// Beyond the first paths of the sequence, which do not split.
const FIRST: u64 = 1 << 20;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let usage = "usage: turns SCENE.xml [general]";
    let desc = load(arguments.next().ok_or(usage)?.as_ref(), &[])?.desc;
    let general = arguments.next().is_some();
    let scene = if general { Scene::prepare_general(&desc)? } else { Scene::prepare(&desc)? };
    let (scene, camera) = (Arc::new(scene), Camera::of(&desc)?);
    let setup = Setup::new(scene, camera, &desc.integrator, 0, UvWindow::PICTURE);
    match desc.integrator.kind {
        IntegratorKind::Path | IntegratorKind::Auto => answer(&PathTracer { setup }),
        IntegratorKind::Light => answer(&ParticleTracer { setup }),
        IntegratorKind::Bidirectional => answer(&BidirectionalTracer { setup }),
        IntegratorKind::Photon => answer(&PhotonTracer::new(setup, true)),
    }
}

fn answer<I: Integrator>(integrator: &I) -> Result<(), Box<dyn std::error::Error>> {
    let (mut next, mut scratch) = (FIRST, I::Scratch::default());
    for line in std::io::stdin().lock().lines() {
        let time = Duration::from_millis(line?.trim().parse()?);
        let (start, first) = (Instant::now(), next);
        while start.elapsed() < time {
            for _ in 0..AT_ONCE {
                integrator.trace(next, &mut scratch, &mut Nowhere);
                next += 1;
            }
        }
        println!("{}", start.elapsed().as_nanos() as f64 / (next - first) as f64);
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
