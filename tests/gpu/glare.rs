//! Glare on the GPU against its reference and against the convolution written out.

use crate::common::{assert_silent, film, gpu, scene, settings, spec};
use crate::support::glare::{ADAPTATIONS, difference, direct, glare, noise, point, rounding_bound, total};
use glam::{DVec3, Vec3};
use pointillist::client::background::{BackgroundPolicy, join_abandoned};
use pointillist::client::film::VulkanFilm;
use pointillist::client::glare::GlareKernel;
use pointillist::client::pass::glare::glare_detail;
use pointillist::client::reference::glare::ReferenceGlare;
use pointillist::client::{Adaptation, Film, Glare, Reconstruction, Settings, SplatFilter};
use pointillist::color::Xyz;
use pointillist::gpu::{Region, read_image};
use pointillist::image::Grid;
use pointillist::stream::Sample;

/// A film that shows exactly this picture: one sample in the middle of each pixel, box filter.
fn showing(picture: &Grid<Vec3>) -> VulkanFilm {
    let (width, height) = (picture.width(), picture.height());
    let samples: Vec<Sample> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let uv = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32];
            let v = picture.pixels()[i];
            Sample { uv, xyz: Xyz::new(v.x, v.y, v.z), w: 1.0 }
        })
        .collect();
    let mut film = film(spec(width as u32, height as u32, SplatFilter::Box));
    film.add(&samples).expect("add");
    film
}

fn plain() -> Settings {
    settings(Reconstruction::None, 0.0)
}

/// The film's picture before the tone curve.
fn picture(film: &mut VulkanFilm, glare: Option<Glare>) -> Grid<Vec3> {
    let (width, height) = (film.spec().width as usize, film.spec().height as usize);
    let xyz = film.reconstruct(&Settings { glare, ..plain() }, 1).expect("a picture");
    Grid::from_rows(width, height, xyz.into_iter().map(Vec3::from_array).collect()).expect("its size")
}

/// From the definition within rounding, and within 10⁻⁵ of the root mean square from the reference, which rounds the kernel alike.
#[test]
fn gpu_equals_direct_convolution_and_reference() {
    for extent in [[1, 1], [1, 7], [2, 2], [3, 5], [17, 33], [24, 9], [40, 31], [64, 64], [75, 20]] {
        let mut film = showing(&noise(extent, 7));
        let before = picture(&mut film, None);
        for adaptation in ADAPTATIONS {
            let glare = glare(adaptation);
            let got = picture(&mut film, Some(glare));
            let wanted = direct(&before, &glare);
            let error = difference(got.pixels(), &wanted);
            assert!(
                error < rounding_bound(&wanted),
                "{extent:?} {adaptation:?}: {error:e} from the definition"
            );
            let reference = ReferenceGlare::default().apply(&before, &glare).expect("memory");
            let reference: Vec<_> = reference.pixels().iter().map(|v| v.as_dvec3()).collect();
            let error = difference(got.pixels(), &reference);
            assert!(error < 1e-5, "{extent:?} {adaptation:?}: {error:e} from the reference");
        }
        assert_eq!(picture(&mut film, None), before, "off again");
    }
    assert_silent(gpu());
}

/// A convolution on the torus: what a transform without padding computes.
fn wrapped(picture: &Grid<Vec3>, glare: &Glare) -> Vec<DVec3> {
    let extent @ [width, height] = [picture.width(), picture.height()];
    let kernel = GlareKernel::new(extent, glare).expect("memory");
    // Offsets of either sign that are the same on the torus, all in one.
    let folded = |d: usize, n: usize| if d == 0 { vec![0] } else { vec![d, n - d] };
    let mut out = vec![DVec3::ZERO; width * height];
    for (q, value) in picture.pixels().iter().enumerate() {
        let light = value.as_dvec3() * DVec3::from_array(kernel.gain_at(q % width, q / width).map(f64::from));
        for (p, out) in out.iter_mut().enumerate() {
            for y in folded((p / width).abs_diff(q / width), height) {
                for x in folded((p % width).abs_diff(q % width), width) {
                    *out += light * DVec3::from_array(kernel.quadrant.at(x, y).map(f64::from));
                }
            }
        }
    }
    out
}

