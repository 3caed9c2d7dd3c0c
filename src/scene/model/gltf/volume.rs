//! Volumes of glTF materials as media within the meshes: `KHR_materials_volume` attenuates light, `KHR_materials_volume_scatter` scatters it.
//!
//! | glTF | here |
//! |---|---|
//! | `attenuationColor` c after `attenuationDistance` d | `sigma_t` = −ln c / d, wavelength by wavelength |
//! | `multiscatterColorFactor`, in older files `multiscatterColor` | `albedo` by [`single_scattering_albedo`], wavelength by wavelength |
//! | `scatterAnisotropy` | `g` of `hg` |
//! | `thicknessFactor` 0 | no medium: the material is thin |
//!
//! The distance is one of the world: the scale of a node does not change it, unlike the thickness, which rays find by themselves.

use glam::Vec4;
use serde_json::Value;

use super::json::{extension, number, share, shares};
use super::material_reader::MaterialReader;
use crate::scene::desc::single_scattering_albedo;
use crate::scene::model::text::SceneText;
use crate::spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};

/// What is left of light after the attenuation distance, at least: of black, too, there is a logarithm.
const LEAST_TRANSMITTANCE: f32 = 1e-6;

/// Least attenuation distance: what is shorter is as opaque, and its coefficient could not be traced.
const LEAST_DISTANCE: f32 = 1e-10;

/// Largest mean cosine of scattering, as `scatterAnisotropy` is within (−1, 1).
const MOST_ANISOTROPY: f32 = 0.999;

/// Distance of the wavelengths of a coefficient, nm: its spectra are smooth.
const STEP: usize = 5;

/// Whether meshes of a material are bounds of a volume, and not thin sheets.
pub(super) fn is_solid(material: &Value) -> bool {
    number(extension(material, "KHR_materials_volume"), "thicknessFactor", 0.0) > 0.0
}

/// Writes the medium within the meshes of a material, whose bsdf is `bsdf`; returns its id. None where light meets nothing in there.
pub(super) fn interior(reader: &mut MaterialReader<'_, '_, '_>, bsdf: &str) -> Option<String> {
    let material = reader.material;
    let [volume, scatter] =
        ["KHR_materials_volume", "KHR_materials_volume_scatter"].map(|name| extension(material, name));
    let color = shares(volume, "attenuationColor", [1.0; 3]);
    let distance = number(volume, "attenuationDistance", f32::INFINITY);
    if distance <= 0.0 {
        reader.tell("an `attenuationDistance` that is not above 0 attenuates nothing");
    }
    let is_dense = color != [1.0; 3] && distance > 0.0 && distance.is_finite();
    if !(is_dense && is_solid(material) && lets_light_in(material)) {
        if !scatter.is_null() {
            reader.tell(
                "`KHR_materials_volume_scatter` scatters nothing: it needs `KHR_materials_transmission` or \
                 `KHR_materials_diffuse_transmission`, and the `thicknessFactor`, `attenuationColor` and `attenuationDistance` of a \
                 `KHR_materials_volume`",
            );
        } else if is_dense && is_solid(material) {
            reader.tell("`KHR_materials_volume` is not used where its surface lets no light in");
        }
        return None;
    }
    let wanted = number(scatter, "scatterAnisotropy", 0.0);
    let g = wanted.clamp(-MOST_ANISOTROPY, MOST_ANISOTROPY);
    if g != wanted {
        reader.tell("`scatterAnisotropy` lies between -1 and 1: the nearest of -0.999 and 0.999 counts");
    }
    let given = "multiscatterColorFactor";
    let given = if scatter[given].is_null() { "multiscatterColor" } else { given };
    let scattered = shares(scatter, given, [0.0; 3]);
    let distance = distance.max(LEAST_DISTANCE);
    let id = reader.text.id(&format!("{bsdf} interior"));
    reader.text.object("medium", "homogeneous", &[("id", &id)], |text| {
        coefficient(text, "sigma_t", color, |c| -c.clamp(LEAST_TRANSMITTANCE, 1.0).ln() / distance);
        coefficient(text, "albedo", scattered, |a| match scattered {
            [0.0, 0.0, 0.0] => 0.0,
            _ => single_scattering_albedo(a, g),
        });
        if g != 0.0 {
            text.object("phase", "hg", &[], |text| text.value("float", "g", g));
        }
    });
    Some(id)
}

/// Whether light enters what is bounded by this material.
fn lets_light_in(material: &Value) -> bool {
    let is_none = |name: &str| extension(material, name).is_null();
    let passes = |name: &str, factor: &str| share(extension(material, name), factor, 0.0) > 0.0;
    is_none("KHR_materials_unlit")
        && is_none("KHR_materials_pbrSpecularGlossiness")
        && (passes("KHR_materials_transmission", "transmissionFactor")
            || passes("KHR_materials_diffuse_transmission", "diffuseTransmissionFactor"))
}

/// Writes a coefficient that is a function of a reflectance with this colour.
fn coefficient(text: &mut SceneText<'_>, name: &str, color: [f32; 3], of: impl Fn(f32) -> f32) {
    let spectrum = Spectrum::reflectance_rgb(color);
    if let Spectrum::Constant(value) = spectrum {
        return text.value("float", name, of(value));
    }
    let points = (LAMBDA_MIN as u16..=LAMBDA_MAX as u16).step_by(STEP).map(|nm| {
        let value = of(spectrum.eval(Vec4::splat(f32::from(nm))).x);
        format!("{nm}:{value}")
    });
    text.value("spectrum", name, points.collect::<Vec<_>>().join(", "));
}
