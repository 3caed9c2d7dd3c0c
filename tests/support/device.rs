//! What tests of the Vulkan client share: one device with validation, and samples.

use std::sync::{Arc, LazyLock};

use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{
    AdaptiveFilter, DisplayImage, Film, FilmSpec, Reconstruction, Settings, SplatFilter, VarianceForm,
};
use pointillist::color::Xyz;
use pointillist::gpu::{DeviceChoice, Gpu, GpuOptions};
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

static GPU: LazyLock<Arc<Gpu>> = LazyLock::new(|| open(false));

/// A device with the validation layer; a missing driver or layer fails the test with what to install.
pub fn open(quads: bool) -> Arc<Gpu> {
    open_with(GpuOptions { quads, ..GpuOptions::default() })
}

/// The same with other options.
pub fn open_with(options: GpuOptions) -> Arc<Gpu> {
    let options = GpuOptions { validation: true, ..options };
    Gpu::with_options(&DeviceChoice::Best, options).unwrap_or_else(|error| {
        panic!(
            "the tests of the Vulkan client need a driver and the validation layer: {error}\n\
             On Debian: apt-get install libvulkan1 mesa-vulkan-drivers vulkan-validationlayers"
        )
    })
}

/// The device that all tests of a binary share.
pub fn gpu() -> &'static Arc<Gpu> {
    &GPU
}

/// Fails when the validation layer has said anything so far.
pub fn assert_silent(gpu: &Gpu) {
    let messages = gpu.validation_messages();
    assert!(messages.is_empty(), "{} validation messages, the first: {}", messages.len(), messages[0]);
}

/// A film of the shared device.
pub fn film(spec: FilmSpec) -> VulkanFilm {
    VulkanFilm::new(gpu().clone(), spec).expect("a film")
}

/// A film on the shared device and its reference, which get the same samples.
pub struct Both {
    pub film: VulkanFilm,
    pub reference: ReferenceFilm,
}

impl Both {
    pub fn new(spec: FilmSpec) -> Self {
        Self { film: film(spec), reference: ReferenceFilm::new(spec, 2).expect("a film") }
    }

    /// `count` more samples of [`scene`], with as many camera and light paths.
    pub fn add_scene(&mut self, count: usize, every_light: usize) {
        let samples = scene(&self.film.spec().clone(), count, count as u64, every_light);
        let paths = PathCounts { camera: count as u64, light: count as u64 };
        self.film.add(&samples).expect("add");
        self.reference.add(&samples).expect("add");
        self.film.count_paths(paths);
        self.reference.count_paths(paths);
    }

    /// Both display the same; bounds as in [`assert_one_step`].
    pub fn assert_display(&mut self, settings: &Settings, rare: usize, what: &str) {
        let got = self.film.display(settings).expect("display");
        assert_one_step(&got, &self.reference.display(settings).expect("display"), rare, what);
    }
}

/// No channel is more than one step of 255 apart, where a value lies at a rounding edge, and fewer than one in `rare` is.
pub fn assert_one_step(got: &DisplayImage, wanted: &DisplayImage, rare: usize, what: &str) {
    assert_eq!((got.width, got.height), (wanted.width, wanted.height));
    let pairs = || got.rgb.iter().flatten().zip(wanted.rgb.iter().flatten());
    assert!(pairs().all(|(a, b)| a.abs_diff(*b) <= 1), "{what}: more than one step apart");
    let off = pairs().filter(|(a, b)| a != b).count();
    assert!(off * rare < got.rgb.len() * 3, "{what}: {off} channels are off by one");
}

pub fn spec(width: u32, height: u32, filter: SplatFilter) -> FilmSpec {
    FilmSpec { width, height, filter, variance: Some(VarianceForm::Product), sums: Default::default() }
}

pub fn settings(reconstruction: Reconstruction, vm: f32) -> Settings {
    // The adaptive filter of the light stream has tests of its own.
    Settings { reconstruction, vm, adaptive_filter: AdaptiveFilter::Off, ..Settings::default() }
}

pub const FILTERS: [SplatFilter; 3] = [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box];

pub const RECONSTRUCTIONS: [Reconstruction; 4] =
    [Reconstruction::Gaussian, Reconstruction::CatmullRom, Reconstruction::Mipmap, Reconstruction::None];

/// Samples of a picture with an edge, a gradient and noise, over the film's whole window; one in `every_light` (0: none)
/// belongs to the light stream.
pub fn scene(spec: &FilmSpec, count: usize, seed: u64, every_light: usize) -> Vec<Sample> {
    let mut random = Random(seed);
    let window = spec.window();
    (0..count)
        .map(|i| {
            let t = [random.f32(), random.f32()];
            let uv = [0, 1].map(|k| window.min[k] + t[k] * (window.max[k] - window.min[k]));
            let bright = if uv[0] > 0.5 { 2.0 } else { 0.25 } + uv[1];
            let y = bright * (0.5 + random.f32());
            let xyz = Xyz::new(0.9 * y, y, (0.3 + 0.5 * uv[0]) * y);
            if every_light > 0 && i % every_light == 0 {
                Sample { uv, xyz: xyz * 0.5, w: -1.0 }
            } else {
                let w = 0.5 + random.f32();
                Sample { uv, xyz: xyz * w, w }
            }
        })
        .collect()
}
