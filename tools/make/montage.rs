//! Pictures side by side, for the figures of the README.

use std::path::{Path, PathBuf};

use pointillist::image::png::{PngPicture, Transfer, read, write};

/// Columns of white between two pictures, pixels.
const GAP: usize = 4;

/// Joins PNG pictures of one height and writes them to `out`.
pub fn join(out: &Path, pictures: &[PathBuf]) -> Result<(), Box<dyn std::error::Error>> {
    let pictures = pictures.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let height = pictures.first().ok_or("no picture to join")?.1;
    if pictures.iter().any(|(_, h, _)| *h != height) {
        return Err("the pictures differ in height".into());
    }
    let mut rgb = Vec::new();
    for y in 0..height as usize {
        for (i, (width, _, pixels)) in pictures.iter().enumerate() {
            rgb.extend([[255; 3]; GAP].iter().take(if i > 0 { GAP } else { 0 }));
            let width = *width as usize;
            rgb.extend_from_slice(&pixels[y * width..][..width]);
        }
    }
    let width = (rgb.len() / height as usize) as u32;
    let primaries = pointillist::color::Profile::srgb().primaries;
    let picture = PngPicture { width, height, rgb: &rgb, transfer: Transfer::Gamma(2.2), primaries };
    write(out, picture, &[])?;
    Ok(())
}
