//! Times of the Vulkan client's passes and of their references on the CPU, as a table.
//!
//! GPU times are timestamps; on lavapipe they leave out clears of targets. Samples are uniform over the window, in batches of
//! 65,536. "CPU" columns are the process's CPU time, all threads.

use std::sync::Arc;
use std::time::Instant;

use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::wavelet::{HalfPicture, PixelFeatures, WaveletFilter};
use pointillist::client::{
    Adaptation, CHUNK_SAMPLES, Film, FilmSpec, Glare, Reconstruction, Settings, SplatFilter, develop,
};
use pointillist::color::{Profile, Xyz};
use pointillist::gpu::{DeviceChoice, Gpu};
use pointillist::image::{Grid, exr, png};
use pointillist::math::random::Random;
use pointillist::stream::{BLOCK_SAMPLES, Sample};

use super::common::{Outcome, process_seconds};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Pixels along a side of the picture
    #[arg(default_value_t = 512)]
    size: u32,
    /// The Vulkan device, by number or by a part of its name
    #[arg(default_value = "")]
    device: String,
}

const BATCH: usize = 65_536;
const BATCHES: usize = 16;

/// Measures every pass.
pub fn run(arguments: &Arguments) -> Outcome {
    let (size, choice) = (arguments.size, DeviceChoice::parse(&arguments.device));
    let start = Instant::now();
    let gpu = Gpu::new(&choice)?;
    let opened = start.elapsed().as_secs_f64() * 1e3;
    let info = gpu.info();
    println!("device   {} ({}, {}, Vulkan {})", info.name, info.kind, info.driver, info.api);
    println!("picture  {size}×{size}, batches of {BATCH} samples");
    let spec = FilmSpec {
        width: size,
        height: size,
        filter: SplatFilter::Gaussian,
        variance: Some(Default::default()),
        sums: Default::default(),
    };
    let samples = uniform(&spec, BATCH);
    first_picture(&gpu, spec, &samples, opened)?;
    for filter in [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box] {
        raster(&gpu, FilmSpec { filter, ..spec }, &samples)?;
    }
    upload(&gpu)?;
    mips(&gpu, spec, &samples)?;
    for count in [1, 4, 16] {
        for (kind, vm) in [
            (Reconstruction::Gaussian, 0.0),
            (Reconstruction::Gaussian, 0.5),
            (Reconstruction::CatmullRom, 0.0),
            (Reconstruction::Mipmap, 0.0),
            (Reconstruction::None, 0.0),
        ] {
            display(&gpu, spec, &samples, count, &settings(kind, vm))?;
        }
    }
    glare(&gpu, spec, &samples)?;
    noise_filter(spec);
    files(spec, &samples)
}

/// From nothing to the first picture: what a user waits for.
fn first_picture(gpu: &Arc<Gpu>, spec: FilmSpec, samples: &[Sample], opened: f64) -> Outcome {
    let start = Instant::now();
    let mut film = VulkanFilm::new(gpu.clone(), spec)?;
    film.add(&samples[..1024])?;
    film.flush()?;
    let flushed = start.elapsed().as_secs_f64() * 1e3;
    film.display(&settings(Reconstruction::Gaussian, 0.0))?;
    let shown = start.elapsed().as_secs_f64() * 1e3;
    println!(
        "start    device {opened:.0} ms, film and first batch recorded {flushed:.0} ms, first picture {shown:.0} ms"
    );
    Ok(())
}

/// Splat, fold and variance of one stream.
fn raster(gpu: &Arc<Gpu>, spec: FilmSpec, samples: &[Sample]) -> Outcome {
    let mut film = VulkanFilm::new(gpu.clone(), spec)?;
    film.add(samples)?;
    film.develop()?;
    gpu.take_timings();
    gpu.set_timing(true);
    let (start, cpu) = (Instant::now(), process_seconds());
    for _ in 0..BATCHES {
        film.add(samples)?;
    }
    film.flush()?;
    wait(gpu)?;
    let (seconds, cpu) = (start.elapsed().as_secs_f64(), process_seconds() - cpu);
    gpu.set_timing(false);
    let total = (BATCH * BATCHES) as f64;
    println!("\n{:?}: {:.2} Msamples/s in all, {:.2} s CPU", spec.filter, total / seconds / 1e6, cpu);
    for scope in gpu.take_timings() {
        let each = scope.milliseconds / scope.count as f64;
        println!("  {:<14} {each:8.2} ms {:8.2} Msamples/s", scope.name, BATCH as f64 / each / 1e3);
    }
    let mut reference = ReferenceFilm::new(spec, 0)?;
    reference.add(samples)?;
    let start = Instant::now();
    for _ in 0..BATCHES {
        reference.add(samples)?;
    }
    println!("  reference, all passes: {:.2} Msamples/s", total / start.elapsed().as_secs_f64() / 1e6);
    Ok(())
}

