//! Batches of several chunks, and sums that are coarse while a picture moves.

use crate::common::{assert_silent, film, gpu, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::{ExactFilm, ReferenceFilm};
use pointillist::client::{CHUNK_SAMPLES, Film, FilmData, FilmSpec, Reconstruction, SplatFilter};
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

/// Largest error of a texel's sums, relative to the texel's own. The judge counts in units of 2^-36, so those that only the edge of a
/// sprite has touched are left out.
fn error(got: &[[f32; 4]], wanted: &[[f32; 4]]) -> f64 {
    let of = |got: &[f32; 4], wanted: &[f32; 4]| {
        let pairs = got.iter().zip(wanted).filter(|(_, wanted)| **wanted > 1e-3);
        pairs.map(|(got, wanted)| (f64::from(*got) / f64::from(*wanted) - 1.0).abs()).fold(0.0, f64::max)
    };
    got.iter().zip(wanted).map(|(got, wanted)| of(got, wanted)).fold(0.0, f64::max)
}

/// Sums of batches of several chunks are as exact as those of one chunk, judged by sums without rounding: evenly spread samples, and a
/// place so dense that it is merged from a later chunk on.
#[test]
fn batches_of_several_chunks_are_exact() {
    let [small, large] = [[360, 280], [800, 640]].map(|[w, h]| spec(w, h, SplatFilter::Gaussian));
    assert_eq!([small, large].map(|s| s.batch_capacity() / CHUNK_SAMPLES), [1, 3]);
    let errors = [small, large].map(|spec| {
        let mut random = Random(23);
        let mut samples = scene(&spec, 2 * large.batch_capacity() + 12_345, 5, 3);
        for (i, sample) in samples.iter_mut().enumerate().filter(|(i, _)| i % 7 == 0) {
            let t = [random.f32(), random.f32()];
            let at = [(150.0 + t[0]) / spec.width as f32, (90.0 + t[1]) / spec.height as f32];
            *sample = Sample { uv: at, xyz: Xyz::new(0.3, 0.1 + (i % 13) as f32, 0.7), w: sample.w };
        }
        let mut film = film(spec);
        let mut exact = ExactFilm::new(spec, 2, 1.0).expect("a film");
        film.add(&samples).expect("add");
        exact.add(&samples).expect("add");
        let (got, wanted) = (film.develop().expect("develop"), exact.develop().expect("develop"));
        assert!(!wanted.light.is_empty());
        error(&got.camera, &wanted.camera).max(error(&got.light, &wanted.light))
    });
    println!(
        "largest relative error of a sum: {:.1e} in batches of one chunk, {:.1e} of three",
        errors[0], errors[1]
    );
    assert!(errors.iter().all(|error| *error < 1e-6), "{errors:?}");
    assert_silent(gpu());
}

/// The same samples in the same order give the same bits, however they are split into calls, also where a batch has several chunks and
/// ends early.
#[test]
fn calls_leave_no_trace_in_large_batches() {
    let spec = spec(800, 640, SplatFilter::Box);
    let mut samples = scene(&spec, 2 * spec.batch_capacity() + 999, 8, 3);
    // So many at one place that the second batch ends with its second chunk.
    for sample in samples.iter_mut().skip(spec.batch_capacity()).take(CHUNK_SAMPLES + 5_000) {
        (sample.uv, sample.w) = ([0.51, 0.49], 1.0);
    }
    let mut whole = film(spec);
    whole.add(&samples).expect("add");
    whole.settle().expect("settle");
    let waiting = whole.waiting();
    assert_ne!(waiting, 999, "case too easy: no batch ended early");
    let wanted = whole.develop().expect("develop");
    for part in [1_000, CHUNK_SAMPLES, CHUNK_SAMPLES + 1] {
        let mut film = film(spec);
        samples.chunks(part).for_each(|part| film.add(part).expect("add"));
        film.settle().expect("settle");
        assert_eq!(film.waiting(), waiting);
        assert!(film.develop().expect("develop") == wanted, "in parts of {part}");
    }
    assert_silent(gpu());
}

/// What a film shows of a batch that is kept does not depend on how far the thread that sorts is: the light stream has begun with samples that are
/// not drawn yet.
#[test]
fn a_batch_that_is_kept_leaves_no_trace() {
    let spec = spec(800, 640, SplatFilter::Box);
    let mut samples = scene(&spec, 2 * spec.batch_capacity() + 70_000, 8, 3);
    for (i, sample) in samples.iter_mut().enumerate() {
        sample.w = if i < 2 * spec.batch_capacity() { 1.0 } else { -1.0 };
    }
    let mut whole = film(spec);
    whole.add(&samples[..2 * spec.batch_capacity()]).expect("add");
    let wanted = whole.develop().expect("develop");
    for part in [1_000, 70_000, samples.len(), 999] {
        let mut film = film(spec);
        film.keep_batch(true);
        samples.chunks(part).for_each(|part| film.add(part).expect("add"));
        let got = film.develop().expect("develop");
        assert!(got.camera == wanted.camera && got.light.is_empty(), "in parts of {part}");
        assert_eq!((film.waiting(), film.allocated_streams()), (70_000, [true, false]));
    }
    assert_silent(gpu());
}

/// Samples that are forgotten while the thread has them are in no later sum.
#[test]
fn forgotten_samples_leave_no_trace() {
    let spec = spec(300, 200, SplatFilter::Gaussian);
    let samples = scene(&spec, 4 * CHUNK_SAMPLES, 5, 2);
    let mut fresh = film(spec);
    fresh.add(&samples[..90_000]).expect("add");
    let wanted = fresh.develop().expect("develop");
    let mut film = film(spec);
    for forgotten in [1, CHUNK_SAMPLES, CHUNK_SAMPLES + 1, 3 * CHUNK_SAMPLES, samples.len()] {
        film.add(&samples[samples.len() - forgotten..]).expect("add");
        film.clear();
        film.add(&samples[..90_000]).expect("add");
        assert!(film.develop().expect("develop") == wanted, "after {forgotten} others");
        film.clear();
    }
    // Dropped at once, with chunks that the thread has.
    film.add(&samples).expect("add");
    drop(film);
    assert_silent(gpu());
}

/// A batch whose samples lie at one place ends early, however large the film: it takes no more of them than a small one.
#[test]
fn dense_batches_end_early() {
    let spec = spec(800, 640, SplatFilter::Box);
    let sample = Sample { uv: [0.51, 0.49], xyz: Xyz::new(0.1, 0.1, 0.1), w: 1.0 };
    let mut film = film(spec);
    film.add(&vec![sample; CHUNK_SAMPLES - 1]).expect("add");
    film.settle().expect("settle");
    assert_eq!(film.waiting(), CHUNK_SAMPLES - 1);
    film.add(&[sample]).expect("add");
    film.settle().expect("settle");
    assert_eq!(film.waiting(), 0, "the batch was drawn");
    assert_silent(gpu());
}

fn develop(film: &mut dyn Film, samples: &[Sample]) -> FilmData {
    film.add(samples).expect("add");
    film.count_paths(PathCounts { camera: samples.len() as u64, light: samples.len() as u64 });
    film.develop().expect("develop")
}

/// Coarse sums are those of a film of a quarter of the extent; sharpened, the film is as if they had never been.
#[test]
fn coarse_sums_leave_no_trace() {
    for place in [false, true] {
        let spec = FilmSpec { width: 131, height: 90, ..spec(1, 1, SplatFilter::Gaussian) };
        let samples = scene(&spec, 1_500, 3, 4);
        let make = |spec| match place {
            true => VulkanFilm::summed_on_host(gpu().clone(), spec).expect("a film"),
            false => film(spec),
        };
        let quarter = FilmSpec { width: 33, height: 23, filter: SplatFilter::Tent, ..spec };
        let (wanted, sharp) = (develop(&mut make(quarter), &samples), develop(&mut make(spec), &samples));
        let mut film = make(spec);
        film.add(&scene(&spec, 5_000, 77, 2)).expect("add");
        film.begin_coarsely().expect("coarse");
        assert_eq!(develop(&mut film, &samples), wanted);
        assert!(film.is_coarse() && film.must_sharpen(), "more than one camera sample for 16 texels");
        film.display(&settings(Reconstruction::Gaussian, 0.7)).expect("display");
        film.sharpen();
        assert_eq!(film.counts(), Default::default());
        assert_eq!(develop(&mut film, &samples), sharp);
        film.begin_coarsely().expect("coarse");
        assert_eq!(develop(&mut film, &samples), wanted, "a second view");
        film.clear();
        assert!(!film.is_coarse());
    }
    assert_silent(gpu());
}

/// The picture of coarse sums is as near to the truth as that of full ones, at the level of detail up to which they are taken and in
/// every internal resolution: with the noise of samples, and without noise within one step of 8 bits.
#[test]
fn coarse_sums_show_the_same_picture() {
    let spec = spec(320, 240, SplatFilter::Gaussian);
    let truth = |u: f32, v: f32| 0.5 + 0.3 * (9.0 * u).sin() * (7.0 * v).cos();
    let settings = settings(Reconstruction::Gaussian, 0.0);
    for noise in [0.0, 1.0] {
        let mut random = Random(31);
        let samples: Vec<Sample> = (0..4800)
            .map(|i| {
                // The R2 sequence (Roberts 2018).
                let place = |a: f64| (a * f64::from(i)).fract() as f32 * 1.06 - 0.03;
                let uv = [place(0.754_877_666_246_693), place(0.569_840_290_998_053)];
                let y = truth(uv[0], uv[1]) * (1.0 + noise * (2.0 * random.f32() - 1.0));
                Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
            })
            .collect();
        for detail in [1, 2, 4] {
            let [full, coarse] = [false, true].map(|coarse| {
                let mut film = film(spec);
                if coarse {
                    film.begin_coarsely().expect("coarse");
                }
                film.add(&samples).expect("add");
                assert!(!film.must_sharpen(), "case too easy");
                let picture = film.reconstruct(&settings, detail).expect("reconstruct");
                let width = spec.width.div_ceil(detail);
                let error = |(i, xyz): (usize, &[f32; 3])| {
                    let at = [i as u32 % width, i as u32 / width].map(|n| (n as f32 + 0.5) * detail as f32);
                    f64::from(xyz[1] - truth(at[0] / 320.0, at[1] / 240.0)).powi(2)
                };
                (picture.iter().enumerate().map(error).sum::<f64>() / picture.len() as f64).sqrt()
            });
            println!(
                "noise {noise}, detail {detail}: error {full:.4} by full sums, {coarse:.4} by coarse ones"
            );
            let bound = if noise > 0.0 { 1.05 * full } else { 1.0 / 255.0 };
            assert!(coarse < bound, "{coarse} and {full}");
        }
    }
    assert_silent(gpu());
}

/// A film that takes over the sums of another one goes on as that one would; in memory, a film takes its own sums to another device.
#[test]
fn sums_outlive_their_device() {
    let spec = spec(97, 61, SplatFilter::Gaussian);
    let [before, after] = [4, 5].map(|seed| scene(&spec, 20_000, seed, 3));
    let mut kept = film(spec);
    develop(&mut kept, &before);
    let backup = kept.begin_backup().expect("backup").wait().expect("sums");
    let mut restored = film(spec);
    restored.add(&after).expect("what is forgotten");
    restored.restore(&backup).expect("restore");
    assert_eq!(restored.develop().expect("develop"), kept.develop().expect("develop"));
    let (got, wanted) = (develop(&mut restored, &after), develop(&mut kept, &after));
    assert_eq!(got.counts, wanted.counts);
    assert!(error(&got.camera, &wanted.camera) < 1e-6, "the rests are lost, and nothing else");
    for settings in [settings(Reconstruction::Gaussian, 0.7), settings(Reconstruction::None, 0.0)] {
        let pictures =
            [&mut restored, &mut kept].map(|film| film.reconstruct(&settings, 1).expect("picture"));
        let pairs = pictures[0].iter().flatten().zip(pictures[1].iter().flatten());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() <= 1e-4 * b.abs().max(0.1)));
    }
    assert!(kept.moved_to(gpu()).is_none(), "its sums were on the device");
    // Onto a device that is the processor, and without a device.
    let mut host = VulkanFilm::summed_on_host(gpu().clone(), spec).expect("a film");
    host.restore(&backup).expect("restore");
    let got = develop(&mut host, &after);
    assert_eq!(got.counts, wanted.counts);
    assert!(error(&got.camera, &wanted.camera) < 1e-6 && error(&got.light, &wanted.light) < 1e-6);
    let mut alone = host.into_reference(2).expect("sums in memory").expect("threads");
    assert_eq!(alone.develop().expect("develop"), got);
    let mut reference = ReferenceFilm::new(spec, 2).expect("a film");
    reference.restore(&backup).expect("restore");
    assert_eq!(develop(&mut reference, &after), got);

    let other = crate::common::open(false);
    let mut host = VulkanFilm::summed_on_host(gpu().clone(), spec).expect("a film");
    let sums = develop(&mut host, &before);
    host.display(&settings(Reconstruction::Gaussian, 0.0)).expect("display");
    let mut moved = host.moved_to(&other).expect("sums in memory");
    assert_eq!(moved.develop().expect("develop"), sums);
    moved.display(&settings(Reconstruction::Gaussian, 0.0)).expect("display");
    assert_silent(gpu());
    assert_silent(&other);
}
