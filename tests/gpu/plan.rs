//! What is off takes nothing on the device: no pass, no image, no pipeline.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::common::{assert_silent, open, scene, settings, spec};
use pointillist::client::background::{BackgroundPolicy, join_abandoned};
use pointillist::client::film::VulkanFilm;
use pointillist::client::memory::{FilmContents, film_memory};
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{
    ClientError, Film, FilmSpec, Glare, Masking, Reconstruction, Settings, SplatFilter, ToneCurve,
};
use pointillist::gpu::{DeviceKind, Gpu, Region, read_image};
use pointillist::image::stereo::StereoLayout;
use pointillist::stream::PathCounts;

/// Without noise masking there is no variance: no pass, no image, and the same picture bit for bit. One stream has the images
/// of one stream. What is there is exactly this.
#[test]
fn what_is_off_is_not_there() {
    let with = spec(64, 48, SplatFilter::Gaussian);
    let without = FilmSpec { variance: None, ..with };
    let samples = scene(&with, 30_000, 4, 0);
    let show = |spec, settings: &Settings| {
        let gpu = open(false);
        gpu.set_timing(true);
        let mut film = VulkanFilm::new(gpu.clone(), spec).expect("a film");
        film.add(&samples).expect("add");
        let picture = film.display(settings);
        let passes: BTreeSet<_> = gpu.take_rows().rows.iter().map(|r| r.name).collect();
        assert_silent(&gpu);
        (picture, passes, gpu.inventory())
    };
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let (full, passes, _) = show(with, &plain);
    assert!(passes.contains("variance"));
    let (picture, passes, inventory) = show(without, &plain);
    assert_eq!(picture.expect("display"), full.expect("display"));
    let expected = ["clear", "fold", "mips", "readback", "reconstruct", "splat", "tonemap"];
    assert_eq!(passes.into_iter().collect::<Vec<_>>(), expected);
    let names: Vec<&str> = inventory.memory.iter().map(|(name, _)| name.as_str()).collect();
    let expected = [
        "batch color",
        "camera color rests",
        "camera color sums",
        "picture XYZ",
        "picture encoded",
        "picture readback",
        "samples 0",
    ];
    assert_eq!(names, expected);
    let shaders: Vec<&str> = inventory.pipelines.iter().filter_map(|p| p.split(' ').next()).collect();
    // So many samples need no blur: no coarser level is made either.
    let reconstruct =
        if crate::common::gpu().prefers_compute() { "reconstruct.comp" } else { "reconstruct.frag" };
    assert_eq!(shaders, ["splat_color.frag", "fold.comp", reconstruct, "tonemap.frag"]);
    // What needs a variance says so.
    let (refused, ..) = show(without, &settings(Reconstruction::Gaussian, 1.0));
    assert!(matches!(refused, Err(ClientError::NoVariance)));
    let mut reference = ReferenceFilm::new(without, 1).expect("a film");
    reference.add(&samples).expect("add");
    assert!(matches!(
        reference.display(&settings(Reconstruction::Gaussian, 1.0)),
        Err(ClientError::NoVariance)
    ));
    let mut full = ReferenceFilm::new(with, 1).expect("a film");
    full.add(&samples).expect("add");
    assert_eq!(reference.display(&plain).expect("display"), full.display(&plain).expect("display"));
    assert!(reference.develop().expect("develop").camera_variance.is_empty());
}

/// A film that does not wait shows the picture of before while a pipeline is compiled, then the one that was asked for, to the bit;
/// the first picture and one that is read back are waited for.
#[test]
fn pipelines_are_compiled_aside() {
    let own = open(false);
    let spec = spec(64, 48, SplatFilter::Gaussian);
    let mut film = VulkanFilm::new(own.clone(), spec).expect("a film");
    film.set_background_policy(BackgroundPolicy::Background);
    film.add(&scene(&spec, 30_000, 4, 2)).expect("add");
    film.flush().expect("flush");
    let paint = |film: &mut VulkanFilm, settings: &Settings| {
        let mut frame = own.begin().expect("a frame");
        film.paint(&mut frame.cmd(), settings, 1, &mut []).expect("paint");
        own.wait(frame.submit().expect("submit")).expect("wait");
        let image = film.painted().expect("painted");
        let bytes = read_image(&own, image, 0, Region { origin: [0, 0], extent: [64, 48] }).expect("read");
        bytes.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect::<Vec<_>>()
    };
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let mut last = paint(&mut film, &plain);
    assert!(!film.has_given_up(), "there is nothing to show meanwhile");
    for vm in [0.5, 1.0] {
        for curve in [ToneCurve::AgX, ToneCurve::Paper] {
            let settings =
                Settings { curve, masking: Masking::LowPass, ..settings(Reconstruction::Mipmap, vm) };
            let compiled = own.compiled_pipelines();
            let mut given_up = 0;
            let shown = loop {
                let shown = paint(&mut film, &settings);
                if !film.has_given_up() {
                    break shown;
                }
                given_up += 1;
                assert!(shown == last, "a picture that is half done is shown");
                std::thread::sleep(Duration::from_millis(1));
            };
            let is_new = own.compiled_pipelines() > compiled;
            assert_eq!(given_up > 0, is_new, "{vm} {curve:?}: {given_up} times");
            // The first picture has compiled the curve of the paper, and the strength is no constant.
            assert_eq!(is_new, vm == 0.5 && curve == ToneCurve::AgX, "{vm} {curve:?}");
            last = shown;
            assert_eq!(film.display(&settings).expect("display").rgb, last);
        }
    }
    // What is read back is waited for, although it needs another pipeline.
    let other = Settings { curve: ToneCurve::Paper, ..settings(Reconstruction::CatmullRom, 0.0) };
    assert_ne!(film.display(&other).expect("display").rgb, last);
    drop(film);
    join_abandoned();
    assert_silent(&own);
}

