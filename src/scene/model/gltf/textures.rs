//! Textures of materials: pictures with their samplers and transforms.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use serde_json::Value;

use super::json::{extension, index, number, numbers};
use crate::scene::model::surface::MaterialBitmap;
use crate::scene::model::text::SceneText;

/// Codes of samplers.
pub(super) const NEAREST: u64 = 9728;
pub(super) const LINEAR: u64 = 9729;
pub(super) const REPEAT: u64 = 10_497;
pub(super) const CLAMP: u64 = 33_071;
pub(super) const MIRROR: u64 = 33_648;

/// A texture as a material refers to it.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct TextureUse {
    /// Its index.
    pub(super) texture: usize,
    /// The set of texture coordinates.
    pub(super) set: usize,
    /// None for a transform that has no inverse.
    pub(super) to_uv: Option<DAffine3>,
}

impl TextureUse {
    /// The texture of a `textureInfo`, if there is one.
    pub(super) fn of(info: &Value) -> Option<Self> {
        let transform = extension(info, "KHR_texture_transform");
        let set = index(transform, "texCoord").or_else(|| index(info, "texCoord")).unwrap_or(0);
        Some(Self { texture: index(info, "index")?, set, to_uv: to_uv(transform) })
    }

    /// The bitmap of this texture by the picture in `file`.
    pub(super) fn bitmap(
        &self,
        root: &Value,
        file: String,
        raw: bool,
        text: &mut SceneText<'_>,
    ) -> MaterialBitmap {
        let texture = &root["textures"][self.texture];
        let place = format!("textures[{}]", self.texture);
        let sampler = index(texture, "sampler").map_or(&Value::Null, |i| &root["samplers"][i]);
        let [s, t] = ["wrapS", "wrapT"].map(|name| sampler[name].as_u64().unwrap_or(REPEAT));
        if s != t {
            text.tell(
                "pictures are continued in both directions as `wrapS` says: `wrapT` is not used",
                &place,
            );
        }
        if self.to_uv.is_none() {
            let message = "a `KHR_texture_transform` that is scaled to nothing, or by no number, is not used";
            text.tell(message, &place);
        }
        let wrap = match s {
            MIRROR => "mirror",
            CLAMP => "clamp",
            _ => "repeat",
        };
        let nearest = sampler["magFilter"].as_u64() == Some(NEAREST);
        MaterialBitmap { file, raw, nearest, wrap, to_uv: self.to_uv.unwrap_or(DAffine3::IDENTITY) }
    }
}

/// `KHR_texture_transform`: scale, then turn, then move. A turn is against the clock as the picture is seen, with v downwards.
fn to_uv(transform: &Value) -> Option<DAffine3> {
    let (sin, cos) = f64::from(number(transform, "rotation", 0.0)).sin_cos();
    let [scale, offset] = [("scale", [1.0; 2]), ("offset", [0.0; 2])]
        .map(|(name, default)| DVec2::from(numbers(transform, name, default).map(f64::from)));
    let columns = [DVec3::new(cos, -sin, 0.0) * scale.x, DVec3::new(sin, cos, 0.0) * scale.y, DVec3::Z];
    let to_uv = DAffine3::from_mat3_translation(
        DMat3::from_cols(columns[0], columns[1], columns[2]),
        offset.extend(0.0),
    );
    Some(to_uv).filter(|to_uv| to_uv.is_finite() && to_uv.matrix3.determinant().is_normal())
}
