//! Dispersion of solid glass of glTF, a material with `KHR_materials_transmission` and `KHR_materials_volume`.

use super::extensions::index_of_refraction;
use super::json::{extension, number};
use super::material_reader::MaterialReader;
use crate::scene::model::surface::{MaterialValue, SurfaceModel};

/// A glass of this index is none: it is never closer to 1.
const LEAST_ETA: f32 = 1.001;

/// α below which facets are smooth, as those of `principled` are at least.
const SMOOTH: f32 = 1e-3;

/// Glass whose index depends on the wavelength (`KHR_materials_dispersion`: 20 over the Abbe number). `principled` has one index, so that
/// this is a `dielectric`. None where there is no dispersion, or where the material is more than glass of one colour: this is told.
pub(super) fn dispersive(
    reader: &mut MaterialReader<'_, '_, '_>,
    color: &MaterialValue,
    roughness: &MaterialValue,
    [metallic, through]: [&MaterialValue; 2],
) -> Option<SurfaceModel> {
    let dispersion = number(extension(reader.material, "KHR_materials_dispersion"), "dispersion", 0.0);
    if dispersion <= 0.0 {
        return None;
    }
    let is = |value: &MaterialValue, wanted: f32| matches!(value, MaterialValue::Number(v) if *v == wanted);
    let (MaterialValue::Rgb(rgb), MaterialValue::Number(roughness)) = (color, roughness) else {
        reader.tell("`KHR_materials_dispersion` is not used where colour or roughness vary");
        return None;
    };
    if !is(metallic, 0.0) || !is(through, 1.0) {
        reader.tell("`KHR_materials_dispersion` is used for what is nothing but glass");
        return None;
    }
    let used = [
        "KHR_materials_transmission",
        "KHR_materials_volume",
        "KHR_materials_volume_scatter",
        "KHR_materials_ior",
    ];
    reader.tell_extensions("KHR_materials_dispersion", &used);
    let abbe = 20.0 / dispersion;
    if abbe < 1.0 {
        reader.tell("a `dispersion` above 20 counts as 20");
    }
    let eta = index_of_refraction(reader, true).max(LEAST_ETA);
    let mut parameters = vec![
        ("int_ior", MaterialValue::Number(eta)),
        ("int_abbe", MaterialValue::Number(abbe.clamp(1.0, 1e6))),
        ("ext_ior", MaterialValue::Number(1.0)),
        // Light passes two surfaces.
        ("specular_transmittance", MaterialValue::Rgb(rgb.map(f32::sqrt))),
    ];
    let alpha = roughness * roughness;
    let kind = if alpha <= SMOOTH { "dielectric" } else { "roughdielectric" };
    if kind == "roughdielectric" {
        parameters.push(("alpha", MaterialValue::Number(alpha)));
    }
    Some(SurfaceModel { kind, parameters, transmits: true })
}
