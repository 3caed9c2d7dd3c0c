//! Prints what the CPU client costs; no assertion on time. Run with
//! `cargo test --release --test client_speed -- --ignored --nocapture`.

use std::time::Instant;

use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{FilmSpec, Reconstruction, Settings, SplatFilter, develop};
use pointillist::color::{Profile, Xyz};
use pointillist::image::png::{self, Picture, Transfer};
use pointillist::image::{Attribute, exr};
use pointillist::stream::Sample;

fn samples(n: usize) -> Vec<Sample> {
    let mut seed = 7u32;
    let mut next = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / 16_777_216.0
    };
    (0..n).map(|_| Sample { uv: [next(), next()], xyz: Xyz::new(next(), next(), next()), w: 1.0 }).collect()
}

/// Set `KEEP` in the environment to a folder to look at the files.
#[test]
#[ignore = "prints times"]
fn files() {
    let spec =
        FilmSpec { width: 512, height: 512, filter: SplatFilter::Gaussian, variance: Default::default() };
    let mut film = ReferenceFilm::new(spec, 2).expect("film");
    film.add(&samples(1 << 20)).expect("add");
    let data = film.develop().expect("develop");
    let keep = std::env::var_os("KEEP").map(std::path::PathBuf::from);
    let folder = keep.clone().unwrap_or_else(std::env::temp_dir);
    let path = folder.join(format!("speed-{}.exr", std::process::id()));
    let start = Instant::now();
    let attributes = [("scene".to_owned(), Attribute::Text("Küche.xml".into()))];
    let layers = develop::layers(&data, &Profile::srgb(), spec.filter.energy(), &attributes);
    exr::write(&path, &layers).expect("write");
    println!("EXR of {} channels: {:.0} ms", layers.channels.len(), start.elapsed().as_secs_f64() * 1e3);
    let picture = film.display(&Settings::default()).expect("display");
    let start = Instant::now();
    let name = path.with_extension("png");
    let transfer = Transfer::Srgb;
    let picture = Picture { width: picture.width, height: picture.height, rgb: &picture.rgb, transfer };
    png::write(&name, picture, &attributes).expect("write");
    println!("PNG: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    if keep.is_none() {
        std::fs::remove_file(path).expect("remove");
        std::fs::remove_file(name).expect("remove");
    }
}

#[test]
#[ignore = "prints times"]
fn speed() {
    let samples = samples(1 << 20);
    for filter in [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box] {
        let spec = FilmSpec { width: 512, height: 512, filter, variance: Default::default() };
        for threads in [1, 2] {
            let mut film = ReferenceFilm::new(spec, threads).expect("film");
            film.add(&samples[..65_536]).expect("add");
            let start = Instant::now();
            film.add(&samples).expect("add");
            let rate = samples.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
            println!("splat + fold + variance, {filter:?}, {threads} threads: {rate:.2} Msamples/s");
            if filter != SplatFilter::Gaussian {
                continue;
            }
            for reconstruction in [
                Reconstruction::Gaussian,
                Reconstruction::CatmullRom,
                Reconstruction::Mipmap,
                Reconstruction::None,
            ] {
                for (n, vm) in [(1 << 16, 0.0), (1 << 16, 0.5), (1 << 20, 0.0)] {
                    let mut film = ReferenceFilm::new(spec, threads).expect("film");
                    film.add(&samples[..n]).expect("add");
                    let settings = Settings { reconstruction, vm, ..Settings::default() };
                    film.display(&settings).expect("display");
                    let start = Instant::now();
                    film.display(&settings).expect("display");
                    let ns = start.elapsed().as_secs_f64() * 1e9 / f64::from(512 * 512) * threads as f64;
                    println!(
                        "display {reconstruction:?}, {n} samples, Vm {vm}, {threads} threads: {ns:.0} CPU ns/pixel"
                    );
                }
            }
        }
    }
}
