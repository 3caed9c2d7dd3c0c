//! Samples arrive as they were made, of the newest render only, and each once.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use pointillist::remote::{FetchOptions, Health, RemoteRender, Welcome, fetch};
use pointillist::server::Server;
use pointillist::stream::{Block, DrainOrder, Epoch, PathCounts, Sample, tracer_seed};

use crate::host::{FakeViewer, Served, address};
use crate::support::synthetic::{synthetic, varied};

const TOKEN: &str = "a secret of more than 16 letters";

/// Samples in order of index, and the counts of all blocks.
fn sorted(mut blocks: Vec<Block>) -> (Vec<Sample>, PathCounts, u64) {
    // Parts of a block have the same first index, and come in order.
    blocks.sort_by_key(|block| block.header.first_index);
    let (mut samples, mut paths, mut indices) = (Vec::new(), PathCounts::default(), 0);
    for block in &blocks {
        samples.extend_from_slice(block.samples());
        paths.camera += block.header.paths.camera;
        paths.light += block.header.paths.light;
        indices += block.header.index_count;
    }
    (samples, paths, indices)
}

/// What a server of this process makes of the same.
fn made_here(paths: u64) -> (Vec<Sample>, PathCounts, u64) {
    let (server, mut lanes) = Server::start(2).unwrap();
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    server.render(pointillist::server::RenderJob::new(synthetic(varied), 0..paths), Epoch(1)).unwrap();
    let mut blocks = Vec::new();
    while !lanes.is_drained() {
        lanes.wait(Duration::from_millis(5));
        lanes.drain(1 << 16, |block| blocks.push(block.clone()));
    }
    sorted(blocks)
}

#[test]
fn samples_arrive_as_they_were_made() {
    for token in [None, Some(TOKEN)] {
        let served = Served::start(token);
        let mut viewer = FakeViewer::of(vec![address(&served.address, token)]);
        viewer.render(Some(200_000));
        let blocks = viewer.all();
        assert!(blocks.iter().all(|block| block.header.epoch == viewer.epoch));
        let (samples, paths, indices) = sorted(blocks);
        let (made, made_paths, made_indices) = made_here(200_000);
        assert_eq!((paths, indices), (made_paths, made_indices));
        assert!(samples == made, "{} samples of {}", samples.len(), made.len());
        assert_eq!(viewer.tracers.status()[0].health, Health::Well);
        assert_eq!(viewer.tracers.threads(), 2);
    }
}

#[test]
fn short_samples_are_as_many() {
    let served = Served::start(None);
    let mut short = address(&served.address, None);
    short.compressed = true;
    let mut viewer = FakeViewer::of(vec![short]);
    viewer.render(Some(100_000));
    let (samples, paths, indices) = sorted(viewer.all());
    let (made, made_paths, made_indices) = made_here(100_000);
    assert_eq!((paths, indices, samples.len()), (made_paths, made_indices, made.len()));
    for (short, made) in samples.iter().zip(&made) {
        assert_eq!(short.w, made.w);
        assert!(
            (short.uv[0] - made.uv[0]).abs() < 1e-5
                && (short.xyz.x - made.xyz.x).abs() <= made.xyz.x / 1000.0
        );
    }
}

/// Hundreds of edits, faster than anything can be traced: only samples of the last one come. (`benchmarks live --restless` watches the memory.)
#[test]
fn the_newest_render_counts() {
    let served = Served::start(None);
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.render(None);
    viewer.receive(100_000);
    for edit in 0..500u64 {
        viewer.render(None);
        let epoch = viewer.epoch;
        viewer.lanes.drain(1 << 16, |block| assert_eq!(block.header.epoch, epoch));
        if edit % 50 == 0 {
            viewer.receive(1000);
        }
    }
    viewer.render(Some(50_000));
    let epoch = viewer.epoch;
    let blocks = viewer.all();
    assert!(blocks.iter().all(|block| block.header.epoch == epoch));
    assert_eq!(sorted(blocks), made_here(50_000));
}

