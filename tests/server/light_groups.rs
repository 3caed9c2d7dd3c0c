//! Groups of lights on the stream: their samples stand behind the picture's, group by group in the order of paths, and change nothing
//! of what a consumer without interest in them sees.

use std::time::Duration;

use pointillist::color::Xyz;
use pointillist::math::bits::mix;
use pointillist::stream::{
    BLOCK_SAMPLES, BlockSink, DrainOrder, Epoch, LaneWriter, Lanes, MAX_VALUE, PathCounts, Sample,
    SampleSink, UvWindow, lanes,
};

const GROUPS: usize = 3;
const PATHS: PathCounts = PathCounts { camera: 1, light: 1 };

fn part(index: u64, group: usize) -> Xyz {
    let value = |k: u64| (mix(index * 31 + group as u64 * 7 + k) >> 40) as f32;
    Xyz::new(value(0), value(1), value(2))
}

/// One camera sample, and light samples: none to many, more than a block holds on one path in a hundred.
fn trace(sink: &mut impl SampleSink, index: u64, grouped: bool) {
    let uv = [0.25, 0.5];
    let count = if index % 100 == 99 { 1500 } else { index % 4 };
    for number in 0..count {
        let group = ((index + number) % GROUPS as u64) as usize;
        match grouped {
            true => sink.light_of_group(uv, part(number, group), group as u8),
            false => sink.light(uv, part(number, group)),
        }
    }
    let parts: Vec<Xyz> = (0..GROUPS).map(|group| part(index, group)).collect();
    let sum = parts.iter().fold(Xyz::BLACK, |sum, part| sum + *part);
    match grouped {
        true => sink.camera_by_groups(uv, sum, 0.5, &parts),
        false => sink.camera(uv, sum, 0.5),
    }
}

/// Traces chunks of indices in turn on each writer.
fn produce(writers: Vec<LaneWriter>, chunks: u64, grouped: bool) {
    const CHUNK: u64 = 250;
    let next = std::sync::atomic::AtomicU64::new(0);
    let hub = writers[0].hub().clone();
    std::thread::scope(|scope| {
        for writer in writers {
            scope.spawn(|| {
                let mut sink = BlockSink::new(writer);
                sink.start(Epoch(1), UvWindow::PICTURE);
                loop {
                    let chunk = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                    if chunk >= chunks {
                        return;
                    }
                    sink.begin_chunk(chunk * CHUNK);
                    for index in chunk * CHUNK..(chunk + 1) * CHUNK {
                        sink.begin_path(index);
                        trace(&mut sink, index, grouped);
                        sink.end_path(PATHS);
                    }
                    assert!(sink.flush());
                }
            });
        }
    });
    hub.end(Epoch(1));
}

/// The samples of the picture and of each group in the order in which they come, and the paths.
#[derive(Default, PartialEq, Debug)]
struct Drained {
    picture: Vec<Sample>,
    groups: [Vec<Sample>; GROUPS],
    paths: PathCounts,
    indices: u64,
}

fn drain_all(lanes: &mut Lanes) -> Drained {
    let mut all = Drained::default();
    while !lanes.is_drained() {
        lanes.wait(Duration::from_millis(20));
        let done = lanes.drain(4 * BLOCK_SAMPLES, |block| {
            assert_eq!(block.header.first_index, all.indices, "in order of index");
            assert!(block.sample_count() <= BLOCK_SAMPLES);
            let in_groups: usize = block.groups().map(<[Sample]>::len).sum();
            assert_eq!(block.sample_count(), block.samples().len() + in_groups);
            all.picture.extend(block.samples());
            all.groups.iter_mut().zip(block.groups()).for_each(|(group, samples)| group.extend(samples));
            all.indices += block.header.index_count;
            all.paths.camera += block.header.paths.camera;
            all.paths.light += block.header.paths.light;
        });
        assert!(done.samples <= 4 * BLOCK_SAMPLES);
    }
    all
}

fn drained(threads: usize, grouped: bool) -> Drained {
    let (writers, mut lanes) = lanes(threads, 4);
    lanes.hub().run(Some(Epoch(1)));
    lanes.follow(Epoch(1), DrainOrder::Index { first: 0 });
    std::thread::scope(|scope| {
        scope.spawn(move || produce(writers, 20, grouped));
        drain_all(&mut lanes)
    })
}

