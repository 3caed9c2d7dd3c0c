//! Extensions of materials as parameters of `principled` and `principledthin` (Burley 2012, 2015).
//!
//! | glTF | here |
//! |---|---|
//! | `KHR_materials_clearcoat` | `clearcoat`, as strong where it is faced, and on top of all light of its base; `clearcoat_gloss` of the same α |
//! | `KHR_materials_sheen` | `sheen`, the luminance of its colour |
//! | `KHR_materials_specular` | the index of refraction whose reflection at normal incidence has that luminance |
//! | `KHR_materials_anisotropy` | `anisotropic` and `roughness` of the same α along and across u |
//! | `KHR_materials_iridescence` | `thin_film_weight`, `thin_film_thickness`, `thin_film_eta` |
//! | `KHR_materials_diffuse_transmission` | `diff_trans` of `principledthin` |
//!
//! A note tells what they do not support.

use serde_json::Value;

use super::json::{extension, number, numbers, share, shares};
use super::material_reader::MaterialReader;
use crate::scene::model::picture_changes::Change;
use crate::scene::model::surface::{MaterialValue, Parameters, gloss, index_of, is_grey, luminance};

/// Index of refraction of a material that gives none.
const ETA: f32 = 1.5;

/// The index of refraction, from that of the material and the strength of its reflection.
pub(super) fn index_of_refraction(reader: &mut MaterialReader<'_, '_, '_>, transmits: bool) -> f32 {
    let material = reader.material;
    let given = number(extension(material, "KHR_materials_ior"), "ior", ETA);
    let eta = if (1.0..10.0).contains(&given) { given } else { ETA };
    if eta != given {
        reader.tell("an index of refraction that is not from 1 to 10 counts as 1.5");
    }
    let specular = extension(material, "KHR_materials_specular");
    let (factor, tint) =
        (share(specular, "specularFactor", 1.0), numbers(specular, "specularColorFactor", [1.0; 3]));
    if factor == 1.0 && tint == [1.0; 3] {
        return eta;
    }
    if transmits {
        reader.tell("`KHR_materials_specular` is not used for what lets light through");
        return eta;
    }
    if !is_grey(tint) {
        reader.tell("`specularColorFactor` of `KHR_materials_specular` counts by its luminance");
    }
    let at_normal = ((eta - 1.0) / (eta + 1.0)).powi(2) * factor * luminance(tint).max(0.0);
    index_of(at_normal.min(1.0))
}

/// A clear coat, where `kind` can have one.
pub(super) fn clearcoat(reader: &mut MaterialReader<'_, '_, '_>, kind: &str) -> Result<Parameters, String> {
    let coat = extension(reader.material, "KHR_materials_clearcoat");
    let factor = share(coat, "clearcoatFactor", 0.0);
    if factor == 0.0 {
        return Ok(Vec::new());
    }
    if kind != "principled" {
        reader.tell("`KHR_materials_clearcoat` is not used for what is thin");
        return Ok(Vec::new());
    }
    reader.tell("`KHR_materials_clearcoat` is the coat of `principled`, which takes no light from its base");
    let roughness = share(coat, "clearcoatRoughnessFactor", 0.0);
    if roughness * roughness > 0.1 {
        reader.tell("`clearcoatRoughnessFactor` above .316 counts as .316");
    }
    let gloss = match reader.bitmap(&coat["clearcoatRoughnessTexture"], Change::Gloss(roughness), true)? {
        Some(bitmap) => MaterialValue::Texture(bitmap),
        None => MaterialValue::Number(gloss(roughness)),
    };
    let strength = reader.channel(&coat["clearcoatTexture"], 0, factor)?;
    Ok(vec![("clearcoat", strength), ("clearcoat_gloss", gloss)])
}

/// Sheen.
pub(super) fn sheen(reader: &mut MaterialReader<'_, '_, '_>) -> Result<Parameters, String> {
    let sheen = extension(reader.material, "KHR_materials_sheen");
    let color = shares(sheen, "sheenColorFactor", [0.0; 3]);
    if color == [0.0; 3] {
        return Ok(Vec::new());
    }
    let bitmap = reader.bitmap(&sheen["sheenColorTexture"], Change::times(color), false)?;
    if !is_grey(color) || bitmap.is_some() {
        reader.tell("the colour of `KHR_materials_sheen` counts by its luminance");
    }
    let value = bitmap.map_or(MaterialValue::Number(luminance(color)), MaterialValue::Texture);
    Ok(vec![("sheen", value)])
}