/// A bright spot at the border, which a transform without padding shows again at the other side. Bound of ours as above;
/// the wrong one must miss it by far. All of the light stays in the picture, within 10⁻⁵.
#[test]
fn nothing_wraps_around_a_border() {
    for (extent, spot) in [([24, 18], [0, 9]), ([24, 18], [23, 17]), ([17, 33], [8, 32])] {
        let before = point(extent, spot, Vec3::new(90.0, 100.0, 110.0));
        let mut film = showing(&before);
        for adaptation in ADAPTATIONS {
            let glare = glare(adaptation);
            let got = picture(&mut film, Some(glare));
            let error = difference(got.pixels(), &direct(&before, &glare));
            assert!(error < 1e-5, "{extent:?} {adaptation:?}: {error:e} from the definition");
            let error = difference(got.pixels(), &wrapped(&before, &glare));
            assert!(error > 1e-4, "{extent:?} {adaptation:?}: {error:e} from one that wraps around");
            let energy = (total(got.pixels()) / total(before.pixels()) - 1.0).abs().max_element();
            assert!(energy < 1e-5, "{extent:?} {adaptation:?}: energy differs by {energy:e}");
        }
    }
    assert_silent(gpu());
}

/// A film that does not wait shows the picture without glare, then with it: the one of a film that waits, to the bit.
#[test]
fn an_impatient_film_has_the_same_glare_later() {
    let mut film = showing(&noise([40, 31], 5));
    let settings = Settings { glare: Some(glare(Adaptation::Scotopic)), ..plain() };
    film.set_background_policy(BackgroundPolicy::Background);
    let paint = |film: &mut VulkanFilm| {
        film.flush().expect("flush");
        let mut frame = gpu().begin().expect("a frame");
        film.paint(&mut frame.cmd(), &settings, 1, &mut []).expect("paint");
        gpu().wait(frame.submit().expect("submit")).expect("wait");
        let image = film.painted().expect("painted");
        read_image(gpu(), image, 0, Region { origin: [0, 0], extent: [40, 31] }).expect("read")
    };
    let first = paint(&mut film);
    while !film.is_background_ready() {
        std::thread::yield_now();
    }
    let second = paint(&mut film);
    assert!(!film.is_background_ready());
    assert_ne!(first, second, "glare changes the picture");
    let rgb: Vec<_> = second.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect();
    assert_eq!(film.display(&settings).expect("display").rgb, rgb);
    // Dropped with something under way.
    film.set_background_policy(BackgroundPolicy::Background);
    let other = Settings { glare: Some(glare(Adaptation::Mesopic)), ..plain() };
    let mut frame = gpu().begin().expect("a frame");
    film.paint(&mut frame.cmd(), &other, 1, &mut []).expect("paint");
    gpu().wait(frame.submit().expect("submit")).expect("wait");
    drop(film);
    join_abandoned();
    assert_silent(gpu());
}

/// Several stages of every radix, more columns than threads. Bound: 10⁻⁴ of the root mean square, which is far below
/// the brightest pixel; energy within 10⁻⁵.
#[test]
fn large_pictures_equal_the_reference_and_keep_their_energy() {
    for extent in [[512, 288], [270, 600], [1100, 3]] {
        let mut film = showing(&noise(extent, 11));
        let before = picture(&mut film, None);
        let glare = Glare { adaptation: Adaptation::Scotopic, view_angle: 25.0 };
        let got = picture(&mut film, Some(glare));
        let reference = ReferenceGlare::default().apply(&before, &glare).expect("memory");
        let reference: Vec<_> = reference.pixels().iter().map(|v| v.as_dvec3()).collect();
        let error = difference(got.pixels(), &reference);
        assert!(error < 1e-4, "{extent:?}: {error:e} from the reference");
        let energy = (total(got.pixels()) / total(before.pixels()) - 1.0).abs().max_element();
        assert!(energy < 1e-5, "{extent:?}: energy differs by {energy:e}");
    }
    assert_silent(gpu());
}

