//! The running variance, and what it says of the error of a pixel.

use std::sync::Arc;

use pointillist::client::develop::mean_variance;
use pointillist::client::lod::{LocalStatistics, StreamLod};
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmData, FilmSpec, SplatFilter, Summation, VarianceForm};
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::scene::desc::IntegratorDesc;
use pointillist::stream::{Sample, SampleSink, UvWindow};
use pointillist::tracer::integrator::{PathTracer, RenderContext};
use pointillist::tracer::medium::MediumIndex;
use pointillist::tracer::sampler::cells::ScreenCells;
use pointillist::tracer::{Camera, Integrator, Scene};

use crate::Row;
use crate::sums::{films, large};
use crate::support::device::{assert_silent, gpu};

fn grey(uv: [f32; 2], y: f32) -> Sample {
    Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
}

fn spec(width: u32, height: u32, form: VarianceForm) -> FilmSpec {
    let (filter, sums) = (SplatFilter::Box, Summation::default());
    FilmSpec { width, height, filter, variance: Some(form), sums }
}

/// What a film holds after these samples, `batch` at a time.
fn developed(film: &mut dyn Film, samples: &[Sample], batch: usize) -> FilmData {
    for part in samples.chunks(batch) {
        film.add(part).unwrap();
        film.flush().unwrap();
    }
    film.develop().unwrap()
}

/// `Σ (Y − Ȳ)²` of the camera stream in a texel, in luminance².
fn deviations(data: &FilmData, texel: usize) -> f64 {
    f64::from(data.camera_variance[texel]) * f64::from(data.luminance_scale).powi(2)
}

/// The same of samples of weight 1, in two passes of `f64`.
fn exact_deviations(samples: &[Sample]) -> f64 {
    let mean = samples.iter().map(|s| f64::from(s.xyz.y)).sum::<f64>() / samples.len() as f64;
    samples.iter().map(|s| (f64::from(s.xyz.y) - mean).powi(2)).sum()
}

/// The sum of squares less the squared sum, in `f32`.
fn naive_deviations(samples: &[Sample]) -> f64 {
    let [sum, squares] =
        samples.iter().fold([0.0f32; 2], |[sum, squares], s| [sum + s.xyz.y, squares + s.xyz.y * s.xyz.y]);
    f64::from(squares - sum * sum / samples.len() as f32)
}

/// The product form gives the sum of squares for batches of any size; the paper's is low, most so for small ones.
#[test]
fn p2_batches_of_any_size() {
    let mut numbers = Random(1);
    let samples: Vec<Sample> = (0..240).map(|_| grey([0.5; 2], numbers.f32())).collect();
    let exact = exact_deviations(&samples);
    let worst = |form: VarianceForm| {
        [0, 1].map(|device| {
            let error = |batch: usize| {
                let (_, film) = &mut films(spec(1, 1, form))[device];
                (deviations(&developed(&mut **film, &samples, batch), 0) / exact - 1.0).abs()
            };
            [1, 2, 3, 7, 60, 240].into_iter().map(error).fold(0.0, f64::max)
        })
    };
    let (ours, paper) = (worst(VarianceForm::Product), worst(VarianceForm::Paper));
    for (i, device) in ["GPU", "CPU"].into_iter().enumerate() {
        Row {
            case: &format!("P2 batches of 1 to 240 samples, {device}"),
            measure: "relative error of the sum of squares",
            figure: ours[i],
            naive: ("the paper's form", paper[i]),
            bound: 1e-5,
        }
        .check();
    }
}

