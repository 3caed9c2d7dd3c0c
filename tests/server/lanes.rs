//! Fan-in without a server: budgets, turns, stale blocks, order, sleeping and waking.

use std::time::Duration;

use pointillist::color::Xyz;
use pointillist::stream::{
    BLOCK_SAMPLES, Block, BlockSink, DrainOrder, Epoch, LaneWriter, PathCounts, SampleSink, UvWindow, lanes,
};

const FAR: Duration = Duration::from_secs(60);

/// Sends one block of `count` paths with one sample each.
fn send(writer: &mut LaneWriter, epoch: Epoch, first_index: u64, count: u64) -> bool {
    let mut block = Box::<Block>::default();
    block.restart(epoch, first_index);
    for index in first_index..first_index + count {
        let xyz = Xyz::new(index as f32, 0.0, 0.0);
        assert!(block.push(pointillist::stream::Sample { uv: [0.5; 2], xyz, w: 1.0 }));
    }
    block.header.index_count = count;
    writer.send(&mut block)
}

#[test]
fn lanes_take_turns_and_the_budget_is_never_exceeded() {
    let (mut writers, mut lanes) = lanes(3, 4);
    lanes.hub().run(Some(Epoch(1)));
    for (lane, writer) in writers.iter_mut().enumerate() {
        for n in 0..3 {
            assert!(send(writer, Epoch(1), 1000 * lane as u64 + 100 * n, 100));
        }
    }
    assert_eq!((lanes.fill().blocks, lanes.fill().capacity), (9, 12));
    let mut order = Vec::new();
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    let mut drain = |budget| {
        let done = lanes.drain(budget, |block| order.push(block.header.first_index));
        (done.blocks, done.samples)
    };
    assert_eq!(drain(99), (0, 0));
    assert_eq!(drain(450), (4, 400));
    assert_eq!(drain(BLOCK_SAMPLES), (5, 500));
    assert_eq!(drain(BLOCK_SAMPLES), (0, 0));
    assert_eq!(order, [0, 1000, 2000, 100, 1100, 2100, 200, 1200, 2200]);
}

#[test]
fn stale_blocks_are_dropped_and_newer_ones_wait() {
    let (mut writers, mut lanes) = lanes(2, 8);
    for (epoch, first) in [(1, 0), (2, 10), (2, 20), (3, 30)] {
        lanes.hub().run(Some(Epoch(epoch)));
        assert!(send(&mut writers[0], Epoch(epoch), first, 5));
    }
    let mut seen = Vec::new();
    lanes.follow(Epoch(2), DrainOrder::Arrival);
    let done = lanes.drain(1 << 20, |block| seen.push(block.header.first_index));
    assert_eq!((lanes.stale_blocks(), done.blocks), (1, 2));
    lanes.follow(Epoch(3), DrainOrder::Arrival);
    let done = lanes.drain(1 << 20, |block| seen.push(block.header.first_index));
    assert_eq!((lanes.stale_blocks(), done.blocks), (1, 1));
    assert_eq!(seen, [10, 20, 30]);
    // A writer of an older epoch is refused: its blocks would only be dropped.
    assert!(!send(&mut writers[1], Epoch(2), 40, 5));
}

/// Lanes of one block each, chunks claimed in turn, the worker of the expected chunk always last to come: the merge
/// neither stalls nor reorders.
#[test]
fn ordered_draining_with_the_smallest_lanes_does_not_stall() {
    const CHUNKS: u64 = 300;
    for threads in [1, 2, 5] {
        let (writers, mut lanes) = lanes(threads, 1);
        lanes.hub().run(Some(Epoch(1)));
        let next = std::sync::atomic::AtomicU64::new(0);
        std::thread::scope(|scope| {
            for mut writer in writers {
                let next = &next;
                scope.spawn(move || {
                    loop {
                        let chunk = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        if chunk >= CHUNKS {
                            return;
                        }
                        if chunk.is_multiple_of(7) {
                            std::thread::sleep(Duration::from_micros(300));
                        }
                        for part in 0..3 {
                            assert!(send(&mut writer, Epoch(1), 30 * chunk + 10 * part, 10));
                        }
                    }
                });
            }
            lanes.follow(Epoch(1), DrainOrder::Index { first: 0 });
            let mut values = Vec::new();
            while lanes.next_index() < 30 * CHUNKS {
                assert!(lanes.wait(FAR), "stalled at {}", lanes.next_index());
                lanes.drain(BLOCK_SAMPLES, |block| {
                    values.extend(block.samples().iter().map(|sample| sample.xyz.x as u64));
                });
            }
            assert!(values.iter().copied().eq(0..30 * CHUNKS));
        });
    }
}

