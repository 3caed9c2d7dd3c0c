//! A tracer that stands still, is slow, goes away or talks nonsense: the others go on, and the viewer says which one is ill.

use std::time::{Duration, Instant};

use pointillist::remote::Health;

use crate::host::{FakeViewer, Served, address};
use crate::support::proxy::{Proxy, Weather};

/// A viewer with two tracers, the first of them behind a proxy.
fn two() -> (FakeViewer, Proxy, [Served; 2]) {
    two_with(None)
}

fn two_with(token: Option<&str>) -> (FakeViewer, Proxy, [Served; 2]) {
    let served = [Served::start(token), Served::start(token)];
    let proxy = Proxy::start(&served[0].address);
    let mut viewer = FakeViewer::of(vec![address(&proxy.address, token), address(&served[1].address, token)]);
    viewer.render(None);
    viewer.hears(0, Health::Well, "threads");
    viewer.hears(1, Health::Well, "threads");
    viewer.receive(100_000);
    (viewer, proxy, served)
}

/// Edits reach the other tracer meanwhile, and its samples come.
fn the_other_goes_on(viewer: &mut FakeViewer) {
    for _ in 0..3 {
        viewer.render(None);
        viewer.receive(20_000);
    }
    assert_eq!(viewer.tracers.status()[1].health, Health::Well);
}

#[test]
fn a_tracer_that_stands_still_is_named_and_comes_back() {
    let (mut viewer, proxy, _served) = two();
    proxy.set(Weather::Still);
    viewer.hears(0, Health::Ill, "silent");
    the_other_goes_on(&mut viewer);
    proxy.set(Weather::Fine);
    viewer.hears(0, Health::Well, "threads");
    the_other_goes_on(&mut viewer);
    // Nobody waits for one that stands still at the end.
    proxy.set(Weather::Still);
    viewer.hears(0, Health::Ill, "silent");
    let start = Instant::now();
    drop(viewer);
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
}

#[test]
fn a_tracer_that_is_slow_is_named() {
    let (mut viewer, proxy, _served) = two();
    proxy.set(Weather::Slow(1000));
    viewer.hears(0, Health::Ill, "slow");
    the_other_goes_on(&mut viewer);
}

#[test]
fn a_tracer_that_is_gone_is_named_and_comes_back() {
    let (mut viewer, proxy, _served) = two();
    proxy.set(Weather::Broken);
    viewer.hears(0, Health::Ill, "closed");
    the_other_goes_on(&mut viewer);
    proxy.set(Weather::Fine);
    viewer.hears(0, Health::Well, "threads");
}

/// With a token the length of a record may be damaged, and the rest of it never come. The connection that is tried next fails at its first bytes.
#[test]
fn nonsense_is_named() {
    let cases: [(_, &[&str]); 2] = [
        (None, &["it sent a message", "it does not speak the protocol"]),
        (
            Some("a secret of more than 16 letters"),
            &["a record was damaged", "silent", "no message has come", "it does not speak the protocol"],
        ),
    ];
    for (token, problems) in cases {
        let (mut viewer, proxy, _served) = two_with(token);
        proxy.set(Weather::Noise);
        viewer.hears_one_of(0, Health::Ill, problems);
        the_other_goes_on(&mut viewer);
        proxy.set(Weather::Fine);
        viewer.hears(0, Health::Well, "threads");
    }
}

/// A window that is hidden does not read for a while. That is no fault of the tracer.
#[test]
fn a_viewer_that_does_not_read_calls_nobody_ill() {
    let served = Served::start(None);
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.render(None);
    viewer.receive(100_000);
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(25) {
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(viewer.tracers.status()[0].health, Health::Well, "{:?}", viewer.tracers.status());
    }
    for _ in 0..100 {
        viewer.receive(10_000);
        assert_eq!(viewer.tracers.status()[0].health, Health::Well, "{:?}", viewer.tracers.status());
    }
    assert_eq!(served.logged().len(), 1, "one connection: {:?}", served.logged());
}

/// An address where nobody is, a name that nobody has: told, and tried again.
#[test]
fn addresses_where_nobody_is_are_told() {
    let served = Served::start(None);
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let addresses = [&served.address, &nobody, "no.such.host.invalid:7070", "nonsense"];
    let mut viewer = FakeViewer::of(addresses.iter().map(|a| address(a, None)).collect());
    viewer.render(None);
    viewer.hears(1, Health::Ill, "refused");
    viewer.hears(2, Health::Ill, "");
    viewer.hears(3, Health::Ill, "");
    viewer.receive(10_000);
}

/// A link that carries a small part of what is traced: the sums of all of it come nevertheless, and no path is counted twice or lost.
#[test]
fn a_slow_link_carries_film_deltas() {
    let served = Served::start(None);
    let proxy = Proxy::start(&served.address);
    let mut slow = address(&proxy.address, None);
    slow.compressed = true;
    let mut viewer = FakeViewer::of(vec![slow]);
    proxy.set(Weather::Slow(400_000));
    let paths = 1_000_000;
    viewer.render(Some(paths));
    let blocks = viewer.all();
    let camera: u64 = blocks.iter().map(|block| block.header.paths.camera).sum();
    let indices: u64 = blocks.iter().map(|block| block.header.index_count).sum();
    assert_eq!((camera, indices), (paths, paths));
    let (mut made, mut sums) = ([0.0; 2], [0.0; 2]);
    let mut take = |index: u64| {
        struct Sum<'a>(&'a mut [f64; 2]);
        impl crate::support::synthetic::Out for Sum<'_> {
            fn camera(&mut self, _: [f32; 2], value: pointillist::color::Xyz, weight: f32) {
                self.0[0] += f64::from(value.y * weight);
            }
            fn light(&mut self, _: [f32; 2], value: pointillist::color::Xyz) {
                self.0[1] += f64::from(value.y);
            }
        }
        crate::support::synthetic::varied(index, &mut Sum(&mut made));
    };
    (0..paths).for_each(&mut take);
    let samples = blocks.iter().flat_map(|block| block.samples());
    let mut count = 0;
    for sample in samples {
        sums[usize::from(sample.w < 0.0)] += f64::from(sample.xyz.y);
        count += 1;
    }
    // About 1.5 samples are made on each path.
    assert!(count < paths, "{count} samples");
    for (sum, made) in sums.into_iter().zip(made) {
        assert!((sum / made - 1.0).abs() < 1e-4, "{sum} for {made}");
    }
}
