//! Cost of the photon map against its size, and its throughput with one and two threads.
//!
//! Photons lie on the walls of a box and, half of them, in the focus of a caustic. Queries are for the 50 nearest, on the same
//! surfaces.

use std::hint::black_box;
use std::thread;
use std::time::{Duration, Instant};

use glam::Vec3;
use pointillist::math::bits::mix;
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::photon_map::{
    Arrival, ArrivalSite, Photon, PhotonBatch, PhotonLayer, PhotonMap, QueryScratch,
};

use super::common::{Outcome, line};

/// How far to go.
#[derive(clap::Args)]
pub struct Arguments {
    /// The largest number of photons
    #[arg(default_value_t = 1e7)]
    largest: f64,
}

/// Photons of a light path, a claim of 64 of which is deposited at a time.
const PER_PATH: u64 = 5;
const CLAIM: u64 = 64;
const PATHS_PER_GENERATION: u64 = 4096;
const NEIGHBOURS: usize = 50;
/// Larger than any disc of 50 photons.
const RADIUS: f32 = 10.0;

/// A number in [0, 1) for each counter.
fn unit(counter: u64) -> f32 {
    (mix(counter) >> 40) as f32 / 16_777_216.0
}

/// A point on the six walls of the unit cube; every second one on the floor, the denser the nearer to its middle.
fn position(number: u64) -> Vec3 {
    let [a, b, c] = [0, 1, 2].map(|i| unit(number * 3 + i));
    if number.is_multiple_of(2) {
        let (s, cos) = (a * std::f32::consts::TAU).sin_cos();
        let r = 0.5 * b * b;
        return Vec3::new(0.5 + r * cos, 0.0, 0.5 + r * s);
    }
    let side = (c * 6.0) as usize;
    let mut p = Vec3::new(a, b, a);
    p[(side / 2 + 1) % 3] = b;
    p[side / 2] = (side % 2) as f32;
    p
}

fn arrival(number: u64) -> Arrival {
    Arrival {
        position: position(number),
        direction: Vec3::Y,
        site: ArrivalSite::Surface(Vec3::Y),
        flux: SampledSpectrum::ONE,
        wavelengths: number as u16,
        hero_only: false,
        depth: 2,
        group: 0,
    }
}

/// Traces and hands in 64 light paths.
fn add(map: &PhotonMap) {
    let Some(claim) = map.claim(u64::MAX) else { return };
    let mut batch = PhotonBatch::default();
    for number in claim.paths().start * PER_PATH..claim.paths().end * PER_PATH {
        batch.push(PhotonLayer::Global, &arrival(number));
    }
    claim.deposit(batch, &|| true);
}

/// The number of photons that a query finds.
fn nearest(map: &PhotonMap, at: Vec3, scratch: &mut QueryScratch) -> usize {
    let snapshot = map.latest();
    snapshot.layer(PhotonLayer::Global).nearest(at, RADIUS, NEIGHBOURS, scratch, upwards).len()
}

fn empty() -> PhotonMap {
    PhotonMap::new(Vec3::ZERO, Vec3::ONE, PATHS_PER_GENERATION, usize::MAX)
}

fn upwards(photon: &Photon) -> bool {
    photon.normal().y > 0.5
}

/// Where query `i` is, on the same surfaces as the photons but at none of them.
fn place(i: u64) -> Vec3 {
    position(i + (1 << 40))
}

/// Nanoseconds per query: the best of thirty short rounds, which other work on the machine disturbs least.
fn query_ns(map: &PhotonMap, queries: u64) -> f64 {
    let mut scratch = QueryScratch::default();
    (0..30)
        .map(|round| {
            let start = Instant::now();
            for i in 0..queries {
                black_box(nearest(map, place(i + round * queries), &mut scratch));
            }
            start.elapsed().as_secs_f64() * 1e9 / queries as f64
        })
        .fold(f64::INFINITY, f64::min)
}

