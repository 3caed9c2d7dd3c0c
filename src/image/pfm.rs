//! Portable float maps (`.pfm`): a header of three numbers, then 32-bit floats in rows from the bottom.

use super::exr::check_pixels;

/// Width, height and linear R, G, B of the file with these `bytes`, of at most `most` pixels. As in Mitsuba, the magnitude of the
/// header's scale multiplies the values; its sign tells the order of bytes.
pub(super) fn decode(bytes: &[u8], most: usize) -> Result<(usize, usize, Vec<[f32; 3]>), String> {
    let mut rest = bytes;
    let mut word = || {
        rest = rest.trim_ascii_start();
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .filter(|n| *n < 64)
            .ok_or("its header does not end")?;
        let (word, behind) = rest.split_at(end);
        rest = behind;
        std::str::from_utf8(word).map_err(|_| "its header is no text")
    };
    let channels = match word()? {
        "PF" => 3,
        "Pf" => 1,
        other => return Err(format!("it begins with {other} instead of PF or Pf")),
    };
    let number = |text: &str| text.parse::<f64>().map_err(|_| format!("`{text}` in its header is no number"));
    let [width, height, scale] = [number(word()?)?, number(word()?)?, number(word()?)?];
    // Non-integers and NaN become a size that does not match the data.
    let (width, height) = (width as usize, height as usize);
    check_pixels(width, height, most)?;
    // A single whitespace character ends the header.
    let data = rest.get(1..).unwrap_or_default();
    let (floats, _) = data.as_chunks::<4>();
    if floats.len() < width * height * channels {
        return Err("it is cut short".to_owned());
    }
    let factor = scale.abs() as f32;
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(format!("the scale {scale} in its header is not usable"));
    }
    let read: fn([u8; 4]) -> f32 = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let pixel = |i: usize| {
        let value = |c: usize| factor * read(floats[i * channels + c.min(channels - 1)]);
        [value(0), value(1), value(2)]
    };
    let rows = (0..height).rev().flat_map(|y| (0..width).map(move |x| y * width + x));
    Ok((width, height, rows.map(pixel).collect()))
}
