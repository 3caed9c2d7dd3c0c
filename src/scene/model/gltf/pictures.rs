//! Pictures of glTF as materials need them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use image::RgbaImage;
use serde_json::Value;

use super::buffers::{Buffers, ImageSource};
use super::json::{extension, index};
use crate::image::bitmap;
use crate::image::ktx2::{self, is_ktx2};
use crate::scene::diagnostic::shorten;
use crate::scene::limits;
use crate::scene::model::picture_changes::{Change, changed};
use crate::scene::model::text::SceneText;

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
