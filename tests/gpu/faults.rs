//! The Vulkan film without memory: errors are clear, and the film goes on.

use crate::common::{assert_silent, gpu, open, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::{ClientError, Film, Reconstruction, SplatFilter};
use pointillist::gpu::DeviceKind;
use pointillist::stream::PathCounts;

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
        own.fail_allocations_after(allowed);
        let outcome = run(&mut film);
        own.fail_allocations_after(u64::MAX);
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
