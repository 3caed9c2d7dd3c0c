//! Colour metadata of image files: primaries and white point of EXR files, which are converted to Rec.709, and metadata of other files that
//! is not used, as remarks.
//!
//! Textures are linear Rec.709, or sRGB if they are integers. Other metadata would change the colours, so it is always reported.

use glam::{DVec2, Vec3};

use crate::color::profile::{Profile, rec709_from};
use crate::color::{icc, srgb};

/// CIE xy chromaticities of red, green, blue and white.
pub type Chromaticities = [DVec2; 4];

/// Chromaticities that differ by less count as equal, since files round them.
const SAME: f64 = 2e-3;

/// Primaries and white point of Rec.709.
pub const REC_709: Chromaticities =
    [DVec2::new(0.64, 0.33), DVec2::new(0.30, 0.60), DVec2::new(0.15, 0.06), DVec2::new(0.312_7, 0.329_0)];

/// Whether primaries and white point are those of Rec.709.
pub(super) fn are_rec709(given: &Chromaticities) -> bool {
    given.iter().zip(REC_709).all(|(a, b)| a.distance(b) < SAME)
}

/// Converts linear colours of these chromaticities to Rec.709, keeping the absolute stimulus, as Mitsuba does: no chromatic adaptation.
///
/// # Errors
///
/// A description of what is wrong with the chromaticities.
pub(super) fn to_rec709(given: &Chromaticities, pixels: &mut [[f32; 3]]) -> Result<(), String> {
    let [red, green, blue, white] = *given;
    let matrix = rec709_from([red, green, blue], white)
        .ok_or("the chromaticities in its header are not those of three colours")?;
    pixels.iter_mut().for_each(|rgb| *rgb = (matrix * Vec3::from(*rgb)).to_array());
    Ok(())
}

/// Remark about an ICC profile, unless it is sRGB.
pub(super) fn remark_of_profile(profile: &[u8]) -> Option<String> {
    let srgb = Profile::srgb();
    let is_srgb = icc::parse(profile).is_ok_and(|given| {
        let near = given.primaries.iter().zip(srgb.primaries).all(|(a, b)| a.distance(b) < 5e-3);
        let signal = |v: f32| given.transfer.as_ref().map_or(v, |curve| curve.apply(Vec3::splat(v)).y);
        near && [0.05, 0.2, 0.5].into_iter().all(|v| (signal(v) - srgb::encode(v)).abs() < 0.02)
    });
    (!is_srgb).then(|| "its ICC profile, which is not that of sRGB".to_owned())
}

/// Remarks about the colour chunks of a PNG file, except its ICC profile.
pub(super) fn remarks_of_png(bytes: &[u8]) -> Vec<String> {
    /// Bytes before the first chunk.
    const SIGNATURE: usize = 8;
    let mut remarks = Vec::new();
    let mut rest = bytes.get(SIGNATURE..).unwrap_or_default();
    while let Some((head, data)) = rest.split_first_chunk::<8>() {
        let (length, name) = (u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize, &head[4..]);
        let Some(chunk) = data.get(..length) else { break };
        let number = |i: usize| {
            let bytes = chunk.get(4 * i..4 * i + 4)?;
            Some(f64::from(u32::from_be_bytes(bytes.try_into().ok()?)) / 100_000.0)
        };
        match name {
            // An sRGB chunk makes the other chunks redundant.
            b"sRGB" => return Vec::new(),
            b"IDAT" => break,
            b"gAMA" => {
                let gamma = number(0).unwrap_or_default();
                if (gamma - 1.0 / 2.2).abs() > 0.01 {
                    remarks.push(format!("its gamma {gamma:.3}"));
                }
            }
            b"cHRM" => {
                let xy = |i: usize| number(2 * i).zip(number(2 * i + 1)).map_or(DVec2::ZERO, DVec2::from);
                let [white, red, green, blue] = std::array::from_fn(xy);
                if !are_rec709(&[red, green, blue, white]) {
                    remarks.push("its chromaticities, which are not those of sRGB".to_owned());
                }
            }
            b"cICP" => remarks.push("its coding-independent code points (chunk cICP)".to_owned()),
            _ => (),
        }
        rest = data.get(length + 4..).unwrap_or_default();
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Primaries and white point of ACES (SMPTE ST 2065-1).
    const AP0: Chromaticities = [
        DVec2::new(0.7347, 0.2653),
        DVec2::new(0.0, 1.0),
        DVec2::new(0.0001, -0.077),
        DVec2::new(0.321_68, 0.337_67),
    ];

    #[test]
    fn colours_of_other_primaries_are_those_of_the_same_light() {
        assert!(are_rec709(&REC_709) && !are_rec709(&AP0));
        let mut pixels = [[0.8, 0.1, 0.1]];
        to_rec709(&AP0, &mut pixels).expect("they are colours");
        let [[r, g, b]] = pixels;
        assert!((r - 1.89).abs() < 0.01 && (g + 0.10).abs() < 0.01 && (b - 0.08).abs() < 0.01, "{r} {g} {b}");
        // Luminance is preserved: the Y row of AP0 is .344, .728, −.072.
        let y = crate::color::profile::rec709_luminance().dot(pixels[0].into());
        assert!((y - (0.3439664 * 0.8 + 0.7281661 * 0.1 - 0.0721325 * 0.1)).abs() < 1e-3, "{y}");
        for bad in [[DVec2::ZERO; 4], [DVec2::NAN; 4], [DVec2::ONE; 4]] {
            assert!(to_rec709(&bad, &mut []).is_err(), "{bad:?}");
        }
    }

    fn png(chunks: &[(&[u8; 4], &[u32])]) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        for (name, values) in chunks {
            bytes.extend((4 * values.len() as u32).to_be_bytes());
            bytes.extend(*name);
            values.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
            bytes.extend([0; 4]);
        }
        bytes
    }

    #[test]
    fn png_files_are_taken_as_srgb_and_it_is_told_where_they_are_not() {
        let srgb = [31_270, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000];
        let p3 = [31_270, 32_900, 68_000, 32_000, 26_500, 69_000, 15_000, 6_000];
        for (chunks, told) in [
            (vec![(b"gAMA", [45_455].as_slice()), (b"cHRM", &srgb)], 0),
            (vec![(b"gAMA", [100_000].as_slice())], 1),
            (vec![(b"gAMA", [100_000].as_slice()), (b"cHRM", &p3), (b"cICP", &[1])], 3),
            (vec![(b"gAMA", [100_000].as_slice()), (b"sRGB", &[0])], 0),
            (vec![(b"IDAT", [0].as_slice()), (b"gAMA", &[100_000])], 0),
            (vec![(b"gAMA", [].as_slice())], 1),
            (vec![(b"cHRM", [1, 2].as_slice())], 1),
        ] {
            let remarks = remarks_of_png(&png(&chunks));
            assert_eq!(remarks.len(), told, "{remarks:?}");
        }
        assert!(remarks_of_png(b"\x89PNG").is_empty() && remarks_of_png(&[255; 40]).is_empty());
    }

    #[test]
    fn a_profile_that_is_not_that_of_srgb_is_told() {
        assert!(remark_of_profile(b"nothing").is_some());
    }
}