/// A film without samples, and one of black ones, stay black; nothing is NaN at 10³⁰.
#[test]
fn black_and_huge_pictures() {
    let glare = glare(Adaptation::Mesopic);
    let mut empty = film(spec(20, 10, SplatFilter::Box));
    assert!(picture(&mut empty, Some(glare)).pixels().iter().all(|v| *v == Vec3::ZERO));
    let black = Grid::from_rows(20, 10, vec![Vec3::ZERO; 200]).expect("a picture");
    assert!(picture(&mut showing(&black), Some(glare)).pixels().iter().all(|v| *v == Vec3::ZERO));
    let mut huge = vec![Vec3::ONE; 200];
    huge[77] = Vec3::splat(1e30);
    let huge = Grid::from_rows(20, 10, huge).expect("a picture");
    let got = picture(&mut showing(&huge), Some(glare));
    assert!(got.pixels().iter().all(|v| v.is_finite()));
    assert!((total(got.pixels()).y / 1e30 - 1.0).abs() < 1e-4);
    assert_silent(gpu());
}

/// Where a line does not fit the memory that a workgroup shares, the picture with its glare is computed on the finest grid that
/// does; without glare it stays as it is.
#[test]
fn lines_that_do_not_fit_are_transformed_on_a_coarser_grid() {
    let glare = glare(ADAPTATIONS[0]);
    let shining = Settings { glare: Some(glare), ..plain() };
    // Bytes that a workgroup shares, and pixels per texel of the grid: a line of 64 texels needs 512 bytes.
    for (shared, detail) in [(512, 1), (511, 2), (256, 2), (255, 4), (128, 4)] {
        let own = crate::common::open(false);
        own.limit_shared(shared);
        let mut film = VulkanFilm::new(own.clone(), spec(64, 48, SplatFilter::Box)).expect("a film");
        assert_eq!(glare_detail(&own, [64, 48]), detail, "{shared} bytes");
        film.add(&scene(film.spec(), 20_000, 5, 0)).expect("add");
        let (width, height) = (64_usize.div_ceil(detail as usize), 48_usize.div_ceil(detail as usize));
        let plain = film.reconstruct(&plain(), detail).expect("a picture");
        let grid = |xyz: Vec<[f32; 3]>| {
            Grid::from_rows(width, height, xyz.into_iter().map(Vec3::from_array).collect()).expect("its size")
        };
        let got = grid(film.reconstruct(&shining, 1).expect("a picture"));
        let wanted = ReferenceGlare::default().apply(&grid(plain), &glare).expect("memory");
        let wanted: Vec<_> = wanted.pixels().iter().map(|v| v.as_dvec3()).collect();
        let error = difference(got.pixels(), &wanted);
        assert!(error < 1e-5, "{shared} bytes: {error:e} from the reference");
        // The picture that is shown has all its pixels.
        let shown = film.display(&shining).expect("a picture");
        assert_eq!((shown.width, shown.height, shown.rgb.len()), (64, 48, 64 * 48));
        assert_silent(&own);
    }
    // What fits at no resolution is an error with a sentence.
    let own = crate::common::open(false);
    own.limit_shared(120);
    let mut film = VulkanFilm::new(own.clone(), spec(64, 48, SplatFilter::Box)).expect("a film");
    let refused = film.display(&shining).expect_err("too large").to_string();
    assert!(refused.contains("the picture for glare"), "{refused}");
    film.display(&plain()).expect("without glare");
    assert_silent(&own);
}
