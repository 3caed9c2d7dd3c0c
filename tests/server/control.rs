//! Commands, events and everything that may go wrong while a render runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::support::synthetic::{Out, finish_of, flat, gather, render_all, synthetic};
use pointillist::color::Xyz;
use pointillist::server::{RenderJob, Server, ServerError};
use pointillist::stream::{Cause, DrainOrder, Epoch, Fault, FaultyValue, FinishReason, MAX_VALUE, Sample};

#[test]
fn abort_takes_at_most_one_path_per_worker() {
    const THREADS: usize = 3;
    let started = Arc::new(AtomicU64::new(0));
    let counter = started.clone();
    let slow = synthetic(move |_, out: &mut dyn Out| {
        counter.fetch_add(1, Ordering::SeqCst);
        std::thread::sleep(Duration::from_millis(2));
        out.camera([0.5; 2], Xyz::BLACK, 1.0);
    });
    let (server, mut lanes) = Server::start(THREADS).expect("threads");
    server.render(RenderJob::new(slow, 0..u64::MAX), Epoch(1)).expect("first epoch");
    while started.load(Ordering::SeqCst) < 20 {
        lanes.wait(Duration::from_millis(1));
    }
    server.abort();
    let at_abort = started.load(Ordering::SeqCst);
    let (got, reason) = gather(&server, &mut lanes, Epoch(1));
    // A worker may have passed its check just before the abort: one more path each.
    let total = started.load(Ordering::SeqCst);
    assert!(total <= at_abort + THREADS as u64, "{} paths after the abort", total - at_abort);
    assert_eq!(reason, FinishReason::Aborted);
    // The begun blocks are sent: nothing that was traced is lost, so the picture so far can be finished.
    assert_eq!((got.indices(), got.samples.len() as u64), (total, total));
    assert_eq!(server.stats().total().paths, total);
}

/// Every path is older than the deadline when it ends, so each is sent at once.
#[test]
fn slow_paths_are_sent_one_by_one_and_a_sudden_slowdown_is_noticed() {
    let slow = synthetic(|_, out: &mut dyn Out| {
        std::thread::sleep(Duration::from_millis(50));
        out.camera([0.5; 2], Xyz::BLACK, 1.0);
    });
    let (got, _) = render_all(1, RenderJob::new(slow, 0..12));
    assert!(got.blocks.iter().all(|block| block.index_count == 1), "{:?}", got.lens);

    let suddenly = synthetic(|index, out: &mut dyn Out| {
        if index >= 900 {
            std::thread::sleep(Duration::from_millis(10));
        }
        out.camera([0.5; 2], Xyz::BLACK, 1.0);
    });
    let (got, _) = render_all(1, RenderJob::new(suddenly, 0..940));
    let late = got.blocks.iter().filter(|block| block.first_index >= 900).map(|block| block.index_count);
    let slow_alone = late.filter(|&count| count == 1).count();
    assert!(slow_alone >= 40 - 16 - 1, "only {slow_alone} slow paths were sent alone");
}