#[test]
fn a_full_lane_parks_its_writer_until_space_or_the_end_of_the_epoch() {
    // The lane must be big enough to hold what comes before the pause.
    let (mut writers, mut lanes) = lanes(1, 2);
    lanes.hub().run(Some(Epoch(1)));
    let mut writer = writers.remove(0);
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    for n in 0..2 {
        assert!(send(&mut writer, Epoch(1), 10 * n, 10));
    }
    let worker = std::thread::spawn(move || {
        let sent = send(&mut writer, Epoch(1), 20, 10);
        (sent, writer)
    });
    std::thread::sleep(Duration::from_millis(20));
    assert!(!worker.is_finished());
    assert_eq!(lanes.drain(10, |_| {}).blocks, 1);
    let (sent, mut writer) = worker.join().expect("worker");
    assert!(sent && writer.parked() > Duration::ZERO);

    let hub = lanes.hub().clone();
    let worker = std::thread::spawn(move || send(&mut writer, Epoch(1), 30, 10));
    std::thread::sleep(Duration::from_millis(20));
    hub.run(None);
    assert!(!worker.join().expect("worker"), "stopped: the block is not sent");
    let mut indices = Vec::new();
    lanes.drain(1000, |block| indices.push(block.header.first_index));
    assert_eq!(indices, [10, 20]);
}

#[test]
fn a_client_sleeps_until_a_block_or_an_event_comes() {
    let (mut writers, mut lanes) = lanes(1, 2);
    lanes.hub().run(Some(Epoch(1)));
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    assert!(!lanes.wait(Duration::from_millis(1)), "nothing is there");
    let hub = lanes.hub().clone();
    std::thread::scope(|scope| {
        scope.spawn(|| send(&mut writers[0], Epoch(1), 0, 1));
        assert!(lanes.wait(FAR));
        lanes.drain(1000, |_| {});
        scope.spawn(move || hub.announce());
        assert!(lanes.wait(FAR));
    });
    assert!(!lanes.wait(Duration::ZERO), "an event counts once");
}

/// What a stopped render leaves of a path that needs several blocks: its count never goes out without its samples.
#[test]
fn a_path_cut_by_the_end_of_its_epoch_is_not_counted() {
    let (mut writers, mut lanes) = lanes(1, 2);
    lanes.hub().run(Some(Epoch(1)));
    let mut sink = BlockSink::new(writers.remove(0));
    sink.start(Epoch(1), UvWindow::PICTURE);
    sink.begin_chunk(0);
    sink.begin_path(0);
    sink.camera([0.5; 2], Xyz::BLACK, 1.0);
    sink.end_path(PathCounts { camera: 1, light: 1 });
    sink.begin_path(1);
    let hub = lanes.hub().clone();
    for n in 0..4 * BLOCK_SAMPLES {
        if n == 2 * BLOCK_SAMPLES {
            hub.run(None); // the lane is full by now
        }
        sink.light([0.5; 2], Xyz::BLACK);
    }
    sink.end_path(PathCounts { camera: 1, light: 1 });
    sink.flush();
    let (mut indices, mut paths) = (0, 0);
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    lanes.drain(1 << 20, |block| {
        indices += block.header.index_count;
        paths += block.header.paths.light;
    });
    assert_eq!((indices, paths), (1, 1));
    assert_eq!(lanes.fill().blocks, 0);
}

/// A render is drained once the producer has declared its end and no block of it is left, in any order; a gap that an
/// abort has left does not hold it up.
#[test]
fn a_render_is_drained_when_it_has_ended_and_nothing_is_left() {
    let (mut writers, mut lanes) = lanes(2, 8);
    let hub = lanes.hub().clone();
    for (epoch, order) in [(1, DrainOrder::Arrival), (2, DrainOrder::Index { first: 0 })] {
        hub.run(Some(Epoch(epoch)));
        lanes.follow(Epoch(epoch), order);
        assert!(!lanes.is_drained(), "not ended");
        for (lane, first) in [(1, 10), (0, 0), (0, 40)] {
            assert!(send(&mut writers[lane], Epoch(epoch), first, 10));
        }
        hub.end(Epoch(epoch));
        let expected = if order == DrainOrder::Arrival { 3 } else { 2 };
        let mut blocks = 0;
        while !lanes.is_drained() {
            assert!(lanes.wait(FAR));
            blocks += lanes.drain(10, |_| {}).blocks;
        }
        assert_eq!(blocks, expected);
    }
}
