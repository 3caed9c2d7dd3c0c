//! Radiance pictures (`.hdr`, `.pic`): three mantissas and one exponent per pixel, plain or run-length coded.
//!
//! As Mitsuba does, values are those of the file: what its header says of exposure and colours is not undone.

use image::codecs::hdr::{HdrDecoder, HdrMetadata};
use image::{ImageDecoder, ImageError};

use super::exr::{check_inflation, check_pixels};

/// Header lines with unused colour metadata, and their neutral values.
const OF_COLORS: [(&str, &[f64]); 3] = [
    ("EXPOSURE", &[1.0]),
    ("COLORCORR", &[1.0; 3]),
    ("PRIMARIES", &[0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3333, 0.3333]),
];

pub(super) struct RadiancePicture {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Linear R, G, B.
    pub(super) pixels: Vec<[f32; 3]>,
    /// Colour metadata in the header that is not used.
    pub(super) remarks: Vec<String>,
}

/// Decodes the file with these `bytes`, of at most `most` pixels.
pub(super) fn decode(bytes: &[u8], most: usize) -> Result<RadiancePicture, String> {
    let told = |error| match error {
        ImageError::IoError(_) => "it is cut short".to_owned(),
        error => error.to_string(),
    };
    let decoder = HdrDecoder::new_nonstrict(bytes).map_err(told)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_pixels(width, height, most)?;
    check_inflation(12 * (width as u64) * (height as u64), bytes.len())?;
    let remarks = remarks(&decoder.metadata());
    let mut pixels = vec![[0.0; 3]; width * height];
    decoder.read_image(bytemuck::cast_slice_mut(&mut pixels)).map_err(told)?;
    Ok(RadiancePicture { width, height, pixels, remarks })
}

fn remarks(metadata: &HdrMetadata) -> Vec<String> {
    let unusual = metadata.custom_attributes.iter().filter(|(name, text)| {
        let values: Vec<f64> = text.split_ascii_whitespace().filter_map(|v| v.parse().ok()).collect();
        OF_COLORS.iter().any(|(known, usual)| {
            let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 2e-3;
            name == known && !(values.len() == usual.len() && values.iter().zip(*usual).all(is_near))
        })
    });
    unusual.map(|(name, text)| format!("its line `{name}={}`", text.trim_end())).collect()
}