/// Over many texels of four samples the mean of V/(n − 1) is σ² = 1/12. The paper's form has (n−1)²/n² in each term. The standard
/// error of the mean of 10,000 such variances is 0.7 %.
#[test]
fn p2_few_samples_are_not_biased() {
    let side = 100;
    let mut numbers = Random(2);
    let rounds: Vec<Vec<Sample>> = (0..4)
        .map(|_| {
            let at = |i: u32| [(i % side) as f32 + 0.5, (i / side) as f32 + 0.5].map(|p| p / side as f32);
            (0..side * side).map(|i| grey(at(i), numbers.f32())).collect()
        })
        .collect();
    let bias = |form: VarianceForm| {
        films(spec(side, side, form)).map(|(_, mut film)| {
            let mut data = FilmData::default();
            rounds.iter().for_each(|round| data = developed(&mut *film, round, round.len()));
            let texels = data.camera_variance.len();
            let mean = (0..texels).map(|i| deviations(&data, i)).sum::<f64>() / texels as f64 / 3.0;
            (mean * 12.0 - 1.0).abs()
        })
    };
    let (ours, paper) = (bias(VarianceForm::Product), bias(VarianceForm::Paper));
    for (i, device) in ["GPU", "CPU"].into_iter().enumerate() {
        Row {
            case: &format!("P2 four samples in a texel, {device}"),
            measure: "bias of V/(n − 1)",
            figure: ours[i],
            naive: ("the paper's form", paper[i]),
            bound: 0.03,
        }
        .check();
    }
}

/// One sample in each texel says nothing of the variance: V is 0, and the paper takes the picture for clean. Two pseudo-samples among
/// the eight that are averaged keep the error above a quarter of the truth, here a relative variance of 1, however few samples there are.
#[test]
fn p2_first_samples_are_not_clean() {
    let side = 40u32;
    let mut numbers = Random(3);
    let at = |i: u32| [(i % side) as f32 + 0.5, (i / side) as f32 + 0.5].map(|p| p / side as f32);
    let samples: Vec<Sample> =
        (0..side * side).map(|i| grey(at(i), if numbers.f32() < 0.5 { 0.0 } else { 2.0 })).collect();
    for (device, mut film) in films(spec(side, side, VarianceForm::Product)) {
        let data = developed(&mut *film, &samples, samples.len());
        assert!(data.camera_variance.iter().all(|v| *v == 0.0), "one sample has no deviation");
        let lod = StreamLod::new(u64::from(side * side), samples.len() as u64, 6).unwrap();
        let place = LocalStatistics { luminance: 1.0, weight: 1.0, variance: 0.0, summed: false };
        let stated = lod.relative_variance(&place, 1.0, SplatFilter::Box.energy());
        Row {
            case: &format!("P2 one sample in every texel, {device}"),
            measure: "true over stated variance of the mean",
            figure: 1.0 / f64::from(stated),
            naive: ("V alone", 1.0 / f64::from(data.camera_variance[0])),
            bound: 5.0,
        }
        .check();
    }
}

/// A mean of 10^6 with a deviation of 0.29: the f32 sum of a batch is known to 2^-25 of itself, so that its mean is off by up to a tenth
/// of the deviation. That enters V by its square and averages over the 64 batches or more, which gives some 5e-4. (A single batch of
/// thousands in one texel is off by up to 1 %.)
#[test]
#[ignore = "open: 1.4e-3 on the device, because the f32 sum of a batch rounds its mean"]
fn n15_a_mean_far_above_the_deviation() {
    let mut numbers = Random(15);
    let samples: Vec<Sample> = (0..65_536).map(|_| grey([0.503, 0.503], 1e6 + numbers.f32())).collect();
    let wide =
        FilmSpec { variance: Some(VarianceForm::Product), ..large(SplatFilter::Box, Summation::TwoFloat) };
    let texel = 100 * 200 + 100;
    for (i, device) in ["GPU", "CPU"].into_iter().enumerate() {
        let (mut worst, mut naive, mut order) = (0.0f64, 0.0f64, 0.0f64);
        for batch in [4usize, 16, 64, 1024] {
            let part = &samples[..(64 * batch).clamp(2048, samples.len())];
            let exact = exact_deviations(part);
            let of = |part: &[Sample]| {
                let (_, film) = &mut films(wide)[i];
                let v = deviations(&developed(&mut **film, part, batch), texel);
                assert!(v >= 0.0, "batches of {batch}: a variance of {v}");
                v / exact
            };
            let mut reversed = part.to_vec();
            reversed.reverse();
            let (forward, backward) = (of(part), of(&reversed));
            worst = worst.max((forward - 1.0).abs());
            order = order.max((forward - backward).abs());
            naive = naive.max((naive_deviations(part) / exact - 1.0).abs());
        }
        let case = format!("N15 1e6 + U(0, 1) in one texel, batches of 4 to 1024, {device}");
        let naive = ("sum of squares less squared sum, f32", naive);
        Row { case: &case, measure: "relative error of the variance", figure: worst, naive, bound: 1e-3 }
            .check();
        // Both orders are within 1e-3.
        let measure = "the same samples in the other order: relative difference";
        Row { case: &case, measure, figure: order, naive, bound: 2e-3 }.check();
    }
    assert_silent(gpu());
}

