//! What is off takes nothing on the device: no pass, no image, no pipeline.

use std::collections::BTreeSet;

use crate::common::{assert_silent, open, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{ClientError, Film, FilmSpec, Reconstruction, Settings, SplatFilter};

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
    assert_eq!(shaders, ["splat_color.frag", "fold.comp", "reconstruct.frag", "tonemap.frag"]);
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
