//! Views into panoramas against the tracer's cameras: those that make the panoramas, and perspective ones that look the same way.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2, Vec3};

use crate::support::scenes::*;
use pointillist::client::post_process::{PanoramaProjection, PanoramaView, PictureGrid, PostSettings};
use pointillist::image::Grid;
use pointillist::scene::desc::*;
use pointillist::tracer::{Camera, PrepareOptions};

const CENTER: [f32; 2] = [0.5; 2];

/// Every panorama of the tracer that can be looked into, with the size of a picture whose faces are whole texels.
fn panoramas() -> [(PanoramaProjection, ProjectionDesc, [u32; 2]); 6] {
    let cube = |layout| ProjectionDesc::CubeMap(layout);
    let stereo = StereoDesc { interocular: 0.1, eyes: StereoEyes::OverUnder };
    [
        (PanoramaProjection::Spherical, ProjectionDesc::Spherical, [128, 64]),
        (PanoramaProjection::OverUnder, ProjectionDesc::Stereo(stereo), [128, 128]),
        (PanoramaProjection::CubeBlock, cube(CubeLayout::Block), [96, 64]),
        (PanoramaProjection::CubeRow, cube(CubeLayout::Row), [192, 32]),
        (PanoramaProjection::CubeColumn, cube(CubeLayout::Column), [32, 192]),
        (PanoramaProjection::CubeCross, cube(CubeLayout::Cross), [128, 96]),
    ]
}

fn views(projection: PanoramaProjection) -> impl Iterator<Item = PanoramaView> {
    let angles = [
        [0.3, 0.2, 90.0],
        [50.3, 35.1, 40.0],
        [-134.7, -52.3, 100.0],
        [179.4, 88.6, 70.0],
        [90.2, -89.0, 115.0],
    ];
    angles.into_iter().map(move |[yaw, pitch, fov]| PanoramaView {
        yaw,
        pitch,
        fov,
        ..PanoramaView::ahead(projection)
    })
}

fn camera(projection: ProjectionDesc, to_world: DAffine3, [width, height]: [u32; 2]) -> Camera {
    let mut desc = empty();
    desc.camera = CameraDesc { projection, to_world, ..desc.camera };
    (desc.film.width, desc.film.height) = (width, height);
    Camera::new(&desc.camera, &desc.film, &PrepareOptions { width, height }).unwrap()
}

/// The perspective camera that looks as the view does.
fn perspective(view: &PanoramaView, size: [u32; 2]) -> Camera {
    let (yaw, pitch) = (f64::from(view.yaw).to_radians(), f64::from(view.pitch).to_radians());
    let ahead = DVec3::new(-yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
    let left = DVec3::Y.cross(ahead).normalize();
    let axes = DMat3::from_cols(left, ahead.cross(left), ahead);
    // In a strip the angle is that along twice the shorter side.
    let [longer, shorter] = [size[0].max(size[1]), size[0].min(size[1])].map(f64::from);
    let strip = (0.5 * longer / shorter).max(1.0);
    let fov = 2.0 * (strip * (0.5 * f64::from(view.fov)).to_radians().tan()).atan().to_degrees();
    let lens = LensDesc::PINHOLE;
    let desc = PerspectiveDesc { fov, fov_axis: FovAxis::Larger, lens, distortion: None };
    camera(ProjectionDesc::Perspective(desc), DAffine3::from_mat3(axes), size)
}

/// The direction at a place in pixels; `None` where the camera sees nothing.
fn direction(camera: &Camera, place: DVec2, size: [u32; 2]) -> Option<Vec3> {
    let uv = place / DVec2::from(size.map(f64::from));
    camera.ray(uv.to_array(), CENTER).map(|ray| ray.direction.normalize())
}

fn centers([width, height]: [u32; 2]) -> impl Iterator<Item = DVec2> {
    (0..height).flat_map(move |y| (0..width).map(move |x| DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)))
}

/// A panorama of its own directions becomes a picture of the directions of a perspective camera. What is no part of a view is not a number:
/// the blank cells of a cross, and the right eye.
#[test]
fn views_show_what_a_perspective_camera_sees() {
    for (projection, desc, size @ [width, height]) in panoramas() {
        let panorama = camera(desc, DAffine3::IDENTITY, size);
        let is_shown =
            |at: DVec2| projection != PanoramaProjection::OverUnder || at.y < 0.5 * f64::from(height);
        let texel = |at: DVec2| direction(&panorama, at, size).filter(|_| is_shown(at)).unwrap_or(Vec3::NAN);
        let texels = centers(size).map(texel).collect();
        let picture = Grid::from_rows(width as usize, height as usize, texels).unwrap();
        // A texel of a face is 1/16 wide, and beyond an edge lies the nearest of the face beside it; one of a sphere is 1/20 wide.
        let is_sphere = matches!(projection, PanoramaProjection::Spherical | PanoramaProjection::OverUnder);
        let bound = if is_sphere { 1e-3 } else { 1e-2 };
        for view in views(projection) {
            let mut post = PostSettings::default();
            post.look_around.view = Some(view);
            let shown = post.apply(&picture, PictureGrid { extent: size, detail: 1 }).unwrap();
            let wanted = perspective(&view, size);
            let (mut worst, mut sum) = (0f32, 0.0);
            for (at, got) in centers(size).zip(shown.pixels()) {
                let error = got.normalize().distance(direction(&wanted, at, size).unwrap());
                assert!(error < bound, "{view:?} at {at}: {got}, off by {error}");
                (worst, sum) = (worst.max(error), sum + error);
            }
            let mean = sum / shown.pixels().len() as f32;
            assert!(mean < 1e-3, "{view:?}: mean {mean}, worst {worst}");
        }
    }
}