#[test]
fn bad_samples_are_kept_out_and_counted_with_their_index() {
    let bad = synthetic(|index, out: &mut dyn Out| {
        let one = Xyz::new(1.0, 1.0, 1.0);
        match index {
            5 => out.camera([f32::NAN, 0.5], one, 1.0),
            7 => out.camera([0.5, f32::INFINITY], one, 1.0),
            11 => out.camera([0.5; 2], Xyz::new(1.0, f32::NAN, 1.0), 1.0),
            13 => out.camera([0.5; 2], one, f32::NAN),
            17 => out.camera([0.5; 2], one, 0.0),
            19 => out.camera([0.5; 2], one, -1.0),
            23 => out.camera([0.5; 2], one * 1e30, 1e30),
            29 => out.camera([1.1, 0.5], one, 1.0),
            31 => out.light([0.5, -0.01], one),
            37 => out.light([0.5; 2], Xyz::new(0.0, 0.0, f32::NEG_INFINITY)),
            41 => out.camera([0.5; 2], one, -0.0),
            // Finite, but their sums would not be.
            43 => out.camera([0.5; 2], one * 1e32, 1.0),
            47 => out.light([0.5; 2], Xyz::new(0.0, -2.0 * MAX_VALUE, 0.0)),
            53 => out.camera([0.5; 2], Xyz::BLACK, 1e32),
            59 => out.camera([1.0, 0.0], one * 2.0f32.powi(-100), MAX_VALUE),
            _ => out.camera([1.0, 0.0], one, 2.0),
        }
    });
    let (server, mut lanes) = Server::start(2).expect("threads");
    server.render(RenderJob::new(bad, 0..5000), Epoch(1)).expect("first epoch");
    let (got, _) = gather(&server, &mut lanes, Epoch(1));
    assert_eq!((got.samples.len(), got.indices()), (5000 - 14, 5000));
    let normal = |s: &Sample| s.w == 2.0 && s.xyz == Xyz::new(2.0, 2.0, 2.0);
    let largest = |s: &Sample| s.w == MAX_VALUE && s.xyz == Xyz::new(1.0, 1.0, 1.0);
    assert!(got.samples.iter().all(|s| normal(s) || largest(s)));
    assert_eq!(got.samples.iter().filter(|s| largest(s)).count(), 1);
    // The client takes all that the stream lets in.
    assert!(got.samples.iter().all(pointillist::client::filter::accepts));
    let rejections = server.stats().total().rejections;
    assert_eq!(Cause::ALL.map(|cause| rejections.count(cause)), [3, 3, 4, 2, 2]);
    let indices: Vec<u64> = rejections.examples().iter().map(|example| example.index).collect();
    assert_eq!(indices, [5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53]);
    let Fault { cause, part, .. } = rejections.examples()[1].fault;
    assert_eq!((cause, part), (Cause::Infinite, FaultyValue::Position));
    // A client that knows no server knows how many.
    assert_eq!(got.blocks.iter().map(|block| block.rejected).sum::<u64>(), rejections.samples());
}

#[test]
fn a_new_epoch_in_mid_frame_drops_what_is_stale() {
    let (server, mut lanes) = Server::start(2).expect("threads");
    for n in 1..=20 {
        let epoch = Epoch(n);
        server.render(RenderJob::new(synthetic(flat(n as f32)), 0..u64::MAX), epoch).expect("newer");
        lanes.follow(epoch, DrainOrder::Arrival);
        // One frame of this epoch, and blocks of it left behind in the lanes.
        let mut samples = 0;
        while samples < 3000 {
            lanes.wait(Duration::from_secs(60));
            samples += lanes
                .drain(4096, |block| {
                    assert!(block.samples().iter().all(|s| s.xyz.y == n as f32), "epoch {n}");
                })
                .samples;
        }
        while lanes.fill().blocks == 0 {
            lanes.wait(Duration::from_secs(60));
        }
    }
    assert!(lanes.stale_blocks() >= 19);
    server.term();
}