/// What the processor does for a sample of a film on the device, from a block to the vertex buffer: what the loop of a window does itself, and
/// how fast the thread is that sorts.
fn upload(gpu: &Arc<Gpu>) -> Outcome {
    println!();
    for [width, height] in [[1920, 1080], [3840, 2160]] {
        let spec = FilmSpec {
            width,
            height,
            filter: SplatFilter::Gaussian,
            variance: Some(Default::default()),
            sums: Default::default(),
        };
        // Less than a batch, so that nothing is drawn; the first time makes the buffers.
        let samples = uniform(&spec, spec.batch_capacity() - BATCH);
        let mut film = VulkanFilm::new(gpu.clone(), spec)?;
        let mut add = || -> Outcome<[f64; 3]> {
            film.clear();
            let start = Instant::now();
            for block in samples.chunks(BLOCK_SAMPLES) {
                film.add(block)?;
            }
            film.settle()?;
            let all = start.elapsed().as_secs_f64();
            film.clear();
            let (start, mut own) = (Instant::now(), 0.0);
            for chunk in samples.chunks(CHUNK_SAMPLES) {
                let start = Instant::now();
                for block in chunk.chunks(BLOCK_SAMPLES) {
                    film.add(block)?;
                }
                own += start.elapsed().as_secs_f64();
                film.settle()?;
            }
            let thread = start.elapsed().as_secs_f64() - own;
            Ok([own, thread, all].map(|seconds| seconds / samples.len() as f64 * 1e9))
        };
        add()?;
        let mut least = [f64::INFINITY; 3];
        for _ in 0..8 {
            let times = add()?;
            least = [0, 1, 2].map(|i| times[i].min(least[i]));
        }
        let [own, thread, all] = least;
        println!(
            "upload   {width}×{height}: {own:.1} ns per sample on the loop, {thread:.1} on the thread that sorts; without a pause {all:.1}"
        );
    }
    Ok(())
}

/// The whole mip chain of the colour against a pass that copies level 0 texel by texel.
///
/// The chain reads 4/3 and writes 1/3 of the texels, the copy reads and writes all: the last figure scales by bytes.
fn mips(gpu: &Arc<Gpu>, spec: FilmSpec, samples: &[Sample]) -> Outcome {
    let mut film = VulkanFilm::new(gpu.clone(), spec)?;
    let mut one = |kind, scope: &str| -> Outcome<f64> {
        film.clear();
        film.add(&samples[..1])?; // one sample: the blur reaches over all levels
        film.flush()?;
        wait(gpu)?;
        gpu.take_timings();
        gpu.set_timing(true);
        film.display(&settings(kind, 0.0))?;
        gpu.set_timing(false);
        let times = gpu.take_timings();
        Ok(times.iter().filter(|t| t.name == scope).map(|t| t.milliseconds).sum())
    };
    // In turn, and the least of many: what else runs on the machine hits both alike.
    let (mut chain, mut copy) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..40 {
        chain = chain.min(one(Reconstruction::Mipmap, "mips")?);
        copy = copy.min(one(Reconstruction::None, "reconstruct")?);
    }
    println!("\nmips, all levels: {chain:.2} ms; copy of level 0: {copy:.2} ms");
    println!("  ratio {:.2}, for the same bytes {:.2}", chain / copy, chain / copy * 2.0 / (5.0 / 3.0));
    Ok(())
}

/// Glare against a pass that copies the picture texel by texel, and what a change of its settings costs.
fn glare(gpu: &Arc<Gpu>, spec: FilmSpec, samples: &[Sample]) -> Outcome {
    let mut film = VulkanFilm::new(gpu.clone(), spec)?;
    film.add(samples)?;
    for adaptation in [Adaptation::Photopic, Adaptation::Scotopic] {
        let mut settings = settings(Reconstruction::None, 0.0);
        settings.glare = Some(Glare { adaptation, ..Glare::default() });
        let start = Instant::now();
        film.display(&settings)?;
        let first = start.elapsed().as_secs_f64() * 1e3;
        let (mut glare, mut copy) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..10 {
            gpu.take_timings();
            gpu.set_timing(true);
            let start = Instant::now();
            film.display(&settings)?;
            let all = start.elapsed().as_secs_f64() * 1e3;
            gpu.set_timing(false);
            let times = gpu.take_timings();
            let of =
                |name: &str| times.iter().filter(|t| t.name == name).map(|t| t.milliseconds).sum::<f64>();
            // lavapipe's timestamps may miss compute: what the other scopes leave of the whole is the bound.
            glare = glare.min(of("glare").max(all - of("reconstruct") - of("tonemap") - of("readback")));
            copy = copy.min(of("reconstruct"));
        }
        println!(
            "\nglare, {adaptation:?}: {glare:.1} ms, {:.1} times a fullscreen copy ({copy:.2} ms); first {first:.0} ms",
            glare / copy
        );
    }
    Ok(())
}

