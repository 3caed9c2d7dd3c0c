//! Two eyes as layers of the same images: each against a film of its own, and the composed picture against its reference.

use crate::common::{assert_silent, film, gpu, scene, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::stereo::grid;
use pointillist::client::{
    AdaptiveFilter, ClientError, ColorOutput, Dither, Film, FilmSpec, Glare, Masking, Reconstruction,
    Settings, SplatFilter,
};
use pointillist::color::{Profile, TransferTable, Xyz};
use pointillist::gpu::{Region, read_image};
use pointillist::image::Grid;
use pointillist::image::stereo::{DisplayCoding, Eye, StereoLayout, compose};
use pointillist::stream::{PathCounts, Sample};

/// Samples of both eyes, of which every `every_light`th is one of the light stream; 0 for none. Both have as many of each stream, which the
/// level of detail depends on, and the same luminances, which the unit of the variance does.
fn samples(spec: &FilmSpec, count: usize, every_light: usize) -> [Vec<Sample>; 2] {
    let left = scene(spec, count, 31, every_light);
    let mirrored = |sample: &Sample| {
        let Sample { uv: [u, v], xyz, .. } = *sample;
        Sample { uv: [1.0 - u, v], xyz: Xyz::new(xyz.z, xyz.y, xyz.x), ..*sample }
    };
    let right = left.iter().map(mirrored).collect();
    [left, right]
}

fn filled(mut film: VulkanFilm, samples: &[Sample]) -> VulkanFilm {
    film.add(samples).expect("add");
    film.count_paths(paths(samples));
    film
}

fn paths(samples: &[Sample]) -> PathCounts {
    let light = samples.iter().filter(|sample| sample.w < 0.0).count() as u64;
    PathCounts { camera: samples.len() as u64 - light, light }
}

/// A film of both eyes with these samples, which arrive in turns as blocks do.
fn of_both(film: VulkanFilm, [left, right]: &[Vec<Sample>; 2]) -> VulkanFilm {
    let mut film = film.with_right_eye().expect("a film");
    for (left, right) in left.chunks(700).zip(right.chunks(700)) {
        film.add(left).expect("add");
        film.add_right(right).expect("add");
    }
    film.count_paths(paths(left));
    film
}

/// Settings whose passes all differ.
fn displays() -> Vec<(&'static str, Settings)> {
    let base = Settings::default();
    let mut vignetted = base.clone();
    vignetted.post.vignette.corner_loss = 0.4;
    let mut table = Profile::named("display-p3").expect("a listed name");
    let srgb = |i: usize| (i as f32 / 1023.0).powi(2).powf(1.0 / 2.4);
    table.transfer = Some(TransferTable((0..1024).map(|i| [srgb(i), srgb(i).sqrt(), srgb(i)]).collect()));
    let glare = Glare::default();
    let masked = |masking| Settings { vm: 0.5, masking, ..base.clone() };
    vec![
        ("plain", base.clone()),
        ("Catmull–Rom", Settings { reconstruction: Reconstruction::CatmullRom, ..base.clone() }),
        ("low-pass masking", masked(Masking::LowPass)),
        ("bilateral masking", masked(Masking::Bilateral)),
        ("no adaptive filter", Settings { adaptive_filter: AdaptiveFilter::Off, ..base.clone() }),
        ("glare", Settings { glare: Some(glare), ..base.clone() }),
        ("vignette", vignetted),
        ("table and blue noise", Settings { profile: table, dither: Dither::BlueNoise, ..base.clone() }),
    ]
}

#[test]
fn each_eye_is_the_picture_of_a_film_of_its_own() {
    let spec = spec(61, 45, SplatFilter::Gaussian);
    for (count, every_light) in [(40, 2), (3_000, 3), (70_000, 2), (20_000, 0)] {
        let samples = samples(&spec, count, every_light);
        let on_host = || VulkanFilm::summed_on_host(gpu().clone(), spec).expect("a film");
        for place in ["device", "host"] {
            let empty = || if place == "host" { on_host() } else { film(spec) };
            let mut both = of_both(empty(), &samples);
            let mut alone = samples.each_ref().map(|samples| filled(empty(), samples));
            for (name, settings) in displays() {
                let shown = both.display(&settings).expect("display");
                assert_eq!([shown.width, shown.height], [122, 45]);
                for (eye, alone) in Eye::BOTH.into_iter().zip(&mut alone) {
                    let wanted = alone.display(&settings).expect("display");
                    let rows = shown.rgb.chunks(122).map(|row| &row[61 * eye as usize..][..61]);
                    let differ = rows.flatten().zip(&wanted.rgb).filter(|(a, b)| a != b).count();
                    assert_eq!(differ, 0, "{name}, {count} samples, sums on the {place}, {}", eye.name());
                }
            }
            let developed = alone.map(|mut film| film.develop().expect("develop"));
            assert_eq!(both.develop().expect("develop"), developed[0]);
            let of_eyes = both.begin_develop_eyes().expect("develop").into_iter();
            let of_eyes: Vec<_> = of_eyes.map(|eye| eye.wait().expect("develop")).collect();
            assert_eq!(of_eyes, developed);
        }
    }
    assert_silent(gpu());
}

/// An eye that lacks a stream, or all samples, is as dark as a film that lacks them; nothing of the other is seen there.
#[test]
fn an_eye_without_samples_is_black() {
    let spec = spec(40, 30, SplatFilter::Gaussian);
    let samples = scene(&spec, 5_000, 3, 2);
    for on_host in [false, true] {
        let empty = match on_host {
            true => VulkanFilm::summed_on_host(gpu().clone(), spec).expect("a film"),
            false => film(spec),
        };
        let mut both = filled(empty.with_right_eye().expect("a film"), &samples);
        let shown = both.display(&Settings::default()).expect("display");
        let (left, right): (Vec<_>, Vec<_>) =
            shown.rgb.chunks(80).map(|row| row.split_at(40)).map(|(a, b)| (a.to_vec(), b.to_vec())).unzip();
        assert!(right.concat().iter().all(|rgb| *rgb == [0; 3]));
        assert!(left.concat().iter().any(|rgb| rgb[1] > 50));
    }
    assert_silent(gpu());
}

#[test]
fn composed_pictures_equal_the_reference() {
    for (width, height) in [(61, 45), (40, 30), (1, 1)] {
        let spec = spec(width, height, SplatFilter::Gaussian);
        let samples = samples(&spec, 30_000, 0);
        let mut both = of_both(film(spec), &samples);
        let mut table = Profile::named("display-p3").expect("a listed name");
        let srgb = |i: usize| (i as f32 / 1023.0).powi(2).powf(1.0 / 2.4);
        table.transfer = Some(TransferTable((0..1024).map(|i| [srgb(i), srgb(i).sqrt(), srgb(i)]).collect()));
        for profile in [Profile::srgb(), table] {
            let settings = |stereo| Settings { stereo, profile: profile.clone(), ..Settings::default() };
            let eyes = both.display(&settings(StereoLayout::OverUnder)).expect("display");
            let of_eye = |eye: Eye| {
                let pixels = (width * height) as usize;
                let rgb = eyes.rgb[pixels * eye as usize..][..pixels].to_vec();
                Grid::from_rows(width as usize, height as usize, rgb).expect("a grid")
            };
            let (left, right) = (of_eye(Eye::Left), of_eye(Eye::Right));
            let coding = DisplayCoding::new(&profile, Settings::default().gamma);
            for layout in StereoLayout::ALL {
                let got = grid(both.display(&settings(layout)).expect("display"));
                let wanted = compose([&left, &right], layout, &coding).expect("memory");
                assert_eq!(
                    [got.width(), got.height()],
                    [wanted.width(), wanted.height()],
                    "{}",
                    layout.name()
                );
                let steps =
                    |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
                let steps = || got.pixels().iter().zip(wanted.pixels()).map(steps);
                let off = steps().filter(|steps| *steps > 0).count();
                let mixes = matches!(layout, StereoLayout::Anaglyph(_));
                // Products of matrices are rounded in other ways, which decides at the edge between two values.
                let allowed = if mixes { 1 + got.pixels().len() / 200 } else { 0 };
                assert!(off <= allowed, "{}, {}: {off} pixels differ", layout.name(), profile.name);
                assert!(steps().all(|steps| steps <= 1), "{}", layout.name());
            }
        }
    }
    assert_silent(gpu());
}

/// For a window with a layer for each eye the picture has two of them, which are the eyes as they stand side by side; a readback has them so,
/// and leaves nothing behind that the window would show instead.
#[test]
fn layers_are_the_pictures_of_the_eyes() {
    let (width, height) = (61, 45);
    let spec = spec(width, height, SplatFilter::Gaussian);
    let mut both = of_both(film(spec), &samples(&spec, 30_000, 3));
    both.flush().expect("flush");
    for output in [ColorOutput::Sdr, ColorOutput::ScRgb] {
        let settings = |stereo| Settings { stereo, output, ..Settings::default() };
        for before in [StereoLayout::SideBySide, StereoLayout::Swapchain] {
            let shown = both.display(&settings(StereoLayout::SideBySide)).expect("display");
            assert_eq!(both.display(&settings(StereoLayout::Swapchain)).expect("display"), shown);
            let mut frame = gpu().begin().expect("a frame");
            both.paint(&mut frame.cmd(), &settings(before), 1, &mut []).expect("paint");
            both.paint(&mut frame.cmd(), &settings(StereoLayout::Swapchain), 1, &mut []).expect("paint");
            frame.submit().expect("submit");
            let layers = both.painted().expect("a picture");
            assert_eq!((layers.extent(0), layers.layers()), ([width, height], 2));
            if output != ColorOutput::Sdr {
                continue;
            }
            for eye in Eye::BOTH {
                let whole = Region { origin: [0, 0], extent: [width, height] };
                let texels = read_image(gpu(), layers, eye as u32, whole).expect("read");
                let rows = shown.rgb.chunks(2 * width as usize);
                let wanted = rows.flat_map(|row| &row[(width * eye as u32) as usize..][..width as usize]);
                let differ = texels.chunks_exact(4).zip(wanted).filter(|(a, b)| a[..3] != b[..]).count();
                assert_eq!(differ, 0, "{}", eye.name());
            }
        }
    }
    assert_silent(gpu());
}

/// Layouts that copy pixels take any encoding; those that mix light are refused where pixels are no 8-bit values.
#[test]
fn wide_range_pictures_are_not_mixed() {
    let spec = spec(16, 12, SplatFilter::Gaussian);
    let mut both = of_both(film(spec), &samples(&spec, 3_000, 0));
    both.flush().expect("flush");
    for layout in StereoLayout::ALL {
        let settings = Settings { stereo: layout, output: ColorOutput::ScRgb, ..Settings::default() };
        let mut frame = gpu().begin().expect("a frame");
        let painted = both.paint(&mut frame.cmd(), &settings, 1, &mut []).map(|image| image.extent(0));
        let mixes = layout.mixes_light();
        match painted {
            Ok(extent) => {
                assert!(!mixes);
                assert_eq!(Some(extent.map(|n| n as usize)), layout.size([16, 12]));
            }
            Err(error) => assert!(mixes && matches!(error, ClientError::Stereo(_)), "{error}"),
        }
        frame.submit().expect("submit");
    }
    assert_silent(gpu());
}
