//! The Vulkan film without memory: errors are clear, and the film goes on.

use std::sync::Arc;

use crate::common::{assert_silent, gpu, open, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::{
    CHUNK_SAMPLES, ClientError, DisplayImage, Film, FilmData, Glare, Reconstruction, Settings, SplatFilter,
};
use pointillist::gpu::{DeviceCall, DeviceKind, Gpu, GpuError};
use pointillist::stream::{PathCounts, Sample};

/// A film that no device can hold is an error with a sentence, not a crash.
#[test]
fn impossible_films_are_refused() {
    for (width, height) in [(0, 5), (5, 0), (1 << 20, 4), (u32::MAX, u32::MAX)] {
        let error = VulkanFilm::new(gpu().clone(), spec(width, height, SplatFilter::Gaussian)).err();
        let text = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(text.contains("not possible"), "{width}×{height}: {text}");
    }
    // Possible by its sides, but one image is larger than lavapipe allocates (2 GiB); a larger device may take it.
    if gpu().info().kind == DeviceKind::Cpu {
        let huge = spec(16_000, 16_000, SplatFilter::Gaussian);
        let mut film = VulkanFilm::new(gpu().clone(), huge).expect("nothing is made yet");
        film.add(&scene(&huge, 1, 1, 0)).expect("add");
        let text = film.flush().expect_err("too large").to_string();
        assert!(text.contains("smaller picture"), "{text}");
        // The film stays usable: it refuses every batch, and does not grow.
        film.add(&scene(&huge, 70_000, 1, 0)).expect("a part of a batch");
        assert!(film.flush().is_err() && film.waiting() == 0);
    }
    assert_silent(gpu());
}

/// Memory that runs out at any moment is an error, after which the film goes on: nothing is drawn from images that were
/// never written, and barriers say what the GPU has really done, also where a repaint was given up half way.
#[test]
fn exhausted_memory_leaves_the_film_usable() {
    let own = open(false);
    let spec = spec(45, 29, SplatFilter::Gaussian);
    let (masked, plain) = (settings(Reconstruction::Gaussian, 0.5), settings(Reconstruction::Mipmap, 0.0));
    let samples = scene(&spec, 5_000, 3, 2);
    let fresh = || VulkanFilm::new(own.clone(), spec).expect("a film");
    let run = |film: &mut VulkanFilm| {
        film.add(&samples)?;
        film.count_paths(PathCounts { camera: 5_000, light: 5_000 });
        Ok::<_, ClientError>((film.display(&masked)?, film.display(&plain)?, film.develop()?))
    };
    let wanted = run(&mut fresh()).expect("enough memory");
    let mut failures = 0;
    for allowed in 0.. {
        let mut film = fresh();
        own.faults().fail_after(DeviceCall::Allocation, allowed);
        let outcome = run(&mut film);
        own.faults().fail_after(DeviceCall::Allocation, u64::MAX);
        if outcome.is_ok() {
            break;
        }
        failures += 1;
        // What was lost is lost; what is shown now must be defined.
        for settings in [&masked, &plain] {
            film.display(settings).unwrap_or_else(|e| panic!("after {allowed} allocations: {e}"));
        }
        film.develop().expect("develop");
        film.clear();
        assert!(run(&mut film).expect("enough memory") == wanted, "after {allowed} allocations");
    }
    assert!(failures > 15, "only {failures} allocations");
    assert_silent(&own);
}

/// Wherever memory ends while batches are made beside the loop, it is an error, after which the film is as new. Where there is none for a second
/// vertex buffer the first one serves all batches: no sample is lost, however far the thread is ahead.
#[test]
fn batches_share_the_vertex_buffers_that_there_are() {
    let own = open(false);
    let spec = spec(300, 200, SplatFilter::Gaussian);
    let samples = scene(&spec, 5 * CHUNK_SAMPLES + 999, 5, 2);
    let fresh = || VulkanFilm::new(own.clone(), spec).expect("a film");
    let fill = |film: &mut VulkanFilm| {
        samples.chunks(1_000).try_for_each(|part| film.add(part))?;
        film.flush()
    };
    let mut film = fresh();
    fill(&mut film).expect("enough memory");
    let wanted = film.develop().expect("develop");
    drop(film);
    let mut failures = 0;
    for allowed in 0.. {
        let mut film = fresh();
        own.faults().fail_after(DeviceCall::Allocation, allowed);
        let outcome = fill(&mut film);
        own.faults().fail_after(DeviceCall::Allocation, u64::MAX);
        if outcome.is_ok() {
            let names = own.inventory().memory;
            assert_eq!(names.iter().filter(|(name, _)| name.starts_with("samples")).count(), 1);
            assert!(film.develop().expect("develop") == wanted);
            break;
        }
        failures += 1;
        assert!(film.is_damaged());
        film.clear();
        fill(&mut film).expect("enough memory");
        assert!(film.develop().expect("develop") == wanted, "after {allowed} allocations");
    }
    assert!(failures >= 8, "only {failures} allocations");
    assert_silent(&own);
}

/// A small film with both streams, its samples, and two displays that between them run every pass but the error view.
struct Subject {
    samples: Vec<Sample>,
    shown: [Settings; 2],
}

impl Subject {
    fn new() -> Self {
        let masked = settings(Reconstruction::Gaussian, 0.5);
        let plain = settings(Reconstruction::Mipmap, 0.0);
        let glare = Settings { glare: Some(Glare::default()), ..plain };
        Self { samples: scene(&spec(45, 29, SplatFilter::Gaussian), 5_000, 3, 2), shown: [masked, glare] }
    }

    fn film(&self, gpu: &Arc<Gpu>) -> Result<VulkanFilm, ClientError> {
        VulkanFilm::new(gpu.clone(), spec(45, 29, SplatFilter::Gaussian))
    }

    fn run(&self, film: &mut VulkanFilm) -> Result<([DisplayImage; 2], FilmData), ClientError> {
        film.add(&self.samples)?;
        film.count_paths(PathCounts { camera: 5_000, light: 5_000 });
        let [masked, glare] = &self.shown;
        Ok(([film.display(masked)?, film.display(glare)?], film.develop()?))
    }

    /// Lets the n-th attempt and all later ones fail, for every n from 0 until none is left, each on a device that has made
    /// nothing before. Returns the number of failures; `is_expected` tells the error that each must be.
    fn walk(&self, call: DeviceCall, is_expected: impl Fn(&GpuError) -> bool) -> u64 {
        let own = open(false);
        let wanted = self.run(&mut self.film(&own).expect("a film")).expect("nothing fails");
        assert_silent(&own);
        for allowed in 0.. {
            let own = open(false);
            own.faults().fail_after(call, allowed);
            let made = self.film(&own);
            let outcome = made.map(|mut film| (self.run(&mut film), film));
            own.faults().fail_after(call, u64::MAX);
            let (outcome, film) = match outcome {
                Ok((Ok(got), _)) => {
                    assert!(got == wanted, "with {allowed} attempts the picture is another");
                    return allowed;
                }
                Ok((Err(error), film)) => (error, Some(film)),
                Err(error) => (error, None),
            };
            match &outcome {
                ClientError::Gpu(error) => assert!(is_expected(error), "after {allowed}: {error}"),
                other => panic!("after {allowed}: {other}"),
            }
            let mut film = film.unwrap_or_else(|| self.film(&own).expect("nothing fails any more"));
            for settings in &self.shown {
                film.display(settings).unwrap_or_else(|e| panic!("after {allowed}: {e}"));
            }
            film.develop().expect("develop");
            film.clear();
            assert!(self.run(&mut film).expect("nothing fails any more") == wanted, "after {allowed}");
            drop(film);
            assert_silent(&own);
        }
        unreachable!("the loop has no end")
    }
}

/// A pipeline that cannot be compiled is one error that names it, after which the film goes on.
#[test]
fn pipelines_that_fail_leave_the_film_usable() {
    let failures = Subject::new().walk(DeviceCall::Pipeline, |error| {
        let text = error.to_string();
        text.starts_with("vkCreate") && text.contains("Pipelines(") && text.contains("out of memory")
    });
    assert!(failures > 10, "only {failures} pipelines");
}

/// A buffer that the host cannot see is one error that names it; before, its contents were silently empty.
#[test]
fn mappings_that_fail_leave_the_film_usable() {
    let failures = Subject::new().walk(DeviceCall::Mapping, |error| {
        matches!(error, GpuError::Unmapped(_)) && error.to_string().contains("could not be mapped")
    });
    assert!(failures > 5, "only {failures} buffers");
}

/// An allocation that does not fit says what it needs, what is in use and what there is.
#[test]
fn exhausted_memory_is_told_in_numbers() {
    let own = open(false);
    let mut film = VulkanFilm::new(own.clone(), spec(400, 300, SplatFilter::Gaussian)).expect("a film");
    own.limit_memory(6_000_000);
    film.add(&scene(film.spec(), 1, 1, 0)).expect("add");
    let error = film.flush().expect_err("more than 6 MB").to_string();
    for part in
        ["no GPU memory for ", "it needs ", "and may use 6.0 MB", "the device has ", "smaller picture"]
    {
        assert!(error.contains(part), "{error}");
    }
    own.limit_memory(u64::MAX);
    film.display(&settings(Reconstruction::Gaussian, 0.0)).expect("enough memory");
    assert_silent(&own);
}
