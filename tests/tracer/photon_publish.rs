//! The photon map under threads: what a snapshot holds does not depend on who made it, and readers see whole generations.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use crate::photons::arrival;
use glam::Vec3;
use pointillist::math::random::Random;
use pointillist::tracer::photon_map::{
    PhotonBatch, PhotonLayer, PhotonMap, QueryScratch, Schedule, Snapshot,
};

const PATHS: u64 = 256;

/// Light paths of zero to five photons, each a function of its number, which the flux carries.
fn trace(paths: Range<u64>, batch: &mut PhotonBatch) {
    for path in paths {
        let mut r = Random(path * 1000);
        for _ in 0..path % 6 {
            let mark = path as f32 + 1.0;
            let layer = if r.f32() < 0.2 { PhotonLayer::Caustic } else { PhotonLayer::Global };
            assert!(batch.push(layer, &arrival(r.point(), mark)));
        }
    }
}

fn map() -> PhotonMap {
    PhotonMap::new(Vec3::ZERO, Vec3::ONE, PATHS, usize::MAX)
}

/// The snapshot of so many generations, whatever it takes.
fn wait(map: &PhotonMap, generations: u64) -> Arc<Snapshot> {
    map.wait(generations, trace, &|| true).expect("always wanted")
}

/// Everything that a query returns, in its order.
fn answers(snapshot: &Snapshot) -> Vec<u32> {
    let mut all = vec![snapshot.generations as u32, snapshot.light_paths as u32];
    let mut scratch = QueryScratch::default();
    for layer in [PhotonLayer::Global, PhotonLayer::Caustic] {
        let forest = snapshot.layer(layer);
        for near in forest.nearest(Vec3::splat(0.5), 2.0, usize::MAX, &mut scratch, |_| true) {
            all.extend([forest.photon(near).flux().0.x.to_bits(), near.distance2.to_bits()]);
        }
        for i in 0..50 {
            let at = Random(77 + i).point();
            for near in forest.nearest(at, 0.5, 10, &mut scratch, |_| true) {
                all.extend([forest.photon(near).flux().0.x.to_bits(), near.distance2.to_bits()]);
            }
        }
    }
    all
}

#[test]
fn snapshots_do_not_depend_on_the_number_of_threads() {
    let generations = [1, 2, 3, 7, 8, 21];
    let alone = map();
    let expected: Vec<_> = generations.iter().map(|&g| answers(&wait(&alone, g))).collect();
    assert!(expected[5].len() > 10_000, "the case is too easy");
    for threads in [2, 3, 8] {
        let shared = map();
        for (g, expected) in generations.iter().zip(&expected) {
            let results: Vec<_> = thread::scope(|s| {
                let waiting: Vec<_> = (0..threads).map(|_| s.spawn(|| wait(&shared, *g))).collect();
                waiting.into_iter().map(|t| t.join().unwrap()).collect()
            });
            for snapshot in results {
                assert!(answers(&snapshot) == *expected, "{threads} threads, generation {g}");
            }
        }
    }
}

/// The marks of all photons of the first generations, summed in integers: exact.
fn sum_of_marks(generations: u64) -> u64 {
    (0..generations * PATHS).map(|path| (path + 1) * (path % 6)).sum()
}

#[test]
fn readers_see_whole_generations_only() {
    let map = map();
    let last = 60;
    let stop = AtomicBool::new(false);
    let seen = AtomicU64::new(0);
    thread::scope(|s| {
        let readers: Vec<_> = (0..2)
            .map(|_| {
                s.spawn(|| {
                    let mut scratch = QueryScratch::default();
                    let mut before = 0;
                    while !stop.load(Ordering::Relaxed) {
                        let snapshot = map.latest();
                        let g = snapshot.generations;
                        assert!(g >= before, "generation {g} after {before}");
                        assert_eq!(snapshot.light_paths, g * PATHS);
                        let mut sum = 0;
                        for layer in [PhotonLayer::Global, PhotonLayer::Caustic] {
                            let forest = snapshot.layer(layer);
                            let at = Vec3::splat(0.5);
                            for near in forest.nearest(at, 2.0, usize::MAX, &mut scratch, |_| true) {
                                sum += forest.photon(near).flux().0.x.round() as u64;
                            }
                        }
                        assert_eq!(sum, sum_of_marks(g), "generation {g}");
                        seen.fetch_max(g, Ordering::Relaxed);
                        before = g;
                    }
                })
            })
            .collect();
        let writers: Vec<_> = (0..3)
            .map(|_| {
                s.spawn(|| {
                    while let Some(claim) = map.claim(last * PATHS) {
                        let mut batch = PhotonBatch::default();
                        trace(claim.paths(), &mut batch);
                        claim.deposit(batch, &|| true);
                        thread::yield_now();
                    }
                })
            })
            .collect();
        writers.into_iter().for_each(|w| w.join().unwrap());
        // A writer that found another one publishing has left its generation to that one.
        assert_eq!(map.latest().generations, last);
        while seen.load(Ordering::Relaxed) < last && !readers.iter().any(|r| r.is_finished()) {
            thread::yield_now();
        }
        stop.store(true, Ordering::Relaxed);
        readers.into_iter().for_each(|r| r.join().unwrap());
    });
}

