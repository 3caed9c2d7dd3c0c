//! Every post-process of the list against its reference.

use crate::common::{Both, assert_silent, film, gpu, scene, settings, spec};
use crate::reference::difference;
use clap::ValueEnum;
use glam::Vec3;
use pointillist::client::post_process::{PanoramaProjection, PanoramaView, PictureGrid, PostSettings};
use pointillist::client::{Film, Reconstruction, Settings, SplatFilter};
use pointillist::image::Grid;

/// Settings with each post-process alone, under its name, and with all of them.
fn all_settings() -> Vec<(&'static str, Settings)> {
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let names: Vec<_> = PostSettings::default().effects().iter().map(|effect| effect.name).collect();
    let with = |names: &[&str]| {
        let mut settings = plain.clone();
        names.iter().for_each(|name| settings.switch(name, true));
        settings
    };
    names.iter().map(|name| (*name, with(&[name]))).chain([("all", with(&names))]).collect()
}

/// The picture before the tone curve, at every internal resolution.
#[test]
fn post_processed_pictures_equal_the_reference() {
    let spec = spec(75, 62, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 60_000, 7, 0)).expect("add");
    for (name, settings) in all_settings() {
        for detail in [1, 2, 4] {
            let plain = film.reconstruct(&settings.before_glare(), detail).expect("a picture");
            let pixels = plain.iter().map(|xyz| Vec3::from(*xyz)).collect();
            let [width, height] = [75, 62].map(|n: usize| n.div_ceil(detail as usize));
            let picture = Grid::from_rows(width, height, pixels).expect("as many texels");
            let grid = PictureGrid { extent: [75, 62], detail };
            let wanted = settings.post.apply(&picture, grid).expect("memory");
            let wanted: Vec<_> = wanted.pixels().iter().map(Vec3::to_array).collect();
            let got = film.reconstruct(&settings, detail).expect("a picture");
            let worst = difference(&got, &wanted);
            // A view into a panorama rounds the places where it looks texels up.
            let bound = if settings.look_around().is_some() { 2e-4 } else { 1e-5 };
            assert!(worst < bound, "{name}, detail {detail}: {worst}");
            // A radius of less than a coarse texel changes next to nothing.
            assert!(detail > 1 || difference(&got, &plain) > 1e-3, "{name}: nothing changes");
        }
    }
    assert_silent(gpu());
}

/// Views into panoramas of every projection, across seams, corners, a pole, and the rim of fisheye lenses.
#[test]
fn views_into_panoramas_equal_the_reference() {
    let spec = spec(96, 72, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 90_000, 8, 0)).expect("add");
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let picture = film.reconstruct(&plain, 1).expect("a picture").into_iter().map(Vec3::from).collect();
    let picture = Grid::from_rows(96, 72, picture).expect("as many texels");
    for projection in PanoramaProjection::value_variants() {
        for [yaw, pitch, fov] in [[20.0, 10.0, 100.0], [171.0, -33.0, 60.0], [-75.0, 70.0, 90.0]] {
            let mut settings = plain.clone();
            settings.post.look_around.view =
                Some(PanoramaView { yaw, pitch, fov, ..PanoramaView::ahead(*projection) });
            let wanted = settings.post.apply(&picture, PictureGrid { extent: [96, 72], detail: 1 });
            let wanted: Vec<_> = wanted.expect("memory").pixels().iter().map(Vec3::to_array).collect();
            let worst = difference(&film.reconstruct(&settings, 1).expect("a picture"), &wanted);
            assert!(worst < 1e-3, "{projection:?}, {yaw}, {pitch}: {worst}");
        }
    }
    assert_silent(gpu());
}

/// From samples to the encoded picture, both ways on their own; off again, nothing is left of it.
#[test]
fn post_processed_displays_equal_the_reference() {
    let mut both = Both::new(spec(90, 61, SplatFilter::Gaussian));
    both.add_scene(90_000, 4);
    let plain = settings(Reconstruction::Gaussian, 0.0);
    let before = both.film.display(&plain).expect("display");
    for (name, settings) in all_settings() {
        both.assert_display(&settings, 100, name);
        assert_eq!(both.film.display(&plain).expect("display"), before, "{name}");
    }
    assert_silent(gpu());
}
