//! Pictures side by side, for the figures of the README.

use std::path::{Path, PathBuf};

use pointillist::image::png::{PngPicture, Transfer, write};

/// Columns of white between two pictures, pixels.
const GAP: usize = 4;

/// Joins PNG pictures of one height and writes them to `out`.
pub fn join(out: &Path, pictures: &[PathBuf]) -> Result<(), Box<dyn std::error::Error>> {
    let read = |path: &PathBuf| image::open(path).map(image::DynamicImage::into_rgb8);
    let pictures = pictures.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let height = pictures.first().ok_or("no picture to join")?.height();
    if pictures.iter().any(|picture| picture.height() != height) {
        return Err("the pictures differ in height".into());
    }
    let mut rgb = Vec::new();
    for y in 0..height {
        for (i, picture) in pictures.iter().enumerate() {
            rgb.extend([[255; 3]; GAP].iter().take(if i > 0 { GAP } else { 0 }));
            rgb.extend((0..picture.width()).map(|x| picture.get_pixel(x, y).0));
        }
    }
    let width = (rgb.len() / height as usize) as u32;
    let primaries = pointillist::color::Profile::srgb().primaries;
    let picture = PngPicture { width, height, rgb: &rgb, transfer: Transfer::Gamma(2.2), primaries };
    write(out, picture, &[])?;
    Ok(())
}