#[test]
fn a_claim_given_up_is_handed_to_another() {
    let map = map();
    drop(map.claim(PATHS).unwrap());
    let snapshot = thread::scope(|s| {
        let lost = map.claim(PATHS).unwrap();
        let other = map.claim(PATHS).unwrap();
        let waiting = s.spawn(|| wait(&map, 1));
        drop(other);
        let panicking = s.spawn(move || {
            let _held = lost;
            panic!("a light path that went wrong, on purpose");
        });
        assert!(panicking.join().is_err());
        waiting.join().unwrap()
    });
    assert!(answers(&snapshot) == answers(&wait(&self::map(), 1)));
}

#[test]
fn old_snapshots_stay_valid_while_they_are_held() {
    let map = map();
    let first = wait(&map, 1);
    let told = answers(&first);
    wait(&map, 40);
    assert!(answers(&first) == told);
    assert!(map.finished(40).is_some() && map.finished(30).is_some());
    // Asked for by a thread that slept too long, it is made again.
    assert!(map.finished(1).is_none());
    assert!(answers(&wait(&map, 1)) == told);
    assert_eq!(map.latest().generations, 40);
}

/// A small renderer: each index traces its share of light paths and reads the generation that the schedule names.
#[test]
fn samples_do_not_depend_on_the_number_of_threads() {
    let schedule = Schedule {
        paths_per_generation: PATHS,
        samples_per_generation: 500,
        radius: 0.3,
        beam_radius: 0.3,
        alpha: 0.0,
        neighbours: 20,
    };
    let sample = |map: &PhotonMap, index: u64| {
        while let Some(claim) = map.claim(schedule.paths_ahead(index)) {
            let mut batch = PhotonBatch::default();
            trace(claim.paths(), &mut batch);
            claim.deposit(batch, &|| true);
        }
        let lookup = schedule.lookup(schedule.generations(index));
        let snapshot = wait(map, lookup.generations);
        let forest = snapshot.layer(PhotonLayer::Global);
        let mut scratch = QueryScratch::default();
        let at = Random(index + 5_000_000).point();
        let found = forest.nearest(at, lookup.radius, lookup.neighbours, &mut scratch, |_| true);
        found.iter().map(|n| forest.photon(n).flux().0.x * n.distance2).sum::<f32>().to_bits()
    };
    let alone = map();
    let expected: Vec<u32> = (0..5000).map(|i| sample(&alone, i)).collect();
    for threads in [2, 4] {
        let (shared, next) = (map(), AtomicU64::new(0));
        thread::scope(|s| {
            for _ in 0..threads {
                s.spawn(|| {
                    loop {
                        let first = next.fetch_add(16, Ordering::Relaxed);
                        if first >= 5000 {
                            return;
                        }
                        for index in first..(first + 16).min(5000) {
                            assert_eq!(sample(&shared, index), expected[index as usize], "sample {index}");
                        }
                    }
                });
            }
        });
    }
    // A range rendered apart, from the middle on.
    let apart = map();
    assert_eq!(sample(&apart, 4321), expected[4321]);
}

/// A merge that nobody waits for any more is given up without loss: the next thread that needs it begins again.
#[test]
fn a_merge_given_up_is_made_by_another() {
    let (map, last) = (map(), 15);
    wait(&map, last);
    // The 16th generation merges all; the deposit that completes it finds itself unwanted.
    while let Some(claim) = map.claim((last + 1) * PATHS) {
        let mut batch = PhotonBatch::default();
        trace(claim.paths(), &mut batch);
        claim.deposit(batch, &|| false);
    }
    assert_eq!(map.latest().generations, last, "the merge was not given up");
    assert!(map.wait(last + 1, trace, &|| false).is_none());
    let waiting = |map: &PhotonMap| wait(map, last + 1);
    let snapshot = thread::scope(|s| [0; 3].map(|_| s.spawn(|| waiting(&map))).map(|t| t.join().unwrap()));
    let expected = answers(&wait(&self::map(), last + 1));
    assert!(snapshot.iter().all(|s| answers(s) == expected));
}

/// With a limit the last snapshot is the first to hold so many photons, for any number of threads and any question.
#[test]
fn a_map_stops_growing_at_its_limit() {
    let alone = map();
    let photons = |s: &Snapshot| s.layer(PhotonLayer::Global).len() + s.layer(PhotonLayer::Caustic).len();
    let limit = photons(&wait(&alone, 9)) - 1;
    let expected = answers(&wait(&alone, 9));
    for threads in [1, 3] {
        let map = PhotonMap::new(Vec3::ZERO, Vec3::ONE, PATHS, limit);
        thread::scope(|s| {
            let waiting: Vec<_> = (0..threads).map(|_| s.spawn(|| wait(&map, 1000))).collect();
            for t in waiting {
                assert!(answers(&t.join().unwrap()) == expected);
            }
        });
        assert!(map.claim(u64::MAX).is_none() && map.latest().generations == 9);
        assert!(answers(&wait(&map, 5)) == answers(&wait(&self::map(), 5)), "an earlier one, made again");
    }
}
