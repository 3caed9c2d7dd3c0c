//! Pictures as materials need them: as they are, one channel, or a multiple.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, GrayImage, ImageFormat, RgbImage, RgbaImage};
use serde_json::Value;

use super::buffers::{Buffers, ImageSource};
use super::extensions::gloss;
use super::json::{extension, index};
use crate::color::srgb;
use crate::image::bitmap;
use crate::scene::limits;
use crate::scene::mitsuba::shorten;
use crate::scene::model::text::SceneText;

/// What is made of a picture.
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
    /// `clearcoat_gloss` of `principled` from green times this, a roughness of glTF.
    Gloss(f32),
    /// One channel as numbers without a bound: from the first of the range, where the picture is black, to the second.
    Between { channel: usize, range: [f32; 2] },
    /// Light: the colours times this, linear, as numbers without a bound.
    Light([f32; 3]),
}

impl Change {
    /// Colours times this.
    pub(super) fn times(factor: [f32; 3]) -> Self {
        if factor == [1.0; 3] { Self::None } else { Self::Times(factor) }
    }
}

/// The pictures that were made, by image and what was made of it.
#[derive(Default)]
pub(super) struct MaterialPictures {
    known: BTreeMap<(usize, String), String>,
    texels: usize,
}

/// The image of a texture.
fn source(root: &Value, texture: usize) -> Result<usize, String> {
    let object = &root["textures"][texture];
    let webp = index(extension(object, "EXT_texture_webp"), "source");
    webp.or_else(|| index(object, "source")).ok_or_else(|| {
        let others: Vec<String> =
            object["extensions"].as_object().into_iter().flat_map(|all| all.keys()).map(|name| shorten(name)).collect();
        match others.as_slice() {
            [] => format!("textures[{texture}] has no picture"),
            others => format!(
                "textures[{texture}] has no picture but that of {}, which is not supported: export it as PNG, JPEG or WebP",
                others.join(", ")
            ),
        }
    })
}

impl MaterialPictures {
    /// The name of the file of a texture's image.
    pub(super) fn of(
        &mut self,
        root: &Value,
        texture: usize,
        change: Change,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'_>,
    ) -> Result<String, String> {
        let index = source(root, texture)?;
        let key = (index, format!("{change:?}"));
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let number = self.known.len();
        let name = match (change, buffers.image(index)?) {
            (Change::None, ImageSource::File(name)) => name,
            (Change::None, ImageSource::Bytes(bytes)) => {
                buffers.spend(bytes.len())?;
                text.file(&format!("image-{index}.png"), bytes)
            }
            _ => {
                let picture = self.decoded(root, texture, buffers)?;
                let (ending, bytes) = changed(&picture, change).map_err(|e| e.to_string())?;
                text.file(&format!("image-{index}-{number}.{ending}"), bytes)
            }
        };
        self.known.insert(key, name.clone());
        Ok(name)
    }

    /// The texels of a texture's image.
    pub(super) fn decoded(
        &mut self,
        root: &Value,
        texture: usize,
        buffers: &mut Buffers<'_>,
    ) -> Result<RgbaImage, String> {
        let index = source(root, texture)?;
        let bytes = buffers.image_bytes(index)?;
        let picture = bitmap::picture(Path::new(""), &bytes, limits::IMAGE_PIXELS)
            .map_err(|e| format!("images[{index}] cannot be read: {e}"))?
            .into_rgba8();
        self.spend((picture.width() * picture.height()) as usize)?;
        Ok(picture)
    }

    /// Takes part of the texels that a model may make.
    pub(super) fn spend(&mut self, texels: usize) -> Result<(), String> {
        self.texels += texels;
        if self.texels > limits::TOTAL_TEXELS {
            return Err(format!("its materials need more than {} texels", limits::TOTAL_TEXELS));
        }
        Ok(())
    }
}

/// A picture after a change: its ending and its bytes.
fn changed(picture: &RgbaImage, change: Change) -> image::ImageResult<(&'static str, Vec<u8>)> {
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
        Change::Light(factor) => {
            let mut out = format!("PF\n{} {}\n-1.0\n", size[0], size[1]).into_bytes();
            // From the lowest row.
            for row in picture.rows().rev() {
                for texel in row {
                    let light = |i: usize| decode[usize::from(texel.0[i])] * factor[i];
                    out.extend((0..3).flat_map(|i| light(i).to_le_bytes()));
                }
            }
            return Ok(("pfm", out));
        }
    };
    Ok(("png", encoded(&made)?))
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
