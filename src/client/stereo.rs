//! Composition of what two films display, one for each eye, into one picture.

use crate::client::settings::{ColorOutput, DisplayImage, OptionNames, Settings};
use crate::image::Grid;
use crate::image::stereo::{self, DisplayCoding, StereoError, StereoLayout};

/// The encoding of pictures that are displayed with these settings.
///
/// # Errors
///
/// [`StereoError::Encoding`] for wide-range outputs, whose values are no 8-bit signals of a display.
pub fn coding(settings: &Settings) -> Result<DisplayCoding, StereoError> {
    match settings.output {
        ColorOutput::Sdr => Ok(DisplayCoding::new(&settings.profile, settings.gamma)),
        other => Err(StereoError::Encoding(other.label())),
    }
}

/// A displayed picture as a grid, for [`stereo::write_jps`] and [`stereo::write_mpo`].
pub fn grid(picture: DisplayImage) -> Grid<[u8; 3]> {
    Grid::from_rows(picture.width as usize, picture.height as usize, picture.rgb)
        .expect("a displayed picture has all its pixels")
}

/// Composes the pictures of the left and the right eye, displayed with `settings`, which each has seen by itself: filters and glare act before.
///
/// # Errors
///
/// As [`stereo::compose`] and [`coding`].
pub fn compose(
    eyes: [DisplayImage; 2],
    layout: StereoLayout,
    settings: &Settings,
) -> Result<DisplayImage, StereoError> {
    let coding = coding(settings)?;
    let [left, right] = eyes.map(grid);
    let composed = stereo::compose([&left, &right], layout, &coding)?;
    let [width, height] = [composed.width() as u32, composed.height() as u32];
    Ok(DisplayImage { width, height, rgb: composed.into_pixels() })
}
