//! Colour metadata of image files: primaries and white point of EXR files, which are converted to Rec.709, and metadata of other files that
//! is not used, as remarks.
//!
//! Textures are linear Rec.709, or sRGB if they are integers. Other metadata would change the colours, so it is always reported.

use std::io::Cursor;

use glam::{DVec2, Vec3};
use png::{ScaledFloat, SourceChromaticities};

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
    let mut remarks = Vec::new();
    let Ok(reader) = png::Decoder::new(Cursor::new(bytes)).read_info() else { return remarks };
    let info = reader.info();
    // An sRGB chunk makes the other chunks redundant.
    if info.srgb.is_some() {
        return remarks;
    }
    if let Some(gamma) = info.gama_chunk.map(ScaledFloat::into_value)
        && (gamma - 1.0 / 2.2).abs() > 0.01
    {
        remarks.push(format!("its gamma {gamma:.3}"));
    }
    if let Some(SourceChromaticities { white, red, green, blue }) = info.chrm_chunk {
        let xy =
            |(x, y): (ScaledFloat, ScaledFloat)| DVec2::new(x.into_value().into(), y.into_value().into());
        if !are_rec709(&[red, green, blue, white].map(xy)) {
            remarks.push("its chromaticities, which are not those of sRGB".to_owned());
        }
    }
    if info.coding_independent_code_points.is_some() {
        remarks.push("its coding-independent code points (chunk cICP)".to_owned());
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

    fn png(change: impl Fn(&mut png::Info)) -> Vec<u8> {
        let mut info = png::Info::with_size(1, 1);
        change(&mut info);
        let mut bytes = Vec::new();
        let encoder = png::Encoder::with_info(&mut bytes, info).expect("an encoder");
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[0]).expect("a pixel");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn png_files_are_taken_as_srgb_and_it_is_told_where_they_are_not() {
        let gamma = |value| Some(ScaledFloat::new(value));
        let srgb = SourceChromaticities::new((0.3127, 0.329), (0.64, 0.33), (0.3, 0.6), (0.15, 0.06));
        let p3 = SourceChromaticities::new((0.3127, 0.329), (0.68, 0.32), (0.265, 0.69), (0.15, 0.06));
        let told = |change: &dyn Fn(&mut png::Info)| remarks_of_png(&png(change));
        let usual =
            told(&|info| (info.source_gamma, info.source_chromaticities) = (gamma(0.45455), Some(srgb)));
        assert!(usual.is_empty(), "{usual:?}");
        let linear = told(&|info| info.source_gamma = gamma(1.0));
        assert_eq!(linear, ["its gamma 1.000"]);
        let both = told(&|info| (info.source_gamma, info.source_chromaticities) = (gamma(1.0), Some(p3)));
        assert_eq!(both.len(), 2, "{both:?}");
        let marked = told(&|info| {
            (info.source_gamma, info.srgb) = (gamma(1.0), Some(png::SrgbRenderingIntent::Perceptual));
        });
        assert!(marked.is_empty(), "{marked:?}");
        assert!(remarks_of_png(b"\x89PNG").is_empty() && remarks_of_png(&[255; 40]).is_empty());
    }

    #[test]
    fn a_profile_that_is_not_that_of_srgb_is_told() {
        assert!(remark_of_profile(b"nothing").is_some());
    }
}
