//! Conversion of a film's sums to the scene-linear picture without reconstruction blur, as stored in the EXR's main layer.

use glam::{DVec3, Vec3};

use crate::client::reference::tonemap::ToneMapper;
use crate::client::settings::{FilmData, Settings};
use crate::color::Profile;
use crate::color::profile::xyz_from_rec709;
use crate::gpu::Region;
use crate::image::compare::Measured;
use crate::image::exr::Layers;
use crate::image::{Attribute, Grid};

/// CIE XYZ `[height][width]`: camera sums over their weight plus light sums times texels per light path.
///
/// A pixel that no camera sample reached has the light stream only; without either it is 0.
pub fn linear_xyz(data: &FilmData) -> Vec<[f32; 3]> {
    let light_scale = data.counts.light_scale(data.width, data.height);
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

/// As [`linear_xyz`], converted to linear RGB of `profile` (Rec.709 primaries for EXR); out-of-gamut values stay negative.
pub fn linear_rgb(data: &FilmData, profile: &Profile) -> Vec<[f32; 3]> {
    linear_xyz(data).into_iter().map(|xyz| (profile.from_xyz * Vec3::from(xyz)).to_array()).collect()
}

/// Display-linear sRGB of a scene-linear picture (Rec.709) after the tone curve; non-finite values become NaN.
pub fn shown(rgb: &Grid<[f32; 3]>, settings: &Settings) -> Grid<[f32; 3]> {
    let tone = ToneMapper::new(settings);
    let to_xyz = xyz_from_rec709();
    let mut shown = rgb.clone();
    for pixel in shown.pixels_mut() {
        let finite = pixel.iter().all(|c| c.is_finite());
        // In double precision, since the sum of the largest floats would be infinite.
        let xyz = (to_xyz * DVec3::from(pixel.map(f64::from))).min(DVec3::splat(1e30)).as_vec3();
        *pixel = if finite { tone.linear(xyz).to_array() } else { Vec3::NAN.to_array() };
    }
    shown
}

/// Variance of the mean luminance in every pixel, `[height][width]`, in units of luminance².
///
/// Camera stream: `V/(n − 1)/W` with `n = W/energy` effective samples; infinite for `n ≤ 1`. Light stream:
/// `energy · Σ f Y²`, the variance of a sum with a random number of terms, times the light scale squared.
/// Squares count with the squares of the samples' weights. Right for independent samples, too large for those of a low-discrepancy sequence. `energy` is the splat
/// filter's ([`SplatFilter::energy`](crate::client::SplatFilter::energy)).
pub fn mean_variance(data: &FilmData, energy: f32) -> Vec<f32> {
    let energy = f64::from(energy);
    let scale2 = f64::from(data.luminance_scale).powi(2);
    let light_scale2 = f64::from(data.counts.light_scale(data.width, data.height)).powi(2);
    let mut variances = vec![0.0f64; data.width as usize * data.height as usize];
    for ((out, sum), &v) in variances.iter_mut().zip(&data.camera).zip(&data.camera_variance) {
        let (v, w) = (f64::from(v), f64::from(sum[3]));
        let n = w / energy;
        *out = if n > 1.0 { v * scale2 / (w * (n - 1.0)) } else { f64::INFINITY };
    }
    for ((out, sum), &v) in variances.iter_mut().zip(&data.light).zip(&data.light_variance) {
        let (y, w) = (f64::from(sum[1]), f64::from(sum[3]));
        let squares = f64::from(v) * scale2 + if w > 0.0 { y * y / w } else { 0.0 };
        *out += energy * squares * light_scale2;
    }
    variances.into_iter().map(|v| v as f32).collect()
}

/// Mixes `part` of the picture of a region, which begins at the pixel `origin`, into the sums of the whole picture, in whose pixels the part is
/// given: the mean of both pictures, the region's with this `share`, from 0 to 1. The sums of weights are added, and so is what is known of the variance of the camera stream, which holds where
/// shares are those of the samples.
pub fn mix_region(data: &mut FilmData, region: &FilmData, origin: [u32; 2], part: Region, share: f32) {
    let (width, columns) = (data.width as usize, region.width as usize);
    let rows = part.origin[1] as usize..(part.origin[1] + part.extent[1]) as usize;
    let places = || {
        rows.clone()
            .flat_map(|y| (part.origin[0] as usize..).take(part.extent[0] as usize).map(move |x| (x, y)))
    };
    let [x0, y0] = origin.map(|n| n as usize);
    // Index of a pixel in the whole picture and in the region.
    let pair = move |(x, y): (usize, usize)| (y * width + x, (y - y0) * columns + x - x0);
    let pixels = width * data.height as usize;
    // A stream without samples has empty sums.
    for (sums, more) in [(&mut data.camera, &region.camera), (&mut data.light, &region.light)] {
        if sums.is_empty() && !more.is_empty() {
            sums.resize(pixels, [0.0; 4]);
        }
    }
    for (sums, more) in [
        (&mut data.camera_variance, &region.camera_variance),
        (&mut data.light_variance, &region.light_variance),
    ] {
        if sums.is_empty() && !more.is_empty() {
            sums.resize(pixels, 0.0);
        }
    }
    let unit = (region.luminance_scale / data.luminance_scale).powi(2);
    let mean = |[x, y, z, w]: [f32; 4]| if w > 0.0 { Vec3::new(x, y, z) / w } else { Vec3::ZERO };
    let kept = 1.0 - share;
    for (place, i) in places().map(pair) {
        let Some(sum) = data.camera.get_mut(place) else { break };
        let more = region.camera.get(i).copied().unwrap_or_default();
        let weight = sum[3] + more[3];
        let mixed = match (sum[3] > 0.0, more[3] > 0.0) {
            (true, true) => mean(*sum) * kept + mean(more) * share,
            (true, false) => mean(*sum),
            (false, _) => mean(more),
        };
        *sum = (mixed * weight).extend(weight).to_array();
        if let Some(variance) = data.camera_variance.get_mut(place) {
            *variance += region.camera_variance.get(i).copied().unwrap_or(0.0) * unit;
        }
    }
    // Light sums are normalised by the number of light paths of the whole picture; if that is zero, the region's is used.
    if data.counts.light_paths == 0 {
        data.counts.light_paths = region.counts.light_paths;
    }
    let scale = data.counts.light_scale(data.width, data.height);
    let factor = match region.counts.light_scale(region.width, region.height) {
        more if scale > 0.0 => share * more / scale,
        _ => 0.0,
    };
    for (place, i) in places().map(pair) {
        let Some(sum) = data.light.get_mut(place) else { break };
        let more = region.light.get(i).copied().unwrap_or_default();
        let squares = |[_, y, _, w]: [f32; 4], v: f32| v + if w > 0.0 { y * y / w } else { 0.0 };
        let mixed: [f32; 4] = std::array::from_fn(|c| match c {
            3 => sum[3] + more[3],
            c => sum[c] * kept + more[c] * factor,
        });
        if let Some(variance) = data.light_variance.get_mut(place) {
            let (own, other) = (data.luminance_scale.powi(2), region.luminance_scale.powi(2));
            let of_region = region.light_variance.get(i).copied().unwrap_or(0.0);
            let all = kept.powi(2) * squares(*sum, *variance * own)
                + factor.powi(2) * squares(more, of_region * other);
            *variance = (all - squares(mixed, 0.0)).max(0.0) / own;
        }
        *sum = mixed;
    }
}

/// The picture with everything needed to go on from it, for [`exr::write`](crate::image::exr::write):
/// R, G, B; `camera.XYZW` and `light.XYZW` sums; `variance.camera` and `variance.light` sums; `variance.Y`,
/// the variance of the mean; without those of the variance where the film keeps none. Counts and the luminance scale are added to the attributes.
pub fn layers(data: &FilmData, profile: &Profile, energy: f32, attributes: &[(String, Attribute)]) -> Layers {
    let mut layers = Layers {
        width: data.width as usize,
        height: data.height as usize,
        attributes: attributes.to_vec(),
        ..Layers::default()
    };
    let rgb = linear_rgb(data, profile);
    for (i, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.push(name, rgb.iter().map(|c| c[i]));
    }
    let streams =
        [("camera", &data.camera, &data.camera_variance), ("light", &data.light, &data.light_variance)];
    for (stream, color, variance) in streams.into_iter().filter(|(_, color, _)| !color.is_empty()) {
        for (i, axis) in ["X", "Y", "Z", "W"].into_iter().enumerate() {
            layers.push(&format!("{stream}.{axis}"), color.iter().map(|c| c[i]));
        }
        if !variance.is_empty() {
            layers.push(&format!("variance.{stream}"), variance.iter().copied());
        }
    }
    let has_variance = !(data.camera_variance.is_empty() && data.light_variance.is_empty());
    if has_variance {
        layers.push(Measured::VARIANCE_CHANNEL, mean_variance(data, energy));
    }
    let counts = data.counts;
    for (name, value) in [
        ("luminanceScale", f64::from(data.luminance_scale)),
        ("cameraSamples", counts.camera_samples as f64),
        ("lightSamples", counts.light_samples as f64),
        ("cameraPaths", counts.camera_paths as f64),
        ("lightPaths", counts.light_paths as f64),
    ] {
        layers.attributes.push((name.to_owned(), Attribute::Number(value)));
    }
    layers
}
