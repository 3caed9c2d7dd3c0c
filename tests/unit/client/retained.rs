//! Tests of `client::retained`.

use pointillist::client::retained::*;
use pointillist::color::Xyz;
use pointillist::stream::block::{BLOCK_SAMPLES, Block};
use pointillist::stream::control::Epoch;
use pointillist::stream::{
    BlockEyes, BlockSink, CHUNK, DrainOrder, LANE_BLOCKS, PathCounts, Sample, SampleSink, UvWindow, lanes,
};

fn block(samples: usize, first: u64) -> Block {
    let mut block = Block::default();
    block.restart(Epoch(1), first);
    block.header.paths = PathCounts { camera: samples as u64, light: 0 };
    for i in 0..samples {
        assert!(block.push(Sample { uv: [0.0, (first + i as u64) as f32], w: 1.0, ..Sample::default() }));
    }
    block
}

fn all(store: &mut RetainedSamples) -> (Vec<f32>, u64) {
    let (mut seen, mut paths) = (Vec::new(), 0);
    while let Some(([samples, _], first_index, counts)) = store.feed() {
        assert!(samples.first().is_none_or(|s| s.uv[1] == first_index as f32));
        seen.extend(samples.iter().map(|s| s.uv[1]));
        paths += counts.camera;
    }
    (seen, paths)
}

#[test]
fn a_new_film_gets_everything_in_order() {
    let mut store = RetainedSamples::with_room(8 * BLOCK_SAMPLES, 100);
    for i in 0..5 {
        assert!(store.push(&block(3, 3 * i)));
    }
    assert!(store.caught_up() && store.feed().is_none());
    store.rewind();
    assert!(store.feed().is_some_and(|([samples, _], ..)| samples.len() == 3));
    // While the new film is behind, blocks queue up.
    assert!(store.push_for_later(&block(2, 15)));
    let (seen, paths) = all(&mut store);
    assert_eq!(seen, (3..17).map(|i| i as f32).collect::<Vec<_>>());
    assert_eq!(paths, 14);
    assert!(store.push(&block(1, 17)) && store.caught_up());
}

#[test]
fn the_store_is_bounded_and_has_no_gap() {
    let mut store = RetainedSamples::with_room(2 * BLOCK_SAMPLES, 100);
    assert!(store.push(&block(BLOCK_SAMPLES, 0)) && store.push(&block(10, 1024)));
    assert!(store.complete() && !store.has_room() && !store.push(&block(BLOCK_SAMPLES, 1034)));
    // A small one would fit, but not without a gap.
    assert!(!store.push(&block(1, 5000)) && !store.complete());
    store.rewind();
    assert_eq!(all(&mut store).1, 1034);
    store.clear();
    assert!(store.complete() && store.is_empty() && store.caught_up() && store.push(&block(5, 0)));
    // Blocks are bounded too.
    let mut store = RetainedSamples::with_room(1 << 20, 3);
    assert_eq!((0..10).filter(|&i| store.push(&block(1, i))).count(), 3);
}

/// Half of the room is taken by samples, or by blocks with few of them; a film that has its samples from elsewhere is fed nothing.
#[test]
fn room_is_counted_in_samples_and_blocks() {
    let mut store = RetainedSamples::with_room(4 * BLOCK_SAMPLES, 100);
    assert!(store.push(&block(BLOCK_SAMPLES, 0)) && store.push(&block(BLOCK_SAMPLES, 1024)));
    assert!(!store.is_half_full() && store.push(&block(1, 2048)) && store.is_half_full());
    let mut store = RetainedSamples::with_room(4 * BLOCK_SAMPLES, 6);
    assert!((0..3).all(|i| store.push(&block(1, i))) && !store.is_half_full());
    assert!(store.push(&block(1, 3)) && store.is_half_full());
    store.rewind();
    assert!(!store.caught_up());
    store.skip();
    assert!(store.caught_up() && store.feed().is_none());
}

/// A film of two eyes gets the samples of each, also where the blocks of the other eye's chunk carry them.
#[test]
fn samples_of_both_eyes_are_kept() {
    let (mut writers, mut lanes) = lanes(1, LANE_BLOCKS);
    lanes.hub().run(Some(Epoch(1)));
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    let mut sink = BlockSink::new(writers.remove(0));
    sink.start(Epoch(1), UvWindow::PICTURE);
    // The chunk of the left eye, and that of the right.
    for (index, own, other) in [(0, 0.25, 0.75), (CHUNK, 0.5, 0.125)] {
        sink.begin_chunk(index);
        sink.begin_path(index);
        sink.camera([own, 0.5], Xyz::new(1.0, 1.0, 1.0), 1.0);
        sink.camera_of_other_eye([other, 0.5], Xyz::new(1.0, 1.0, 1.0), 1.0);
        sink.end_path(PathCounts { camera: 1, light: 0 });
        sink.flush();
    }
    let mut store = RetainedSamples::with_room(8 * BLOCK_SAMPLES, 100);
    store.begin(BlockEyes::Both { replicated: false });
    lanes.drain(usize::MAX, |block| assert!(store.push(block)));
    assert_eq!(store.len(), 2, "as many as the left eye has");
    store.rewind();
    let mut seen = [Vec::new(), Vec::new()];
    while let Some((eyes, ..)) = store.feed() {
        for (seen, samples) in seen.iter_mut().zip(eyes) {
            seen.extend(samples.iter().map(|sample| sample.uv[0]));
        }
    }
    assert_eq!(seen, [vec![0.25, 0.125], vec![0.75, 0.5]]);
    store.begin(BlockEyes::One);
    assert!(store.is_empty() && store.push(&block(3, 1024)) && store.len() == 3);
}
