//! Pictures of glTF as materials need them.

use std::collections::BTreeMap;
use std::path::Path;

use image::RgbaImage;
use serde_json::Value;

use super::buffers::{Buffers, ImageSource};
use super::json::{extension, index};
use crate::image::bitmap;
use crate::scene::limits;
use crate::scene::mitsuba::shorten;
use crate::scene::model::picture_changes::{Change, changed};
use crate::scene::model::text::SceneText;

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