/// Equal samples have no variance, in whatever batches. What is left is the square of the rounding of the mean of a batch.
#[test]
fn n15_equal_samples_have_no_variance() {
    let (mut worst, mut naive) = ([0.0f64; 2], 0.0f64);
    for y in [1.0f32, 0.1, 1e6, 1e-15] {
        let samples = vec![grey([0.5; 2], y); 600];
        let square = 600.0 * f64::from(y).powi(2);
        naive = naive.max(naive_deviations(&samples).abs() / square);
        for batch in [1, 3, 600] {
            for (worst, (_, mut film)) in worst.iter_mut().zip(films(spec(1, 1, VarianceForm::Product))) {
                let data = developed(&mut *film, &samples, batch);
                *worst = worst.max(deviations(&data, 0).abs() / square);
            }
        }
    }
    for (device, figure) in ["GPU", "CPU"].into_iter().zip(worst) {
        Row {
            case: &format!("N15 equal samples, {device}"),
            measure: "variance over squared mean",
            figure,
            naive: ("sum of squares less squared sum, f32", naive),
            bound: 1e-12,
        }
        .check();
    }
}

/// Of each pixel of many pictures: the mean of the variance that each states for its mean, and the variance of the means.
fn stated_and_true(pictures: &[(Vec<f64>, Vec<f32>)]) -> [f64; 2] {
    let n = pictures.len() as f64;
    let pixels = pictures[0].0.len();
    let stated = pictures.iter().flat_map(|(_, v)| v).map(|v| f64::from(*v)).sum::<f64>();
    let spread = |i: usize| {
        let mean = pictures.iter().map(|(m, _)| m[i]).sum::<f64>() / n;
        pictures.iter().map(|(m, _)| (m[i] - mean).powi(2)).sum::<f64>() / (n - 1.0)
    };
    [stated / n / pixels as f64, (0..pixels).map(spread).sum::<f64>() / pixels as f64]
}

/// The means and stated variances of a film.
fn picture(data: &FilmData, filter: SplatFilter) -> (Vec<f64>, Vec<f32>) {
    let means = data.camera.iter().map(|s| f64::from(s[1]) / f64::from(s[3])).collect();
    (means, mean_variance(data, filter.energy()))
}

