//! `KHR_materials_pbrSpecularGlossiness` as metallic-roughness: a diffuse colour and the colour of the reflection at normal
//! incidence become a base colour and a share of metal.
//!
//! A weak, grey reflection that is the same everywhere is that of an index of refraction, which is exact. Otherwise each texel is
//! converted as in the examples of the extension (KhronosGroup/glTF, `extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness`):
//! the share of metal is what gives both brightnesses with a reflection of .04 of what is not metal.

use image::RgbaImage;
use serde_json::Value;

use super::json::{share, shares};
use super::material_reader::MaterialReader;
use super::textures::TextureUse;
use crate::color::srgb;
use crate::scene::model::picture_changes::{Change, made};
use crate::scene::model::specular::{DIELECTRIC, STRONGEST, metallic_roughness};
use crate::scene::model::surface::{MaterialValue, index_of};

/// A material as metallic-roughness.
pub(super) struct ConvertedMaterial {
    pub(super) color: MaterialValue,
    pub(super) metallic: MaterialValue,
    pub(super) roughness: MaterialValue,
    pub(super) eta: f32,
}

/// Converts the material of the extension `object`. `tinted`: the factor on its colour is in the vertices.
pub(super) fn converted(
    reader: &mut MaterialReader<'_, '_, '_>,
    object: &Value,
    tinted: bool,
) -> Result<ConvertedMaterial, String> {
    let [r, g, b, _] = shares(object, "diffuseFactor", [1.0; 4]);
    let diffuse = if tinted { [1.0; 3] } else { [r, g, b] };
    let specular = shares(object, "specularFactor", [1.0; 3]);
    let glossiness = share(object, "glossinessFactor", 1.0);
    let textures = ["diffuseTexture", "specularGlossinessTexture"].map(|name| TextureUse::of(&object[name]));
    let rough = reader.bitmap(&object["specularGlossinessTexture"], Change::Rough(glossiness), true)?;
    let roughness = rough.map_or(MaterialValue::Number(1.0 - glossiness), MaterialValue::Texture);
    let [red, green, blue] = specular;
    if textures[1].is_none() && red == green && green == blue && red <= STRONGEST {
        let color = diffuse.map(|v| v * (1.0 - red));
        let bitmap = reader.bitmap(&object["diffuseTexture"], Change::times(color), false)?;
        // Without a reflection roughness would mean the diffuse part alone, which has none in glTF.
        let roughness = if red == 0.0 { MaterialValue::Number(1.0) } else { roughness };
        return Ok(ConvertedMaterial {
            color: bitmap.map_or(MaterialValue::Rgb(color), MaterialValue::Texture),
            metallic: MaterialValue::Number(0.0),
            roughness,
            eta: index_of(red),
        });
    }
    let [first, second] = textures;
    let Some(texture) = first.or(second) else {
        let (color, metallic) = metallic_roughness(diffuse, specular);
        let (color, metallic) = (MaterialValue::Rgb(color), MaterialValue::Number(metallic));
        return Ok(ConvertedMaterial { color, metallic, roughness, eta: index_of(DIELECTRIC) });
    };
    let mut decoded =
        |texture: Option<TextureUse>| texture.map(|texture| reader.decoded(&texture)).transpose();
    let pictures = [decoded(first)?, decoded(second)?];
    let [width, height] = size(&pictures);
    if pictures.iter().flatten().any(|picture| picture.dimensions() != (width, height))
        || second.is_some_and(|second| (second.set, second.to_uv) != (texture.set, texture.to_uv))
    {
        reader.tell("the diffuse and the specular picture of `KHR_materials_pbrSpecularGlossiness` do not lie on each other: the second is laid on the first");
    }
    reader.pictures.spend(2 * (width as usize * height as usize))?;
    let texel = |x: u32, y: u32| {
        let value = |picture: &Option<RgbaImage>, factor: [f32; 3]| {
            let Some(picture) = picture else { return factor };
            let at = |v: u32, most: u32, size: u32| (u64::from(v) * u64::from(most) / u64::from(size)) as u32;
            let texel = picture.get_pixel(at(x, picture.width(), width), at(y, picture.height(), height)).0;
            std::array::from_fn(|i| srgb::decode(f32::from(texel[i]) / 255.0) * factor[i])
        };
        metallic_roughness(value(&pictures[0], diffuse), value(&pictures[1], specular))
    };
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let colors = image::RgbImage::from_fn(width, height, |x, y| {
        image::Rgb(texel(x, y).0.map(|v| byte(srgb::encode(v))))
    });
    let metals = image::GrayImage::from_fn(width, height, |x, y| image::Luma([byte(texel(x, y).1)]));
    let color = made(colors.into(), &format!("{}-base", reader.name()), reader.text)?;
    let metallic = made(metals.into(), &format!("{}-metallic", reader.name()), reader.text)?;
    Ok(ConvertedMaterial {
        color: MaterialValue::Texture(texture.bitmap(reader.root, color, false, reader.text)),
        metallic: MaterialValue::Texture(texture.bitmap(reader.root, metallic, true, reader.text)),
        roughness,
        eta: index_of(DIELECTRIC),
    })
}

/// The size of the larger picture.
fn size(pictures: &[Option<RgbaImage>; 2]) -> [u32; 2] {
    let sizes = pictures.iter().flatten().map(|picture| [picture.width(), picture.height()]);
    sizes.max_by_key(|[width, height]| u64::from(*width) * u64::from(*height)).unwrap_or([1, 1])
}