#[test]
fn a_client_that_never_drains_delays_neither_abort_nor_term_nor_the_next_render() {
    let (server, mut lanes) = Server::start(2).expect("threads");
    let endless = || RenderJob::new(synthetic(flat(1.0)), 0..u64::MAX);
    let until_full = |lanes: &pointillist::stream::Lanes| {
        while lanes.fill().blocks < lanes.fill().capacity {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    server.render(endless(), Epoch(1)).expect("first epoch");
    until_full(&lanes);
    server.abort();
    assert_eq!(finish_of(&server, Epoch(1)), FinishReason::Aborted);
    // What was sent before the abort is still there, and paths and samples agree.
    let mut counts = (0, 0);
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    while lanes
        .drain(1 << 20, |b| {
            counts = (counts.0 + b.header.index_count, counts.1 + b.samples().len() as u64);
        })
        .blocks
        > 0
    {}
    assert_eq!(counts.0, counts.1);
    assert_eq!(counts.1, server.stats().total().samples);

    server.render(endless(), Epoch(2)).expect("newer");
    until_full(&lanes);
    server.render(endless(), Epoch(3)).expect("newer");
    assert_eq!(finish_of(&server, Epoch(2)), FinishReason::Aborted);
    server.term();
    assert_eq!(finish_of(&server, Epoch(3)), FinishReason::Aborted);
    assert!(matches!(server.render(endless(), Epoch(4)), Err(ServerError::Terminated)));

    let (server, lanes) = Server::start(2).expect("threads");
    server.render(endless(), Epoch(1)).expect("first epoch");
    until_full(&lanes);
    drop(lanes);
    assert_eq!(finish_of(&server, Epoch(1)), FinishReason::Aborted);
    // Without a client there is nothing to trace for.
    server.render(endless(), Epoch(2)).expect("newer");
    assert_eq!(finish_of(&server, Epoch(2)), FinishReason::Aborted);
}

#[test]
fn a_panic_names_its_index_and_the_server_lives_on() {
    let fragile = synthetic(|index, out: &mut dyn Out| {
        out.camera([0.5; 2], Xyz::new(index as f32, 0.0, 0.0), 1.0);
        assert!(index != 2500, "degenerate triangle");
    });
    let (server, mut lanes) = Server::start(2).expect("threads");
    server.render(RenderJob::new(fragile, 0..u64::MAX), Epoch(1)).expect("first epoch");
    let (got, reason) = gather(&server, &mut lanes, Epoch(1));
    match reason {
        FinishReason::Panicked { index, message } => {
            assert_eq!(index, 2500);
            assert!(message.contains("degenerate triangle"), "{message}");
        }
        other => panic!("{other:?}"),
    }
    assert!(got.samples.iter().all(|s| s.xyz.x != 2500.0));
    assert_eq!(got.samples.len() as u64, got.indices());
    server.render(RenderJob::new(synthetic(flat(1.0)), 0..4000), Epoch(2)).expect("newer");
    let (got, reason) = gather(&server, &mut lanes, Epoch(2));
    assert_eq!((reason, got.samples.len()), (FinishReason::Complete, 4000));
}

#[test]
fn a_thousand_restarts_leave_nothing_behind() {
    let integrator = synthetic(flat(1.0));
    for n in 0..1000u64 {
        let (server, mut lanes) = Server::start(2).expect("threads");
        server.render(RenderJob::new(integrator.clone(), 0..u64::MAX), Epoch(1)).expect("first epoch");
        match n % 4 {
            0 => {
                lanes.follow(Epoch(1), DrainOrder::Arrival);
                lanes.wait(Duration::from_secs(60));
            }
            1 => server.abort(),
            2 => drop(lanes),
            _ => {}
        }
        drop(server);
        assert_eq!(Arc::strong_count(&integrator), 1, "restart {n}");
    }
    let (server, mut lanes) = Server::start(2).expect("threads");
    for n in 1..=1000 {
        server.render(RenderJob::new(integrator.clone(), n..n + 100 * (n % 7)), Epoch(n)).expect("newer");
        if n % 100 == 0 {
            let (got, reason) = gather(&server, &mut lanes, Epoch(n));
            assert_eq!((reason, got.indices()), (FinishReason::Complete, 100 * (n % 7)));
        }
    }
}

#[test]
fn misuse_is_answered_with_a_sentence() {
    // A Ctrl-C handler shares the server; the client's thread may own the lanes.
    fn shared<T: Send + Sync>(_: &T) {}
    fn sent<T: Send>(_: &T) {}
    assert!(matches!(Server::start(0).map(|_| ()), Err(ServerError::NoThreads)));
    let (server, mut lanes) = Server::start(1).expect("threads");
    shared(&server);
    sent(&lanes);
    server.render(RenderJob::new(synthetic(flat(1.0)), 0..10), Epoch(5)).expect("first epoch");
    let again = server.render(RenderJob::new(synthetic(flat(1.0)), 0..10), Epoch(5));
    assert!(matches!(&again, Err(ServerError::StaleEpoch { .. })), "{again:?}");
    assert!(again.expect_err("stale").to_string().contains("next()"));
    // An empty range finishes too.
    gather(&server, &mut lanes, Epoch(5));
    server.render(RenderJob::new(synthetic(flat(1.0)), 10..10), Epoch(6)).expect("newer");
    assert_eq!(gather(&server, &mut lanes, Epoch(6)).1, FinishReason::Complete);
}

#[test]
fn statistics_add_up() {
    let (server, mut lanes) = Server::start(2).expect("threads");
    server.render(RenderJob::new(synthetic(flat(1.0)), 0..100_000), Epoch(1)).expect("first epoch");
    gather(&server, &mut lanes, Epoch(1));
    let stats = server.stats();
    let total = stats.total();
    assert_eq!((stats.epoch, stats.workers.len()), (Epoch(1), 2));
    assert_eq!((total.paths, total.samples, total.discarded), (100_000, 100_000, 0));
    assert!(total.busy > Duration::ZERO);
}
