//! Pictures as materials need them: as they are, one channel, or a multiple.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, GrayImage, ImageFormat, RgbImage, RgbaImage};
use serde_json::Value;

use super::buffers::{Buffers, ImageSource};
use super::extensions::gloss;
use super::json::{extension, index};
use crate::color::srgb;
use crate::image::bitmap;
use crate::image::ktx2::{self, is_ktx2};
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
    /// Why images that another one stands in for cannot be read; none of those that can.
    checked: BTreeMap<usize, Option<String>>,
    /// Textures whose other image is used.
    replaced: BTreeSet<usize>,
    /// Whether images are KTX2 files that say that they are linear.
    linear: BTreeMap<usize, bool>,
    texels: usize,
}

/// The images of a texture: that of an extension counts, the other stands in for it.
fn sources(root: &Value, texture: usize) -> Result<(usize, Option<usize>), String> {
    let object = &root["textures"][texture];
    let mut named: Vec<usize> = ["KHR_texture_basisu", "EXT_texture_webp"]
        .iter()
        .filter_map(|name| index(extension(object, name), "source"))
        .chain(index(object, "source"))
        .collect();
    if !named.is_empty() {
        let first = named.remove(0);
        return Ok((first, named.pop()));
    }
    let others: Vec<String> =
        object["extensions"].as_object().into_iter().flatten().map(|(name, _)| shorten(name)).collect();
    Err(match others.as_slice() {
        [] => format!("textures[{texture}] has no picture"),
        others => format!(
            "textures[{texture}] has no picture but that of {}, which is not supported: export it as PNG, JPEG, WebP or KTX2",
            others.join(", ")
        ),
    })
}

/// The texels of an image.
fn texels(index: usize, bytes: &[u8]) -> Result<RgbaImage, String> {
    let picture = bitmap::picture(Path::new(""), bytes, limits::IMAGE_PIXELS);
    Ok(picture.map_err(|e| format!("images[{index}] cannot be read: {e}"))?.into_rgba8())
}

impl MaterialPictures {
    /// The image of a texture. A file that is not there, or KTX2 that cannot be read, gives way to what stands in for it.
    fn source(&mut self, root: &Value, texture: usize, buffers: &mut Buffers<'_>) -> Result<usize, String> {
        let (first, other) = sources(root, texture)?;
        let Some(other) = other else { return Ok(first) };
        if !self.checked.contains_key(&first) {
            let fault = match buffers.image_bytes(first) {
                Ok(bytes) if is_ktx2(&bytes) => {
                    self.spend(ktx2::pixels(&bytes).min(limits::IMAGE_PIXELS))?;
                    texels(first, &bytes).err()
                }
                Ok(_) => None,
                Err(message) => Some(message),
            };
            self.checked.insert(first, fault);
        }
        let Some(Some(message)) = self.checked.get(&first) else { return Ok(first) };
        if self.replaced.insert(texture) {
            let message = format!("the picture that stands in for another is used, since {message}");
            buffers.remarks.push((message, format!("textures[{texture}]")));
        }
        Ok(other)
    }

    /// Whether an image is a KTX2 file that says that it is linear.
    fn is_linear(&mut self, index: usize, buffers: &mut Buffers<'_>) -> Result<bool, String> {
        if let Some(known) = self.linear.get(&index) {
            return Ok(*known);
        }
        let is_linear = match buffers.image(index)? {
            ImageSource::Bytes(bytes) => ktx2::is_linear(&bytes),
            ImageSource::File(name) if !is_ktx2_name(&name) => false,
            // A file that cannot be read is the error of who asks for its texels.
            ImageSource::File(_) => buffers.image_bytes(index).is_ok_and(|bytes| ktx2::is_linear(&bytes)),
        };
        self.linear.insert(index, is_linear);
        Ok(is_linear)
    }

    /// The name of the file of a texture's image. `raw`: its numbers are no colours.
    pub(super) fn of(
        &mut self,
        root: &Value,
        texture: usize,
        (change, raw): (Change, bool),
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'_>,
    ) -> Result<String, String> {
        let index = self.source(root, texture, buffers)?;
        // A KTX2 file says whether it is linear, but glTF has colours in sRGB and other numbers not, whatever it says.
        let recoded = !raw && matches!(change, Change::None) && self.is_linear(index, buffers)?;
        let key = (index, format!("{change:?} {recoded}"));
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let number = self.known.len();
        let name = match (change, buffers.image(index)?) {
            (Change::None, ImageSource::File(name)) if !recoded => name,
            (Change::None, ImageSource::Bytes(bytes)) if !recoded => {
                buffers.spend(bytes.len())?;
                let ending = if is_ktx2(&bytes) { "ktx2" } else { "png" };
                text.file(&format!("image-{index}.{ending}"), bytes)
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
        let index = self.source(root, texture, buffers)?;
        let picture = texels(index, &buffers.image_bytes(index)?)?;
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

/// Whether a name is that of a KTX2 file.
fn is_ktx2_name(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ktx2"))
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