/// Cost at growing numbers of photons, up to `largest`.
fn growth(largest: f64) {
    println!("\none thread");
    println!("     photons  parts  insert ns/photon  bytes/photon  query ns  + per doubling");
    let map = empty();
    let (mut photons, mut spent, mut before) = (0.0, Duration::ZERO, None);
    let mut points = Vec::new();
    let mut wanted: f64 = 1e4;
    // Whole generations: what is not finished is not seen.
    let generation = (PATHS_PER_GENERATION * PER_PATH) as f64;
    while wanted <= largest * 1.01 {
        let target = (wanted / generation).ceil() * generation;
        let start = Instant::now();
        while photons < target {
            add(&map);
            photons += (CLAIM * PER_PATH) as f64;
        }
        spent += start.elapsed();
        let ns = query_ns(&map, 4000);
        let slope: Option<f64> = before.map(|(n, t): (f64, f64)| (ns - t) / (photons / n).log2());
        let slope = slope.map_or(String::new(), |s| format!("{s:14.0}"));
        let (insert, bytes) = (
            spent.as_secs_f64() * 1e9 / photons,
            map.latest().layer(PhotonLayer::Global).bytes() as f64 / photons,
        );
        println!(
            "{photons:12} {:6} {insert:17.0} {bytes:13.1} {ns:9.0} {slope}",
            map.latest().layer(PhotonLayer::Global).trees().len()
        );
        points.push((photons.log2(), ns));
        before = Some((photons, ns));
        wanted *= 10f64.sqrt();
    }
    let (slope, at_zero) = line(&points);
    let at_million = at_zero + slope * 1e6f64.log2();
    println!("  fit: {at_million:.0} ns at 10^6 photons, {slope:+.0} ns per doubling");
}

/// Per thread: events, and the longest of them in seconds.
type Load = (u64, f64);

/// Runs `threads` of the load for `seconds`: one claim of light paths to every `queries` queries (none if 0; no light
/// paths if `u64::MAX`). Returns photons per second, queries per second, longest query in ms, queries above 1 ms.
fn load(map: &PhotonMap, threads: usize, queries: u64, seconds: f64) -> (f64, f64, f64, u64) {
    let start = Instant::now();
    let work = |number: u64| {
        let mut scratch = QueryScratch::default();
        let (mut claims, mut asked, mut late): (u64, Load, u64) = (0, (0, 0.0), 0);
        while start.elapsed().as_secs_f64() < seconds {
            if queries != u64::MAX {
                add(map);
                claims += 1;
            }
            for _ in 0..queries.min(64) {
                let at = place(asked.0 + (number << 36));
                let began = Instant::now();
                black_box(nearest(map, at, &mut scratch));
                let took = began.elapsed().as_secs_f64();
                asked = (asked.0 + 1, asked.1.max(took));
                late += u64::from(took > 1e-3);
            }
        }
        (claims, asked, late)
    };
    let results: Vec<_> = thread::scope(|s| {
        let work = &work;
        let running: Vec<_> = (0..threads as u64).map(|number| s.spawn(move || work(number))).collect();
        running.into_iter().filter_map(|t| t.join().ok()).collect()
    });
    let took = start.elapsed().as_secs_f64();
    let claims: u64 = results.iter().map(|r| r.0).sum();
    let asked: u64 = results.iter().map(|r| r.1.0).sum();
    let longest = results.iter().map(|r| r.1.1).fold(0.0, f64::max);
    let late = results.iter().map(|r| r.2).sum();
    ((claims * CLAIM * PER_PATH) as f64 / took, asked as f64 / took, longest * 1e3, late)
}

fn throughput() {
    println!("\nthroughput");
    println!(
        "  load                          threads  Mphotons/s  Mqueries/s  longest query ms  queries > 1 ms"
    );
    for (name, queries) in
        [("light paths only", 0), ("64 light paths, 64 queries", 64), ("queries only", u64::MAX)]
    {
        for threads in [1, 2] {
            let map = empty();
            // The same start for all: 10^6 photons.
            (0..49 * PATHS_PER_GENERATION / CLAIM).for_each(|_| add(&map));
            let (photons, asked, longest, late) = load(&map, threads, queries, 3.0);
            let (photons, asked) = (photons / 1e6, asked / 1e6);
            println!("  {name:<29} {threads:7} {photons:11.2} {asked:11.3} {longest:17.2} {late:15}");
        }
    }
}

/// Grows a map, then puts load on one of 10⁶ photons.
pub fn run(arguments: &Arguments) -> Outcome {
    println!("{} bytes per photon besides splits", size_of::<Vec3>() + size_of::<Photon>());
    growth(arguments.largest);
    throughput();
    Ok(())
}
