//! The Vulkan film by itself: sums, flat fields, determinism, odd sizes, epochs.

use crate::common::{FILTERS, RECONSTRUCTIONS, assert_silent, film, gpu, open, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::{Film, FilmData, FilmSpec, Reconstruction, Settings, SplatFilter};
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

fn develop(spec: FilmSpec, samples: &[Sample]) -> FilmData {
    let mut film = film(spec);
    film.add(samples).expect("add");
    film.develop().expect("develop")
}

/// One sprite adds 1 in all, wherever it lies: at texel centres, edges, corners and in between.
#[test]
fn one_sprite_sums_to_one() {
    const CELL: u32 = 16;
    const CELLS: u32 = 24;
    for filter in FILTERS {
        let spec = spec(CELL * CELLS, CELL * CELLS, filter);
        let mut random = Random(5);
        // One sprite in the middle of every cell: they do not touch.
        let offsets: Vec<[f32; 2]> = (0..CELLS * CELLS)
            .map(|i| match i {
                0..4 => [0.5 * (i & 1) as f32, 0.25 * (i & 2) as f32],
                4..8 => [1.0 / 512.0 * (i - 4) as f32, 1.0 / 1024.0],
                _ => [random.f32(), random.f32()],
            })
            .collect();
        let size = (CELL * CELLS) as f32;
        let samples: Vec<Sample> = (0..)
            .zip(&offsets)
            .map(|(i, o)| {
                let corner = [i % CELLS * CELL + CELL / 2, i / CELLS * CELL + CELL / 2];
                let uv = [0, 1].map(|k| (corner[k] as f32 + o[k]) / size);
                Sample { uv, xyz: Xyz::new(1.0, 1.0, 1.0), w: 1.0 }
            })
            .collect();
        let data = develop(spec, &samples);
        for cell in 0..CELLS * CELLS {
            let (x0, y0) = (cell % CELLS * CELL, cell / CELLS * CELL);
            let texels = (0..CELL * CELL).map(|i| (y0 + i / CELL) * spec.width + x0 + i % CELL);
            let sum: f64 = texels.map(|t| f64::from(data.camera[t as usize][3])).sum();
            let offset = offsets[cell as usize];
            assert!((sum - 1.0).abs() < 1e-6, "{filter:?} at {offset:?}: {sum}");
        }
    }
    assert_silent(gpu());
}

/// The same samples in the same order: the same bits, however they are split into calls, and again.
#[test]
fn bits_do_not_depend_on_calls() {
    for filter in [SplatFilter::Gaussian, SplatFilter::Box] {
        let spec = spec(150, 90, filter);
        let samples = scene(&spec, 150_000, 11, 3);
        let whole = develop(spec, &samples);
        assert_eq!(whole, develop(spec, &samples), "a second run differs");
        let mut pieces = film(spec);
        let mut rest = &samples[..];
        let mut random = Random(3);
        while !rest.is_empty() {
            let n = ((random.f32() * 40_000.0) as usize).clamp(1, rest.len());
            pieces.add(&rest[..n]).expect("add");
            rest = &rest[n..];
        }
        assert_eq!(whole, pieces.develop().expect("develop"), "{filter:?}: pieces differ");
    }
    assert_silent(gpu());
}

/// Instanced quads, the fallback without large points, give the same bits as points.
#[test]
fn quads_equal_points() {
    let quads = open(true);
    for filter in FILTERS {
        let spec = spec(75, 41, filter);
        let samples = scene(&spec, 30_000, 7, 2);
        let mut film = VulkanFilm::new(quads.clone(), spec).expect("a film");
        film.add(&samples).expect("add");
        assert_eq!(film.develop().expect("develop"), develop(spec, &samples), "{filter:?}");
    }
    assert_silent(&quads);
}

/// Tiny and odd films, every reconstruction, one sample in the whole picture, an empty film.
#[test]
fn odd_sizes_give_finite_pictures() {
    for (width, height) in [(1, 1), (3, 5), (2, 7), (33, 1), (511, 513)] {
        for filter in FILTERS {
            let spec = spec(width, height, filter);
            let mut film = film(spec);
            for count in [0, 1, 5, 2000] {
                film.add(&scene(&spec, count, u64::from(width) + count as u64, 2)).expect("add");
                film.count_paths(PathCounts { camera: count as u64, light: count as u64 });
                for kind in RECONSTRUCTIONS {
                    for vm in [0.0, 0.7] {
                        let picture = film.reconstruct(&settings(kind, vm), 1).expect("reconstruct");
                        assert_eq!(picture.len(), (width * height) as usize);
                        let bad = picture.iter().flatten().find(|v| !v.is_finite());
                        assert_eq!(bad, None, "{width}×{height} {filter:?} {kind:?} Vm {vm}");
                    }
                }
            }
            let shown = film.display(&settings(Reconstruction::Gaussian, 0.0)).expect("display");
            assert!(shown.rgb.iter().flatten().any(|c| *c > 0), "{width}×{height} is black");
        }
    }
    assert_silent(gpu());
}

/// A stream without samples has no image; bad samples are dropped and not counted.
#[test]
fn unused_streams_are_absent() {
    let spec = spec(40, 30, SplatFilter::Gaussian);
    let mut film = film(spec);
    let black = film.display(&settings(Reconstruction::Gaussian, 0.5)).expect("display");
    assert!(black.rgb.iter().all(|c| *c == [0; 3]));
    assert_eq!(film.allocated_streams(), [false, false]);

    let good = Sample { uv: [0.5, 0.5], xyz: Xyz::new(1.0, 1.0, 1.0), w: 1.0 };
    let bad = [
        Sample { uv: [f32::NAN, 0.5], ..good },
        Sample { uv: [0.5, f32::INFINITY], ..good },
        Sample { w: f32::NAN, ..good },
        Sample { w: 0.0, ..good },
        Sample { w: -0.0, ..good },
        Sample { xyz: Xyz::new(f32::NAN, 1.0, 1.0), ..good },
    ];
    film.add(&bad).expect("add");
    film.flush().expect("flush");
    assert_eq!(film.allocated_streams(), [false, false]);
    assert_eq!(film.counts().camera_samples + film.counts().light_samples, 0);

    film.add(&[good]).expect("add");
    let data = film.develop().expect("develop");
    assert_eq!(film.allocated_streams(), [true, false]);
    assert!(data.light.is_empty() && data.light_variance.is_empty());
    assert!(data.camera.iter().flatten().all(|v| v.is_finite()));

    // Outside of the padded target: counted, drawn nowhere.
    let mut outside = VulkanFilm::new(gpu().clone(), spec).expect("a film");
    outside.add(&[Sample { uv: [7.0, 0.5], ..good }, Sample { uv: [-3.0, 1e30], ..good }]).expect("add");
    let data = outside.develop().expect("develop");
    assert_eq!(data.counts.camera_samples, 2);
    assert!(data.camera.iter().flatten().all(|v| *v == 0.0));
    let shown = outside.display(&settings(Reconstruction::Gaussian, 0.5)).expect("display");
    assert!(shown.rgb.iter().all(|c| *c == [0; 3]));
    assert_silent(gpu());
}

/// A new epoch forgets everything, also what waits in the batch and what the mips hold.
#[test]
fn clearing_starts_anew() {
    let spec = spec(60, 45, SplatFilter::Gaussian);
    let samples = scene(&spec, 70_000, 21, 4);
    let wanted = develop(spec, &samples);
    let mut film = film(spec);
    film.add(&scene(&spec, 90_000, 99, 1)).expect("add");
    film.display(&settings(Reconstruction::Gaussian, 0.5)).expect("display");
    film.add(&scene(&spec, 1_000, 98, 0)).expect("add");
    film.clear();
    assert_eq!(film.counts(), Default::default());
    assert!(film.develop().expect("develop").camera.is_empty());
    let black = film.display(&settings(Reconstruction::Gaussian, 0.5)).expect("display");
    assert!(black.rgb.iter().all(|c| *c == [0; 3]));
    film.add(&samples).expect("add");
    assert_eq!(film.develop().expect("develop"), wanted);
    assert_silent(gpu());
}

/// Films dropped while the GPU still draws into them: their images wait for the frame, and are gone afterwards.
#[test]
fn dropped_films_are_retired() {
    let spec = spec(200, 200, SplatFilter::Gaussian);
    let samples = scene(&spec, 70_000, 8, 2);
    for _ in 0..12 {
        let mut film = film(spec);
        film.add(&samples).expect("add");
        film.flush().expect("flush");
    }
    assert_silent(gpu());
}

/// Values that no slider should give, but a command line can: a picture, whatever it shows, and no message.
#[test]
fn odd_settings_do_no_harm() {
    let spec = spec(33, 21, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 3_000, 4, 3)).expect("add");
    let huge = Sample { uv: [0.3, 0.3], xyz: Xyz::new(1e30, 1e30, 1e30), w: 1e30 };
    film.add(&[huge, Sample { w: -1.0, ..huge }, Sample { w: 1e-30, ..huge }]).expect("add");
    film.count_paths(PathCounts { camera: u64::MAX, light: u64::MAX });
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE, 1e30] {
        for kind in RECONSTRUCTIONS {
            let good = settings(kind, 0.5);
            let all = [
                Settings { vm: bad, ..good.clone() },
                Settings { exposure: bad, ..good.clone() },
                Settings { contrast: bad, ..good.clone() },
                Settings { gamma: bad, ..good.clone() },
            ];
            for settings in all {
                let shown = film.display(&settings).expect("display");
                assert_eq!(shown.rgb.len(), 33 * 21);
            }
        }
    }
    assert_silent(gpu());
}

