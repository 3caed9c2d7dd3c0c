//! Pictures inside a page: `data:` URIs (RFC 2397).

use crate::image::png::{self, Picture};

/// Quality of JPEG: at 92 of 100, with colour at full resolution, noise looks as it did.
const QUALITY: u8 = 92;

/// As PNG: every value as it is. `None` for a wrong number of pixels.
pub fn exact(picture: Picture<'_>) -> Option<String> {
    let bytes = png::encode(picture, &[]).ok()?;
    Some(format!("data:image/png;base64,{}", base64(&bytes)))
}

/// As JPEG, a third of the bytes of a noisy PNG: for looking at; values are taken as sRGB. `None` for a wrong number of
/// pixels or more than 65535 along a side.
pub fn seen(width: u32, height: u32, rgb: &[[u8; 3]]) -> Option<String> {
    let [w, h] = [width, height].map(|side| u16::try_from(side).ok());
    let (w, h) = w.zip(h).filter(|(w, h)| rgb.len() == usize::from(*w) * usize::from(*h))?;
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_1_1);
    encoder.encode(rgb.as_flattened(), w, h, jpeg_encoder::ColorType::Rgb).ok()?;
    Some(format!("data:image/jpeg;base64,{}", base64(&bytes)))
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word =
            three.iter().enumerate().fold(0u32, |word, (i, &byte)| word | u32::from(byte) << (16 - 8 * i));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= three.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn jpeg_takes_what_it_can() {
        let grey = [[127; 3]; 6];
        assert!(seen(3, 2, &grey).is_some_and(|uri| uri.starts_with("data:image/jpeg;base64,/9j/")));
        assert_eq!(seen(3, 3, &grey), None);
        assert_eq!(seen(0, 0, &[]), None);
        assert_eq!(seen(70_000, 0, &[]), None);
    }
}