/// 64 pictures of 16 independent samples per pixel: the variance that each states for the means of its pixels, over the variance of
/// these means. The standard error of the ratio is 1 % for the box, and 2 % for the Gaussian, of which some seven pixels vary together.
#[test]
fn p2_predicted_variance_of_independent_samples() {
    let side = 24;
    for filter in [SplatFilter::Box, SplatFilter::Gaussian] {
        let ratio = |form: VarianceForm, batch: usize| {
            let spec = FilmSpec { filter, ..spec(side, side, form) };
            let window = spec.window();
            let mut film = ReferenceFilm::new(spec, 1).unwrap();
            let pictures: Vec<_> = (0..64)
                .map(|seed| {
                    let mut random = Random(1000 + seed);
                    let [u, v] = [0, 1].map(|i| window.max[i] - window.min[i]);
                    let count = (16.0 * u * v * (side * side) as f32) as usize;
                    let samples: Vec<Sample> = (0..count)
                        .map(|_| {
                            let at = [random.f32() * u + window.min[0], random.f32() * v + window.min[1]];
                            grey(at, 0.2 + random.f32().powi(4))
                        })
                        .collect();
                    film.clear();
                    picture(&developed(&mut film, &samples, batch), filter)
                })
                .collect();
            let [stated, real] = stated_and_true(&pictures);
            stated / real
        };
        let ours = [64, 576, 4096, 65_536].map(|batch| ratio(VarianceForm::Product, batch));
        let [few, all] = [64, 65_536].map(|batch| ratio(VarianceForm::Paper, batch));
        // With the Gaussian a batch is small beside what a texel collects, and the paper's form is off by less; there the number of
        // samples is what is easily wrong.
        let naive = match filter {
            SplatFilter::Box => ("the paper's form, batches of 64", few),
            _ => ("W as the number of samples", ours[0] / f64::from(filter.energy())),
        };
        println!(
            "P2 stated over true variance by size of batches, {filter:?}: {ours:.3?}; the paper's {few:.3}, {all:.3}"
        );
        let case = format!("P2 64 pictures of independent samples, batches of 64 to 65,536, {filter:?}");
        let figure = ours.map(|r| (r - 1.0).abs()).into_iter().fold(0.0, f64::max);
        let measure = "stated over true variance of a pixel, less 1";
        Row { case: &case, measure, figure, naive: (naive.0, (naive.1 - 1.0).abs()), bound: 0.05 }.check();
        let trend = ours.iter().map(|r| (r / ours[0] - 1.0).abs()).fold(0.0, f64::max);
        let naive = ("the paper's form", (all / few - 1.0).abs());
        Row { case: &case, measure: "change with the size of batches", figure: trend, naive, bound: 1e-3 }
            .check();
    }
}

/// Keeps the samples of a path tracer.
struct Collect(Vec<Sample>);

impl SampleSink for Collect {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.push(Sample { uv, xyz: value * weight, w: weight });
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// The Cornell box by path tracing, 64 paths per pixel, 48 seeds: samples of a low-discrepancy sequence cover a pixel more evenly than
/// independent ones, so that the variance within it states too much. Replicates know: the variance of the mean of 24 of them against
/// that of 24 others is the same within chance, some 10 %, since few bright pixels have most of it.
#[test]
fn p3_replicates_know_the_error_of_a_sequence() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml");
    let mut desc = pointillist::scene::load(&path, &[]).unwrap().desc;
    [desc.film.width, desc.film.height] = [16, 16];
    let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
    let IntegratorDesc { max_depth, rr_depth, hide_emitters, .. } = desc.integrator;
    let spec = spec(16, 16, VarianceForm::Product);
    let render = |seed: u32| {
        let context = RenderContext {
            scene: scene.clone(),
            camera: camera.clone(),
            other_eye: None,
            seed,
            window: UvWindow::PICTURE,
            max_depth,
            rr_depth,
            hide_emitters,
            places: None,
            screen: Default::default(),
            cells: ScreenCells::of_pixels([f64::from(spec.width), f64::from(spec.height)]),
            medium: MediumIndex::VACUUM,
            on_boundary: false,
            photons: Default::default(),
        };
        let (tracer, mut sink) = (PathTracer { context }, Collect(Vec::new()));
        (0..64 * 256).for_each(|index| tracer.trace(index, &mut (), &mut sink));
        let mut film = ReferenceFilm::new(spec, 1).unwrap();
        picture(&developed(&mut film, &sink.0, usize::MAX), spec.filter)
    };
    let pictures: Vec<_> = (0..48).map(|i| render(31 + i)).collect();
    let [within, real] = stated_and_true(&pictures);
    let [first, second] = [&pictures[..24], &pictures[24..]].map(|half| stated_and_true(half)[1]);
    println!("P3 variance within pixels over that of their means, Cornell box: {:.2}", within / real);
    Row {
        case: "P3 Cornell box, 64 paths per pixel",
        measure: "stated over true variance of a pixel, less 1",
        figure: (first / second - 1.0).abs(),
        naive: ("variance within the pixel", within / real - 1.0),
        bound: 0.25,
    }
    .check();
}
