//! A material of glTF that is being written: what its parts, each in its own file, read it by.

use image::RgbaImage;
use serde_json::Value;

use super::buffers::Buffers;
use super::pictures::MaterialPictures;
use super::textures::TextureUse;
use crate::scene::model::picture_changes::Change;
use crate::scene::model::surface::{MaterialBitmap, MaterialValue};
use crate::scene::model::text::SceneText;

/// How the vertex colours of a primitive change its material.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct VertexColors {
    pub(super) rgb: bool,
    pub(super) opacity: bool,
}

/// A material that is being written, with all that this needs.
pub(super) struct MaterialReader<'r, 'a, 't> {
    pub(super) root: &'r Value,
    pub(super) material: &'r Value,
    pub(super) index: Option<usize>,
    pub(super) colors: VertexColors,
    pub(super) text: &'a mut SceneText<'t>,
    pub(super) buffers: &'a mut Buffers<'r>,
    pub(super) pictures: &'a mut MaterialPictures,
}

impl MaterialReader<'_, '_, '_> {
    /// Tells what is not used of this material.
    pub(super) fn tell(&mut self, message: &str) {
        let place = self.index.map_or("the default material".to_owned(), |i| format!("materials[{i}]"));
        self.text.tell(message, &place);
    }

    /// A name of its own for files.
    pub(super) fn name(&self) -> String {
        format!("material-{}", self.index.unwrap_or_default())
    }

    /// The bitmap of a texture after a change; none where there is no texture.
    pub(super) fn bitmap(
        &mut self,
        info: &Value,
        change: Change,
        raw: bool,
    ) -> Result<Option<MaterialBitmap>, String> {
        let Some(texture) = TextureUse::of(info) else { return Ok(None) };
        let file = self.pictures.of(self.root, texture.texture, (change, raw), self.text, self.buffers)?;
        Ok(Some(texture.bitmap(self.root, file, raw, self.text)))
    }

    /// The texels of a texture.
    pub(super) fn decoded(&mut self, texture: &TextureUse) -> Result<RgbaImage, String> {
        self.pictures.decoded(self.root, texture.texture, self.buffers)
    }

    /// A number: a factor, times a channel of a texture if there is one.
    pub(super) fn channel(
        &mut self,
        info: &Value,
        channel: usize,
        factor: f32,
    ) -> Result<MaterialValue, String> {
        let change = Change::Channel { channel, factor };
        let bitmap = if factor > 0.0 { self.bitmap(info, change, true)? } else { None };
        Ok(bitmap.map_or(MaterialValue::Number(factor), MaterialValue::Texture))
    }

    /// Tells of the extensions of the material that have no part beside this `kind` of it, other than those `used`.
    pub(super) fn tell_extensions(&mut self, kind: &str, used: &[&str]) {
        let names = self.material["extensions"].as_object().into_iter().flat_map(|all| all.keys());
        let unused = |name: &&String| {
            let name = name.as_str();
            name.starts_with("KHR_materials_")
                && name != kind
                && name != "KHR_materials_emissive_strength"
                && !used.contains(&name)
        };
        let unused: Vec<String> = names.filter(unused).cloned().collect();
        for name in unused {
            self.tell(&format!("`{name}` is not used beside `{kind}`"));
        }
    }
}