/// What is told of a film's memory is what is allocated, image by image; in all within 5 %, but for a `padding` of that share.
#[track_caller]
fn assert_told(gpu: &Gpu, spec: &FilmSpec, settings: &Settings, contents: FilmContents, padding: f64) {
    let told = film_memory(spec, settings, contents, !gpu.fetches_any_level());
    // Tables that no film is too small for.
    let small = |name: &str| {
        ["blue noise", "transfer", "glare line", "stereo coding"].contains(&name)
            || name.ends_with("readback")
    };
    let held: Vec<_> = gpu.inventory().memory.into_iter().filter(|(name, _)| !small(name)).collect();
    let names = |list: &[(String, u64)]| list.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&told), names(&held));
    let sum = |list: &[(String, u64)]| list.iter().map(|(_, bytes)| *bytes as f64).sum::<f64>();
    let ratio = sum(&told) / sum(&gpu.inventory().memory);
    assert!((0.95 - padding..1.05).contains(&ratio), "{ratio}: told {told:?}, held {held:?}");
}

/// With and without variance, masking of both kinds, glare with post-processes, one stream and two.
#[test]
fn the_memory_of_a_film_is_told() {
    for (width, height, streams) in
        [(640, 360, [true, false]), (640, 360, [true, true]), (640, 360, [false, true])]
    {
        for (variance, masking, glare) in [
            (false, None, false),
            (true, None, false),
            (true, Some(Masking::LowPass), false),
            (true, Some(Masking::Bilateral), false),
            (false, None, true),
        ] {
            let own = open(false);
            let full = spec(width, height, SplatFilter::Gaussian);
            let spec = FilmSpec { variance: full.variance.filter(|_| variance), ..full };
            let plain = settings(Reconstruction::Gaussian, if masking.is_some() { 0.5 } else { 0.0 });
            let mut settings =
                Settings { masking: masking.unwrap_or_default(), glare: glare.then(Glare::default), ..plain };
            for post in settings.post.effects() {
                settings.switch(post.name, glare);
            }
            let mut film = VulkanFilm::new(own.clone(), spec).expect("a film");
            let every_light = match streams {
                [true, false] => 0,
                [true, true] => 2,
                [false, _] => 1,
            };
            // Four samples of each stream for a texel, where the bilateral filter is to run.
            let count = if masking == Some(Masking::Bilateral) { 2_200_000 } else { 2_000 };
            film.add(&scene(&spec, count, 9, every_light)).expect("add");
            film.count_paths(PathCounts { camera: count as u64, light: count as u64 });
            film.display(&settings).expect("display");
            own.free_retired().expect("the device");
            // Hardware rounds the rows of an image up to whole blocks, of 128 rows on an NVIDIA H200, and each level again.
            let padding = if own.info().kind == DeviceKind::Cpu { 0.0 } else { 0.1 };
            assert_told(&own, &spec, &settings, FilmContents { streams, samples: count, eyes: 1 }, padding);
            assert_silent(&own);
        }
    }
}

/// Pictures of 4K, by their sizes alone, with few samples: a plain one, and one with both streams, masking and glare.
#[test]
fn the_memory_of_a_large_film_is_told() {
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let glare = Some(Glare::default());
    let full = Settings { masking: Masking::LowPass, glare, ..settings(Reconstruction::Gaussian, 0.5) };
    for (settings, streams, every_light) in [(plain, [true, false], 0), (full, [true, true], 2)] {
        let own = open(false);
        let spec = spec(3840, 2160, SplatFilter::Gaussian);
        let mut film = VulkanFilm::new(own.clone(), spec).expect("a film");
        film.add(&scene(&spec, 1_000, 9, every_light)).expect("add");
        film.count_paths(PathCounts { camera: 1_000, light: 1_000 });
        film.display(&settings).expect("display");
        own.free_retired().expect("the device");
        assert_told(&own, &spec, &settings, FilmContents { streams, samples: 1_000, eyes: 1 }, 0.0);
        assert_silent(&own);
    }
}

/// A film of two eyes: images have two layers, batches are there twice, tables once, and the composed picture has the size of its layout.
#[test]
fn the_memory_of_two_eyes_is_told() {
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let glare = Settings { glare: Some(Glare::default()), ..plain.clone() };
    let masked = Settings { masking: Masking::LowPass, ..settings(Reconstruction::Gaussian, 0.5) };
    let anaglyph = Settings { stereo: StereoLayout::Anaglyph(Default::default()), ..plain.clone() };
    for (settings, streams, every_light) in [
        (plain, [true, false], 0),
        (glare, [true, true], 2),
        (masked, [true, true], 2),
        (anaglyph, [true, false], 0),
    ] {
        let own = open(false);
        let spec = spec(640, 360, SplatFilter::Gaussian);
        let film = VulkanFilm::new(own.clone(), spec).expect("a film");
        let mut film = film.with_right_eye().expect("a film");
        let samples = scene(&spec, 2_000, 9, every_light);
        film.add(&samples).expect("add");
        film.add_right(&samples).expect("add");
        film.count_paths(PathCounts { camera: 2_000, light: 2_000 });
        film.display(&settings).expect("display");
        own.free_retired().expect("the device");
        let padding = if own.info().kind == DeviceKind::Cpu { 0.0 } else { 0.1 };
        assert_told(&own, &spec, &settings, FilmContents { streams, samples: 2_000, eyes: 2 }, padding);
        assert_silent(&own);
    }
}
