//! Renders that begin and end faster than the observer processes them.

use std::path::PathBuf;

use crate::client::{FilmSpec, SplatFilter};
use crate::color::Xyz;
use crate::render::observer::*;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::{IntegratorKind, PhotonDesc};
use crate::stream::block::{BLOCK_SAMPLES, Block};
use crate::stream::control::Epoch;
use crate::study::ErrorQuantile;

fn run(width: u32, height: u32) -> RunSpec {
    RunSpec {
        scene: PathBuf::from("observer test.xml"),
        defines: Vec::new(),
        lenient: false,
        size: None,
        film: FilmSpec { width, height, filter: SplatFilter::Box, variance: None, sums: Default::default() },
        max_depth: None,
        rr_depth: 5,
        hide_emitters: false,
        integrator: IntegratorKind::Path,
        photons: PhotonDesc::default(),
        aovs: Vec::new(),
        auto: None,
        effects: Vec::new(),
        spp: 16,
        seed: 0,
        first_index: 0,
        deterministic: false,
        replicated: true,
        device: String::new(),
        adaptive: false,
        light_groups: None,
        reweighted: None,
    }
}

/// One chunk of noisy grey over the whole picture.
fn chunk(number: u64) -> Block {
    let mut block = Block::default();
    block.restart(Epoch(1), number * BLOCK_SAMPLES as u64);
    for i in 0..BLOCK_SAMPLES {
        let index = number * BLOCK_SAMPLES as u64 + i as u64;
        let turns = |by: f64| ((index as f64 + 0.5) * by).fract() as f32;
        let y = 0.5 + turns(0.569_840_290_998_053_3);
        let uv = [turns(0.754_877_666_246_692_8), turns(0.618_033_988_749_894_9)];
        assert!(block.push(Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }));
    }
    block.header.paths = PathCounts { camera: BLOCK_SAMPLES as u64, light: 0 };
    block
}

fn aim(error: f64) -> Option<ErrorTarget> {
    Some(ErrorTarget { error, at: ErrorQuantile::P95 })
}

/// Hands a block to the observer.
fn give(observer: &Observer, block: &Block) {
    observer.samples(block.header.first_index, block.header.paths, block.samples());
}

#[test]
fn the_error_is_known_after_four_samples_per_pixel_and_falls() {
    let mut observer = Observer::start(&run(64, 64), aim(0.01), Backpressure::LeaveOut).expect("a thread");
    observer.begin(&run(64, 64), None);
    (0..8).for_each(|i| give(&observer, &chunk(i)));
    observer.sync();
    assert!(observer.state().checkpoints.is_empty(), "two samples per pixel");
    (8..64).for_each(|i| give(&observer, &chunk(i)));
    observer.sync();
    let state = observer.state();
    let checkpoints = &state.checkpoints;
    assert!(
        checkpoints.len() >= 5 && checkpoints[checkpoints.len() - 1].error < checkpoints[0].error,
        "{checkpoints:?}"
    );
    // Another target is answered without another checkpoint.
    let before = state.prediction.map(|said| said.target);
    observer.set_target(aim(0.001));
    observer.sync();
    let after = observer.state();
    assert_eq!((before, after.checkpoints.len()), (Some(0.01), checkpoints.len()));
    assert_eq!(after.prediction.map(|said| said.target), Some(0.001));
    observer.begin(&run(64, 64), None);
    assert!(observer.state().checkpoints.is_empty(), "of the new render nothing is known");
}

#[test]
fn sixty_renders_in_a_second_leave_nothing_behind() {
    let large = run(4096, 2160);
    let mut observer = Observer::start(&large, aim(0.01), Backpressure::LeaveOut).expect("a thread");
    let block = chunk(0);
    for _ in 0..60 {
        observer.begin(&large, None);
        (0..40).for_each(|_| give(&observer, &block));
        assert!(observer.waiting() <= 40 * BLOCK_SAMPLES, "{}", observer.waiting());
        std::thread::sleep(Duration::from_millis(2));
    }
    // A render that lasts is observed from its first block on.
    observer.begin(&run(16, 16), None);
    (0..8).for_each(|i| give(&observer, &chunk(i)));
    let (state, _) = observer.end();
    assert!((state.samples_per_pixel - 32.0).abs() < 1e-9 && observer.waiting() == 0);
}

#[test]
fn what_waits_is_bounded() {
    let small = run(16, 16);
    let mut observer = Observer::start(&small, None, Backpressure::LeaveOut).expect("a thread");
    observer.begin(&small, None);
    let blocks = 3 * MOST / BLOCK_SAMPLES;
    for i in 0..blocks as u64 {
        give(&observer, &chunk(i % 2));
        assert!(observer.waiting() <= MOST);
    }
    observer.end();
    // With [`Backpressure::Wait`] no block is dropped.
    let observer = Observer::start(&small, None, Backpressure::Wait).expect("a thread");
    (0..blocks as u64).for_each(|i| give(&observer, &chunk(i % 2)));
    let (state, _) = observer.end();
    assert_eq!(state.samples_per_pixel, (blocks * BLOCK_SAMPLES) as f64 / 256.0);
}