#[test]
fn no_two_tracers_trace_the_same() {
    let served: Vec<Served> = (0..3).map(|_| Served::start(None)).collect();
    let mut viewer = FakeViewer::of(served.iter().map(|served| address(&served.address, None)).collect());
    (0..3).for_each(|place| viewer.hears(place, Health::Well, "threads"));
    viewer.render(Some(90_000));
    let (_, paths, indices) = sorted(viewer.all());
    assert_eq!((indices, paths.camera), (90_000, 90_000), "a third for each");
    let requests = |served: &Served| served.host.requests.lock().unwrap().clone();
    let seeds: HashSet<u32> =
        served.iter().flat_map(requests).filter(|r| r.epoch == viewer.epoch.0).map(|r| r.seed).collect();
    assert_eq!(seeds, [0, 1, 2].map(|k| tracer_seed(7, k)).into());
    // One that ends and comes back gets a sequence that nobody had.
    viewer.render(None);
    viewer.receive(10_000);
    let mut served = served;
    let (gone, port) = (served.remove(1), 1);
    let address = gone.address.clone();
    drop(gone);
    viewer.hears(port, Health::Ill, "");
    viewer.receive(100_000);
    let back = Served::at(&address, None, Vec::new());
    viewer.hears(port, Health::Well, "threads");
    viewer.until(|_| {}, |_| !requests(&back).is_empty());
    assert_eq!(requests(&back)[0].seed, tracer_seed(7, 3));
}

#[test]
fn an_abort_ends_the_render_and_another_begins() {
    let served = Served::start(None);
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.render(None);
    viewer.receive(50_000);
    viewer.tracers.abort();
    let blocks = viewer.all();
    assert!(blocks.iter().all(|block| block.header.epoch == viewer.epoch));
    viewer.render(Some(2000));
    assert_eq!(sorted(viewer.all()), made_here(2000));
}

#[test]
fn an_order_that_cannot_be_traced_is_told() {
    let served = Served::start(None);
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.order(None, "refuse");
    viewer.hears(0, Health::Ill, "that cannot be traced");
    viewer.render(None);
    viewer.receive(1000);
    viewer.hears(0, Health::Well, "threads");
}

/// One of two tracers refuses: the render ends with the share of the other one, and what it has asked for is not counted as complete.
#[test]
fn a_tracer_that_refuses_holds_nobody_up() {
    let served = [Served::start(None), Served::start(None)];
    served[1].host.refuses.store(true, Ordering::SeqCst);
    let mut viewer = FakeViewer::of(served.iter().map(|served| address(&served.address, None)).collect());
    viewer.render(Some(60_000));
    let (_, paths, _) = sorted(viewer.all());
    assert_eq!(paths.camera, 30_000);
    viewer.hears(1, Health::Ill, "that cannot be traced");
}

/// A number that stands for no render would have the tracer trace for ever.
#[test]
fn the_last_number_is_no_render() {
    let served = Served::start(None);
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.hears(0, Health::Well, "threads");
    let (epoch, order) = (Epoch(u64::MAX), "{}".to_owned());
    viewer.tracers.render(RemoteRender { epoch, seed: 7, paths: None, side: 64, order });
    viewer.hears(0, Health::Ill, "closed");
    drop(viewer);
    let mut next = FakeViewer::of(vec![address(&served.address, None)]);
    next.render(None);
    next.receive(1000);
}

#[test]
fn the_scene_is_fetched_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let mesh: Vec<u8> = (0..300_000u32).map(|i| (i % 251) as u8).collect();
    let files = vec![
        ("scenes/a.xml".to_owned(), file("a.xml", b"<scene/>")),
        ("meshes/b.ply".to_owned(), file("b.ply", &mesh)),
        ("meshes/empty.obj".to_owned(), file("empty.obj", b"")),
    ];
    let served = Served::at("127.0.0.1:0", Some(TOKEN), files);
    let cache = folder.path().join("cache");
    for _ in 0..2 {
        let options = FetchOptions {
            folder: &cache,
            digest: &|paths: &[PathBuf], _: &Welcome| {
                paths.iter().all(|path| path.is_file()).then(|| "d1".to_owned())
            },
            is_over: &|| false,
        };
        let fetched = fetch(&address(&served.address, Some(TOKEN)), &options).unwrap();
        assert_eq!(std::fs::read(&fetched.scene).unwrap(), b"<scene/>");
        let root = fetched.scene.parent().unwrap().parent().unwrap();
        assert_eq!(std::fs::read(root.join("meshes/b.ply")).unwrap(), mesh);
        assert_eq!(std::fs::read(root.join("meshes/empty.obj")).unwrap(), b"");
        assert_eq!(fetched.welcome.digest, "d1");
        std::fs::remove_file(folder.path().join("a.xml")).unwrap_or_default();
    }
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 1);
}