#[test]
fn groups_change_nothing_of_the_picture_and_stand_behind_it_in_order() {
    let plain = drained(2, false);
    assert!(plain.groups.iter().all(Vec::is_empty));
    for threads in [1, 3] {
        let grouped = drained(threads, true);
        assert_eq!(
            (&grouped.picture, grouped.paths, grouped.indices),
            (&plain.picture, plain.paths, plain.indices)
        );
        // What each group must have, path by path.
        let mut expected = Drained::default();
        for sample in collect() {
            expected.groups[sample.0].push(sample.1);
        }
        assert_eq!(grouped.groups, expected.groups);
    }
}

/// All parts in the order of the paths.
fn collect() -> Vec<(usize, Sample)> {
    struct Parts(Vec<(usize, Sample)>);
    impl SampleSink for Parts {
        fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}
        fn light(&mut self, _: [f32; 2], _: Xyz) {}

        fn camera_by_groups(&mut self, uv: [f32; 2], _: Xyz, w: f32, parts: &[Xyz]) {
            self.0.extend(parts.iter().map(|part| Sample { uv, xyz: *part * w, w }).enumerate());
        }

        fn light_of_group(&mut self, uv: [f32; 2], xyz: Xyz, group: u8) {
            self.0.push((usize::from(group), Sample { uv, xyz, w: -1.0 }));
        }
    }
    let mut parts = Parts(Vec::new());
    (0..20 * 250).for_each(|index| trace(&mut parts, index, true));
    parts.0
}

/// A sample with a part that is no number is rejected with all its parts, and counted once; an abandoned path leaves none.
#[test]
fn samples_and_their_parts_are_sent_together_or_not_at_all() {
    let (mut writers, mut lanes) = lanes(1, 4);
    lanes.hub().run(Some(Epoch(1)));
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    let mut sink = BlockSink::new(writers.remove(0));
    sink.start(Epoch(1), UvWindow::PICTURE);
    let bad = [f32::NAN, -1.0, 2.0 * MAX_VALUE].map(|v| Xyz::new(v, 1.0, 1.0));
    for (index, wrong) in (0..).zip(bad) {
        sink.begin_path(index);
        sink.camera_by_groups([0.5; 2], Xyz::new(1.0, 1.0, 1.0), 1.0, &[Xyz::BLACK, wrong]);
        sink.camera_by_groups([2.0; 2], Xyz::BLACK, 1.0, &[Xyz::BLACK; 2]);
        sink.light_of_group([0.5; 2], wrong, 1);
        sink.end_path(PATHS);
    }
    trace_one(&mut sink, 3);
    sink.end_path(PATHS);
    trace_one(&mut sink, 4);
    sink.abandon_path();
    assert!(sink.flush());
    let totals = sink.totals().clone();
    let mut sent = Vec::new();
    lanes.drain(BLOCK_SAMPLES, |block| {
        assert_eq!((block.header.rejected, block.header.index_count), (9, 4));
        sent.extend(std::iter::once(block.samples().len()).chain(block.groups().map(<[Sample]>::len)));
    });
    assert_eq!(sent, [2, 1, 2], "one camera sample with two parts, one light sample of the second group");
    assert_eq!((totals.samples, totals.discarded, totals.rejections.samples()), (2, 2, 9));
}

fn trace_one(sink: &mut BlockSink, index: u64) {
    sink.begin_path(index);
    sink.camera_by_groups([0.5; 2], part(index, 0), 1.0, &[part(index, 0), Xyz::BLACK]);
    sink.light_of_group([0.5; 2], part(index, 1), 1);
}

#[test]
fn stale_samples_of_groups_are_counted() {
    let (mut writers, mut lanes) = lanes(1, 8);
    lanes.hub().run(Some(Epoch(1)));
    let mut sink = BlockSink::new(writers.remove(0));
    sink.start(Epoch(1), UvWindow::PICTURE);
    sink.begin_chunk(0);
    sink.begin_path(0);
    trace(&mut sink, 0, true);
    sink.end_path(PATHS);
    assert!(sink.flush());
    lanes.follow(Epoch(2), DrainOrder::Arrival);
    lanes.drain(1 << 20, |_| panic!("the block is stale"));
    assert_eq!((lanes.stale_blocks(), lanes.stale_samples()), (1, 1 + GROUPS as u64));
}
