//! The samples of a range do not depend on threads; in order they are one sequence.

use crate::support::synthetic::{Gathered, Out, gather_in, render_all, synthetic, varied};
use pointillist::color::Xyz;
use pointillist::server::{CHUNK, RenderJob, Server};
use pointillist::stream::{BLOCK_SAMPLES, BlockSink, DrainOrder, Epoch, FinishReason, UvWindow, lanes};

const START: u64 = 777;
const END: u64 = 60_001;

/// The reference: one loop, no server.
fn expected() -> Gathered {
    let (mut writers, mut lanes) = lanes(1, 1024);
    lanes.hub().run(Some(Epoch(1)));
    let mut sink = BlockSink::new(writers.remove(0));
    sink.start(Epoch(1), UvWindow::PICTURE);
    for index in START..END {
        sink.begin_path(index);
        varied(index, &mut sink);
        sink.end_path(Default::default());
    }
    sink.flush();
    let mut gathered = Gathered::default();
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    lanes.drain(usize::MAX, |block| gathered.take(block));
    gathered
}

#[test]
fn any_thread_count_gives_the_same_multiset_and_counts() {
    let expected = expected();
    for threads in [1, 2, 7] {
        let (got, reason) = render_all(threads, RenderJob::new(synthetic(varied), START..END));
        assert_eq!(reason, FinishReason::Complete);
        assert_eq!(got.indices(), END - START, "{threads} threads");
        assert_eq!((got.paths().camera, got.paths().light), (END - START, 2 * (END - START)));
        assert!(got.multiset() == expected.multiset(), "{threads} threads");
    }
}

#[test]
fn ordered_draining_gives_one_sequence_and_full_blocks_only_one_set_of_blocks() {
    let expected = expected().sequence();
    let mut first_blocks = None;
    for (threads, deadline) in [(1, None), (2, None), (7, None), (3, Some(std::time::Duration::ZERO))] {
        let (server, mut lanes) = Server::start(threads).expect("threads");
        let job = RenderJob { deadline, ..RenderJob::new(synthetic(varied), START..END) };
        server.render(job, Epoch(4)).expect("first epoch");
        let order = DrainOrder::Index { first: START };
        let (got, reason) = gather_in(order, &server, &mut lanes, Epoch(4));
        assert_eq!((reason, lanes.next_index()), (FinishReason::Complete, END));
        assert!(got.sequence() == expected, "{threads} threads, {deadline:?}");
        if deadline.is_none() {
            let blocks: Vec<_> = got.blocks.iter().map(|b| (b.first_index, b.index_count)).collect();
            assert_eq!(&blocks, first_blocks.get_or_insert(blocks.clone()), "{threads} threads");
        } else {
            assert!(got.blocks.len() > 1000, "a deadline of zero sends small blocks");
        }
    }
}

/// The case the merge is there for: without it, two threads give another order.
#[test]
fn unordered_draining_is_not_in_order() {
    let uneven = |index: u64, out: &mut dyn Out| {
        if index / CHUNK == 0 {
            std::thread::sleep(std::time::Duration::from_micros(300));
        }
        varied(index, out);
    };
    let (got, _) = render_all(2, RenderJob::new(synthetic(uneven), START..END));
    assert!(got.sequence() != expected().sequence());
}

#[test]
fn blocks_stay_within_chunks_and_within_their_capacity() {
    let (got, _) = render_all(3, RenderJob::new(synthetic(varied), START..END));
    for (block, &len) in got.blocks.iter().zip(&got.lens) {
        assert!(len <= BLOCK_SAMPLES);
        if block.index_count > 0 {
            assert_eq!(block.first_index / CHUNK, (block.first_index + block.index_count - 1) / CHUNK);
        }
    }
}

/// A path with more samples than a block holds goes out in pieces and is counted once.
#[test]
fn a_path_longer_than_a_block_arrives_whole() {
    const PER_PATH: usize = 2 * BLOCK_SAMPLES + 500;
    let long = |index: u64, out: &mut dyn Out| {
        for i in 0..PER_PATH {
            out.light([0.5, 0.5], Xyz::new(index as f32, i as f32, 0.0));
        }
    };
    let (server, mut lanes) = Server::start(3).expect("threads");
    for (epoch, ordered) in [(Epoch(1), true), (Epoch(2), false)] {
        server.render(RenderJob::new(synthetic(long), 0..5000), epoch).expect("newer");
        let order = if ordered { DrainOrder::Index { first: 0 } } else { DrainOrder::Arrival };
        let (got, reason) = gather_in(order, &server, &mut lanes, epoch);
        assert_eq!(
            (reason, got.indices(), got.samples.len()),
            (FinishReason::Complete, 5000, 5000 * PER_PATH)
        );
        assert!(got.lens.iter().all(|&len| len > 0));
        if ordered {
            let in_order =
                got.samples.iter().enumerate().all(|(n, sample)| {
                    sample.xyz == Xyz::new((n / PER_PATH) as f32, (n % PER_PATH) as f32, 0.0)
                });
            assert!(in_order);
        }
    }
}

/// A range leased out in pieces, one of them twice because its first holder was stopped, gives the same samples.
#[test]
fn leases_and_a_lease_issued_again_give_the_same_samples() {
    let render = |range| render_all(2, RenderJob::new(synthetic(sampled), range)).0;
    let whole = render(0..8192).multiset();
    let (server, lanes) = Server::start(2).expect("threads");
    server.render(RenderJob::new(synthetic(sampled), 4096..8192), Epoch(1)).expect("first epoch");
    drop((lanes, server)); // the holder dies
    let mut pieces = [render(4096..8192).multiset(), render(0..4096).multiset()].concat();
    pieces.sort_unstable();
    assert!(pieces == whole);
}

/// One sample at the sequence's screen position.
fn sampled(index: u64, out: &mut dyn Out) {
    let sampler = pointillist::tracer::Sampler::at(index, 3);
    let vertex = sampler.vertex(2);
    let uv = sampler.camera().screen.map(|u| u as f32);
    out.camera(uv, Xyz::new(vertex.light[0], vertex.bsdf[0], vertex.roulette), 1.0);
}