/// The same of fisheye lenses, as far as they see; beyond that a view is black.
#[test]
fn views_into_fisheye_pictures_show_what_a_perspective_camera_sees() {
    let size = [72, 72];
    for (projection, mapping, lens) in [
        (PanoramaProjection::FisheyeEquidistant, FisheyeMapping::Equidistant, 200.0),
        (PanoramaProjection::FisheyeEquisolid, FisheyeMapping::Equisolid, 220.0),
        (PanoramaProjection::FisheyeStereographic, FisheyeMapping::Stereographic, 160.0),
        (PanoramaProjection::FisheyeOrthographic, FisheyeMapping::Orthographic, 120.0),
    ] {
        let (fov, fov_axis) = (f64::from(lens), FovAxis::Smaller);
        let desc = FisheyeDesc { mapping, fov, fov_axis, image_circle: 360.0, distortion: [0.0; 4] };
        let fisheye = camera(ProjectionDesc::Fisheye(desc), DAffine3::IDENTITY, size);
        let texels = centers(size).map(|at| direction(&fisheye, at, size).unwrap_or(Vec3::NAN)).collect();
        let picture = Grid::from_rows(72, 72, texels).unwrap();
        let extent = Vec2::splat(72.0);
        let mut counts = [0, 0];
        for view in views(projection).map(|view| PanoramaView { lens, ..view }) {
            let mut post = PostSettings::default();
            post.look_around.view = Some(view);
            let shown = post.apply(&picture, PictureGrid { extent: size, detail: 1 }).unwrap();
            let wanted = perspective(&view, size);
            for (at, got) in centers(size).zip(shown.pixels()) {
                let ray = direction(&wanted, at, size).unwrap();
                let Some(place) = view.to_picture(at, extent) else {
                    assert_eq!(*got, Vec3::ZERO, "{view:?} at {at}");
                    counts[1] += 1;
                    continue;
                };
                // Two lenses crowd what is beside or behind them into a rim; texels at the edge of the picture lack a neighbour.
                let is_rim = match mapping {
                    FisheyeMapping::Orthographic => ray.z < 0.4,
                    FisheyeMapping::Equisolid => ray.z < -0.8,
                    FisheyeMapping::Equidistant | FisheyeMapping::Stereographic => false,
                };
                if is_rim || place.min_element() < 1.0 || place.max_element() > 71.0 {
                    continue;
                }
                let back = direction(&fisheye, place, size).unwrap().distance(ray);
                assert!(back < 5e-4, "{view:?}: {at} to {place}: off by {back}");
                let error = got.normalize().distance(ray);
                assert!(error < 2e-2, "{view:?} at {at}: {got}, off by {error}");
                let there = view.to_shown(place, extent).unwrap();
                assert!(there.distance(at) < 0.1, "{view:?}: {at} to {place} to {there}");
                counts[0] += 1;
            }
        }
        assert!(counts.iter().all(|count| *count > 500), "{projection:?}: {counts:?} inside and outside");
    }
}

/// A place of the window is the place of the panorama whose ray goes the same way, and back again.
#[test]
fn places_of_views_are_places_of_the_panorama() {
    for (projection, desc, size) in panoramas() {
        let panorama = camera(desc, DAffine3::IDENTITY, size);
        let extent = Vec2::from(size.map(|n| n as f32));
        for view in views(projection) {
            let wanted = perspective(&view, size);
            for shown in centers(size).step_by(7) {
                let place = view.to_picture(shown, extent).unwrap();
                let got = direction(&panorama, place, size).unwrap();
                let error = got.distance(direction(&wanted, shown, size).unwrap());
                assert!(error < 5e-4, "{view:?}, {shown} to {place}: off by {error}");
                let back = view.to_shown(place, extent).unwrap();
                assert!(back.distance(shown) < 0.1, "{view:?}: {shown} to {place} to {back}");
            }
        }
    }
    let ahead = PanoramaView::ahead(PanoramaProjection::OverUnder);
    let extent = Vec2::new(128.0, 128.0);
    assert_eq!(ahead.to_shown(DVec2::new(1.0, 32.0), extent), None, "behind");
    assert_eq!(ahead.to_shown(DVec2::new(64.0, 96.0), extent), None, "of the other eye");
    let middle = ahead.to_shown(DVec2::new(64.0, 32.0), extent).unwrap();
    assert!(middle.distance(DVec2::splat(64.0)) < 1e-3, "{middle}");
}