/// Run by [`bits_do_not_depend_on_threads`] in processes of its own: prints a hash of sums and picture.
#[test]
#[ignore = "a part of another test"]
fn print_hash() {
    let spec = spec(150, 90, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 150_000, 13, 3)).expect("add");
    let data = film.develop_padded().expect("develop");
    let shown = film.display(&settings(Reconstruction::Gaussian, 0.5)).expect("display");
    let sums = data.camera.iter().chain(&data.light).flatten();
    let sums = sums.chain(&data.camera_variance).chain(&data.light_variance).flat_map(|v| v.to_ne_bytes());
    let bytes = sums.chain(shown.rgb.into_iter().flatten());
    let hash =
        bytes.fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    println!("hash {hash:016x}");
}

/// lavapipe takes the number of its threads from the environment; other drivers ignore it.
#[test]
fn bits_do_not_depend_on_threads() {
    let hashes: Vec<String> = ["0", "1", "2", "7"]
        .iter()
        .map(|threads| {
            let program = std::env::current_exe().expect("this program");
            let output = std::process::Command::new(program)
                .args(["--exact", "film::print_hash", "--ignored", "--nocapture"])
                .env("LP_NUM_THREADS", threads)
                .output()
                .expect("this program again");
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            let at = text.find("hash ").unwrap_or_else(|| panic!("{threads} threads: {text}"));
            text[at..at + 21].to_owned()
        })
        .collect();
    assert!(hashes.iter().all(|h| *h == hashes[0]), "{hashes:?}");
}
