//! Samples of hostile values: what the stream lets in, and what the film takes beside it.

use pointillist::client::filter::accepts;
use pointillist::color::Xyz;
use pointillist::stream::{
    BlockSink, Cause, DrainOrder, Epoch, MAX_VALUE, PathCounts, Sample, SampleSink, UvWindow, lanes,
};

use crate::Row;
use crate::sums::films;
use crate::support::device::{assert_silent, gpu, scene, spec};

const PLACES: [f32; 6] = [0.5, -0.0, 1e-45, 2.0, f32::NAN, f32::INFINITY];
const VALUES: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    -0.0,
    0.0,
    1e-45,
    -1e-45,
    1e-38,
    1.0,
    -1.0,
    MAX_VALUE,
    f32::MAX,
];

/// All combinations of places, colours and weights: `[u, v], [x, y, z], w`.
fn hostile() -> impl Iterator<Item = Sample> {
    (0..6 * 6 * 12usize.pow(4)).map(|i| {
        let value = |k: u32| VALUES[i / 36 / 12usize.pow(k) % 12];
        let uv = [PLACES[i % 6], PLACES[i / 6 % 6]];
        Sample { uv, xyz: Xyz::new(value(0), value(1), value(2)), w: value(3) }
    })
}

/// Whether all numbers of a sample are finite.
fn is_finite(s: &Sample) -> bool {
    s.uv.iter().chain(&[s.xyz.x, s.xyz.y, s.xyz.z, s.w]).all(|v| v.is_finite())
}

/// No sample of the stream has a number that is not finite, or a weight that names no stream, and every one that is kept out is
/// counted by its cause. `W ≥ 0` for the camera and everything else for the light lets NaN into the light image.
#[test]
fn p1_samples_of_hostile_values() {
    let (mut writers, mut lanes) = lanes(1, 64);
    lanes.hub().run(Some(Epoch(1)));
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    let mut sink = BlockSink::new(writers.remove(0));
    sink.start(Epoch(1), UvWindow::PICTURE);
    let (mut offered, mut wrong, mut sent, mut ambiguous) = (0u64, 0u64, 0u64, 0u64);
    let (mut naive, mut rejected) = (0u64, 0u64);
    let mut drain = |lanes: &mut pointillist::stream::Lanes| {
        lanes.drain(usize::MAX, |block| {
            sent += block.samples().len() as u64;
            rejected += block.header.rejected;
            let known = |s: &Sample| is_finite(s) && (s.w > 0.0 || s.w == -1.0) && accepts(s);
            wrong += block.samples().iter().filter(|s| !known(s)).count() as u64;
        });
    };
    for (index, sample) in hostile().enumerate() {
        sink.begin_path(index as u64);
        sink.camera(sample.uv, sample.xyz, sample.w);
        offered += 1;
        if sample.w == 1.0 {
            sink.light(sample.uv, sample.xyz);
            offered += 1;
        }
        sink.end_path(PathCounts { camera: 1, light: 1 });
        // The paper's rule looks at the sign of the weight alone, and takes all.
        naive += u64::from(!is_finite(&sample));
        ambiguous += u64::from(sample.w == 0.0 || sample.w.is_nan());
        if index % 1024 == 1023 {
            drain(&mut lanes);
        }
    }
    assert!(sink.flush());
    drain(&mut lanes);
    let rejections = &sink.totals().rejections;
    assert_eq!(
        (sent + rejected, rejections.total()),
        (offered, rejected),
        "a sample was neither sent nor counted"
    );
    assert!(sent > 1000 && ambiguous > 1000, "case too easy: {sent} sent, {ambiguous} ambiguous");
    let causes = Cause::ALL.map(|cause| rejections.count(cause));
    println!("P1 {offered} samples, {sent} sent; rejected by cause {causes:?}");
    assert!(causes.iter().all(|count| *count > 0), "{causes:?}");
    Row {
        case: "P1 all combinations of NaN, ±∞, ±0, denormals, huge",
        measure: "samples in the stream that are not finite or of no stream",
        figure: wrong as f64,
        naive: ("W ≥ 0", naive as f64),
        bound: 0.0,
    }
    .check();
}

/// The same samples, given to the film itself: those that are not finite, too large or of no stream leave no trace, while the sums
/// of a film without the check, in f64, are no numbers any more.
#[test]
fn p1_hostile_values_leave_no_trace_on_a_film() {
    let spec = spec(6, 4, pointillist::client::SplatFilter::Gaussian);
    let bad: Vec<Sample> = hostile().filter(|s| !accepts(s)).collect();
    let mut sums = [1.0f64; 4];
    for s in &bad {
        sums.iter_mut().zip([s.xyz.x, s.xyz.y, s.xyz.z, s.w]).for_each(|(sum, v)| *sum += f64::from(v));
    }
    for (device, mut film) in films(spec) {
        film.add(&scene(&spec, 500, 4, 3)).unwrap();
        let before = film.develop().unwrap();
        film.add(&bad).unwrap();
        let after = film.develop().unwrap();
        assert_eq!(before.counts, after.counts);
        let bits = |data: &pointillist::client::FilmData| -> Vec<u32> {
            let colors = data.camera.iter().chain(&data.light).flatten();
            colors.chain(&data.camera_variance).chain(&data.light_variance).map(|v| v.to_bits()).collect()
        };
        Row {
            case: &format!("P1 {:.0e} hostile samples on a film, {device}", bad.len() as f64),
            measure: "sums that changed",
            figure: bits(&before).iter().zip(bits(&after)).filter(|(a, b)| **a != *b).count() as f64,
            naive: ("f64 sums without a check", sums.iter().filter(|sum| !sum.is_finite()).count() as f64),
            bound: 0.0,
        }
        .check();
    }
    assert_silent(gpu());
}
