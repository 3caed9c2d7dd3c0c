//! Renders that begin and end faster than the observer processes them.

use crate::accounting::accumulator::MOST;
use crate::accounting::observer::*;
use crate::color::Xyz;
use crate::stream::block::{BLOCK_SAMPLES, Block};
use crate::stream::control::Epoch;
use crate::study::ErrorQuantile;

/// A render of this many pixels.
fn render(width: u32, height: u32, target: Option<ErrorTarget>) -> ObservedRender {
    let (monitor, samples) =
        (ErrorMonitor::new([width, height], target), AccumulatedSamples::new([width, height], 1.0));
    ObservedRender { monitor, samples, log: Box::new(|_| ()) }
}

fn start(render: ObservedRender, target: Option<ErrorTarget>, policy: CheckpointPolicy) -> Observer {
    Observer::start(render, target, policy).expect("the threads")
}

/// Paths of a [`chunk`].
const CHUNK_PATHS: u64 = BLOCK_SAMPLES as u64;

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
    for policy in [CheckpointPolicy::WhenIdle, CheckpointPolicy::Exact] {
        let mut observer = start(render(64, 64, aim(0.01)), aim(0.01), policy);
        observer.begin(render(64, 64, aim(0.01)));
        (0..8).for_each(|i| give(&observer, &chunk(i)));
        observer.sync();
        assert!(observer.state().checkpoints.is_empty(), "two samples per pixel");
        for i in 8..64 {
            give(&observer, &chunk(i));
            // In a window, samples that arrive during an estimate make one checkpoint.
            observer.sync();
        }
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
        observer.begin(render(64, 64, aim(0.001)));
        assert!(observer.state().checkpoints.is_empty(), "of the new render nothing is known");
    }
}

/// The checkpoints of a render without a window are those of a monitor that looks at every block.
#[test]
fn exact_checkpoints_do_not_depend_on_timing() {
    let observer = start(render(64, 64, aim(0.01)), aim(0.01), CheckpointPolicy::Exact);
    let ObservedRender { mut monitor, mut samples, .. } = render(64, 64, aim(0.01));
    for i in 0..96 {
        let block = chunk(i);
        give(&observer, &block);
        samples.add(block.header.first_index, block.header.paths, block.samples());
        if samples.paths() as f64 >= monitor.due() {
            monitor.take_checkpoint(&samples, 0.0);
        }
    }
    observer.sync();
    let at = |status: &ErrorStatus| -> Vec<_> {
        status.checkpoints.iter().map(|checkpoint| (checkpoint.samples, checkpoint.error)).collect()
    };
    assert!(at(monitor.status()).len() > 5);
    assert_eq!(at(&observer.state()), at(monitor.status()));
}

/// A snapshot stays as it was while samples are added, and neither loses any.
#[test]
fn a_snapshot_does_not_change() {
    let observer = start(render(64, 64, None), None, CheckpointPolicy::WhenIdle);
    (0..8).for_each(|i| give(&observer, &chunk(i)));
    let before = observer.accumulated().expect("the thread is there");
    let pixel = before.replicates().pixel(5, 9);
    (8..16).for_each(|i| give(&observer, &chunk(i)));
    let after = observer.accumulated().expect("the thread is there");
    assert_eq!((before.paths(), after.paths()), (8 * CHUNK_PATHS, 16 * CHUNK_PATHS));
    assert_eq!(before.replicates().pixel(5, 9), pixel);
    let mut expected = AccumulatedSamples::new([64; 2], 1.0);
    for i in 0..16 {
        let block = chunk(i);
        expected.add(block.header.first_index, block.header.paths, block.samples());
    }
    for (x, y) in [(0, 0), (5, 9), (63, 63)] {
        assert_eq!(after.replicates().pixel(x, y), expected.replicates().pixel(x, y));
    }
}

#[test]
fn sixty_renders_in_a_second_leave_nothing_behind() {
    let large = || render(4096, 2160, aim(0.01));
    let mut observer = start(large(), aim(0.01), CheckpointPolicy::WhenIdle);
    let block = chunk(0);
    for _ in 0..60 {
        observer.begin(large());
        (0..40).for_each(|_| give(&observer, &block));
        assert!(observer.waiting() <= 40 * BLOCK_SAMPLES, "{}", observer.waiting());
        std::thread::sleep(Duration::from_millis(2));
    }
    // A render that lasts is observed from its first block on.
    observer.begin(render(16, 16, None));
    (0..8).for_each(|i| give(&observer, &chunk(i)));
    let (state, _) = observer.end();
    assert!((state.samples_per_pixel - 32.0).abs() < 1e-9 && observer.waiting() == 0);
}

#[test]
fn the_queue_is_bounded_and_loses_nothing() {
    for policy in [CheckpointPolicy::WhenIdle, CheckpointPolicy::Exact] {
        let mut observer = start(render(16, 16, None), None, policy);
        observer.begin(render(16, 16, None));
        let blocks = 3 * MOST / BLOCK_SAMPLES;
        for i in 0..blocks as u64 {
            give(&observer, &chunk(i % 2));
            assert!(observer.waiting() <= MOST);
        }
        let (state, _) = observer.end();
        assert_eq!(state.samples_per_pixel, (blocks * BLOCK_SAMPLES) as f64 / 256.0);
    }
}

/// A render that ends while others wait for its estimate leaves no thread behind.
#[test]
fn observers_that_read_each_other_end() {
    let (whole, part) = (render(64, 64, None), render(32, 32, None));
    let whole = start(whole, None, CheckpointPolicy::WhenIdle);
    let part = start(part, None, CheckpointPolicy::WhenIdle);
    (0..32).for_each(|i| give(&whole, &chunk(i)));
    whole.share_shown([8, 8], [32, 32], &part);
    part.share_own(&whole, [8, 8]);
    part.ask_for([8, 8], [32, 32], &whole, &part);
    drop(part);
    whole.sync();
    drop(whole);
}
