#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use glam::DVec2;

use crate::accounting::accumulator::{CheckpointPolicy, RenderAccount, SampleAccumulator};
use crate::client::{SplatFilter, Summation};
use crate::color::Xyz;
use crate::denoise::noise_filter::*;
use crate::math::random::Random;
use crate::stream::{CHUNK, PathCounts, Sample};

const SIDE: u32 = 64;

const FILM: FilmSpec = FilmSpec {
    width: SIDE,
    height: SIDE,
    filter: SplatFilter::Box,
    variance: None,
    sums: Summation::TwoFloat,
};

fn cornell_box() -> EpochView {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml");
    let desc = crate::scene::load(&path, &[]).unwrap().desc;
    let scene = Arc::new(Scene::prepare(&desc).unwrap());
    EpochView { scene, camera: Camera::of(&desc).unwrap() }
}

/// The accounts of a render, which hold samples out if the error is wanted.
fn accounts(wants_error: bool) -> SampleAccumulator {
    let mut samples = AccumulatedSamples::new([SIDE; 2], FILM.filter.energy());
    if wants_error {
        samples.hold_out();
    }
    let account = RenderAccount { render: 0, samples, due: f64::INFINITY };
    SampleAccumulator::start(account, CheckpointPolicy::WhenIdle, drop).unwrap()
}

/// A filter of the Cornell box that has denoised this many noisy samples per pixel.
fn filtered(per_pixel: u64, wants_error: bool) -> NoiseFilter {
    filtered_view(cornell_box(), per_pixel, wants_error)
}

/// The same of this view.
fn filtered_view(view: EpochView, per_pixel: u64, wants_error: bool) -> NoiseFilter {
    let accounts = accounts(wants_error);
    let mut filter = NoiseFilter::start(1, accounts.reader()).unwrap();
    filter.begin(FILM, view, None);
    let mut random = Random(3);
    let samples = per_pixel * u64::from(SIDE * SIDE);
    for chunk in 0..samples / CHUNK {
        let sample = |_| {
            let y = 0.5 + random.f32();
            let uv = [random.f32(), random.f32()];
            Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
        };
        let block: Vec<Sample> = (0..CHUNK).map(sample).collect();
        accounts.add(chunk * CHUNK, PathCounts { camera: CHUNK, light: 0 }, &block, Duration::ZERO);
    }
    filter.prepare(Denoise::Wavelet);
    // The first answer is about the error, the second is the picture.
    for _ in 0..2 {
        filter.filter(Denoise::Wavelet, samples, None);
        filter.wait();
    }
    filter
}

#[test]
fn the_error_of_the_filtered_picture_is_estimated_where_it_is_wanted() {
    let mut known = filtered(16, true);
    let error = known.error(Denoise::Wavelet).expect("there are samples enough").relative[0].value;
    // Without the filter the error is 0.289/√16.
    assert!(error > 0.0 && error < 0.072, "{error}");
    assert!(known.error(Denoise::Oidn).is_none());
    // Another film begins without a picture.
    known.begin(FILM, cornell_box(), None);
    assert!(known.error(Denoise::Wavelet).is_none());
    assert!(filtered(16, false).error(Denoise::Wavelet).is_none(), "nobody wants it");
    assert!(filtered(2, true).error(Denoise::Wavelet).is_none(), "there are too few samples");
}

/// If the last view shows too little of the present one, samples are waited for, and the filter works as without an earlier view.
#[test]
fn a_view_that_shows_too_little_is_not_a_failure() {
    let accounts = accounts(false);
    let mut filter = NoiseFilter::start(1, accounts.reader()).unwrap();
    let kind = Denoise::Wavelet;
    filter.reprojecting = true;
    let took = Duration::from_millis(30);
    let answer = |is_reprojection| {
        let content = AnswerContent::Picture(PictureAnswer { is_reprojection, frame: None, took });
        FilterAnswer { number: 0, kind, content }
    };
    assert!(filter.take(answer(true)).is_none());
    assert!(!filter.is_reprojecting() && filter.reprojections() == 0 && filter.shown().is_none());
    assert!(filter.reprojection == took && filter.failed.is_empty());
    // A filter that ran out of memory counts as failed.
    filter.take(answer(false));
    assert!(filter.failed == [kind]);
}

/// The last picture steers the first samples of a view that it shows in part, where that is wanted, and not those of another scene.
#[test]
fn samples_are_steered_where_that_is_wanted() {
    let window = Some(UvWindow::PICTURE);
    let cases = [
        ("wanted", true, window, true),
        ("not wanted", true, None, false),
        ("another", false, window, false),
    ];
    for (case, is_same_scene, steered, expected) in cases {
        let view = cornell_box();
        let mut filter = filtered_view(view.clone(), 2, false);
        let scene = if is_same_scene { view.scene } else { cornell_box().scene };
        let camera = view.camera.cropped(DVec2::new(0.2, 0.0), DVec2::ONE);
        let kind = Denoise::Wavelet;
        filter.begin(FILM, EpochView { scene, camera }, Some(CarryOver { kind, steered }));
        assert!(filter.take_steering().is_none(), "{case}: the last view has none");
        filter.prepare(kind);
        // Until the features have been traced, which comes after the reprojection.
        while !filter.is_ready(kind, &FILM, u64::MAX) {
            std::thread::sleep(Duration::from_millis(1));
        }
        filter.poll();
        assert_eq!(filter.take_steering().is_some(), expected, "{case}");
        assert!(filter.take_steering().is_none(), "{case}: it is taken once");
    }
}
