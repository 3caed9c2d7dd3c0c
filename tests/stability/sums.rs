//! Sums of many samples in one texel, on the Vulkan device and its reference on the CPU. The film in `f64` is the judge.

use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{CHUNK_SAMPLES, Film, FilmSpec, SplatFilter, Summation};
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::stream::Sample;

use crate::Row;
use crate::support::device::{assert_silent, gpu};

/// A film that is large enough for one copy of the batch, so that all samples of a texel meet in one `f32`.
pub fn large(filter: SplatFilter, sums: Summation) -> FilmSpec {
    let spec = FilmSpec { width: 200, height: 200, filter, variance: None, sums };
    assert_eq!(spec.batch_slots(), 1);
    spec
}

/// The two films of a specification, and their names.
pub fn films(spec: FilmSpec) -> [(&'static str, Box<dyn Film>); 2] {
    let device = VulkanFilm::new(gpu().clone(), spec).unwrap();
    [("GPU", Box::new(device)), ("CPU", Box::new(ReferenceFilm::new(spec, 1).unwrap()))]
}

/// `Σ f [x, y, z, w]` of one texel of the picture in `f64`.
fn judge(spec: &FilmSpec, [column, row]: [u32; 2], samples: &[Sample]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for sample in samples {
        let p = spec.texel_position(sample.uv).map(f64::from);
        let d = [0, 1].map(|i| f64::from([column, row][i] + spec.pad()) + 0.5 - p[i]);
        let f = match spec.filter {
            SplatFilter::Box => f64::from(d.iter().all(|d| *d > -0.5 && *d <= 0.5)),
            filter => {
                let weight = |d: f64| {
                    let taps = match filter {
                        SplatFilter::Tent => &[1.0f32, 0.0][..],
                        _ => &pointillist::client::filter::GAUSSIAN_TAPS,
                    };
                    let (i, t) = (d.abs() as usize, d.abs().fract());
                    let tap = |i: usize| f64::from(taps.get(i).copied().unwrap_or(0.0));
                    tap(i) + t * (tap(i + 1) - tap(i))
                };
                weight(d[0]) * weight(d[1])
            }
        };
        let Xyz { x, y, z } = sample.xyz;
        sum.iter_mut().zip([x, y, z, sample.w.abs()]).for_each(|(sum, v)| *sum += f * f64::from(v));
    }
    sum
}

/// A batch whose samples lie in one texel of the large film, at random or all at one place.
fn batch(spec: &FilmSpec, scattered: bool, color: impl Fn(usize) -> Xyz) -> Vec<Sample> {
    let mut random = Random(16);
    let at = |column: u32, t: f32, size: u32| (column as f32 + t) / size as f32;
    (0..CHUNK_SAMPLES)
        .map(|i| {
            let t =
                if scattered { [random.within(0.01, 0.99), random.within(0.01, 0.99)] } else { [0.3, 0.6] };
            let uv = [at(TEXEL[0], t[0], spec.width), at(TEXEL[1], t[1], spec.height)];
            Sample { uv, xyz: color(i), w: 1.0 }
        })
        .collect()
}

/// The texel that all samples fall into.
const TEXEL: [u32; 2] = [77, 105];

/// The largest relative error of the sums, and of X/Y and Z/Y, in the texel and its neighbours, after this many batches.
fn errors(film: &mut dyn Film, spec: &FilmSpec, samples: &[Sample], batches: usize) -> [f64; 2] {
    for _ in 0..batches {
        film.add(samples).unwrap();
    }
    let data = film.develop().unwrap();
    let mut worst = [0.0f64; 2];
    for neighbour in [[0, 0], [1, 0], [0, 1]] {
        let at = [TEXEL[0] + neighbour[0], TEXEL[1] + neighbour[1]];
        let wanted = judge(spec, at, samples).map(|sum| sum * batches as f64);
        if wanted[3] == 0.0 {
            continue;
        }
        let got = data.camera[(at[0] + at[1] * spec.width) as usize].map(f64::from);
        let of = |a: f64, b: f64| (a / b - 1.0).abs();
        worst[0] = (0..4).map(|k| of(got[k], wanted[k])).fold(worst[0], f64::max);
        let hue = |sum: &[f64; 4], k: usize| sum[k] / sum[1];
        worst[1] = [0, 2].map(|k| of(hue(&got, k), hue(&wanted, k))).into_iter().fold(worst[1], f64::max);
    }
    worst
}

/// Equal samples in one texel of a large film, whole batches of them. The naive sum is the film with sums of one float, on which one
/// batch alone goes wrong by 6e-4 (the paper blends all samples into one texture, which stands still at 2^24).
///
/// 1e-6: the batch is summed in `f64` and rounded once per centre of texels (2^-25), multiplied by the filter (2^-24), and added to
/// at most three others. That is the same in every batch; the sum of batches has 48 bits, so 2^26 samples are off by no more than 2^22.
fn equal_samples(batches: usize) {
    for filter in [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box] {
        let (spec, plain) = (large(filter, Summation::TwoFloat), large(filter, Summation::Plain));
        let samples = batch(&spec, false, |_| Xyz::new(1.0, 0.1, 0.7));
        for ((device, mut film), (_, mut naive)) in films(spec).into_iter().zip(films(plain)) {
            Row {
                case: &format!(
                    "P6 2^{} equal samples in one texel, {filter:?}, {device}",
                    batches.ilog2() + 16
                ),
                measure: "relative error of a sum",
                figure: errors(&mut *film, &spec, &samples, batches)[0],
                naive: ("plain fp32, 2^18 samples", errors(&mut *naive, &plain, &samples, 4)[0]),
                bound: 1e-6,
            }
            .check();
        }
    }
    assert_silent(gpu());
}

#[test]
fn p6_a_batch_in_one_texel() {
    equal_samples(1 << 6);
}

#[test]
#[ignore = "minutes: the same with 2^26 samples"]
fn p6_a_batch_in_one_texel_2_to_the_26() {
    equal_samples(1 << 10);
}

/// 2^26 samples in a film of one texel, whose batch has many copies.
#[test]
fn p6_a_film_of_one_texel() {
    let spec = FilmSpec { width: 1, height: 1, ..large(SplatFilter::Box, Summation::TwoFloat) };
    let sample = Sample { uv: [0.5, 0.5], xyz: Xyz::new(1.0, 0.1, 0.7), w: 1.0 };
    let naive = (0..1 << 26).fold(0.0f32, |sum, _| sum + 0.1);
    let n = f64::from(1 << 26);
    for (device, mut film) in films(spec) {
        // Below the density that is merged, so that the copies must do: 8192 samples in 1024 copies.
        let batch = vec![sample; 8 << 10];
        let batches = if device == "GPU" { 1 << 10 } else { 1 << 13 };
        for _ in 0..batches {
            film.add(&batch).unwrap();
            film.flush().unwrap();
        }
        let n_film = (batches * batch.len()) as f64;
        let got = film.develop().unwrap().camera[0].map(f64::from);
        let wanted = [1.0, 0.1, 0.7, 1.0f32].map(|v| f64::from(v) * n_film);
        Row {
            case: &format!("P6 2^{} samples in a film of one texel, {device}", n_film.log2()),
            measure: "relative error of a sum",
            figure: (0..4).map(|k| (got[k] / wanted[k] - 1.0).abs()).fold(0.0, f64::max),
            naive: ("plain fp32, 2^26 samples", (f64::from(naive) / (f64::from(0.1f32) * n) - 1.0).abs()),
            bound: 1e-6,
        }
        .check();
    }
}

/// A block of texels that has as many samples as may be in each before they are merged, at the same place in each: the most additions
/// of equal numbers to one `f32`, 288 in a batch.
#[test]
fn p6_the_densest_batch_that_is_not_merged() {
    const BATCHES: usize = 256;
    let spec = large(SplatFilter::Gaussian, Summation::TwoFloat);
    let samples: Vec<Sample> = (0..8 * 24 * 24)
        .map(|i| {
            let at = [i % 24, i / 24 % 24];
            let uv = [0, 1].map(|k| (TEXEL[k] as f32 - 12.0 + at[k] as f32 + 0.3) / 200.0);
            Sample { uv, xyz: Xyz::new(1.0, 0.1, 0.7), w: 1.0 }
        })
        .collect();
    let taps: Vec<f32> = samples.iter().map(|s| judge(&spec, TEXEL, &[*s])[1] as f32).collect();
    let naive = (0..BATCHES).flat_map(|_| &taps).fold(0.0f32, |sum, v| sum + v);
    let wanted = judge(&spec, TEXEL, &samples).map(|sum| sum * BATCHES as f64);
    for (device, mut film) in films(spec) {
        for _ in 0..BATCHES {
            film.add(&samples).unwrap();
            film.flush().unwrap();
        }
        let got = film.develop().unwrap().camera[(TEXEL[0] + TEXEL[1] * spec.width) as usize].map(f64::from);
        Row {
            case: &format!("P6 dense block of texels below the density of merging, {device}"),
            measure: "relative error of a sum",
            figure: (0..4).map(|k| (got[k] / wanted[k] - 1.0).abs()).fold(0.0, f64::max),
            naive: ("plain fp32", (f64::from(naive) / wanted[1] - 1.0).abs()),
            bound: 1e-6,
        }
        .check();
    }
    assert_silent(gpu());
}

/// Samples of which every thousandth is 1e7 times as bright as the others, at random places of one texel of a large film.
///
/// 1e-5 is what is asked for; what is reached is that of equal samples, for the same reason.
fn mixture(count: usize) {
    let spec = large(SplatFilter::Gaussian, Summation::TwoFloat);
    let mut random = Random(7);
    let ratios: Vec<[f32; 2]> = (0..CHUNK_SAMPLES).map(|_| [random.f32(), random.f32()]).collect();
    let samples = batch(&spec, true, |i| {
        // Another hue, so that the picture's shifts where the dark ones are lost.
        let (y, hue) = if i % 1000 == 500 { (1e7, [1.0, 1.0]) } else { (1.0, [3.0, 0.2]) };
        Xyz::new(y * hue[0] * (0.5 + ratios[i][0]), y, y * hue[1] * (0.5 + ratios[i][1]))
    });
    let plain = large(SplatFilter::Gaussian, Summation::Plain);
    let batches = count.div_ceil(CHUNK_SAMPLES);
    for ((device, mut film), (_, mut naive)) in films(spec).into_iter().zip(films(plain)) {
        let [sum, hue] = errors(&mut *film, &spec, &samples, batches);
        let naive = errors(&mut *naive, &plain, &samples, 16);
        let case = format!("N16 {:e} samples in one texel, a mixture of 1e7:1, {device}", count as f64);
        for (measure, figure, naive) in
            [("relative error of a sum", sum, naive[0]), ("drift of the hues X/Y and Z/Y", hue, naive[1])]
        {
            let naive = ("plain fp32, 2^20 samples", naive);
            Row { case: &case, measure, figure, naive, bound: 1e-5 }.check();
        }
    }
    assert_silent(gpu());
}

#[test]
fn n16_a_mixture_of_bright_and_dark() {
    mixture(10_000_000);
}

#[test]
#[ignore = "a minute: the same with 1e8 samples"]
fn n16_a_mixture_of_1e8_samples() {
    mixture(100_000_000);
}