/// The noise filter of a noisy plain: what is done once per view, and per picture. The least of many.
fn noise_filter(spec: FilmSpec) {
    let (width, height) = (spec.width as usize, spec.height as usize);
    let mut random = Random(1);
    let mut half = || -> HalfPicture {
        let pixel = |_| glam::Vec4::new(random.f32(), random.f32(), random.f32(), 1.0);
        Grid::from_rows(width, height, (0..width * height).map(pixel).collect()).expect("memory")
    };
    let halves = [half(), half()];
    let plain = PixelFeatures { distance: 1.0, ..PixelFeatures::default() };
    let features = Grid::try_filled(width, height, plain).expect("memory");
    let (mut once, mut each) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..5 {
        let start = Instant::now();
        let filter = WaveletFilter::after(None, [width, height], Some([&features, &features]));
        once = once.min(start.elapsed().as_secs_f64() * 1e3);
        let mut filter = filter.expect("memory");
        for _ in 0..5 {
            let start = Instant::now();
            filter.filtered(halves.each_ref()).expect("memory");
            each = each.min(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    println!("\nnoise filter: {each:.1} ms for a picture, {once:.1} ms for a view");
}

/// One way of display, with `count` batches in the film.
fn display(gpu: &Arc<Gpu>, spec: FilmSpec, samples: &[Sample], count: usize, settings: &Settings) -> Outcome {
    const REPEATS: usize = 4;
    let mut film = VulkanFilm::new(gpu.clone(), spec)?;
    let mut reference = ReferenceFilm::new(spec, 0)?;
    for _ in 0..count {
        film.add(samples)?;
        reference.add(samples)?;
    }
    film.display(settings)?;
    reference.display(settings)?;
    gpu.take_timings();
    let (mut gpu_cpu, mut gpu_wall) = (0.0, 0.0);
    gpu.set_timing(true);
    for _ in 0..REPEATS {
        film.add(&samples[..1])?;
        film.flush()?;
        wait(gpu)?;
        let (cpu, start) = (process_seconds(), Instant::now());
        film.display(settings)?;
        gpu_cpu += process_seconds() - cpu;
        gpu_wall += start.elapsed().as_secs_f64();
    }
    gpu.set_timing(false);
    let cpu = process_seconds();
    for _ in 0..REPEATS {
        reference.display(settings)?;
    }
    let reference_cpu = process_seconds() - cpu;
    let per_pixel = |s: f64| s * 1e9 / (REPEATS as f64 * f64::from(spec.width) * f64::from(spec.height));
    println!(
        "\n{:?}, Vm {}, {:.2} samples/texel: {:.1} ms; CPU {:.0} ns/pixel, reference {:.0}, ratio {:.2}",
        settings.reconstruction,
        settings.vm,
        (count * BATCH) as f64 / (f64::from(spec.width) * f64::from(spec.height)),
        gpu_wall * 1e3 / REPEATS as f64,
        per_pixel(gpu_cpu),
        per_pixel(reference_cpu),
        gpu_cpu / reference_cpu
    );
    let shown = ["mips", "atlas", "reconstruct", "tonemap", "readback"];
    for scope in gpu.take_timings().iter().filter(|s| shown.contains(&s.name)) {
        println!("  {:<14} {:8.2} ms", scope.name, scope.milliseconds / scope.count as f64);
    }
    Ok(())
}

/// EXR with all layers, and PNG.
fn files(spec: FilmSpec, samples: &[Sample]) -> Outcome {
    let mut film = ReferenceFilm::new(spec, 0)?;
    (0..BATCHES).try_for_each(|_| film.add(samples))?;
    let (data, shown) = (film.develop()?, film.display(&settings(Reconstruction::Gaussian, 0.0))?);
    let exr = std::env::temp_dir().join(format!("benchmarks-{}.exr", std::process::id()));
    let png = exr.with_extension("png");
    let start = Instant::now();
    let layers = develop::layers(&data, &Profile::srgb(), spec.filter.energy(), &[]);
    exr::write(&exr, &layers)?;
    let wrote = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let [width, height] = [shown.width, shown.height];
    let (transfer, primaries) = (png::Transfer::Gamma(2.2), Profile::srgb().primaries);
    png::write(&png, png::PngPicture { width, height, rgb: &shown.rgb, transfer, primaries }, &[])?;
    let channels = layers.channels.len();
    println!("\nEXR of {channels} channels {wrote:.0} ms, PNG {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    std::fs::remove_file(exr)?;
    Ok(std::fs::remove_file(png)?)
}

/// Waits until the GPU has done everything.
fn wait(gpu: &Arc<Gpu>) -> Outcome {
    Ok(gpu.wait(gpu.begin()?.submit()?)?)
}

fn settings(reconstruction: Reconstruction, vm: f32) -> Settings {
    Settings { reconstruction, vm, ..Settings::default() }
}

/// Random samples over the whole window.
fn uniform(spec: &FilmSpec, count: usize) -> Vec<Sample> {
    let mut random = Random(1);
    let mut next = || random.f32();
    let window = spec.window();
    (0..count)
        .map(|_| {
            let t = [next(), next()];
            let uv = [0, 1].map(|k| window.min[k] + t[k] * (window.max[k] - window.min[k]));
            Sample { uv, xyz: Xyz::new(next(), next(), next()), w: 1.0 }
        })
        .collect()
}
