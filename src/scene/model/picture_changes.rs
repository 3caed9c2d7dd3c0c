//! Pictures as materials need them: as they are, one channel, or a multiple.

use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageFormat, RgbImage, RgbaImage};

use super::surface::gloss;
use super::text::SceneText;
use crate::color::srgb;

/// A change that makes one picture of another.
#[derive(Clone, Copy, Debug)]
pub(super) enum Change {
    /// Nothing.
    None,
    /// Colours times this, linear.
    Times([f32; 3]),
    /// One channel times this.
    Channel { channel: usize, factor: f32 },
    /// Alpha times this; with a cutoff it is all or nothing.
    Alpha { factor: f32, cutoff: Option<f32> },
    /// Normals with x and y times this.
    Bend(f32),
    /// One minus the alpha times this: roughness from glossiness.
    Rough(f32),
    /// `clearcoat_gloss` of `principled` from green times this, a roughness.
    Gloss(f32),
    /// One channel as numbers without a bound: from the first of the range, where the picture is black, to the second.
    Between { channel: usize, range: [f32; 2] },
    /// Each channel times a number plus another one.
    Scaled(ScaledChannels),
    /// Light: the colours times this, linear, as numbers without a bound.
    Light([f32; 3]),
}

/// The scale and offset of channels.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScaledChannels {
    /// This channel alone; all three colours otherwise.
    pub(super) channel: Option<usize>,
    pub(super) scale: [f32; 4],
    pub(super) bias: [f32; 4],
    /// The colours of the picture are numbers, not encoded as sRGB; those that are made are, too.
    pub(super) linear: bool,
    pub(super) then: ChannelUse,
}

/// The use of a channel.
#[derive(Clone, Copy, Debug)]
pub(super) enum ChannelUse {
    /// A share, from 0 to 1.
    Share,
    /// All or nothing: 1 from this on.
    Cutoff(f32),
    /// `clearcoat_gloss` of `principled` from a roughness.
    Gloss,
    /// Light, which has no bound.
    Light,
}

impl ScaledChannels {
    fn at(&self, texel: [u8; 4], decode: &[f32; 256], i: usize) -> f32 {
        let share =
            if self.linear || i == 3 { f32::from(texel[i]) / 255.0 } else { decode[usize::from(texel[i])] };
        let value = share * self.scale[i] + self.bias[i];
        match self.then {
            ChannelUse::Share => value,
            ChannelUse::Cutoff(from) => f32::from(u8::from(value >= from)),
            ChannelUse::Gloss => gloss(value),
            ChannelUse::Light => value.max(0.0),
        }
    }
}

impl Change {
    /// Colours times this.
    pub(super) fn times(factor: [f32; 3]) -> Self {
        if factor == [1.0; 3] { Self::None } else { Self::Times(factor) }
    }
}

/// A picture after a change: its ending and its bytes.
pub(super) fn changed(picture: &RgbaImage, change: Change) -> image::ImageResult<(&'static str, Vec<u8>)> {
    let size = [picture.width(), picture.height()];
    let decode: [f32; 256] = std::array::from_fn(|v| srgb::decode(v as f32 / 255.0));
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let grey = |value: &dyn Fn([u8; 4]) -> f32| {
        let texel = |x, y| image::Luma([byte(value(picture.get_pixel(x, y).0))]);
        DynamicImage::from(GrayImage::from_fn(size[0], size[1], texel))
    };
    let rgb = |value: &dyn Fn([u8; 4]) -> [f32; 3]| {
        let texel = |x, y| image::Rgb(value(picture.get_pixel(x, y).0).map(byte));
        DynamicImage::from(RgbImage::from_fn(size[0], size[1], texel))
    };
    let made = match change {
        Change::None => DynamicImage::from(picture.clone()),
        Change::Times(factor) => {
            let encoded: [[u8; 256]; 3] =
                factor.map(|f| std::array::from_fn(|v| byte(srgb::encode(decode[v] * f))));
            let texel = |[r, g, b, _]: [u8; 4]| {
                let bytes =
                    [encoded[0][usize::from(r)], encoded[1][usize::from(g)], encoded[2][usize::from(b)]];
                bytes.map(|v| f32::from(v) / 255.0)
            };
            rgb(&texel)
        }
        Change::Channel { channel, factor } => grey(&|texel| f32::from(texel[channel]) / 255.0 * factor),
        Change::Rough(factor) => grey(&|[.., a]| 1.0 - f32::from(a) / 255.0 * factor),
        Change::Gloss(factor) => grey(&|[_, g, ..]| gloss(f32::from(g) / 255.0 * factor)),
        Change::Between { channel, range: [least, most] } => {
            let mut out = format!("Pf\n{} {}\n-1.0\n", size[0], size[1]).into_bytes();
            for row in picture.rows().rev() {
                let number =
                    |texel: &image::Rgba<u8>| least + f32::from(texel.0[channel]) / 255.0 * (most - least);
                out.extend(row.flat_map(|texel| number(texel).to_le_bytes()));
            }
            return Ok(("pfm", out));
        }
        Change::Alpha { factor, cutoff } => grey(&|[.., a]| {
            let alpha = f32::from(a) / 255.0 * factor;
            cutoff.map_or(alpha, |cutoff| if alpha < cutoff { 0.0 } else { 1.0 })
        }),
        Change::Bend(scale) => rgb(&|[x, y, z, _]| {
            let [x, y, z] = [x, y, z].map(|v| f32::from(v) / 127.5 - 1.0);
            let bent = glam::Vec3::new(x * scale, y * scale, z).normalize_or(glam::Vec3::Z);
            (bent * 0.5 + 0.5).to_array()
        }),
        Change::Scaled(channels) => {
            let at = |texel, i| channels.at(texel, &decode, i);
            match (channels.channel, channels.then) {
                (only, ChannelUse::Light) => {
                    let texel = |texel| std::array::from_fn(|i| at(texel, only.unwrap_or(i)));
                    return Ok(("pfm", pfm(picture, &texel)));
                }
                (Some(i), _) => grey(&|texel| at(texel, i)),
                (None, _) => rgb(&|texel| {
                    let encode = |v: f32| if channels.linear { v } else { srgb::encode(v.clamp(0.0, 1.0)) };
                    [0, 1, 2].map(|i| encode(at(texel, i)))
                }),
            }
        }
        Change::Light(factor) => {
            let texel = |texel: [u8; 4]| std::array::from_fn(|i| decode[usize::from(texel[i])] * factor[i]);
            return Ok(("pfm", pfm(picture, &texel)));
        }
    };
    Ok(("png", encoded(&made)?))
}

/// A picture of light.
fn pfm(picture: &RgbaImage, value: &dyn Fn([u8; 4]) -> [f32; 3]) -> Vec<u8> {
    let mut out = format!("PF\n{} {}\n-1.0\n", picture.width(), picture.height()).into_bytes();
    // From the lowest row.
    for texel in picture.rows().rev().flatten() {
        out.extend(value(texel.0).iter().flat_map(|v| v.to_le_bytes()));
    }
    out
}

/// Keeps a picture that was made of several; returns its name.
pub(super) fn made(picture: DynamicImage, name: &str, text: &mut SceneText<'_>) -> Result<String, String> {
    Ok(text.file(&format!("{name}.png"), encoded(&picture).map_err(|e| e.to_string())?))
}

fn encoded(picture: &DynamicImage) -> image::ImageResult<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
