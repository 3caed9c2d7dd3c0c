//! The unblurred scene-linear picture of a film's sums: what goes into the EXR's main layer.

use glam::Vec3;

use crate::client::settings::{FilmData, FilmSpec};
use crate::color::Profile;

/// CIE XYZ `[height][width]`: camera sums over their weight plus light sums times texels per light path.
///
/// A pixel that no camera sample reached has the light stream only; without either it is 0.
pub fn linear_xyz(data: &FilmData) -> Vec<[f32; 3]> {
    let spec = FilmSpec {
        width: data.width,
        height: data.height,
        filter: Default::default(),
        variance: Default::default(),
    };
    let light_scale = data.counts.light_scale(&spec);
    let mut picture = vec![[0.0f32; 3]; data.width as usize * data.height as usize];
    for (out, sum) in picture.iter_mut().zip(&data.camera) {
        if sum[3] > 0.0 {
            *out = [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]];
        }
    }
    for (out, sum) in picture.iter_mut().zip(&data.light) {
        for (out, sum) in out.iter_mut().zip(sum) {
            *out += sum * light_scale;
        }
    }
    picture
}

/// The same in linear RGB of `profile` (Rec.709 primaries for EXR); out-of-gamut values stay negative.
pub fn linear_rgb(data: &FilmData, profile: &Profile) -> Vec<[f32; 3]> {
    linear_xyz(data).into_iter().map(|xyz| (profile.from_xyz * Vec3::from(xyz)).to_array()).collect()
}

/// Variance of the mean luminance in every pixel, `[height][width]`, in units of luminance².
///
/// From the deviations within the texel: right for independent samples, too large for a QMC sequence.
/// `energy` is the splat filter's ([`SplatFilter::energy`](crate::client::SplatFilter::energy)). Infinite
/// where fewer than two effective samples fell.
pub fn mean_variance(data: &FilmData, energy: f32) -> Vec<f32> {
    let scale2 = f64::from(data.luminance_scale) * f64::from(data.luminance_scale);
    let of_mean = |sum: f32, weight: f32| {
        let n = f64::from(weight / energy);
        // V/W is biased by (n − 1)/n; the mean has 1/n of the samples' variance.
        if n > 1.0 { f64::from(sum) / f64::from(weight) * scale2 / (n - 1.0) } else { f64::INFINITY }
    };
    data.camera.iter().zip(&data.camera_variance).map(|(c, &v)| of_mean(v, c[3]) as f32).collect()
}