/// A thin film, where `kind` can have one: from the least thickness to the greatest by a texture, the greatest without one.
pub(super) fn iridescence(reader: &mut MaterialReader<'_, '_, '_>, kind: &str) -> Result<Parameters, String> {
    let film = extension(reader.material, "KHR_materials_iridescence");
    let factor = share(film, "iridescenceFactor", 0.0);
    if factor == 0.0 {
        return Ok(Vec::new());
    }
    if kind != "principled" {
        reader.tell("`KHR_materials_iridescence` is not used for what is thin");
        return Ok(Vec::new());
    }
    let mut bounded = |name: &str, default: f32, [least, most]: [f32; 2]| {
        let given = number(film, name, default);
        if !(least..=most).contains(&given) {
            reader.tell(&format!("`{name}` is from {least} to {most}: it counts as the nearer of them"));
        }
        given.clamp(least, most)
    };
    let eta = bounded("iridescenceIor", 1.3, [1.0, 10.0]);
    let thinnest = bounded("iridescenceThicknessMinimum", 100.0, [0.0, 1e5]);
    let thickest = bounded("iridescenceThicknessMaximum", 400.0, [0.0, 1e5]);
    let between = Change::Between { channel: 1, range: [thinnest, thickest] };
    let thickness = reader.bitmap(&film["iridescenceThicknessTexture"], between, true)?;
    Ok(vec![
        ("thin_film_weight", reader.channel(&film["iridescenceTexture"], 0, factor)?),
        ("thin_film_thickness", thickness.map_or(MaterialValue::Number(thickest), MaterialValue::Texture)),
        ("thin_film_eta", MaterialValue::Number(eta)),
    ])
}

/// Stretched highlights: `roughness` as it is to be, and `anisotropic`. glTF has α along u between the material's and 1 by the
/// square of the strength; `principled` has α / a and α · a with a² = 1 − .9 `anisotropic`.
pub(super) fn anisotropy(
    reader: &mut MaterialReader<'_, '_, '_>,
    roughness: MaterialValue,
) -> (MaterialValue, Option<f32>) {
    let extension = extension(reader.material, "KHR_materials_anisotropy");
    let strength = share(extension, "anisotropyStrength", 0.0);
    if strength == 0.0 {
        return (roughness, None);
    }
    // A turn by half a circle changes nothing.
    if number(extension, "anisotropyRotation", 0.0).sin().abs() > 1e-3 {
        reader.tell("`KHR_materials_anisotropy` is not used where `anisotropyRotation` turns it");
        return (roughness, None);
    }
    let MaterialValue::Number(isotropic) = roughness else {
        reader.tell("`KHR_materials_anisotropy` is not used where a texture has the roughness");
        return (roughness, None);
    };
    let across = (isotropic * isotropic).max(1e-3);
    let along = across + (1.0 - across) * strength * strength;
    let anisotropic = (1.0 - across / along) / 0.9;
    if anisotropic > 1.0 {
        reader.tell("`anisotropyStrength` counts as one that stretches highlights tenfold");
    }
    let anisotropic = anisotropic.min(1.0);
    // Where the ratio is cut the area of the highlight stays.
    (MaterialValue::Number((along * across).sqrt().sqrt()), Some(anisotropic))
}

/// Light that a thin material lets through in all directions: `diff_trans`, which is 2 where nothing is reflected.
pub(super) fn diffuse_transmission(
    reader: &mut MaterialReader<'_, '_, '_>,
    base: &Value,
) -> Result<Option<MaterialValue>, String> {
    let extension = extension(reader.material, "KHR_materials_diffuse_transmission");
    let factor = share(extension, "diffuseTransmissionFactor", 0.0);
    if factor == 0.0 {
        return Ok(None);
    }
    reader
        .tell("`KHR_materials_diffuse_transmission` is `principledthin`, which has no reflection beside it");
    let [r, g, b, _] = shares(base, "baseColorFactor", [1.0; 4]);
    let color = shares(extension, "diffuseTransmissionColorFactor", [1.0; 3]);
    let textures = [&extension["diffuseTransmissionColorTexture"], &base["baseColorTexture"]];
    if color != [r, g, b] || textures.iter().any(|texture| !texture.is_null()) {
        reader.tell("light of `KHR_materials_diffuse_transmission` has the base colour, not its own");
    }
    let between = Change::Between { channel: 3, range: [0.0, 2.0 * factor] };
    let bitmap = reader.bitmap(&extension["diffuseTransmissionTexture"], between, true)?;
    Ok(Some(bitmap.map_or(MaterialValue::Number(2.0 * factor), MaterialValue::Texture)))
}
