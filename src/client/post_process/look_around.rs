//! A perspective view into a picture of all directions, which is turned without tracing anything anew.

use glam::{Vec2, Vec3};

use crate::client::layout::blocks;
use crate::client::post_process::panorama::{PanoramaGrid, PanoramaProjection, PanoramaView, VIEW_FOVS};
use crate::client::post_process::post_pass::{PictureGrid, PostProcess, PostSlider};
use crate::image::Grid;

/// The view that is shown in the place of a panorama.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct LookAround {
    /// A perspective view into a picture of all directions: how that shows them (spherical, over-under, cube-block, cube-row, cube-column,
    /// cube-cross, fisheye-equidistant, fisheye-equisolid, fisheye-stereographic, fisheye-orthographic), and in degrees the angles of the view to
    /// the right and up, its field of view along the longer side (10 to 120; in a strip along twice the shorter one), and what a fisheye lens covers along the shorter side.
    #[arg(id = "look_around", long = "look-around", value_name = "PROJECTION[,YAW,PITCH,FOV[,LENS]]")]
    #[arg(value_parser = PanoramaView::parse)]
    pub view: Option<PanoramaView>,
}

blocks! {
    /// Constants of `look_around.frag`.
    LookAroundPush, 64 {
        /// Direction of the top left corner of the picture, in camera space; the fourth number is not used.
        corner: [f32; 4],
        /// Its change per texel to the right.
        across: [f32; 4],
        /// Its change per texel down.
        down: [f32; 4],
        /// Texels that the picture covers.
        size: [f32; 2],
        /// Focal length of a fisheye lens, texels.
        focal: f32,
        /// Fills the last 16 bytes.
        padding: f32,
    }
}

impl PostProcess for LookAround {
    const NAME: &'static str = "look-around";
    const SHADER: &'static str = "look_around.frag";
    type Push = LookAroundPush;

    fn is_on(&self) -> bool {
        self.view.is_some()
    }

    fn example() -> Self {
        Self { view: Some(PanoramaView::ahead(PanoramaProjection::Spherical)) }
    }

    fn options(&self) -> String {
        self.view
            .map_or_else(|| "no --look-around".to_owned(), |view| format!("--look-around {}", view.text()))
    }

    fn sliders(&mut self) -> Vec<PostSlider<'_>> {
        let Some(PanoramaView { yaw, pitch, fov, .. }) = &mut self.view else { return Vec::new() };
        let slider = |label, hint, value, default, range| PostSlider { label, hint, value, default, range };
        vec![
            slider("View right", "Degrees from the middle of the panorama", yaw, 0.0, -180.0..=180.0),
            slider("View up", "Degrees above the horizon", pitch, 0.0, -90.0..=90.0),
            slider(
                "View width",
                "Field of view along the longer side of the picture, in a strip along twice the shorter one, degrees",
                fov,
                90.0,
                VIEW_FOVS[0]..=VIEW_FOVS[1],
            ),
        ]
    }

    fn push(&self, PictureGrid { extent, detail }: PictureGrid) -> LookAroundPush {
        let size = Vec2::from(extent.map(|n| n as f32 / detail as f32));
        let Some(view) = self.view else { return LookAroundPush::default() };
        let [corner, across, down] = view.directions(size).map(|v| v.extend(0.0).to_array());
        let focal = PanoramaGrid::new(&view, size).focal();
        LookAroundPush { corner, across, down, size: size.to_array(), focal, padding: 0.0 }
    }

    fn constants(&self) -> Vec<u32> {
        self.view.iter().map(|view| view.projection as u32).collect()
    }

    fn texel(&self, push: &LookAroundPush, picture: &Grid<Vec3>, [x, y]: [usize; 2]) -> Vec3 {
        let Some(view) = self.view else { return picture.at(x, y) };
        let [corner, across, down] =
            [push.corner, push.across, push.down].map(|v| Vec3::new(v[0], v[1], v[2]));
        let direction = corner + across * (x as f32 + 0.5) + down * (y as f32 + 0.5);
        PanoramaGrid::new(&view, push.size.into()).sample(picture, direction)
    }
}
